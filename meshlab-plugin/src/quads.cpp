// SPDX-License-Identifier: GPL-3.0-or-later
// A range image becomes a regular grid of quads, dense where the surface bends, and the B-spline surface through it.
#include "filter.h"
#include "layer.h"
#include "parameters.h"
#include "range_layer.h"
#include "reports.h"

namespace srf {
namespace {

// The numbers of control points, which here are the grid's vertices.
const auto controls = {"rows", "columns"};

void parameters(const MeshDocument &document, RichParameterList &list)
{
    add_parameters(list, quads_parameters, diagonal(document.mm()));
    list.addParam(RichInt("surface_steps", 0, "Surface steps",
                          "Where it is not 0, another layer gets the B-spline surface through the grid, drawn in so many steps a quad. It "
                          "covers the whole image and continues the scan where nothing was measured."));
    add_parameters(list, spline_parameters, 1, controls);
}

// A whole number that must not be negative.
std::uint64_t count(const RichParameterList &given, const char *name)
{
    const int value = given.getInt(name);
    if (value < 0) refuse(std::string(name) + " must be at least 0, got " + std::to_string(value));
    return static_cast<std::uint64_t>(value);
}

// MeshLab keeps quads as pairs of triangles whose common edge is not drawn, and not written into files.
void hide_diagonals(MeshModel &layer)
{
    CMeshO &mesh = layer.cm;
    for (std::size_t q = 0; q + 1 < mesh.face.size(); q += 2) {
        CFaceO &first = mesh.face[q], &second = mesh.face[q + 1];
        for (int i = 0; i < 3; ++i) {
            for (int k = 0; k < 3; ++k) {
                if (first.V0(i) == second.V1(k) && first.V1(i) == second.V0(k)) {
                    first.SetF(i);
                    second.SetF(k);
                }
            }
        }
    }
    layer.updateDataMask(MeshModel::MM_POLYGONAL);
}

void set_texture(MeshModel &layer, const surfrecon::View<float, 2> &uvs)
{
    layer.updateDataMask(MeshModel::MM_VERTTEXCOORD);
    for (std::size_t i = 0; i < uvs.size(); ++i) {
        layer.cm.vert[i].T().U() = uvs[i][0];
        layer.cm.vert[i].T().V() = uvs[i][1];
    }
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
    surfrecon::QuadParams params;
    read_parameters(given, quads_parameters, &params);
    const std::uint64_t steps = count(given, "surface_steps");
    surfrecon::SplineParams spline_params;
    read_parameters(given, spline_parameters, &spline_params, controls);

    const surfrecon::Image image = range_image(*layer, Frame::layer);
    const auto [quads, report] = surfrecon::Quads::create(image, params, job.progress());
    // Before any layer is made: a refused order leaves the document as it was.
    surfrecon::Mesh surface;
    if (steps > 0) {
        const surfrecon::Spline spline = quads.spline(spline_params);
        surface = spline.sample((quads.rows() - 1) * steps + 1, (quads.cols() - 1) * steps + 1);
    }
    const std::string label = layer->label().toStdString();
    const surfrecon::Pose pose = placement(*layer);
    if (surface) place(add_layer(job.document, label + " surface", surface, "", image.pose()), pose);
    MeshModel &made = add_layer(job.document, label + " quads", quads.triangles(), "", image.pose());
    place(made, pose);
    hide_diagonals(made);
    set_texture(made, quads.uvs());

    job.log(std::to_string(quads.rows()) + " x " + std::to_string(quads.cols()) + " vertices, " + std::to_string(report.quads) +
            " quads on the surface");
    log_figures(job, quads_figures, &report);
    Outputs out = values(quads_figures, &report);
    out["rows"] = static_cast<int>(quads.rows());
    out["columns"] = static_cast<int>(quads.cols());
    return out;
}

}  // namespace

void ask_quads(const MeshDocument &document, RichParameterList &list) { parameters(document, list); }

Outputs run_quads(Job &job) { return run(job); }

}  // namespace srf
