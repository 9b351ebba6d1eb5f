// SPDX-License-Identifier: GPL-3.0-or-later
// The vertices of a layer become a surface through them.
#include "filter.h"
#include "layer.h"

namespace srf {
namespace {

void parameters(const MeshDocument &, RichParameterList &list)
{
    surfrecon::ReconstructParams defaults;
    list.addParam(RichFloat("factor", static_cast<compat::Number>(defaults.factor), "Factor",
                            "Makes the threshold on the perimeters of triangles larger, 1 to 2: closes more gaps, keeps more stray points."));
    list.addParam(RichEnum("threshold", 0, {"Spacing of the points around", "Mean of the surface"}, "Threshold",
                           "What the perimeter of a triangle is compared with. By the spacing around it, sparse parts may have large "
                           "triangles."));
    list.addParam(RichEnum("topology", 0, {"Manifold", "Free"}, "Topology",
                           "Manifold: at most two triangles at an edge, one fan of them at a vertex.<br>Free: carved by the threshold "
                           "alone, as in the paper: parts may touch, and points are lost."));
    list.addParam(RichEnum("closure", 0, {"Closed or open", "Closed", "Open"}, "Closure",
                           "Closed: gaps in the sampling are spanned by large triangles.<br>Open: triangles above the threshold are left "
                           "out, so that gaps stay open.<br>Closed or open: closed if a closed surface goes through more than half of the "
                           "points. Looked at with a manifold topology only."));
    list.addParam(RichBool("usenormals", false, "Turn to the normals",
                           "Turns the surface to the side that the layer's normals show. Otherwise closed surfaces are turned outwards, "
                           "open ones up."));
}

// The value of a choice, counted from 1 as in the library.
std::uint64_t chosen(const RichParameterList &given, const char *name) { return static_cast<std::uint64_t>(given.getEnum(name)) + 1; }

Outputs run(Job &job)
{
    using surfrecon::View;
    const RichParameterList &given = job.parameters;
    const MeshModel *const layer = job.document.mm();
    if (layer == nullptr) refuse("There is no layer: open a file of points");
    surfrecon::ReconstructParams params;
    params.factor = given.getFloat("factor");
    params.threshold = chosen(given, "threshold");
    params.topology = chosen(given, "topology");
    params.closure = chosen(given, "closure");

    const LayerArrays flat = arrays(*layer, Frame::layer, NotFinite::passed_on);
    const std::size_t count = flat.kept.size();
    std::vector<float> directions;
    if (given.getBool("usenormals")) directions = normals(*layer, flat);
    const std::vector<std::uint8_t> colours = vertex_colours(*layer, flat);
    const surfrecon::Cloud cloud = surfrecon::Cloud::create(
        View<double, 3>(flat.positions.data(), count), View<float, 3>(directions.data(), directions.size() / 3),
        View<std::uint8_t, 4>(colours.data(), colours.size() / 4));
    const auto [surface, report] = surfrecon::Reconstructor(cloud).surface(params, job.progress());

    const std::string label = layer->label().toStdString() + " surface";
    const surfrecon::Pose pose = placement(*layer);
    MeshModel &made = add_layer(job.document, label, surface, "");
    place(made, pose);

    job.log(std::to_string(surface.triangles().size()) + " triangles through " + std::to_string(report.used) + " of " +
            std::to_string(report.points) + " points, taken as " + (report.is_closed ? "closed" : "open"));
    job.log("Not on it: " + std::to_string(report.duplicates) + " copies, " + std::to_string(report.inside) + " inside, " +
            std::to_string(report.outside) + " outside, " + std::to_string(report.not_finite) + " that are no finite numbers");
    Outputs out;
    out["points"] = static_cast<int>(report.points);
    out["used"] = static_cast<int>(report.used);
    out["duplicates"] = static_cast<int>(report.duplicates);
    out["inside"] = static_cast<int>(report.inside);
    out["outside"] = static_cast<int>(report.outside);
    out["not_finite"] = static_cast<int>(report.not_finite);
    out["tetrahedra"] = static_cast<int>(report.tetrahedra);
    out["closed"] = report.is_closed != 0;
    out["threshold"] = report.threshold;
    out["cut_facets"] = static_cast<int>(report.cut_facets);
    return out;
}

}  // namespace

extern const Filter reconstruct_filter = {
    "Surface Reconstruction: Delaunay Carving",
    "generate_surface_reconstruction_delaunay_carving",
    "Makes a surface through the <b>vertices of the current layer</b>, whatever faces it has, over their 3D Delaunay "
    "tetrahedralization: closed or open, manifold, through every point the sampling lets it reach. Points are neither moved nor "
    "made; copies and vertices that are no finite numbers are left out and counted. The custom vertex attribute <i>source_point</i> says which point each vertex was.<br>"
    "The layer is not changed.<br><br>"
    "See:<br><i>A. Rodr\u00edguez, J. M. Espadero, D. L\u00f3pez, L. Pastor</i><br>"
    "<b>\"Delaunay surface reconstruction from scattered points\"</b><br>DGCI 2000, LNCS 1953",
    compat::FilterBase::Remeshing,
    compat::FilterBase::SINGLE_MESH,
    parameters,
    run,
};

}  // namespace srf
