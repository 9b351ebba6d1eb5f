"""Judges closed surfaces with numpy, scipy and Open3D: what crosses, what lies in seen space, how far from the truth.

Nothing here is shared with the library, but that it writes the files which `slicer` judges: signs are exact, sight is
marched along the pixels of each image.
"""

from fractions import Fraction

import noise_figures
import numpy as np
import slicer
from surface import topology

# Cells: all that lies further from the measured surface was filled.
FILLED_CELLS = 1.5
# Points of the result that its figures are means of, and of the truth.
POINTS = 100_000
# Sides of a wall turn from each other by more than 120 degrees; its thinnest part is this share of the surface, so that
# single slivers do not decide.
OPPOSITE, THINNEST_SHARE = -0.5, 0.001
# A vertex is where it was if the result has one within this share of the size: tools write float32.
MOVED = 1e-6
# Of the largest product in a determinant: no rounding error is as large (7.8e-16 by Shewchuk).
ROUNDING = 1e-15
# Candidates are compared in parts.
PART = 2_000_000


def side(a, b, c, d):
    """The side of the plane through a, b, c on which d lies: 1, 0 or -1, exact."""
    ad, bd, cd = a - d, b - d, c - d
    products = [
        sign * ad[:, i] * bd[:, j] * cd[:, k]
        for sign, i, j, k in ((1, 0, 1, 2), (-1, 0, 2, 1), (1, 1, 2, 0), (-1, 1, 0, 2), (1, 2, 0, 1), (-1, 2, 1, 0))
    ]
    value, bound = sum(products), ROUNDING * sum(np.abs(p) for p in products)
    signs = np.sign(value).astype(int)
    for k in np.flatnonzero(np.abs(value) <= bound):
        signs[k] = exact_side(*(row[k] for row in (a, b, c, d)))
    return signs


def exact_side(a, b, c, d):
    """The same of four points, in fractions."""
    points = [[Fraction(float(x)) for x in point] for point in (a, b, c, d)]
    (ax, ay, az), (bx, by, bz), (cx, cy, cz) = ([x - y for x, y in zip(p, points[3], strict=True)] for p in points[:3])
    value = ax * (by * cz - bz * cy) - ay * (bx * cz - bz * cx) + az * (bx * cy - by * cx)
    return (value > 0) - (value < 0)


def near_pairs(vertices, faces):
    """Pairs of triangles whose boxes overlap, found in a grid: parts of arrays (one, other)."""
    corners = vertices[faces]
    low, high = corners.min(1), corners.max(1)
    cell = max(2 * float(np.median((high - low).max(1))), 1e-3 * float((high - low).max()), 1e-30)
    start = low.min(0)
    first, last = (np.floor((box - start) / cell).astype(np.int64) for box in (low, high))
    size = last.max(0) + 1
    spans = last - first + 1
    count = spans.prod(1)
    owner = np.repeat(np.arange(len(faces)), count)
    place = np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)
    x, place = place % spans[owner, 0], place // spans[owner, 0]
    at = first[owner] + np.stack([x, place % spans[owner, 1], place // spans[owner, 1]], 1)
    # Of a large triangle those cells count that its plane meets.
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1), 1e-300)[:, None]
    off = np.einsum("ij,ij->i", start + (at + 0.5) * cell - corners[owner, 0], normals[owner])
    kept = (count[owner] < 9) | (np.abs(off) < cell)
    owner, at = owner[kept], at[kept]
    key = (at[:, 0] * size[1] + at[:, 1]) * size[2] + at[:, 2]
    order = np.argsort(key, kind="stable")
    owner, key = owner[order], key[order]
    # The k-th next in the same cell, for all k.
    found, k = [], 0
    alive = np.arange(len(owner))
    while len(alive):
        k += 1
        alive = alive[alive + k < len(owner)]
        alive = alive[key[alive] == key[alive + k]]
        one, other = owner[alive], owner[alive + k]
        apart = (low[one] > high[other]).any(1) | (low[other] > high[one]).any(1)
        found.append(np.sort(np.stack([one[~apart], other[~apart]], 1), 1))
    pairs = np.concatenate(found) if found else np.empty((0, 2), np.int64)
    return np.unique(pairs[:, 0] * len(faces) + pairs[:, 1])


def crossings(vertices, faces):
    """How many pairs of triangles cross: an edge of one goes through the other. Touching does not count."""
    keys, count = near_pairs(vertices, faces), 0
    for begin in range(0, len(keys), PART):
        one, other = np.divmod(keys[begin : begin + PART], len(faces))
        cross = np.zeros(len(one), bool)
        for a, b in ((one, other), (other, one)):
            for k in range(3):
                left = np.flatnonzero(~cross)
                edge, corners = faces[a[left]][:, [k, (k + 1) % 3]], faces[b[left]]
                # An edge that shares a corner with the triangle cannot go through it.
                apart = ~(edge[:, :, None] == corners[:, None, :]).any((1, 2))
                left, edge, corners = left[apart], edge[apart], corners[apart]
                cross[left] = pierces(
                    *(vertices[edge[:, i]] for i in (0, 1)), *(vertices[corners[:, i]] for i in (0, 1, 2))
                )
        count += int(cross.sum())
    return count


