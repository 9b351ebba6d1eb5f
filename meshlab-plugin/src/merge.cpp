// SPDX-License-Identifier: GPL-3.0-or-later
// The visible layers become one surface.
#include <cmath>
#include <set>

#include "filter.h"
#include "layer.h"
#include "range_layer.h"

namespace srf {
namespace {

std::vector<const MeshModel *> visible(const MeshDocument &document)
{
    std::vector<const MeshModel *> found;
    for (const MeshModel *layer : compat::layers(document)) {
        if (layer->isVisible() && layer->cm.vn > 0) found.push_back(layer);
    }
    return found;
}

// Shares of lengths are of the diagonal of what is merged.
double diagonal(const MeshDocument &document)
{
    Box3m box;
    for (const MeshModel *layer : visible(document)) box.Add(layer->cm.Tr, layer->cm.bbox);
    const double found = box.IsNull() ? 0 : box.Diag();
    return std::isfinite(found) && found > 0 ? found : 1;
}

void parameters(const MeshDocument &document, RichParameterList &list)
{
    const auto longest = static_cast<Scalarm>(diagonal(document));
    list.addParam(compat::LengthParameter(
        "voxel", 0, 0, longest, "Voxel side",
        "Size of a cell of the grid. Smaller keeps more detail and costs time and memory with its inverse square.<br>"
        "0: measured from the data, three times the mean distance of neighbouring samples."));
    list.addParam(compat::LengthParameter(
        "mergedistance", 0, 0, longest, "Merge distance",
        "Surfaces of different layers closer than this, facing the same way, become one. Choose it above the residual of the "
        "alignment and below the thinnest wall.<br>0: from the voxel and the measured distance between overlapping layers."));
    list.addParam(RichBool("closeholes", true, "Close holes", "Close the holes whose border is not longer than the next value."));
    list.addParam(compat::LengthParameter(
        "maxholelength", 0, 0, 4 * longest, "Longest border to close",
        "Holes with a longer border stay open.<br>0: 100 voxels, but at most a fifth of the diagonal of the surface."));
    list.addParam(RichFloat(
        "mincomponentpercent", 1, "Smallest part (%)",
        "Connected parts with fewer triangles than this share of the largest part's are dropped, in per cent. 0 keeps all."));
    list.addParam(RichBool(
        "qualityasconfidence", false, "Quality is confidence",
        "Where layers overlap, vertices of higher quality count more. Layers with a custom vertex attribute "
        "<i>confidence</i>, as imported range images have it, use that in any case."));
}

// Names break ties, so that the order of the layers does not matter: they have to differ.
std::string name_of(const MeshModel &layer, std::set<std::string> &taken)
{
    const std::string label = layer.label().toStdString();
    std::string name = label;
    for (int k = 2; !taken.insert(name).second; ++k) name = label + " (" + std::to_string(k) + ")";
    return name;
}

void use_quality(surfrecon::Mesh &mesh, const MeshModel &layer)
{
    if (!layer.hasDataMask(MeshModel::MM_VERTQUALITY) || !scalars(layer, "confidence").empty()) return;
    std::vector<float> weights;
    for (const CVertexO &vertex : layer.cm.vert) {
        if (vertex.IsD()) continue;
        if (!std::isfinite(vertex.cQ()) || vertex.cQ() < 0) {
            refuse("The quality of vertex " + std::to_string(&vertex - &layer.cm.vert[0]) + " of the layer " + quoted(layer) +
                   " is " + std::to_string(vertex.cQ()) + ": as confidence it must be at least 0");
        }
        weights.push_back(static_cast<float>(vertex.cQ()));
    }
    mesh.set_attribute(SRF_VERTICES, "confidence", surfrecon::View<float>(weights.data(), weights.size()));
}

Outputs run(Job &job)
{
    const RichParameterList &given = job.parameters;
    const auto layers = visible(job.document);
    if (layers.empty()) {
        refuse("There is nothing to merge: load the aligned range images or meshes as layers, and make those to merge visible");
    }
    surfrecon::Merger merger;
    std::set<std::string> names;
    for (const MeshModel *layer : layers) {
        const std::string name = name_of(*layer, names);
        if (layer->cm.fn > 0) {
            surfrecon::Mesh surface = mesh(*layer, Frame::world);
            if (given.getBool("qualityasconfidence")) use_quality(surface, *layer);
            merger.add(surface, name);
        } else if (has_grid(*layer)) {
            const surfrecon::Mesh surface = range_image(*layer, Frame::world).triangulate();
            merger.add(surface, name);
        } else {
            refuse("The layer " + quoted(*layer) + " has points only, and no grid that tells which of them are neighbours. " +
                   "Hide it, or import it from its file with \"" + import_name + "\"");
        }
    }

    surfrecon::MergeParams params;
    params.voxel = length(given, "voxel");
    params.merge_distance = length(given, "mergedistance");
    params.max_hole_length = given.getBool("closeholes") ? length(given, "maxholelength") : 0.0;
    params.min_component_share = given.getFloat("mincomponentpercent") / 100.0;
    const auto [surface, report] = merger.run(params, job.progress());
    if (surface.triangles().size() == 0) {
        refuse("Nothing is left of the surface: choose a smaller voxel, or keep smaller parts");
    }
    add_layer(job.document, "Merged", surface, "confidence");

    job.log("Merged " + std::to_string(report.scans) + " layers, " + std::to_string(report.input_triangles) +
            " triangles, into " + std::to_string(surface.triangles().size()) + " triangles");
    job.log("Voxel " + shown(report.voxel) + ", merge distance " + shown(report.merge_distance));
    job.log(std::to_string(report.holes_closed) + " holes closed, " + std::to_string(report.holes_open) + " left open; " +
            std::to_string(report.dropped_components) + " small parts dropped");
    Outputs out;
    out["layers"] = static_cast<int>(report.scans);
    out["input_triangles"] = static_cast<int>(report.input_triangles);
    out["triangles"] = static_cast<int>(surface.triangles().size());
    out["vertices"] = static_cast<int>(surface.positions().size());
    out["voxel"] = report.voxel;
    out["merge_distance"] = report.merge_distance;
    out["max_hole_length"] = report.max_hole_length;
    if (report.overlap_residual >= 0) out["overlap_residual"] = report.overlap_residual;
    out["holes_closed"] = static_cast<int>(report.holes_closed);
    out["holes_open"] = static_cast<int>(report.holes_open);
    out["dropped_components"] = static_cast<int>(report.dropped_components);
    return out;
}

}  // namespace

extern const Filter merge_filter = {
    "Surface Reconstruction: Marching Intersections",
    "generate_surface_reconstruction_marching_intersections",
    "Merges the <b>visible</b> layers, aligned range images or any oriented meshes, into one welded surface with colour and "
    "confidence. Where they overlap they are fused; every other vertex stays on a line through the original surface. Boundaries "
    "are kept, small holes are closed, and the result does not depend on the order of the layers or the number of processors.<br>"
    "Layers are taken where their matrices place them, and are not changed. No file is written.<br><br>"
    "See:<br><i>C. Rocchini, P. Cignoni, F. Ganovelli, C. Montani, P. Pingi, R. Scopigno</i><br>"
    "<b>\"The Marching Intersections algorithm for merging range images\"</b><br>The Visual Computer 20, 2004",
    compat::FilterBase::RangeMap | compat::FilterBase::Remeshing,
    compat::FilterBase::VARIABLE,
    parameters,
    run,
};

}  // namespace srf
