/* Every kind of handle made, used, handed around and freed, well and badly: run under sanitizers and valgrind. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "surfrecon.h"

#define N 24

static void must(int holds, const char *what)
{
    if (!holds) {
        fprintf(stderr, "%s: %s\n", what, srf_last_error_message());
        exit(1);
    }
}

static int32_t cancel(const char *stage, double fraction, const char *message, void *user)
{
    (void)stage;
    (void)fraction;
    (void)message;
    ++*(int *)user;
    return 1;
}

static srf_image *height_map(void)
{
    const srf_projection plane = {SRF_PROJECTION_ORTHOGRAPHIC, 0, {0, 0, 1, -1}};
    float *heights = malloc(N * N * sizeof *heights);
    srf_array samples = {NULL, N * N, 0, SRF_TYPE_F32, 1};
    srf_image *image = NULL;
    int i;

    for (i = 0; i < N * N; ++i) heights[i] = (float)sin(0.4 * (i % N)) * (float)cos(0.3 * (double)(i / N));
    heights[100] = (float)NAN;
    samples.data = heights;
    must(srf_image_create(N, N, &plane, &samples, NULL, "height map", &image) == SRF_OK, "image");
    free(heights);
    return image;
}

/* A frame that is made when it is needed: a wall, whose depths stay with the program. */
typedef struct {
    uint16_t depths[N * N];
    int is_broken;
} Wall;

static int32_t make_wall(void *user, srf_image **out_image)
{
    const Wall *wall = user;
    srf_array depths = {NULL, N * N, 0, SRF_TYPE_U16, 1};
    srf_frame frame;

    if (wall->is_broken) {
        srf_set_last_error("the camera is gone");
        return SRF_ERR_IO;
    }
    depths.data = wall->depths;
    must(srf_frame_init(&frame) == SRF_OK && frame.kind == SRF_PROJECTION_PINHOLE_DEPTH && frame.scale == 1.0, "init");
    frame.rows = frame.cols = N;
    frame.intrinsics[0] = frame.intrinsics[1] = N;
    frame.intrinsics[2] = frame.intrinsics[3] = 0.5 * (N - 1);
    frame.scale = 0.001;
    return srf_image_from_frame(&frame, &depths, NULL, NULL, NULL, NULL, NULL, out_image, NULL);
}

/* Frames from memory, merged by a function that makes them; one that fails says why. */
static void frames(void)
{
    Wall *wall = calloc(1, sizeof *wall);
    const srf_image_source source = {make_wall, wall};
    srf_image *image = NULL;
    srf_left_out_report left_out;
    srf_merger *merger = NULL;
    srf_mesh *merged = NULL;
    srf_frame frame;
    srf_array depths = {NULL, N * N, 0, SRF_TYPE_U16, 1};
    int i;

    for (i = 1; i < N * N; ++i) wall->depths[i] = (uint16_t)(1000 + 3 * (i % N) + 2 * (i / N));
    must(make_wall(wall, &image) == SRF_OK && srf_image_free(image) == SRF_OK, "frame");
    image = NULL;
    depths.data = wall->depths;
    must(srf_frame_init(&frame) == SRF_OK && srf_left_out_report_init(&left_out) == SRF_OK, "init");
    frame.rows = N - 1;
    frame.cols = N;
    frame.intrinsics[0] = frame.intrinsics[1] = N;
    must(srf_image_from_frame(&frame, &depths, NULL, NULL, NULL, NULL, NULL, &image, &left_out) == SRF_ERR_INPUT && image == NULL, "rows");
    frame.rows = N;
    frame.reach = 1050;
    must(srf_image_from_frame(&frame, &depths, NULL, NULL, NULL, "a wall", NULL, &image, &left_out) == SRF_OK, "frame");
    must(left_out.of == N * N - 1 && left_out.out_of_reach > 100 && left_out.low_confidence == 0, "left out");
    must(srf_image_free(image) == SRF_OK && srf_merger_create(&merger) == SRF_OK, "free");
    must(srf_merger_add_source(merger, &source, NULL, "wall") == SRF_OK, "add");
    must(srf_merger_run(merger, NULL, NULL, &merged, NULL) == SRF_OK && srf_mesh_free(merged) == SRF_OK, "merge");
    wall->is_broken = 1;
    merged = NULL;
    must(srf_merger_run(merger, NULL, NULL, &merged, NULL) == SRF_ERR_INPUT && merged == NULL, "a source that fails");
    must(strcmp(srf_last_error_message(), "wall: the source could not make its image: the camera is gone") == 0, "its reason");
    must(srf_merger_free(merger) == SRF_OK, "free");
    free(wall);
}

