// SPDX-License-Identifier: GPL-3.0-or-later
// A program around MeshLab's own library and the plugin's range layers, which looks at what no filter shows: how the pixels of a layer
// see after all that users do to layers. Prints `ok` or what is wrong.
#include <QCoreApplication>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <stdexcept>
#include <string>
#include <vector>

#include "filter.h"
#include "range_layer.h"

namespace {

using srf::Frame;
using surfrecon::Image;
using surfrecon::Pose;
using surfrecon::View;

const std::size_t rows = 20, columns = 30, pixels = rows * columns;

void expect(bool holds, const std::string &what)
{
    if (!holds) throw std::runtime_error(what);
}

struct Kind {
    const char *name;
    srf_projection projection;
};

const Kind kinds[] = {
    {"orthographic", {SRF_PROJECTION_ORTHOGRAPHIC, 0, {-0.3, 0.2, 0.02, -0.02}}},
    {"pinhole depth", {SRF_PROJECTION_PINHOLE_DEPTH, 0, {60, 61, 15, 10}}},
    {"pinhole range", {SRF_PROJECTION_PINHOLE_RANGE, 0, {60, 61, 15, 10}}},
    {"spherical", {SRF_PROJECTION_SPHERICAL, 0, {-0.2, 0.2, 0.02, -0.02}}},
    {"parallel points", {SRF_PROJECTION_GRID_PARALLEL, 0, {0.6, 0, -0.8, 0}}},
    {"points from", {SRF_PROJECTION_GRID_FROM, 0, {0.1, 0.2, 3, 0}}},
};

bool is_points(const srf_projection &projection) { return projection.kind >= SRF_PROJECTION_GRID_PARALLEL; }

// Whether numbers are single, as MeshLab's matrices and vertices are in most builds.
bool single = false;
double stored(double x) { return single ? static_cast<double>(static_cast<float>(x)) : x; }

// Turns, scales, mirrors and moves.
Pose motion(double scale, bool mirrors, double far)
{
    const double turn[3][3] = {{0.36, 0.48, -0.8}, {-0.8, 0.6, 0}, {0.48, 0.64, 0.6}}, place[3] = {1, -2, 0.5};
    Pose made;
    for (int k = 0; k < 3; ++k) {
        for (int i = 0; i < 3; ++i) made.matrix[4 * i + k] = scale * turn[k][i] * (mirrors && i == 1 ? -1 : 1);
        made.matrix[12 + k] = far * place[k];
    }
    return made;
}

// A bent surface with two samples missing, with all attributes.
Image image_of(const srf_projection &projection)
{
    const double nan = std::nan("");
    std::vector<double> samples;
    std::vector<std::uint8_t> colours;
    std::vector<float> intensities, confidences;
    for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
        const double row = static_cast<double>(pixel / columns), column = static_cast<double>(pixel % columns);
        const double value = pixel == 0 || pixel == 77 ? nan : 2 + 0.1 * std::sin(0.2 * row) * std::cos(0.15 * column);
        if (is_points(projection)) samples.insert(samples.end(), {0.02 * column - 0.3, 0.2 - 0.02 * row, -value});
        else samples.push_back(value);
        for (int k = 0; k < 4; ++k) colours.push_back(static_cast<std::uint8_t>(pixel * 7 + 50 * k));
        intensities.push_back(static_cast<float>(pixel));
        confidences.push_back(static_cast<float>(1 / (1 + row)));
    }
    Image image = is_points(projection)
                      ? Image::create(rows, columns, projection, View<double, 3>(samples.data(), pixels), motion(1, false, 1))
                      : Image::create(rows, columns, projection, View<double>(samples.data(), pixels), motion(1, false, 1));
    const srf_array colour = View<std::uint8_t, 4>(colours.data(), pixels).array();
    const srf_array intensity = View<float>(intensities.data(), pixels).array();
    const srf_array confidence = View<float>(confidences.data(), pixels).array();
    surfrecon::check(srf_image_set_attributes(image.get(), &colour, &intensity, &confidence));
    return image;
}

