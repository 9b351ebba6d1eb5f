// The work of a slider in a host: the range image is made ready once, then sculpted to one tolerance after the other.
// Usage: live_tolerance [OUT.ply]
// Scans a torus of radii 1 and 0.4 virtually from a distance of 4. C++17.

#include <cmath>
#include <chrono>
#include <cstdlib>
#include <iostream>
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

}  // namespace

int main(int argc, char **argv)
try {
    // A pinhole camera on the z axis that looks down at the origin: x to the right, y down, z forward.
    surfrecon::Pose from_above;
    from_above.matrix[5] = from_above.matrix[10] = -1;
    from_above.matrix[14] = 4;
    const surfrecon::Projection projection = surfrecon::Projection::pinhole(500, 500, 255.5, 255.5);
    const surfrecon::Image scan = surfrecon::Image::scan(torus(400, 200), 512, 512, projection, from_above);
    const auto bar = [](const surfrecon::Tick &tick) {
        std::cerr << '\r' << tick.message << "          \r";
        return true;
    };

    const surfrecon::Sculptor sculptor(scan);
    for (const double tolerance : {0.1, 0.03, 0.01, 0.003, 0.001, 0.01}) {
        const auto started = std::chrono::steady_clock::now();
        const auto [mesh, certificate] = sculptor.refine(tolerance, bar);
        const std::chrono::duration<double, std::milli> taken = std::chrono::steady_clock::now() - started;
        std::cout << "tolerance " << tolerance << ": " << certificate.triangles << " of " << certificate.full_triangles
                  << " triangles, farthest sample " << certificate.max_error << " away, " << taken.count() << " ms\n";
        if (certificate.max_error > tolerance * (1 + 1e-9)) return EXIT_FAILURE;
        if (argc > 1) mesh.write_ply(argv[1]);
    }
    return EXIT_SUCCESS;
} catch (const surfrecon::Error &error) {
    std::cerr << error.what() << '\n';
    return EXIT_FAILURE;
}
