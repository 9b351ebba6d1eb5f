/* A program that Ctrl-C cancels: the handler of its signal calls srf_cancel_set(), wherever the library is just then. Prints "fine". */

#define _XOPEN_SOURCE 700

#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/time.h>
#include <time.h>

#include "surfrecon.h"

static srf_cancel *cancel;
static volatile sig_atomic_t interrupted;

static void interrupt(int signal)
{
    (void)signal;
    errno = EDOM;
    interrupted = srf_cancel_set(cancel) == SRF_OK && srf_cancel_set(NULL) == SRF_ERR_NULL && errno == EDOM ? 1 : 2;
}

static void must(int fine, const char *what)
{
    if (fine) return;
    printf("%s: %s\n", what, srf_last_error_message());
    exit(1);
}

static double now(void)
{
    struct timespec time;
    clock_gettime(CLOCK_MONOTONIC, &time);
    return (double)time.tv_sec + 1e-9 * (double)time.tv_nsec;
}

static void interrupt_after(long microseconds)
{
    struct itimerval timer;
    memset(&timer, 0, sizeof timer);
    timer.it_value.tv_sec = microseconds / 1000000;
    timer.it_value.tv_usec = microseconds % 1000000;
    must(setitimer(ITIMER_REAL, &timer, NULL) == 0, "timer");
}

int main(void)
{
    const double corners[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
    const uint32_t faces[12] = {0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3};
    const srf_array positions = {corners, 4, 0, SRF_TYPE_F64, 3}, triangles = {faces, 4, 0, SRF_TYPE_U32, 3};
    struct sigaction action;
    srf_progress progress;
    srf_merge_params params;
    srf_mesh *mesh, *merged = NULL;
    srf_merger *merger;
    double began;
    int i;

    memset(&action, 0, sizeof action);
    action.sa_handler = interrupt;
    must(sigaction(SIGALRM, &action, NULL) == 0, "handler");
    memset(&progress, 0, sizeof progress);
    must(srf_cancel_create(&cancel) == SRF_OK, "cancel");
    progress.cancel = cancel;
    must(srf_mesh_create(&positions, &triangles, &mesh) == SRF_OK, "mesh");
    must(srf_merger_create(&merger) == SRF_OK && srf_merger_add_mesh(merger, mesh, NULL, "solid") == SRF_OK, "merger");
    must(srf_merge_params_init(&params) == SRF_OK, "params");

    /* A call that would take many seconds, and of which several at once fit into the memory of any machine that builds this. */
    params.voxel = 0.001;
    began = now();
    interrupt_after(200000);
    must(srf_merger_run(merger, &params, &progress, &merged, NULL) == SRF_ERR_CANCELLED && merged == NULL, "cancelled");
    must(interrupted == 1 && now() - began < 5, "soon");

    /* Short calls, one after the other, interrupted in the midst of their locks and allocations. */
    for (i = 0; i < 300; ++i) {
        srf_mesh *one;
        interrupted = 0;
        must(srf_cancel_reset(cancel) == SRF_OK, "reset");
        interrupt_after(1 + 37 * i % 500);
        while (interrupted == 0) {
            must(srf_mesh_create(&positions, &triangles, &one) == SRF_OK && srf_mesh_free(one) == SRF_OK, "short");
            must(srf_mesh_free(mesh) == SRF_OK && srf_mesh_create(&positions, &triangles, &mesh) == SRF_OK, "again");
        }
        must(interrupted == 1, "interrupted");
    }
    must(srf_cancel_free(cancel) == SRF_OK && srf_merger_free(merger) == SRF_OK && srf_mesh_free(mesh) == SRF_OK, "free");
    must(srf_cancel_set(cancel) == SRF_ERR_HANDLE, "freed");
    printf("fine\n");
    return 0;
}
