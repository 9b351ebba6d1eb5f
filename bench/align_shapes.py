"""Virtual scans, and shapes to scan."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

PIXELS = 200


@dataclass
class Cloud:
    """Points with normals, perhaps with triangles, in the frame of `pose`."""

    points: np.ndarray
    normals: np.ndarray
    triangles: np.ndarray | None = None
    pose: np.ndarray = None


def look(mesh, directions, noise=0.0, pixels=PIXELS, seed=0, rolls=None):
    """Images of a mesh by pinhole cameras from these directions, each rolled by some angle."""
    import surfrecon

    low, high = mesh.bounds
    size, middle = np.linalg.norm(high - low), (low + high) / 2
    rolls = np.random.default_rng(seed).normal(size=(len(directions), 3)) if rolls is None else rolls
    cameras = []
    for direction, roll in zip(directions, rolls, strict=True):
        up = np.cross(direction, roll)
        eye = middle + 2.5 * size * direction
        cameras.append(
            surfrecon.Camera.pinhole(pixels, pixels, height_angle=2 * np.arctan(0.2), eye=eye, target=middle, up=up)
        )
    return surfrecon.virtual_scan(mesh, cameras, noise=noise * size / pixels, seed=seed)


def spacing(points):
    """Median distance of a point to its nearest."""
    return float(np.median(cKDTree(points).query(points[:: max(1, len(points) // 5000)], k=2)[0][:, 1]))


def of_corners(points, faces):
    """Unit normals of the vertices."""
    corners = points[faces]
    crosses = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    sums = np.zeros(points.shape)
    for i in range(3):
        np.add.at(sums, faces[:, i], crosses)
    return sums / np.maximum(np.linalg.norm(sums, axis=1, keepdims=True), 1e-300)


def lying(some, turned, tree, others, limit):
    """Share of samples that lie on another scan: near one of its own, and facing the same way."""
    distance, nearest = tree.query(some, distance_upper_bound=limit)
    near = np.isfinite(distance)
    return np.sum((turned[near] * others[nearest[near]]).sum(1) > 0.5) / len(some)


def shares(scans):
    """Share of the smaller of each two scans whose samples lie on the other, where all lie where they belong."""
    poses, meshes = [scan.world_from_sensor for scan in scans], [scan.triangulate() for scan in scans]
    points = [mesh.positions @ pose[:3, :3].T + pose[:3, 3] for pose, mesh in zip(poses, meshes, strict=True)]
    faced = [
        of_corners(mesh.positions, mesh.triangles) @ pose[:3, :3].T for pose, mesh in zip(poses, meshes, strict=True)
    ]
    trees, limit = [cKDTree(p) for p in points], 1.5 * spacing(points[0])
    found = np.zeros((len(scans), len(scans)))
    for a in range(len(scans)):
        for b in range(a):
            small, large = sorted((a, b), key=lambda k: len(points[k]))
            some = slice(None, None, max(1, len(points[small]) // 1000))
            share = lying(points[small][some], faced[small][some], trees[large], faced[large], limit)
            found[a, b] = found[b, a] = share
    return found


def bent(scan):
    """The scan as a device that drifts while it scans has it: bent along its rows, its ends off by a spacing."""
    import surfrecon

    points = np.where(scan.valid[..., None], scan.points, np.nan).astype(float)
    inside = points[scan.valid]
    low, high = inside[:, 0].min(), inside[:, 0].max()
    along = (2 * points[..., 0] - low - high) / (high - low)
    points[..., 2] += 1.5 * spacing(inside) * (along**2 - 1 / 3)
    made = surfrecon.RangeImage.from_points(points, viewing=("from", (0.0, 0.0, 0.0)), name=scan.name)
    made.world_from_sensor = scan.world_from_sensor
    return made


def revolved(radius, height, detail=160):
    """A closed surface of revolution about z: `radius` of the height and the azimuth."""
    import surfrecon

    rows = detail
    z, turn = np.meshgrid(np.linspace(-height, height, rows), 2 * np.pi * np.arange(detail) / detail, indexing="ij")
    r = radius(z / height, turn)
    side = np.stack([r * np.cos(turn), r * np.sin(turn), z], -1).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(rows - 1), np.arange(detail), indexing="ij")
    a, b = (i * detail + j).ravel(), (i * detail + (j + 1) % detail).ravel()
    c, d = a + detail, b + detail
    ends = np.array([[0, 0, -height], [0, 0, height]])
    first, last, n = np.arange(detail), (rows - 1) * detail + np.arange(detail), len(side)
    caps = [
        np.stack([np.full(detail, n), np.roll(first, -1), first], 1),
        np.stack([np.full(detail, n + 1), last, np.roll(last, -1)], 1),
    ]
    faces = np.concatenate([np.stack([a, b, d], 1), np.stack([a, d, c], 1), *caps])
    return surfrecon.Mesh(np.concatenate([side, ends]), faces.astype(np.uint32))


def relief(height, size=1.0, detail=240):
    """A sheet z = height(x, y) that faces +z."""
    import surfrecon

    x, y = np.meshgrid(np.linspace(-size, size, detail), np.linspace(-size, size, detail))
    positions = np.stack([x, y, height(x, y)], -1).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(detail - 1), np.arange(detail - 1), indexing="ij")
    a = (i * detail + j).ravel()
    faces = np.concatenate([np.stack([a, a + 1, a + detail + 1], 1), np.stack([a, a + detail + 1, a + detail], 1)])
    return surfrecon.Mesh(positions, faces.astype(np.uint32))


def cube():
    """Of edges of 2, around the origin."""
    import surfrecon

    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = [(a, b, c) for a, b, c, _ in sides] + [(a, c, d) for a, _, c, d in sides]
    return surfrecon.Mesh(corners, np.array(faces, np.uint32))


def together(meshes):
    """One mesh of several."""
    import surfrecon

    starts = np.cumsum([0] + [len(mesh.positions) for mesh in meshes[:-1]])
    faces = [mesh.triangles + start for mesh, start in zip(meshes, starts, strict=True)]
    return surfrecon.Mesh(np.concatenate([mesh.positions for mesh in meshes]), np.concatenate(faces).astype(np.uint32))
