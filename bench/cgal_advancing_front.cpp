// CGAL's advancing front surface reconstruction, with its own defaults: POINTS OUT. Points are x, y, z as doubles; the result
// is the number of triangles and, for each, three indices, all as 32-bit integers.
#include <CGAL/Advancing_front_surface_reconstruction.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <array>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <vector>

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;

int main(int argc, char **argv)
{
    if (argc != 3)
        return 2;
    std::ifstream in(argv[1], std::ios::binary);
    std::vector<Kernel::Point_3> points;
    for (double p[3]; in.read(reinterpret_cast<char *>(p), sizeof p);)
        points.emplace_back(p[0], p[1], p[2]);
    std::vector<std::array<std::size_t, 3>> triangles;
    CGAL::advancing_front_surface_reconstruction(points.begin(), points.end(), std::back_inserter(triangles));
    std::ofstream out(argv[2], std::ios::binary);
    const std::uint32_t count = triangles.size();
    out.write(reinterpret_cast<const char *>(&count), sizeof count);
    for (const auto &triangle : triangles) {
        const std::uint32_t corners[3] = {std::uint32_t(triangle[0]), std::uint32_t(triangle[1]), std::uint32_t(triangle[2])};
        out.write(reinterpret_cast<const char *>(corners), sizeof corners);
    }
    return out ? 0 : 1;
}
