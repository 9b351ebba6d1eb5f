// SPDX-License-Identifier: GPL-3.0-or-later
#include "layer.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "filter.h"

namespace srf {

using Allocator = vcg::tri::Allocator<CMeshO>;

std::string quoted(const MeshModel &layer) { return "\"" + layer.label().toStdString() + "\""; }

surfrecon::Pose placement(const MeshModel &layer)
{
    surfrecon::Pose pose;
    for (int row = 0; row < 4; ++row) {
        for (int column = 0; column < 4; ++column) pose.matrix[4 * column + row] = layer.cm.Tr.ElementAt(row, column);
    }
    return pose;
}

void place(MeshModel &layer, const srf_pose &pose)
{
    for (int row = 0; row < 4; ++row) {
        for (int column = 0; column < 4; ++column) {
            layer.cm.Tr.ElementAt(row, column) = static_cast<Scalarm>(pose.matrix[4 * column + row]);
        }
    }
}

namespace {

bool is_identity(const surfrecon::Pose &pose)
{
    const surfrecon::Pose identity;
    return std::equal(std::begin(pose.matrix), std::end(pose.matrix), std::begin(identity.matrix));
}

std::array<double, 3> apply(const double *m, const double *p)
{
    std::array<double, 3> moved{};
    for (int k = 0; k < 3; ++k) moved[k] = m[k] * p[0] + m[4 + k] * p[1] + m[8 + k] * p[2] + m[12 + k];
    return moved;
}

// Sign of the volume a matrix makes of a positive one.
bool mirrors(const double *m)
{
    return m[0] * (m[5] * m[10] - m[6] * m[9]) - m[4] * (m[1] * m[10] - m[2] * m[9]) + m[8] * (m[1] * m[6] - m[2] * m[5]) < 0;
}

// Values of the vertices that are kept.
template <typename T, std::size_t N, typename Get>
std::vector<T> gather(const LayerArrays &from, const Get &get)
{
    std::vector<T> values(N * from.kept.size());
    for (std::size_t i = 0; i < from.kept.size(); ++i) get(from.kept[i], &values[N * i]);
    return values;
}

}  // namespace

surfrecon::Pose product(const srf_pose &first, const srf_pose &second)
{
    surfrecon::Pose made;
    for (int column = 0; column < 4; ++column) {
        for (int row = 0; row < 4; ++row) {
            double &sum = made.matrix[4 * column + row] = 0;
            for (int k = 0; k < 4; ++k) sum += first.matrix[4 * k + row] * second.matrix[4 * column + k];
        }
    }
    return made;
}

bool is_rigid(const srf_pose &pose)
{
    const double *const m = pose.matrix;
    const double off = 1e-4;
    for (int a = 0; a < 3; ++a) {
        for (int b = 0; b < 3; ++b) {
            double dot = a == b ? -1 : 0;
            for (int k = 0; k < 3; ++k) dot += m[4 * a + k] * m[4 * b + k];
            if (!(std::abs(dot) <= off)) return false;
        }
    }
    return !mirrors(m) && m[3] == 0 && m[7] == 0 && m[11] == 0 && m[15] == 1;
}

surfrecon::Pose inverse(const srf_pose &rigid)
{
    const double *const m = rigid.matrix;
    surfrecon::Pose made;
    for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column) made.matrix[4 * column + row] = m[4 * row + column];
        made.matrix[12 + row] = -(m[4 * row] * m[12] + m[4 * row + 1] * m[13] + m[4 * row + 2] * m[14]);
    }
    return made;
}

