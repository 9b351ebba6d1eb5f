// SPDX-License-Identifier: GPL-3.0-or-later
// Range images as layers. The grid travels with the layer: each vertex knows its pixel by the scalar custom attributes
// range_row and range_col, and the layer how pixels see. So a layer may be edited, and other filters can give a layer a grid.
#pragma once

#include <surfrecon.hpp>

#include <array>

#include "compat.h"
#include "layer.h"

namespace srf {

// Fills an empty layer with a range image and places it by its matrix: a vertex each valid pixel, the triangles that bridge no jump;
// quality is the confidence.
void fill_range_layer(MeshModel &layer, const surfrecon::Image &image, bool faces);

// Whether vertices say which pixel they are.
bool has_grid(const MeshModel &layer);

// The range image of a layer as it is now, by srf_image_from_vertices(): however vertices were moved, turned, scaled and mirrored all
// together since the import, by themselves or by the layer's matrix, its pixels see as they did. Where the layer never knew how they
// see, or too few vertices are left to tell, they are taken to be seen from where its surface faces. Throws MLException, with the
// layer's name, where pixels are taken twice.
surfrecon::Image range_image(const MeshModel &layer, Frame frame);

// The place where the rays of a layer's range image start, in the layer's frame. Three NaN where they are parallel or nothing tells.
std::array<double, 3> sensor(const MeshModel &layer);

// Takes vertices, by their place in the layer, out of it, and the faces at them. A range image stays one: it still knows how its pixels
// see and how it was moved, and if it had all of its triangles, it has all of those that are left.
void remove_vertices(MeshModel &layer, const std::vector<bool> &gone);

// To be called where all vertices of a layer were scaled about its origin.
void scale_camera(MeshModel &layer, double scale);

}  // namespace srf
