// SPDX-License-Identifier: GPL-3.0-or-later
// A program around MeshLab's own library: loads the plugin as MeshLab does, applies filters, and cancels, which neither MeshLab nor
// pymeshlab lets a user do. Usage: host PLUGIN SCANS. Prints `ok` or what is wrong.
#include <QCoreApplication>

#include <common/globals.h>
#include <common/ml_document/mesh_document.h>
#include <common/mlexception.h>
#include <common/plugins/plugin_manager.h>

#include <cstdio>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

int calls = 0, last = 0, answer_no_at = 0;
bool fell = false, named = true;

bool watch(const int percent, const char *what)
{
    ++calls;
    fell = fell || percent < last || percent > 100;
    named = named && what != nullptr && *what != 0;
    last = percent;
    return answer_no_at == 0 || calls < answer_no_at;
}

void expect(bool holds, const std::string &what)
{
    if (!holds) throw std::runtime_error(what);
}

const char *const import_name = "Import Range Images", *const merge_name = "Surface Reconstruction: Marching Intersections",
                 *const sculpt_name = "Surface Reconstruction: Range Image Sculpting", *const align_name = "Align Scans";

// Applies a filter; the text of its refusal, empty if it went well.
std::string apply(MeshDocument &document, const char *name, const char *file, int no_at)
{
    PluginManager &plugins = meshlab::pluginManagerInstance();
    QAction *const action = plugins.filterAction(name);
    expect(action != nullptr, std::string("there is no filter ") + name);
    FilterPlugin *const filter = plugins.getFilterPluginFromAction(action);
    filter->setLog(&document.Log);
    RichParameterList given = filter->initParameterList(action, document);
    if (file != nullptr) given.setValue("file", StringValue(file));
    if (std::string(name) == merge_name) given.setValue("voxel", FloatValue(0.02f));
    calls = last = 0;
    fell = false;
    answer_no_at = no_at;
    unsigned int changed = 0;
    try {
        filter->applyFilter(action, given, document, changed, watch);
    } catch (const MLException &error) {
        return error.what();
    }
    return {};
}

// The numbers of all matrices.
std::vector<Scalarm> matrices(const MeshDocument &document)
{
    std::vector<Scalarm> found;
    for (const MeshModel &layer : document.meshIterator()) {
        for (int i = 0; i < 16; ++i) found.push_back(layer.cm.Tr.ElementAt(i / 4, i % 4));
    }
    return found;
}

void run(const char *plugin, const char *scans)
{
    meshlab::pluginManagerInstance().loadPlugin(plugin);
    MeshDocument document;
    expect(apply(document, import_name, scans, 2).find("Cancelled") == 0, "the import was not cancelled");
    expect(document.meshNumber() == 0, "a cancelled import left layers");
    expect(apply(document, import_name, scans, 0).empty(), "the import failed");
    const unsigned int layers = document.meshNumber();

    const std::vector<Scalarm> before = matrices(document);

    for (const char *name : {merge_name, sculpt_name, align_name}) {
        const std::string said = apply(document, name, nullptr, 1);
        expect(said.find("Cancelled") == 0, std::string(name) + " was not cancelled: " + said);
        expect(calls == 1, std::string(name) + " went on after it was cancelled");
        expect(document.meshNumber() == layers, std::string(name) + " left a layer when it was cancelled");
        expect(matrices(document) == before, std::string(name) + " moved a layer when it was cancelled");
    }
    const std::string error = apply(document, merge_name, nullptr, 0);
    expect(error.empty(), error);
    expect(calls >= 1 && !fell && named, "progress must rise from 0 to 100 and say what is done");
    expect(document.meshNumber() == layers + 1, "the merged layer is missing");

    document.mm()->setVisible(false);
    document.setCurrentMesh(0);
    const std::string refusal = apply(document, align_name, nullptr, 0);
    expect(refusal.empty(), refusal);
    QStringList log;
    document.Log.print(log);
    const QString said = log.join("\n");
    const QString first = document.mm()->label() + ": stays where it is";
    expect(said.contains(" scans placed. ") && said.contains(first), "the log lacks the table of the alignment: " + said.toStdString());
}

}  // namespace

int main(int count, char **arguments)
{
    QCoreApplication application(count, arguments);
    try {
        expect(count == 3, "usage: host PLUGIN SCANS");
        run(arguments[1], arguments[2]);
        std::puts("ok");
        return 0;
    } catch (const std::exception &error) {
        std::printf("%s\n", error.what());
        return 1;
    }
}
