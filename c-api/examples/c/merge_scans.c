/*
 * Merges range scans into one surface: merge_scans OUT SCANS...
 * Scans in any format or a list that places them; OUT ends in .glb, .ply, .obj or .stl. How far it is stands on the terminal; Ctrl-C
 * cancels within a tenth of a second and leaves no file, nor harms one that was there. Ends with 0, 1 for an error, 2 for wrong use, 130
 * if cancelled. C99.
 */
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>

#include <surfrecon.h>

enum { WRONG_USE = 2, CANCELLED = 130 };

static srf_cancel *interruption = NULL;

static void interrupt(int signal_number)
{
    srf_cancel_set(interruption);
    /* Some systems forget the handler once it was called: a second Ctrl-C must not end the program halfway. */
    signal(signal_number, interrupt);
}

/* One line that is drawn over. */
static int32_t report(const char *stage, double fraction, const char *message, void *user)
{
    (void)stage;
    (void)fraction;
    (void)user;
    fprintf(stderr, "\r%-78.78s", message);
    return 0;
}

static void tell(int32_t level, const char *text, void *user)
{
    (void)user;
    fprintf(stderr, "\r%-78s\r%s%s\n", "", level == SRF_LOG_LEVEL_WARNING ? "warning: " : "", text);
}

/* How the program ends after a call that failed. */
static int failed(const char *what, srf_status status)
{
    fprintf(stderr, "\r%-78s\r%s: %s\n", "", what, srf_last_error_message());
    return status == SRF_ERR_CANCELLED ? CANCELLED : EXIT_FAILURE;
}

static int merge(const char *out, const char *const *paths, size_t count)
{
    srf_scans *scans = NULL;
    srf_merger *merger = NULL;
    srf_mesh *mesh = NULL;
    srf_merge_report figures;
    const srf_progress progress = {report, NULL, interruption};
    srf_status status;
    int result;

    if ((status = srf_check_mesh_file(out, NULL)) != SRF_OK) {
        result = failed("preparing", status);
    } else if ((status = srf_scans_open(paths, count, NULL, &progress, &scans)) != SRF_OK) {
        result = failed("opening", status);
    } else if ((status = srf_merger_create(&merger)) != SRF_OK || (status = srf_merger_add_scans(merger, scans)) != SRF_OK
               || (status = srf_merge_report_init(&figures)) != SRF_OK) {
        result = failed("preparing", status);
    } else if ((status = srf_merger_run(merger, NULL, &progress, &mesh, &figures)) != SRF_OK) {
        result = failed("merging", status);
    } else if ((status = srf_mesh_write(mesh, out, NULL, &progress)) != SRF_OK) {
        result = failed("writing", status);
    } else {
        fprintf(stderr, "\r%-78s\r", "");
        printf("%u scan%s, %llu triangles in, %llu out, voxel %g, %llu holes closed, %llu left open\n", (unsigned)figures.scans,
               figures.scans == 1 ? "" : "s", (unsigned long long)figures.input_triangles,
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
    srf_status status;
    int result;

    if (argc < 3) {
        fprintf(stderr, "usage: %s OUT SCANS...\n", argv[0]);
        return WRONG_USE;
    }
    if (srf_abi_version() != SRF_ABI_VERSION) {
        fprintf(stderr, "built with another version of the header than the library %s\n", srf_version());
        return EXIT_FAILURE;
    }
    srf_set_log(tell, NULL);
    if ((status = srf_cancel_create(&interruption)) != SRF_OK) {
        return failed("preparing", status);
    }
    signal(SIGINT, interrupt);
    result = merge(argv[1], (const char *const *)(argv + 2), (size_t)(argc - 2));
    /* It may be set after that: nothing has it any more then. */
    srf_cancel_free(interruption);
    return result;
}
