"""Reading files: this library beside what people read them with, on the same files.

Each tool reads each file in a fresh process, three times; the median counts. MB/s are megabytes of the file by CPU
second, so that another load on the machine doesn't count; the peak is what the process holds beyond its imports. Into
Blender both ways take turns in one process; the peak is what ours needs beyond the other. See blender.py. Recordings of
frames are a table of their own: recordings.py.
"""

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import blender
import measured
import recordings
import table

# Case: file in SURFRECON_DATA (or made below), and who else reads it.
CASES = {
    "range grid": ("stanford_bunny/bun000.ply", []),
    "mesh, text": ("stanford_bunny/bun_zipper.ply", ["open3d", "pymeshlab", "trimesh", "meshio"]),
    "mesh, binary": ("meshlab_rangemaps/lato315.ply", ["open3d", "pymeshlab", "trimesh", "meshio"]),
    "armadillo": ("meshes/libigl_armadillo.obj", ["open3d", "pymeshlab", "trimesh", "meshio"]),
    "organized": ("organized_pcd/learn0.pcd", ["open3d"]),
    "cloud": ("organized_pcd/model.pcd", ["open3d"]),
    "bunny": ("e57/bunnyFloat.e57", ["pymeshlab", "pye57"]),
    "depth": ("rgbd_open3d/depth/00000.png", ["open3d"]),
    "terrain": ("dem/N37E014.hgt", []),
    "large scan": ("made/large.ptx", ["pymeshlab"]),
    "large text": ("made/large.ply", ["open3d", "pymeshlab", "trimesh", "meshio"]),
    "large mesh": ("made/large.stl", ["open3d", "pymeshlab", "trimesh", "meshio"]),
    "aerial": ("made/large.las", ["laspy"]),
    "aerial, packed": ("made/large.laz", ["laspy"]),
}
SMALLEST = {
    "large scan": ("made/large.ptx", []),
    "large text": ("made/large.ply", ["trimesh", "meshio"]),
    "large mesh": ("made/large.stl", ["open3d", "pymeshlab"]),
    "aerial": ("made/large.las", ["laspy"]),
}
INTO_BLENDER = "into Blender"
COLUMNS = ["case", "format", "tool", "mb_per_s", "wall_s", "peak_mb"]

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
    "trimesh": "import trimesh\ndef read(path): return trimesh.load(path, process=False)",
    "meshio": "import meshio\ndef read(path): return meshio.read(path)",
    # Coordinates are scaled when they are asked for.
    "laspy": """import laspy, numpy
def read(path):
    points = laspy.read(path)
    return points, numpy.column_stack([points.x, points.y, points.z])""",
    "pye57": "import pye57\ndef read(path): return pye57.E57(path).read_scan(0, ignore_missing_fields=True)",
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


def into_blender(wanted, record):
    """The rows of a million triangles into Blender; none without its module."""
    head = {"case": INTO_BLENDER, "format": "bpy"}
    try:
        for found in blender.hand_over(wanted, record):
            if found["case"] == "plain":
                for tool, (cpu, wall) in (("surfrecon", found["ours"]), ("bpy", found["minimum"])):
                    speed = found["megabytes"] / max(cpu, measured.LEAST_S)
                    record.put(head | {"tool": tool, "mb_per_s": speed, "wall_s": wall, "peak_mb": found["peak_mb"]})
    except measured.Failed as problem:
        record.put(head | {"tool": "surfrecon", "failed": str(problem)})


