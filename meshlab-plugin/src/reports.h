// SPDX-License-Identifier: GPL-3.0-or-later
// Figures of the operations. Written by `make generate` from their declarations in the core: change those.
#pragma once

#include "report.h"

namespace srf {

inline const Figures align_figures = {
    {Figure::Kind::count, "scans_count", "Scans", false, 1, offsetof(srf_align_report, scans_count), {}, {}},
    {Figure::Kind::count, "pairs_count", "Pairs", false, 1, offsetof(srf_align_report, pairs_count), {}, {}},
    {Figure::Kind::count, "groups_count", "Groups", false, 1, offsetof(srf_align_report, groups_count), {}, {}},
    {Figure::Kind::count, "compared", "Pairs compared", false, 1, offsetof(srf_align_report, compared), {}, {}},
    {Figure::Kind::length, "residual", "Distance of the surfaces", true, 1, offsetof(srf_align_report, residual), {}, {}},
    {Figure::Kind::number, "turntable_point", "Turntable: Axis", false, 3, offsetof(srf_align_report, turntable_point), {}, {}},
    {Figure::Kind::number, "turntable_direction", "Turntable: Axis", false, 3, offsetof(srf_align_report, turntable_direction), {}, {}},
    {Figure::Kind::count, "messages_count", "Messages", false, 1, offsetof(srf_align_report, messages_count), {}, {}},
    {Figure::Kind::count, "placed", "Placed", false, 1, offsetof(srf_align_report, placed), {}, {}},
};

inline const Figures merge_figures = {
    {Figure::Kind::count, "scans", "Scans", false, 1, offsetof(srf_merge_report, scans), {}, {}},
    {Figure::Kind::count, "input_triangles", "Their triangles", false, 1, offsetof(srf_merge_report, input_triangles), {}, {}},
    {Figure::Kind::length, "voxel", "Voxel", false, 1, offsetof(srf_merge_report, voxel), {}, {}},
    {Figure::Kind::choice, "voxel_reason", "Chosen as", false, 1, offsetof(srf_merge_report, voxel_reason), {"given", "spacing", "noise", "distance", "memory"}, {"as given", "1.5 times the spacing of the samples", "half the noise of the samples", "1.5 times the distance between overlapping scans", "coarser, to fit into memory"}},
    {Figure::Kind::length, "merge_distance", "Merge distance", false, 1, offsetof(srf_merge_report, merge_distance), {}, {}},
    {Figure::Kind::length, "max_hole_length", "Closed up to", false, 1, offsetof(srf_merge_report, max_hole_length), {}, {}},
    {Figure::Kind::length, "overlap_residual", "Scans disagree by", true, 1, offsetof(srf_merge_report, overlap_residual), {}, {}},
    {Figure::Kind::length, "noise", "Noise of the samples", false, 1, offsetof(srf_merge_report, noise), {}, {}},
    {Figure::Kind::length, "noise_across", "Across the rays", false, 1, offsetof(srf_merge_report, noise_across), {}, {}},
    {Figure::Kind::length, "noise_step", "In steps of", false, 1, offsetof(srf_merge_report, noise_step), {}, {}},
    {Figure::Kind::number, "noise_correlation", "Shared over", false, 1, offsetof(srf_merge_report, noise_correlation), {}, {}},
    {Figure::Kind::count, "grid", "Grid", false, 3, offsetof(srf_merge_report, grid), {}, {}},
    {Figure::Kind::count, "intersections", "Intersections", false, 1, offsetof(srf_merge_report, intersections), {}, {}},
    {Figure::Kind::count, "seen_through", "Dropped as seen through", false, 1, offsetof(srf_merge_report, seen_through), {}, {}},
    {Figure::Kind::count, "fused_intersections", "Fused intersections", false, 1, offsetof(srf_merge_report, fused_intersections), {}, {}},
    {Figure::Kind::count, "artificial_intersections", "Artificial intersections", false, 1, offsetof(srf_merge_report, artificial_intersections), {}, {}},
    {Figure::Kind::count, "faces_direct", "Triangles of case a, b, c", false, 1, offsetof(srf_merge_report, faces_direct), {}, {}},
    {Figure::Kind::count, "faces_settled", "Triangles of case a, b, c", false, 1, offsetof(srf_merge_report, faces_settled), {}, {}},
    {Figure::Kind::count, "faces_filling", "Triangles of case a, b, c", false, 1, offsetof(srf_merge_report, faces_filling), {}, {}},
    {Figure::Kind::count, "holes_closed", "Holes closed, left", false, 1, offsetof(srf_merge_report, holes_closed), {}, {}},
    {Figure::Kind::count, "holes_open", "Holes closed, left", false, 1, offsetof(srf_merge_report, holes_open), {}, {}},
    {Figure::Kind::count, "dropped_components", "Stray parts dropped, triangles", false, 1, offsetof(srf_merge_report, dropped_components), {}, {}},
    {Figure::Kind::count, "dropped_faces", "Stray parts dropped, triangles", false, 1, offsetof(srf_merge_report, dropped_faces), {}, {}},
    {Figure::Kind::bytes, "working_bytes", "Memory", false, 1, offsetof(srf_merge_report, working_bytes), {}, {}},
    {Figure::Kind::flag, "in_files", "In files", false, 1, offsetof(srf_merge_report, in_files), {}, {}},
    {Figure::Kind::length, "shortest_edge", "Shortest edge", false, 1, offsetof(srf_merge_report, shortest_edge), {}, {}},
};

inline const Figures sculpt_figures = {
    {Figure::Kind::length, "tolerance", "Tolerance", false, 1, offsetof(srf_sculpt_report, tolerance), {}, {}},
    {Figure::Kind::length, "depth_extent", "Depth extent", false, 1, offsetof(srf_sculpt_report, depth_extent), {}, {}},
    {Figure::Kind::count, "full_triangles", "Triangles with every sample", false, 1, offsetof(srf_sculpt_report, full_triangles), {}, {}},
    {Figure::Kind::count, "hidden_triangles", "Hidden triangles", false, 1, offsetof(srf_sculpt_report, hidden_triangles), {}, {}},
    {Figure::Kind::count, "dug_triangles", "Triangles before the polish", false, 1, offsetof(srf_sculpt_report, dug_triangles), {}, {}},
    {Figure::Kind::count, "triangles", "Triangles", false, 1, offsetof(srf_sculpt_report, triangles), {}, {}},
    {Figure::Kind::count, "isolated_pixels", "Samples not covered", false, 1, offsetof(srf_sculpt_report, isolated_pixels), {}, {}},
    {Figure::Kind::length, "max_error", "Largest error", false, 1, offsetof(srf_sculpt_report, max_error), {}, {}},
    {Figure::Kind::length, "max_error_single", "In single precision", false, 1, offsetof(srf_sculpt_report, max_error_single), {}, {}},
    {Figure::Kind::length, "rms_error", "RMS error", false, 1, offsetof(srf_sculpt_report, rms_error), {}, {}},
    {Figure::Kind::length, "p95_error", "95 % below", false, 1, offsetof(srf_sculpt_report, p95_error), {}, {}},
    {Figure::Kind::count, "worst_row", "Worst pixel", true, 1, offsetof(srf_sculpt_report, worst_row), {}, {}},
    {Figure::Kind::count, "worst_col", "Worst pixel", true, 1, offsetof(srf_sculpt_report, worst_col), {}, {}},
    {Figure::Kind::count, "covered_pixels", "Samples covered", false, 1, offsetof(srf_sculpt_report, covered_pixels), {}, {}},
};

inline const Figures quads_figures = {
    {Figure::Kind::count, "tiles_down", "Tiles", false, 1, offsetof(srf_quads_report, tiles_down), {}, {}},
    {Figure::Kind::count, "tiles_across", "Tiles", false, 1, offsetof(srf_quads_report, tiles_across), {}, {}},
    {Figure::Kind::length, "depth_extent", "Depth extent", false, 1, offsetof(srf_quads_report, depth_extent), {}, {}},
    {Figure::Kind::ratio, "relative_error", "Relative error", false, 1, offsetof(srf_quads_report, relative_error), {}, {}},
    {Figure::Kind::ratio, "uniform_relative_error", "Of the uniform grid", false, 1, offsetof(srf_quads_report, uniform_relative_error), {}, {}},
    {Figure::Kind::length, "rms_error", "RMS error", false, 1, offsetof(srf_quads_report, rms_error), {}, {}},
    {Figure::Kind::length, "uniform_rms_error", "RMS error of the uniform grid", false, 1, offsetof(srf_quads_report, uniform_rms_error), {}, {}},
    {Figure::Kind::length, "max_error", "Largest error", false, 1, offsetof(srf_quads_report, max_error), {}, {}},
    {Figure::Kind::length, "uniform_max_error", "Largest error of the uniform grid", false, 1, offsetof(srf_quads_report, uniform_max_error), {}, {}},
    {Figure::Kind::flag, "is_uniform", "Uniform", false, 1, offsetof(srf_quads_report, is_uniform), {}, {}},
    {Figure::Kind::count, "valid_pixels", "Valid pixels", false, 1, offsetof(srf_quads_report, valid_pixels), {}, {}},
    {Figure::Kind::count, "missed_pixels", "Missed pixels", false, 1, offsetof(srf_quads_report, missed_pixels), {}, {}},
    {Figure::Kind::count, "uniform_missed_pixels", "Missed by the uniform grid", false, 1, offsetof(srf_quads_report, uniform_missed_pixels), {}, {}},
    {Figure::Kind::count, "gaps_filled", "Gaps filled", false, 1, offsetof(srf_quads_report, gaps_filled), {}, {}},
    {Figure::Kind::count, "unfolded", "Vertices unfolded", false, 1, offsetof(srf_quads_report, unfolded), {}, {}},
    {Figure::Kind::count, "snapped", "Vertices snapped", false, 1, offsetof(srf_quads_report, snapped), {}, {}},
    {Figure::Kind::count, "quads", "Quads", false, 1, offsetof(srf_quads_report, quads), {}, {}},
};

inline const Figures reconstruct_figures = {
    {Figure::Kind::count, "points", "Points", false, 1, offsetof(srf_reconstruct_report, points), {}, {}},
    {Figure::Kind::count, "used", "On the surface", false, 1, offsetof(srf_reconstruct_report, used), {}, {}},
    {Figure::Kind::count, "tetrahedra", "Tetrahedra", false, 1, offsetof(srf_reconstruct_report, tetrahedra), {}, {}},
    {Figure::Kind::flag, "closed", "Closed", false, 1, offsetof(srf_reconstruct_report, closed), {}, {}},
    {Figure::Kind::number, "threshold", "Threshold", false, 1, offsetof(srf_reconstruct_report, threshold), {}, {}},
    {Figure::Kind::count, "rounds", "Rounds of carving", false, 1, offsetof(srf_reconstruct_report, rounds), {}, {}},
    {Figure::Kind::count, "repaired", "Repaired, gathered", false, 1, offsetof(srf_reconstruct_report, repaired), {}, {}},
    {Figure::Kind::count, "gathered", "Repaired, gathered", false, 1, offsetof(srf_reconstruct_report, gathered), {}, {}},
    {Figure::Kind::count, "cut_facets", "Facets left out", false, 1, offsetof(srf_reconstruct_report, cut_facets), {}, {}},
    {Figure::Kind::count, "turned_parts", "Parts turned over", false, 1, offsetof(srf_reconstruct_report, turned_parts), {}, {}},
    {Figure::Kind::count, "not_finite", "Dropped: not finite", false, 1, offsetof(srf_reconstruct_report, not_finite), {}, {}},
    {Figure::Kind::count, "duplicates", "Dropped: copies", false, 1, offsetof(srf_reconstruct_report, duplicates), {}, {}},
    {Figure::Kind::count, "inside", "Dropped: inside", false, 1, offsetof(srf_reconstruct_report, inside), {}, {}},
    {Figure::Kind::count, "outside", "Dropped: outside", false, 1, offsetof(srf_reconstruct_report, outside), {}, {}},
    {Figure::Kind::length, "noise", "Noise of the points", false, 1, offsetof(srf_reconstruct_report, noise), {}, {}},
    {Figure::Kind::length, "spacing", "Spacing of the points", false, 1, offsetof(srf_reconstruct_report, spacing), {}, {}},
    {Figure::Kind::length, "smoothing", "Smoothed within", false, 1, offsetof(srf_reconstruct_report, smoothing), {}, {}},
    {Figure::Kind::length, "moved", "Points moved by", false, 1, offsetof(srf_reconstruct_report, moved), {}, {}},
    {Figure::Kind::count, "outliers", "Dropped: outliers", false, 1, offsetof(srf_reconstruct_report, outliers), {}, {}},
};

inline const Figures cluster_figures = {
    {Figure::Kind::count, "patches", "Patches", false, 1, offsetof(srf_cluster_report, patches), {}, {}},
    {Figure::Kind::count, "vertices", "Vertices", false, 1, offsetof(srf_cluster_report, vertices), {}, {}},
    {Figure::Kind::count, "triangles", "Triangles", false, 1, offsetof(srf_cluster_report, triangles), {}, {}},
    {Figure::Kind::count, "separated", "Parts made patches", false, 1, offsetof(srf_cluster_report, separated), {}, {}},
    {Figure::Kind::count, "dissolved", "Given to neighbours", false, 1, offsetof(srf_cluster_report, dissolved), {}, {}},
    {Figure::Kind::count, "halved", "Patches halved", false, 1, offsetof(srf_cluster_report, halved), {}, {}},
    {Figure::Kind::count, "cut_edges", "Edges cut", false, 1, offsetof(srf_cluster_report, cut_edges), {}, {}},
    {Figure::Kind::count, "off_surface", "Points off the surface", false, 1, offsetof(srf_cluster_report, off_surface), {}, {}},
    {Figure::Kind::number, "energy", "Energy", false, 1, offsetof(srf_cluster_report, energy), {}, {}},
    {Figure::Kind::angle, "before_mean_smallest_angle", "Before: Mean smallest angle", false, 1, offsetof(srf_cluster_report, before_mean_smallest_angle), {}, {}},
    {Figure::Kind::angle, "before_smallest_angle", "Before: Smallest angle", false, 1, offsetof(srf_cluster_report, before_smallest_angle), {}, {}},
    {Figure::Kind::angle, "before_largest_angle", "Before: Largest angle", false, 1, offsetof(srf_cluster_report, before_largest_angle), {}, {}},
    {Figure::Kind::angle, "after_mean_smallest_angle", "After: Mean smallest angle", false, 1, offsetof(srf_cluster_report, after_mean_smallest_angle), {}, {}},
    {Figure::Kind::angle, "after_smallest_angle", "After: Smallest angle", false, 1, offsetof(srf_cluster_report, after_smallest_angle), {}, {}},
    {Figure::Kind::angle, "after_largest_angle", "After: Largest angle", false, 1, offsetof(srf_cluster_report, after_largest_angle), {}, {}},
    {Figure::Kind::length, "max_error", "Largest error", false, 1, offsetof(srf_cluster_report, max_error), {}, {}},
    {Figure::Kind::flag, "kept_input", "The input itself", false, 1, offsetof(srf_cluster_report, kept_input), {}, {}},
    {Figure::Kind::length, "rms_error", "RMS error", false, 1, offsetof(srf_cluster_report, rms_error), {}, {}},
};

inline const Figures close_figures = {
    {Figure::Kind::length, "cell", "Cell", false, 1, offsetof(srf_close_report, cell), {}, {}},
    {Figure::Kind::length, "fill_cell", "Cell of the fill", false, 1, offsetof(srf_close_report, fill_cell), {}, {}},
    {Figure::Kind::length, "merge_distance", "Merge distance", false, 1, offsetof(srf_close_report, merge_distance), {}, {}},
    {Figure::Kind::length, "max_hole_length", "Closed up to", true, 1, offsetof(srf_close_report, max_hole_length), {}, {}},
    {Figure::Kind::flag, "has_sight", "Keeps out of seen space", false, 1, offsetof(srf_close_report, has_sight), {}, {}},
    {Figure::Kind::count, "closed", "Openings closed", false, 1, offsetof(srf_close_report, closed), {}, {}},
    {Figure::Kind::count, "left_not_asked", "Left open, by reason", false, 1, offsetof(srf_close_report, left_not_asked), {}, {}},
    {Figure::Kind::count, "left_too_long", "Left open, by reason", false, 1, offsetof(srf_close_report, left_too_long), {}, {}},
    {Figure::Kind::count, "left_not_enclosed", "Left open, by reason", false, 1, offsetof(srf_close_report, left_not_enclosed), {}, {}},
    {Figure::Kind::count, "left_seen_through", "Left open, by reason", false, 1, offsetof(srf_close_report, left_seen_through), {}, {}},
    {Figure::Kind::count, "left_crossing", "Left open, by reason", false, 1, offsetof(srf_close_report, left_crossing), {}, {}},
    {Figure::Kind::length, "largest_opening", "Largest opening closed", false, 1, offsetof(srf_close_report, largest_opening), {}, {}},
    {Figure::Kind::count, "added_vertices", "Vertices, triangles added", false, 1, offsetof(srf_close_report, added_vertices), {}, {}},
    {Figure::Kind::count, "added_triangles", "Vertices, triangles added", false, 1, offsetof(srf_close_report, added_triangles), {}, {}},
    {Figure::Kind::number, "filled_area", "Area filled", false, 1, offsetof(srf_close_report, filled_area), {}, {}},
    {Figure::Kind::ratio, "filled_share", "Filled", false, 1, offsetof(srf_close_report, filled_share), {}, {}},
    {Figure::Kind::count, "forced_triangles", "Filled in seen space", false, 1, offsetof(srf_close_report, forced_triangles), {}, {}},
    {Figure::Kind::count, "open_edges", "Open edges", false, 1, offsetof(srf_close_report, open_edges), {}, {}},
    {Figure::Kind::flag, "is_closed", "Closed", false, 1, offsetof(srf_close_report, is_closed), {}, {}},
};

}  // namespace srf
