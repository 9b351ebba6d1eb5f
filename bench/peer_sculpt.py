"""One tool of the sculpting benchmark in a process of its own: peer_sculpt.py TOOL GRID.npy TOLERANCE OUT.npz PROGRAMS.

GRID holds heights, NaN where invalid. PROGRAMS is the folder of the tools that are compiled. OUT receives `positions`
(column, row, height) and `triangles`; printed is a line of JSON with the wall and CPU seconds of the meshing alone and,
for ours, the wall seconds of going there from twice the tolerance with a sculptor that has been nowhere else.
"""

import json
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np


def filled(heights):
    """Holes filled by the nearest sample, then smoothed: for tools that know no holes."""
    bad = np.isnan(heights)
    if not bad.any():
        return heights
    from scipy.ndimage import distance_transform_edt

    nearest = distance_transform_edt(bad, return_distances=False, return_indices=True)
    heights = heights[tuple(nearest)]
    for _ in range(300):
        p = np.pad(heights, 1, mode="edge")
        heights[bad] = ((p[:-2, 1:-1] + p[2:, 1:-1] + p[1:-1, :-2] + p[1:-1, 2:]) / 4)[bad]
    return heights


def surfrecon_mesh(heights, tolerance, effort, **options):
    """Ours: the holes stay holes."""
    import surfrecon

    image = surfrecon.RangeImage.orthographic(heights, step=(1.0, 1.0))
    # Like for like: the peers bridge every jump.
    run = lambda: surfrecon.Sculptor(image, effort=effort, edge_limit=1e9, **options)  # noqa: E731
    result, wall, cpu = timed(lambda: run().refine(tolerance=tolerance))
    figures = {"wall_s": wall, "cpu_s": cpu}
    # The search takes its time again.
    if effort < 2:
        sculptor = run()
        sculptor.refine(tolerance=2 * tolerance)
        figures["redig_s"] = timed(lambda: sculptor.refine(tolerance=tolerance))[1]
    return result.mesh.positions, result.mesh.triangles, figures


def reference_mesh(heights, tolerance, programs):
    """The paper's own pipeline; the CPU time includes reading the grid and writing the mesh."""
    with tempfile.TemporaryDirectory() as folder:
        grid, out = Path(folder) / "grid", Path(folder) / "mesh"
        heights.astype("<f8").tofile(grid)
        command = [programs / "examples" / "sculpt_reference", grid, str(heights.shape[1]), repr(tolerance), out]
        printed = subprocess.run(command, check=True, capture_output=True, text=True).stdout
        used = resource.getrusage(resource.RUSAGE_CHILDREN)
        positions = np.fromfile(out, "<f8").reshape(-1, 3)
    figures = json.loads(printed) | {"cpu_s": used.ru_utime + used.ru_stime}
    return positions, np.arange(len(positions)).reshape(-1, 3), figures


def delatin_mesh(heights, tolerance):
    """Greedy insertion."""
    import pydelatin

    heights = filled(heights).astype(np.float32)
    mesh, wall, cpu = timed(lambda: pydelatin.Delatin(heights, max_error=tolerance))
    positions = np.array(mesh.vertices, float)
    # Its rows count from below.
    positions[:, 1] = heights.shape[0] - 1 - positions[:, 1]
    positions[:, 2] = heights[positions[:, 1].astype(int), positions[:, 0].astype(int)]
    return positions, np.array(mesh.triangles), {"wall_s": wall, "cpu_s": cpu}


def martini_mesh(heights, tolerance):
    """Right-triangulated irregular network; wants a square of 2^n + 1."""
    import pymartini

    heights = filled(heights)
    side = 1 << (max(heights.shape) - 2).bit_length()
    pad = [(0, side + 1 - n) for n in heights.shape]
    square = np.pad(heights, pad, mode="edge").astype(np.float32)
    tile = lambda: pymartini.Martini(side + 1).create_tile(square).get_mesh(tolerance)  # noqa: E731
    (vertices, triangles), wall, cpu = timed(tile)
    places = np.asarray(vertices).reshape(-1, 2).astype(int)
    positions = np.column_stack([places, square[places[:, 1], places[:, 0]]]).astype(float)
    return positions, np.asarray(triangles).reshape(-1, 3), {"wall_s": wall, "cpu_s": cpu}


def surface(heights):
    """All samples as a mesh, two triangles a cell."""
    rows, cols = heights.shape
    y, x = np.mgrid[:rows, :cols]
    a = (np.arange(rows - 1)[:, None] * cols + np.arange(cols - 1)).ravel()
    triangles = np.concatenate([np.stack([a, a + 1, a + cols], 1), np.stack([a + 1, a + cols + 1, a + cols], 1)])
    return np.column_stack([x.ravel(), y.ravel(), heights.ravel()]).astype(float), triangles.astype(np.int32)


