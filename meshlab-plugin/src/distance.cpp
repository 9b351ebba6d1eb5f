// SPDX-License-Identifier: GPL-3.0-or-later
// How far one layer lies from another: exact at the vertices, with a bound that holds everywhere between them.
#include <algorithm>
#include <cmath>

#include "filter.h"
#include "layer.h"

namespace srf {
namespace {

using surfrecon::View;

// Points measured between the vertices to tighten the bound: as a multiple of the number of vertices, and at least.
const std::size_t refinement_budget = 16, least_budget = 100000;

void parameters(const MeshDocument &document, RichParameterList &list)
{
    list.addParam(compat::layer_parameter(
        "measured", document, 0, "Measured layer", "Distances are from its vertices. It is copied; the copy has them as quality."));
    list.addParam(compat::layer_parameter("reference", document, 1, "Reference layer", "Distances are to its surface: it must have faces."));
    list.addParam(RichBool("signed", false, "Signed", "Distances behind the reference are negative."));
    list.addParam(RichBool("both_ways", false, "Both ways",
                           "Also measures from the reference to the measured layer; both have to have faces then."));
}

double size(const double *a, const double *b) { return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]); }

// A triangle by its corners and their distances.
struct Patch {
    double corner[3][3];
    double distance[3];

    double largest() const { return *std::max_element(distance, distance + 3); }

    // No point of the triangle is farther: every one is at most the longest edge over the square root of 3 from a corner, and
    // distances change no faster than the point moves.
    double bound() const
    {
        const double edges[3] = {size(corner[1], corner[2]), size(corner[2], corner[0]), size(corner[0], corner[1])};
        double least = largest() + *std::max_element(edges, edges + 3) / std::sqrt(3.0);
        for (int k = 0; k < 3; ++k) least = std::min(least, distance[k] + std::max(edges[(k + 1) % 3], edges[(k + 2) % 3]));
        return least;
    }
};

struct Measured {
    surfrecon::DistanceReport figures;
    std::vector<double> distances;
    double reached;  // the largest distance that was found, between the vertices too
    double bound;    // no point of the surface is farther
};

Measured measure(const LayerArrays &from, const surfrecon::Mesh &to, bool is_signed, const surfrecon::ProgressFunction &progress)
{
    const std::size_t count = from.kept.size();
    Measured found;
    found.distances.resize(count);
    found.figures = to.distances(View<double, 3>(from.positions.data(), count), found.distances.data(), is_signed, progress);
    found.reached = found.bound = found.figures.max;

    std::vector<Patch> patches;
    for (std::size_t i = 0; i < from.triangles.size(); i += 3) {
        Patch patch;
        for (int k = 0; k < 3; ++k) {
            const std::size_t vertex = from.triangles[i + k];
            std::copy_n(&from.positions[3 * vertex], 3, patch.corner[k]);
            patch.distance[k] = std::abs(found.distances[vertex]);
        }
        patches.push_back(patch);
    }
    // Triangles that may hold the farthest point are split until they can't by more than a hundredth, or the budget is spent.
    std::size_t budget = std::max(refinement_budget * count, least_budget);
    for (;;) {
        const double enough = 1.01 * found.reached;
        patches.erase(std::remove_if(patches.begin(), patches.end(), [&](const Patch &p) { return p.bound() <= enough; }), patches.end());
        found.bound = enough;
        for (const Patch &patch : patches) found.bound = std::max(found.bound, patch.bound());
        if (patches.empty() || 3 * patches.size() > budget) break;
        budget -= 3 * patches.size();

        std::vector<double> middles;
        middles.reserve(9 * patches.size());
        for (const Patch &p : patches) {
            for (int k = 0; k < 3; ++k) {
                for (int axis = 0; axis < 3; ++axis) {
                    middles.push_back(0.5 * p.corner[(k + 1) % 3][axis] + 0.5 * p.corner[(k + 2) % 3][axis]);
                }
            }
        }
        std::vector<double> distances(middles.size() / 3);
        to.distances(View<double, 3>(middles.data(), distances.size()), distances.data(), false, progress);
        std::vector<Patch> smaller;
        smaller.reserve(4 * patches.size());
        for (std::size_t i = 0; i < patches.size(); ++i) {
            const double *const m = &middles[9 * i], *const d = &distances[3 * i];
            Patch centre;
            for (int k = 0; k < 3; ++k) {
                // The one at corner k, and the middles of the edges that meet there.
                Patch at;
                const int a = (k + 1) % 3, b = (k + 2) % 3;
                std::copy_n(patches[i].corner[k], 3, at.corner[0]);
                std::copy_n(m + 3 * b, 3, at.corner[1]);
                std::copy_n(m + 3 * a, 3, at.corner[2]);
                at.distance[0] = patches[i].distance[k];
                at.distance[1] = d[b];
                at.distance[2] = d[a];
                smaller.push_back(at);
                std::copy_n(m + 3 * k, 3, centre.corner[k]);
                centre.distance[k] = d[k];
            }
            smaller.push_back(centre);
            found.reached = std::max(found.reached, centre.largest());
        }
        patches.swap(smaller);
    }
    return found;
}

