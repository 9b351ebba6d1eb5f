// SPDX-License-Identifier: GPL-3.0-or-later
// The visible layers as scans: shared by the filters that take all of them.
#pragma once

#include <set>

#include <surfrecon.hpp>

#include "compat.h"
#include "layer.h"

namespace srf {

// The visible layers that have vertices, in their order.
template <typename Document>
auto visible(Document &document)
{
    auto found = compat::layers(document);
    const auto is_left_out = [](const MeshModel *layer) { return !layer->isVisible() || layer->cm.vn == 0; };
    found.erase(std::remove_if(found.begin(), found.end(), is_left_out), found.end());
    return found;
}

// Names break ties, so that the order of the layers does not matter: they have to differ.
std::string name_of(const MeshModel &layer, std::set<std::string> &taken);

// Whether the faces of a layer are those of its range image, which then says more than they do: its noise, what it sees through.
bool is_as_imported(const MeshModel &layer, Frame frame, surfrecon::Image &image);

}  // namespace srf
