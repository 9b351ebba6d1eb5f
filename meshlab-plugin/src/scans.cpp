// SPDX-License-Identifier: GPL-3.0-or-later
#include "scans.h"

#include "layer.h"
#include "range_layer.h"

namespace srf {

void fill_scan(MeshModel &layer, surfrecon::Scans::Content &scan, const surfrecon::Pose &pose, bool faces)
{
    if (scan.image) {
        fill_range_layer(layer, scan.image, faces);
        return;
    }
    if (scan.mesh) {
        fill_mesh(layer, scan.mesh, "confidence");
    } else {
        fill_cloud(layer, scan.cloud);
    }
    place(layer, pose);
}

}  // namespace srf
