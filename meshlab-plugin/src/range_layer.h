// SPDX-License-Identifier: GPL-3.0-or-later
// Range images as layers. The grid travels with the layer: each vertex knows its pixel by the scalar custom attributes
// range_row and range_col, and the layer how pixels see. So a layer may be edited, and other filters can give a layer a grid.
#pragma once

#include <surfrecon.hpp>

#include "compat.h"
#include "layer.h"

namespace srf {

// Adds a range image as a layer placed by its matrix: a vertex each valid pixel, the triangles that bridge no jump; quality is
// the confidence.
MeshModel &add_range_layer(MeshDocument &document, const std::string &label, surfrecon::Image &image, bool faces);
void fill_range_layer(MeshModel &layer, surfrecon::Image &image, bool faces);

// Whether vertices say which pixel they are.
bool has_grid(const MeshModel &layer);

// The range image of a layer as it is now. Where vertices were moved all together since the import, by any rigid motion, it is
// placed so; where they were edited one by one, or the layer never knew how its pixels see, they are taken to be seen from
// where its surface faces. Throws where pixels are taken twice.
surfrecon::Image range_image(const MeshModel &layer, Frame frame);

// Takes vertices, by their place in the layer, out of it, and the faces at them. A range image stays one: it still knows how its pixels
// see and how it was moved.
void remove_vertices(MeshModel &layer, const std::vector<bool> &gone);

// To be called where all vertices of a layer were scaled about its origin.
void scale_camera(MeshModel &layer, double scale);

}  // namespace srf
