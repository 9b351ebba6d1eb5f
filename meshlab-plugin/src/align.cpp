// SPDX-License-Identifier: GPL-3.0-or-later
// The visible layers come to one frame: their matrices are found.
#include <algorithm>

#include "filter.h"
#include "layer.h"
#include "parameters.h"
#include "range_layer.h"
#include "reports.h"
#include "visible.h"

namespace srf {
namespace {

void parameters(const MeshDocument &document, RichParameterList &list)
{
    // Layers may lie far from each other: shares of lengths are of the largest one's diagonal.
    double longest = 0;
    for (const MeshModel *layer : visible(document)) longest = std::max(longest, diagonal(layer));
    add_parameters(list, align_parameters, longest > 0 ? longest : 1);
}

// A layer among the scans; its range image, if it is one, has a frame of its own.
struct Placed {
    MeshModel *layer;
    surfrecon::Pose layer_from_scan;
};

bool has_normals(const std::vector<float> &normals)
{
    return std::any_of(normals.begin(), normals.end(), [](float x) { return x != 0; });
}

surfrecon::Cloud cloud(const MeshModel &layer)
{
    using surfrecon::View;
    const LayerArrays flat = arrays(layer, Frame::layer);
    const std::vector<float> directions = normals(layer, flat);
    if (!has_normals(directions)) {
        refuse("The layer " + quoted(layer) + " has points only, and no normals that tell its outside. Compute them with " +
               "Compute Normals for Point Sets, hide it, or import it from its file with \"" + import_name + "\".");
    }
    const std::size_t count = flat.kept.size();
    return surfrecon::Cloud::create(View<double, 3>(flat.positions.data(), count), View<float, 3>(directions.data(), count), {},
                                    placement(layer));
}

Placed add(surfrecon::Aligner &aligner, MeshModel &layer, const std::string &name)
{
    const surfrecon::Pose world_from_layer = placement(layer);
    if (!is_rigid(world_from_layer)) {
        refuse("The layer " + quoted(layer) + " is scaled, sheared or mirrored by its matrix: apply that with Matrix: Freeze " +
               "Current Matrix first, since alignment turns and shifts only");
    }
    surfrecon::Image image;
    if (is_as_imported(layer, Frame::layer, image) || (layer.cm.fn == 0 && has_grid(layer))) {
        if (!image) image = range_image(layer, Frame::layer);
        const surfrecon::Pose layer_from_sensor = image.pose();
        image.set_pose(product(world_from_layer, layer_from_sensor));
        aligner.add(image);
        return {&layer, layer_from_sensor};
    }
    if (layer.cm.fn > 0) {
        aligner.add(mesh(layer, Frame::layer), name, world_from_layer);
    } else {
        aligner.add(cloud(layer), name);
    }
    return {&layer, {}};
}

Outputs run(Job &job)
{
    const auto layers = visible(job.document);
    const auto current = std::find(layers.begin(), layers.end(), job.document.mm());
    if (layers.size() < 2) {
        refuse("Aligning takes at least two layers: load the scans as layers, and make those to align visible");
    }
    if (current == layers.end()) {
        refuse("The current layer stays where it is, so it must be one of those that are aligned: make it visible, or choose another");
    }
    surfrecon::AlignParams params;
    read_parameters(job.parameters, align_parameters, &params);
    surfrecon::Aligner aligner;
    std::set<std::string> names;
    std::vector<Placed> scans;
    for (MeshModel *layer : layers) scans.push_back(add(aligner, *layer, name_of(*layer, names)));
    aligner.fix(static_cast<std::size_t>(current - layers.begin()));

    const surfrecon::Alignment alignment = aligner.run(params, job.progress());
    for (std::size_t i = 0; i < scans.size(); ++i) {
        const surfrecon::AlignedScan found = alignment.scan(i);
        if (found.state != SRF_SCAN_STATE_PLACED) continue;
        place(*scans[i].layer, product(found.world_from_scan, inverse(scans[i].layer_from_scan)));
    }

    for (const std::string &line : alignment.lines()) job.log(line);
    const surfrecon::AlignReport report = alignment.report();
    return values(align_figures, &report);
}

}  // namespace

void ask_align(const MeshDocument &document, RichParameterList &list) { parameters(document, list); }

Outputs run_align(Job &job) { return run(job); }

}  // namespace srf
