// SPDX-License-Identifier: GPL-3.0-or-later
// The vertices of a layer become a surface through them.
#include <array>
#include <cmath>

#include "filter.h"
#include "layer.h"
#include "parameters.h"
#include "range_layer.h"
#include "reports.h"

namespace srf {
namespace {

void parameters(const MeshDocument &document, RichParameterList &list)
{
    add_parameters(list, reconstruct_parameters, diagonal(document.mm()));
    list.addParam(RichBool("use_normals", false, "Turn to the normals",
                           "Turns the surface to the side that the layer's normals show; where points carry noise they also tell the sides of "
                           "thin walls apart, and what is inside. Otherwise closed surfaces are turned outwards, open ones up."));
}

Outputs run(Job &job)
{
    using surfrecon::View;
    const RichParameterList &given = job.parameters;
    const MeshModel *const layer = job.document.mm();
    if (layer == nullptr) refuse("There is no layer: open a file of points");
    surfrecon::ReconstructParams params;
    read_parameters(given, reconstruct_parameters, &params);

    const LayerArrays flat = arrays(*layer, Frame::layer, NotFinite::passed_on);
    const std::size_t count = flat.kept.size();
    std::vector<float> directions;
    if (given.getBool("use_normals")) directions = normals(*layer, flat);
    const std::vector<std::uint8_t> colours = vertex_colours(*layer, flat);
    const surfrecon::Cloud cloud = surfrecon::Cloud::create(
        View<double, 3>(flat.positions.data(), count), View<float, 3>(directions.data(), directions.size() / 3),
        View<std::uint8_t, 4>(colours.data(), colours.size() / 4));
    const std::array<double, 3> seen_from = sensor(*layer);
    const surfrecon::Reconstructor points = std::isnan(seen_from[0]) ? surfrecon::Reconstructor(cloud)
                                                                     : surfrecon::Reconstructor(cloud, View<double, 3>(seen_from.data(), 1));
    const auto [surface, report] = points.surface(params, job.progress());

    const std::string label = layer->label().toStdString() + " surface";
    const surfrecon::Pose pose = placement(*layer);
    MeshModel &made = add_layer(job.document, label, surface, "");
    place(made, pose);

    job.log(std::to_string(surface.triangles().size()) + " triangles through " + std::to_string(report.used) + " of " +
            std::to_string(report.points) + " points, taken as " + (report.closed ? "closed" : "open"));
    log_figures(job, reconstruct_figures, &report);
    Outputs out = values(reconstruct_figures, &report);
    return out;
}

}  // namespace

void ask_reconstruct(const MeshDocument &document, RichParameterList &list) { parameters(document, list); }

Outputs run_reconstruct(Job &job) { return run(job); }

}  // namespace srf
