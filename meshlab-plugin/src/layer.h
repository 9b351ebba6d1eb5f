// SPDX-License-Identifier: GPL-3.0-or-later
// Layers of MeshLab <-> meshes of the library. Nothing else touches vertices and faces.
#pragma once

#include <surfrecon.hpp>

#include "compat.h"

namespace srf {

// For messages: the label in quotes.
std::string quoted(const MeshModel &layer);

// Placement of a layer in the world, column after column.
surfrecon::Pose placement(const MeshModel &layer);
void place(MeshModel &layer, const srf_pose &pose);

// The pose that moves by `second` and then by `first`.
surfrecon::Pose product(const srf_pose &first, const srf_pose &second);
// Whether a matrix turns and moves and does no more, to what single precision leaves of one.
bool is_rigid(const srf_pose &pose);
// Of a rigid one.
surfrecon::Pose inverse(const srf_pose &rigid);

// The elements of a layer that are not deleted, as flat arrays: kept[i] is the vertex in the layer of vertex i.
struct LayerArrays {
    std::vector<double> positions;  // 3 a vertex
    std::vector<std::uint32_t> triangles;
    std::vector<std::size_t> kept;
};

enum class Frame { layer, world };

// The fate of vertices that are not finite: the layer is refused with the first one's number, or the library gets them.
enum class NotFinite { refused, passed_on };

LayerArrays arrays(const MeshModel &layer, Frame frame, NotFinite broken = NotFinite::refused);

// The layer as a mesh, with its colours and its custom attribute `confidence`, if it has them. A placement that mirrors keeps
// the outside outside.
surfrecon::Mesh mesh(const MeshModel &layer, Frame frame);

// Colours of the vertices that are kept, 4 numbers each; empty if the layer has none.
std::vector<std::uint8_t> vertex_colours(const MeshModel &layer, const LayerArrays &flat);

// Normals of the vertices that are kept, 3 numbers each.
std::vector<float> normals(const MeshModel &layer, const LayerArrays &flat);

// Values of a scalar custom attribute of the vertices by their place in the layer; empty if there is none.
std::vector<double> scalars(const MeshModel &layer, const std::string &name);
void set_scalars(MeshModel &layer, const std::string &name, const std::vector<double> &values);

// Takes vertices, by their place in the layer, out of it, and the faces at them. Others keep their order and their attributes.
void delete_vertices(MeshModel &layer, const std::vector<bool> &gone);
// Gives a layer other faces, three vertices each.
void replace_faces(MeshModel &layer, const std::vector<std::uint32_t> &triangles);
// Multiplies the coordinates of vertices and the attributes that are lengths.
void scale_vertices(MeshModel &layer, double scale);

// Fills an empty layer with a mesh: colours, and attributes as scalar custom attributes. `quality` names the vertex attribute that
// becomes the quality as well; it need not be there.
// `layer_from_mesh` moves the vertices.
void fill_mesh(MeshModel &layer, const surfrecon::Mesh &mesh, const std::string &quality, const surfrecon::Pose &layer_from_mesh = {});
void fill_cloud(MeshModel &layer, const surfrecon::Cloud &cloud);
// A new layer with a mesh.
MeshModel &add_layer(MeshDocument &document, const std::string &label, const surfrecon::Mesh &mesh, const std::string &quality,
                     const surfrecon::Pose &layer_from_mesh = {});

// Writes points and triangles into an empty layer.
void fill(MeshModel &layer, const double *positions, std::size_t vertices, const std::uint32_t *triangles, std::size_t faces);
void set_colours(MeshModel &layer, const std::uint8_t *rgba);
void set_quality(MeshModel &layer, const std::vector<double> &values);

}  // namespace srf