/* A range image as vertices, and back. */
static void vertices(void)
{
    srf_image *image = height_map(), *back = NULL;
    srf_mesh *mesh = NULL;
    srf_array positions, rows, columns;
    srf_grid_camera camera, unset;
    srf_pose moved;

    memset(&moved, 0, sizeof moved);
    moved.matrix[0] = -2;
    moved.matrix[5] = moved.matrix[10] = 2;
    moved.matrix[15] = 1;
    must(srf_image_to_mesh(image, 1, NULL, &mesh) == SRF_OK && srf_mesh_positions(mesh, &positions) == SRF_OK, "vertices");
    must(srf_mesh_attribute(mesh, SRF_DOMAIN_VERTICES, "range_row", &rows) == SRF_OK, "rows");
    must(srf_mesh_attribute(mesh, SRF_DOMAIN_VERTICES, "range_col", &columns) == SRF_OK, "columns");
    must(srf_grid_camera_init(&camera) == SRF_OK && srf_image_grid_camera(image, NULL, &camera) == SRF_OK, "camera");
    must(camera.rows == N && camera.anchor_count == 256 && camera.anchors[255].row < N, "anchors");
    must(srf_image_from_vertices(&camera, &rows, &columns, &positions, NULL, NULL, NULL, &moved, NULL, NULL, &back) == SRF_OK, "back");
    must(srf_image_free(back) == SRF_OK && srf_grid_camera_scale(&camera, 2) == SRF_OK, "scale");
    back = NULL;
    must(srf_grid_camera_init(&unset) == SRF_OK, "init");
    must(srf_image_from_vertices(&unset, &rows, &columns, &positions, NULL, NULL, NULL, NULL, "none", NULL, &back) == SRF_ERR_INPUT, "empty");
    must(back == NULL && srf_mesh_free(mesh) == SRF_OK && srf_image_free(image) == SRF_OK, "free");
}

/* One scan drawn to the others, and what it lies off them. */
static void draw(const srf_aligner *aligner, const srf_align_params *params, const srf_cloud *cloud)
{
    srf_snap_report snap;
    srf_pose poses[3];
    srf_array points;
    srf_progress watcher;
    uint8_t touches[3];
    size_t count = 0, i;
    int asked = 0;
    double *off;

    must(srf_aligner_count(aligner, &count) == SRF_OK && count == 3 && srf_snap_report_init(&snap) == SRF_OK, "init");
    memset(poses, 0, sizeof poses);
    for (i = 0; i < 2; ++i) {
        poses[i].matrix[0] = poses[i].matrix[5] = poses[i].matrix[10] = poses[i].matrix[15] = 1;
    }
    poses[1].matrix[14] = 0.2;
    watcher.report = cancel;
    watcher.user = &asked;
    watcher.cancel = NULL;
    must(srf_aligner_snap(aligner, 1, poses, 3, params, &watcher, &snap, NULL) == SRF_ERR_CANCELLED && asked > 0, "cancel");
    must(srf_aligner_snap(aligner, 1, poses, 3, params, NULL, &snap, touches) == SRF_OK, "snap");
    must(snap.state == SRF_PAIR_STATE_FITS && snap.touches_count == 1 && touches[0] == 1 && touches[2] == 0, "it fits the only one");
    must(snap.moved > 0.1 && fabs(snap.world_from_scan.matrix[14]) < 0.01, "it is drawn there");
    must(snap.freedoms_count <= 6 && snap.freedoms[5].turns <= 1, "ways");
    must(srf_aligner_snap(aligner, 2, poses, 3, NULL, NULL, &snap, NULL) == SRF_ERR_INPUT, "no pose to start from");
    must(srf_aligner_snap(aligner, 1, NULL, 0, NULL, NULL, &snap, NULL) == SRF_OK && snap.touches_count == 2, "as added");
    must(srf_cloud_arrays(cloud, &points, NULL, NULL, NULL) == SRF_OK, "points");
    off = malloc(points.count * sizeof *off);
    must(srf_aligner_misfit(aligner, 1, poses, 3, &points, NULL, off) == SRF_OK, "misfit");
    for (i = 0, count = 0; i < points.count; ++i) count += off[i] > 0.05 && off[i] < 0.5;
    must(count > points.count / 2, "it lies above");
    free(off);
}

