// SPDX-License-Identifier: GPL-3.0-or-later
#include "io_plugin.h"

#include <set>

#include <QCoreApplication>

#include "filter.h"
#include "layer.h"
#include "scans.h"

namespace {

// Files that MeshLab opens itself, as meshes, projects or rasters, and those that say nothing without others.
const std::set<std::string> left_out = {
    "ply", "stl", "obj", "ptx", "asc", "xyz", "txt", "pts", "mlp", "aln", "png", "tif", "tiff", "json", "log", "freiburg", "traj",
#if SRF_MESHLAB >= 202100
    "e57", "glb", "gltf",
#endif
#if SRF_MESHLAB >= 202500
    "3mf",
#endif
};

// The others that the library knows: name for people, ending.
std::vector<std::pair<QString, QString>> endings()
{
    std::vector<std::pair<QString, QString>> found;
    for (const surfrecon::Format &format : surfrecon::formats()) {
        for (const std::string &ending : format.endings) {
            if (left_out.count(ending) == 0) found.emplace_back(srf::text(format.name), srf::text(ending).toUpper());
        }
    }
    return found;
}

using Layers = std::vector<MeshModel *>;

// Fills a layer a scan; returns what is in them for MeshLab.
std::vector<int> load(const QString &file, const Layers &layers, const RichParameterList &given, vcg::CallBackPos *callback)
{
    try {
        const surfrecon::Scans scans = srf::open(file, given);
        const std::vector<std::size_t> chosen = srf::chosen(scans, given);
        if (chosen.size() != layers.size()) {
            srf::refuse("There are " + std::to_string(chosen.size()) + " scans in the file: open it with the filter \"" + srf::import_name + "\"");
        }
        // pymeshlab, which has no application, leaves its callback pointing at the log of the last document that applied a filter,
        // even once that document is gone.
        if (QCoreApplication::instance() == nullptr) callback = nullptr;
        std::vector<int> masks;
        for (std::size_t i = 0; i < layers.size(); ++i) {
            if (callback != nullptr && !callback(static_cast<int>(100 * i / layers.size()), "Reading scans")) {
                srf::refuse("Cancelled");
            }
            surfrecon::Scans::Content scan = scans.read(chosen[i]);
            srf::fill_scan(*layers[i], scan, scans.pose(chosen[i]), given.getBool("faces"));
            layers[i]->setLabel(srf::text(scans.name(chosen[i])));
            int mask = vcg::tri::io::Mask::IOM_VERTCOORD;
            if (layers[i]->cm.fn > 0) mask |= vcg::tri::io::Mask::IOM_FACEINDEX;
            if (layers[i]->hasDataMask(MeshModel::MM_VERTCOLOR)) mask |= vcg::tri::io::Mask::IOM_VERTCOLOR;
            if (layers[i]->hasDataMask(MeshModel::MM_VERTQUALITY)) mask |= vcg::tri::io::Mask::IOM_VERTQUALITY;
            masks.push_back(mask);
        }
        return masks;
    } catch (const surfrecon::Error &error) {
        srf::refuse(error.what());
    } catch (const std::bad_alloc &) {
        srf::refuse("There is not enough memory: close other programs");
    }
}

}  // namespace

#if SRF_MESHLAB < 202100

QList<SurfreconIOPlugin::Format> SurfreconIOPlugin::importFormats() const
{
    QList<Format> formats;
    for (const auto &[name, ending] : endings()) formats << Format(name, ending);
    return formats;
}

void SurfreconIOPlugin::initPreOpenParameter(const QString &, const QString &, RichParameterList &list) { srf::add_read_parameters(list); }

bool SurfreconIOPlugin::open(const QString &, const QString &file, MeshModel &layer, int &mask, const RichParameterList &given,
                             vcg::CallBackPos *callback, QWidget *)
{
    try {
        mask = load(file, {&layer}, given, callback).front();
        return true;
    } catch (const std::exception &error) {
        errorMessage = QString::fromLocal8Bit(error.what());
        return false;
    }
}

#else

std::list<FileFormat> SurfreconIOPlugin::importFormats() const
{
    std::list<FileFormat> formats;
    for (const auto &[name, ending] : endings()) formats.emplace_back(name, ending);
    return formats;
}

RichParameterList SurfreconIOPlugin::initPreOpenParameter(const QString &) const
{
    RichParameterList list;
    srf::add_read_parameters(list);
    return list;
}

unsigned int SurfreconIOPlugin::numberMeshesContainedInFile(const QString &, const QString &file, const RichParameterList &given) const
{
    // Opening says how many there are, and reads none.
    try {
        return static_cast<unsigned int>(srf::chosen(srf::open(file, given), given).size());
    } catch (const surfrecon::Error &error) {
        srf::refuse(error.what());
    }
}

void SurfreconIOPlugin::open(const QString &, const QString &file, MeshModel &layer, int &mask, const RichParameterList &given,
                             vcg::CallBackPos *callback)
{
    mask = load(file, {&layer}, given, callback).front();
}

void SurfreconIOPlugin::open(const QString &, const QString &file, const std::list<MeshModel *> &layers, std::list<int> &masks,
                             const RichParameterList &given, vcg::CallBackPos *callback)
{
    for (const int mask : load(file, {layers.begin(), layers.end()}, given, callback)) masks.push_back(mask);
}

#endif

MESHLAB_PLUGIN_NAME_EXPORTER(SurfreconIOPlugin)
