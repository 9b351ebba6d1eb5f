// SPDX-License-Identifier: GPL-3.0-or-later
// The corners of the faces of the current layer get texture coordinates.
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
    if (layer->cm.fn == 0) refuse("The layer " + quoted(*layer) + " has no faces: choose a mesh with a surface");
    surfrecon::UnwrapParams params;
    read_parameters(job.parameters, unwrap_parameters, &params);
    surfrecon::UnwrapReport report;
    const surfrecon::Mesh unwrapped = mesh(*layer, Frame::world).unwrapped(params, &report, job.progress());

    const std::vector<std::size_t> kept = arrays(*layer, Frame::world).kept;
    const auto triangles = unwrapped.triangles();
    const auto s = unwrapped.attribute<float>(SRF_DOMAIN_VERTICES, "s");
    const auto t = unwrapped.attribute<float>(SRF_DOMAIN_VERTICES, "t");
    const auto source = unwrapped.attribute<std::int32_t>(SRF_DOMAIN_VERTICES, "source_vertex");
    layer->updateDataMask(MeshModel::MM_WEDGTEXCOORD);
    std::size_t place = 0;
    for (CFaceO &face : layer->cm.face) {
        if (face.IsD()) continue;
        for (int k = 0; k < 3; ++k) {
            const std::size_t vertex = vcg::tri::Index(layer->cm, face.cV(k));
            // A placement that mirrors has turned the corners.
            const std::uint32_t *corner = triangles[place];
            while (kept[static_cast<std::size_t>(source[*corner][0])] != vertex) ++corner;
            face.WT(k).U() = s[*corner][0];
            face.WT(k).V() = t[*corner][0];
            face.WT(k).N() = 0;
        }
        ++place;
    }
    log_figures(job, unwrap_figures, &report);
    return values(unwrap_figures, &report);
}

}  // namespace

void ask_unwrap(const MeshDocument &document, RichParameterList &list)
{
    add_parameters(list, unwrap_parameters, diagonal(document.mm()));
}

Outputs run_unwrap(Job &job) { return run(job); }

}  // namespace srf
