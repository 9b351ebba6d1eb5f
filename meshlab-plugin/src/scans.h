// SPDX-License-Identifier: GPL-3.0-or-later
// What is read from files as a layer: shared by the filter and the import plugin.
#pragma once

#include <surfrecon.hpp>

#include "compat.h"

namespace srf {

// Writes a scan into an empty layer. `pose` places meshes and clouds; an image knows its own place.
void fill_scan(MeshModel &layer, surfrecon::Scans::Content &scan, const surfrecon::Pose &pose, bool faces);

}  // namespace srf
