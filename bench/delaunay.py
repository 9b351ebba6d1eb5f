"""Tetrahedralizing points: this library beside CGAL, TetGen, Gmsh and Qhull on the same points.

Every run is a fresh process that reads the points from a file of doubles. Tools take turns, figures are medians; those
of the compiled programs are the whole process's, those of the Python packages leave their import out.
"""

import json
import shutil
import subprocess
import sys
from pathlib import Path

import measured
import numpy as np
import table

HERE = Path(__file__).resolve().parent
OURS = "surfrecon"
# Tool and threads. Qhull takes minutes on lattices and is left to the small case.
TOOLS = [(OURS, 1), (OURS, 2), ("cgal", 1), ("cgal", 2), ("tetgen", 1), ("gmsh", 1), ("qhull", 1)]
COMPILED = ["cgal", "tetgen"]
QHULL_LIMIT = 200_000
COLUMNS = ["case", "tool", "threads", "points", "runs", "cpu_s", "wall_s", "peak_mb", "tets"]
# For each run: ten times what the slowest tool takes for the largest set. Gmsh does not end on two layers of a lattice.
CPU_LIMIT_S = 240


def uniform(count, seed):
    """Points spread evenly over a cube."""
    return np.random.Generator(np.random.PCG64(seed)).random((count, 3))


def exact_torus(count, seed):
    """A torus to the last bits, in random order: spheres that touch it along circles make cells that span it."""
    u, v = np.random.Generator(np.random.PCG64(seed)).random((2, count)) * 2 * np.pi
    return np.stack([(3 + np.cos(v)) * np.cos(u), (3 + np.cos(v)) * np.sin(u), np.sin(v)], 1)


def torus(count, seed):
    """A bumpy torus with noise, in random order."""
    random = np.random.Generator(np.random.PCG64(seed))
    u, v = random.random(count) * 2 * np.pi, random.random(count) * 2 * np.pi
    r = 0.35 * (1 + 0.15 * np.sin(5 * u) * np.cos(3 * v))
    points = np.stack([(1 + r * np.cos(v)) * np.cos(u), (1 + r * np.cos(v)) * np.sin(u), r * np.sin(v)], 1)
    return points + random.normal(0, 1e-3, (count, 3))


def curvature_space(side, seed):
    """The pixels of a quantized range image with jumps, lifted by the logarithm of their curvature."""
    random = np.random.Generator(np.random.PCG64(seed))
    y, x = np.mgrid[0:side, 0:side] / side
    z = np.zeros((side, side))
    for _ in range(8):
        cx, cy, s, a = random.random(), random.random(), 0.05 + 0.15 * random.random(), 40 + 160 * random.random()
        z += a * np.exp(-((x - cx) ** 2 + (y - cy) ** 2) / (2 * s * s))
    z += 60.0 * (x > 0.4) + 45.0 * (y > 0.65) - 80.0 * ((x - 0.7) ** 2 + (y - 0.3) ** 2 < 0.02)
    z = np.round(z + random.normal(0, 0.6, z.shape))
    p = np.pad(z, 1, mode="edge")
    around = [(i, j) for i in range(3) for j in range(3) if (i, j) != (1, 1)]
    k = np.abs(8 * z - sum(p[i : i + side, j : j + side] for i, j in around))
    lifted = np.log(1 + k * k)
    steps = [np.abs(np.diff(lifted, axis=axis)).max() for axis in (0, 1)]
    gamma = 20 * np.sqrt(7) / max(steps)
    row, column = np.mgrid[0:side, 0:side].astype(float)
    return np.stack([20 * row, 20 * column, gamma * lifted], -1).reshape(-1, 3)


def lattice(side):
    """A cube of integers."""
    return np.stack(np.meshgrid(*[np.arange(side)] * 3, indexing="ij"), -1).reshape(-1, 3).astype(float)


def two_layers(side):
    """Two squares of integers, the second half a step aside and one above."""
    i, j = np.meshgrid(np.arange(side), np.arange(side), indexing="ij")
    layer = np.stack([i, j, 0 * i], -1).reshape(-1, 3).astype(float)
    return np.concatenate([layer, layer + [0.5, 0.5, 1.0]])


CASES = {
    "uniform 100 k": lambda: uniform(100_000, 1),
    "uniform 1 M": lambda: uniform(1_000_000, 2),
    "uniform 3 M": lambda: uniform(3_000_000, 3),
    "curvature space of 1024^2": lambda: curvature_space(1024, 6),
    "noisy torus 1 M": lambda: torus(1_000_000, 5),
    "exact torus 100 k": lambda: exact_torus(100_000, 4),
    "100^3 integers": lambda: lattice(100),
    "two layers of integers 500 k": lambda: two_layers(500),
}
SMALLEST = {"uniform 2 k": lambda: uniform(2_000, 1)}


