# SPDX-License-Identifier: GPL-3.0-or-later
"""Range images as objects, and objects as what is merged and aligned.

A range image in Blender is a mesh of one vertex a valid pixel, with the vertex attributes `range_row` and `range_col`
and, where known, `confidence`, `intensity` and `colour`; the object has custom properties for the size of the grid and
the projection, and its matrix is the pose. So undo, save and reload keep it, and vertices may be moved or deleted.
"""

import bpy
import numpy as np
import surfrecon

from . import convert, usable
from .running import Refused

ROWS, COLUMNS, PROJECTION, PARAMETERS = "range_rows", "range_columns", "range_projection", "range_parameters"

# Custom properties can be changed by anyone: no grid is larger.
MOST_PIXELS = 2**28

# A matrix of Blender is in single precision: departures from a rigid one below this are rounding.
ROUNDING = 1e-5

# What single precision makes of coordinates, as a share of the largest.
ROUNDED = 1e-6


def is_range_image(obj):
    """Whether the object says of itself that it is a range image."""
    return ROWS in obj and COLUMNS in obj


def object_from_range_image(name, image, scale, faces):
    """An object from a `surfrecon.RangeImage`; lengths are multiplied by `scale`. With or without triangles."""
    valid = image.valid
    coordinates = (image.points[valid] * scale).astype(np.float32).reshape(-1)
    triangles = np.empty(0, np.int32)
    if faces:
        surface = image.triangulate()
        vertex_of_pixel = np.zeros(valid.shape, np.int32)
        vertex_of_pixel[valid] = np.arange(valid.sum(), dtype=np.int32)
        grid = surface.vertex_attributes
        vertices = vertex_of_pixel[grid["range_row"], grid["range_col"]]
        triangles = vertices[surface.triangles].reshape(-1)
    mesh = convert.new_mesh(name, coordinates, triangles)
    rows, columns = np.nonzero(valid)
    convert.store(mesh, "range_row", rows.astype(np.int32))
    convert.store(mesh, "range_col", columns.astype(np.int32))
    for attribute in ("confidence", "intensity", "colour"):
        values = getattr(image, attribute)
        if values is not None:
            convert.store(mesh, attribute, values[valid])
    made = bpy.data.objects.new(name, mesh)
    made[ROWS], made[COLUMNS] = image.rows, image.cols
    made[PROJECTION], made[PARAMETERS] = projection_properties(image.projection, scale)
    return made


def projection_properties(projection, scale):
    """Kind and parameters of a projection as custom properties; lengths are multiplied by `scale`."""
    parameters = {k: v for k, v in projection.items() if k != "kind"}
    kind = projection["kind"]
    if kind == "points":
        viewing, vector = parameters["viewing"]
        parameters = {"viewing": viewing, "vector": [x * scale if viewing == "from" else x for x in vector]}
    elif kind == "orthographic":
        parameters = {k: [x * scale for x in v] for k, v in parameters.items()}
    return kind, {k: v if isinstance(v, str) else [float(x) for x in v] for k, v in parameters.items()}


def scale_range_image(obj, scale):
    """Scales the samples of a range image and its projection; its pose stays."""
    mesh = obj.data
    mesh.attributes["position"].data.foreach_set("vector", (convert.positions(mesh) * scale).reshape(-1))
    mesh.update()
    if PARAMETERS in obj:
        projection = {"kind": obj[PROJECTION], **obj[PARAMETERS].to_dict()}
        if projection["kind"] == "points":
            projection = {"kind": "points", "viewing": (projection["viewing"], projection["vector"])}
        obj[PROJECTION], obj[PARAMETERS] = projection_properties(projection, scale)


def scan_of_object(obj, depsgraph):
    """What `surfrecon.merge` takes for an object: a `RangeImage`, or a mesh with its matrix and name. Modifiers count.

    Raises `Refused` with a sentence about the object.
    """
    usable.readable(obj, depsgraph)
    if obj.type not in {"MESH", "CURVE", "SURFACE", "META", "FONT"}:
        raise Refused(f'"{obj.name}" is no mesh: deselect it')
    matrix = np.array(obj.evaluated_get(depsgraph).matrix_world, np.float64)
    with convert.Placed(obj, depsgraph) as mesh:
        if mesh is None or len(mesh.vertices) == 0:
            raise Refused(f'"{obj.name}" has no vertices')
        if is_range_image(obj):
            image = range_image(obj, mesh, matrix)
            if image is not None:
                return image
        if len(mesh.polygons) == 0:
            raise Refused(
                f'"{obj.name}" has neither faces nor the attributes of a range image:'
                " make a surface of its vertices first, with Surface from Points"
            )
        usable.refuse_unusable(obj, matrix)
        if np.linalg.det(matrix[:3, :3]) == 0:
            raise Refused(f'"{obj.name}" is flattened by a scale of 0')
        usable.refuse_not_finite(obj, convert.positions(mesh))
        try:
            content = surfrecon.Mesh(
                convert.positions(mesh),
                convert.triangles(mesh),
                colour=convert.vertex_colours(mesh),
                confidence=convert.vertex_values(mesh, "confidence", "FLOAT", np.float32),
            )
        except surfrecon.InputError as error:
            raise Refused(f'"{obj.name}": {error}') from error
        return content, matrix, obj.name


