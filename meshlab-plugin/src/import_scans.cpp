// SPDX-License-Identifier: GPL-3.0-or-later
// Files of scans become layers, a layer a scan.
#include "filter.h"
#include "layer.h"
#include "range_layer.h"
#include "scans.h"

#include <algorithm>

namespace srf {
namespace {

void parameters(const MeshDocument &, RichParameterList &list)
{
    QStringList endings;
    std::string names;
    for (const surfrecon::Format &format : surfrecon::formats()) {
        for (const std::string &ending : format.endings) endings << text("*." + ending);
        names += (names.empty() ? "" : "; ") + format.name;
    }
    endings.removeDuplicates();
    endings << "*";
    list.addParam(compat::FileParameter(
        "file", "", endings, "File", text("A scan, or a file that places several. What it is is seen from the content. Known are: " + names)));
    add_read_parameters(list);
}

Outputs run(Job &job)
{
    const QString file = job.parameters.getOpenFileName("file");
    if (file.isEmpty()) refuse("Choose the file to import");
    const surfrecon::Scans scans = open(file, job.parameters);
    for (const std::string &note : scans.notes()) job.log(note);
    std::vector<std::size_t> layers = chosen(scans, job.parameters);
    if (const std::string note = left_out(scans, layers); !note.empty()) job.log(note);

    // All are read before the first layer is made: an error or a cancel leaves the document as it was.
    std::vector<surfrecon::Scans::Content> read;
    std::vector<std::size_t> damaged;
    for (std::size_t i = 0; i < layers.size(); ++i) {
        if (job.callback != nullptr && !job.callback(static_cast<int>(80 * i / layers.size()), "Reading scans")) {
            refuse("Cancelled: nothing was imported");
        }
        try {
            read.push_back(scans.read(layers[i]));
        } catch (const surfrecon::Error &error) {
            // Of many frames one that is damaged does not end the import.
            const bool is_last = damaged.size() + 1 == layers.size();
            if (error.status() != SRF_ERR_FORMAT || !scans.is_frame(layers[i]) || is_last) throw;
            job.log(scans.name(layers[i]) + " is skipped: " + error.what());
            damaged.push_back(layers[i]);
        }
    }
    const auto is_damaged = [&](std::size_t layer) { return std::count(damaged.begin(), damaged.end(), layer) > 0; };
    layers.erase(std::remove_if(layers.begin(), layers.end(), is_damaged), layers.end());
    std::vector<MeshModel *> made;
    int images = 0, vertices = 0;
    try {
        for (std::size_t i = 0; i < read.size(); ++i) {
            if (job.callback != nullptr) job.callback(static_cast<int>(80 + 20 * i / read.size()), "Making layers");
            const std::string name = scans.name(layers[i]);
            made.push_back(job.document.addNewMesh("", text(name), true));
            const surfrecon::Image &image = read[i].image;
            if (image) {
                job.log(name + ": " + std::to_string(image.rows()) + " x " + std::to_string(image.cols()) + " pixels, " +
                        std::to_string(image.valid()) + " of them valid");
                ++images;
            }
            fill_scan(*made.back(), read[i], scans.pose(layers[i]), job.parameters.getBool("faces"));
            vertices += made.back()->cm.vn;
            read[i] = {};
        }
    } catch (...) {
        for (MeshModel *layer : made) compat::remove(job.document, *layer);
        throw;
    }
    Outputs out;
    out["layers"] = static_cast<int>(read.size());
    out["range_images"] = images;
    out["vertices"] = vertices;
    return out;
}

}  // namespace

void ask_open(const MeshDocument &document, RichParameterList &list) { parameters(document, list); }

Outputs run_open(Job &job) { return run(job); }

}  // namespace srf
