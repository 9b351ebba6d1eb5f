// SPDX-License-Identifier: GPL-3.0-or-later
// Everything that differs between the versions of MeshLab. SRF_MESHLAB is the version as a number: 202009, 202202, 202312
// (whose interface 2025.07 kept).
#pragma once

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
#else
using FilterBase = FilterPlugin;
using Action = const QAction;
using Arity = FilterPlugin::FilterArity;
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
#else
#define SRF_FILTER_IID FILTER_PLUGIN_IID
#define SRF_FILTER_BASE FilterPlugin
#endif
