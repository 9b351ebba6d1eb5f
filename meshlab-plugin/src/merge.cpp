// SPDX-License-Identifier: GPL-3.0-or-later
// The visible layers become one surface.
#include <cmath>
#include <set>

#include "filter.h"
#include "layer.h"
#include "parameters.h"
#include "range_layer.h"
#include "reports.h"
#include "visible.h"

namespace srf {
namespace {

// While it lives, the core's warnings go to the log: whether layers plainly do not lie where they belong.
struct Listening {
    explicit Listening(const Job &job)
    {
        surfrecon::set_log([&job](srf_log_level, const char *text) { job.log(text); });
    }
    ~Listening() { srf_set_log(nullptr, nullptr); }
    Listening(const Listening &) = delete;
    Listening &operator=(const Listening &) = delete;
};

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
    const double longest = diagonal(document);
    add_parameters(list, merge_parameters, longest);
    list.addParam(RichBool(
        "quality_as_confidence", false, "Quality is confidence",
        "Where layers overlap, vertices of higher quality count more. Layers with a custom vertex attribute "
        "<i>confidence</i>, as imported range images have it, use that in any case."));
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
    mesh.set_attribute(SRF_DOMAIN_VERTICES, "confidence", surfrecon::View<float>(weights.data(), weights.size()));
}

// The filled faces are selected, so that what nobody measured is told apart.
void select_filled(MeshModel &merged, const surfrecon::Mesh &surface)
{
    const auto fills = surface.attribute<uint8_t>(SRF_DOMAIN_TRIANGLES, "hole_fill");
    for (std::size_t i = 0; i < merged.cm.face.size(); ++i) {
        if (*fills[i] != 0) merged.cm.face[i].SetS();
    }
}

Outputs run(Job &job)
{
    const RichParameterList &given = job.parameters;
    const auto layers = visible(job.document);
    if (layers.empty()) {
        refuse("There is nothing to merge: load the aligned range images or meshes as layers, and make those to merge visible");
    }
    surfrecon::MergeParams params;
    read_parameters(given, merge_parameters, &params);
    surfrecon::Merger merger;
    std::set<std::string> names;
    for (const MeshModel *layer : layers) {
        const std::string name = name_of(*layer, names);
        surfrecon::Image image;
        if (is_as_imported(*layer, Frame::world, image)) {
            merger.add(image);
        } else if (layer->cm.fn > 0) {
            surfrecon::Mesh surface = mesh(*layer, Frame::world);
            if (given.getBool("quality_as_confidence")) use_quality(surface, *layer);
            merger.add(surface, name);
        } else if (has_grid(*layer)) {
            merger.add(range_image(*layer, Frame::world));
        } else {
            refuse("The layer " + quoted(*layer) + " has points only, and no grid that tells which of them are neighbours. " +
                   "Hide it, or import it from its file with \"" + import_name + "\"");
        }
    }

    surfrecon::InFiles files;
    files.only_if_needed = true;
    const Listening listening(job);
    const auto [surface, report] = merger.run_in_files(params, files, job.progress());
    if (surface.triangles().size() == 0) {
        refuse("Nothing is left of the surface: choose a smaller voxel, or keep smaller parts");
    }
    MeshModel &merged = add_layer(job.document, "Merged", surface, "confidence");
    if (report.filled_area != SRF_FROM_DATA) select_filled(merged, surface);

    job.log("Merged " + std::to_string(report.scans) + " layers, " + std::to_string(report.input_triangles) +
            " triangles, into " + std::to_string(surface.triangles().size()) + " triangles");
    if (report.in_files != 0) job.log("Memory was short, so the merge worked in temporary files");
    log_figures(job, merge_figures, &report);
    Outputs out = values(merge_figures, &report);
    out["triangles"] = static_cast<int>(surface.triangles().size());
    out["vertices"] = static_cast<int>(surface.positions().size());
    return out;
}

}  // namespace

void ask_merge(const MeshDocument &document, RichParameterList &list) { parameters(document, list); }

Outputs run_merge(Job &job) { return run(job); }

}  // namespace srf
