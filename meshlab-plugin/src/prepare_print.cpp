// SPDX-License-Identifier: GPL-3.0-or-later
// The closed current layer is made ready for printing. Each part becomes a layer, and faces that were added are selected.
#include "filter.h"
#include "layer.h"
#include "parameters.h"
#include "reports.h"

namespace srf {
namespace {

Outputs run(Job &job)
{
    const MeshModel *const layer = job.document.mm();
    if (layer == nullptr) refuse("There is no layer: open a mesh first");
    if (layer->cm.fn == 0) refuse("The layer " + quoted(*layer) + " has no faces: choose the mesh that is to be printed");
    surfrecon::PreparePrintParams params;
    read_parameters(job.parameters, prepare_print_parameters, &params);
    const std::string label = layer->label().toStdString() + " for printing";
    surfrecon::PrepareReport report;
    const surfrecon::Mesh whole = mesh(*layer, Frame::world).prepared_for_printing(params, &report, job.progress());

    for (std::size_t number = 0; number < report.parts; ++number) {
        const bool is_one = report.parts == 1;
        const surfrecon::Mesh part = is_one ? surfrecon::Mesh() : whole.part(number);
        const surfrecon::Mesh &printed = is_one ? whole : part;
        const auto added = printed.attribute<std::uint8_t>(SRF_DOMAIN_TRIANGLES, "added");
        MeshModel &made = add_layer(job.document, is_one ? label : label + " " + std::to_string(number + 1), printed, "");
        for (std::size_t i = 0; i < made.cm.face.size(); ++i) {
            if (added[i][0] != 0) made.cm.face[i].SetS();
        }
    }
    log_figures(job, prepare_print_figures, &report);
    return values(prepare_print_figures, &report);
}

}  // namespace

void ask_prepare_print(const MeshDocument &document, RichParameterList &list)
{
    add_parameters(list, prepare_print_parameters, diagonal(document.mm()));
}

Outputs run_prepare_print(Job &job) { return run(job); }

}  // namespace srf
