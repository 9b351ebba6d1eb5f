"""Shapes whose surface is known, as triangles small enough to say which of them an image saw."""

import math
from dataclasses import dataclass

import noise_scans
import numpy as np

# Angle of the first and the last row of an image of 640 x 480, radians: such that a cell of the sculpture is 1.3 mm.
HEIGHT_ANGLE = 0.5
# Thicknesses of the plates, in cells; their other sides, and how far apart their middles stand.
THICKNESSES = np.arange(0.5, 4.01, 0.25)
PLATE, APART, PLATE_CELL = 28, 36, 1.3


@dataclass
class Plate:
    """A plate across y, seen from both sides; lengths in mm."""

    middle: np.ndarray
    thickness: float


def scene(shape, views):
    """A shape as our mesh, the poses that see it, their camera, the cell and, if it has any, its plates."""
    import surfrecon

    small = shape.endswith("small")
    rows, cols = (60, 80) if small else (480, 640)
    camera = noise_scans.Camera(rows, cols, (rows - 1) / 2 / math.tan(HEIGHT_ANGLE / 2))
    if shape.startswith("plates"):
        thicknesses = THICKNESSES[-1:] if small else THICKNESSES
        cell = PLATE_CELL
        vertices, faces, plates = plates_of(thicknesses, cell)
        poses = [look(eye, [0, 0, 0]) for eye in both_sides(views, cell / 2 * camera.focal)]
        return surfrecon.Mesh(vertices, faces), poses, camera, cell, plates
    mesh = surfrecon.sculpture(cell=8.0 if small else None)
    # Of 40: 27 around, 10 above, 3 below.
    around, above = round(views * 27 / 40), views // 4
    if views < 4:
        around, above = views, 0
    cameras = surfrecon.turntable(
        mesh, around=around, above=above, below=views - around - above, pixels=rows, height_angle=HEIGHT_ANGLE
    )
    poses = [camera.world_from_sensor for camera in cameras]
    cell = 2 * float(np.linalg.norm(poses[0][:3, 3] - mesh.bounds.mean(0))) / camera.focal
    return mesh, poses, camera, cell, None


def look(eye, target):
    """World from camera: x right, y down, z from the eye to the target; the world's z is up."""
    forward = np.subtract(target, eye) / np.linalg.norm(np.subtract(target, eye))
    right = np.cross(forward, [0, 0, 1])
    right /= np.linalg.norm(right)
    pose = np.eye(4)
    pose[:3, :3] = np.stack([right, np.cross(forward, right), forward], 1)
    pose[:3, 3] = eye
    return pose


def both_sides(views, distance):
    """Eyes in front of and behind the plates, as many each: one straight ahead, the others around it."""
    for side in (-1, 1):
        for k in range(views // 2):
            turn, tilt = (0, 0) if k == 0 else (2 * math.pi * (k - 0.5) / (views // 2 - 1), 0.4)
            along = [math.sin(tilt) * math.cos(turn), side * math.cos(tilt), math.sin(tilt) * math.sin(turn)]
            yield distance * np.array(along)


def plates_of(thicknesses, cell):
    """Plates beside and above each other, five in a row: vertices, faces, plates."""
    parts, plates = [], []
    for k, thickness in enumerate(thicknesses):
        # Not on a common plane: each meets the grid differently.
        col, row = k % 5 - (min(len(thicknesses), 5) - 1) / 2, k // 5 - (len(thicknesses) - 1) // 5 / 2
        middle = cell * np.array([col * APART, 0.37 * k, row * APART])
        half = cell * np.array([PLATE, thickness, PLATE]) / 2
        parts.append(box(middle - half, middle + half, cell))
        plates.append(Plate(middle, cell * float(thickness)))
    return *joined(parts), plates


def joined(parts):
    """Several meshes as one."""
    starts = np.cumsum([0] + [len(vertices) for vertices, _ in parts])
    faces = [faces + start for (_, faces), start in zip(parts, starts[:-1], strict=True)]
    return np.concatenate([vertices for vertices, _ in parts]), np.concatenate(faces)


def box(low, high, step, inside_out=False):
    """A closed box of quads of about `step`, cut in two."""
    low, high = np.asarray(low, float), np.asarray(high, float)
    parts = []
    for axis in range(3):
        one, other = (axis + 1) % 3, (axis + 2) % 3
        u, v = (np.linspace(low[a], high[a], max(1, round((high[a] - low[a]) / step)) + 1) for a in (one, other))
        for end in (low, high):
            vertices = np.empty((len(u), len(v), 3))
            vertices[..., axis], vertices[..., one], vertices[..., other] = end[axis], u[:, None], v
            parts.append((vertices.reshape(-1, 3), sheet(len(u), len(v), (end is high) == inside_out)))
    return joined(parts)


def sphere(middle, radius, step):
    """A sphere of quads of about `step`, cut in two, its axis z."""
    rings = max(3, round(math.pi * radius / step))
    down, around = np.meshgrid(
        np.linspace(0, np.pi, rings + 1), np.linspace(0, 2 * np.pi, 2 * rings + 1), indexing="ij"
    )
    vertices = np.stack([np.sin(down) * np.cos(around), np.sin(down) * np.sin(around), np.cos(down)], -1)
    faces = sheet(rings + 1, 2 * rings + 1, False)
    a, b, c = (vertices.reshape(-1, 3)[faces[:, k]] for k in range(3))
    # The two triangles of a quad at a pole: one has no area.
    faces = faces[np.linalg.norm(np.cross(b - a, c - a), axis=1) > 1e-9]
    return middle + radius * vertices.reshape(-1, 3), faces


def sheet(rows, cols, turned):
    """Faces of a grid of vertices; not turned, they turn from rows to columns."""
    grid = np.arange(rows * cols).reshape(rows, cols)
    a, b, c, d = (part.ravel() for part in (grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]))
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    return faces[:, ::-1] if turned else faces
