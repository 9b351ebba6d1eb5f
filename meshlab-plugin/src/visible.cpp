// SPDX-License-Identifier: GPL-3.0-or-later
#include "visible.h"

#include "range_layer.h"

namespace srf {

std::string name_of(const MeshModel &layer, std::set<std::string> &taken)
{
    const std::string label = layer.label().toStdString();
    std::string name = label;
    for (int k = 2; !taken.insert(name).second; ++k) name = label + " (" + std::to_string(k) + ")";
    return name;
}

bool is_as_imported(const MeshModel &layer, Frame frame, surfrecon::Image &image)
{
    if (layer.cm.fn == 0 || !has_grid(layer)) return false;
    try {
        image = range_image(layer, frame);
        return image.triangulate().triangles().size() == static_cast<std::size_t>(layer.cm.fn);
    } catch (const MLException &) {
        return false;
    } catch (const surfrecon::Error &) {
        return false;
    }
}

}  // namespace srf