MeshModel &layer_of(MeshDocument &document, const Image &image, bool faces = true)
{
    MeshModel &layer = *document.addNewMesh("", "scan", true);
    srf::fill_range_layer(layer, image, faces);
    expect(static_cast<std::size_t>(layer.cm.vn) == image.valid(), "a vertex a valid pixel");
    expect(faces == (layer.cm.fn > 0), "faces on request");
    return layer;
}

std::vector<double> moved(const std::vector<double> &points, const Pose &by)
{
    std::vector<double> there;
    const double *const m = by.matrix;
    for (std::size_t i = 0; i < points.size(); i += 3) {
        for (int k = 0; k < 3; ++k) there.push_back(m[k] * points[i] + m[4 + k] * points[i + 1] + m[8 + k] * points[i + 2] + m[12 + k]);
    }
    return there;
}

// Moves a layer by a matrix, in its matrix or, as Freeze Current Matrix does, in its vertices.
void move(MeshModel &layer, const Pose &by, bool frozen)
{
    Pose matrix = srf::product(by, srf::placement(layer));
    if (frozen) {
        for (CVertexO &vertex : layer.cm.vert) {
            const auto there = moved({vertex.cP()[0], vertex.cP()[1], vertex.cP()[2]}, matrix);
            vertex.P() = Point3m(there[0], there[1], there[2]);
        }
        matrix = {};
    }
    for (double &x : matrix.matrix) x = stored(x);
    srf::place(layer, matrix);
    for (CVertexO &vertex : layer.cm.vert) {
        for (int k = 0; k < 3; ++k) vertex.P()[k] = stored(vertex.cP()[k]);
    }
}

// Deletes vertices as MeshLab does, which leaves them marked.
void erase(MeshModel &layer, const std::vector<bool> &gone)
{
    for (CFaceO &face : layer.cm.face) {
        bool stays = true;
        for (int k = 0; k < 3; ++k) stays = stays && !gone[vcg::tri::Index(layer.cm, face.cV(k))];
        if (!face.IsD() && !stays) vcg::tri::Allocator<CMeshO>::DeleteFace(layer.cm, face);
    }
    for (std::size_t i = 0; i < gone.size(); ++i) {
        if (gone[i] && !layer.cm.vert[i].IsD()) vcg::tri::Allocator<CMeshO>::DeleteVertex(layer.cm, layer.cm.vert[i]);
    }
}

// The vertices by which motions are recognized, every so-manieth of them.
std::vector<bool> anchors(const MeshModel &layer, const Image &image, std::uint32_t every)
{
    const surfrecon::GridCamera camera = image.grid_camera();
    const std::vector<double> row = srf::scalars(layer, "range_row"), column = srf::scalars(layer, "range_col");
    std::vector<bool> found(layer.cm.vert.size());
    for (std::size_t i = 0; i < found.size(); ++i) {
        for (std::uint32_t k = 0; k < camera.anchor_count; k += every) {
            found[i] = found[i] || (camera.anchors[k].row == row[i] && camera.anchors[k].col == column[i]);
        }
    }
    return found;
}

// The same, and vertices all over the image.
std::vector<bool> some(const MeshModel &layer, const Image &image, std::uint32_t every)
{
    std::vector<bool> gone = anchors(layer, image, every);
    for (std::size_t i = 0; i < gone.size(); i += 7) gone[i] = true;
    return gone;
}

template <typename T>
bool same_where_valid(const srf_array &a, const srf_array &b, const std::vector<double> &points)
{
    if (a.count != pixels || b.count != pixels || a.components != b.components) return false;
    for (std::size_t i = 0; i < pixels * a.components; ++i) {
        if (std::isnan(points[3 * (i / a.components)])) continue;
        if (static_cast<const T *>(a.data)[i] != static_cast<const T *>(b.data)[i]) return false;
    }
    return true;
}

