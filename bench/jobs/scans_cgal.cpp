// The job of c-api/examples/c/merge_scans.c with CGAL: scans_cgal OUT.ply SCANS...
// It has no merge of scans. The nearest is Poisson's reconstruction of all their points, which is closed and bridges what no scan saw. Scans are
// triangulated and lie in the world: range grids are not read, nor lists that place scans. Stages are told, no share of them; nothing asks
// whether to go on: Ctrl-C ends the program, and takes the unfinished file along.
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <iostream>
#include <string>
#include <utility>
#include <vector>

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/IO/polygon_mesh_io.h>
#include <CGAL/Polygon_mesh_processing/compute_normal.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/compute_average_spacing.h>
#include <CGAL/grid_simplify_point_set.h>
#include <CGAL/poisson_surface_reconstruction.h>
#include <CGAL/property_map.h>

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Surface = CGAL::Surface_mesh<Kernel::Point_3>;
using Oriented = std::pair<Kernel::Point_3, Kernel::Vector_3>;
using Place = CGAL::First_of_pair_property_map<Oriented>;
using Normal = CGAL::Second_of_pair_property_map<Oriented>;

std::string unfinished;

void interrupt(int)
{
    unlink(unfinished.c_str());
    _exit(130);
}

int fail(const std::string &what)
{
    std::cerr << what << '\n';
    return EXIT_FAILURE;
}

}  // namespace

int main(int argc, char **argv)
try {
    if (argc < 3) {
        std::cerr << "usage: " << argv[0] << " OUT.ply SCANS...\n";
        return 2;
    }
    const std::string out = argv[1];
    unfinished = out + ".part.ply";
    std::signal(SIGINT, interrupt);

    std::vector<Oriented> points;
    for (int i = 2; i < argc; ++i) {
        std::cerr << "reading " << argv[i] << '\n';
        Surface scan;
        if (!CGAL::Polygon_mesh_processing::IO::read_polygon_mesh(argv[i], scan) || scan.number_of_faces() == 0)
            return fail(std::string(argv[i]) + " is no scan");
        auto normals = scan.add_property_map<Surface::Vertex_index, Kernel::Vector_3>("v:normal", CGAL::NULL_VECTOR).first;
        CGAL::Polygon_mesh_processing::compute_vertex_normals(scan, normals);
        for (const auto vertex : scan.vertices())
            if (normals[vertex] != CGAL::NULL_VECTOR) points.emplace_back(scan.point(vertex), normals[vertex]);
    }

    std::cerr << "merging\n";
    const auto places = CGAL::parameters::point_map(Place());
    const double cell = 1.5 * CGAL::compute_average_spacing<CGAL::Sequential_tag>(points, 6, places);
    points.erase(CGAL::grid_simplify_point_set(points, cell, places), points.end());
    Surface merged;
    if (!CGAL::poisson_surface_reconstruction_delaunay(points.begin(), points.end(), Place(), Normal(), merged, cell))
        return fail("there is no surface");

    std::cerr << "writing\n";
    if (!CGAL::IO::write_polygon_mesh(unfinished, merged) || std::rename(unfinished.c_str(), out.c_str()) != 0) {
        unlink(unfinished.c_str());
        return fail(out + " can't be written");
    }
    std::cout << argc - 2 << " scans, " << merged.number_of_faces() << " triangles\n";
    return EXIT_SUCCESS;
} catch (const std::exception &error) {
    unlink(unfinished.c_str());
    return fail(error.what());
}
