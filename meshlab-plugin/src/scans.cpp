// SPDX-License-Identifier: GPL-3.0-or-later
#include "scans.h"

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
        refuse("The camera must be four numbers in pixels, fx fy cx cy, for example 525 525 319.5 239.5; got \"" +
               std::string(given.getString("camera").toUtf8().constData()) + "\"");
    }
    return options;
}

surfrecon::Scans open(const QString &file, const RichParameterList &given)
{
    const std::string path = file.toUtf8().constData();
    surfrecon::Scans scans = surfrecon::Scans::open({path}, read_options(given));
    if (scans.size() == 0) refuse("There is no scan in " + path);
    return scans;
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
