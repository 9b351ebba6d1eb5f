// SPDX-License-Identifier: GPL-3.0-or-later
#include "range_layer.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "filter.h"

namespace srf {
namespace {

using Allocator = vcg::tri::Allocator<CMeshO>;
const char *const row_name = "range_row", *const column_name = "range_col", *const camera_name = "range_camera";
const double nan = std::numeric_limits<double>::quiet_NaN();

// What a layer remembers of its range image besides its vertices.
struct RangeCamera {
    std::uint64_t rows, columns;
    srf_projection projection;
    // Three vertices by their pixels, and where they were: how the vertices were moved since.
    struct {
        std::uint64_t row, column;
        double point[3];
    } anchors[3];
};

using Vector = std::array<double, 3>;

Vector minus(const double *a, const double *b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
double dot(const Vector &a, const Vector &b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Vector cross(const Vector &a, const Vector &b)
{
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
double size(const Vector &a) { return std::sqrt(dot(a, a)); }
Vector scaled(const Vector &a, double by) { return {a[0] * by, a[1] * by, a[2] * by}; }

// Three vertices far from each other: the first, the one farthest from it, the one farthest from the line through both.
std::array<std::size_t, 3> anchors(const std::vector<double> &points)
{
    std::array<std::size_t, 3> chosen{0, 0, 0};
    double best = 0;
    for (std::size_t i = 0; 3 * i < points.size(); ++i) {
        const double far = size(minus(&points[3 * i], &points[0]));
        if (far > best) {
            best = far;
            chosen[1] = i;
        }
    }
    const Vector line = minus(&points[3 * chosen[1]], &points[0]);
    best = 0;
    for (std::size_t i = 0; 3 * i < points.size(); ++i) {
        const double far = size(cross(line, minus(&points[3 * i], &points[0])));
        if (far > best) {
            best = far;
            chosen[2] = i;
        }
    }
    return chosen;
}

// A rigid motion: x -> rotation x + shift, rows of the rotation one after the other.
struct Motion {
    std::array<Vector, 3> rotation;
    Vector shift;

    Vector operator()(const double *x) const
    {
        const Vector v{x[0], x[1], x[2]};
        return {dot(rotation[0], v) + shift[0], dot(rotation[1], v) + shift[1], dot(rotation[2], v) + shift[2]};
    }
};

// Three orthonormal axes of a triangle.
bool axes(const std::array<Vector, 3> &corners, std::array<Vector, 3> &found)
{
    const Vector a = minus(corners[1].data(), corners[0].data()), b = minus(corners[2].data(), corners[0].data());
    const Vector normal = cross(a, b);
    if (!(size(a) > 0) || !(size(normal) > 0)) return false;
    found[0] = scaled(a, 1 / size(a));
    found[2] = scaled(normal, 1 / size(normal));
    found[1] = cross(found[2], found[0]);
    return true;
}

// The motion that takes `from` to `to`, if a rigid one does to within rounding.
bool rigid_motion(const std::array<Vector, 3> &from, const std::array<Vector, 3> &to, Motion &found)
{
    std::array<Vector, 3> before, after;
    if (!axes(from, before) || !axes(to, after)) return false;
    for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column) {
            found.rotation[row][column] = 0;
            for (int k = 0; k < 3; ++k) found.rotation[row][column] += after[k][row] * before[k][column];
        }
    }
    found.shift = {0, 0, 0};
    const Vector turned = found(from[0].data());
    found.shift = minus(to[0].data(), turned.data());
    const double extent = size(minus(from[1].data(), from[0].data()));
    double magnitude = extent;
    for (const Vector &corner : to) magnitude = std::max(magnitude, size(corner));
    // Vertices are in single precision in most builds.
    const double rounding = 1e-5 * extent + 1e-6 * magnitude;
    for (int k = 0; k < 3; ++k) {
        const Vector moved = found(from[k].data());
        if (size(minus(moved.data(), to[k].data())) > rounding) return false;
    }
    return true;
}

// The motion of a matrix, if it is rigid and takes `from` to `to`: tells where what lies in a point or on a line went, too.
bool carried_by(const surfrecon::Pose &pose, const std::array<Vector, 3> &from, const std::array<Vector, 3> &to, Motion &found)
{
    for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column) found.rotation[row][column] = pose.matrix[4 * column + row];
        found.shift[row] = pose.matrix[12 + row];
    }
    const auto &r = found.rotation;
    for (int i = 0; i < 3; ++i) {
        for (int k = 0; k < 3; ++k) {
            if (std::abs(dot(r[i], r[k]) - (i == k ? 1 : 0)) > 1e-5) return false;
        }
    }
    if (dot(r[0], cross(r[1], r[2])) < 0) return false;
    for (int k = 0; k < 3; ++k) {
        const Vector moved = found(from[k].data());
        if (size(minus(moved.data(), to[k].data())) > 1e-6 * (size(to[k]) + size(found.shift))) return false;
    }
    return true;
}

Motion inverse(const Motion &motion)
{
    Motion found;
    for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column) found.rotation[row][column] = motion.rotation[column][row];
    }
    found.shift = {0, 0, 0};
    const Vector back = found(motion.shift.data());
    found.shift = scaled(back, -1);
    return found;
}

