/*
 * Merges range scans into one surface: merge_scans OUT.glb SCANS...
 * A progress bar while it works; Ctrl-C cancels. C99.
 */
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>

#include <surfrecon.h>

static volatile sig_atomic_t interrupted = 0;

static void interrupt(int signal_number)
{
    (void)signal_number;
    interrupted = 1;
}

/* Draws a bar; a non-zero answer cancels. */
static int32_t report(const char *stage, double fraction, const char *message, void *user)
{
    int done = (int)(40.0 * fraction);
    int i;

    (void)message;
    (void)user;
    fputs("\r[", stderr);
    for (i = 0; i < 40; ++i) fputc(i < done ? '#' : ' ', stderr);
    fprintf(stderr, "] %3.0f %% %-40s", 100.0 * fraction, stage);
    return interrupted;
}

static void tell(int32_t level, const char *text, void *user)
{
    (void)user;
    fprintf(stderr, "%s%s\n", level == SRF_LOG_LEVEL_WARNING ? "warning: " : "", text);
}

static int fail(const char *what)
{
    fprintf(stderr, "\n%s: %s\n", what, srf_last_error_message());
    return EXIT_FAILURE;
}

static int merge(const char *out, const char *const *paths, size_t count)
{
    srf_scans *scans = NULL;
    srf_merger *merger = NULL;
    srf_mesh *mesh = NULL;
    srf_merge_params params;
    srf_merge_report figures;
    const srf_progress progress = {report, NULL};
    int result = EXIT_FAILURE;

    if (srf_scans_open(paths, count, NULL, NULL, &scans) != SRF_OK) {
        result = fail("opening");
    } else if (srf_merge_params_init(&params) != SRF_OK || srf_merge_report_init(&figures) != SRF_OK) {
        result = fail("preparing");
    } else if (srf_merger_create(&merger) != SRF_OK || srf_merger_add_scans(merger, scans) != SRF_OK) {
        result = fail("adding");
    } else if (srf_merger_run(merger, &params, &progress, &mesh, &figures) != SRF_OK) {
        result = fail("merging");
    } else if (srf_mesh_write_glb(mesh, out, "merged scans", 1.0, 0, &progress) != SRF_OK) {
        result = fail("writing");
    } else {
        report("done", 1.0, "", NULL);
        fprintf(stderr, "\n");
        printf("%u scans, %llu triangles in, %llu out, voxel %g, %llu holes closed, %llu left open\n", (unsigned)figures.scans,
               (unsigned long long)figures.input_triangles,
               (unsigned long long)(figures.faces_direct + figures.faces_settled + figures.faces_filling), figures.voxel,
               (unsigned long long)figures.holes_closed, (unsigned long long)figures.holes_open);
        result = EXIT_SUCCESS;
    }
    srf_mesh_free(mesh);
    srf_merger_free(merger);
    srf_scans_free(scans);
    return result;
}

int main(int argc, char **argv)
{
    if (argc < 3) {
        fprintf(stderr, "usage: %s OUT.glb SCANS...\n", argv[0]);
        return EXIT_FAILURE;
    }
    if (srf_abi_version() != SRF_ABI_VERSION) {
        fprintf(stderr, "built with another version of the header than the library %s\n", srf_version());
        return EXIT_FAILURE;
    }
    signal(SIGINT, interrupt);
    srf_set_log(tell, NULL);
    return merge(argv[1], (const char *const *)(argv + 2), (size_t)(argc - 2));
}