LayerArrays arrays(const MeshModel &layer, Frame frame, NotFinite broken)
{
    const CMeshO &mesh = layer.cm;
    const surfrecon::Pose pose = placement(layer);
    const double *const m = pose.matrix;
    const bool moved = frame == Frame::world && !is_identity(pose);
    const std::uint32_t none = 0xffffffff;
    if (mesh.vert.size() >= none) refuse("The layer " + quoted(layer) + " has more vertices than can be counted: split it");

    LayerArrays found;
    found.positions.reserve(3 * static_cast<std::size_t>(mesh.vn));
    found.kept.reserve(static_cast<std::size_t>(mesh.vn));
    std::vector<std::uint32_t> place_of(mesh.vert.size(), none);
    for (std::size_t i = 0; i < mesh.vert.size(); ++i) {
        if (mesh.vert[i].IsD()) continue;
        const auto &p = mesh.vert[i].cP();
        std::array<double, 3> point{p[0], p[1], p[2]};
        if (moved) point = apply(m, point.data());
        if (broken == NotFinite::refused && !std::all_of(point.begin(), point.end(), [](double x) { return std::isfinite(x); })) {
            refuse("Vertex " + std::to_string(i) + " of the layer " + quoted(layer) +
                   " is not finite: remove it, for example with Remove Vertices with NaN or by selecting and deleting it");
        }
        place_of[i] = static_cast<std::uint32_t>(found.kept.size());
        found.kept.push_back(i);
        found.positions.insert(found.positions.end(), point.begin(), point.end());
    }
    const bool flip = moved && mirrors(m);
    found.triangles.reserve(3 * static_cast<std::size_t>(mesh.fn));
    for (const CFaceO &face : mesh.face) {
        if (face.IsD()) continue;
        std::uint32_t corners[3];
        for (int k = 0; k < 3; ++k) corners[k] = place_of[vcg::tri::Index(mesh, face.cV(k))];
        if (flip) std::swap(corners[1], corners[2]);
        found.triangles.insert(found.triangles.end(), corners, corners + 3);
    }
    return found;
}

std::vector<std::uint8_t> vertex_colours(const MeshModel &layer, const LayerArrays &flat)
{
    if (!layer.hasDataMask(MeshModel::MM_VERTCOLOR)) return {};
    return gather<std::uint8_t, 4>(flat, [&](std::size_t i, std::uint8_t *out) {
        for (int k = 0; k < 4; ++k) out[k] = layer.cm.vert[i].cC()[k];
    });
}

std::vector<float> normals(const MeshModel &layer, const LayerArrays &flat)
{
    return gather<float, 3>(flat, [&](std::size_t i, float *out) {
        for (int k = 0; k < 3; ++k) out[k] = static_cast<float>(layer.cm.vert[i].cN()[k]);
    });
}

surfrecon::Mesh mesh(const MeshModel &layer, Frame frame)
{
    using surfrecon::View;
    const LayerArrays flat = arrays(layer, frame);
    const std::size_t count = flat.kept.size();
    surfrecon::Mesh made = surfrecon::Mesh::create(View<double, 3>(flat.positions.data(), count),
                                                   View<std::uint32_t, 3>(flat.triangles.data(), flat.triangles.size() / 3));
    const std::vector<std::uint8_t> colours = vertex_colours(layer, flat);
    if (!colours.empty()) {
        made.set_attribute(SRF_DOMAIN_VERTICES, "colour", View<std::uint8_t, 4>(colours.data(), count));
    }
    const std::vector<double> confidence = scalars(layer, "confidence");
    if (!confidence.empty()) {
        // Numbers that other filters left there may be anything.
        const auto weights = gather<float, 1>(flat, [&](std::size_t i, float *out) {
            *out = std::isfinite(confidence[i]) && confidence[i] > 0 ? static_cast<float>(confidence[i]) : 0.0f;
        });
        made.set_attribute(SRF_DOMAIN_VERTICES, "confidence", View<float>(weights.data(), count));
    }
    return made;
}

std::vector<double> scalars(const MeshModel &layer, const std::string &name)
{
    std::vector<double> values;
    // MeshLab's way to find attributes is not const in old versions.
    CMeshO &mesh = const_cast<CMeshO &>(layer.cm);
    if (!vcg::tri::HasPerVertexAttribute(mesh, name)) return values;
    auto handle = Allocator::FindPerVertexAttribute<Scalarm>(mesh, name);
    if (!Allocator::IsValidHandle(mesh, handle)) return values;
    values.resize(mesh.vert.size());
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<double>(handle[i]);
    return values;
}