surfrecon::Pose pose_of(const Motion &motion)
{
    surfrecon::Pose pose;
    for (int column = 0; column < 3; ++column) {
        for (int row = 0; row < 3; ++row) pose.matrix[4 * column + row] = motion.rotation[row][column];
    }
    for (int row = 0; row < 3; ++row) pose.matrix[12 + row] = motion.shift[row];
    return pose;
}

// The grid of a layer's vertices that are not deleted.
struct Grid {
    LayerArrays flat;
    std::vector<std::size_t> pixels;  // one a vertex
    std::size_t rows = 0, columns = 0;
};

Grid grid(const MeshModel &layer, const RangeCamera *camera, Frame frame)
{
    Grid found;
    found.flat = arrays(layer, frame);
    const std::vector<double> rows = scalars(layer, row_name), columns = scalars(layer, column_name);
    const auto whole = [](double x) { return x >= 0 && x < 4294967296.0 && x == std::floor(x); };
    double last_row = 0, last_column = 0;
    for (const std::size_t i : found.flat.kept) {
        if (!whole(rows[i]) || !whole(columns[i])) {
            refuse("Vertex " + std::to_string(i) + " of the layer " + quoted(layer) + " has row " + std::to_string(rows[i]) +
                   " and column " + std::to_string(columns[i]) + " in range_row and range_col: both must be whole and at least 0");
        }
        last_row = std::max(last_row, rows[i]);
        last_column = std::max(last_column, columns[i]);
    }
    found.rows = static_cast<std::size_t>(last_row) + 1;
    found.columns = static_cast<std::size_t>(last_column) + 1;
    if (camera != nullptr && camera->rows >= found.rows && camera->columns >= found.columns) {
        found.rows = camera->rows;
        found.columns = camera->columns;
    }
    // No allocation larger than what the vertices justify.
    const double pixels = static_cast<double>(found.rows) * static_cast<double>(found.columns);
    const double most = std::max(1e6, 256.0 * static_cast<double>(found.flat.kept.size()));
    if (pixels > most) {
        refuse("range_row and range_col of the layer " + quoted(layer) + " span " + std::to_string(found.rows) + " x " +
               std::to_string(found.columns) + " pixels for " + std::to_string(found.flat.kept.size()) +
               " vertices: that is no range image");
    }
    std::vector<bool> taken(found.rows * found.columns);
    for (const std::size_t i : found.flat.kept) {
        const std::size_t pixel = static_cast<std::size_t>(rows[i]) * found.columns + static_cast<std::size_t>(columns[i]);
        if (taken[pixel]) {
            refuse("Two vertices of the layer " + quoted(layer) + " are the pixel in row " + std::to_string(pixel / found.columns) +
                   ", column " + std::to_string(pixel % found.columns) +
                   ": the layer was refined or joined with another and is no range image any more. Import it again");
        }
        taken[pixel] = true;
        found.pixels.push_back(pixel);
    }
    return found;
}

// Where the vertices with the anchors' pixels are now.
bool find_anchors(const Grid &grid, const RangeCamera &camera, std::array<Vector, 3> &found)
{
    for (int k = 0; k < 3; ++k) {
        const std::size_t pixel = camera.anchors[k].row * grid.columns + camera.anchors[k].column;
        const auto at = std::find(grid.pixels.begin(), grid.pixels.end(), pixel);
        if (at == grid.pixels.end()) return false;
        const double *const p = &grid.flat.positions[3 * (at - grid.pixels.begin())];
        found[k] = {p[0], p[1], p[2]};
    }
    return true;
}

bool is_grid(const srf_projection &projection)
{
    return projection.kind == SRF_GRID_PARALLEL || projection.kind == SRF_GRID_FROM;
}

// What the pixel of a point measures.
double value(const srf_projection &projection, const Vector &point)
{
    const bool depth = projection.kind == SRF_ORTHOGRAPHIC || projection.kind == SRF_PINHOLE_DEPTH;
    return depth ? point[2] : size(point);
}

