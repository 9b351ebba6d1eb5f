/* A program that runs out of memory: what the limit, or the system, refuses is an error, and the next call goes on. */
#define _DEFAULT_SOURCE
#include <stdio.h>
#include <stdlib.h>
#include <sys/resource.h>

#include "surfrecon.h"

enum { SIDE = 700 };

static void must(int holds, const char *what)
{
    if (!holds) {
        fprintf(stderr, "%s: %s\n", what, srf_last_error_message());
        exit(1);
    }
}

static double positions[SIDE * SIDE][3];
static uint32_t triangles[2 * (SIDE - 1) * (SIDE - 1)][3];
static srf_mesh *mesh;

static srf_status make_mesh(void)
{
    const srf_array at = {positions, SIDE * SIDE, 0, SRF_TYPE_F64, 3};
    const srf_array corners = {triangles, 2 * (SIDE - 1) * (SIDE - 1), 0, SRF_TYPE_U32, 3};
    srf_mesh *made = NULL;
    srf_status status = srf_mesh_create(&at, &corners, &made);

    if (status == SRF_OK) srf_mesh_free(made);
    return status;
}

static srf_status check(void)
{
    srf_check_report report;

    must(srf_check_report_init(&report) == SRF_OK, "init");
    return srf_mesh_check(mesh, 0, NULL, &report);
}

static srf_status check_welded(void)
{
    srf_check_report report;

    must(srf_check_report_init(&report) == SRF_OK, "init");
    return srf_mesh_check(mesh, 1, NULL, &report);
}

static srf_status merge(void)
{
    srf_merger *merger = NULL;
    srf_mesh *merged = NULL;
    srf_merge_params params;
    srf_status status;

    must(srf_merger_create(&merger) == SRF_OK && srf_merger_add_mesh(merger, mesh, NULL, "sheet") == SRF_OK, "add");
    must(srf_merge_params_init(&params) == SRF_OK, "init");
    params.voxel = 1;
    status = srf_merger_run(merger, &params, NULL, &merged, NULL);
    if (status == SRF_OK) srf_mesh_free(merged);
    srf_merger_free(merger);
    return status;
}

int main(void)
{
    static srf_status (*const calls[])(void) = {make_mesh, check, check_welded, merge};
    const srf_array at = {positions, SIDE * SIDE, 0, SRF_TYPE_F64, 3};
    const srf_array corners = {triangles, 2 * (SIDE - 1) * (SIDE - 1), 0, SRF_TYPE_U32, 3};
    struct rlimit all, some;
    size_t row, col, i, megabytes, t = 0, refused = 0;

    for (row = 0; row < SIDE; row++) {
        for (col = 0; col < SIDE; col++) {
            const uint32_t here = (uint32_t)(row * SIDE + col);
            double *place = positions[here];
            place[0] = (double)col;
            place[1] = (double)row;
            place[2] = (double)(row * col % 7) * 0.1;
            if (row + 1 < SIDE && col + 1 < SIDE) {
                uint32_t *first = triangles[t++], *second = triangles[t++];
                first[0] = here, first[1] = here + 1, first[2] = here + SIDE + 1;
                second[0] = here, second[1] = here + SIDE + 1, second[2] = here + SIDE;
            }
        }
    }
    must(srf_mesh_create(&at, &corners, &mesh) == SRF_OK, "mesh");
    for (i = 0; i < sizeof calls / sizeof *calls; i++) {
        must(calls[i]() == SRF_OK, "without a limit");
        must(srf_set_memory_limit(5000000) == SRF_OK, "limit");
        must(calls[i]() == SRF_ERR_OUT_OF_MEMORY, "with a limit");
        must(srf_set_memory_limit(0) == SRF_OK, "no limit");
        must(calls[i]() == SRF_OK, "afterwards");
    }
    /* The same where the system refuses; what it has mapped already it still has. */
    must(getrlimit(RLIMIT_AS, &all) == 0, "limit of the system");
    for (i = 0; i < sizeof calls / sizeof *calls; i++) {
        for (megabytes = 1; megabytes < 1000; megabytes *= 2) {
            srf_status status;
            some = all;
            some.rlim_cur = (rlim_t)megabytes << 20;
            must(setrlimit(RLIMIT_AS, &some) == 0, "set");
            status = calls[i]();
            must(setrlimit(RLIMIT_AS, &all) == 0, "set back");
            must(status == SRF_OK || status == SRF_ERR_OUT_OF_MEMORY, "starved");
            refused += status == SRF_ERR_OUT_OF_MEMORY;
        }
        must(calls[i]() == SRF_OK, "afterwards");
    }
    must(refused > 0, "nothing was refused");
    must(srf_mesh_free(mesh) == SRF_OK, "free");
    puts("fine");
    return 0;
}
