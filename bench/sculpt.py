"""Height maps to triangles within a bound: this library, beside greedy insertion, a right-triangulated network, quadric
collapse, and the pipeline of the paper.

meshoptimizer is told the tolerance, but measures otherwise: its largest error shows by how much it overshoots.

Grids are scaled to a depth extent of 1, so that tolerances are shares of it. Every run is a fresh process; times are of
the meshing alone, without imports and files: medians for the tools in TIMED, of one run for the others. One checker
measures all: triangles on valid pixels, largest error there.

The paper's own images can't be had; three cases have their size. The virtual scans are about as smooth: greedy
insertion, which is about as good as the decimation that the paper compares with, leaves about as many triangles. The
head is harder than the paper's images: curved everywhere, and with 130 pixels across it there is little to leave out.
"""

import json
import os
import sys
import tempfile
from pathlib import Path

import height_maps
import measured
import numpy as np
import table

HERE = Path(__file__).resolve().parent
TOLERANCES_PCT = [0.28, 0.14, 0.069, 0.041, 0.013]
# Their times are compared.
TIMED = ["surfrecon", "pydelatin"]
BEST = ["surfrecon-search", "surfrecon-free"]
OTHERS = ["surfrecon-dug", "surfrecon-floor", "surfrecon-borders", "pymartini", "meshoptimizer"]
# The pipeline of the paper tetrahedralizes all pixels; the quadric collapses take away all that is too much a dozen
# times to find the bound.
REFERENCE = ["surfrecon-reference"]
QUADRIC = ["open3d-quadric", "meshlab-quadric"]
# Pixels of small grids, on which every tool runs; and the one tolerance of the slowest tools, and of most on large
# grids.
SMALL = 100_000
SLOW_PCT = 0.069
# Growth is measured at one tolerance.
GROWTH_PCT = 0.041
# A run that takes more CPU time is given up.
LIMIT_S = 120
# Triangles left in % and seconds on the paper's image of 26,028 triangles (table 1).
PAPER = {0.28: (10.4, 43.07), 0.14: (15.6, 44.22), 0.069: (21.5, 46.39), 0.041: (26.1, 48.84), 0.013: (42.9, 61.06)}
PAPER_SIZE = ["forked pipe", "bottle", "head"]
COLUMNS = ["case", "tool", "tau_pct", "runs", "triangles", "pct_of_full", "max_err_pct", "rms_err_pct"]
COLUMNS += ["cpu_s", "wall_s", "peak_mb"]


def tools_for(case, kind, pixels, tolerance_pct, wanted):
    """The tools that run on a grid: all on those of the main cases, others are counted only."""
    if wanted.smallest:
        return TIMED + BEST + OTHERS + REFERENCE + QUADRIC
    small, slow = pixels <= SMALL, tolerance_pct == SLOW_PCT
    main = BEST + OTHERS * (small or slow) + REFERENCE * small + QUADRIC * (small and slow)
    return wanted.tools(case, TIMED + main * (kind == "main"))


def cases(wanted, record):
    """Name, kind and maker of each grid that is wanted."""
    if wanted.smallest:
        yield "synthetic 32", "main", lambda: height_maps.synthetic(32)
        return
    data = os.environ.get("SURFRECON_DATA")
    main = [
        ("bun000", "stanford_bunny/bun000.ply", height_maps.scan),
        ("dragonStandRight_0", "stanford_dragon_stand/dragonStandRight_0.ply", height_maps.scan),
        ("kinect", "rgbd_7scenes/frame-000150.depth.png", height_maps.depth_image),
        ("N37E015", "dem/N37E015.hgt", height_maps.terrain),
    ]
    # On none of these was anything tuned.
    others = [
        ("N37E014", "dem/N37E014.hgt", height_maps.terrain),
        ("bun090", "stanford_bunny/bun090.ply", height_maps.scan),
        ("dragonStandRight_96", "stanford_dragon_stand/dragonStandRight_96.ply", height_maps.scan),
        ("happyStandRight_48", "stanford_happy_stand/happyStandRight_48.ply", height_maps.scan),
        ("kinect 170", "rgbd_7scenes/frame-000170.depth.png", height_maps.depth_image),
    ]
    for kind, files in (("main", main), ("others", others)):
        for name, file, make in files:
            if not wanted.takes(name):
                continue
            if data and (Path(data) / file).is_file():
                yield name, kind, lambda make=make, path=Path(data) / file: make(path)
            else:
                record.skip(f"{name}: {file} is not in SURFRECON_DATA")
    made = list(zip(PAPER_SIZE, ["main"] * 3, (height_maps.pipe, height_maps.bottle, height_maps.head), strict=True))
    made += [("synthetic 1024", "main", lambda: height_maps.synthetic(1024))]
    sides = (128, 256, 512, 1024, 2048, 4096)
    made += [(f"growth {side}", "growth", lambda side=side: height_maps.synthetic(side)) for side in sides]
    yield from (case for case in made if wanted.takes(case[0]))