// The direction from which the surface of a layer is seen best.
Vector facing(const MeshModel &layer, const Grid &grid)
{
    Vector sum{0, 0, 0};
    const std::vector<double> &p = grid.flat.positions;
    for (std::size_t i = 0; i < grid.flat.triangles.size(); i += 3) {
        const std::uint32_t *const t = &grid.flat.triangles[i];
        const Vector normal = cross(minus(&p[3 * t[1]], &p[3 * t[0]]), minus(&p[3 * t[2]], &p[3 * t[0]]));
        for (int k = 0; k < 3; ++k) sum[k] += normal[k];
    }
    if (!(size(sum) > 0) || !std::isfinite(size(sum))) {
        refuse("It is not known from where the layer " + quoted(layer) + " was seen, and it has no faces to tell. Import it with \"" +
               std::string(import_name) + "\"");
    }
    return scaled(sum, 1 / size(sum));
}

template <typename T, std::size_t N, typename Get>
std::vector<T> spread(const Grid &grid, const Get &get)
{
    std::vector<T> values(N * grid.rows * grid.columns);
    for (std::size_t i = 0; i < grid.pixels.size(); ++i) get(grid.flat.kept[i], &values[N * grid.pixels[i]]);
    return values;
}

void set_attributes(const surfrecon::Image &image, const MeshModel &layer, const Grid &grid)
{
    const std::size_t pixels = grid.rows * grid.columns;
    std::vector<std::uint8_t> colours;
    std::vector<float> intensities, confidences;
    srf_array views[3]{};
    if (layer.hasDataMask(MeshModel::MM_VERTCOLOR)) {
        colours = spread<std::uint8_t, 4>(grid, [&](std::size_t i, std::uint8_t *out) {
            for (int k = 0; k < 4; ++k) out[k] = layer.cm.vert[i].cC()[k];
        });
        views[0] = surfrecon::detail::array_of(colours.data(), pixels, 4);
    }
    const auto scalar = [&](const char *name, std::vector<float> &store, srf_array &view) {
        const std::vector<double> values = scalars(layer, name);
        if (values.empty()) return;
        store = spread<float, 1>(grid, [&](std::size_t i, float *out) {
            *out = std::isfinite(values[i]) ? static_cast<float>(values[i]) : 0.0f;
        });
        view = surfrecon::detail::array_of(store.data(), pixels, 1);
    };
    scalar("intensity", intensities, views[1]);
    scalar("range_confidence", confidences, views[2]);
    surfrecon::check(srf_image_set_attributes(image.get(), views[0].data ? &views[0] : nullptr,
                                              views[1].data ? &views[1] : nullptr, views[2].data ? &views[2] : nullptr));
}

// Colours, intensities and confidences of the valid pixels.
void keep_attributes(MeshModel &layer, const surfrecon::Image &image, const std::vector<double> &row_of,
                     const std::vector<double> &column_of)
{
    srf_array colours{}, intensities{}, confidences{};
    surfrecon::check(srf_image_attributes(image.get(), &colours, &intensities, &confidences));
    const std::size_t columns = image.cols();
    const auto pixel = [&](std::size_t i) {
        return static_cast<std::size_t>(row_of[i]) * columns + static_cast<std::size_t>(column_of[i]);
    };
    if (colours.count > 0) {
        std::vector<std::uint8_t> kept;
        for (std::size_t i = 0; i < row_of.size(); ++i) {
            const auto *const rgba = static_cast<const std::uint8_t *>(colours.data) + 4 * pixel(i);
            kept.insert(kept.end(), rgba, rgba + 4);
        }
        set_colours(layer, kept.data());
    }
    const auto keep = [&](const srf_array &view, const char *name) {
        if (view.count == 0) return;
        std::vector<double> kept(row_of.size());
        for (std::size_t i = 0; i < kept.size(); ++i) kept[i] = static_cast<const float *>(view.data)[pixel(i)];
        set_scalars(layer, name, kept);
    };
    keep(intensities, "intensity");
    keep(confidences, "range_confidence");
}

// The layer's vertices that the vertices of an image's surface are; `vertex_of` has them by pixel.
std::vector<std::uint32_t> vertices_of(const surfrecon::Mesh &surface, const std::vector<std::uint32_t> &vertex_of, std::size_t columns)
{
    const auto row = surface.attribute<std::int32_t>(SRF_VERTICES, row_name);
    const auto column = surface.attribute<std::int32_t>(SRF_VERTICES, column_name);
    std::vector<std::uint32_t> found(row.size());
    for (std::size_t i = 0; i < found.size(); ++i) {
        found[i] = vertex_of[static_cast<std::size_t>(*row[i]) * columns + static_cast<std::size_t>(*column[i])];
    }
    return found;
}

