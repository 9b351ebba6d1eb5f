/* Two plugins in one program, each under a context of its own, and the program beside them under none. Prints "fine". */

#define _XOPEN_SOURCE 700

#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "surfrecon.h"

#define MEGA 1000000

static void must(int fine, const char *what)
{
    if (fine) return;
    printf("%s: %s\n", what, srf_last_error_message());
    exit(1);
}

/* A mesh of so many bytes. */
static srf_status make(size_t bytes, srf_mesh **mesh)
{
    const size_t count = bytes / 24;
    float *numbers = calloc(3 * count, sizeof(float));
    srf_array positions;
    srf_status status;
    must(numbers != NULL, "calloc");
    memset(&positions, 0, sizeof positions);
    positions.data = numbers;
    positions.count = count;
    positions.type = SRF_TYPE_F32;
    positions.components = 3;
    *mesh = NULL;
    status = srf_mesh_create(&positions, NULL, mesh);
    free(numbers);
    return status;
}

static size_t held(const srf_context *context)
{
    uint64_t bytes = 0;
    must(srf_context_memory(context, NULL, &bytes) == SRF_OK, "held");
    return (size_t)bytes;
}

/* A bumpy range image, triangulated, merged. */
static srf_mesh *merge(void)
{
    enum { SIDE = 120 };
    static const srf_projection plane = {SRF_PROJECTION_ORTHOGRAPHIC, 0, {0, 0, 0.01, -0.01}};
    double *samples = malloc(SIDE * SIDE * sizeof(double));
    srf_array array;
    srf_image *image;
    srf_merger *merger;
    srf_mesh *mesh;
    int i;
    must(samples != NULL, "malloc");
    for (i = 0; i < SIDE * SIDE; ++i) samples[i] = 0.01 * (double)((i % 17) * (i % 13)) / 100;
    memset(&array, 0, sizeof array);
    array.data = samples;
    array.count = SIDE * SIDE;
    array.type = SRF_TYPE_F64;
    array.components = 1;
    must(srf_image_create(SIDE, SIDE, &plane, &array, NULL, "one", &image) == SRF_OK, "image");
    free(samples);
    must(srf_merger_create(&merger) == SRF_OK && srf_merger_add_image(merger, image) == SRF_OK, "merger");
    must(srf_merger_run(merger, NULL, NULL, &mesh, NULL) == SRF_OK, "merge");
    must(srf_merger_free(merger) == SRF_OK && srf_image_free(image) == SRF_OK, "free");
    return mesh;
}

struct plugin {
    srf_context *context;
    int is_narrow;
    srf_mesh *made;
};

static void *plugin(void *given)
{
    struct plugin *self = given;
    srf_mesh *mesh;
    int i;
    must(srf_context_use(self->context, NULL) == SRF_OK, "use");
    for (i = 0; i < 20; ++i) {
        const srf_status status = make(60 * MEGA, &mesh);
        must(status == (self->is_narrow ? SRF_ERR_OUT_OF_MEMORY : SRF_OK), "limits of a context");
        must(srf_mesh_free(mesh) == SRF_OK, "free");
        must(srf_mesh_free(merge()) == SRF_OK, "merge");
    }
    self->made = merge();
    return NULL;
}

static int told;

static void count(int32_t level, const char *text, void *user)
{
    (void)level;
    (void)text;
    *(int *)user += 1;
}

int main(void)
{
    struct plugin plugins[2];
    pthread_t threads[2];
    srf_context *context;
    srf_mesh *mesh;
    size_t before = 0;
    int i;

    /* The limit of one is nobody else's, nor is that of the process one of theirs. */
    must(srf_set_memory_limit(40 * MEGA) == SRF_OK, "limit");
    for (i = 0; i < 2; ++i) {
        plugins[i].is_narrow = i == 0;
        must(srf_context_create(&plugins[i].context) == SRF_OK, "context");
        must(srf_context_set_threads(plugins[i].context, 2) == SRF_OK, "threads");
        must(srf_context_set_memory_limit(plugins[i].context, (i == 0 ? 50 : 500) * (uint64_t)MEGA) == SRF_OK, "limit");
    }
    for (i = 0; i < 2; ++i) must(pthread_create(&threads[i], NULL, plugin, &plugins[i]) == 0, "thread");
    for (i = 0; i < 20; ++i) {
        must(make(60 * MEGA, &mesh) == SRF_ERR_OUT_OF_MEMORY && strstr(srf_last_error_message(), "memory") != NULL, "limit");
        must(make(20 * MEGA, &mesh) == SRF_OK && srf_mesh_free(mesh) == SRF_OK, "what the others take");
    }
    for (i = 0; i < 2; ++i) must(pthread_join(threads[i], NULL) == 0, "join");
    for (i = 0; i < 2; ++i) {
        /* A result outlives its context. */
        must(held(plugins[i].context) > 100000 && srf_context_free(plugins[i].context) == SRF_OK, "context");
        must(srf_mesh_free(plugins[i].made) == SRF_OK, "free");
    }

    /* One without a limit of its own has that of the process. */
    must(srf_context_create(&context) == SRF_OK && srf_context_use(context, NULL) == SRF_OK, "context");
    must(make(60 * MEGA, &mesh) == SRF_ERR_OUT_OF_MEMORY, "limit of the process");
    must(srf_set_memory_limit(0) == SRF_OK && make(60 * MEGA, &mesh) == SRF_OK && srf_mesh_free(mesh) == SRF_OK, "none");

    /* Nothing is left on its account, whoever frees what was made under it. */
    for (i = 0; i < 300; ++i) {
        if (i == 20) before = held(context);
        must(srf_context_use(context, NULL) == SRF_OK, "use");
        mesh = merge();
        must(srf_context_use(NULL, NULL) == SRF_OK && srf_mesh_free(mesh) == SRF_OK, "free");
    }
    if (held(context) > before + 100000) {
        printf("%lu bytes were held, %lu are now\n", (unsigned long)before, (unsigned long)held(context));
        return 1;
    }

    /* Many, one after the other and at once. */
    for (i = 0; i < 3000; ++i) {
        srf_context *one;
        must(srf_context_create(&one) == SRF_OK && srf_context_free(one) == SRF_OK, "one after the other");
    }
    {
        static srf_context *all[1100];
        int most = 0;
        while (srf_context_create(&all[most]) == SRF_OK) ++most;
        must(most == 1022 && strstr(srf_last_error_message(), "free some") != NULL, "as many as there can be");
        for (i = 0; i < most; ++i) must(srf_context_free(all[i]) == SRF_OK, "free");
    }

    /* The log of the process is that of contexts without one. */
    {
        int own = 0;
        must(srf_set_log(count, &told) == SRF_OK && srf_context_use(context, NULL) == SRF_OK, "log");
        must(srf_mesh_free(merge()) == SRF_OK && told > 0, "told");
        told = 0;
        must(srf_context_set_log(context, count, &own) == SRF_OK, "log");
        must(srf_mesh_free(merge()) == SRF_OK && told == 0 && own > 0, "a log of its own");
        own = 0;
        must(srf_context_use(NULL, NULL) == SRF_OK, "none");
        must(srf_mesh_free(merge()) == SRF_OK && told > 0 && own == 0, "the process's");
    }
    must(srf_context_free(context) == SRF_OK && srf_set_log(NULL, NULL) == SRF_OK, "free");
    printf("fine\n");
    return 0;
}
