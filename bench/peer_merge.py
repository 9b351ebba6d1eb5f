"""One peer of the merge, run in a process of its own: peer_merge.py PEER FOLDER VOXEL OUT. FOLDER is from prepare.py.

Only what the peer needs is imported, so that its time and memory are its own.
"""

import math
import os
import sys
import tempfile
from pathlib import Path


def vcg(folder, voxel, out):
    """VCG's surface reconstruction (pymeshlab): a distance field; smooths once and closes holes by widening."""
    import pymeshlab

    files = (folder / "scans.txt").read_text().split("\n")[:-1]
    meshes = pymeshlab.MeshSet(verbose=False)
    for file in files:
        meshes.load_new_mesh(file)
    # The filter leaves a file of its own where it runs.
    with tempfile.TemporaryDirectory() as scratch:
        os.chdir(scratch)
        meshes.generate_surface_reconstruction_vcg(
            voxsize=pymeshlab.PureValue(voxel), subdiv=1, mergecolor=False, simplification=False
        )
        save(meshes, out)
        os.chdir("/")


def poisson(folder, voxel, out):
    """Screened Poisson reconstruction (pymeshlab), its octree as deep as the voxel asks for; closed, not trimmed."""
    import pymeshlab

    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.load_new_mesh(str(folder / "points.ply"))
    box = meshes.current_mesh().bounding_box()
    side = 1.1 * max(box.dim_x(), box.dim_y(), box.dim_z())
    # The 0.3 lets a cell up to a fifth larger than the voxel do.
    depth = max(5, math.ceil(math.log2(side / voxel) - 0.3))
    meshes.generate_surface_reconstruction_screened_poisson(depth=depth, preclean=False)
    save(meshes, out)


def save(meshes, out):
    """Geometry only."""
    meshes.save_current_mesh(str(out), save_vertex_normal=False, save_vertex_quality=False, save_vertex_color=False)


def voxel_block_grid(folder, voxel, out):
    """Open3D's VoxelBlockGrid on the CPU: a truncated distance field of 4 voxels, cells seen at least once."""
    import numpy as np
    import open3d
    from open3d import core
    from ply import write_ply

    truncation = 4.0
    grid = open3d.t.geometry.VoxelBlockGrid(
        ("tsdf", "weight"), (core.float32, core.float32), ((1), (1)), voxel, 16, 4000, core.Device("CPU:0")
    )
    for file in (folder / "scans.txt").read_text().split("\n")[:-1]:
        scan = np.load(folder / "depth" / f"{Path(file).stem}.npz")
        image = open3d.t.geometry.Image(core.Tensor(scan["depth"]))
        far = 1.01 * float(scan["depth"].max())
        # Blocks are found from rays through whole numbers, the middles of our pixels. To integrate, a projection is cut
        # down to the pixel it lies in: there middles lie at halves.
        middles, halves = scan["K"], scan["K"] + [[0, 0, 0.5], [0, 0, 0.5], [0, 0, 0]]
        extrinsic = core.Tensor(scan["E"])
        blocks = grid.compute_unique_block_coordinates(image, core.Tensor(middles), extrinsic, 1.0, far, truncation)
        grid.integrate(blocks, image, core.Tensor(halves), extrinsic, 1.0, far, truncation)
    mesh = grid.extract_triangle_mesh(0.5)
    write_ply(out, mesh.vertex.positions.numpy(), mesh.triangle.indices.numpy())


PEERS = {"pymeshlab-vcg": vcg, "pymeshlab-poisson": poisson, "open3d-vbg": voxel_block_grid}

if __name__ == "__main__":
    PEERS[sys.argv[1]](Path(sys.argv[2]), float(sys.argv[3]), Path(sys.argv[4]))
