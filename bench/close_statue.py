"""The surfaces that the guide to printing shows: a statue on a table, scanned from one side, merged and closed.

Usage: python close_statue.py OUT      writes OUT/printing.npz and its figures, OUT/printing.json, which it prints too

Ours and Screened Poisson close the same merged surface. Of each face is told whether it was filled, and whether it lies
where a scan saw that nothing is. Lengths are in mm.
"""

import json
import math
import sys
import tempfile
from pathlib import Path

import close
import close_figures
import noise_figures
import noise_scans
import noise_shapes
import numpy as np
import surfrecon

PIXELS, FOCAL, AWAY = 400, 984.0, 760.0
# Elevation in radians, then the cameras of an arc from some degrees to some degrees around the statue.
ARCS = [(0.2, 5, 20, 160), (0.7, 3, 40, 140)]
NOISE = 0.1
# Half a side of the table, and the samples that lie so near to it are taken away with it.
TABLE, MARGIN = 170.0, 0.6
# Faces are halved until no edge is longer than as many cells, so that marks have smooth borders.
EDGE_CELLS = 1.0


def poses(middle):
    """Cameras in front of the statue; none sees its back."""
    for elevation, count, first, last in ARCS:
        for turn in np.radians(np.linspace(first, last, count)):
            flat = math.cos(elevation)
            way = np.array([flat * math.cos(turn), flat * math.sin(turn), math.sin(elevation)])
            yield noise_shapes.look(middle + AWAY * way, middle)


def on_a_table(statue):
    """The statue and the top of a table below it, as one mesh."""
    corners = TABLE * np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], float)
    top = len(statue.positions) + np.array([(0, 1, 2), (0, 2, 3)])
    return surfrecon.Mesh(np.vstack([statue.positions, corners]), np.vstack([statue.triangles, top]))


def scanned(statue):
    """Virtual scans of the statue on its table, and the same as depth images for the judge."""
    seen_by = noise_scans.Camera(PIXELS, PIXELS, FOCAL)
    places = list(poses(np.mean(statue.bounds, axis=0)))
    lens = {"focal": (FOCAL, FOCAL), "centre": seen_by.centre}
    cameras = [surfrecon.Camera.intrinsic(PIXELS, PIXELS, world_from_sensor=pose, **lens) for pose in places]
    scans = surfrecon.virtual_scan(on_a_table(statue), cameras, noise=NOISE, seed=1)
    depth = np.stack([np.nan_to_num(scan.values).astype(np.float32) for scan in scans])
    return scans, noise_scans.Shots(seen_by, np.stack(places), depth, 2 * AWAY / FOCAL)


def poisson(merged):
    """Screened Poisson of the merged surface, as the benchmark of closing runs it."""
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        np.savez(folder / "merged.npz", positions=merged.positions, triangles=merged.triangles)
        close.tool_run(close.POISSON, folder, folder / "poisson.npz")
        return close.mesh_of(folder / "poisson.npz")


def halved(corners, longest):
    """The corners of triangles (n, 3, 3), halved across their longest edge until none is longer."""
    while True:
        edges = np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2)
        side, large = edges.argmax(1), edges.max(1) > longest
        if not large.any():
            return corners
        turn = (side[large, None] + np.arange(3)) % 3
        a, b, c = np.take_along_axis(corners[large], turn[..., None], 1).transpose(1, 0, 2)
        middle = (a + b) / 2
        halves = [np.stack([a, middle, c], 1), np.stack([middle, b, c], 1)]
        corners = np.concatenate([corners[~large], *halves])


def main():
    """Makes all and writes it."""
    out = Path(sys.argv[1])
    out.mkdir(parents=True, exist_ok=True)
    statue = surfrecon.sculpture()
    scans, shots = scanned(statue)
    table = surfrecon.Plane((0, 0, 0), (0, 0, 1), margin=MARGIN)
    merged = surfrecon.merge(surfrecon.remove(scans, table), close="none")
    cell, reach = merged.report.voxel, merged.report.merge_distance
    closed = surfrecon.close(merged.mesh, scans, cell=cell, merge_distance=reach, flat_base=True)
    known = noise_figures.Surface(merged.mesh.positions, merged.mesh.triangles)
    written, figures = {"open": merged.mesh.positions[merged.mesh.triangles].astype(np.float32)}, {"scans": len(scans)}
    figures["left_open"] = len(closed.report.open)

    def tell(name, vertices, faces, judged=True):
        corners = halved(np.asarray(vertices, float)[faces], EDGE_CELLS * cell)
        middles = corners.mean(1)
        areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
        far = known.distances(middles) > close_figures.FILLED_CELLS * cell
        figures[f"{name}_pct"] = 100 * float(areas[far].sum() / areas.sum())
        written[name], written[f"{name}_far"] = corners.astype(np.float32), far
        if judged:
            empty = far & close_figures.in_seen_space(shots, middles, reach + close.SLACK_CELLS * cell)
            figures[f"{name}_empty_pct"] = 100 * float(areas[empty].sum() / areas[far].sum())
            written[f"{name}_empty"] = empty

    tell("statue", statue.positions, statue.triangles, judged=False)
    tell("ours", closed.mesh.positions, closed.mesh.triangles)
    tell("poisson", *poisson(merged.mesh))
    np.savez(out / "printing.npz", **written)
    (out / "printing.json").write_text(json.dumps(figures, indent=1))
    print(json.dumps(figures, indent=1))


if __name__ == "__main__":
    main()