def open3d_collapse(positions, triangles):
    """A function from a number of triangles to the mesh that has it."""
    import open3d as o3d

    vectors = (o3d.utility.Vector3dVector(positions), o3d.utility.Vector3iVector(triangles))
    full = o3d.geometry.TriangleMesh(*vectors)

    def collapsed(count):
        mesh = full.simplify_quadric_decimation(count)
        return np.asarray(mesh.vertices), np.asarray(mesh.triangles)

    return collapsed


def meshlab_collapse(positions, triangles):
    """The same by MeshLab's filter with its default options."""
    import pymeshlab

    def collapsed(count):
        meshes = pymeshlab.MeshSet()
        meshes.add_mesh(pymeshlab.Mesh(positions, triangles))
        meshes.meshing_decimation_quadric_edge_collapse(targetfacenum=count, preserveboundary=True)
        mesh = meshes.current_mesh()
        return mesh.vertex_matrix(), mesh.face_matrix()

    return collapsed


def quadric_mesh(heights, tolerance, tool):
    """Quadric collapse to the fewest triangles found within the bound; the time is that of the last collapse alone.

    These tools know no bound: their number of triangles is bisected, each trial measured.
    """
    import sculpt

    # Lengths along the grid as the heights: the quadrics weigh all three axes alike.
    pitch = 1 / max(heights.shape)
    positions, triangles = surface(filled(heights))
    collapsed = tool(positions * [pitch, pitch, 1], triangles)
    low, high = 2, len(triangles)
    best = None
    while best is None or high - low > 0.03 * high:
        count = high if best is None else int((low * high) ** 0.5)
        (found, corners), wall, cpu = timed(lambda count=count: collapsed(count))
        found = found / [pitch, pitch, 1]
        if sculpt.check(heights, found, corners)[1] <= tolerance:
            best, high = (found, corners, {"wall_s": wall, "cpu_s": cpu}), count
        else:
            if best is None:
                raise RuntimeError("no mesh of this tool is within the bound")
            low = count
    return best


def meshopt_mesh(heights, tolerance, programs):
    """meshoptimizer, told the tolerance as its largest error: its own measure, so that the bound need not hold.

    As for the quadric collapses, lengths along the grid are as the heights. The CPU time includes reading and writing.
    """
    pitch = 1 / max(heights.shape)
    positions, triangles = surface(filled(heights))
    with tempfile.TemporaryDirectory() as folder:
        files = [Path(folder) / name for name in ("positions", "triangles", "out")]
        (positions * [pitch, pitch, 1]).astype("<f4").tofile(files[0])
        triangles.astype("<u4").tofile(files[1])
        command = [programs / "surfrecon-bench-meshopt", files[0], files[1], repr(tolerance), files[2]]
        printed = subprocess.run(command, check=True, capture_output=True, text=True).stdout
        used = resource.getrusage(resource.RUSAGE_CHILDREN)
        left = np.fromfile(files[2], "<u4").reshape(-1, 3)
    return positions, left, json.loads(printed) | {"cpu_s": used.ru_utime + used.ru_stime}


def timed(work):
    """The result of `work`, its wall and its CPU seconds."""
    wall, cpu = time.perf_counter(), time.process_time()
    made = work()
    return made, time.perf_counter() - wall, time.process_time() - cpu


TOOLS = {
    "surfrecon": lambda h, t, _: surfrecon_mesh(h, t, 1),
    "surfrecon-dug": lambda h, t, _: surfrecon_mesh(h, t, 0),
    "surfrecon-search": lambda h, t, _: surfrecon_mesh(h, t, 2),
    "surfrecon-free": lambda h, t, _: surfrecon_mesh(h, t, 2, interpolate=False),
    "surfrecon-floor": lambda h, t, _: surfrecon_mesh(h, t, 1, min_angle=np.radians(10)),
    "surfrecon-borders": lambda h, t, _: surfrecon_mesh(h, t, 1, simplify_borders=True),
    "surfrecon-reference": reference_mesh,
    "pydelatin": lambda h, t, _: delatin_mesh(h, t),
    "pymartini": lambda h, t, _: martini_mesh(h, t),
    "meshoptimizer": meshopt_mesh,
    "open3d-quadric": lambda h, t, _: quadric_mesh(h, t, open3d_collapse),
    "meshlab-quadric": lambda h, t, _: quadric_mesh(h, t, meshlab_collapse),
}

if __name__ == "__main__":
    tool, grid, tolerance, out, programs = sys.argv[1:]
    positions, triangles, figures = TOOLS[tool](np.load(grid), float(tolerance), Path(programs))
    np.savez(out, positions=positions, triangles=triangles)
    print(json.dumps(figures))
