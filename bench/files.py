"""Reading files: this library beside what people read them with, on the same files.

Each tool reads each file in a fresh process, three times; the median counts. MB/s are megabytes of the file by CPU
second, so that another load on the machine doesn't count; the peak is what the process holds beyond its imports.
"""

import json
import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

import measured
import table

# Case: file in SURFRECON_DATA (or made below), and who else reads it.
CASES = {
    "range grid": ("stanford_bunny/bun000.ply", []),
    "mesh, text": ("stanford_bunny/bun_zipper.ply", ["open3d", "pymeshlab"]),
    "mesh, binary": ("meshlab_rangemaps/lato315.ply", ["open3d", "pymeshlab"]),
    "armadillo": ("meshes/libigl_armadillo.obj", ["open3d", "pymeshlab"]),
    "organized": ("organized_pcd/learn0.pcd", ["open3d"]),
    "cloud": ("organized_pcd/model.pcd", ["open3d"]),
    "bunny": ("e57/bunnyFloat.e57", ["pymeshlab"]),
    "depth": ("rgbd_open3d/depth/00000.png", ["open3d"]),
    "terrain": ("dem/N37E014.hgt", []),
    "large scan": ("made/large.ptx", ["pymeshlab"]),
    "large mesh": ("made/large.stl", ["open3d", "pymeshlab"]),
}

READ = {
    "surfrecon": "import surfrecon\ndef read(path): return surfrecon.open(path)[0].read()",
    "open3d": """import open3d
def read(path):
    if path.endswith((".png",)): return open3d.io.read_image(path)
    if path.endswith((".pcd",)): return open3d.io.read_point_cloud(path)
    return open3d.io.read_triangle_mesh(path)""",
    "pymeshlab": """import pymeshlab
def read(path):
    meshes = pymeshlab.MeshSet()
    meshes.load_new_mesh(path)
    return meshes""",
}

PROGRAM = """
import json, resource, statistics, sys
{read}
def used():
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return usage.ru_utime + usage.ru_stime
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
import time
times, walls = [], []
for _ in range(3):
    start, wall = used(), time.perf_counter()
    content = read(sys.argv[1])
    times.append(used() - start)
    walls.append(time.perf_counter() - wall)
    if len(times) == 1:
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    del content
print(json.dumps([statistics.median(times), statistics.median(walls), peak / 1024]))
"""


def made(folder):
    """Files larger than the real ones: a scan of a million points, a mesh of 400,000 triangles."""
    program = """
import sys, numpy as np, surfrecon
random = np.random.default_rng(1)
shape = (1000, 1000)
points = np.dstack([random.uniform(-20, 20, shape), random.uniform(-20, 20, shape), random.uniform(1, 9, shape)])
image = surfrecon.RangeImage.from_points(points.astype(np.float32), viewing=("from", (0, 0, 0)), name="large")
image.intensity = random.uniform(0, 1, shape)
image.write(sys.argv[1] + "/large.ptx")
side = np.arange(448)
vertices = np.dstack([*np.meshgrid(side, side), random.uniform(0, 1, (448, 448))]).reshape(-1, 3)
a = (side[:-1, None] * 448 + side[None, :-1]).ravel()
triangles = np.concatenate([np.stack([a, a + 1, a + 448], 1), np.stack([a + 1, a + 449, a + 448], 1)])
surfrecon.Mesh(vertices.astype(np.float32), triangles).write(sys.argv[1] + "/large.stl")
"""
    subprocess.run([sys.executable, "-c", program, str(folder)], check=True)


def main(only_cases, repeats):
    """Measures; returns the rows."""
    data = os.environ.get("SURFRECON_DATA")
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        made(folder)
        for case, (file, peers) in CASES.items():
            if only_cases not in case:
                continue
            path = Path(folder, Path(file).name) if file.startswith("made/") else Path(data or "", file)
            if not path.is_file():
                print(f"SKIPPED {case}: there is no {file} in SURFRECON_DATA")
                continue
            for tool in ["surfrecon", *peers]:
                rows.append(row(case, path, tool, repeats))
    table.show(
        rows,
        {"case": "case", "format": "format", "tool": "tool", "MB/s": "mb_per_s", "s": "wall_s", "MB": "peak_mb"}
        | ({"failed": "failed"} if any("failed" in row for row in rows) else {}),
    )
    return {"rows": rows}


def row(case, path, tool, repeats):
    """The figures of a tool on a file."""
    head = {"case": case, "format": path.suffix[1:], "tool": tool}
    program = PROGRAM.format(read=READ[tool])
    try:
        runs = [
            json.loads(measured.run([sys.executable, "-c", program, path], timeout=300)[1].strip().splitlines()[-1])
            for _ in range(repeats)
        ]
    except measured.Failed as problem:
        return head | {"failed": str(problem)[:200]}
    cpu, wall, peak = (statistics.median(run[k] for run in runs) for k in range(3))
    return head | {"mb_per_s": path.stat().st_size / 1e6 / max(cpu, 1e-4), "wall_s": wall, "peak_mb": peak}
