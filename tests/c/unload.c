/* A program that loads the library by its name, twice, and unloads it: unload LIBRARY ITS_COPY */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "surfrecon.h"

enum { N = 40 };

typedef struct {
    void *library;
    srf_status (*create)(size_t, size_t, const srf_projection *, const srf_array *, const srf_pose *, const char *, srf_image **);
    srf_status (*size)(const srf_image *, size_t *, size_t *, size_t *);
    srf_status (*triangulate)(const srf_image *, const srf_triangulate_params *, const srf_progress *, srf_mesh **);
    srf_status (*free_image)(srf_image *);
    srf_status (*free_mesh)(srf_mesh *);
    const char *(*message)(void);
} library;

static void must(int holds, const char *what)
{
    if (!holds) {
        fprintf(stderr, "%s\n", what);
        exit(1);
    }
}

static void *function(void *from, const char *name)
{
    void *found = dlsym(from, name);
    must(found != NULL, name);
    return found;
}

static library load(const char *path)
{
    library it;
    it.library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    must(it.library != NULL, path);
    *(void **)&it.create = function(it.library, "srf_image_create");
    *(void **)&it.size = function(it.library, "srf_image_size");
    *(void **)&it.triangulate = function(it.library, "srf_image_triangulate");
    *(void **)&it.free_image = function(it.library, "srf_image_free");
    *(void **)&it.free_mesh = function(it.library, "srf_mesh_free");
    *(void **)&it.message = function(it.library, "srf_last_error_message");
    return it;
}

static int32_t go_on(const char *stage, double fraction, const char *message, void *user)
{
    (void)stage, (void)fraction, (void)message, (void)user;
    return 0;
}

static srf_image *image_of(const library *with)
{
    static double heights[N * N];
    const srf_projection plane = {SRF_PROJECTION_ORTHOGRAPHIC, 0, {0, 0, 1, 1}};
    const srf_array samples = {heights, N * N, 0, SRF_TYPE_F64, 1};
    srf_image *image = NULL;

    must(with->create(N, N, &plane, &samples, NULL, "plane", &image) == SRF_OK, "image");
    return image;
}

/* Watched work runs on a thread of the library, which waits for more afterwards. */
static void work(const library *with)
{
    const srf_progress progress = {go_on, NULL, NULL};
    srf_image *image = image_of(with);
    srf_mesh *mesh = NULL;

    must(with->triangulate(image, NULL, &progress, &mesh) == SRF_OK, with->message());
    must(with->free_mesh(mesh) == SRF_OK && with->free_image(image) == SRF_OK, "free");
}

int main(int count, char **arguments)
{
    library first, second;
    srf_image *images[2];
    size_t rows;
    int turn;

    must(count == 3, "unload LIBRARY ITS_COPY");
    first = load(arguments[1]);
    must(dlclose(first.library) == 0 && dlopen(arguments[1], RTLD_NOW | RTLD_NOLOAD) != NULL, "it stays once it was loaded");
    for (turn = 0; turn < 3; ++turn) {
        first = load(arguments[1]);
        work(&first);
        must(dlclose(first.library) == 0, "closed");
        /* Long enough for the thread to wake without its code. */
        usleep(100000);
    }
    first = load(arguments[1]), second = load(arguments[2]);
    must(first.create != second.create, "two copies");
    images[0] = image_of(&first), images[1] = image_of(&second);
    must(first.size(images[1], &rows, NULL, NULL) == SRF_ERR_HANDLE, "a handle of the other copy");
    must(strstr(first.message(), "is not a handle of this library") != NULL, first.message());
    must(second.size(images[0], &rows, NULL, NULL) == SRF_ERR_HANDLE, "a handle of the other copy");
    must(first.free_image(images[1]) == SRF_ERR_HANDLE && second.free_image(images[1]) == SRF_OK, "freed by its own");
    must(first.free_image(images[0]) == SRF_OK, "freed by its own");
    puts("fine");
    return 0;
}
