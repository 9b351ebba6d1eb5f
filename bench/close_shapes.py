"""Closed shapes whose surface is known, and cameras that leave a wanted share of it unseen; lengths in mm."""

import math
from dataclasses import dataclass, field

import close_figures
import noise_figures
import noise_scans
import noise_shapes
import numpy as np

# The longest side of a shape, and how far away the cameras stand.
SIZE, DISTANCE = 220.0, 500.0
PIXELS, SMALL_PIXELS = 260, 60
# Cell of the merge, about, of images of PIXELS; noise is told in cells.
CELL = 1.65
# Spacing of the triangles.
STEP = 2.0
# Degrees: a ring of cameras above the horizon each. Hollow shapes are looked into as well.
RINGS, INTO = (10, 45), 72
# Cameras of a ring.
AROUND = 4
# Of this share of the way the ring opens from the front to all around; for the rest cameras come below the shape.
ALL_AROUND = 0.7
# So often the way around a shape is halved to leave the wanted share unseen.
STEPS = 7

# Corners of the six tetrahedra of a cube around its diagonal; bit 0, 1 and 2 of a corner are its x, y and z.
TETRAHEDRA = np.array([[0, 1, 3, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 6, 4, 7], [0, 4, 5, 7], [0, 5, 1, 7]])


@dataclass
class Shape:
    """A closed shape that stands, or is held up, along z."""

    name: str
    # A function from the spacing to vertices and faces.
    make: object
    # It stood on the ground: its lowest part is flat.
    stands: bool = False
    hollow: bool = False
    kept: dict = field(default_factory=dict)

    def mesh(self, step=STEP):
        """Vertices and faces; the longest side is SIZE, the middle of the box is 0."""
        if step not in self.kept:
            vertices, faces = self.make(step)
            low, high = vertices.min(0), vertices.max(0)
            self.kept[step] = (vertices - (low + high) / 2) * (SIZE / (high - low).max()), faces
        return self.kept[step]


def level_set(inside, low, high, step):
    """The surface where a function of points is 0, negative inside: marching tetrahedra, so closed and manifold."""
    # Cubes are cut into triangles smaller than they are.
    pitch = 1.4 * step
    axes = [np.arange(a, b + pitch, pitch) for a, b in zip(low, high, strict=True)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), -1)
    size, values = points.shape[:3], inside(points.reshape(-1, 3))
    # A node on the surface would make vertices that are one.
    values[np.abs(values) < 1e-3 * step] = 1e-3 * step
    nodes = np.arange(values.size).reshape(size)
    corners = np.stack(
        [nodes[x : x + size[0] - 1, y : y + size[1] - 1, z : z + size[2] - 1].ravel() for x, y, z in bits()], 1
    )
    within = values[corners] < 0
    corners = corners[within.any(1) & ~within.all(1)]
    tetrahedra = corners[:, TETRAHEDRA].reshape(-1, 4)
    within = values[tetrahedra] < 0
    triangles = []
    for count in (1, 2, 3):
        some = within.sum(1) == count
        # Those inside first; an even permutation keeps the sense.
        order = np.argsort(~within[some], axis=1, kind="stable")
        four, odd = np.take_along_axis(tetrahedra[some], order, 1), is_odd(order)
        a, b, c, d = four.T
        pairs = {
            1: [[(a, b), (a, c), (a, d)]],
            2: [[(a, c), (a, d), (b, d)], [(a, c), (b, d), (b, c)]],
            3: [[(a, d), (b, d), (c, d)]],
        }[count]
        for pair in pairs:
            made = np.stack([np.sort(np.stack(ends, 1), 1) for ends in pair], 1)
            made[odd] = made[odd][:, ::-1]
            triangles.append(made)
    edges = np.concatenate(triangles)
    keys, faces = np.unique(edges[..., 0] * values.size + edges[..., 1], return_inverse=True)
    one, other = keys // values.size, keys % values.size
    flat = points.reshape(-1, 3)
    share = values[one] / (values[one] - values[other])
    return flat[one] + share[:, None] * (flat[other] - flat[one]), faces.reshape(-1, 3)


def bits():
    """The corners of a cube in the order of their numbers."""
    return [(k & 1, k >> 1 & 1, k >> 2 & 1) for k in range(8)]


def is_odd(orders):
    """Whether each row is an odd permutation."""
    count = orders.shape[1]
    swaps = sum((orders[:, i] > orders[:, j]).astype(int) for i in range(count) for j in range(i + 1, count))
    return swaps % 2 == 1


def ellipsoid(points, middle, radii):
    """About the distance to an ellipsoid: exact to first order at its surface."""
    p, radii = points - middle, np.asarray(radii, float)
    scaled, steep = np.linalg.norm(p / radii, axis=1), np.linalg.norm(p / radii**2, axis=1)
    return scaled * (scaled - 1) / np.maximum(steep, 1e-9)