def pierces(p, q, a, b, c):
    """Whether the segment goes through the triangle, or through its border, from one side to the other."""
    one, other = side(a, b, c, p), side(a, b, c, q)
    left = np.flatnonzero((one != 0) & (one == -other))
    # The segment turns around no edge another way than around the others.
    turns = np.stack([side(p[left], q[left], x[left], y[left]) for x, y in ((a, b), (b, c), (c, a))])
    through = np.zeros(len(p), bool)
    through[left] = (turns >= 0).all(0) | (turns <= 0).all(0)
    return through


def in_seen_space(shots, points, slack):
    """Whether points lie where an image sees past them by more than `slack`, in all of 3 x 3 pixels."""
    past = np.zeros(len(points), bool)
    camera = shots.camera
    for pose, depth in zip(shots.poses, shots.depth, strict=True):
        left = np.flatnonzero(~past)
        place = (points[left] - pose[:3, 3]) @ pose[:3, :3]
        z, length = place[:, 2], np.linalg.norm(place, axis=1)
        ahead = z > 1e-9 * length
        left, place, z, length = left[ahead], place[ahead], z[ahead], length[ahead]
        col = np.rint(camera.focal * place[:, 0] / z + camera.centre[0]).astype(int)
        row = np.rint(camera.focal * place[:, 1] / z + camera.centre[1]).astype(int)
        inside = (col >= 1) & (row >= 1) & (col < camera.cols - 1) & (row < camera.rows - 1)
        left, col, row = left[inside], col[inside], row[inside]
        limit = (z + slack * z / length)[inside]
        behind = np.ones(len(left), bool)
        for down in (-1, 0, 1):
            for right in (-1, 0, 1):
                # The depth is 0 where nothing came back, which says nothing.
                behind &= depth[row + down, col + right] > limit
        past[left[behind]] = True
    return past


def moved(measured_vertices, vertices):
    """How many measured vertices are not where they were."""
    from scipy.spatial import cKDTree

    size = float(np.ptp(measured_vertices, axis=0).max())
    off, _ = cKDTree(vertices).query(measured_vertices, distance_upper_bound=MOVED * size)
    return int(np.isinf(off).sum())


def thinnest_wall(result, points, triangle, size):
    """How thick the surface's walls are where they are thinnest: between points and what lies behind them."""
    normals = result.normals[triangle]
    start = points - 1e-5 * size * normals
    thickness, facing = result.cast(start, -normals)
    opposite = np.isfinite(thickness) & (np.einsum("ij,ij->i", facing, normals) < OPPOSITE)
    return float(np.quantile(thickness[opposite], THINNEST_SHARE)) if opposite.any() else None


def sliced(vertices, faces, watertight):
    """Whether the slicer takes the surface as it is, and else why not; None where it is not installed."""
    if not watertight:
        return {"slices": False, "slicer_says": ["it is not watertight"]}
    said = slicer.faults(vertices, faces) if slicer.is_there() else None
    return {"slices": None if said is None else not said, "slicer_says": said}


def quality(result, merged, truth, shots, cell, slack, mm=1.0):
    """Figures of a result beside the measured surface it was made of; of what is not known they are null.

    `truth` is the shape, `shots` are images that know their rays, `mm` the millimetres in the unit of lengths.
    """
    vertices, faces = result
    figures = {key: value for key, value in topology(vertices, faces).items() if key != "collapsed_triangles"}
    open_or_worse = ("boundary_edges", "nonmanifold_edges", "nonmanifold_vertices", "misoriented_edges")
    figures["watertight"] = len(faces) > 0 and not any(figures[key] for key in open_or_worse)
    figures["crossings"] = crossings(vertices, faces)
    figures["measured_moved"] = moved(merged[0], vertices)
    figures |= sliced(vertices, faces, figures["watertight"])
    size = float(np.ptp(vertices, axis=0).max())
    surface, known = noise_figures.Surface(vertices, faces), noise_figures.Surface(*merged)
    points, triangle = surface.sample(POINTS)
    filled = known.distances(points) > FILLED_CELLS * cell
    figures["filled_pct"] = 100 * float(filled.mean())
    figures["thinnest_wall_mm"] = mm * (thinnest_wall(surface, points, triangle, size) or np.nan)
    if shots:
        seen = in_seen_space(shots, points[filled], slack)
        figures["in_seen_space_pct"] = 100 * float(seen.mean()) if filled.any() else 0.0
    if truth:
        off = mm * truth.distances(points)
        figures["to_truth_rms_mm"] = rms(off)
        figures["filled_to_truth_rms_mm"] = rms(off[filled])
        # Places left open lie far from the result, and are no part of what was filled.
        samples, _ = truth.sample(POINTS)
        left = samples[known.distances(samples) > FILLED_CELLS * cell]
        figures["unseen_to_result_rms_mm"] = mm * rms(surface.distances(left))
    return figures


def rms(values):
    """The root of the mean square; 0 of none."""
    return float(np.sqrt(np.mean(values**2))) if len(values) else 0.0


def unseen_pct(merged, truth, cell):
    """How much of the truth lies further from the measured surface than what was measured does."""
    samples, _ = truth.sample(POINTS)
    return 100 * float((noise_figures.Surface(*merged).distances(samples) > FILLED_CELLS * cell).mean())
