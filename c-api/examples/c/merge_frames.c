/*
 * Merges frames of a depth camera that are made when they are needed and never all in memory: merge_frames OUT.ply [FRAMES]
 * Here a ball of half a metre is "recorded" from all around; a program with a camera or a file of its own fills the two images from
 * there. C99.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include <surfrecon.h>

enum { ROWS = 120, COLS = 160, FOCAL = 200, DISTANCE_MM = 1500, RADIUS_MM = 500, MOST = 1000 };

/* A frame that can be made at any time: what it was taken with, and from where. */
typedef struct {
    const srf_frame *camera;
    srf_pose world_from_sensor;
} Frame;

/* The pose of the k-th of so many cameras: spread over a sphere, looking at its middle. x right, y down, z forward. */
static srf_pose place(int k, int count)
{
    const double angle = 2.399963229728653 * k, height = 1 - (2 * k + 1.0) / count, ring = sqrt(1 - height * height);
    const double z[3] = {-ring * cos(angle), -ring * sin(angle), -height};
    const double x[3] = {-sin(angle), cos(angle), 0};
    srf_pose pose = {{0}};
    int i;

    for (i = 0; i < 3; ++i) {
        pose.matrix[i] = x[i];
        pose.matrix[4 + i] = z[(i + 1) % 3] * x[(i + 2) % 3] - z[(i + 2) % 3] * x[(i + 1) % 3];
        pose.matrix[8 + i] = z[i];
        pose.matrix[12 + i] = -0.001 * DISTANCE_MM * z[i];
    }
    pose.matrix[15] = 1;
    return pose;
}

/* Fills the images of a frame: depths in millimetres, 0 where there is nothing, and colours. */
static void record(const Frame *frame, uint16_t *depths, uint8_t *colours)
{
    const double *m = frame->world_from_sensor.matrix;
    int i, axis;

    for (i = 0; i < ROWS * COLS; ++i) {
        const double x = (i % COLS - 0.5 * (COLS - 1)) / FOCAL, y = (i / COLS - 0.5 * (ROWS - 1)) / FOCAL;
        const double square = 1 + x * x + y * y, distance = DISTANCE_MM, radius = RADIUS_MM;
        const double inside = distance * distance - square * (distance * distance - radius * radius);
        const double z = inside < 0 ? 0 : (distance - sqrt(inside)) / square;

        depths[i] = (uint16_t)(z + 0.5);
        for (axis = 0; axis < 3; ++axis) {
            const double at = z * (m[axis] * x + m[4 + axis] * y + m[8 + axis]) + 1000 * m[12 + axis];
            colours[3 * i + axis] = z > 0 ? (uint8_t)(128 + 120 * at / radius) : 90;
        }
    }
}

/* Makes the image of a frame; the library calls it on several threads at once, so nothing is shared but the camera. */
static int32_t make(void *user, srf_image **out_image)
{
    const Frame *frame = user;
    uint16_t *depths = malloc(ROWS * COLS * sizeof *depths);
    uint8_t *colours = malloc(3 * ROWS * COLS);
    int32_t status = SRF_ERR_OUT_OF_MEMORY;

    if (depths != NULL && colours != NULL) {
        const srf_array depth_array = {depths, ROWS * COLS, 0, SRF_TYPE_U16, 1}, colour_array = {colours, ROWS * COLS, 0, SRF_TYPE_U8, 3};
        record(frame, depths, colours);
        status = srf_image_from_frame(frame->camera, &depth_array, &colour_array, NULL, NULL, NULL, NULL, out_image, NULL);
    }
    free(depths);
    free(colours);
    return status;
}

static int fail(const char *what)
{
    fprintf(stderr, "%s: %s\n", what, srf_last_error_message());
    return EXIT_FAILURE;
}

static int merge(const char *out, srf_merger *merger, Frame *frames, int count)
{
    srf_mesh *mesh = NULL;
    srf_merge_report figures;
    char name[32];
    int i, result = EXIT_FAILURE;

    for (i = 0; i < count; ++i) {
        const srf_image_source source = {make, &frames[i]};
        snprintf(name, sizeof name, "frame %04d", i);
        if (srf_merger_add_source(merger, &source, &frames[i].world_from_sensor, name) != SRF_OK) return fail("adding");
    }
    if (srf_merge_report_init(&figures) != SRF_OK || srf_merger_run(merger, NULL, NULL, &mesh, &figures) != SRF_OK) return fail("merging");
    if (srf_mesh_write_ply(mesh, out, SRF_ENCODING_BINARY, NULL) != SRF_OK) {
        result = fail("writing");
    } else {
        printf("%u frames, voxel %g, %llu triangles, %llu holes left open\n", (unsigned)figures.scans, figures.voxel,
               (unsigned long long)(figures.faces_direct + figures.faces_settled + figures.faces_filling),
               (unsigned long long)figures.holes_open);
        result = EXIT_SUCCESS;
    }
    srf_mesh_free(mesh);
    return result;
}

int main(int argc, char **argv)
{
    static Frame frames[MOST];
    const int count = argc > 2 ? atoi(argv[2]) : 30;
    srf_frame camera;
    srf_merger *merger = NULL;
    int i, result;

    if (argc < 2 || count < 1 || count > MOST) {
        fprintf(stderr, "usage: %s OUT.ply [FRAMES], at most %d\n", argv[0], MOST);
        return EXIT_FAILURE;
    }
    if (srf_frame_init(&camera) != SRF_OK || srf_merger_create(&merger) != SRF_OK) return fail("preparing");
    camera.rows = ROWS;
    camera.cols = COLS;
    camera.intrinsics[0] = camera.intrinsics[1] = FOCAL;
    camera.intrinsics[2] = 0.5 * (COLS - 1);
    camera.intrinsics[3] = 0.5 * (ROWS - 1);
    camera.scale = 0.001;
    for (i = 0; i < count; ++i) {
        frames[i].camera = &camera;
        frames[i].world_from_sensor = place(i, count);
    }
    result = merge(argv[1], merger, frames, count);
    srf_merger_free(merger);
    return result;
}
