// SPDX-License-Identifier: GPL-3.0-or-later
// How a parameter of the library is asked for in MeshLab and handed over to the library. parameters.h has all.
#pragma once

#include <cstddef>
#include <initializer_list>
#include <limits>
#include <vector>

#include "compat.h"

namespace srf {

enum class Kind { length, angle, ratio, count, flag, choice, number_or_none };

// In the place of a smallest or largest number that there is none of.
constexpr double unbounded = std::numeric_limits<double>::infinity();

struct Parameter {
    Kind kind;
    const char *name;  // the same in every language
    const char *label;
    const char *tip;      // HTML
    bool from_data;       // 0 asks for what the data give
    double initial;       // angles in degrees, choices counted from 0
    double least, most;   // allowed numbers, likewise
    bool whole;           // the field is a std::uint64_t, otherwise a double
    std::size_t offset;   // of the field in the library's struct
    std::vector<const char *> choices;
};

using Parameters = std::vector<Parameter>;

// Asks for all but those named. Lengths can be given as shares of `longest`.
void add_parameters(RichParameterList &list, const Parameters &parameters, double longest,
                    std::initializer_list<const char *> but = {});

// Writes what was asked for into the library's struct, which has its defaults.
void read_parameters(const RichParameterList &given, const Parameters &parameters, void *into,
                     std::initializer_list<const char *> but = {});

// The diagonal of a layer's box; 1 where that has none.
double diagonal(const MeshModel *layer);

}  // namespace srf