def made(folder, side):
    """A scan and an aerial strip of side x side points, and a mesh: for a side of 1000, larger than the real ones."""
    program = """
import sys, numpy as np, surfrecon
random = np.random.default_rng(1)
n = int(sys.argv[2])
shape = (n, n)
points = np.dstack([random.uniform(-20, 20, shape), random.uniform(-20, 20, shape), random.uniform(1, 9, shape)])
image = surfrecon.RangeImage.from_points(points.astype(np.float32), viewing=("from", (0, 0, 0)), name="large")
image.intensity = random.uniform(0, 1, shape)
image.write(sys.argv[1] + "/large.ptx")
m = 448 * n // 1000
side = np.arange(m)
vertices = np.dstack([*np.meshgrid(side, side), random.uniform(0, 1, (m, m))]).reshape(-1, 3)
a = (side[:-1, None] * m + side[None, :-1]).ravel()
triangles = np.concatenate([np.stack([a, a + 1, a + m], 1), np.stack([a + 1, a + m + 1, a + m], 1)])
mesh = surfrecon.Mesh(vertices.astype(np.float32), triangles)
mesh.write(sys.argv[1] + "/large.stl")
# Written by somebody else: numbers of six digits, as scanners' programs print them.
header = f"ply\\nformat ascii 1.0\\nelement vertex {len(vertices)}\\n"
header += "".join(f"property float {axis}\\n" for axis in "xyz")
header += f"element face {len(triangles)}\\nproperty list uchar int vertex_indices\\nend_header"
with open(sys.argv[1] + "/large.ply", "w") as out:
    np.savetxt(out, vertices, "%.6f", header=header, comments="")
    np.savetxt(out, np.column_stack([np.full(len(triangles), 3), triangles]), "%d")
import laspy
strip = laspy.LasData(laspy.LasHeader(point_format=3, version="1.2"))
strip.header.scales, strip.header.offsets = [0.001] * 3, [4e5, 5e6, 0]
t = np.linspace(0, 400, n * n)
strip.x, strip.y = 4e5 + t + random.normal(0, 0.02, len(t)), 5e6 + np.arange(len(t)) % n * 0.05
strip.z, strip.gps_time = 10 * np.sin(t / 20) + random.normal(0, 0.02, len(t)), t
strip.intensity = random.integers(0, 4000, len(t)).astype(np.uint16)
strip.red = strip.green = strip.blue = (t * 100).astype(np.uint16)
strip.write(sys.argv[1] + "/large.las")
strip.write(sys.argv[1] + "/large.laz")
"""
    subprocess.run([sys.executable, "-c", program, str(folder), str(side)], check=True)


def main(wanted, record):
    """Runs the benchmark."""
    data = os.environ.get("SURFRECON_DATA")
    cases = {case: found for case, found in (SMALLEST if wanted.smallest else CASES).items() if wanted.takes(case)}
    with tempfile.TemporaryDirectory() as folder:
        if any(file.startswith("made/") for file, _ in cases.values()):
            made(folder, 100 if wanted.smallest else 1000)
        for case, (file, peers) in cases.items():
            path = Path(folder, Path(file).name) if file.startswith("made/") else Path(data or "", file)
            if path.is_file():
                read(case, path, wanted.tools(case, ["surfrecon", *peers]), wanted, record)
            else:
                record.skip(f"{case}: {file} is not in SURFRECON_DATA")
    if wanted.takes(INTO_BLENDER):
        into_blender(wanted, record)
    table.show(
        record.rows,
        {"case": "case", "format": "format", "tool": "tool", "MB/s": "mb_per_s", "s": "wall_s", "MB": "peak_mb"},
    )
    recordings.main(wanted, record)


def read(case, path, tools, wanted, record):
    """Has the tools read a file; a row each."""
    megabytes = path.stat().st_size / 1e6

    def once(tool):
        command = [sys.executable, "-c", PROGRAM.format(read=READ[tool]), path]
        cpu, wall, peak = json.loads(measured.run(command, timeout=300)[1].strip().splitlines()[-1])
        return {"mb_per_s": megabytes / max(cpu, measured.LEAST_S), "wall_s": wall, "peak_mb": peak}, None

    record.measure(tools, wanted.repeats, once, lambda tool: {"case": case, "format": path.suffix[1:], "tool": tool})
