// SPDX-License-Identifier: GPL-3.0-or-later
// The operations as filters. Written by `make generate` from their declarations in the core: change those.
#pragma once

#include "filter.h"

namespace srf {

void ask_open(const MeshDocument &document, RichParameterList &list);
Outputs run_open(Job &job);
inline const Filter open_filter = {
    "Import Range Images",
    "create_range_images_from_file",
    "Opens a file of scans: every scan becomes a layer of its own, placed by its matrix. Range images keep their grid: each vertex knows its row and column, so that the layer can be merged, sculpted and edited as the range image it is. Confidence becomes the quality of the vertices. Colours are kept.<br>"
    "A recording of a depth camera or a phone, the file of it or its folder, becomes a layer per frame, of many frames some.<br>"
    "Unlike with <i>Import Mesh</i>, all scans of a file come at once, with their poses, and structured PTX, E57 and PCD files become surfaces.",
    compat::FilterBase::RangeMap | compat::FilterBase::MeshCreation,
    compat::FilterBase::NONE,
    ask_open,
    run_open,
};

void ask_plane(const MeshDocument &document, RichParameterList &list);
Outputs run_plane(Job &job);
inline const Filter plane_filter = {
    "Remove Background",
    "meshing_remove_background",
    "Finds the plane that most vertices of the <b>visible</b> layers lie on, a table, a turntable or the ground, and removes what lies on it and below. Above is the side that range images see, and the outside of meshes. If no plane stands out, that is said and nothing is changed. The result does not depend on the order of the layers or the number of processors.",
    compat::FilterBase::RangeMap | compat::FilterBase::Cleaning,
    compat::FilterBase::VARIABLE,
    ask_plane,
    run_plane,
};

void ask_align(const MeshDocument &document, RichParameterList &list);
Outputs run_align(Job &job);
inline const Filter align_filter = {
    "Align Scans",
    "compute_matrix_by_scan_alignment",
    "Brings the <b>visible</b> layers, range images, oriented meshes or points with normals, to one frame, wherever they lie: what looks alike is found, no starting position is needed. The <b>current</b> layer stays; the others' matrices are set, their vertices are not moved.<br>"
    "A layer is placed only where it is sure: where it shares enough with another, is held against turning and sliding, and fits in one place. Others stay where they are, and the log says why and what to do. The result does not depend on the order of the layers or the number of processors.",
    compat::FilterBase::RangeMap | compat::FilterBase::Layer,
    compat::FilterBase::VARIABLE,
    ask_align,
    run_align,
};

void ask_merge(const MeshDocument &document, RichParameterList &list);
Outputs run_merge(Job &job);
inline const Filter merge_filter = {
    "Surface Reconstruction: Marching Intersections",
    "generate_surface_reconstruction_marching_intersections",
    "Merges the <b>visible</b> layers, aligned range images or any oriented meshes, into one welded surface with colour and confidence. Overlaps are fused. Every other vertex stays on a line through the original surface. Boundaries are kept, small holes are closed, and the result does not depend on the order of the layers or the number of processors.<br>"
    "Layers are taken where their matrices place them, and are not changed. If memory is short, temporary files hold the rest meanwhile. Limits of edges and of grazing triangles are for range images as they were imported. Faces that were changed stay as they are.<br>"
    "<br>"
    "See:<br>"
    "<i>C. Rocchini, P. Cignoni, F. Ganovelli, C. Montani, P. Pingi, R. Scopigno</i><br>"
    "<b>\"The Marching Intersections algorithm for merging range images\"</b><br>"
    "The Visual Computer 20, 2004",
    compat::FilterBase::RangeMap | compat::FilterBase::Remeshing,
    compat::FilterBase::VARIABLE,
    ask_merge,
    run_merge,
};

void ask_sculpt(const MeshDocument &document, RichParameterList &list);
Outputs run_sculpt(Job &job);
inline const Filter sculpt_filter = {
    "Surface Reconstruction: Range Image Sculpting",
    "generate_surface_reconstruction_range_image_sculpting",
    "Approximates the <b>range image</b> in the current layer by a mesh of few triangles in which every sample lies within the tolerance, along the ray it was measured by. Jumps and missing samples stay open. The error is measured on the result and returned. The quality of each vertex is the error around it.<br>"
    "The layer must know its grid: import it with <i>Import Range Images</i>. It is not changed.<br>"
    "<br>"
    "See:<br>"
    "<i>A. D. Sappa, M. A. Garcia</i><br>"
    "<b>\"Coarse-to-fine approximation of range images with bounded error adaptive triangular meshes\"</b><br>"
    "Journal of Electronic Imaging 16(2), 2007",
    compat::FilterBase::RangeMap | compat::FilterBase::Remeshing,
    compat::FilterBase::SINGLE_MESH,
    ask_sculpt,
    run_sculpt,
};

void ask_quads(const MeshDocument &document, RichParameterList &list);
Outputs run_quads(Job &job);
inline const Filter quads_filter = {
    "Surface Reconstruction: Adaptive Quad Grid",
    "generate_surface_reconstruction_adaptive_quad_grid",
    "Turns the <b>range image</b> in the current layer into a regular grid of quads that is dense where the surface bends. Its mean error is at most that of the uniform grid of the same size, and both are returned. Quads over missing samples are left out. Texture coordinates are those of the image.<br>"
    "On request another layer gets the tensor-product B-spline surface through the grid.<br>"
    "The layer must know its grid: import it with <i>Import Range Images</i>. It is not changed.<br>"
    "<br>"
    "See:<br>"
    "<i>M. A. Garcia, A. D. Sappa, L. Basanez</i><br>"
    "<b>\"Fast generation of adaptive quadrilateral meshes from range images\"</b><br>"
    "IEEE International Conference on Robotics and Automation, 1997",
    compat::FilterBase::RangeMap | compat::FilterBase::Remeshing | compat::FilterBase::Polygonal,
    compat::FilterBase::SINGLE_MESH,
    ask_quads,
    run_quads,
};

void ask_reconstruct(const MeshDocument &document, RichParameterList &list);
Outputs run_reconstruct(Job &job);
inline const Filter reconstruct_filter = {
    "Surface Reconstruction: Delaunay Carving",
    "generate_surface_reconstruction_delaunay_carving",
    "Makes a surface through the <b>vertices of the current layer</b>, whatever faces it has, over their 3D Delaunay tetrahedralization: closed or open, manifold, through every point the sampling lets it reach. No points are made, and none moved unless they carry noise, which <i>Smoothing</i> is about. Outliers, copies and vertices that are no finite numbers are left out and counted. The custom vertex attribute <i>source_point</i> says which point each vertex was.<br>"
    "Of a range image that the import filter made it is known from where it was seen: the surface is turned there, and where it is open it spans no jumps.<br>"
    "The layer is not changed.<br>"
    "<br>"
    "See:<br>"
    "<i>A. Rodríguez, J. M. Espadero, D. López, L. Pastor</i><br>"
    "<b>\"Delaunay surface reconstruction from scattered points\"</b><br>"
    "DGCI 2000, LNCS 1953",
    compat::FilterBase::Remeshing,
    compat::FilterBase::SINGLE_MESH,
    ask_reconstruct,
    run_reconstruct,
};

void ask_cluster(const MeshDocument &document, RichParameterList &list);
Outputs run_cluster(Job &job);
inline const Filter cluster_filter = {
    "Remeshing: Multiresolution Clustering",
    "meshing_multiresolution_clustering",
    "Replaces the dense surface in the current layer by one of <b>few, well-shaped triangles</b> of any number of vertices, with the same components, holes and genus. Patches of the surface are found by k-means, joined to a mesh, and relaxed on the surface. Of a layer without faces, the surface through its vertices is taken. The layer is not changed.<br>"
    "With several <b>levels</b>, a chain of layers from one run. Edges that are not manifold are cut.",
    compat::FilterBase::Remeshing,
    compat::FilterBase::SINGLE_MESH,
    ask_cluster,
    run_cluster,
};

void ask_close(const MeshDocument &document, RichParameterList &list);
Outputs run_close(Job &job);
inline const Filter close_filter = {
    "Remeshing: Close Surface",
    "meshing_close_surface",
    "Closes the openings of the surface in the current layer, into a new layer. The fill continues the surface smoothly, and crosses nothing. Vertices of the surface stay as they are. <b>The filled faces are selected</b>.<br>"
    "The other visible layers that are range images are taken for its scans. Nothing is filled where one of them saw through. Import them with <i>Import Range Images</i>. Without such layers nothing says where space is empty, and the shape of the surface alone decides.<br>"
    "The log says how many openings stay open, by reason.",
    compat::FilterBase::Remeshing,
    compat::FilterBase::SINGLE_MESH,
    ask_close,
    run_close,
};

void ask_check_print(const MeshDocument &document, RichParameterList &list);
Outputs run_check_print(Job &job);
inline const Filter check_print_filter = {
    "Check for Printing",
    "compute_scalar_by_print_check_per_face",
    "Checks whether the current layer can be printed in 3D: closed, manifold, no crossing faces, walls, overhangs, size. Nothing is repaired. <b>Faces that cross another or hang over are selected. The quality of each face is the thickness of the wall behind it</b>, at most <i>Max wall</i>.<br>"
    "The log has the figures.",
    compat::FilterBase::Quality | compat::FilterBase::Selection,
    compat::FilterBase::SINGLE_MESH,
    ask_check_print,
    run_check_print,
};

void ask_prepare_print(const MeshDocument &document, RichParameterList &list);
Outputs run_prepare_print(Job &job);
inline const Filter prepare_print_filter = {
    "Prepare for Printing",
    "meshing_prepare_for_printing",
    "Makes the closed current layer ready for printing in 3D, by the steps that are asked for, in this order: its size, a flat base, thicker walls, a cavity, a drain, parts that the printer holds. The result is a new layer, or one for each part. It is closed, and no faces cross. <b>Faces that were added are selected.</b><br>"
    "The log has the figures.",
    compat::FilterBase::Remeshing,
    compat::FilterBase::SINGLE_MESH,
    ask_prepare_print,
    run_prepare_print,
};

void ask_unwrap(const MeshDocument &document, RichParameterList &list);
Outputs run_unwrap(Job &job);
inline const Filter unwrap_filter = {
    "Texture: Unwrap",
    "compute_texcoord_by_unwrapping_per_wedge",
    "Gives the current layer texture coordinates of the corners of its faces: charts that are packed into one tile or several. No face is flipped and no two overlap. Vertices and faces stay as they are.<br>"
    "Any faces are welcome: open, closed, of many parts. Edges that do not join two faces of the same orientation become seams.<br>"
    "The log has the figures.",
    compat::FilterBase::Texture,
    compat::FilterBase::SINGLE_MESH,
    ask_unwrap,
    run_unwrap,
};

inline const Filter *const operation_filters[] = {
    &open_filter,
    &plane_filter,
    &align_filter,
    &merge_filter,
    &sculpt_filter,
    &quads_filter,
    &reconstruct_filter,
    &cluster_filter,
    &close_filter,
    &check_print_filter,
    &prepare_print_filter,
    &unwrap_filter,
};

}  // namespace srf
