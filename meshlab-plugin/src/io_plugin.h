// SPDX-License-Identifier: GPL-3.0-or-later
// The import plugin as MeshLab sees it: range images in files whose endings MeshLab leaves free. Those it has readers of its own
// for, such as PLY, PTX and E57, and pictures, are opened by the filter.
#pragma once

#include <surfrecon.hpp>

#include "compat.h"

class SurfreconIOPlugin : public QObject, public SRF_IO_BASE {
    Q_OBJECT
    MESHLAB_PLUGIN_IID_EXPORTER(SRF_IO_IID)
    Q_INTERFACES(SRF_IO_BASE)

public:
    QString pluginName() const override { return "surfrecon import"; }

#if SRF_MESHLAB < 202100
    QList<Format> importFormats() const override;
    QList<Format> exportFormats() const override { return {}; }
    void GetExportMaskCapability(QString &, int &capability, int &defaults) const override { capability = defaults = 0; }
    void initPreOpenParameter(const QString &format, const QString &file, RichParameterList &list) override;
    bool open(const QString &format, const QString &file, MeshModel &layer, int &mask, const RichParameterList &given,
              vcg::CallBackPos *callback, QWidget *) override;
    bool save(const QString &, const QString &, MeshModel &, const int, const RichParameterList &, vcg::CallBackPos *, QWidget *) override
    {
        return false;
    }
#else
    QString vendor() const override { return "surfrecon"; }
    std::list<FileFormat> importFormats() const override;
    std::list<FileFormat> exportFormats() const override { return {}; }
    void exportMaskCapability(const QString &, int &capability, int &defaults) const override { capability = defaults = 0; }
    RichParameterList initPreOpenParameter(const QString &format) const override;
    unsigned int numberMeshesContainedInFile(const QString &format, const QString &file, const RichParameterList &given) const override;
    void open(const QString &format, const QString &file, MeshModel &layer, int &mask, const RichParameterList &given,
              vcg::CallBackPos *callback) override;
    void open(const QString &format, const QString &file, const std::list<MeshModel *> &layers, std::list<int> &masks,
              const RichParameterList &given, vcg::CallBackPos *callback) override;
    void save(const QString &format, const QString &, MeshModel &, const int, const RichParameterList &, vcg::CallBackPos *) override
    {
        wrongSaveFormat(format);
    }
#endif
};
