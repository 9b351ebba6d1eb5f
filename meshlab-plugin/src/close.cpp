// SPDX-License-Identifier: GPL-3.0-or-later
// The openings of the surface in the current layer are closed, but not where a range image in another visible layer saw through.
#include "filter.h"
#include "layer.h"
#include "parameters.h"
#include "range_layer.h"
#include "reports.h"
#include "visible.h"

namespace srf {
namespace {

// The range images among the other visible layers. Other layers do not know where nothing is.
std::size_t add_scans(surfrecon::Merger &scans, const MeshDocument &document, const MeshModel &surface)
{
    std::size_t count = 0;
    for (const MeshModel *layer : visible(document)) {
        if (layer == &surface || !has_grid(*layer)) continue;
        scans.add(range_image(*layer, Frame::world));
        ++count;
    }
    return count;
}

Outputs run(Job &job)
{
    const MeshModel *const layer = job.document.mm();
    if (layer == nullptr) refuse("There is no layer: open a surface first");
    if (layer->cm.fn == 0) refuse("The layer " + quoted(*layer) + " has no faces: choose the surface whose openings are to be closed");
    surfrecon::CloseParams params;
    read_parameters(job.parameters, close_parameters, &params);
    surfrecon::Merger scans;
    const std::size_t count = add_scans(scans, job.document, *layer);
    const surfrecon::Mesh surface = mesh(*layer, Frame::world);
    const std::string label = layer->label().toStdString() + " closed";
    surfrecon::CloseReport report;
    const surfrecon::Mesh closed = scans.close(surface, params, &report, job.progress());

    MeshModel &made = add_layer(job.document, label, closed, "");
    // The faces of the surface come first.
    for (std::size_t i = surface.triangles().size(); i < made.cm.face.size(); ++i) made.cm.face[i].SetS();
    job.log(count == 0 ? "No other visible layer is a range image, so the shape of the surface alone decided"
                       : "Range images that say where nothing is: " + std::to_string(count));
    log_figures(job, close_figures, &report);
    return values(close_figures, &report);
}

}  // namespace

void ask_close(const MeshDocument &document, RichParameterList &list)
{
    add_parameters(list, close_parameters, diagonal(document.mm()));
}

Outputs run_close(Job &job) { return run(job); }

}  // namespace srf
