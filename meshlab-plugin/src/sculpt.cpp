// SPDX-License-Identifier: GPL-3.0-or-later
// A range image becomes the mesh of few triangles within a tolerance.
#include "filter.h"
#include "layer.h"
#include "parameters.h"
#include "range_layer.h"
#include "reports.h"

namespace srf {
namespace {

void parameters(const MeshDocument &document, RichParameterList &list)
{
    add_parameters(list, sculpt_parameters, diagonal(document.mm()));
    list.addParam(RichInt(
        "max_triangles", 0, "At most so many triangles",
        "Where it is not 0, the tolerance is not looked at: the smallest one is found whose surface has at most so many triangles."));
}

Outputs run(Job &job)
{
    const RichParameterList &given = job.parameters;
    const MeshModel *const layer = job.document.mm();
    if (layer == nullptr) refuse("There is no layer: import a range image with \"" + std::string(import_name) + "\"");
    if (!has_grid(*layer)) {
        refuse("The layer " + quoted(*layer) + " is no range image: it lacks the custom vertex attributes range_row and range_col. " +
               "Import its file with \"" + import_name + "\"");
    }
    const int most = given.getInt("max_triangles");
    if (most < 0) refuse("The number of triangles must be at least 0, got " + std::to_string(most));

    const surfrecon::Image image = range_image(*layer, Frame::layer);
    surfrecon::SculptParams params;
    read_parameters(given, sculpt_parameters, &params);
    const surfrecon::Sculptor sculptor(image, params);
    const auto [surface, report] = most > 0 ? sculptor.at_most(static_cast<std::size_t>(most), job.progress())
                                                 : sculptor.refine(SRF_FROM_DATA, job.progress());
    const std::string label = layer->label().toStdString() + " sculpted";
    const surfrecon::Pose pose = placement(*layer);
    MeshModel &made = add_layer(job.document, label, surface, "error", image.pose());
    place(made, pose);

    log_figures(job, sculpt_figures, &report);
    const Outputs out = values(sculpt_figures, &report);
    return out;
}

}  // namespace

void ask_sculpt(const MeshDocument &document, RichParameterList &list) { parameters(document, list); }

Outputs run_sculpt(Job &job) { return run(job); }

}  // namespace srf