// Whether an image is `of`, moved, less the vertices that its layer lost.
void compare(const Image &image, const MeshModel &layer, const Image &of, const Pose &by)
{
    const std::uint32_t kind = image.projection().kind;
    expect(kind == of.projection().kind, "the projection is of another kind: " + std::to_string(kind));
    expect(image.rows() == rows && image.cols() == columns, "the grid has another size");
    expect(image.valid() == static_cast<std::size_t>(layer.cm.vn), "a valid pixel a vertex");
    expect(srf::is_rigid(image.pose()), "the pose is not rigid");
    expect(image.name() == "scan", "the image has the layer's name");
    const std::vector<double> points = image.world_points(), wanted = moved(of.world_points(), by);
    double largest = 0, off = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
        if (std::isnan(points[i])) continue;
        largest = std::max(largest, std::abs(wanted[i]));
        off = std::max(off, std::isnan(wanted[i]) ? INFINITY : std::abs(points[i] - wanted[i]));
    }
    // Grids of points are in single precision whatever the host's is.
    const double room = single || is_points(of.projection()) ? 2e-6 : 1e-9;
    expect(off <= room * largest, "samples are off by " + std::to_string(off / largest) + " of the largest coordinate");
    srf_array a[3]{}, b[3]{};
    surfrecon::check(srf_image_attributes(image.get(), &a[0], &a[1], &a[2]));
    surfrecon::check(srf_image_attributes(of.get(), &b[0], &b[1], &b[2]));
    expect(same_where_valid<std::uint8_t>(a[0], b[0], points), "colours are others");
    expect(same_where_valid<float>(a[1], b[1], points), "intensities are others");
    expect(same_where_valid<float>(a[2], b[2], points), "confidences are others");
}

void round_trips(const Kind &kind)
{
    const Image image = image_of(kind.projection);
    const std::size_t faces = image.triangulate().triangles().size();
    for (const double scale : {1.0, 0.3, 250.0}) {
        for (int choice = 0; choice < 24; ++choice) {
            const bool mirrors = choice & 1, frozen = choice & 2;
            single = choice & 4;
            const int deleting = choice / 8;
            const Pose by = motion(scale, mirrors, 3 * scale);
            MeshDocument document;
            MeshModel &layer = layer_of(document, image);
            move(layer, {}, false);
            try {
                if (deleting == 1) srf::remove_vertices(layer, some(layer, image, 1));
                move(layer, by, frozen);
                if (deleting == 2) erase(layer, some(layer, image, 2));
                const Image again = srf::range_image(layer, Frame::world);
                compare(again, layer, image, by);
                const std::size_t left = again.triangulate().triangles().size();
                expect(deleting == 2 || left == static_cast<std::size_t>(layer.cm.fn), "all faces are there");
                expect(deleting > 0 || left == faces, "faces are those that were imported");
                // Once more: what was recognized is remembered with what is left.
                if (deleting == 1) {
                    std::vector<bool> gone(layer.cm.vert.size());
                    std::fill(gone.begin(), gone.begin() + 100, true);
                    srf::remove_vertices(layer, gone);
                    move(layer, motion(1 / scale, mirrors, 1), !frozen);
                    compare(srf::range_image(layer, Frame::world), layer, image, srf::product(motion(1 / scale, mirrors, 1), by));
                }
            } catch (const std::exception &error) {
                throw std::runtime_error("scaled by " + std::to_string(scale) + (mirrors ? ", mirrored" : "") + (frozen ? ", frozen" : "") +
                                         (single ? ", in single precision" : "") + (deleting == 1 ? ", cropped" : "") +
                                         (deleting == 2 ? ", deleted from" : "") + ": " + error.what());
            }
        }
    }
    single = false;
}

// A layer that was not moved is the same to the last bit, and the sensor is where it was, in the layer's frame.
void untouched(const Kind &kind)
{
    const Image image = image_of(kind.projection);
    MeshDocument document;
    MeshModel &layer = layer_of(document, image, false);
    const Image again = srf::range_image(layer, Frame::layer);
    const srf_projection projection = again.projection();
    expect(std::equal(projection.numbers, projection.numbers + 4, kind.projection.numbers), "the projection has other numbers");
    expect(again.pose().matrix[0] == 1 && again.pose().matrix[12] == 0, "the sensor is not where the layer has its origin");
    Image here = image_of(kind.projection);
    here.set_pose({});
    compare(again, layer, here, {});
    srf::scale_vertices(layer, 2.5);
    srf::scale_camera(layer, 2.5);
    Pose larger;
    for (int k = 0; k < 3; ++k) larger.matrix[5 * k] = 2.5;
    compare(srf::range_image(layer, Frame::layer), layer, here, larger);
    // A single vertex tells no scale.
    std::vector<bool> gone(layer.cm.vert.size(), true);
    gone[pixels / 2] = false;
    srf::remove_vertices(layer, gone);
    srf::scale_vertices(layer, 0.4);
    srf::scale_camera(layer, 0.4);
    compare(srf::range_image(layer, Frame::layer), layer, here, {});
}

