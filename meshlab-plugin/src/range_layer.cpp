// SPDX-License-Identifier: GPL-3.0-or-later
#include "range_layer.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <set>
#include <utility>

#include "filter.h"

namespace srf {
namespace {

using Allocator = vcg::tri::Allocator<CMeshO>;
using surfrecon::View;
const char *const row_name = "range_row", *const column_name = "range_col", *const camera_name = "range_camera";

// The camera that a layer remembers of its range image besides its vertices. Null if it never knew or MeshLab forgot.
surfrecon::GridCamera *camera_of(const MeshModel &layer)
{
    // MeshLab's way to find attributes is not const in old versions.
    CMeshO &mesh = const_cast<CMeshO &>(layer.cm);
    auto handle = Allocator::FindPerMeshAttribute<surfrecon::GridCamera>(mesh, camera_name);
    return Allocator::IsValidHandle(mesh, handle) ? &handle() : nullptr;
}

void remember(MeshModel &layer, const surfrecon::Image &image)
{
    Allocator::GetPerMeshAttribute<surfrecon::GridCamera>(layer.cm, camera_name)() = image.grid_camera();
}

// A layer's vertices that are not deleted, each with its pixel.
struct Grid {
    LayerArrays flat;
    std::vector<std::uint32_t> row, column;
    std::uint64_t rows = 0, columns = 0;
    const surfrecon::GridCamera *camera = nullptr;  // null where it is not that of these pixels
};

Grid grid(const MeshModel &layer)
{
    Grid found;
    found.flat = arrays(layer, Frame::layer);
    const std::vector<double> rows = scalars(layer, row_name), columns = scalars(layer, column_name);
    const auto whole = [](double x) { return x >= 0 && x < 2147483647.0 && x == std::floor(x); };
    for (const std::size_t i : found.flat.kept) {
        if (!whole(rows[i]) || !whole(columns[i])) {
            refuse("Vertex " + std::to_string(i) + " of the layer " + quoted(layer) + " has row " + std::to_string(rows[i]) +
                   " and column " + std::to_string(columns[i]) +
                   ", but range_row and range_col must be whole, 0 to 2147483646");
        }
        found.row.push_back(static_cast<std::uint32_t>(rows[i]));
        found.column.push_back(static_cast<std::uint32_t>(columns[i]));
        found.rows = std::max<std::uint64_t>(found.rows, found.row.back() + 1);
        found.columns = std::max<std::uint64_t>(found.columns, found.column.back() + 1);
    }
    found.camera = camera_of(layer);
    if (found.camera != nullptr && (found.camera->rows < found.rows || found.camera->cols < found.columns)) found.camera = nullptr;
    // No allocation larger than what the vertices justify.
    const double pixels = static_cast<double>(found.rows) * static_cast<double>(found.columns);
    const double most = std::max(1e6, 256.0 * static_cast<double>(found.row.size()));
    if (found.camera == nullptr && pixels > most) {
        refuse("range_row and range_col of the layer " + quoted(layer) + " span " + std::to_string(found.rows) + " x " +
               std::to_string(found.columns) + " pixels for " + std::to_string(found.row.size()) + " vertices: import the range image again");
    }
    std::vector<bool> taken(found.rows * found.columns);
    for (std::size_t i = 0; i < found.row.size(); ++i) {
        const std::size_t pixel = found.row[i] * found.columns + found.column[i];
        if (taken[pixel]) {
            refuse("Two vertices of the layer " + quoted(layer) + " are the pixel in row " + std::to_string(found.row[i]) +
                   ", column " + std::to_string(found.column[i]) +
                   ". The layer was refined or joined with another and is no range image any more. Import it again.");
        }
        taken[pixel] = true;
    }
    return found;
}

// The image of a layer's vertices, with their colours, intensities and confidences.
surfrecon::Image image_of(const MeshModel &layer, const Grid &grid, const surfrecon::GridCamera &camera, const surfrecon::Pose &pose)
{
    const std::size_t count = grid.row.size();
    const std::vector<std::uint8_t> colours = vertex_colours(layer, grid.flat);
    const auto values = [&](const char *name) {
        const std::vector<double> of_all = scalars(layer, name);
        std::vector<float> kept;
        if (of_all.empty()) return kept;
        for (const std::size_t i : grid.flat.kept) kept.push_back(std::isfinite(of_all[i]) ? static_cast<float>(of_all[i]) : 0.0f);
        return kept;
    };
    const std::vector<float> intensities = values("intensity"), confidences = values("range_confidence");
    try {
        return surfrecon::Image::from_vertices(
            camera, View<std::uint32_t>(grid.row.data(), count), View<std::uint32_t>(grid.column.data(), count),
            View<double, 3>(grid.flat.positions.data(), count), View<std::uint8_t, 4>(colours.data(), colours.size() / 4),
            View<float>(intensities.data(), intensities.size()), View<float>(confidences.data(), confidences.size()), pose,
            layer.label().toStdString());
    } catch (const surfrecon::Error &error) {
        refuse("The layer " + quoted(layer) + " can't be taken as a range image: " + error.what());
    }
}

bool is_points(const srf_projection &projection)
{
    return projection.kind == SRF_PROJECTION_GRID_PARALLEL || projection.kind == SRF_PROJECTION_GRID_FROM;
}

// Whether MeshLab deleted so many of the vertices by which motions are recognized that three are not left.
bool lost_anchors(const Grid &grid, const surfrecon::GridCamera &camera)
{
    std::set<std::pair<std::uint64_t, std::uint64_t>> anchors;
    for (std::uint32_t k = 0; k < camera.anchor_count; ++k) anchors.emplace(camera.anchors[k].row, camera.anchors[k].col);
    if (anchors.size() < 3) return false;
    int left = 0;
    for (std::size_t i = 0; i < grid.row.size() && left < 3; ++i) left += static_cast<int>(anchors.count({grid.row[i], grid.column[i]}));
    return left < 3;
}

// A camera that sees the surface of a layer best.
surfrecon::GridCamera facing(const MeshModel &layer, const Grid &grid)
{
    double sum[3] = {0, 0, 0};
    const std::vector<double> &p = grid.flat.positions;
    for (std::size_t i = 0; i < grid.flat.triangles.size(); i += 3) {
        const std::uint32_t *const t = &grid.flat.triangles[i];
        for (int k = 0; k < 3; ++k) {
            const auto side = [&](int end, int axis) { return p[3 * t[end] + axis % 3] - p[3 * t[0] + axis % 3]; };
            sum[k] += side(1, k + 1) * side(2, k + 2) - side(1, k + 2) * side(2, k + 1);
        }
    }
    const double size = std::hypot(sum[0], sum[1], sum[2]);
    if (!(size > 0) || !std::isfinite(size)) {
        refuse("It is not known from where the layer " + quoted(layer) + " was seen, and it has no faces to tell. Import it with \"" +
               std::string(import_name) + "\"");
    }
    surfrecon::GridCamera camera;
    camera.rows = grid.rows;
    camera.cols = grid.columns;
    camera.projection = {SRF_PROJECTION_GRID_PARALLEL, 0, {-sum[0] / size, -sum[1] / size, -sum[2] / size, 0}};
    return camera;
}

// The triangles of a range image; nothing for an image that has none.
std::optional<surfrecon::Mesh> surface_of(const surfrecon::Image &image)
{
    try {
        return image.triangulate();
    } catch (const surfrecon::Error &error) {
        if (error.status() != SRF_ERR_INPUT) throw;
        return std::nullopt;
    }
}

// Gives a layer the triangles of its range image, which bridge no jump. How far each vertex can be trusted as one of that surface, 0
// for those without triangles.
std::vector<double> join(MeshModel &layer, const surfrecon::Image &image)
{
    const std::size_t columns = image.cols();
    const std::vector<double> row_of = scalars(layer, row_name), column_of = scalars(layer, column_name);
    std::vector<std::uint32_t> at(image.rows() * columns);
    for (std::size_t i = 0; i < row_of.size(); ++i) {
        at[static_cast<std::size_t>(row_of[i]) * columns + static_cast<std::size_t>(column_of[i])] = static_cast<std::uint32_t>(i);
    }
    const std::optional<surfrecon::Mesh> found = surface_of(image);
    if (!found) {
        replace_faces(layer, {});
        return std::vector<double>(row_of.size());
    }
    const surfrecon::Mesh &surface = *found;
    const auto row = surface.attribute<std::int32_t>(SRF_DOMAIN_VERTICES, row_name);
    const auto column = surface.attribute<std::int32_t>(SRF_DOMAIN_VERTICES, column_name);
    const auto weight = surface.attribute<float>(SRF_DOMAIN_VERTICES, "confidence");
    std::vector<std::uint32_t> vertex_of(row.size());
    std::vector<double> confidence(row_of.size());
    for (std::size_t i = 0; i < row.size(); ++i) {
        vertex_of[i] = at[static_cast<std::size_t>(*row[i]) * columns + static_cast<std::size_t>(*column[i])];
        confidence[vertex_of[i]] = *weight[i];
    }
    const auto corners = surface.triangles();
    std::vector<std::uint32_t> faces(3 * corners.size());
    for (std::size_t k = 0; k < faces.size(); ++k) faces[k] = vertex_of[corners.data()[k]];
    replace_faces(layer, faces);
    return confidence;
}

}  // namespace

bool has_grid(const MeshModel &layer)
{
    return layer.cm.vn > 0 && !scalars(layer, row_name).empty() && !scalars(layer, column_name).empty();
}

surfrecon::Image range_image(const MeshModel &layer, Frame frame)
{
    const Grid found = grid(layer);
    const surfrecon::Pose pose = frame == Frame::world ? placement(layer) : surfrecon::Pose();
    if (found.camera != nullptr) {
        const bool lost = lost_anchors(found, *found.camera);
        try {
            surfrecon::Image image = image_of(layer, found, *found.camera, pose);
            // Points lie on rays of any kind only if they are where they are thought to be.
            if (!lost || !is_points(image.projection())) return image;
        } catch (const MLException &) {
            if (!lost) throw;
        }
    }
    return image_of(layer, found, facing(layer, found), pose);
}

std::array<double, 3> sensor(const MeshModel &layer)
{
    if (camera_of(layer) != nullptr && has_grid(layer)) {
        try {
            return range_image(layer, Frame::layer).sensor();
        } catch (const MLException &) {
            // It is no range image any more.
        }
    }
    const double unknown = std::numeric_limits<double>::quiet_NaN();
    return {unknown, unknown, unknown};
}

void remove_vertices(MeshModel &layer, const std::vector<bool> &gone)
{
    surfrecon::Image image;
    if (camera_of(layer) != nullptr && has_grid(layer)) {
        try {
            image = range_image(layer, Frame::layer);
        } catch (const MLException &) {
            // Pixels that are there twice: it is no range image any more.
        }
    }
    const bool as_imported = image && layer.cm.fn > 0 && image.triangulate().triangles().size() == static_cast<std::size_t>(layer.cm.fn);
    std::vector<std::uint8_t> marks;
    if (image) {
        marks.resize(image.rows() * image.cols());
        const std::vector<double> row_of = scalars(layer, row_name), column_of = scalars(layer, column_name);
        for (std::size_t i = 0; i < gone.size(); ++i) {
            if (!gone[i] || layer.cm.vert[i].IsD()) continue;
            marks[static_cast<std::size_t>(row_of[i]) * image.cols() + static_cast<std::size_t>(column_of[i])] = 1;
        }
    }
    delete_vertices(layer, gone);
    if (!image || layer.cm.vn == 0) return;
    // The vertices by which motions are recognized may be gone.
    image.remove(surfrecon::Region::mask(View<std::uint8_t>(marks.data(), marks.size()), image.rows(), image.cols()));
    remember(layer, image);
    // Another diagonal may join the neighbours of a missing pixel.
    if (as_imported) join(layer, image);
}

void scale_camera(MeshModel &layer, double scale)
{
    if (surfrecon::GridCamera *const camera = camera_of(layer)) *camera = camera->scaled(scale);
}

void fill_range_layer(MeshModel &layer, const surfrecon::Image &image, bool faces)
{
    fill_mesh(layer, image.to_mesh(false), "");
    // The trust in samples has a name of its own: confidence is that of the surface.
    const std::vector<double> trusted = scalars(layer, "confidence");
    if (!trusted.empty()) {
        Allocator::DeletePerVertexAttribute(layer.cm, "confidence");
        set_scalars(layer, "range_confidence", trusted);
    }
    if (faces) {
        const std::vector<double> confidence = join(layer, image);
        set_scalars(layer, "confidence", confidence);
        set_quality(layer, confidence);
    }
    remember(layer, image);
    place(layer, image.pose());
}

}  // namespace srf
