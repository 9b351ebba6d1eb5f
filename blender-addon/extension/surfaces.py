# SPDX-License-Identifier: GPL-3.0-or-later
"""Several objects as one surface in the world, with instances and modifiers."""

import numpy as np
import surfrecon

from . import convert, usable
from .running import Refused

SURFACES = {"MESH", "CURVE", "SURFACE", "META", "FONT"}


def surface_of(objects, depsgraph):
    """One `surfrecon.Mesh` in the world of all faces of the objects, those of their instances included.

    Faces of mirrored objects are turned, so that front stays front. Colours are those of the vertices, white where a
    part has none, and absent if no part has any.

    Raises `Refused` with a sentence if there is nothing, or what is there can't be used.
    """
    chosen = {obj.original for obj in objects}
    parts, refused = [], None
    for instance in depsgraph.object_instances:
        # An object that is only a source of instances may be selected and not be seen itself.
        source = instance.parent if instance.is_instance else instance.object
        if source is None or source.original not in chosen:
            continue
        if instance.object.type not in SURFACES:
            continue
        try:
            parts.append(part_of(instance.object, np.array(instance.matrix_world, np.float64)))
        except Refused as problem:
            refused = problem
    # Blender doesn't evaluate what is hidden, as what a result was made from mostly is.
    for obj in chosen:
        if not obj.visible_get() and obj.type in SURFACES:
            usable.readable(obj, depsgraph)
            parts.append(part_of(obj, np.array(obj.matrix_world, np.float64)))
    parts = [part for part in parts if part is not None]
    if not parts:
        if refused is not None:
            raise refused
        names = ", ".join(f'"{obj.name}"' for obj in list(objects)[:3])
        raise Refused(f"{names or 'The selection'} has no faces: select visible objects with a surface")
    return union(parts)


def part_of(evaluated, matrix):
    """Positions (n, 3) in the world, triangles (m, 3) and colours (n, 4) or `None` of an evaluated object.

    `None` where it has no faces.
    """
    mesh = evaluated.to_mesh()
    try:
        if mesh is None or len(mesh.polygons) == 0:
            return None
        usable.refuse_unusable(evaluated, matrix)
        positions = convert.positions(mesh) @ matrix[:3, :3].T + matrix[:3, 3]
        usable.refuse_not_finite(evaluated, positions)
        triangles = convert.triangles(mesh).astype(np.int64)
        if np.linalg.det(matrix[:3, :3]) < 0:
            triangles = triangles[:, ::-1]
        return positions, triangles, convert.vertex_colours(mesh)
    finally:
        evaluated.to_mesh_clear()


def of_own_faces(obj):
    """A `surfrecon.Mesh` of an object's own triangles, without modifiers, where they lie in the object."""
    positions = convert.positions(obj.data)
    usable.refuse_not_finite(obj, positions)
    return surfrecon.Mesh(positions, convert.triangles(obj.data))


def is_mirrored(matrix):
    """Whether a matrix turns the outside in."""
    return np.linalg.det(matrix[:3, :3]) < 0


def in_world(mesh, matrix):
    """A mesh in the world. One that is mirrored there still has its outside outside."""
    triangles = mesh.triangles[:, ::-1] if is_mirrored(matrix) else mesh.triangles
    positions = mesh.positions @ matrix[:3, :3].T + matrix[:3, 3]
    return surfrecon.Mesh(positions, triangles, colour=mesh.vertex_attributes.get("colour"))


def union(parts):
    """A `surfrecon.Mesh` of (positions, triangles, colours or `None`)."""
    if not parts:
        return surfrecon.Mesh(np.zeros((0, 3)), np.zeros((0, 3), np.uint32))
    counts = np.cumsum([0] + [len(positions) for positions, _, _ in parts])
    colour = None
    if any(colours is not None for _, _, colours in parts):
        white = np.full((1, 4), 255, np.uint8)
        colour = np.concatenate([np.repeat(white, len(p), axis=0) if c is None else c for p, _, c in parts])
    return surfrecon.Mesh(
        np.concatenate([positions for positions, _, _ in parts]),
        np.concatenate([triangles + count for (_, triangles, _), count in zip(parts, counts, strict=False)]),
        colour=colour,
    )


def bulging(mesh):
    """A surface turned to the side to which it bulges: where nobody knows from where it was seen, all surfaces of one
    thing that are turned so have the same side outside.
    """
    corners = mesh.positions[mesh.triangles]
    areas = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    middles = corners.mean(axis=1)
    weights = np.linalg.norm(areas, axis=1)
    middle = np.average(middles, axis=0, weights=weights) if weights.sum() > 0 else middles.mean(axis=0)
    if np.sum(areas * (middles - middle)) >= 0:
        return mesh
    return surfrecon.Mesh(mesh.positions, mesh.triangles[:, ::-1], colour=mesh.vertex_attributes.get("colour"))
