// SPDX-License-Identifier: GPL-3.0-or-later
#include "scans.h"

#include <algorithm>

#include "filter.h"
#include "layer.h"
#include "parameters.h"
#include "range_layer.h"

namespace srf {

void add_read_parameters(RichParameterList &list)
{
    list.addParam(RichBool("faces", true, "With faces",
                           "Neighbouring pixels are joined by triangles, except over jumps. Without, range images are points that "
                           "know their pixel."));
    list.addParam(RichString("camera", "", "Camera of depth images",
                             "Focal lengths and centre, in pixels: fx fy cx cy. Images are depth images of this camera then; empty: "
                             "they are height maps."));
    list.addParam(RichInt("max_frames", 50, "Most frames",
                          "Of a recording of more frames, so many become layers, spread evenly over it; 0 for all."));
    add_parameters(list, open_parameters, 1);
}

surfrecon::ReadOptions read_options(const RichParameterList &given)
{
    surfrecon::ReadOptions options;
    read_parameters(given, open_parameters, &options);
    const QString camera = given.getString("camera").simplified();
    if (camera.isEmpty()) return options;
    const QStringList words = camera.split(' ');
    bool good = words.size() == 4;
    for (int k = 0; k < 4 && good; ++k) options.intrinsics[k] = words[k].toDouble(&good);
    if (!good) {
        refuse("The camera must be four numbers in pixels, fx fy cx cy, for example 525 525 319.5 239.5, got \"" +
               std::string(given.getString("camera").toUtf8().constData()) + "\"");
    }
    return options;
}

surfrecon::Scans open(const QString &file, const RichParameterList &given)
{
    const std::string path = file.toUtf8().constData();
    surfrecon::Scans scans = surfrecon::Scans::open({path}, read_options(given));
    if (scans.size() == 0) refuse("There is no scan in " + path + ": choose another file");
    return scans;
}

std::vector<std::size_t> chosen(const surfrecon::Scans &scans, const RichParameterList &given)
{
    const int most = given.getInt("max_frames");
    if (most < 0) refuse("max_frames must be at least 0, got " + std::to_string(most) + ", where 0 stands for all");
    std::vector<std::size_t> frames, all;
    for (std::size_t i = 0; i < scans.size(); ++i) (scans.is_frame(i) ? frames : all).push_back(i);
    const std::size_t count = most == 0 ? frames.size() : std::min(frames.size(), static_cast<std::size_t>(most));
    for (std::size_t k = 0; k < count; ++k) all.push_back(frames[k * frames.size() / count]);
    std::sort(all.begin(), all.end());
    return all;
}

std::string left_out(const surfrecon::Scans &scans, const std::vector<std::size_t> &chosen)
{
    if (chosen.size() == scans.size()) return {};
    return std::to_string(chosen.size()) + " of " + std::to_string(scans.size()) +
           " frames become layers, spread evenly over the recording; max_frames says how many";
}

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