std::vector<std::uint32_t> faces_of(const surfrecon::Mesh &surface, const std::vector<std::uint32_t> &place)
{
    const auto corners = surface.triangles();
    std::vector<std::uint32_t> faces(3 * corners.size());
    for (std::size_t k = 0; k < faces.size(); ++k) faces[k] = place[corners.data()[k]];
    return faces;
}

// Stores how the pixels see, and where three of the vertices are in the sensor's frame.
void remember(MeshModel &layer, const surfrecon::Image &image, const std::vector<double> &row_of,
              const std::vector<double> &column_of, const surfrecon::Pose &sensor_from_layer)
{
    std::vector<double> points;
    const double *const m = sensor_from_layer.matrix;
    for (const CVertexO &vertex : layer.cm.vert) {
        const auto &p = vertex.cP();
        for (int k = 0; k < 3; ++k) points.push_back(m[k] * p[0] + m[4 + k] * p[1] + m[8 + k] * p[2] + m[12 + k]);
    }
    RangeCamera camera{image.rows(), image.cols(), image.projection(), {}};
    const auto chosen = anchors(points);
    for (int k = 0; k < 3; ++k) {
        const std::size_t i = chosen[k];
        camera.anchors[k].row = static_cast<std::uint64_t>(row_of[i]);
        camera.anchors[k].column = static_cast<std::uint64_t>(column_of[i]);
        std::copy_n(&points[3 * i], 3, camera.anchors[k].point);
    }
    Allocator::GetPerMeshAttribute<RangeCamera>(layer.cm, camera_name)() = camera;
}

}  // namespace

bool has_grid(const MeshModel &layer)
{
    return layer.cm.vn > 0 && !scalars(layer, row_name).empty() && !scalars(layer, column_name).empty();
}

surfrecon::Image range_image(const MeshModel &layer, Frame frame)
{
    CMeshO &mesh = const_cast<CMeshO &>(layer.cm);
    auto handle = Allocator::FindPerMeshAttribute<RangeCamera>(mesh, camera_name);
    const RangeCamera *const camera = Allocator::IsValidHandle(mesh, handle) ? &handle() : nullptr;
    const Grid found = grid(layer, camera, frame);
    const std::string name = layer.label().toStdString();
    const std::size_t pixels = found.rows * found.columns;

    std::array<Vector, 3> now{}, then{};
    Motion moved;
    surfrecon::Image image;
    bool known = camera != nullptr && found.rows == camera->rows && found.columns == camera->columns &&
                 find_anchors(found, *camera, now);
    if (known) {
        for (int k = 0; k < 3; ++k) std::copy_n(camera->anchors[k].point, 3, then[k].begin());
        known = rigid_motion(then, now, moved) ||
                carried_by(frame == Frame::world ? placement(layer) : surfrecon::Pose(), then, now, moved);
    }
    if (known) {
        const bool still = now == then;
        const Motion back = inverse(moved);
        const auto in_sensor = [&](std::size_t i) {
            const double *const p = &found.flat.positions[3 * i];
            return still ? Vector{p[0], p[1], p[2]} : back(p);
        };
        const surfrecon::Pose pose = still ? surfrecon::Pose() : pose_of(moved);
        std::vector<double> samples(is_grid(camera->projection) ? 3 * pixels : pixels, nan);
        for (std::size_t i = 0; i < found.pixels.size(); ++i) {
            const Vector point = in_sensor(i);
            if (is_grid(camera->projection)) {
                std::copy(point.begin(), point.end(), &samples[3 * found.pixels[i]]);
            } else {
                samples[found.pixels[i]] = value(camera->projection, point);
            }
        }
        using surfrecon::View;
        image = is_grid(camera->projection)
                    ? surfrecon::Image::create(found.rows, found.columns, camera->projection, View<double, 3>(samples.data(), pixels), pose, name)
                    : surfrecon::Image::create(found.rows, found.columns, camera->projection, View<double>(samples.data(), pixels), pose, name);
    } else {
        const Vector toward = facing(layer, found);
        const srf_projection projection{SRF_GRID_PARALLEL, 0, {-toward[0], -toward[1], -toward[2], 0}};
        std::vector<double> samples(3 * pixels, nan);
        for (std::size_t i = 0; i < found.pixels.size(); ++i) {
            std::copy_n(&found.flat.positions[3 * i], 3, &samples[3 * found.pixels[i]]);
        }
        image = surfrecon::Image::create(found.rows, found.columns, projection, surfrecon::View<double, 3>(samples.data(), pixels),
                                         {}, name);
    }
    set_attributes(image, layer, found);
    return image;
}