void tell(const Job &job, Outputs &out, const std::string &suffix, const MeshModel &from, const MeshModel &to, const Measured &m)
{
    out["mean" + suffix] = m.figures.mean;
    out["rms" + suffix] = m.figures.rms;
    out["p95" + suffix] = m.figures.p95;
    out["max" + suffix] = m.figures.max;
    out["max_found" + suffix] = m.reached;
    out["bound" + suffix] = m.bound;
    job.log("From the " + std::to_string(m.figures.count) + " vertices of " + quoted(from) + " to " + quoted(to) + ": mean " +
            shown(m.figures.mean) + ", RMS " + shown(m.figures.rms) + ", 95 % within " + shown(m.figures.p95) + ", largest " +
            shown(m.figures.max));
    job.log("No point of " + quoted(from) + " is farther than " + shown(m.bound) + ", and " + shown(m.reached) + " was found");
}

Outputs run(Job &job)
{
    const RichParameterList &given = job.parameters;
    const MeshModel *const measured = compat::layer(given, "measured", job.document);
    const MeshModel *const reference = compat::layer(given, "reference", job.document);
    if (measured == nullptr || reference == nullptr) refuse("Choose the layer to measure and the layer to measure it against");
    const bool both = given.getBool("both_ways");
    if (measured->cm.vn == 0) refuse("The layer " + quoted(*measured) + " is empty: there is nothing to measure");
    if (reference->cm.fn == 0) refuse("The layer " + quoted(*reference) + " has no faces, but distances are to a surface: choose another");
    if (both && measured->cm.fn == 0) refuse("The layer " + quoted(*measured) + " has no faces, but measuring both ways needs some: switch it off");

    const LayerArrays from = arrays(*measured, Frame::world);
    const surfrecon::Mesh to = mesh(*reference, Frame::world);
    const Measured there = measure(from, to, given.getBool("signed"), job.progress(0, both ? 0.5 : 1));
    Outputs out;
    tell(job, out, "", *measured, *reference, there);
    out["bias"] = there.figures.bias;
    if (both) {
        const Measured back = measure(arrays(*reference, Frame::world), mesh(*measured, Frame::world), false, job.progress(0.5, 1));
        tell(job, out, "_back", *reference, *measured, back);
        out["hausdorff_bound"] = std::max(there.bound, back.bound);
    }

    const std::string label = measured->label().toStdString() + " distances";
    const std::vector<std::uint8_t> colours = vertex_colours(*measured, from);
    const LayerArrays in_place = arrays(*measured, Frame::layer);
    const surfrecon::Pose pose = placement(*measured);
    MeshModel &made = *job.document.addNewMesh("", text(label), true);
    fill(made, in_place.positions.data(), in_place.kept.size(), in_place.triangles.data(), in_place.triangles.size() / 3);
    if (!colours.empty()) set_colours(made, colours.data());
    set_quality(made, there.distances);
    place(made, pose);
    return out;
}

}  // namespace

extern const Filter distance_filter = {
    "Exact Distance between Layers",
    "get_exact_distance_between_layers",
    "Measures how far the surface of one layer lies from another: the exact distance of every vertex to the nearest point of the "
    "reference, not of sampled points, and a <b>bound</b> that no point of the measured surface exceeds, within a hundredth of the "
    "largest distance found where that takes no more than 16 measurements a vertex, or 100 000. Layers are taken where their matrices place "
    "them and are not changed: a copy of the measured one has the distances as quality.<br>"
    "Signs follow from angle-weighted normals, see:<br><i>J. A. Baerentzen, H. Aanaes</i><br>"
    "<b>\"Signed distance computation using the angle weighted pseudonormal\"</b><br>"
    "IEEE Transactions on Visualization and Computer Graphics 11(3), 2005",
    compat::FilterBase::RangeMap | compat::FilterBase::Measure,
    compat::FilterBase::FIXED,
    parameters,
    run,
};

}  // namespace srf
