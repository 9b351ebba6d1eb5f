"""Quad grids: every real scan's adaptive grid beside the uniform one of the same size, and how fast pixels pass.

Each case runs in a fresh process; times are medians of several calls there, on all cores. The memory's own speed is
measured in the same process: reading as many bytes as the image has, once. `share_of_bandwidth` is the image's bytes by
second over that; it is printed, not kept.
"""

import json
import os
import statistics
import sys

import measured
import table

# Case: file in SURFRECON_DATA, most scans of it, tiles (down, across) and vertices a tile side; None: the defaults.
CASES = {
    "bunny": ("stanford_bunny/bun.conf", 10, None),
    "bunny 55 x 37": ("stanford_bunny/bun.conf", 1, (6, 4, 10)),
    "dragon": ("stanford_dragon_stand/dragonStandRight.conf", 15, None),
    "dragon 31 x 31": ("stanford_dragon_stand/dragonStandRight.conf", 1, (5, 5, 7)),
    "happy": ("stanford_happy_stand/happyStandRight.conf", 15, None),
    "terrain N37E014": ("dem/N37E014.hgt", 1, None),
    "terrain N37E015": ("dem/N37E015.hgt", 1, None),
    "terrain Fuji": ("dem/fuji.png", 1, None),
    "living room": ("rgbd_open3d/depth", 5, None),
    "7-scenes": ("rgbd_7scenes", 50, None),
    "organized 0": ("organized_pcd/learn0.pcd", 1, None),
    "organized 1": ("organized_pcd/learn1.pcd", 1, None),
    "organized 2": ("organized_pcd/learn2.pcd", 1, None),
    "organized 3": ("organized_pcd/learn3.pcd", 1, None),
    "milk carton": ("organized_pcd/milk_cartoon_all_small_clorox.pcd", 1, None),
    "ptx": ("ptx/1.2-with-color.ptx", 1, None),
    # The paper's sizes, and a large one, of a smooth surface with a step and a hole.
    "154 x 183 -> 31 x 31": ((154, 183), 1, (5, 5, 7)),
    "399 x 263 -> 55 x 37": ((399, 263), 1, (6, 4, 10)),
    "4096 x 4096": ((4096, 4096), 1, None),
}
SMALLEST = {"61 x 73": ((61, 73), 1, (5, 5, 7))}
COLUMNS = ["case", "tool", "runs", "rel_err_adaptive", "rel_err_uniform", "wall_s", "mpix_per_s"]

PROGRAM = """
import json, sys, time, statistics
import numpy as np, surfrecon
source, most, tiles = json.loads(sys.argv[1])
if isinstance(source, list):
    rows, cols = source
    y, x = np.mgrid[:rows, :cols].astype(float)
    y, x = y / rows, x / cols
    z = np.sin(9 * x) * np.cos(7 * y) + 0.3 * np.sin(60 * x * y) + (x + 0.3 * y > 0.8) * 0.4
    z[(x - 0.3) ** 2 + (y - 0.6) ** 2 < 0.01] = np.nan
    images = [surfrecon.RangeImage.orthographic(z, step=(1.0, -1.0))]
else:
    images = [scan.read() for scan in list(surfrecon.open(source))[:most]]
    images = [image for image in images if isinstance(image, surfrecon.RangeImage)]
options = {} if tiles is None else dict(tiles_down=tiles[0], tiles_across=tiles[1], rows=tiles[2], columns=tiles[2])
out = []
for image in images:
    calls = 3 if image.rows * image.cols > 1e6 else 9
    times = []
    for _ in range(calls):
        start = time.perf_counter()
        grid = surfrecon.adaptive_quads(image, **options)
        times.append(time.perf_counter() - start)
    bytes = image.rows * image.cols * (12 if image.projection["kind"] == "points" else 8)
    memory = np.ones(max(bytes // 8, 1 << 22))
    reads = []
    for _ in range(3):
        start = time.perf_counter()
        memory.max()
        reads.append((time.perf_counter() - start) / memory.nbytes)
    seconds = statistics.median(times)
    out.append(dict(adaptive=grid.report["relative_error"], uniform=grid.report["uniform_relative_error"],
        seconds=seconds, pixels=image.rows * image.cols, share=bytes * statistics.median(reads) / seconds,
        size=[grid.rows, grid.columns]))
print(json.dumps(out))
"""


def main(wanted, record):
    """Runs the benchmark."""
    data = os.environ.get("SURFRECON_DATA")
    shown, worse = [], 0
    for case, (source, most, tiles) in (SMALLEST if wanted.smallest else CASES).items():
        if not wanted.takes(case):
            continue
        if isinstance(source, str):
            file, source = source, os.path.join(data or "", source)
            if not os.path.exists(source):
                record.skip(f"{case}: {file} is not in SURFRECON_DATA")
                continue
        made, extra = row(case, json.dumps([source, most, tiles]), wanted, record)
        if made:
            shown.append(made | extra)
        worse += extra.get("not_below", 0)
    columns = {"case": "case", "scans": "scans", "grid": "grid", "adaptive %": "rel_err_adaptive"}
    columns |= {"uniform %": "rel_err_uniform", "ratio": "ratio", "worst ratio": "worst", "s": "wall_s"}
    columns |= {"Mpix/s": "mpix_per_s", "of bandwidth": "share_of_bandwidth"}
    table.show(shown, columns)
    print(f"scans whose adaptive grid is not better than the uniform one: {worse}")


def row(case, arguments, wanted, record):
    """The row of a case, medians over the runs of means over its scans, and what is only printed."""
    extra, shares = {}, []

    def once(_):
        printed = measured.run([sys.executable, "-c", PROGRAM, arguments], timeout=600)[1]
        scans = json.loads(printed.splitlines()[-1])
        wall = statistics.mean(scan["seconds"] for scan in scans)
        figures = {"wall_s": wall, "mpix_per_s": statistics.mean(scan["pixels"] for scan in scans) / wall / 1e6}
        shares.append(statistics.mean(scan["share"] for scan in scans))
        extra["share_of_bandwidth"] = statistics.median(shares)
        return figures, scans

    def judge(_, scans):
        ratios = [scan["adaptive"] / scan["uniform"] for scan in scans if scan["uniform"] > 0]
        sizes = sorted({"{} x {}".format(*scan["size"]) for scan in scans})
        extra["scans"], extra["grid"] = len(scans), sizes[0] if len(sizes) == 1 else f"{sizes[0]} ..."
        extra["ratio"], extra["worst"] = statistics.geometric_mean(ratios), max(ratios)
        extra["not_below"] = sum(ratio >= 1 for ratio in ratios)
        return {
            f"rel_err_{kind}": 100 * statistics.mean(scan[kind] for scan in scans) for kind in ("adaptive", "uniform")
        }

    made = record.measure(["surfrecon"], wanted.repeats, once, lambda tool: {"case": case, "tool": tool}, judge)
    return (made[0] if made else {}), extra
