"""A merge of twenty scans of which one has changed, run again from what was kept, beside one that knows nothing.

Frames of a depth camera in rows over a landscape: each sees the eight beside it. The share of the blocks is that of the
bricks of 32 cells with a part of the surface that the changed scan has samples in, before or after.
"""

import statistics
import time

import numpy as np
import surfrecon

COLUMNS = ["first_s", "again_s", "share_pct", "most_s", "same_bytes"]
BRICK = 32
# At most so many times its share of the time of a first merge, and so many seconds.
TIMES, SECONDS = 3, 0.05
HALF = 10  # of the landscape


def landscape(detail):
    """Hills, ridges and grooves."""
    across = np.linspace(-HALF, HALF, detail)
    x, y = (of.ravel() for of in np.meshgrid(across, across))
    z = 0.3 * np.sin(0.9 * x) * np.cos(1.1 * y) + 0.08 * np.sin(5 * x) * np.sin(4 * y) + 0.02 * np.sin(17 * x + 3 * y)
    corner = (np.arange(detail - 1)[:, None] * detail + np.arange(detail - 1)).ravel()
    right, above = corner + 1, corner + detail
    triangles = np.concatenate([np.stack([corner, right, above + 1], 1), np.stack([corner, above + 1, above], 1)])
    return surfrecon.Mesh(np.stack([x, y, z], 1), triangles)


def frames(mesh, rows, cols, noise):
    """Twenty frames, with errors of their poses."""

    def camera(k):
        x, y = 3.2 * (k % 5) - 6.4, 4 * (k // 5) - 6
        return surfrecon.Camera.pinhole(rows, cols, height_angle=1, eye=(x, y - 1, 4.5), target=(x, y, 0), up=(0, 1, 0))

    scans = []
    for k in range(20):
        scans.append(surfrecon.virtual_scan(mesh, camera(k), noise=noise, pose_shift=0.002, seed=k))
        scans[-1].name = f"frame {k:02}"
    return scans


def bricks(points, voxel):
    """The bricks that points lie in."""
    return set(
        map(tuple, np.unique(np.floor(points[np.isfinite(points).all(1)] / (BRICK * voxel)).astype(int), axis=0))
    )


def samples(image):
    """The samples of an image, in the world."""
    return image.world_points().reshape(-1, 3)


def same(mesh, other):
    """Whether two meshes are the same bytes."""
    arrays = [(of.positions, of.triangles, *of.vertex_attributes.values()) for of in (mesh, other)]
    return all(a.tobytes() == b.tobytes() for a, b in zip(*arrays, strict=True))


def main(wanted, record, columns):
    """Runs the cases."""
    detail, rows, cols = (80, 60, 80) if wanted.smallest else (600, 480, 640)
    mesh = landscape(detail)
    for case, cells, is_given in (
        ("none moved", 0, False),
        ("one of twenty moved by a twentieth of a cell", 0.05, False),
        ("one of twenty moved by two cells", 2, False),
        ("one of twenty moved by two cells, the cell given", 2, True),
    ):
        if wanted.takes(case, "surfrecon"):
            row = one(frames(mesh, rows, cols, 0.003), cells, is_given, 1 if wanted.smallest else wanted.repeats)
            record.put(dict.fromkeys(columns) | {"case": case, "tool": "surfrecon"} | row)


def one(scans, cells, is_given, repeats):
    """The figures of moving the eighth scan up, each time further."""
    seconds, shares, are_same = {"first": [], "again": []}, [], True
    merger = surfrecon.Merger(scans)
    voxel = merger.merge().report.voxel
    given = {"voxel": voxel} if is_given else {}
    merger.merge(**given)
    for _ in range(repeats):
        touched = bricks(samples(scans[7]), voxel) if cells else set()
        pose = np.array(scans[7].world_from_sensor)
        pose[2, 3] += cells * voxel
        scans[7].world_from_sensor = pose
        if cells:
            merger[7] = scans[7]
            touched |= bricks(samples(scans[7]), voxel)
        started = time.perf_counter()
        again = merger.merge(**given)
        seconds["again"].append(time.perf_counter() - started)
        started = time.perf_counter()
        first = surfrecon.merge(scans, **given)
        seconds["first"].append(time.perf_counter() - started)
        shares.append(len(touched) / len(bricks(first.mesh.positions, voxel) | touched))
        are_same &= same(again.mesh, first.mesh)
    first, again = (statistics.median(seconds[which]) for which in ("first", "again"))
    share = statistics.median(shares)
    return {
        "first_s": first,
        "again_s": again,
        "share_pct": 100 * share,
        "most_s": TIMES * share * first + SECONDS,
        "same_bytes": are_same,
    }