/* An alignment of a scan with itself: all that was found is looked at. */
static void align(const srf_image *image, const srf_mesh *surface, const srf_cloud *cloud)
{
    srf_aligner *aligner = NULL;
    srf_alignment *alignment = NULL;
    srf_align_params params;
    srf_align_report report;
    srf_aligned_scan scan;
    srf_aligned_pair pair;
    srf_pick pick;
    srf_progress watcher;
    const double at[3] = {0, 0, 0}, up[3] = {0, 0, 1}, turned[3] = {0, 0, 0};
    double point[3], direction[3];
    const char *text = NULL;
    srf_array angles;
    uint32_t found = 0;
    size_t i;
    int asked = 0;

    must(srf_aligner_create(&aligner) == SRF_OK && srf_aligner_add_image(aligner, image) == SRF_OK, "aligner");
    must(srf_aligner_add_mesh(aligner, surface, NULL, "the same again") == SRF_OK, "add");
    must(srf_aligner_add_cloud(aligner, cloud, "its points") == SRF_OK, "add");
    must(srf_aligner_fix(aligner, 2) == SRF_OK && srf_aligner_fix(aligner, 3) == SRF_ERR_PARAMETER, "fix");
    must(srf_align_params_init(&params) == SRF_OK && srf_align_report_init(&report) == SRF_OK, "init");
    must(srf_aligned_scan_init(&scan) == SRF_OK && srf_aligned_pair_init(&pair) == SRF_OK, "init");
    must(srf_pick_init(&pick) == SRF_OK && pick.weight == 1.0, "init");
    pick.scans[1] = 1;
    must(srf_aligner_pick(aligner, &pick) == SRF_OK && srf_aligner_trust(aligner, 0, 1) == SRF_OK, "constraints");
    watcher.report = cancel;
    watcher.user = &asked;
    watcher.cancel = NULL;
    must(srf_aligner_run(aligner, &params, &watcher, &alignment) == SRF_ERR_CANCELLED && alignment == NULL, "cancel");
    must(srf_aligner_run(aligner, &params, NULL, &alignment) == SRF_OK && asked > 0, "align");
    must(srf_alignment_turntable(alignment, &found, point, direction, &angles) == SRF_OK && found == 0, "no turntable");
    must(srf_alignment_free(alignment) == SRF_OK, "free");
    draw(aligner, &params, cloud);
    must(srf_aligner_turn(aligner, at, up, turned, 2) == SRF_ERR_INPUT, "an angle too few");
    must(srf_aligner_turn(aligner, at, up, turned, 3) == SRF_OK, "turn");
    params.turntable = SRF_TURNTABLE_TURNED;
    must(srf_aligner_run(aligner, &params, NULL, &alignment) == SRF_OK, "align");
    must(srf_alignment_turntable(alignment, &found, point, direction, &angles) == SRF_OK && found == 1, "turntable");
    must(direction[2] == 1.0 && angles.count == 3 && cos(((const double *)angles.data)[2]) > 0.999, "as it was given");
    must(srf_aligner_free(aligner) == SRF_OK && srf_aligner_free(NULL) == SRF_OK, "free");
    must(srf_alignment_report(alignment, &report) == SRF_OK && report.scans_count == 3 && report.placed >= 1, "report");
    for (i = 0; i < report.scans_count; ++i) {
        must(srf_alignment_scan(alignment, i, &scan) == SRF_OK && scan.spacing > 0 && scan.misfit >= 0, "scan");
        must(scan.freedoms_count <= 6 && scan.freedoms[5].turns <= 1, "ways of a scan");
        must(srf_alignment_reason(alignment, i, &text) == SRF_OK && (scan.group == 0) == (strlen(text) == 0), "reason");
    }
    must(scan.state == SRF_SCAN_STATE_KEPT && scan.world_from_scan.matrix[0] == 1.0, "the fixed one stays");
    for (i = 0; i < report.pairs_count; ++i) {
        must(srf_alignment_pair(alignment, i, &pair) == SRF_OK && pair.scans[0] < pair.scans[1], "pair");
        must(pair.freedoms_count <= 6 && pair.freedoms[5].turns <= 1, "ways of a pair");
    }
    for (i = 0; i < report.messages_count; ++i) must(srf_alignment_message(alignment, i, &text) == SRF_OK && strlen(text) > 0, "message");
    for (i = 0; i < 1 + report.scans_count + report.messages_count; ++i) must(srf_alignment_line(alignment, i, &text) == SRF_OK && strlen(text) > 0, "line");
    must(srf_alignment_line(alignment, i, &text) == SRF_ERR_PARAMETER, "no such line");
    must(srf_alignment_free(alignment) == SRF_OK && srf_alignment_free(alignment) == SRF_ERR_HANDLE, "freed twice");
}

