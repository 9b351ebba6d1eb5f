// The job of c-api/examples/c/merge_scans.c with Open3D: scans_open3d OUT.ply SCANS...
// It reads no lists that place scans, nor range grids: scans are triangulated and lie in the world. Its merge of such is Poisson's, over all
// points, which is closed, and then cut off where few points are. Stages are told, no share of them; nothing asks whether to go on: Ctrl-C
// ends the program, and takes the unfinished file along.
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <iostream>
#include <string>
#include <vector>

#include <open3d/Open3D.h>

namespace {

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

    open3d::geometry::PointCloud points;
    double spacing = 0;
    for (int i = 2; i < argc; ++i) {
        std::cerr << "reading " << argv[i] << '\n';
        open3d::geometry::TriangleMesh scan;
        if (!open3d::io::ReadTriangleMesh(argv[i], scan) || !scan.HasTriangles()) return fail(std::string(argv[i]) + " is no scan");
        scan.ComputeVertexNormals();
        open3d::geometry::PointCloud part(scan.vertices_);
        part.normals_ = scan.vertex_normals_;
        points += part;
        const std::vector<double> distances = part.ComputeNearestNeighborDistance();
        for (const double distance : distances) spacing += distance / static_cast<double>(distances.size() * (argc - 2));
    }

    // A cell of 1.5 times the mean distance of neighbours.
    const double side = points.GetAxisAlignedBoundingBox().GetMaxExtent();
    const auto depth = static_cast<std::size_t>(std::clamp(std::ceil(std::log2(1.1 * side / (1.5 * spacing))), 5.0, 10.0));
    std::cerr << "merging\n";
    auto [mesh, densities] = open3d::geometry::TriangleMesh::CreateFromPointCloudPoisson(points, depth);
    std::vector<double> sorted = densities;
    if (sorted.empty()) return fail("there is no surface");
    std::sort(sorted.begin(), sorted.end());
    const double least = sorted[sorted.size() / 50];
    std::vector<bool> sparse;
    for (const double density : densities) sparse.push_back(density < least);
    mesh->RemoveVerticesByMask(sparse);

    std::cerr << "writing\n";
    if (!open3d::io::WriteTriangleMesh(unfinished, *mesh) || std::rename(unfinished.c_str(), out.c_str()) != 0) {
        unlink(unfinished.c_str());
        return fail(out + " can't be written");
    }
    std::cout << argc - 2 << " scans, " << mesh->triangles_.size() << " triangles\n";
    return EXIT_SUCCESS;
} catch (const std::exception &error) {
    unlink(unfinished.c_str());
    return fail(error.what());
}
