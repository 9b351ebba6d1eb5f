/* A program that forks: after a call, and while other threads are in the middle of calls and at the tables of handles. Every
   child goes on with what it has; one that hangs is ended by its alarm, and that is a failure. */
#define _DEFAULT_SOURCE
#include <math.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include "surfrecon.h"

static atomic_int at_an_end;
/* An alignment that a thread runs, whose scans were read. */
static _Atomic(srf_aligner *) running;

static void must(int holds, const char *what)
{
    if (!holds) {
        fprintf(stderr, "%s: %s\n", what, srf_last_error_message());
        _exit(1);
    }
}

static srf_mesh *octahedron(void)
{
    static const double corners[6][3] = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
    static const uint32_t sides[8][3] = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
    const srf_array positions = {corners, 6, 0, SRF_TYPE_F64, 3}, triangles = {sides, 8, 0, SRF_TYPE_U32, 3};
    srf_mesh *mesh = NULL;

    must(srf_mesh_create(&positions, &triangles, &mesh) == SRF_OK, "mesh");
    return mesh;
}

/* Merges a mesh; the number of triangles. */
static size_t merge(const srf_mesh *mesh)
{
    srf_merger *merger = NULL;
    srf_mesh *merged = NULL;
    srf_merge_params params;
    srf_array triangles;

    must(srf_merger_create(&merger) == SRF_OK && srf_merger_add_mesh(merger, mesh, NULL, "octahedron") == SRF_OK, "add");
    must(srf_merge_params_init(&params) == SRF_OK, "init");
    params.voxel = 0.05;
    must(srf_merger_run(merger, &params, NULL, &merged, NULL) == SRF_OK, "merge");
    must(srf_mesh_triangles(merged, &triangles) == SRF_OK, "triangles");
    must(srf_mesh_free(merged) == SRF_OK && srf_merger_free(merger) == SRF_OK, "free");
    return triangles.count;
}

static void *merging(void *mesh)
{
    while (!at_an_end) merge(mesh);
    return NULL;
}

enum { SIDE = 40 };

/* A piece of bumpy ground. */
static srf_mesh *ground(int from)
{
    static double points[SIDE * SIDE][3];
    static uint32_t sides[2 * (SIDE - 1) * (SIDE - 1)][3];
    const srf_array positions = {points, SIDE * SIDE, 0, SRF_TYPE_F64, 3}, triangles = {sides, 2 * (SIDE - 1) * (SIDE - 1), 0, SRF_TYPE_U32, 3};
    srf_mesh *mesh = NULL;
    uint32_t i, n = 0;

    for (i = 0; i < SIDE * SIDE; ++i) {
        const double x = (double)(i % SIDE) + from, y = i / SIDE;
        points[i][0] = x;
        points[i][1] = y;
        points[i][2] = 3 * sin(0.31 * x) * cos(0.23 * y) + 2 * sin(0.17 * x + 0.4 * y) + 0.02 * x * y;
        if (i % SIDE == SIDE - 1 || i / SIDE == SIDE - 1) continue;
        sides[n][0] = sides[n + 1][2] = i;
        sides[n][1] = i + 1;
        sides[n][2] = sides[n + 1][0] = i + SIDE + 1;
        sides[n + 1][1] = i + SIDE;
        n += 2;
    }
    must(srf_mesh_create(&positions, &triangles, &mesh) == SRF_OK, "mesh");
    return mesh;
}

static srf_status align(const srf_aligner *aligner)
{
    srf_alignment *alignment = NULL;
    const srf_status status = srf_aligner_run(aligner, NULL, NULL, &alignment);

    srf_alignment_free(alignment);
    return status;
}

static void *aligning(void *nothing)
{
    srf_mesh *pieces[2] = {ground(0), ground(8)};
    srf_aligner *aligner = NULL, *before = NULL;
    srf_snap_report snap;

    must(srf_snap_report_init(&snap) == SRF_OK, "init");
    while (!at_an_end) {
        must(srf_aligner_create(&aligner) == SRF_OK && srf_aligner_add_mesh(aligner, pieces[0], NULL, "a") == SRF_OK, "add");
        must(srf_aligner_add_mesh(aligner, pieces[1], NULL, "b") == SRF_OK, "add");
        must(srf_aligner_snap(aligner, 0, NULL, 0, NULL, NULL, &snap, NULL) == SRF_OK, "snap");
        running = aligner;
        must(align(aligner) == SRF_OK && srf_aligner_free(before) == SRF_OK, "align");
        before = aligner;
    }
    must(srf_aligner_free(before) == SRF_OK && srf_mesh_free(pieces[0]) == SRF_OK && srf_mesh_free(pieces[1]) == SRF_OK, "free");
    return nothing;
}