def limb(points, ends, radii):
    """The distance to a bent limb: a chain of cones with round ends, about."""
    best = np.full(len(points), np.inf)
    for (a, r), (b, s) in zip(zip(ends, radii, strict=True), list(zip(ends, radii, strict=True))[1:], strict=False):
        a, along = np.array(a, float), np.subtract(b, a)
        at = np.clip((points - a) @ along / (along @ along), 0, 1)
        best = np.minimum(best, np.linalg.norm(points - a - at[:, None] * along, axis=1) - (r + at * (s - r)))
    return best


def joined(one, other, width):
    """The union of two, rounded where they meet."""
    share = np.clip(0.5 + 0.5 * (other - one) / width, 0, 1)
    return other + (one - other) * share - width * share * (1 - share)


def without(one, other, width):
    """The first without the second, rounded."""
    return -joined(-one, other, width)


def head(step):
    """A head that looks along x: a smooth skull, and a face with sockets, a nose, lips and ears."""

    def inside(p):
        found = ellipsoid(p, (-8, 0, 28), (86, 70, 82))
        found = joined(found, ellipsoid(p, (24, 0, -36), (54, 48, 48)), 30)
        found = joined(found, limb(p, [(-16, 0, -40), (-26, 0, -92)], [44, 42]), 22)
        found = joined(found, ellipsoid(p, (66, 0, 40), (16, 46, 11)), 14)
        for side in (-1, 1):
            found = without(found, ellipsoid(p, (90, 27 * side, 20), (20, 19, 15)), 10)
            found = joined(found, ellipsoid(p, (62, 27 * side, 20), (15, 15, 12)), 3)
            found = joined(found, ellipsoid(p, (-10, 71 * side, 14), (20, 9, 32)), 8)
            found = without(found, ellipsoid(p, (-2, 80 * side, 16), (9, 8, 20)), 5)
        found = joined(found, limb(p, [(80, 0, 30), (97, 0, -4)], [8, 12]), 12)
        found = joined(found, ellipsoid(p, (75, 0, -28), (10, 21, 5)), 4)
        found = joined(found, ellipsoid(p, (73, 0, -39), (9, 18, 6)), 4)
        hair = np.clip((60 - p[:, 0]) / 40, 0, 1) * np.clip((p[:, 2] - 10) / 40, 0, 1)
        return found + 1.2 * hair * np.sin(p[:, 0] / 4) * np.sin(p[:, 1] / 5 + p[:, 2] / 9)

    return level_set(inside, (-110, -95, -145), (125, 95, 125), step)


def figure(step):
    """A figure with one arm raised and its legs apart."""

    def inside(p):
        found = joined(limb(p, [(0, 0, -5), (0, 0, 48)], [27, 31]), ellipsoid(p, (0, 0, -24), (25, 34, 22)), 10)
        found = joined(found, limb(p, [(0, 0, 50), (2, 0, 84)], [13, 11]), 8)
        found = joined(found, ellipsoid(p, (6, 0, 98), (21, 18, 24)), 6)
        found = joined(found, ellipsoid(p, (26, 0, 96), (6, 4, 7)), 4)
        found = joined(found, limb(p, [(0, 32, 56), (10, 66, 36), (46, 74, 62)], [13, 10, 8]), 6)
        found = joined(found, limb(p, [(0, -32, 56), (8, -64, 80), (24, -60, 122)], [13, 10, 8]), 6)
        for side in (-1, 1):
            bent = -6 if side < 0 else 12
            found = joined(found, limb(p, [(0, 18 * side, -30), (bent, 28 * side, -72)], [18, 13]), 8)
            found = joined(found, limb(p, [(bent, 28 * side, -72), (bent - 8, 32 * side, -114)], [13, 9]), 5)
            found = joined(found, ellipsoid(p, (bent + 6, 34 * side, -118), (24, 11, 9)), 5)
        return found + 0.8 * np.sin(p[:, 0] / 5) * np.sin(p[:, 1] / 5) * np.sin(p[:, 2] / 5)

    return level_set(inside, (-60, -95, -135), (70, 100, 140), step)


def turned(profile, step):
    """A profile (radius, height) from the axis to the axis turned around z, outside first."""
    profile = np.array(profile, float)
    lengths = np.linalg.norm(np.diff(profile, axis=0), axis=1)
    rows = [
        start + (end - start) * np.arange(n)[:, None] / n
        for start, end, n in zip(
            profile[:-1], profile[1:], np.maximum(1, np.round(lengths / step)).astype(int), strict=True
        )
    ]
    # Without the two ends, which lie on the axis.
    rings = np.concatenate(rows)[1:]
    count = max(8, round(2 * math.pi * profile[:, 0].max() / step))
    turn = 2 * math.pi * np.arange(count) / count
    across = np.stack([np.cos(turn), np.sin(turn)], 1)
    vertices = [np.column_stack([radius * across, np.full(count, height)]) for radius, height in rings]
    vertices += [[[0, 0, profile[0, 1]]], [[0, 0, profile[-1, 1]]]]
    grid = np.arange(len(rings) * count).reshape(len(rings), count)
    along = np.concatenate([grid, grid[:, :1]], 1)
    a, b, c, d = (part.ravel() for part in (along[:-1, :-1], along[:-1, 1:], along[1:, 1:], along[1:, :-1]))
    first, last = grid.size, grid.size + 1
    faces = [np.stack([a, b, c], 1), np.stack([a, c, d], 1)]
    faces += [np.stack([np.full(count, first), along[0, 1:], along[0, :-1]], 1)]
    faces += [np.stack([np.full(count, last), along[-1, :-1], along[-1, 1:]], 1)]
    return np.concatenate(vertices), np.concatenate(faces)


