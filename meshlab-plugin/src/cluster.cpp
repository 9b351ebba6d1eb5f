// SPDX-License-Identifier: GPL-3.0-or-later
// A dense surface becomes a coarse one of well-shaped triangles, or a chain of levels of detail.
#include <algorithm>
#include <cmath>

#include "filter.h"
#include "layer.h"

namespace srf {
namespace {

// Layers that a chain may have; each has a quarter of the vertices of the one before.
const int most_levels = 16;

double diagonal(const MeshModel *layer)
{
    const double found = layer == nullptr || layer->cm.bbox.IsNull() ? 0 : static_cast<double>(layer->cm.bbox.Diag());
    return std::isfinite(found) && found > 0 ? found : 1;
}

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
    list.addParam(RichInt("vertices", 0, "Vertices",
                          "Vertices wanted. More come only where the topology needs them.<br>0: a tenth of the layer's."));
    list.addParam(compat::LengthParameter(
        "maxerror", 0, 0, static_cast<Scalarm>(diagonal(document.mm())), "Largest error",
        "Where it is not 0, the number of vertices is not looked at: there are as many as it takes for every vertex of the layer to "
        "lie this near to the result."));
    list.addParam(RichFloat("adaptivity", 1, "Adaptivity",
                            "How much smaller triangles are where the surface bends, 0 to 2: 0 makes them alike everywhere."));
    list.addParam(RichInt("fitting", 0, "Fitting",
                          "Rounds in which vertices leave the surface for where it lies nearest: 1 takes a third off the mean error. 0 keeps them on it."));
    list.addParam(RichInt("levels", 1, "Levels of detail",
                          "Layers to make, each with a quarter of the vertices of the one before. Only without a largest error."));
}

Outputs run(Job &job)
{
    const RichParameterList &given = job.parameters;
    const MeshModel *const layer = job.document.mm();
    if (layer == nullptr) refuse("There is no layer: open a mesh first");
    if (layer->cm.vn == 0) refuse("The layer " + quoted(*layer) + " has no vertices");
    const int vertices = given.getInt("vertices"), levels = given.getInt("levels");
    if (vertices < 0) refuse("The number of vertices must be at least 0, got " + std::to_string(vertices));
    if (levels < 1 || levels > most_levels) {
        refuse("The number of levels must be 1 to " + std::to_string(most_levels) + ", got " + std::to_string(levels));
    }
    const double error = length(given, "maxerror");
    if (error != SRF_FROM_DATA && levels > 1) refuse("A largest error goes with one level: set one of them back");

    // Vertices without faces are points: the surface through them is clustered.
    const bool points = layer->cm.fn == 0;
    const surfrecon::Mesh dense = points ? surfrecon::Mesh() : mesh(*layer, Frame::layer);
    const surfrecon::Cloud scattered = points ? cloud(*layer) : surfrecon::Cloud();
    const std::string label = layer->label().toStdString() + " clustered";
    const surfrecon::Pose pose = placement(*layer);
    const auto count = static_cast<std::uint64_t>(std::max(vertices > 0 ? vertices : layer->cm.vn / 10, 1));
    surfrecon::ClusterParams params;
    params.adaptivity = given.getFloat("adaptivity");
    const int fitting = given.getInt("fitting");
    if (fitting < 0) refuse("The rounds of fitting must be at least 0, got " + std::to_string(fitting));
    params.fitting = static_cast<std::uint64_t>(fitting);
    Outputs out;
    if (levels > 1) {
        std::vector<std::uint64_t> counts{count};
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
    if (error == SRF_FROM_DATA) {
        params.vertices = count;
    } else {
        params.max_error = error;
    }
    surfrecon::ClusterReport report;
    const surfrecon::Mesh surface =
        points ? scattered.clustered(params, &report, job.progress()) : dense.clustered(params, &report, job.progress());
    place(add_layer(job.document, label, surface, ""), pose);
    const double degrees = 180 / std::acos(-1.0);
    job.log(std::to_string(report.vertices) + " vertices from " + std::to_string(report.patches) + " patches; smallest angles: mean " +
            shown(degrees * report.mean_smallest_angle) + " degrees, least " + shown(degrees * report.smallest_angle));
    if (report.kept_input != 0) job.log("Nothing coarser lies within the largest error: the result is a copy");
    out["vertices"] = static_cast<int>(report.vertices);
    out["triangles"] = static_cast<int>(report.triangles);
    out["patches"] = static_cast<int>(report.patches);
    out["cut_edges"] = static_cast<int>(report.cut_edges);
    out["off_surface"] = static_cast<int>(report.off_surface);
    out["mean_smallest_angle"] = report.mean_smallest_angle;
    out["smallest_angle"] = report.smallest_angle;
    if (report.max_error != SRF_FROM_DATA) out["max_error"] = report.max_error;
    return out;
}

}  // namespace

extern const Filter cluster_filter = {
    "Remeshing: Multiresolution Clustering",
    "meshing_multiresolution_clustering",
    "Replaces the dense surface in the current layer by one of <b>few, well-shaped triangles</b> of any number of vertices, with the "
    "same components, holes and genus. Patches of the surface are found by k-means, joined to a mesh, and relaxed on the surface. "
    "Of a layer without faces, the surface through its vertices is taken. The layer is not changed.<br>"
    "With several <b>levels</b>, a chain of layers from one run. Edges that are not manifold are cut.",
    compat::FilterBase::Remeshing,
    compat::FilterBase::SINGLE_MESH,
    parameters,
    run,
};

}  // namespace srf