void remove_vertices(MeshModel &layer, const std::vector<bool> &gone)
{
    auto handle = Allocator::FindPerMeshAttribute<RangeCamera>(layer.cm, camera_name);
    surfrecon::Image image;
    if (Allocator::IsValidHandle(layer.cm, handle) && has_grid(layer)) {
        try {
            image = range_image(layer, Frame::layer);
        } catch (const MLException &) {
            // Pixels that are there twice: it is no range image any more.
        }
    }
    const bool as_imported = image && layer.cm.fn > 0 && image.triangulate().triangles().size() == static_cast<std::size_t>(layer.cm.fn);
    delete_vertices(layer, gone);
    if (!image || layer.cm.vn == 0) return;
    // The vertices by which motions are recognized may be gone.
    remember(layer, image, scalars(layer, row_name), scalars(layer, column_name), inverse(image.pose()));
    if (!as_imported) return;
    // Where a pixel is missing its neighbours may be joined by another diagonal.
    image = range_image(layer, Frame::layer);
    const std::vector<double> rows = scalars(layer, row_name), columns = scalars(layer, column_name);
    std::vector<std::uint32_t> vertex_of(image.rows() * image.cols());
    for (std::size_t i = 0; i < rows.size(); ++i) {
        vertex_of[static_cast<std::size_t>(rows[i]) * image.cols() + static_cast<std::size_t>(columns[i])] = static_cast<std::uint32_t>(i);
    }
    const surfrecon::Mesh surface = image.triangulate();
    replace_faces(layer, faces_of(surface, vertices_of(surface, vertex_of, image.cols())));
}

void scale_camera(MeshModel &layer, double scale)
{
    auto handle = Allocator::FindPerMeshAttribute<RangeCamera>(layer.cm, camera_name);
    if (!Allocator::IsValidHandle(layer.cm, handle)) return;
    RangeCamera &camera = handle();
    for (auto &anchor : camera.anchors) {
        for (double &x : anchor.point) x *= scale;
    }
    if (camera.projection.kind == SRF_ORTHOGRAPHIC || camera.projection.kind == SRF_GRID_FROM) {
        for (double &x : camera.projection.numbers) x *= scale;
    }
}

MeshModel &add_range_layer(MeshDocument &document, const std::string &label, surfrecon::Image &image, bool faces)
{
    MeshModel &layer = *document.addNewMesh("", text(label), true);
    fill_range_layer(layer, image, faces);
    return layer;
}

void fill_range_layer(MeshModel &layer, surfrecon::Image &image, bool faces)
{
    const std::size_t rows = image.rows(), columns = image.cols(), valid = image.valid();
    const surfrecon::Pose pose = image.pose();
    image.set_pose({});
    const std::vector<double> points = image.world_points();

    std::vector<double> kept, row_of, column_of;
    for (auto *list : {&row_of, &column_of}) list->reserve(valid);
    kept.reserve(3 * valid);
    std::vector<std::uint32_t> vertex_of(rows * columns);
    for (std::size_t pixel = 0; pixel < rows * columns; ++pixel) {
        const double *const p = &points[3 * pixel];
        if (!(std::isfinite(p[0]) && std::isfinite(p[1]) && std::isfinite(p[2]))) continue;
        vertex_of[pixel] = static_cast<std::uint32_t>(row_of.size());
        kept.insert(kept.end(), p, p + 3);
        row_of.push_back(static_cast<double>(pixel / columns));
        column_of.push_back(static_cast<double>(pixel % columns));
    }

    std::vector<std::uint32_t> triangles;
    std::vector<double> confidence;
    if (faces) {
        const surfrecon::Mesh surface = image.triangulate();
        const auto weight = surface.attribute<float>(SRF_VERTICES, "confidence");
        const std::vector<std::uint32_t> place = vertices_of(surface, vertex_of, columns);
        confidence.resize(row_of.size());
        for (std::size_t i = 0; i < place.size(); ++i) confidence[place[i]] = *weight[i];
        triangles = faces_of(surface, place);
    }

    fill(layer, kept.data(), row_of.size(), triangles.data(), triangles.size() / 3);
    set_scalars(layer, row_name, row_of);
    set_scalars(layer, column_name, column_of);
    if (faces) {
        set_scalars(layer, "confidence", confidence);
        set_quality(layer, confidence);
    }
    keep_attributes(layer, image, row_of, column_of);
    if (!row_of.empty()) remember(layer, image, row_of, column_of, {});
    place(layer, pose);
    image.set_pose(pose);
}

}  // namespace srf
