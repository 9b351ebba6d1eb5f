/*
 * Says what files of scans hold: list_scans [--camera FX FY CX CY] FILES...
 * Any format, LAS and LAZ, PTX, E57, PLY and the lists that place scans among them; with a camera images are depth
 * images. A percentage while a file is read; Ctrl-C cancels. C99.
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

/* Counts the bytes of the file; a non-zero answer cancels. */
static int32_t report(const char *stage, double fraction, const char *message, void *user)
{
    (void)stage;
    (void)user;
    fprintf(stderr, "\r%-40s", fraction < 1.0 ? message : "");
    return interrupted;
}

static int fail(const char *what)
{
    fprintf(stderr, "\n%s: %s\n", what, srf_last_error_message());
    return EXIT_FAILURE;
}

/* Reads one scan and prints a line about it. */
static int list(const srf_scans *scans, size_t index)
{
    const srf_progress progress = {report, NULL, NULL};
    const char *name = NULL;
    srf_pose pose;
    uint32_t content = 0;
    srf_image *image = NULL;
    srf_mesh *mesh = NULL;
    srf_cloud *cloud = NULL;
    srf_array vertices, triangles;
    size_t rows = 0, cols = 0, valid = 0;
    int result = EXIT_SUCCESS;

    if (srf_scans_describe(scans, index, &name, &pose) != SRF_OK) return fail("describing");
    if (srf_scans_read(scans, index, &progress, &content, &image, &mesh, &cloud) != SRF_OK) return fail(name);
    fprintf(stderr, "\r%-40s\r", "");
    if (content == SRF_CONTENT_IMAGE && srf_image_size(image, &rows, &cols, &valid) == SRF_OK) {
        printf("%s: range image, %lu x %lu, %lu samples", name, (unsigned long)rows, (unsigned long)cols,
               (unsigned long)valid);
    } else if (content == SRF_CONTENT_MESH && srf_mesh_positions(mesh, &vertices) == SRF_OK
               && srf_mesh_triangles(mesh, &triangles) == SRF_OK) {
        printf("%s: mesh, %lu vertices, %lu triangles", name, (unsigned long)vertices.count,
               (unsigned long)triangles.count);
    } else if (content == SRF_CONTENT_CLOUD && srf_cloud_arrays(cloud, &vertices, NULL, NULL, NULL) == SRF_OK) {
        printf("%s: %lu points", name, (unsigned long)vertices.count);
    } else {
        result = fail(name);
    }
    if (result == EXIT_SUCCESS) printf(", at %g %g %g\n", pose.matrix[12], pose.matrix[13], pose.matrix[14]);
    srf_image_free(image);
    srf_mesh_free(mesh);
    srf_cloud_free(cloud);
    return result;
}

int main(int argc, char **argv)
{
    srf_read_options options;
    srf_scans *scans = NULL;
    size_t count = 0, i;
    int first = 1, result = EXIT_SUCCESS;

    if (srf_read_options_init(&options) != SRF_OK) return fail("preparing");
    if (argc > 6 && strcmp(argv[1], "--camera") == 0) {
        for (i = 0; i < 4; ++i) options.intrinsics[i] = strtod(argv[2 + i], NULL);
        first = 6;
    }
    if (argc <= first) {
        fprintf(stderr, "usage: %s [--camera FX FY CX CY] FILES...\n", argv[0]);
        return EXIT_FAILURE;
    }
    signal(SIGINT, interrupt);
    if (srf_scans_open((const char *const *)(argv + first), (size_t)(argc - first), &options, NULL, &scans) != SRF_OK
        || srf_scans_count(scans, &count, NULL) != SRF_OK) {
        return fail("opening");
    }
    for (i = 0; i < count && result == EXIT_SUCCESS; ++i) result = list(scans, i);
    srf_scans_free(scans);
    return result;
}
