// SPDX-License-Identifier: GPL-3.0-or-later
// A dense surface becomes a coarse one of well-shaped triangles, or a chain of levels of detail.
#include <algorithm>
#include <cmath>

#include "filter.h"
#include "layer.h"
#include "parameters.h"
#include "reports.h"

namespace srf {
namespace {

// Layers that a chain may have; each has a quarter of the vertices of the one before.
const int most_levels = 16;

surfrecon::Cloud cloud(const MeshModel &layer)
{
    using surfrecon::View;
    const LayerArrays flat = arrays(layer, Frame::layer);
    const std::vector<std::uint8_t> colours = vertex_colours(layer, flat);
    return surfrecon::Cloud::create(View<double, 3>(flat.positions.data(), flat.kept.size()), View<float, 3>(),
                                    View<std::uint8_t, 4>(colours.data(), colours.size() / 4));
}

void parameters(const MeshDocument &document, RichParameterList &list)
{
    add_parameters(list, cluster_parameters, diagonal(document.mm()));
    list.addParam(RichInt("levels", 1, "Levels of detail",
                          "Layers to make, each with a quarter of the vertices of the one before. Only without a largest error and a number of patches or triangles."));
}

Outputs run(Job &job)
{
    const RichParameterList &given = job.parameters;
    const MeshModel *const layer = job.document.mm();
    if (layer == nullptr) refuse("There is no layer: open a mesh first");
    if (layer->cm.vn == 0) refuse("The layer " + quoted(*layer) + " has no vertices: choose another");
    const int levels = given.getInt("levels");
    surfrecon::ClusterParams params;
    read_parameters(given, cluster_parameters, &params);
    if (levels < 1 || levels > most_levels) {
        refuse("The number of levels must be 1 to " + std::to_string(most_levels) + ", got " + std::to_string(levels));
    }
    if (levels > 1 && (params.max_error != SRF_FROM_DATA || params.patches > 0 || params.triangles > 0)) {
        refuse("A largest error, or a number of patches or triangles, goes with one level: set one of them back");
    }

    // Vertices without faces are points: the surface through them is clustered.
    const bool points = layer->cm.fn == 0;
    const surfrecon::Mesh dense = points ? surfrecon::Mesh() : mesh(*layer, Frame::layer);
    const surfrecon::Cloud scattered = points ? cloud(*layer) : surfrecon::Cloud();
    const std::string label = layer->label().toStdString() + " clustered";
    const surfrecon::Pose pose = placement(*layer);
    Outputs out;
    if (levels > 1) {
        const auto tenth = static_cast<std::uint64_t>(std::max(layer->cm.vn / 10, 1));
        std::vector<std::uint64_t> counts{params.vertices > 0 ? params.vertices : tenth};
        while (static_cast<int>(counts.size()) < levels) counts.push_back(std::max<std::uint64_t>(counts.back() / 4, 1));
        const std::vector<surfrecon::Mesh> chain =
            points ? scattered.clustered(counts, params, job.progress()) : dense.clustered(counts, params, job.progress());
        for (std::size_t level = 0; level < chain.size(); ++level) {
            MeshModel &made = add_layer(job.document, label + " " + std::to_string(level), chain[level], "");
            place(made, pose);
            job.log(std::to_string(made.cm.vn) + " vertices, " + std::to_string(made.cm.fn) + " faces");
        }
        out["levels"] = levels;
        return out;
    }
    surfrecon::ClusterReport report;
    const surfrecon::Mesh surface =
        points ? scattered.clustered(params, &report, job.progress()) : dense.clustered(params, &report, job.progress());
    place(add_layer(job.document, label, surface, ""), pose);
    log_figures(job, cluster_figures, &report);
    for (const auto &figure : values(cluster_figures, &report)) out.insert(figure);
    return out;
}

}  // namespace

void ask_cluster(const MeshDocument &document, RichParameterList &list) { parameters(document, list); }

Outputs run_cluster(Job &job) { return run(job); }

}  // namespace srf