def range_image(obj, mesh, matrix):
    """The range image of an object, or `None` if the mesh is no longer one vertex a pixel."""
    rows, columns = obj[ROWS], obj[COLUMNS]
    if not (isinstance(rows, int) and isinstance(columns, int) and 0 < rows * columns <= MOST_PIXELS):
        raise Refused(
            f'"{obj.name}" says it has {rows} x {columns} pixels, which can\'t be:'
            f" correct its custom properties {ROWS} and {COLUMNS}, or delete them"
        )
    row = convert.vertex_values(mesh, "range_row", "INT", np.int32)
    column = convert.vertex_values(mesh, "range_col", "INT", np.int32)
    if row is None or column is None or min(row.min(), column.min()) < 0:
        return None
    if row.max() >= rows or column.max() >= columns:
        return None
    taken = np.bincount(row.astype(np.int64) * columns + column)
    if taken.max() > 1:
        return None
    pose, rest = rigid_and_rest(obj, matrix)
    samples = convert.positions(mesh)
    if rest is not None:
        samples = (samples @ rest.T).astype(np.float32)
    image = on_rays(obj, samples, row, column) if rest is None else None
    if image is None:
        grid = np.full((rows, columns, 3), np.nan, np.float32)
        grid[row, column] = samples
        image = surfrecon.RangeImage.from_points(grid, viewing=viewing(obj, rest))
    image.name = obj.name
    image.world_from_sensor = pose

    def on_grid(values, fill):
        spread = np.full((rows, columns, *values.shape[1:]), fill, values.dtype)
        spread[row, column] = values
        return spread

    confidence = convert.vertex_values(mesh, "confidence", "FLOAT", np.float32)
    if confidence is not None:
        image.confidence = on_grid(np.nan_to_num(np.maximum(confidence, 0)), 0)
    intensity = convert.vertex_values(mesh, "intensity", "FLOAT", np.float32)
    if intensity is not None:
        image.intensity = on_grid(intensity, 0)
    colour = convert.vertex_colours(mesh)
    if colour is not None:
        image.colour = on_grid(colour, 0)
    return image


def on_rays(obj, samples, row, column):
    """The range image of an object whose vertices lie on the rays of its pixels; `None` if one left its own."""
    kind, parameters = obj.get(PROJECTION), obj.get(PARAMETERS, {})
    names = {"orthographic": ("first", "step"), "spherical": ("first", "step"), "pinhole": ("focal", "centre")}
    if any(len(parameters.get(name, ())) != 2 for name in names.get(kind, ("none",))):
        return None
    known = {name: tuple(parameters[name]) for name in names[kind]}
    if kind == "pinhole":
        known["depth"] = parameters.get("depth", "planar")
    is_depth = kind == "orthographic" or known.get("depth") == "planar"
    values = np.full((obj[ROWS], obj[COLUMNS]), np.nan)
    values[row, column] = samples[:, 2] if is_depth else np.linalg.norm(samples.astype(float), axis=1)
    try:
        image = getattr(surfrecon.RangeImage, kind)(values, **known)
    except surfrecon.InputError:
        return None
    off = np.abs(image.points[row, column] - samples).max()
    return image if off <= ROUNDED * np.abs(samples).max() else None


def viewing(obj, rest):
    """How the object's pixels see, in the frame of its samples."""
    kind = obj.get(PROJECTION, "orthographic")
    parameters = obj.get(PARAMETERS, {})
    if kind == "points" and "vector" in parameters:
        how, vector = parameters["viewing"], np.array(list(parameters["vector"]))
    elif kind in {"pinhole", "spherical"}:
        how, vector = "from", np.zeros(3)
    else:
        how, vector = "parallel", np.array((0.0, 0.0, -1.0))
    return how, vector if rest is None else rest @ vector


def grid_lost(obj):
    """What to say of a range image that is no longer one vertex a pixel."""
    if len(obj.modifiers) > 0:
        return f'The modifiers of "{obj.name}" leave no one vertex a pixel: turn them off in the viewport'
    return f'"{obj.name}" is no longer one vertex a pixel: import the scan again'


def rigid_and_rest(obj, matrix):
    """The rigid part of a matrix (4 x 4) and what must be applied to the samples first (3 x 3), `None` for nothing.

    The rest holds scale, shear and mirroring; it is the polar decomposition, so a rigid matrix stays as it is.
    """
    usable.refuse_unusable(obj, matrix)
    left, stretch, right = np.linalg.svd(matrix[:3, :3])
    if stretch[-1] <= 1e-7 * stretch[0]:
        raise Refused(f'"{obj.name}" is flattened by a scale of 0')
    rotation = left @ np.diag([1, 1, np.sign(np.linalg.det(left @ right))]) @ right
    rest = rotation.T @ matrix[:3, :3]
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = rotation, matrix[:3, 3]
    return pose, None if np.abs(rest - np.eye(3)).max() < ROUNDING else rest