def compile_peers():
    """The program of the compiled peers, or why there is none."""
    source, program = HERE / "peer_delaunay.cpp", HERE.parent / "target" / "bench" / "peer_delaunay"
    program.parent.mkdir(parents=True, exist_ok=True)
    if program.is_file() and program.stat().st_mtime > source.stat().st_mtime:
        return program, None
    if not shutil.which("c++"):
        return None, "there is no C++ compiler"
    # CGAL's interval arithmetic needs its rounding left alone.
    flags = ["-O3", "-march=native", "-ffp-contract=off", "-frounding-math", "-DNDEBUG", "-DCGAL_LINKED_WITH_TBB"]
    libraries = ["-ltet", "-ltbb", "-ltbbmalloc", "-lgmp", "-lmpfr"]
    command = ["c++", "-std=c++17", *flags, source, "-o", program, *libraries]
    built = subprocess.run(list(map(str, command)), capture_output=True, text=True, check=False)
    errors = [line for line in built.stderr.splitlines() if "error" in line] or ["the compiler failed"]
    return program, None if built.returncode == 0 else errors[0]


def command(tool, wanted, points, compiled):
    """The program and arguments that tetrahedralize a file of points."""
    name, threads = tool
    if name == OURS:
        return [wanted.programs / "examples" / "delaunay", points, "--threads", threads]
    if name in COMPILED:
        return [compiled, name, points, threads]
    return [sys.executable, HERE / "peer_delaunay.py", name, points, threads]


def run_case(name, points, tools, wanted, record, compiled):
    """Runs the tools in turn on one set of points; returns a row a tool."""
    file = wanted.out / "inputs" / f"{name.replace(' ', '_')}.f64"
    file.parent.mkdir(parents=True, exist_ok=True)
    points.astype("<f8").tofile(file)

    def head(tool):
        return {"case": name, "tool": tool[0], "threads": tool[1], "points": len(points)}

    def once(tool):
        print(f"  {name}: {tool[0]} on {tool[1]}", flush=True)
        figures, printed = measured.run(command(tool, wanted, file, compiled), cpu_limit=CPU_LIMIT_S)
        told = json.loads(printed.splitlines()[-1])
        tets = told.pop("tets")
        return figures | told, tets

    tools = [tool for tool in tools if tool[0] != "qhull" or len(points) <= QHULL_LIMIT]
    tools = [tool for tool in tools if wanted.takes(name, tool[0])]
    rows = record.measure(tools, wanted.repeats, once, head, lambda _, tets: {"tets": tets}, add_ratios)
    file.unlink()
    return rows


def add_ratios(rows):
    """Our times as a part of each tool's on as many threads, and our wall time on one thread over that on several."""
    done = {(row["tool"], row["threads"]): row for row in rows if "cpu_s" in row}
    for (tool, threads), row in done.items():
        ours = done.get((OURS, threads))
        if ours and tool != OURS:
            row["ours_cpu_ratio"] = ours["cpu_s"] / max(row["cpu_s"], measured.LEAST_S)
            row["ours_wall_ratio"] = ours["wall_s"] / row["wall_s"]
        if tool == OURS and threads > 1 and (OURS, 1) in done:
            row["speedup"] = done[OURS, 1]["wall_s"] / row["wall_s"]


def main(wanted, record):
    """Runs the benchmark."""
    cases, tools, compiled = CASES, TOOLS, None
    if wanted.smallest:
        # Neither those that must be compiled, nor Gmsh, which needs libraries of the system.
        cases, tools = SMALLEST, [tool for tool in TOOLS if tool[0] in (OURS, "qhull")]
    else:
        compiled, missing = compile_peers()
        if missing:
            record.skip(f"{' and '.join(COMPILED)}: {missing}")
            tools = [tool for tool in TOOLS if tool[0] not in COMPILED]
    for name, make in cases.items():
        if wanted.takes(name):
            run_case(name, make(), tools, wanted, record, compiled)
            print()
    columns = {
        "case": "case", "tool": "tool", "threads": "threads", "CPU s": "cpu_s", "wall s": "wall_s", "MB": "peak_mb",
        "tetrahedra": "tets", "ours / it, CPU": "ours_cpu_ratio", "wall": "ours_wall_ratio", "speedup": "speedup",
    }  # fmt: skip
    table.show(record.rows, columns)