def walled(outline, wall, floor):
    """A profile of a vessel: its outline (radius, height) upwards, inside it a wall of a thickness above a floor."""
    radius, height = np.array(outline, float).T
    heights = np.linspace(height[0], height[-1], 60)
    outside = np.column_stack([smooth(heights, height, radius), heights])
    along = np.gradient(outside, axis=0)
    along /= np.linalg.norm(along, axis=1)[:, None]
    within = (outside + wall * np.column_stack([-along[:, 1], along[:, 0]]))[::-1]
    within = within[(within[:, 0] > wall) & (within[:, 1] > height[0] + floor)]
    return [(0, height[0]), *outside, *within, (within[-1, 0], height[0] + floor), (0, height[0] + floor)]


def smooth(at, places, values):
    """A curve through the values without corners."""
    from scipy.interpolate import PchipInterpolator

    return PchipInterpolator(places, values)(at)


def vase(step):
    """A vase with a wall of 6 mm and a wide mouth."""
    outline = [(44, -110), (66, -70), (76, -20), (66, 40), (56, 70), (60, 95), (70, 110)]
    return turned(walled(outline, 6, 8), step)


def goblet(step):
    """A goblet with a foot, a stem and a bowl whose wall is 2.5 mm thick."""
    foot = [(0, -110), (44, -110), (45, -108), (44, -106), (20, -102), (10, -94), (8, -80), (8, -30), (10, -14)]
    bowl = walled([(14, -8), (36, 6), (50, 34), (56, 70), (54, 110)], 2.5, 6)
    return turned([*foot, *bowl[1:]], step)


def sculpture(step):
    """The project's own sculpture: deep crevices, and a flat foot."""
    import surfrecon

    mesh = surfrecon.sculpture(cell=step)
    return mesh.positions, mesh.triangles


def ball(step):
    """A ball, to see whether all works."""
    return level_set(lambda p: ellipsoid(p, (0, 0, 0), (100, 100, 100)), (-110,) * 3, (110,) * 3, step)


SHAPES = {
    shape.name: shape
    for shape in [
        Shape("head", head),
        Shape("figure", figure),
        Shape("sculpture", sculpture, stands=True),
        Shape("vase", vase, stands=True, hollow=True),
        Shape("goblet", goblet, stands=True, hollow=True),
        Shape("ball", ball),
    ]
}


def poses(shape, way):
    """Cameras around a shape; `way` from 0, all in front, to 1, all around and below it."""
    half = math.pi * min(1, way / ALL_AROUND)
    below = max(0, way - ALL_AROUND) / (1 - ALL_AROUND)
    rings = [math.radians(e) for e in (*RINGS, *[INTO] * shape.hollow)]
    if below:
        rings.append(-below * math.radians(RINGS[-1]))
    for k, elevation in enumerate(rings):
        # All around, the first camera is not also the last; and no ring stands above another.
        for turn in half * ((2 * np.arange(AROUND) + 1) / AROUND - 1) + (k % 2) * half / AROUND:
            flat = math.cos(elevation)
            eye = DISTANCE * np.array([flat * math.cos(turn), flat * math.sin(turn), math.sin(elevation)])
            yield noise_shapes.look(eye, np.zeros(3))


def camera(pixels):
    """A camera that has the whole of a shape in view."""
    return noise_scans.Camera(pixels, pixels, (pixels - 1) / 2 * DISTANCE / (0.62 * SIZE))


def scanned(shape, share, pixels, step):
    """The truth, and images of it such that a merge leaves a share of it unseen: as far around it as that takes."""
    import surfrecon

    truth, seen_by = noise_figures.Truth(*shape.mesh(step)), camera(pixels)
    mesh, cell = surfrecon.Mesh(truth.vertices, truth.faces), CELL * PIXELS / pixels

    def images(way):
        common = {"focal": (seen_by.focal,) * 2, "centre": seen_by.centre}
        eyes = [
            surfrecon.Camera.intrinsic(pixels, pixels, world_from_sensor=pose, **common) for pose in poses(shape, way)
        ]
        return surfrecon.virtual_scan(mesh, eyes)

    low, high = 0.0, 1.0
    for _ in range(STEPS):
        way = (low + high) / 2
        merged = surfrecon.merge(images(way), max_hole_length=0.0)
        surface = merged.mesh.positions, merged.mesh.triangles
        unseen = close_figures.unseen_pct(surface, truth, merged.report.voxel) / 100
        low, high = (way, high) if unseen > share else (low, way)
    depth = np.stack([np.nan_to_num(image.values).astype(np.float32) for image in images(way)])
    return truth, noise_scans.Shots(seen_by, np.stack(list(poses(shape, way))), depth, cell)
