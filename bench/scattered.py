"""Surfaces through scattered points: this library beside CGAL's advancing front, ball pivoting and alpha shapes.

Of points that carry noise, beside Screened Poisson with estimated normals.

Every run is a fresh process. Times of programs (this library, CGAL) are those of the whole process, with reading the
points; of Python packages, and of this library with a sensor, those of the reconstruction alone, without imports and
files. One checker measures all.
"""

import json
import os
import shutil
import subprocess
import sys
import tempfile
from itertools import islice, product
from pathlib import Path

import measured
import numpy as np
import ply
import scattered_noise
import surface
import table
from scipy.spatial import cKDTree
from wanted import ALL

HERE = Path(__file__).resolve().parent
OURS, CGAL = "surfrecon", "cgal-advancing-front"
# This library where it knows from where a scan was seen, which no other takes.
SENSOR = "surfrecon-sensor"
PYTHON_TOOLS = ["open3d-ball-pivoting", "open3d-alpha-shape", "meshlab-ball-pivoting"]
POISSON = [f"screened-poisson-{depth}" for depth in scattered_noise.DEPTHS]
# Figures of a surface. They are null where there is none.
QUALITY = ["used_pct", "boundary_loops", "nonmanifold_edges", "nonmanifold_vertices", "genus", "components"]
# Facts of the points and the truth. They are null where nothing is known.
NOISE = ["noise_spacings", "outlier_pct", "to_truth_rms"]
COLUMNS = ["case", "tool", "runs", "cpu_s", "wall_s", "peak_mb", "triangles", *QUALITY, *NOISE]
# The packages take minutes for more, and their results are far from manifold for fewer already.
PYTHON_LIMIT = 140_000
# For each run of a package: some hundred times what this library takes for the smaller sets.
PYTHON_CPU_S = 30
# For each run of a program: ten times what CGAL takes for the noisy scans on a slow machine.
PROGRAM_CPU_S = 900
# Facts of the shapes. The hypersheet is Costa's minimal surface: a torus with three ends.
KNOWN = {
    "bunny": "genus 0",
    "horse": "genus 0",
    "kitten": "genus 1",
    "hypersheet": "genus 1 with 3 loops: Costa's minimal surface",
    "igea": "genus 0",
    "bunny scans": "one object, its scans noisy as their spacing; loops where no scanner saw it",
    "goblet": "genus 0, drawn at random from its thin walls",
    "goblet's vertices": "genus 0",
    "sea shell": "genus 0 with 1 loop, drawn at random from its narrow coils",
    "sea shell's vertices": "genus 0 with 1 loop",
    "armadillo 1M": "genus 0",
}
# Single scans as clouds: what one sensor saw along -z, open, with noise and jumps.
SCANS = {
    "scan bun000": "stanford_bunny/bun000.ply",
    "scan bun090": "stanford_bunny/bun090.ply",
    "scan chin": "stanford_bunny/chin.ply",
    "scan dragon 264": "stanford_dragon_stand/dragonStandRight_264.ply",
    "scan happy 72": "stanford_happy_stand/happyStandRight_72.ply",
    "scan lato270": "meshlab_rangemaps/lato270.ply",
}
# Points of the two objects of the paper that are at hand, in another sampling: its own are drawn from their surfaces.
GOBLET, SEA_SHELL = 3_051, 7_782
# Seconds of the paper's Table 1 by points; 47,342 is what it kept of 52,704.
PAPER = {1_093: 8.00, 3_051: 16.39, 6_287: 51.48, 6_391: 68.17, 7_609: 92.56, 47_342: 1132.88}


def text(path):
    """The first three columns of a text file."""
    return np.loadtxt(path)[:, :3]


def obj(path):
    """Vertices and triangles of an OBJ file."""
    lines = [line.split() for line in Path(path).read_text().splitlines()]
    vertices = np.array([line[1:4] for line in lines if line[:1] == ["v"]], float)
    faces = np.array([[part.split("/")[0] for part in line[1:4]] for line in lines if line[:1] == ["f"]], int)
    return vertices, faces - 1


def gts(path):
    """Vertices and triangles of a GTS file: vertices, edges by their ends, triangles by their edges."""
    lines = Path(path).read_text().split("\n")
    counts = [int(word) for word in lines[0].split()[:3]]
    starts = np.cumsum([1, *counts])
    vertices = np.array([line.split()[:3] for line in lines[starts[0] : starts[1]]], float)
    edges = np.array([line.split()[:2] for line in lines[starts[1] : starts[2]]], int) - 1
    faces = np.array([line.split()[:3] for line in lines[starts[2] : starts[3]]], int) - 1
    ends = edges[faces]
    # The end that two edges of a triangle share lies opposite to the third.
    shared = [
        np.where((ends[:, i, :1] == ends[:, j]).any(1), ends[:, i, 0], ends[:, i, 1])
        for i, j in ((0, 1), (1, 2), (2, 0))
    ]
    return vertices, np.stack(shared, 1)