void set_scalars(MeshModel &layer, const std::string &name, const std::vector<double> &values)
{
    auto handle = Allocator::GetPerVertexAttribute<Scalarm>(layer.cm, name);
    for (std::size_t i = 0; i < values.size(); ++i) handle[i] = static_cast<Scalarm>(values[i]);
}

void fill(MeshModel &layer, const double *positions, std::size_t vertices, const std::uint32_t *triangles, std::size_t faces)
{
    CMeshO &mesh = layer.cm;
    Allocator::AddVertices(mesh, vertices);
    for (std::size_t i = 0; i < vertices; ++i) {
        const double *const p = positions + 3 * i;
        mesh.vert[i].P() = Point3m(static_cast<Scalarm>(p[0]), static_cast<Scalarm>(p[1]), static_cast<Scalarm>(p[2]));
    }
    Allocator::AddFaces(mesh, faces);
    for (std::size_t i = 0; i < faces; ++i) {
        for (int k = 0; k < 3; ++k) mesh.face[i].V(k) = &mesh.vert[triangles[3 * i + k]];
    }
    compat::update_box_and_normals(layer);
}

void delete_vertices(MeshModel &layer, const std::vector<bool> &gone)
{
    CMeshO &mesh = layer.cm;
    for (CFaceO &face : mesh.face) {
        if (face.IsD()) continue;
        bool stays = true;
        for (int k = 0; k < 3; ++k) stays = stays && !gone[vcg::tri::Index(mesh, face.cV(k))];
        if (!stays) Allocator::DeleteFace(mesh, face);
    }
    for (std::size_t i = 0; i < gone.size(); ++i) {
        if (gone[i] && !mesh.vert[i].IsD()) Allocator::DeleteVertex(mesh, mesh.vert[i]);
    }
    Allocator::CompactEveryVector(mesh);
    vcg::tri::UpdateBounding<CMeshO>::Box(mesh);
}

void replace_faces(MeshModel &layer, const std::vector<std::uint32_t> &triangles)
{
    CMeshO &mesh = layer.cm;
    for (CFaceO &face : mesh.face) {
        if (!face.IsD()) Allocator::DeleteFace(mesh, face);
    }
    Allocator::CompactFaceVector(mesh);
    Allocator::AddFaces(mesh, triangles.size() / 3);
    for (std::size_t k = 0; k < triangles.size(); ++k) mesh.face[k / 3].V(static_cast<int>(k % 3)) = &mesh.vert[triangles[k]];
    compat::update_box_and_normals(layer);
}

void scale_vertices(MeshModel &layer, double scale)
{
    for (CVertexO &vertex : layer.cm.vert) {
        for (int k = 0; k < 3; ++k) vertex.P()[k] = static_cast<Scalarm>(vertex.cP()[k] * scale);
    }
    for (const char *const name : {"error", "noise"}) {
        std::vector<double> lengths = scalars(layer, name);
        for (double &length : lengths) length *= scale;
        if (!lengths.empty()) set_scalars(layer, name, lengths);
    }
    vcg::tri::UpdateBounding<CMeshO>::Box(layer.cm);
}

void set_colours(MeshModel &layer, const std::uint8_t *rgba)
{
    layer.updateDataMask(MeshModel::MM_VERTCOLOR);
    for (std::size_t i = 0; i < layer.cm.vert.size(); ++i, rgba += 4) {
        layer.cm.vert[i].C() = vcg::Color4b(rgba[0], rgba[1], rgba[2], rgba[3]);
    }
}

void set_quality(MeshModel &layer, const std::vector<double> &values)
{
    layer.updateDataMask(MeshModel::MM_VERTQUALITY);
    for (std::size_t i = 0; i < values.size(); ++i) layer.cm.vert[i].Q() = static_cast<Scalarm>(values[i]);
}

