// SPDX-License-Identifier: GPL-3.0-or-later
// Everything that differs between the versions of MeshLab. SRF_MESHLAB is the version as a number: 202009, 202202, 202312
// (whose interface 2025.07 kept).
#pragma once

#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include <QAction>
#include <QObject>
#include <QVariant>

#if SRF_MESHLAB < 202100
#include <common/GLExtensionsManager.h>
#include <common/interfaces.h>
#include <common/mlexception.h>
#else
#include <common/globals.h>
#include <common/mlexception.h>
#include <common/plugins/interfaces/filter_plugin.h>
#include <common/plugins/interfaces/io_plugin.h>
#endif

namespace compat {

#if SRF_MESHLAB < 202100
using FilterBase = MeshFilterInterface;
using Action = QAction;
using Arity = MeshFilterInterface::FILTER_ARITY;
using PlaceParameter = RichPoint3f;
using DirectionParameter = RichPoint3f;
#else
using FilterBase = FilterPlugin;
using Action = const QAction;
using Arity = FilterPlugin::FilterArity;
using PlaceParameter = RichPosition;
using DirectionParameter = RichDirection;
#endif

#if SRF_MESHLAB >= 202312
using FileParameter = RichFileOpen;
using LengthParameter = RichPercentage;
#else
using FileParameter = RichOpenFile;
using LengthParameter = RichAbsPerc;
#endif

// Parameters are floats or doubles by version and build.
#if SRF_MESHLAB < 202100
using Number = float;
#else
using Number = Scalarm;
#endif

// The layers, in their order.
inline std::vector<MeshModel *> layers(MeshDocument &document)
{
    std::vector<MeshModel *> found;
#if SRF_MESHLAB < 202100
    for (MeshModel *layer : document.meshList) found.push_back(layer);
#else
    for (MeshModel &layer : document.meshIterator()) found.push_back(&layer);
#endif
    return found;
}

inline std::vector<const MeshModel *> layers(const MeshDocument &document)
{
    std::vector<const MeshModel *> found;
#if SRF_MESHLAB < 202100
    for (const MeshModel *layer : document.meshList) found.push_back(layer);
#else
    for (const MeshModel &layer : document.meshIterator()) found.push_back(&layer);
#endif
    return found;
}

inline void remove(MeshDocument &document, MeshModel &layer)
{
#if SRF_MESHLAB < 202100
    document.delMesh(&layer);
#else
    document.delMesh(static_cast<unsigned int>(layer.id()));
#endif
}

// A parameter that names a layer; by default the one at `place` in the list, or the last.
inline RichMesh layer_parameter(const char *name, const MeshDocument &document, int place, const char *title, const char *tip)
{
#if SRF_MESHLAB < 202100
    MeshDocument *const known = const_cast<MeshDocument *>(&document);
    return RichMesh(name, std::max(0, std::min(place, known->meshList.size() - 1)), known, title, tip);
#else
    unsigned int id = 0;
    for (const MeshModel &layer : document.meshIterator()) {
        id = static_cast<unsigned int>(layer.id());
        if (place-- == 0) break;
    }
    return RichMesh(name, id, &document, title, tip);
#endif
}

// The layer that such a parameter names; null if there is none.
inline MeshModel *layer(const RichParameterList &parameters, const char *name, MeshDocument &document)
{
#if SRF_MESHLAB < 202100
    (void)document;
    return parameters.getMesh(name);
#else
    return document.getMesh(parameters.getMeshId(name));
#endif
}

// To be called once the vertices of a layer are there.
inline void update_box_and_normals(MeshModel &layer)
{
#if SRF_MESHLAB < 202100
    layer.UpdateBoxAndNormals();
#else
    layer.updateBoxAndNormals();
#endif
}

}  // namespace compat

#if SRF_MESHLAB < 202100
#define SRF_FILTER_IID MESH_FILTER_INTERFACE_IID
#define SRF_FILTER_BASE MeshFilterInterface
#define SRF_IO_IID MESH_IO_INTERFACE_IID
#define SRF_IO_BASE MeshIOInterface
#else
#define SRF_FILTER_IID FILTER_PLUGIN_IID
#define SRF_FILTER_BASE FilterPlugin
#define SRF_IO_IID IO_PLUGIN_IID
#define SRF_IO_BASE IOPlugin
#endif