def placed_scans(path):
    """All points of registered range scans that a triangle of theirs uses, in the world."""
    import prepare

    scans = prepare.read_conf(path)
    placed = []
    for scan, rotation in zip(scans, prepare.rotations(scans), strict=True):
        limit = prepare.EDGE_LIMIT * prepare.spacing(scan)
        used = np.unique(prepare.triangulate(scan.points, scan.grid, limit))
        placed.append((scan.points @ rotation.T + scan.translation)[used])
    return np.concatenate(placed)


def torus(count):
    """Random points of a torus, uniform over its area."""
    rng = np.random.default_rng(3)
    u, v, w = 2 * np.pi * rng.random((2, 2 * count))[0], 2 * np.pi * rng.random(2 * count), rng.random(2 * count)
    kept = np.flatnonzero(4 * w <= 3 + np.cos(v))[:count]
    u, v = u[kept], v[kept]
    return np.stack([(3 + np.cos(v)) * np.cos(u), (3 + np.cos(v)) * np.sin(u), np.sin(v)], 1)


# Points of the smallest case, and of the smallest with noise.
SMALLEST, SMALLEST_NOISY = 400, 2000


def cases(wanted, record):
    """Name and maker of each set of points that is wanted."""
    if wanted.smallest:
        points = torus(SMALLEST)
        yield f"torus {SMALLEST}", lambda: points
        yield f"scan of torus {SMALLEST}", lambda: points[points[:, 2] > 0]
        return
    data = os.environ.get("SURFRECON_DATA")
    files = [
        ("bunny", "stanford_bunny/bun_zipper.ply", lambda path: ply.read_ply(path).vertices),
        ("horse", "points/giaccari_Horse.xyz", text),
        ("kitten", "points/kitten.xyz", text),
        ("hypersheet", "points/giaccari_hypersheet.xyz", text),
        ("igea", "meshes/igea.ply", lambda path: ply.read_ply(path).vertices),
        ("bunny scans", "stanford_bunny/bun.conf", placed_scans),
        ("goblet", "gts/goblet.gts", lambda path: surface.sample(*gts(path), GOBLET, 1)),
        ("goblet's vertices", "gts/goblet.gts", lambda path: gts(path)[0]),
        ("sea shell", "gts/seashell.gts", lambda path: surface.sample(*gts(path), SEA_SHELL, 1)),
        ("sea shell's vertices", "gts/seashell.gts", lambda path: gts(path)[0]),
        ("armadillo 1M", "meshes/libigl_armadillo.obj", lambda path: surface.sample(*obj(path), 1_000_000, 1)),
        *((name, file, lambda path: ply.read_ply(path).vertices) for name, file in SCANS.items()),
    ]
    for name, file, make in files:
        if not wanted.takes(name):
            continue
        if data and (Path(data) / file).is_file():
            yield name, lambda make=make, path=Path(data) / file: make(path)
        else:
            record.skip(f"{name}: {file} is not in SURFRECON_DATA")
    # Sizes of the paper's Table 1, and one beyond.
    for count in (*PAPER, 200_000):
        if wanted.takes(f"torus {count}"):
            yield f"torus {count}", lambda count=count: torus(count)


def build_cgal(folder, record):
    """The program of CGAL's reconstruction, or `None`."""
    compiler = shutil.which("c++")
    program = Path(folder) / "cgal_advancing_front"
    if compiler and Path("/usr/include/CGAL/Advancing_front_surface_reconstruction.h").is_file():
        source = HERE / "cgal_advancing_front.cpp"
        subprocess.run(
            [compiler, "-std=c++17", "-O3", "-DNDEBUG", source, "-o", program, "-lgmp", "-lmpfr"], check=True
        )
        return program
    record.skip(f"{CGAL}: libcgal-dev is not installed")
    return None


def quality(points, vertices, triangles):
    """The figures that the rows have of a surface."""
    figures = surface.topology(vertices, triangles)
    row = {"triangles": len(triangles)}
    if len(triangles) == 0:
        return dict.fromkeys(QUALITY) | row
    exact = np.ascontiguousarray(points.astype(np.float32) + np.float32(0)).view([("", np.float32)] * 3).ravel()
    on_it = np.ascontiguousarray(vertices[np.unique(triangles)].astype(np.float32) + np.float32(0))
    used = np.isin(np.unique(exact), on_it.view([("", np.float32)] * 3).ravel())
    row["used_pct"] = 100 * float(used.mean())
    return row | {name: figures[name] for name in QUALITY[1:]}