static void *at_the_table(void *mesh)
{
    while (!at_an_end) {
        srf_merger *merger = NULL;
        must(srf_merger_create(&merger) == SRF_OK && srf_merger_add_mesh(merger, mesh, NULL, "") == SRF_OK, "add");
        must(srf_set_log(NULL, NULL) == SRF_OK && srf_merger_free(merger) == SRF_OK, "free");
    }
    return NULL;
}

static srf_folder *shared;

/* Reads a byte of a file behind a function, which takes its time. */
static int32_t read_slowly(void *user, uint64_t at, void *buffer, size_t count, size_t *out_count)
{
    (void)at;
    usleep(200);
    memset(buffer, *(char *)user, count);
    *out_count = count;
    return SRF_OK;
}

static void in_folders(int folders)
{
    const char *path = NULL;
    srf_scans *scans = NULL;
    srf_folder *own = NULL;
    int i;

    for (i = 0; i < folders; ++i) {
        must(srf_folder_create(NULL, &own) == SRF_OK && srf_folder_put(own, "a", "x", 1) == SRF_OK, "folder");
        must(srf_folder_free(own) == SRF_OK, "folder");
        must(srf_folder_put(shared, "b", "xy", 2) == SRF_OK && srf_folder_path(shared, "slow.ply", &path) == SRF_OK, "shared");
    }
    must(srf_scans_open(&path, 1, NULL, NULL, &scans) == SRF_ERR_FORMAT, "no ply");
}

static void *at_folders(void *nothing)
{
    while (!at_an_end) in_folders(100);
    return nothing;
}

/* Forks; the child merges, or only asks for a handle, and has twenty seconds for it. */
static void child(const srf_mesh *mesh, size_t expected)
{
    int status = 0;
    const pid_t process = fork();

    must(process >= 0, "fork");
    if (process == 0) {
        alarm(20);
        if (expected) {
            must(merge(mesh) == expected, "the child merges otherwise");
            must(running == NULL || align(running) == SRF_OK, "the parent's alignment");
        } else {
            srf_mesh *own = octahedron();
            srf_array positions;
            must(srf_mesh_positions(mesh, &positions) == SRF_OK && positions.count == 6, "the parent's mesh");
            must(srf_set_log(NULL, NULL) == SRF_OK && srf_mesh_free(own) == SRF_OK, "free");
            in_folders(1);
        }
        _exit(0);
    }
    must(waitpid(process, &status, 0) == process, "wait");
    if (WIFSIGNALED(status)) fprintf(stderr, "a child was ended by signal %d\n", WTERMSIG(status));
    must(WIFEXITED(status) && WEXITSTATUS(status) == 0, "child");
}

int main(void)
{
    srf_mesh *mesh = octahedron();
    const size_t expected = merge(mesh);
    pthread_t threads[5];
    static char filling = '#';
    srf_file_source slow = {300, read_slowly, NULL, &filling};
    int i;

    must(srf_folder_create(NULL, &shared) == SRF_OK && srf_folder_put_source(shared, "slow.ply", &slow) == SRF_OK, "folder");
    child(mesh, expected);
    must(pthread_create(&threads[0], NULL, merging, mesh) == 0, "thread");
    for (i = 1; i < 3; ++i) must(pthread_create(&threads[i], NULL, at_the_table, mesh) == 0, "thread");
    must(pthread_create(&threads[3], NULL, aligning, NULL) == 0, "thread");
    must(pthread_create(&threads[4], NULL, at_folders, NULL) == 0, "thread");
    for (i = 0; i < 1000; ++i) child(mesh, i % 100 == 0 ? expected : 0);
    at_an_end = 1;
    for (i = 0; i < 5; ++i) must(pthread_join(threads[i], NULL) == 0, "join");
    must(srf_folder_free(shared) == SRF_OK, "free");
    must(srf_mesh_free(mesh) == SRF_OK, "free");
    puts("fine");
    return 0;
}
