/* A program whose memory the library takes: each block goes back as it was asked for, and what is refused at any call is an error that
   leaves nothing behind. Prints "fine". */

#define _XOPEN_SOURCE 700

#include <pthread.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "surfrecon.h"

static pthread_mutex_t one = PTHREAD_MUTEX_INITIALIZER;
static size_t blocks, bytes, asked;
/* At which call nothing is given, and from then on; 0 for never. */
static size_t refuse_at;
/* Whether nothing is given that is aligned to more than that, on other threads than this. */
static int none_for_workers;
static pthread_t here;
static const char *wrong;

/* The header before each block. */
struct head {
    void *whole;
    size_t size, alignment;
};

static void *allocate(void *user, size_t size, size_t alignment)
{
    char *whole, *block;
    struct head *head;
    int refused;
    pthread_mutex_lock(&one);
    if (user != &blocks || size == 0 || alignment == 0 || (alignment & (alignment - 1)) != 0) wrong = "asked for";
    ++asked;
    refused = (refuse_at != 0 && asked >= refuse_at) || (none_for_workers && alignment > 64 && !pthread_equal(pthread_self(), here));
    pthread_mutex_unlock(&one);
    if (refused) return NULL;
    whole = malloc(size + alignment + sizeof(struct head));
    if (whole == NULL) return NULL;
    block = whole + sizeof(struct head);
    block += (alignment - (uintptr_t)block % alignment) % alignment;
    head = malloc(sizeof *head);
    if (head == NULL) {
        free(whole);
        return NULL;
    }
    head->whole = whole;
    head->size = size;
    head->alignment = alignment;
    memcpy(block - sizeof head, &head, sizeof head);
    memset(block, 0xA5, size);
    pthread_mutex_lock(&one);
    ++blocks;
    bytes += size;
    pthread_mutex_unlock(&one);
    return block;
}

static void deallocate(void *user, void *block, size_t size, size_t alignment)
{
    struct head *head;
    memcpy(&head, (char *)block - sizeof head, sizeof head);
    pthread_mutex_lock(&one);
    if (user != &blocks || head->size != size || head->alignment != alignment) wrong = "given back";
    --blocks;
    bytes -= size;
    pthread_mutex_unlock(&one);
    memset(block, 0x5A, size);
    free(head->whole);
    free(head);
}

static void *reallocate(void *user, void *block, size_t old_size, size_t new_size, size_t alignment)
{
    void *moved = allocate(user, new_size, alignment);
    if (moved == NULL) return NULL;
    memcpy(moved, block, old_size < new_size ? old_size : new_size);
    deallocate(user, block, old_size, alignment);
    return moved;
}

static void must(int fine, const char *what)
{
    if (fine && wrong == NULL) return;
    printf("%s: %s: %s\n", what, wrong == NULL ? "" : wrong, srf_last_error_message());
    exit(1);
}

static srf_status work(void)
{
    enum { SIDE = 60 };
    static const srf_projection plane = {SRF_PROJECTION_ORTHOGRAPHIC, 0, {0, 0, 0.01, -0.01}};
    static double samples[SIDE * SIDE];
    srf_image *image = NULL;
    srf_mesh *mesh = NULL, *merged = NULL;
    srf_merger *merger = NULL;
    srf_merge_params params;
    srf_array array;
    srf_status status;
    int i;
    for (i = 0; i < SIDE * SIDE; ++i) samples[i] = 0.001 * (double)((i % 17) * (i % 13));
    memset(&array, 0, sizeof array);
    array.data = samples;
    array.count = SIDE * SIDE;
    array.type = SRF_TYPE_F64;
    array.components = 1;
    status = srf_merge_params_init(&params);
    params.threads = 2;
    if (status == SRF_OK) status = srf_image_create(SIDE, SIDE, &plane, &array, NULL, "one", &image);
    if (status == SRF_OK) status = srf_image_triangulate(image, NULL, NULL, &mesh);
    if (status == SRF_OK) status = srf_merger_create(&merger);
    if (status == SRF_OK) status = srf_merger_add_image(merger, image);
    if (status == SRF_OK) status = srf_merger_run(merger, &params, NULL, &merged, NULL);
    must(srf_merger_free(merger) == SRF_OK && srf_mesh_free(mesh) == SRF_OK, "free");
    must(srf_mesh_free(merged) == SRF_OK && srf_image_free(image) == SRF_OK, "free");
    return status;
}

int main(int count, char **arguments)
{
    srf_allocator allocator;
    size_t before, calls, k, refused = 0;
    (void)arguments;
    memset(&allocator, 0, sizeof allocator);
    allocator.allocate = allocate;
    allocator.deallocate = deallocate;
    if (count > 1) allocator.reallocate = reallocate;
    allocator.user = &blocks;
    here = pthread_self();
    /* A caller who asks wrongly, and reads why, may ask again. */
    must(srf_last_error_message()[0] == 0 && srf_set_allocator(NULL) == SRF_ERR_NULL, "null");
    must(strstr(srf_last_error_message(), "allocator must not be NULL") != NULL, "null");
    allocator.deallocate = NULL;
    must(srf_set_allocator(&allocator) == SRF_ERR_NULL && strstr(srf_last_error_message(), "deallocate") != NULL, "half");
    allocator.deallocate = deallocate;
    must(srf_abi_version() == SRF_ABI_VERSION && srf_set_allocator(&allocator) == SRF_OK, "set");
    /* Threads that begin find a small block, however it is aligned: they could tell nobody that there is none. */
    none_for_workers = 1;
    must(work() == SRF_OK, "aligned");
    none_for_workers = 0;
    must(work() == SRF_OK && blocks > 0, "work");
    must(srf_set_allocator(&allocator) == SRF_ERR_INPUT && strstr(srf_last_error_message(), "once") != NULL, "twice");
    must(srf_set_memory_limit(20000) == SRF_OK && work() == SRF_ERR_OUT_OF_MEMORY, "limited");
    must(srf_set_memory_limit(0) == SRF_OK && work() == SRF_OK, "unlimited");
    /* Texts of errors, pools and their queues stay. */
    before = bytes;
    asked = 0;
    must(work() == SRF_OK, "counted");
    calls = asked;
    for (k = 1; k < calls; k += 1 + k / 8) {
        srf_status status;
        asked = 0;
        refuse_at = k;
        status = work();
        refuse_at = 0;
        must(status == SRF_OK || status == SRF_ERR_OUT_OF_MEMORY, "refused at a call");
        refused += status != SRF_OK;
        must(work() == SRF_OK, "afterwards");
        must(bytes < before + 65536, "left behind");
    }
    must(refused > 10, "too few were refused");
    printf("fine\n");
    return 0;
}