def check(heights, positions, triangles):
    """Triangles on valid pixels, largest and RMS error there; of all triangles at a pixel the worst one counts."""
    errors = np.full(heights.shape, -1.0)
    corners = positions[triangles]
    low = np.ceil(corners[:, :, :2].min(1)).astype(int)
    size = np.floor(corners[:, :, :2].max(1)).astype(int) - low + 1
    a, b, c = (corners[:, i] for i in range(3))
    area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    middle = np.rint(corners[:, :, :2].mean(1)).astype(int)
    inside = np.all((middle >= 0) & (middle < heights.shape[::-1]), axis=1)
    on_valid = np.zeros(len(triangles), bool)
    on_valid[inside] = ~np.isnan(heights[middle[inside, 1], middle[inside, 0]])

    def compare(t, x, y):
        """Pixels (x, y) with triangles t, arrays that go together."""
        # Triangles edge-on have no area and cover no pixel.
        with np.errstate(divide="ignore", invalid="ignore"):
            seen, of_b, of_c = inside_of(t, x, y)
        t, x, y, of_b, of_c = t[seen], x[seen], y[seen], of_b[seen], of_c[seen]
        z = a[t, 2] + of_b * (b[t, 2] - a[t, 2]) + of_c * (c[t, 2] - a[t, 2])
        np.maximum.at(errors, (y, x), np.abs(z - heights[y, x]))

    def inside_of(t, x, y):
        of_b = ((x - a[t, 0]) * (c[t, 1] - a[t, 1]) - (y - a[t, 1]) * (c[t, 0] - a[t, 0])) / area[t]
        of_c = ((b[t, 0] - a[t, 0]) * (y - a[t, 1]) - (b[t, 1] - a[t, 1]) * (x - a[t, 0])) / area[t]
        seen = (of_b > -1e-9) & (of_c > -1e-9) & (of_b + of_c < 1 + 1e-9)
        return seen & (x >= 0) & (y >= 0) & (x < heights.shape[1]) & (y < heights.shape[0]), of_b, of_c

    # Large triangles one by one; others of like size together: one step of the loop a pixel of their box.
    large = size.prod(1) > 1024
    for t in np.flatnonzero(large):
        y, x = np.mgrid[low[t, 1] : low[t, 1] + size[t, 1], low[t, 0] : low[t, 0] + size[t, 0]].reshape(2, -1)
        compare(np.full(x.shape, t), x, y)
    group = np.ceil(np.log2(np.maximum(size, 1))).astype(int)
    for w, h in np.unique(group[~large], axis=0):
        which = np.flatnonzero((group[:, 0] == w) & (group[:, 1] == h) & ~large)
        for dy in range(1 << h):
            for dx in range(1 << w):
                t = which[(dx < size[which, 0]) & (dy < size[which, 1])]
                compare(t, low[t, 0] + dx, low[t, 1] + dy)
    covered = errors[(errors >= 0) & ~np.isnan(heights)]
    return int(on_valid.sum()), float(covered.max()), float(np.sqrt(np.mean(covered**2)))


def full_triangles(heights):
    """Triangles of all samples: two a full cell, one a cell of three corners."""
    valid = ~np.isnan(heights)
    corners = valid[:-1, :-1].astype(int) + valid[1:, :-1] + valid[:-1, 1:] + valid[1:, 1:]
    return int(2 * (corners == 4).sum() + (corners == 3).sum())


