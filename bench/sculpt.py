"""Height maps to triangles within a bound: this library, beside greedy insertion, a right-triangulated network, quadric
collapse, and the pipeline of the paper.

meshoptimizer is told the tolerance, but measures otherwise: its largest error shows by how much it overshoots.

Grids are scaled to a depth extent of 1, so that tolerances are shares of it. Every run is a fresh process; times are of
the meshing alone, without imports and files: medians for the tools in TIMED, of one run for the others. One checker
measures all: triangles on valid pixels, largest error there.
"""

import json
import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

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


def tools_for(kind, pixels, tolerance_pct):
    """The tools that run on a grid: all on those of the main cases, others are counted only."""
    if kind != "main":
        return TIMED
    small, slow = pixels <= SMALL, tolerance_pct == SLOW_PCT
    return TIMED + BEST + OTHERS * (small or slow) + REFERENCE * small + QUADRIC * (small and slow)


def unit_extent(heights):
    """Scaled to [0, 1] and rounded to 16 bits, as sensors do."""
    low, high = np.nanmin(heights), np.nanmax(heights)
    return np.round((heights - low) / (high - low) * 65535) / 65535


def terrain(file):
    """An SRTM tile; voids become NaN."""
    raw = np.fromfile(file, ">i2").astype(float)
    side = round(raw.size**0.5)
    raw[raw == -32768] = np.nan
    return unit_extent(raw.reshape(side, side))


def depth_image(file):
    """A camera's depths in millimetres as heights; 0 and 65535 are no depths."""
    import open3d

    raw = np.asarray(open3d.io.read_image(str(file))).astype(float)
    raw[(raw == 0) | (raw == 65535)] = np.nan
    return unit_extent(-raw)


def synthetic(side):
    """Fractal hills, eight round ones, and one step."""
    rng = np.random.default_rng(7)
    f = np.hypot(np.fft.fftfreq(side)[:, None], np.fft.rfftfreq(side)[None])
    f[0, 0] = 1
    z = np.fft.irfft2((rng.normal(size=f.shape) + 1j * rng.normal(size=f.shape)) * f**-2.4 * (f < 1), (side, side))
    z = (z - z.min()) / np.ptp(z)
    y, x = np.mgrid[:side, :side] / side
    for _ in range(8):
        cx, cy, width, height = *rng.random(2), 0.03 + 0.08 * rng.random(), 0.3 * rng.random()
        z += height * np.exp(-((x - cx) ** 2 + (y - cy) ** 2) / (2 * width * width))
    return unit_extent(z + 0.15 * ((x > 0.6) & (y > 0.55) & (x < 0.85) & (y < 0.8)))


def smooth_object(side=132):
    """A head-like shape with the background left out: about as many pixels as the paper's images, and as smooth."""
    y, x = np.mgrid[:side, :side] * (2 / (side - 1)) - 1
    inside = (x / 0.9) ** 2 + (y / 0.98) ** 2
    bump = lambda cx, cy, w, h: np.exp(-(((x - cx) / w) ** 2) - ((y - cy) / h) ** 2)  # noqa: E731
    z = np.sqrt(np.maximum(1.15 - inside, 0)) + 0.25 * bump(0, 0.05, 0.1, 0.22)
    z += 0.08 * bump(0, 0.5, 0.25, 0.06) - 0.1 * (bump(-0.3, -0.2, 0.14, 0.09) + bump(0.3, -0.2, 0.14, 0.09))
    return unit_extent(np.where(inside < 1, z, np.nan))


def scan(file):
    """A range scan seen along z on a regular grid of its own spacing, the largest part of its surface only."""
    import open3d
    import surfrecon
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    mesh = surfrecon.read(file).triangulate()
    points, triangles = np.asarray(mesh.positions), np.asarray(mesh.triangles)
    edges = np.concatenate([triangles[:, :2], triangles[:, 1:]])
    graph = coo_matrix((np.ones(len(edges)), edges.T), (len(points), len(points)))
    part = connected_components(graph, directed=False)[1][triangles[:, 0]]
    triangles = triangles[part == np.bincount(part).argmax()]
    used = points[np.unique(triangles)]
    low, high = used.min(0), used.max(0)
    e = points[triangles[:, 1]] - points[triangles[:, 0]]
    pitch = float(np.median(np.linalg.norm(e[:, :2], axis=1)))
    scene = open3d.t.geometry.RaycastingScene()
    moved = (points - [low[0], low[1], high[2]]).astype(np.float32)
    scene.add_triangles(open3d.core.Tensor(moved), open3d.core.Tensor(triangles.astype(np.uint32)))
    cols, rows = ((high - low)[:2] / pitch).astype(int) + 1
    x, y = np.meshgrid((np.arange(cols) + 0.25) * pitch, (np.arange(rows) + 0.25) * pitch)
    rays = np.stack([x, y, np.full_like(x, 0.01), 0 * x, 0 * x, 0 * x - 1], -1).astype(np.float32)
    depth = scene.cast_rays(open3d.core.Tensor(rays))["t_hit"].numpy().astype(float)
    return unit_extent(np.where(np.isfinite(depth), -depth, np.nan))


