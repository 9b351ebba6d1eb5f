// SPDX-License-Identifier: GPL-3.0-or-later
// What is read from files as a layer: shared by the filter and the import plugin.
#pragma once

#include <string>
#include <vector>

#include <surfrecon.hpp>

#include "compat.h"

namespace srf {

// Parameters for what files don't say themselves, and what was answered.
void add_read_parameters(RichParameterList &list);
surfrecon::ReadOptions read_options(const RichParameterList &given);

// Opens one file; an error names it.
surfrecon::Scans open(const QString &file, const RichParameterList &given);

// The scans that become layers: all, but of the frames of a recording at most as many as asked for, spread evenly over it.
std::vector<std::size_t> chosen(const surfrecon::Scans &scans, const RichParameterList &given);

// Says how many that are, where some are left out; else empty.
std::string left_out(const surfrecon::Scans &scans, const std::vector<std::size_t> &chosen);

// Writes a scan into an empty layer. `pose` places meshes and clouds; an image knows its own place.
void fill_scan(MeshModel &layer, surfrecon::Scans::Content &scan, const surfrecon::Pose &pose, bool faces);

}  // namespace srf