int main(void)
{
    srf_image *image = height_map();
    srf_mesh *surface = NULL, *merged = NULL;
    srf_cloud *cloud = NULL;
    srf_merger *merger = NULL;
    srf_merge_params params;
    srf_merge_report report;
    srf_check_report topology;
    srf_distance_report figures;
    srf_array view, points;
    srf_progress watcher;
    double off[N * N];
    int asked = 0;

    frames();
    vertices();
    must(srf_image_triangulate(image, NULL, NULL, &surface) == SRF_OK, "triangulate");
    must(srf_image_to_cloud(image, NULL, &cloud) == SRF_OK, "cloud");
    align(image, surface, cloud);
    must(srf_merger_create(&merger) == SRF_OK && srf_merger_add_image(merger, image) == SRF_OK, "merger");
    must(srf_merger_add_mesh(merger, surface, NULL, "the same again") == SRF_OK, "add");
    must(srf_image_free(image) == SRF_OK && srf_image_free(image) == SRF_ERR_HANDLE, "freed twice");
    must(srf_merge_params_init(&params) == SRF_OK && srf_merge_report_init(&report) == SRF_OK, "init");
    watcher.report = cancel;
    watcher.user = &asked;
    watcher.cancel = NULL;
    params.voxel = 0.01;
    must(srf_merger_run(merger, &params, &watcher, &merged, &report) == SRF_ERR_CANCELLED && merged == NULL, "cancel");
    must(asked > 0, "asked");
    params.voxel = 0.5;
    must(srf_merger_run(merger, &params, NULL, &merged, &report) == SRF_OK && report.scans == 2, "merge");
    must(srf_check_report_init(&topology) == SRF_OK && srf_mesh_check(merged, 1, NULL, &topology) == SRF_OK, "check");
    must(topology.is_manifold == 1, "manifold");
    must(srf_cloud_arrays(cloud, &points, NULL, NULL, NULL) == SRF_OK && points.count == N * N - 1, "points");
    must(srf_distance_report_init(&figures) == SRF_OK, "init");
    must(srf_mesh_distances(merged, &points, 0, 2, NULL, off, &figures) == SRF_OK && figures.max < 1.0, "distances");
    must(srf_mesh_attribute(merged, SRF_DOMAIN_VERTICES, "confidence", &view) == SRF_OK && view.count == topology.vertices, "attribute");
    must(srf_mesh_attribute(merged, SRF_DOMAIN_VERTICES, "no such thing", &view) == SRF_ERR_INPUT, "missing attribute");
    must(strlen(srf_last_error_message()) > 0, "message");
    must(srf_mesh_write_ply(merged, "exercise.ply", SRF_ENCODING_ASCII, NULL) == SRF_OK, "write");
    must(srf_mesh_write_ply(merged, "no/such/folder.ply", SRF_ENCODING_ASCII, NULL) == SRF_ERR_IO, "write nowhere");
    must(srf_merger_write(merger, "exercise.ply", &params, 0, ".", NULL, "{}", NULL, &report) == SRF_OK && report.scans == 2, "into a file");
    must(srf_mesh_free(merged) == SRF_OK, "free");
    must(srf_merger_run_in_files(merger, &params, 0, 0, ".", NULL, &merged, &report) == SRF_OK && report.in_files == 1, "in files");
    must(srf_mesh_free(merged) == SRF_OK && srf_mesh_free(surface) == SRF_OK && srf_cloud_free(cloud) == SRF_OK, "free");
    must(srf_merger_free(merger) == SRF_OK && srf_merger_free(NULL) == SRF_OK, "free");
    must(srf_mesh_positions((srf_mesh *)(void *)&params, &view) == SRF_ERR_HANDLE, "a pointer that is no handle");
    printf("fine\n");
    return 0;
}
