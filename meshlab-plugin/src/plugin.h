// SPDX-License-Identifier: GPL-3.0-or-later
// The filter plugin as MeshLab sees it.
#pragma once

#include "filter.h"

class SurfreconFilterPlugin : public QObject, public SRF_FILTER_BASE {
    Q_OBJECT
    MESHLAB_PLUGIN_IID_EXPORTER(SRF_FILTER_IID)
    Q_INTERFACES(SRF_FILTER_BASE)

public:
    SurfreconFilterPlugin();
    QString pluginName() const override { return "surfrecon"; }
    FilterClass getClass(compat::Action *action)
#if SRF_MESHLAB >= 202100
        const
#endif
        override;
    compat::Arity filterArity(compat::Action *action) const override;
    int getPreConditions(compat::Action *) const override { return MeshModel::MM_NONE; }
    int postCondition(compat::Action *) const override;

#if SRF_MESHLAB < 202100
    QString filterName(FilterIDType id) const override;
    QString filterInfo(FilterIDType id) const override;
    void initParameterSet(QAction *action, MeshDocument &document, RichParameterList &list) override;
    bool applyFilter(QAction *action, MeshDocument &document, const RichParameterList &list, vcg::CallBackPos *callback) override;
#else
    QString vendor() const override { return "surfrecon"; }
    QString filterName(ActionIDType id) const override;
    QString filterInfo(ActionIDType id) const override;
    QString pythonFilterName(ActionIDType id) const override;
    RichParameterList initParameterList(const QAction *action, const MeshDocument &document) override;
    std::map<std::string, QVariant> applyFilter(const QAction *action, const RichParameterList &list, MeshDocument &document,
                                                unsigned int &changed, vcg::CallBackPos *callback) override;
#endif

private:
    srf::Outputs run(compat::Action *action, const RichParameterList &list, MeshDocument &document, vcg::CallBackPos *callback);
};