def cases(skipped):
    """Name, kind and maker of each grid; those that can't run are named in `skipped`."""
    data = os.environ.get("SURFRECON_DATA")
    main = [
        ("bun000", "stanford_bunny/bun000.ply", scan),
        ("dragonStandRight_0", "stanford_dragon_stand/dragonStandRight_0.ply", scan),
        ("kinect", "rgbd_7scenes/frame-000150.depth.png", depth_image),
        ("N37E015", "dem/N37E015.hgt", terrain),
    ]
    # On none of these was anything tuned.
    others = [
        ("N37E014", "dem/N37E014.hgt", terrain),
        ("bun090", "stanford_bunny/bun090.ply", scan),
        ("dragonStandRight_96", "stanford_dragon_stand/dragonStandRight_96.ply", scan),
        ("happyStandRight_48", "stanford_happy_stand/happyStandRight_48.ply", scan),
        ("kinect 170", "rgbd_7scenes/frame-000170.depth.png", depth_image),
    ]
    for kind, files in (("main", main), ("others", others)):
        for name, file, make in files:
            if data and (Path(data) / file).is_file():
                yield name, kind, lambda make=make, path=Path(data) / file: make(path)
            else:
                skipped.append(f"{name}: {file} is not in SURFRECON_DATA")
    yield "paper's size", "main", smooth_object
    yield "synthetic 1024", "main", lambda: synthetic(1024)
    for side in (128, 256, 512, 1024, 2048, 4096):
        yield f"growth {side}", "growth", lambda side=side: synthetic(side)


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


def measure(case, tool, grid, heights, tolerance_pct, repeats):
    """One row: medians of the times of `repeats` fresh processes."""
    row = {"case": case, "tool": tool, "tau_pct": tolerance_pct}
    runs = []
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "mesh.npz"
        try:
            for _ in range(repeats):
                command = [sys.executable, HERE / "peer_sculpt.py", tool, grid, tolerance_pct / 100, out]
                figures, printed = measured.run(command)
                runs.append({"peak_mb": figures["peak_mb"]} | json.loads(printed.strip().splitlines()[-1]))
        except measured.Failed as failed:
            return row | {"failed": str(failed)}
        mesh = np.load(out)
        triangles, largest, rms = check(heights, mesh["positions"], mesh["triangles"].astype(int))
    row |= {"triangles": triangles, "pct_of_full": 100 * triangles / full_triangles(heights)}
    row |= {"max_err_pct": 100 * largest, "rms_err_pct": 100 * rms}
    return row | {key: statistics.median(run[key] for run in runs) for key in runs[0]}


def against_greedy(rows):
    """Prints how many triangles and how much time this library needs of those of greedy insertion."""
    greedy = {(row["case"], row["tau_pct"]): row for row in rows if row["tool"] == "pydelatin" and "failed" not in row}
    ratios = []
    for row in rows:
        other = greedy.get((row["case"], row["tau_pct"]))
        if row["tool"].startswith("surfrecon") and "failed" not in row and other:
            ratio = {"case": row["case"], "tool": row["tool"], "tau_pct": row["tau_pct"]}
            ratio["triangles"] = row["triangles"] / other["triangles"]
            ratio |= {key: row[key] / other["wall_s"] for key in ("wall_s", "redig_s") if key in row}
            ratios.append(ratio | {"cpu_s": row["cpu_s"] / other["cpu_s"]})
    print("\nOf pydelatin's triangles, wall time (first run and coming back to a tolerance) and CPU time")
    columns = ["case", "tool", "tau_pct", "triangles", "wall_s", "redig_s", "cpu_s"]
    table.show(ratios, {column: column for column in columns})


def main(only_cases, repeats):
    """Runs all cases, prints a table a case."""
    peer = ["--manifest-path", HERE / "meshopt" / "Cargo.toml", "--target-dir", HERE.parent / "target"]
    subprocess.run(["cargo", "build", "--release", "--quiet", "--locked", *peer], check=True)
    rows, skipped = [], []
    for name, kind, make in cases(skipped):
        if only_cases not in name:
            continue
        heights = make()
        with tempfile.TemporaryDirectory() as folder:
            grid = Path(folder) / "grid.npy"
            np.save(grid, heights)
            for tolerance in [GROWTH_PCT] if kind == "growth" else TOLERANCES_PCT:
                found = []
                for tool in tools_for(kind, heights.size, tolerance):
                    times = repeats if tool in TIMED and heights.size < 1 << 22 else 1
                    found.append(measure(name, tool, grid, heights, tolerance, times))
                rows += found
                columns = ["tool", "tau_pct", "triangles", "pct_of_full", "max_err_pct", "rms_err_pct"]
                columns += ["cpu_s", "wall_s", "redig_s", "peak_mb"]
                print(f"\n{name}, {tolerance} %")
                table.show(found, {column: column for column in columns})
    against_greedy(rows)
    for text in skipped:
        print(f"SKIPPED {text}")
    return {"rows": rows, "skipped": skipped}