namespace {

// An attribute of one number an entry; empty if it is none.
std::vector<double> numbers(const srf_array &view)
{
    std::vector<double> values;
    if (view.components != 1) return values;
    values.resize(view.count);
    for (std::size_t i = 0; i < view.count; ++i) {
        switch (view.type) {
        case SRF_TYPE_F32: values[i] = static_cast<const float *>(view.data)[i]; break;
        case SRF_TYPE_I32: values[i] = static_cast<const std::int32_t *>(view.data)[i]; break;
        case SRF_TYPE_U8: values[i] = static_cast<const std::uint8_t *>(view.data)[i]; break;
        default: return {};
        }
    }
    return values;
}

}  // namespace

void fill_mesh(MeshModel &layer, const surfrecon::Mesh &mesh, const std::string &quality, const surfrecon::Pose &layer_from_mesh)
{
    const auto positions = mesh.positions();
    const auto triangles = mesh.triangles();
    const double *placed = positions.data();
    std::vector<double> moved;
    if (!is_identity(layer_from_mesh)) {
        moved.reserve(3 * positions.size());
        for (std::size_t i = 0; i < positions.size(); ++i) {
            const auto p = apply(layer_from_mesh.matrix, positions[i]);
            moved.insert(moved.end(), p.begin(), p.end());
        }
        placed = moved.data();
    }
    fill(layer, placed, positions.size(), triangles.data(), triangles.size());
    for (const std::string &name : mesh.attributes(SRF_DOMAIN_VERTICES)) {
        srf_array view{};
        surfrecon::check(srf_mesh_attribute(mesh.get(), SRF_DOMAIN_VERTICES, name.c_str(), &view));
        if (view.type == SRF_TYPE_U8 && view.components == 4) {
            set_colours(layer, static_cast<const std::uint8_t *>(view.data));
            continue;
        }
        const std::vector<double> values = numbers(view);
        set_scalars(layer, name, values);
        if (name == quality) set_quality(layer, values);
    }
    for (const std::string &name : mesh.attributes(SRF_DOMAIN_TRIANGLES)) {
        srf_array view{};
        surfrecon::check(srf_mesh_attribute(mesh.get(), SRF_DOMAIN_TRIANGLES, name.c_str(), &view));
        const std::vector<double> values = numbers(view);
        auto handle = Allocator::GetPerFaceAttribute<Scalarm>(layer.cm, name);
        for (std::size_t i = 0; i < values.size(); ++i) handle[i] = static_cast<Scalarm>(values[i]);
    }
}

void fill_cloud(MeshModel &layer, const surfrecon::Cloud &cloud)
{
    const auto positions = cloud.positions();
    const auto normals = cloud.normals();
    fill(layer, positions.data(), positions.size(), nullptr, 0);
    if (!normals.empty()) {
        layer.updateDataMask(MeshModel::MM_VERTNORMAL);
        for (std::size_t i = 0; i < normals.size(); ++i) layer.cm.vert[i].N() = Point3m(normals[i][0], normals[i][1], normals[i][2]);
    }
    const auto colours = cloud.colours();
    if (!colours.empty()) set_colours(layer, colours.data());
    srf_array intensities{};
    surfrecon::check(srf_cloud_arrays(cloud.get(), nullptr, nullptr, nullptr, &intensities));
    if (intensities.count > 0) {
        const auto *const first = static_cast<const float *>(intensities.data);
        set_scalars(layer, "intensity", std::vector<double>(first, first + intensities.count));
    }
}

MeshModel &add_layer(MeshDocument &document, const std::string &label, const surfrecon::Mesh &mesh, const std::string &quality,
                     const surfrecon::Pose &layer_from_mesh)
{
    MeshModel &layer = *document.addNewMesh("", text(label), true);
    fill_mesh(layer, mesh, quality, layer_from_mesh);
    return layer;
}

}  // namespace srf
