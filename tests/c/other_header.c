/* A program compiled with a header whose structs have a field less or a field more than the library's: none of them is written
 * beyond its end, all are filled, and calls work. -DMORE: the header has the more. C99 and C++17. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "surfrecon.h"

static void must(int is_so, const char *what)
{
    if (!is_so) {
        fprintf(stderr, "%s: %s\n", what, srf_last_error_message());
        exit(1);
    }
}

/* Behind each struct, so that what is written there is seen without a sanitizer too. */
#define CANARY 0xC5
static int is_whole(const unsigned char *canary, size_t size)
{
    size_t i;
    for (i = 0; i < size; ++i) {
        if (canary[i] != CANARY) return 0;
    }
    return 1;
}

#ifdef MORE
#define LAST_IS_RIGHT(value) ((value).added_later == 0)
#else
#define LAST_IS_RIGHT(value) 1
#endif

#define FILL(held, init)                                                                        \
    do {                                                                                        \
        memset(&(held), CANARY, sizeof(held));                                                  \
        must(init(&(held).value) == SRF_OK, #init);                                             \
        must((held).value.struct_size == sizeof((held).value), "the size is the caller's");     \
        must(is_whole((held).canary, sizeof((held).canary)), "nothing is written behind");      \
        must(LAST_IS_RIGHT((held).value), "what the library does not know is 0");               \
    } while (0)

#define HELD(type)                \
    struct {                      \
        type value;               \
        unsigned char canary[64]; \
    }

int main(void)
{
    HELD(srf_triangulate_params) triangulate;
    HELD(srf_check_report) topology;
    HELD(srf_read_options) options;
    HELD(srf_merge_params) merge;
    HELD(srf_merge_report) merged;
    HELD(srf_sculpt_params) sculpt;
    HELD(srf_sculpt_report) certificate;
    HELD(srf_quads_params) quads;
    HELD(srf_quads_report) quad_report;
    HELD(srf_spline_params) spline;
    HELD(srf_write_options) writing;
    HELD(srf_reconstruct_params) reconstruct;
    HELD(srf_reconstruct_report) reconstructed;
    HELD(srf_cluster_params) cluster;
    HELD(srf_cluster_report) clustered;
    HELD(srf_scan_params) scan;
    HELD(srf_distance_report) distances;
    HELD(srf_align_params) align;
    HELD(srf_pick) pick;
    HELD(srf_align_report) aligned;
    HELD(srf_aligned_scan) aligned_scan;
    HELD(srf_aligned_pair) aligned_pair;
    HELD(srf_snap_report) snap;
    HELD(srf_frame) frame;
    HELD(srf_left_out_report) left_out;
    HELD(srf_grid_camera) grid_camera;
    const double positions[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
    const uint32_t triangles[] = {0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2};
    srf_array points, corners;
    srf_mesh *mesh = NULL;
    srf_mesh *surface = NULL;
    srf_merger *merger = NULL;

    FILL(triangulate, srf_triangulate_params_init);
    FILL(topology, srf_check_report_init);
    FILL(options, srf_read_options_init);
    FILL(merge, srf_merge_params_init);
    FILL(merged, srf_merge_report_init);
    FILL(sculpt, srf_sculpt_params_init);
    FILL(certificate, srf_sculpt_report_init);
    FILL(quads, srf_quads_params_init);
    FILL(quad_report, srf_quads_report_init);
    FILL(spline, srf_spline_params_init);
    FILL(writing, srf_write_options_init);
    FILL(reconstruct, srf_reconstruct_params_init);
    FILL(reconstructed, srf_reconstruct_report_init);
    FILL(cluster, srf_cluster_params_init);
    FILL(clustered, srf_cluster_report_init);
    FILL(scan, srf_scan_params_init);
    FILL(distances, srf_distance_report_init);
    FILL(align, srf_align_params_init);
    FILL(pick, srf_pick_init);
    FILL(aligned, srf_align_report_init);
    FILL(aligned_scan, srf_aligned_scan_init);
    FILL(aligned_pair, srf_aligned_pair_init);
    FILL(snap, srf_snap_report_init);
    FILL(frame, srf_frame_init);
    FILL(left_out, srf_left_out_report_init);
    FILL(grid_camera, srf_grid_camera_init);

    memset(&points, 0, sizeof(points));
    points.data = positions;
    points.count = 4;
    points.components = 3;
    points.type = SRF_TYPE_F64;
    corners = points;
    corners.data = triangles;
    corners.type = SRF_TYPE_U32;
    must(srf_mesh_create(&points, &corners, &mesh) == SRF_OK, "mesh");
    must(srf_mesh_check(mesh, 0, NULL, &topology.value) == SRF_OK, "check");
    must(is_whole(topology.canary, sizeof(topology.canary)), "a report ends where the caller's does");
    must(topology.value.triangles == 4 && LAST_IS_RIGHT(topology.value), "a report is filled");
    merge.value.voxel = 0.1;
    must(srf_merger_create(&merger) == SRF_OK && srf_merger_add_mesh(merger, mesh, NULL, "mesh") == SRF_OK, "merger");
    must(srf_merger_run(merger, &merge.value, NULL, &surface, &merged.value) == SRF_OK, "merge");
    must(is_whole(merged.canary, sizeof(merged.canary)), "a report ends where the caller's does");
    must(srf_mesh_distances(surface, &points, 0, 0, NULL, NULL, &distances.value) == SRF_OK, "distances");
    must(is_whole(distances.canary, sizeof(distances.canary)), "figures end where the caller's do");
    srf_mesh_free(surface);
    surface = NULL;
#ifdef MORE
    /* What this library can't know is not passed over. */
    merge.value.added_later = 1;
    must(srf_merger_run(merger, &merge.value, NULL, &surface, NULL) == SRF_ERR_STRUCT_SIZE, "a field of the future");
    must(strstr(srf_last_error_message(), "Use a newer library.") != NULL, "the remedy");
#endif
    must(srf_check_report_init_sized(&topology.value, 12) == SRF_ERR_STRUCT_SIZE, "a size that no struct has");
    srf_merger_free(merger);
    srf_mesh_free(mesh);
    puts("fine");
    return 0;
}
