// SPDX-License-Identifier: GPL-3.0-or-later
// What of the visible layers is kept: by a box, a plane or the selection; the background; their true size and the ground.
#include <algorithm>
#include <array>
#include <set>

#include "filter.h"
#include "layer.h"
#include "parameters.h"
#include "range_layer.h"
#include "visible.h"

namespace srf {
namespace {

using surfrecon::View;

// Whether a region of the world holds the vertices of a layer, by their place in it.
std::vector<bool> held(const MeshModel &layer, const surfrecon::Region &region)
{
    const LayerArrays flat = arrays(layer, Frame::world);
    std::vector<std::int32_t> places(flat.kept.begin(), flat.kept.end());
    surfrecon::Mesh points = surfrecon::Mesh::create(View<double, 3>(flat.positions.data(), places.size()), View<std::uint32_t, 3>());
    points.set_attribute(SRF_DOMAIN_VERTICES, "place", View<std::int32_t>(places.data(), places.size()));
    points.keep(region);
    std::vector<bool> found(layer.cm.vert.size());
    const auto left = points.attribute<std::int32_t>(SRF_DOMAIN_VERTICES, "place");
    for (std::size_t i = 0; i < left.size(); ++i) found[static_cast<std::size_t>(*left[i])] = true;
    return found;
}

std::vector<bool> selected(const MeshModel &layer)
{
    std::vector<bool> found(layer.cm.vert.size());
    for (std::size_t i = 0; i < found.size(); ++i) found[i] = !layer.cm.vert[i].IsD() && layer.cm.vert[i].IsS();
    return found;
}

// Takes vertices out of layers, which may be all of a layer's, but not all of all.
template <typename Marked>
Outputs remove(Job &job, const std::vector<MeshModel *> &layers, const Marked &marked, bool keep)
{
    std::vector<std::vector<bool>> gone;
    std::size_t removed = 0, left = 0;
    for (const MeshModel *layer : layers) {
        gone.push_back(marked(*layer));
        for (std::size_t i = 0; i < gone.back().size(); ++i) {
            if (layer->cm.vert[i].IsD()) continue;
            if (keep) gone.back()[i] = !gone.back()[i];
            ++(gone.back()[i] ? removed : left);
        }
    }
    if (left == 0) refuse("Nothing would be left of the layers, so nothing was changed: choose another region");
    for (std::size_t k = 0; k < layers.size(); ++k) {
        const int before = layers[k]->cm.vn;
        remove_vertices(*layers[k], gone[k]);
        job.log(quoted(*layers[k]) + ": " + std::to_string(before - layers[k]->cm.vn) + " of " + std::to_string(before) +
                " vertices removed");
    }
    Outputs out;
    out["removed"] = static_cast<int>(removed);
    out["left"] = static_cast<int>(left);
    return out;
}

std::vector<MeshModel *> layers_of(Job &job)
{
    auto layers = visible(job.document);
    if (layers.empty()) refuse("No layer with vertices is visible: make those visible that this is about");
    return layers;
}

std::array<double, 3> place_of(const RichParameterList &given, const char *name)
{
    const Point3m point = given.getPoint3m(name);
    return {point[0], point[1], point[2]};
}

// The box of a layer's vertices as it lies in the world.
surfrecon::Region box_of(const MeshModel &layer)
{
    if (layer.cm.vn == 0) refuse("The layer " + quoted(layer) + " has no vertices, so that it is no box: choose another");
    const Point3m low = layer.cm.bbox.min, high = layer.cm.bbox.max;
    surfrecon::Pose box;
    for (int axis = 0; axis < 3; ++axis) {
        box.matrix[5 * axis] = 0.5 * (static_cast<double>(high[axis]) - static_cast<double>(low[axis]));
        box.matrix[12 + axis] = 0.5 * (static_cast<double>(high[axis]) + static_cast<double>(low[axis]));
    }
    return surfrecon::Region::box(product(placement(layer), box));
}

double longest(const MeshDocument &document)
{
    double found = 0;
    for (const MeshModel *layer : visible(document)) found = std::max(found, diagonal(layer));
    return found > 0 ? found : 1;
}

namespace region {

enum { box, plane, selection };

void parameters(const MeshDocument &document, RichParameterList &list)
{
    list.addParam(RichEnum("region", box, {"Box of a layer", "Below a plane", "Selected vertices"}, "Region", "What the region is."));
    list.addParam(RichEnum("what", 0, {"Remove", "Keep"}, "What it holds", "Remove what the region holds, or keep it and remove all else."));
    list.addParam(compat::layer_parameter("box_layer", document, 1 << 20, "Box",
                                          "Its vertices' box, turned and placed by its matrix, is the region. It stays as it is."));
    list.addParam(compat::PlaceParameter("plane_point", Point3m(0, 0, 0), "Point of the plane", "In the world."));
    list.addParam(compat::DirectionParameter("plane_normal", Point3m(0, 0, 1), "Normal of the plane", "Points above: what is below goes."));
    const double most = longest(document);
    list.addParam(compat::LengthParameter("margin", 0, 0, static_cast<compat::Number>(most), "Margin",
                                          "What lies at most so far above the plane counts as below."));
}

Outputs run(Job &job)
{
    auto layers = layers_of(job);
    const bool keep = job.parameters.getEnum("what") == 1;
    const int kind = job.parameters.getEnum("region");
    if (kind == selection) {
        bool any = false;
        for (const MeshModel *layer : layers) {
            for (const bool is : selected(*layer)) any = any || is;
        }
        if (!any) refuse("No vertex is selected: select some, for example by painting, or choose another region");
        return remove(job, layers, selected, keep);
    }
    surfrecon::Region found;
    if (kind == box) {
        MeshModel *const of = compat::layer(job.parameters, "box_layer", job.document);
        if (of == nullptr) refuse("Choose the layer whose box is the region");
        found = box_of(*of);
        layers.erase(std::remove(layers.begin(), layers.end(), of), layers.end());
        if (layers.empty()) refuse("No layer but the box is visible: make those visible that this is about");
    } else {
        surfrecon::Plane plane;
        const auto point = place_of(job.parameters, "plane_point"), normal = place_of(job.parameters, "plane_normal");
        std::copy(point.begin(), point.end(), plane.point);
        std::copy(normal.begin(), normal.end(), plane.normal);
        plane.margin = length(job.parameters, "margin", false);
        found = surfrecon::Region::below(plane);
    }
    return remove(job, layers, [&](const MeshModel &layer) { return held(layer, found); }, keep);
}

}  // namespace region

// The plane that most vertices of layers lie on.
surfrecon::Plane plane_of(const std::vector<MeshModel *> &layers, const surfrecon::PlaneParams &params,
                          const surfrecon::ProgressFunction &progress)
{
    surfrecon::Aligner aligner;
    std::set<std::string> names;
    for (const MeshModel *layer : layers) {
        const std::string name = name_of(*layer, names);
        surfrecon::Image image;
        if (is_as_imported(*layer, Frame::world, image)) {
            aligner.add(image);
        } else if (layer->cm.fn > 0) {
            aligner.add(mesh(*layer, Frame::world), name);
        } else {
            const LayerArrays flat = arrays(*layer, Frame::world);
            aligner.add(surfrecon::Cloud::create(View<double, 3>(flat.positions.data(), flat.kept.size())), name);
        }
    }
    return aligner.dominant_plane(params, progress);
}

void tell(Job &job, const surfrecon::Plane &plane)
{
    job.log("The plane has " + shown(100 * plane.share) + " % of the vertices, which scatter by " + shown(plane.spread) +
            ", margin " + shown(plane.margin));
}

namespace background {

void parameters(const MeshDocument &document, RichParameterList &list) { add_parameters(list, plane_parameters, longest(document)); }

Outputs run(Job &job)
{
    const auto layers = layers_of(job);
    surfrecon::PlaneParams params;
    read_parameters(job.parameters, plane_parameters, &params);
    const surfrecon::Plane plane = plane_of(layers, params, job.progress(0, 0.8));
    const surfrecon::Region below = surfrecon::Region::below(plane);
    Outputs out = remove(job, layers, [&](const MeshModel &layer) { return held(layer, below); }, false);
    tell(job, plane);
    out["share"] = plane.share;
    out["spread"] = plane.spread;
    out["margin"] = plane.margin;
    return out;
}

}  // namespace background

namespace size_and_ground {

enum { as_it_is, found, picked };

void parameters(const MeshDocument &document, RichParameterList &list)
{
    list.addParam(RichFloat("distance", 0, "True distance", "How far apart the two places truly are. 0: sizes stay."));
    list.addParam(compat::PlaceParameter("a", Point3m(0, 0, 0), "First place", "In the world."));
    list.addParam(compat::PlaceParameter("b", Point3m(0, 0, 1), "Second place", "In the world."));
    list.addParam(RichEnum("ground", as_it_is, {"Stays", "The plane most vertices lie on", "Through three places"}, "Ground",
                           "What becomes the ground, at height 0."));
    const char *const names[] = {"ground_1", "ground_2", "ground_3"};
    const char *const labels[] = {"Ground, first place", "Ground, second place", "Ground, third place"};
    for (int k = 0; k < 3; ++k) {
        list.addParam(compat::PlaceParameter(names[k], Point3m(k == 1, k == 2, 0), labels[k],
                                             "In the world. Most vertices come to lie above."));
    }
    list.addParam(RichEnum("up", 0, {"z", "y"}, "Up", "The axis that points up from the ground."));
    (void)document;
}

// Through three places, so that most vertices lie above.
surfrecon::Plane through(const RichParameterList &given, const std::vector<MeshModel *> &layers)
{
    surfrecon::Plane plane =
        surfrecon::Plane::through({place_of(given, "ground_1"), place_of(given, "ground_2"), place_of(given, "ground_3")});
    long long above = 0;
    for (const MeshModel *layer : layers) {
        const LayerArrays flat = arrays(*layer, Frame::world);
        for (std::size_t i = 0; i < flat.positions.size(); i += 3) {
            double height = 0;
            for (int k = 0; k < 3; ++k) height += plane.normal[k] * (flat.positions[i + k] - plane.point[k]);
            above += height > 0 ? 1 : height < 0 ? -1 : 0;
        }
    }
    if (above < 0) {
        for (double &x : plane.normal) x = -x;
    }
    return plane;
}

Outputs run(Job &job)
{
    const auto layers = layers_of(job);
    const RichParameterList &given = job.parameters;
    const double distance = given.getFloat("distance");
    if (!(distance >= 0)) refuse("The true distance must be at least 0, got " + shown(distance));
    surfrecon::Pose size, ground;
    if (distance > 0) size = surfrecon::true_size(place_of(given, "a"), place_of(given, "b"), distance);
    const int kind = given.getEnum("ground");
    if (kind == as_it_is && distance == 0) refuse("Nothing is asked for: give the true distance, choose a ground, or both");
    const std::array<double, 3> up = given.getEnum("up") == 0 ? std::array<double, 3>{0, 0, 1} : std::array<double, 3>{0, 1, 0};
    if (kind == found) {
        const surfrecon::Plane plane = plane_of(layers, {}, job.progress());
        tell(job, plane);
        ground = surfrecon::ground(plane, up);
    } else if (kind == picked) {
        ground = surfrecon::ground(through(given, layers), up);
    }
    const surfrecon::Pose both = product(size, ground);
    const double scale = size.matrix[0];
    surfrecon::Pose smaller;
    for (int axis = 0; axis < 3; ++axis) smaller.matrix[5 * axis] = 1 / scale;
    for (MeshModel *layer : layers) {
        place(*layer, product(product(both, placement(*layer)), smaller));
        if (scale != 1) {
            scale_vertices(*layer, scale);
            scale_camera(*layer, scale);
        }
    }
    job.log(std::to_string(layers.size()) + " layers placed, lengths multiplied by " + shown(scale));
    Outputs out;
    out["scale"] = scale;
    return out;
}

}  // namespace size_and_ground

}  // namespace

extern const Filter region_filter = {
    "Keep or Remove by Box, Plane or Selection",
    "meshing_keep_or_remove_by_region",
    "Removes vertices of the <b>visible</b> layers, and the faces at them: those in the box of a layer, which can be turned by its "
    "matrix; those below a plane; or those selected, for example by painting. Or keeps these and removes all others. What lies on the border is "
    "inside. Range images stay such: what is removed are pixels of which nothing is known, through which a merge does not see.",
    compat::FilterBase::RangeMap | compat::FilterBase::Cleaning,
    compat::FilterBase::VARIABLE,
    region::parameters,
    region::run,
};

void ask_plane(const MeshDocument &document, RichParameterList &list) { background::parameters(document, list); }

Outputs run_plane(Job &job) { return background::run(job); }

extern const Filter size_and_ground_filter = {
    "True Size and Ground",
    "compute_matrix_by_true_size_and_ground",
    "Gives the <b>visible</b> layers their true size, by two picked places and their distance, and lays a plane to height 0: the one that most "
    "vertices lie on, or one through three picked places. All layers move alike; their matrices stay rigid, vertices are scaled.",
    compat::FilterBase::RangeMap | compat::FilterBase::Layer,
    compat::FilterBase::VARIABLE,
    size_and_ground::parameters,
    size_and_ground::run,
};

}  // namespace srf
