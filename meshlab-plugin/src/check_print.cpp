// SPDX-License-Identifier: GPL-3.0-or-later
// The current layer is checked before it is printed: faces with faults are selected, walls are the quality of faces.
#include "filter.h"
#include "layer.h"
#include "parameters.h"
#include "reports.h"

namespace srf {
namespace {

Outputs run(Job &job)
{
    MeshModel *const layer = job.document.mm();
    if (layer == nullptr) refuse("There is no layer: open a mesh first");
    if (layer->cm.fn == 0) refuse("The layer " + quoted(*layer) + " has no faces: choose the mesh that is to be printed");
    surfrecon::CheckPrintParams params;
    read_parameters(job.parameters, check_print_parameters, &params);
    surfrecon::PrintReport report;
    const surfrecon::Mesh checked = mesh(*layer, Frame::world).checked_for_printing(params, &report, job.progress());

    const auto wall = checked.attribute<float>(SRF_DOMAIN_TRIANGLES, "wall");
    const auto crossing = checked.attribute<std::uint8_t>(SRF_DOMAIN_TRIANGLES, "crossing");
    const auto overhang = checked.attribute<std::uint8_t>(SRF_DOMAIN_TRIANGLES, "overhang");
    layer->updateDataMask(MeshModel::MM_FACEQUALITY);
    std::size_t place = 0;
    for (CFaceO &face : layer->cm.face) {
        if (face.IsD()) continue;
        face.Q() = static_cast<Scalarm>(wall[place][0]);
        if (crossing[place][0] != 0 || overhang[place][0] != 0) {
            face.SetS();
        } else {
            face.ClearS();
        }
        ++place;
    }
    log_figures(job, check_print_figures, &report);
    return values(check_print_figures, &report);
}

}  // namespace

void ask_check_print(const MeshDocument &document, RichParameterList &list)
{
    add_parameters(list, check_print_parameters, diagonal(document.mm()));
}

Outputs run_check_print(Job &job) { return run(job); }

}  // namespace srf
