// CGAL's and TetGen's tetrahedralization of a file of doubles: peer_delaunay cgal|tetgen POINTS THREADS
// Prints the number of tetrahedra as JSON.

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <string>
#include <vector>

#include <CGAL/Delaunay_triangulation_3.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <tbb/global_control.h>
#define TETLIBRARY
#include <tetgen.h>

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Vertex = CGAL::Triangulation_vertex_base_3<Kernel>;
using CellBase = CGAL::Delaunay_triangulation_cell_base_3<Kernel>;
using Parallel = CGAL::Delaunay_triangulation_3<
    Kernel, CGAL::Triangulation_data_structure_3<Vertex, CellBase, CGAL::Parallel_tag>>;

static std::vector<double> read(const char* path) {
    std::ifstream file(path, std::ios::binary | std::ios::ate);
    std::vector<double> values(static_cast<size_t>(file.tellg()) / sizeof(double));
    file.seekg(0);
    file.read(reinterpret_cast<char*>(values.data()), static_cast<std::streamsize>(values.size() * sizeof(double)));
    return values;
}

static std::vector<Kernel::Point_3> points(const char* path) {
    std::vector<double> values = read(path);
    std::vector<Kernel::Point_3> points;
    points.reserve(values.size() / 3);
    for (size_t i = 0; i < values.size(); i += 3) points.emplace_back(values[i], values[i + 1], values[i + 2]);
    return points;
}

int main(int count, char** arguments) {
    if (count != 4) return 2;
    const std::string tool = arguments[1];
    const int threads = std::atoi(arguments[3]);
    size_t cells = 0;
    if (tool == "cgal" && threads == 1) {
        const auto input = points(arguments[2]);
        CGAL::Delaunay_triangulation_3<Kernel> delaunay(input.begin(), input.end());
        cells = delaunay.number_of_finite_cells();
    } else if (tool == "cgal") {
        const auto input = points(arguments[2]);
        tbb::global_control control(tbb::global_control::max_allowed_parallelism, static_cast<size_t>(threads));
        CGAL::Bbox_3 box;
        for (const auto& point : input) box += point.bbox();
        Parallel::Lock_data_structure locks(box, 50);
        Parallel delaunay(input.begin(), input.end(), &locks);
        cells = delaunay.number_of_finite_cells();
    } else {
        const std::vector<double> values = read(arguments[2]);
        tetgenio in, out;
        in.firstnumber = 0;
        in.numberofpoints = static_cast<int>(values.size() / 3);
        in.pointlist = new REAL[values.size()];
        std::memcpy(in.pointlist, values.data(), values.size() * sizeof(double));
        char quiet[] = "Q";
        try {
            tetrahedralize(quiet, &in, &out);
        } catch (int error) {
            std::printf("TetGen's error %d\n", error);
            return 1;
        }
        cells = static_cast<size_t>(out.numberoftetrahedra);
    }
    std::printf("{\"tets\": %zu}\n", cells);
}
