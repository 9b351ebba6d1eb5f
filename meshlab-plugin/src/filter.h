// SPDX-License-Identifier: GPL-3.0-or-later
// What a filter is for this plugin: names, a category, parameters and something to run. One file a filter; plugin.cpp lists
// them and is the only one that knows how MeshLab calls.
#pragma once

#include <cstdio>
#include <functional>

#include <surfrecon.hpp>

#include "compat.h"

namespace srf {

using Outputs = std::map<std::string, QVariant>;

// One call of a filter.
struct Job {
    MeshDocument &document;
    const RichParameterList &parameters;
    vcg::CallBackPos *callback;  // may be null
    std::function<void(const std::string &)> log;

    // Reports to MeshLab the share `from` to `to` of the bar, and cancels when MeshLab says so.
    surfrecon::ProgressFunction progress(double from = 0, double to = 1) const
    {
        vcg::CallBackPos *const tell = callback;
        if (tell == nullptr) return {};
        return [tell, from, to](const surfrecon::Tick &tick) {
            const int percent = static_cast<int>(100 * (from + (to - from) * tick.fraction));
            return tell(percent, std::string(tick.message).c_str());
        };
    }
};

struct Filter {
    const char *name;         // in menus
    const char *python_name;  // in pymeshlab
    const char *info;         // HTML
    int category;             // values of FilterClass, or-ed
    compat::Arity arity;
    void (*parameters)(const MeshDocument &document, RichParameterList &list);
    Outputs (*run)(Job &job);
};

// Named in what users are told to do; the import plugin is without the filters.
inline const char *const import_name = "Import Range Images";

// Filters that are tools of the host; those that are operations are in operations.h.
extern const Filter distance_filter, region_filter, size_and_ground_filter;

inline QString text(const std::string &utf8) { return QString::fromUtf8(utf8.data(), static_cast<int>(utf8.size())); }

// An error in words a user can act on.
[[noreturn]] inline void refuse(const std::string &sentence) { throw MLException(text(sentence)); }

// A number for people.
inline std::string shown(double value)
{
    char digits[32];
    std::snprintf(digits, sizeof digits, "%.4g", value);
    return digits;
}

// A length of at least 0; 0 stands for what the data give, where they do.
inline double length(const RichParameterList &parameters, const char *name, bool from_data)
{
    const double value = parameters.getAbsPerc(name);
    if (!(value >= 0)) {
        const std::string hint = from_data ? ", where 0 stands for a length measured from the data" : "";
        refuse(std::string(name) + " must be at least 0, got " + shown(value) + hint);
    }
    return from_data && value == 0 ? SRF_FROM_DATA : value;
}

}  // namespace srf
