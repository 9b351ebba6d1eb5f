// SPDX-License-Identifier: GPL-3.0-or-later
// How the figures of a report are told: values that scripts get, and lines of the log. reports.h has all figures.
#pragma once

#include <cstddef>
#include <vector>

#include "filter.h"

namespace srf {

struct Figure {
    enum class Kind { flag, count, integer, bytes, length, angle, ratio, number, choice };

    Kind kind;
    const char *name;  // the same in every language
    const char *label;
    bool optional;        // may be none
    std::size_t size;     // how many numbers of eight bytes it has
    std::size_t offset;   // of the first in the library's struct
    std::vector<const char *> names;   // of the choices, counted from 1
    std::vector<const char *> labels;  // of the choices, for people
};

using Figures = std::vector<Figure>;

// The values of a report of the library, by name. Figures that do not apply are left out.
Outputs values(const Figures &figures, const void *report);

// Logs the figures in one line; those that do not apply, and counts of 0, are left out.
void log_figures(const Job &job, const Figures &figures, const void *report);

}  // namespace srf