def run_case(name, points, tools, folder, wanted, record, noise=(None, None, None), repeats=None):
    """Runs the tools, programs by their commands, on a set of points; a row each.

    `noise`: that of the points in spacings, the percentage of outliers, and the true surface. `repeats` if not those of
    `wanted`.
    """
    file, out, moved = (Path(folder) / name for name in ("points.f64", "out.npz", "vertices.f64"))
    noise_spacings, outlier_pct, truth = noise
    points.tofile(file)
    spacing = float(np.median(cKDTree(points).query(points, k=2)[0][:, 1]))

    def once(tool):
        if tools[tool]:
            ours = ["--vertices", moved] if tool.startswith(OURS) else []
            figures, _ = measured.run([*tools[tool], file, out, *ours], cpu_limit=PROGRAM_CPU_S)
            vertices = np.fromfile(moved).reshape(-1, 3) if ours else points
            return figures, (vertices, np.fromfile(out, np.uint32)[1:].reshape(-1, 3).astype(np.int64))
        if len(points) > PYTHON_LIMIT:
            raise measured.Failed(f"not run for more than {PYTHON_LIMIT:,} points, which takes minutes")
        command = [sys.executable, HERE / "peer_scattered.py", tool, file, spacing, out]
        figures, printed = measured.run(command, cpu_limit=PYTHON_CPU_S)
        found = np.load(out)
        seconds = json.loads(printed.strip().splitlines()[-1])
        return figures | seconds, (found["vertices"], found["triangles"].astype(np.int64))

    def judge(_, made):
        row = quality(points, *made) | {"noise_spacings": noise_spacings, "outlier_pct": outlier_pct}
        is_known = truth is not None and row["triangles"] > 0
        return row | {"to_truth_rms": scattered_noise.to_truth_rms(made, truth) if is_known else None}

    return record.measure(
        wanted.tools(name, tools), repeats or wanted.repeats, once, lambda tool: {"case": name, "tool": tool}, judge
    )


def compare(rows):
    """Says which part of CGAL's CPU time this library takes."""
    cpu = {row["tool"]: row["cpu_s"] for row in rows if "cpu_s" in row}
    for tool, seconds in cpu.items():
        if tool.startswith(OURS) and CGAL in cpu:
            print(f"{tool}: {seconds / cpu[CGAL]:.3f} of the CPU time of {CGAL}")


def noisy(tools, folder, wanted, record):
    """Runs this library and Screened Poisson on points that carry noise; the latter's best depth is what counts.

    Unless all is asked for once each, since what is asked is how far from the truth the surfaces lie.
    """
    data = os.environ.get("SURFRECON_DATA")
    file = Path(data) / "gts/goblet.gts" if data else None
    shapes = scattered_noise.truths((lambda: gts(file)) if file and file.is_file() else None)
    noises, outliers, count = scattered_noise.NOISES, scattered_noise.OUTLIERS_PCT, scattered_noise.COUNT
    tools = {tool: tools[tool] for tool in (OURS, *POISSON)}
    if wanted.smallest:
        shapes, noises, outliers, count = islice(shapes, 1), [1], [5], SMALLEST_NOISY
        tools = {tool: tools[tool] for tool in (OURS, POISSON[0])}
    for shape, genus, make in shapes:
        truth = make()
        for outlier_pct, noise in product(outliers, noises):
            name = f"{shape}, noise {noise}, outliers {outlier_pct} %"
            if not any(wanted.tools(name, tools)):
                continue
            points = np.ascontiguousarray(scattered_noise.points(*truth, noise, outlier_pct, count))
            repeats = None if wanted.extent == ALL else 1
            found = run_case(name, points, tools, folder, wanted, record, (noise, outlier_pct, truth), repeats)
            print(f"\n{name}, {len(points):,} points" + (f" (genus {genus})" if genus is not None else ""), flush=True)
            columns = ["tool", "cpu_s", "wall_s", "triangles", "boundary_loops", "genus", "components", "to_truth_rms"]
            table.show(found, {column: column for column in columns})


def main(wanted, record):
    """Runs all cases, prints a table a case."""
    ours = wanted.programs / "examples" / "reconstruct_points"
    with tempfile.TemporaryDirectory() as folder:
        tools = {OURS: [ours], f"{OURS}-1-thread": [ours, "--threads", 1]}
        # The smallest case does without what must be compiled.
        cgal = None if wanted.smallest else build_cgal(folder, record)
        tools |= {CGAL: [cgal]} if cgal else {}
        tools |= dict.fromkeys(PYTHON_TOOLS)
        for name, make in cases(wanted, record):
            points = np.ascontiguousarray(make(), np.float64)
            is_scan = name.startswith("scan ")
            found = run_case(name, points, tools | ({SENSOR: None} if is_scan else {}), folder, wanted, record)
            columns = ["tool", "cpu_s", "wall_s", "peak_mb", "triangles", "used_pct", "boundary_loops"]
            columns += ["nonmanifold_edges", "nonmanifold_vertices", "genus", "components"]
            shape = "genus 1" if name.startswith("torus") else "one scan, open" if is_scan else ""
            known = KNOWN.get(name, shape)
            if len(points) in PAPER:
                known += f"; the paper takes {PAPER[len(points)]} s for as many"
            print(f"\n{name}, {len(points):,} points ({known})", flush=True)
            table.show(found, {column: column for column in columns})
            compare(found)
        noisy(tools | dict.fromkeys(POISSON), folder, wanted, record)
