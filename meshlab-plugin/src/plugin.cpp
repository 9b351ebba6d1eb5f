// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin.h"

#include <iterator>
#include <vector>

#include "operations.h"

namespace {

// The operations, then what else there is.
std::vector<const srf::Filter *> all()
{
    std::vector<const srf::Filter *> filters(std::begin(srf::operation_filters), std::end(srf::operation_filters));
    filters.insert(filters.end(), {&srf::distance_filter, &srf::region_filter, &srf::size_and_ground_filter});
    return filters;
}

const std::vector<const srf::Filter *> filters = all();

const srf::Filter &filter(int id) { return *filters[id]; }

// The changes of filters in the document: they add layers, place them, take vertices and faces out of old ones, select and rate faces, and give
// their corners texture coordinates.
const int changed_elements = MeshModel::MM_VERTCOORD | MeshModel::MM_VERTNORMAL | MeshModel::MM_VERTNUMBER | MeshModel::MM_FACEVERT |
                             MeshModel::MM_FACENORMAL | MeshModel::MM_FACENUMBER | MeshModel::MM_FACEQUALITY | MeshModel::MM_FACEFLAGSELECT |
                             MeshModel::MM_WEDGTEXCOORD | MeshModel::MM_TRANSFMATRIX;

}  // namespace

SurfreconFilterPlugin::SurfreconFilterPlugin()
{
    for (int id = 0; id < static_cast<int>(std::size(filters)); ++id) {
        typeList.push_back(id);
        actionList.push_back(new QAction(filterName(id), this));
    }
}

SurfreconFilterPlugin::FilterClass SurfreconFilterPlugin::getClass(compat::Action *action)
#if SRF_MESHLAB >= 202100
    const
#endif
{
    return static_cast<FilterClass>(filter(ID(action)).category);
}

compat::Arity SurfreconFilterPlugin::filterArity(compat::Action *action) const { return filter(ID(action)).arity; }

int SurfreconFilterPlugin::postCondition(compat::Action *) const { return changed_elements; }

srf::Outputs SurfreconFilterPlugin::run(compat::Action *action, const RichParameterList &list, MeshDocument &document,
                                        vcg::CallBackPos *callback)
{
    srf::Job job{document, list, callback, [this](const std::string &line) {
#if SRF_MESHLAB < 202100
                     Log("%s", line.c_str());
#else
                     log("%s", line.c_str());
#endif
                 }};
    try {
        return filter(ID(action)).run(job);
    } catch (const surfrecon::Cancelled &) {
        srf::refuse("Cancelled: nothing was changed");
    } catch (const surfrecon::Error &error) {
        srf::refuse(error.what());
    } catch (const std::bad_alloc &) {
        srf::refuse("There is not enough memory: close other programs");
    }
}

#if SRF_MESHLAB < 202100

QString SurfreconFilterPlugin::filterName(FilterIDType id) const { return filter(id).name; }
QString SurfreconFilterPlugin::filterInfo(FilterIDType id) const { return filter(id).info; }

void SurfreconFilterPlugin::initParameterSet(QAction *action, MeshDocument &document, RichParameterList &list)
{
    filter(ID(action)).parameters(document, list);
}

bool SurfreconFilterPlugin::applyFilter(QAction *action, MeshDocument &document, const RichParameterList &list,
                                        vcg::CallBackPos *callback)
{
    try {
        run(action, list, document, callback);
        return true;
    } catch (const std::exception &error) {
        errorMessage = QString::fromLocal8Bit(error.what());
        return false;
    }
}

#else

QString SurfreconFilterPlugin::filterName(ActionIDType id) const { return filter(id).name; }
QString SurfreconFilterPlugin::filterInfo(ActionIDType id) const { return filter(id).info; }
QString SurfreconFilterPlugin::pythonFilterName(ActionIDType id) const { return filter(id).python_name; }

RichParameterList SurfreconFilterPlugin::initParameterList(const QAction *action, const MeshDocument &document)
{
    RichParameterList list;
    filter(ID(action)).parameters(document, list);
    return list;
}

std::map<std::string, QVariant> SurfreconFilterPlugin::applyFilter(const QAction *action, const RichParameterList &list,
                                                                   MeshDocument &document, unsigned int &changed,
                                                                   vcg::CallBackPos *callback)
{
    changed = changed_elements;
    return run(action, list, document, callback);
}

#endif

MESHLAB_PLUGIN_NAME_EXPORTER(SurfreconFilterPlugin)