// Vertices that are not where their pixels see are points, seen from where they were.
void stretched(const Kind &kind)
{
    const Image image = image_of(kind.projection);
    for (const bool frozen : {false, true}) {
        MeshDocument document;
        MeshModel &layer = layer_of(document, image);
        Pose by = motion(1, false, 1);
        for (int k = 0; k < 3; ++k) by.matrix[k] *= 2;
        move(layer, by, frozen);
        const Image again = srf::range_image(layer, Frame::world);
        expect(is_points(again.projection()) && again.valid() == image.valid(), "a stretched image is one of points");
        const std::vector<double> points = again.world_points(), wanted = moved(image.world_points(), by);
        for (std::size_t i = 0; i < points.size(); ++i) {
            expect(std::isnan(wanted[i]) || std::abs(points[i] - wanted[i]) < 1e-5, "a stretched image lies where its vertices do");
        }
        expect(again.triangulate().triangles().size() > 0, "it is seen from its front");
    }
}

std::string refusal(const MeshModel &layer)
{
    try {
        srf::range_image(layer, Frame::layer);
        return {};
    } catch (const MLException &error) {
        return error.what();
    }
}

// A patch that MeshLab left, with none of the vertices by which motions are recognized.
void lost(const Kind &kind)
{
    for (const bool faces : {true, false}) {
        MeshDocument document;
        MeshModel &layer = layer_of(document, image_of(kind.projection), faces);
        erase(layer, anchors(layer, image_of(kind.projection), 1));
        const std::uint32_t seen = is_points(kind.projection) ? std::uint32_t{SRF_PROJECTION_GRID_PARALLEL} : kind.projection.kind;
        const bool refused = is_points(kind.projection) && !faces;
        expect(refused || srf::range_image(layer, Frame::layer).projection().kind == seen, "what lies on its rays was not moved");
        move(layer, motion(1, false, 1), true);
        const std::string said = refusal(layer);
        expect(faces == said.empty(), "without faces nothing tells from where it is seen: " + said);
        if (!faces) {
            expect(said.find("\"scan\" was seen, and it has no faces to tell") != std::string::npos, said);
            continue;
        }
        const Image again = srf::range_image(layer, Frame::layer);
        expect(again.projection().kind == SRF_PROJECTION_GRID_PARALLEL, "it is seen from where its surface faces");
        expect(again.valid() == static_cast<std::size_t>(layer.cm.vn), "a valid pixel a vertex");
        expect(again.triangulate().triangles().size() > 0, "it is seen from its front");
    }
}

// Refusals name the layer.
void refusals(const Kind &kind)
{
    MeshDocument document;
    MeshModel &layer = layer_of(document, image_of(kind.projection));
    std::vector<double> column = srf::scalars(layer, "range_col");
    const double first = column[0];
    column[0] = column[1];
    srf::set_scalars(layer, "range_col", column);
    expect(refusal(layer).find("Two vertices of the layer \"scan\" are the pixel in row 0, column 2") == 0, refusal(layer));
    column[0] = first;
    srf::set_scalars(layer, "range_col", column);
    for (CVertexO &vertex : layer.cm.vert) vertex.P() = Point3m(1, 2, 3);
    expect(refusal(layer).find("The layer \"scan\" can't be taken as a range image: all vertices lie in one place") == 0, refusal(layer));
}

}  // namespace

int main(int count, char **arguments)
{
    QCoreApplication application(count, arguments);
    bool good = true;
    for (const Kind &kind : kinds) {
        for (void (*const test)(const Kind &) : {round_trips, untouched, stretched, lost, refusals}) {
            try {
                test(kind);
            } catch (const std::exception &error) {
                std::printf("%s: %s\n", kind.name, error.what());
                good = false;
            }
        }
    }
    if (good) std::puts("ok");
    return good ? 0 : 1;
}
