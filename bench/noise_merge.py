"""One tool of the benchmark of noise, in a process of its own: noise_merge.py TOOL FOLDER VOXEL OUT [OPTION=NUMBER...].

FOLDER is from noise_scans.py. Only what the tool needs is imported, so that its time and memory are its own.
"""

import json
import sys
from pathlib import Path


def ours(folder, voxel, out):
    """This library with all its defaults; what it says of its work goes beside the result."""
    import surfrecon
    from ply import write_ply

    if (folder / "left_out.json").is_file():
        told = json.loads((folder / "left_out.json").read_text())
        scans = [scan for k, scan in enumerate(surfrecon.open(told["conf"])) if k != told["left_out"]]
    else:
        frames = sorted(folder.glob("frame_*.npy")) or sorted(folder.glob("frame_*.png"))
        files = [str(file) for file in [folder / "camera.txt", folder / "poses.log", *frames]]
        scans = surfrecon.open(files, invalid=0)
    merged = surfrecon.merge(scans, voxel=voxel)
    write_ply(out, merged.mesh.positions, merged.mesh.triangles)
    out.with_suffix(".json").write_text(json.dumps(merged.report.as_dict(), default=str))


def vcg(folder, voxel, out):
    """VCG's surface reconstruction, as peer_merge.py does it."""
    import peer_merge

    peer_merge.vcg(folder, voxel, out)


def poisson(folder, voxel, out, samples_per_node, point_weight=4.0):
    """Screened Poisson reconstruction (pymeshlab), as deep as peer_merge.py chooses."""
    import math

    import peer_merge
    import pymeshlab

    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.load_new_mesh(str(folder / "points.ply"))
    box = meshes.current_mesh().bounding_box()
    depth = max(5, math.ceil(math.log2(1.1 * max(box.dim_x(), box.dim_y(), box.dim_z()) / voxel) - 0.3))
    meshes.generate_surface_reconstruction_screened_poisson(
        depth=depth, samplespernode=samples_per_node, pointweight=point_weight, preclean=False
    )
    peer_merge.save(meshes, out)


def voxel_block_grid(folder, voxel, out, truncation, weight):
    """Open3D's VoxelBlockGrid on the CPU: a truncated distance field, cells seen more often than `weight`."""
    import numpy as np
    import open3d
    from open3d import core
    from ply import write_ply

    grid = open3d.t.geometry.VoxelBlockGrid(
        ("tsdf", "weight"), (core.float32, core.float32), ((1), (1)), voxel, 16, 4000, core.Device("CPU:0")
    )
    fx, fy, cx, cy = map(float, (folder / "camera.txt").read_text().split())
    middles = np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]])
    # Half a pixel further to integrate: see peer_merge.py.
    halves = middles + [[0, 0, 0.5], [0, 0, 0.5], [0, 0, 0]]
    numbers = [line.split() for line in (folder / "poses.log").read_text().splitlines()]
    poses = np.array([line for line in numbers if len(line) == 4], float).reshape(-1, 4, 4)
    for k, pose in enumerate(poses):
        png = folder / f"frame_{k:04}.png"
        if png.is_file():
            image, scale = open3d.t.io.read_image(str(png)), 1000.0
            far = 1.01 * float(image.as_tensor().max().item()) / scale
        else:
            depth = np.load(folder / f"frame_{k:04}.npy")
            image, scale = open3d.t.geometry.Image(core.Tensor(depth)), 1.0
            far = 1.01 * float(depth.max())
        extrinsic = core.Tensor(np.linalg.inv(pose))
        blocks = grid.compute_unique_block_coordinates(image, core.Tensor(middles), extrinsic, scale, far, truncation)
        grid.integrate(blocks, image, core.Tensor(halves), extrinsic, scale, far, truncation)
    mesh = grid.extract_triangle_mesh(weight)
    write_ply(out, mesh.vertex.positions.numpy(), mesh.triangle.indices.numpy())


TOOLS = {"surfrecon": ours, "pymeshlab-vcg": vcg, "pymeshlab-poisson": poisson, "open3d-vbg": voxel_block_grid}

if __name__ == "__main__":
    tool, folder, voxel, out = TOOLS[sys.argv[1]], Path(sys.argv[2]), float(sys.argv[3]), Path(sys.argv[4])
    tool(folder, voxel, out, **{name: float(value) for name, value in (word.split("=") for word in sys.argv[5:])})
