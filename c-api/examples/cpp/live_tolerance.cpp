// A coarser and coarser merge of virtual scans that still stays within a tolerance: live_tolerance [TOLERANCE] [OUT.ply]
// Scans a torus of radii 1 and 0.4 from all sides, then halves the cell of the merge until 95 % of the samples lie within
// the tolerance of the surface. C++17.

#include <cmath>
#include <cstdlib>
#include <iostream>
#include <string>
#include <vector>

#include <surfrecon.hpp>

namespace {

constexpr double PI = 3.14159265358979323846;

surfrecon::Mesh torus(std::uint32_t around, std::uint32_t across)
{
    std::vector<double> positions;
    std::vector<std::uint32_t> triangles;
    for (std::uint32_t i = 0; i < around; ++i) {
        for (std::uint32_t j = 0; j < across; ++j) {
            const double u = 2 * PI * i / around, v = 2 * PI * j / across, r = 1 + 0.4 * std::cos(v);
            positions.insert(positions.end(), {r * std::cos(u), r * std::sin(u), 0.4 * std::sin(v)});
            const auto at = [&](std::uint32_t a, std::uint32_t b) { return a % around * across + b % across; };
            const std::uint32_t p = at(i, j), q = at(i + 1, j), s = at(i + 1, j + 1), t = at(i, j + 1);
            triangles.insert(triangles.end(), {p, q, s, p, s, t});
        }
    }
    return surfrecon::Mesh::create(surfrecon::View<double, 3>(positions.data(), positions.size() / 3),
                                   surfrecon::View<std::uint32_t, 3>(triangles.data(), triangles.size() / 3));
}

// A pinhole camera at a distance of 4 that looks at the origin: x to the right, y down, z forward.
surfrecon::Pose camera(double azimuth, double elevation)
{
    const double ca = std::cos(azimuth), sa = std::sin(azimuth), ce = std::cos(elevation), se = std::sin(elevation);
    surfrecon::Pose pose;
    const double columns[16] = {-sa, ca, 0, 0, se * ca, se * sa, -ce, 0, -ce * ca, -ce * sa, -se, 0, 4 * ce * ca, 4 * ce * sa, 4 * se, 1};
    std::copy(columns, columns + 16, pose.matrix);
    return pose;
}

}  // namespace

int main(int argc, char **argv)
try {
    const double tolerance = argc > 1 ? std::atof(argv[1]) : 0.002;
    const surfrecon::Mesh shape = torus(200, 100);
    const srf_projection projection = {SRF_PINHOLE_DEPTH, 0, {500, 500, 159.5, 159.5}};
    surfrecon::Merger merger;
    std::vector<double> samples;
    for (int i = 0; i < 12; ++i) {
        const surfrecon::Pose pose = camera(2 * PI * i / 6, i < 6 ? 0.7 : -0.7);
        const surfrecon::Image ideal = surfrecon::Image::scan(shape, 320, 320, projection, pose);
        merger.add(ideal.triangulate(), "scan " + std::to_string(i), pose);
        for (const double x : ideal.world_points()) {
            if (!std::isnan(x)) samples.push_back(x);
        }
    }
    const auto bar = [](const surfrecon::Tick &tick) {
        std::cerr << '\r' << tick.message << "          ";
        return true;
    };
    surfrecon::MergeParams params;
    for (params.voxel = 0.16; params.voxel > 0.004; params.voxel /= 2) {
        const auto [mesh, report] = merger.run(params, bar);
        const surfrecon::Distances off = mesh.distances(surfrecon::View<double, 3>(samples.data(), samples.size() / 3));
        const srf_mesh_report topology = mesh.report();
        std::cerr << "\r                                                  \r";
        std::cout << "cell " << params.voxel << ": " << topology.triangles << " triangles, 95 % of the samples within " << off.p95
                  << ", genus " << topology.genus << '\n';
        if (off.p95 <= tolerance) {
            if (argc > 2) mesh.write_ply(argv[2]);
            return topology.is_manifold ? EXIT_SUCCESS : EXIT_FAILURE;
        }
    }
    std::cerr << "no cell is small enough for " << tolerance << '\n';
    return EXIT_FAILURE;
} catch (const surfrecon::Error &error) {
    std::cerr << error.what() << '\n';
    return EXIT_FAILURE;
}