def measure(case, tools, file, heights, tolerance_pct, wanted, record, repeats):
    """A row a tool at one tolerance."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "mesh.npz"

        def once(tool):
            command = [sys.executable, HERE / "peer_sculpt.py", tool, file, tolerance_pct / 100, out, wanted.programs]
            figures, printed = measured.run(command, cpu_limit=LIMIT_S)
            mesh = np.load(out)
            return figures | json.loads(printed.strip().splitlines()[-1]), (mesh["positions"], mesh["triangles"])

        def judge(_, mesh):
            triangles, largest, rms = check(heights, mesh[0], mesh[1].astype(int))
            share = 100 * triangles / full_triangles(heights)
            return {
                "triangles": triangles,
                "pct_of_full": share,
                "max_err_pct": 100 * largest,
                "rms_err_pct": 100 * rms,
            }

        return record.measure(
            tools, repeats, once, lambda tool: {"case": case, "tool": tool, "tau_pct": tolerance_pct}, judge
        )


def against_greedy(rows):
    """Prints how many triangles and how much time this library needs of those of greedy insertion."""
    greedy = {(row["case"], row["tau_pct"]): row for row in rows if row["tool"] == "pydelatin" and "failed" not in row}
    ratios = []
    for row in rows:
        other = greedy.get((row["case"], row["tau_pct"]))
        if row["tool"].startswith("surfrecon") and "failed" not in row and other:
            ratio = {"case": row["case"], "tool": row["tool"], "tau_pct": row["tau_pct"]}
            ratio["triangles"] = row["triangles"] / other["triangles"]
            ratio |= {
                key: row[key] / max(other["wall_s"], measured.LEAST_S) for key in ("wall_s", "redig_s") if key in row
            }
            ratios.append(ratio | {"cpu_s": row["cpu_s"] / max(other["cpu_s"], measured.LEAST_S)})
    print("\nOf pydelatin's triangles, wall time (first run and coming back to a tolerance) and CPU time")
    columns = ["case", "tool", "tau_pct", "triangles", "wall_s", "redig_s", "cpu_s"]
    table.show(ratios, {column: column for column in columns})


def beside_the_paper(rows):
    """Prints our rows of the images of the paper's size beside its table 1."""
    ours = [row for row in rows if row["case"] in PAPER_SIZE and row["tool"] == "surfrecon" and "failed" not in row]
    print("\nThe paper's table 1: triangles left in %, and its seconds beside our milliseconds")
    found = []
    for row in ours:
        left, seconds = PAPER[row["tau_pct"]]
        line = {"case": row["case"], "tau_pct": row["tau_pct"], "pct_of_full": row["pct_of_full"], "paper_pct": left}
        line["full"] = round(100 * row["triangles"] / row["pct_of_full"])
        line |= {"wall_ms": 1000 * row["wall_s"], "redig_ms": 1000 * row["redig_s"], "paper_s": seconds}
        found.append(line)
    columns = ["case", "full", "tau_pct", "pct_of_full", "paper_pct", "wall_ms", "redig_ms", "paper_s"]
    table.show(found, {column: column for column in columns})


def growth(rows):
    """Prints how time and memory grow with the pixels."""
    found = []
    for row in rows:
        if row["case"].startswith("growth") and "failed" not in row:
            pixels = int(row["case"].split()[1]) ** 2
            line = {"pixels": pixels, "tool": row["tool"], "triangles": row["triangles"], "wall_s": row["wall_s"]}
            line |= {"cpu_us_a_pixel": 1e6 * row["cpu_s"] / pixels, "peak_mb": row["peak_mb"]}
            found.append(line)
    print(f"\nGrowth with the number of pixels, at {GROWTH_PCT} %")
    columns = ["pixels", "tool", "triangles", "wall_s", "cpu_us_a_pixel", "peak_mb"]
    table.show(found, {column: column for column in columns})


def main(wanted, record):
    """Runs all cases, prints a table a case."""
    built = (wanted.programs / "surfrecon-bench-meshopt").is_file()
    if not built and not wanted.smallest:
        record.skip("meshoptimizer: its program, bench/meshopt, is not built")
    for name, kind, make in cases(wanted, record):
        heights = make()
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "grid.npy"
            np.save(file, heights)
            tolerances = [SLOW_PCT] if wanted.smallest else [GROWTH_PCT] if kind == "growth" else TOLERANCES_PCT
            for tolerance in tolerances:
                found = []
                tools = tools_for(name, kind, heights.size, tolerance, wanted)
                tools = [tool for tool in tools if built or tool != "meshoptimizer"]
                timed = [tool for tool in tools if tool in TIMED]
                repeats = wanted.repeats if kind != "others" and heights.size < 1 << 22 else 1
                found += measure(name, timed, file, heights, tolerance, wanted, record, repeats)
                rest = [tool for tool in tools if tool not in TIMED]
                found += measure(name, rest, file, heights, tolerance, wanted, record, 1)
                columns = ["tool", "tau_pct", "triangles", "pct_of_full", "max_err_pct", "rms_err_pct"]
                columns += ["cpu_s", "wall_s", "redig_s", "peak_mb"]
                print(f"\n{name}, {tolerance} %", flush=True)
                table.show(found, {column: column for column in columns})
    against_greedy(record.rows)
    beside_the_paper(record.rows)
    growth(record.rows)
