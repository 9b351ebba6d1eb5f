/*
 * Finds the poses of scans that have none, or rough ones: align_scans [--rough] SCANS...
 * The first scan stays where it is; a line a scan says where it went or why it has no place. A progress bar while it works;
 * Ctrl-C cancels. C99.
 */
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

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

static int fail(const char *what)
{
    fprintf(stderr, "\n%s: %s\n", what, srf_last_error_message());
    return EXIT_FAILURE;
}

/* A line about one scan. */
static int print(const srf_scans *scans, const srf_alignment *alignment, size_t index)
{
    srf_aligned_scan found;
    const char *name = NULL, *reason = NULL;

    if (srf_aligned_scan_init(&found) != SRF_OK || srf_alignment_scan(alignment, index, &found) != SRF_OK
        || srf_scans_describe(scans, index, &name, NULL) != SRF_OK
        || srf_alignment_reason(alignment, index, &reason) != SRF_OK) {
        return fail("reporting");
    }
    if (found.state == SRF_SCAN_STATE_PLACED || found.state == SRF_SCAN_STATE_KEPT) {
        const double *at = found.world_from_scan.matrix + 12;
        printf("%s: at %g %g %g, to %.2g\n", name, at[0], at[1], at[2], found.deviation);
    } else {
        printf("%s: not placed: %s\n", name, reason);
    }
    return EXIT_SUCCESS;
}

static int align(const char *const *paths, size_t count, uint64_t start)
{
    srf_scans *scans = NULL;
    srf_aligner *aligner = NULL;
    srf_alignment *alignment = NULL;
    srf_align_params params;
    const srf_progress progress = {report, NULL, NULL};
    size_t listed = 0, i;
    int result = EXIT_FAILURE;

    if (srf_scans_open(paths, count, NULL, NULL, &scans) != SRF_OK || srf_scans_count(scans, &listed, NULL) != SRF_OK) {
        result = fail("opening");
    } else if (srf_align_params_init(&params) != SRF_OK || srf_aligner_create(&aligner) != SRF_OK
               || srf_aligner_add_scans(aligner, scans) != SRF_OK || srf_aligner_fix(aligner, 0) != SRF_OK) {
        result = fail("adding");
    } else {
        params.start = start;
        if (srf_aligner_run(aligner, &params, &progress, &alignment) != SRF_OK) {
            result = fail("aligning");
        } else {
            report("done", 1.0, "", NULL);
            fprintf(stderr, "\n");
            result = EXIT_SUCCESS;
            for (i = 0; i < listed && result == EXIT_SUCCESS; ++i) result = print(scans, alignment, i);
        }
    }
    srf_alignment_free(alignment);
    srf_aligner_free(aligner);
    srf_scans_free(scans);
    return result;
}

int main(int argc, char **argv)
{
    const int rough = argc > 1 && strcmp(argv[1], "--rough") == 0;

    if (argc < 2 + rough) {
        fprintf(stderr, "usage: %s [--rough] SCANS...\n", argv[0]);
        return EXIT_FAILURE;
    }
    signal(SIGINT, interrupt);
    return align((const char *const *)(argv + 1 + rough), (size_t)(argc - 1 - rough),
                 rough ? SRF_START_ROUGH : SRF_START_UNKNOWN);
}
