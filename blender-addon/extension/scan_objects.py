# SPDX-License-Identifier: GPL-3.0-or-later
"""Range images as objects, and objects as what is merged and aligned.

A range image in Blender is a mesh of one vertex a valid pixel, with the vertex attributes `range_row` and `range_col`
and, where known, `confidence`, `intensity` and `colour`. The object has custom properties for the camera of its pixels,
and its matrix is the pose. So undo, save and reload keep it. Vertices may be moved, turned, scaled and mirrored, all at
once or with the object, and deleted: the library tells by the camera's anchors what was done to them.
"""

import bpy
import numpy as np
import surfrecon

from . import convert, usable
from .running import Refused

# Custom properties of a camera. Anchors, five numbers each: row, column, and where its vertex lies as long as nobody
# moves it, in the frame of the object; files of 0.1 have none.
ROWS, COLUMNS, PROJECTION, PARAMETERS = "range_rows", "range_columns", "range_projection", "range_parameters"
ANCHORS = "range_anchors"

# Custom properties can be changed by anyone: no grid is larger.
MOST_PIXELS = 2**28


def is_range_image(obj):
    """Whether the object says of itself that it is a range image."""
    return ROWS in obj and COLUMNS in obj


# Range images -> objects


def object_from_range_image(name, image, scale, faces):
    """An object from a `surfrecon.RangeImage`, with or without triangles. Lengths are multiplied by `scale`."""
    made = bpy.data.objects.new(name, convert.mesh_from_result(name, image.to_mesh(faces=faces), scale=scale))
    keep_camera(made, image.grid_camera().scaled(scale))
    return made


def keep_camera(obj, camera):
    """Notes a `surfrecon.GridCamera` in custom properties."""
    projection = dict(camera.projection)
    kind, parameters = projection.pop("kind"), projection
    if "viewing" in parameters:
        parameters["viewing"], parameters["vector"] = parameters["viewing"]
    obj[ROWS], obj[COLUMNS], obj[PROJECTION] = camera.rows, camera.cols, kind
    obj[PARAMETERS] = {k: v if isinstance(v, str) else [float(x) for x in v] for k, v in parameters.items()}
    if len(camera.anchors) > 0:
        obj[ANCHORS] = camera.anchors.reshape(-1).tolist()


def scale_range_image(obj, scale):
    """Scales the samples of a range image and its camera. Its pose stays."""
    mesh = obj.data
    mesh.attributes["position"].data.foreach_set("vector", (convert.positions(mesh) * scale).reshape(-1))
    mesh.update()
    keep_camera(obj, camera_of(obj).scaled(scale))


# Objects -> range images


def camera_of(obj):
    """The `surfrecon.GridCamera` that an object's custom properties say. It refuses what can't be one."""
    rows, columns = obj[ROWS], obj[COLUMNS]
    if not (isinstance(rows, int) and isinstance(columns, int) and 0 < rows * columns <= MOST_PIXELS and rows > 0):
        raise Refused(
            f'"{obj.name}" says it has {rows} x {columns} pixels, which can\'t be:'
            f" correct its custom properties {ROWS} and {COLUMNS}, or delete them"
        )
    try:
        projection = {**obj[PARAMETERS].to_dict(), "kind": obj[PROJECTION]}
        if "vector" in projection:
            projection["viewing"] = projection["viewing"], projection.pop("vector")
        anchors = np.array(obj[ANCHORS], np.float64).reshape(-1, 5) if ANCHORS in obj else None
        return surfrecon.GridCamera(rows, columns, projection, anchors=anchors)
    except (surfrecon.SurfreconError, AttributeError, KeyError, TypeError, ValueError) as problem:
        raise Refused(
            f'"{obj.name}" has an impossible camera: correct its custom properties {PROJECTION}, {PARAMETERS} and'
            f" {ANCHORS}, or delete them ({problem})"
        ) from problem


def scan_of_object(obj, depsgraph):
    """The scan of an object for `surfrecon.merge`: a `RangeImage`, or a mesh with its matrix and name. Modifiers count.

    Raises `Refused` with a sentence about the object.
    """
    usable.readable(obj, depsgraph)
    if obj.type not in {"MESH", "CURVE", "SURFACE", "META", "FONT"}:
        raise Refused(f'"{obj.name}" is no mesh: deselect it')
    matrix = np.array(obj.evaluated_get(depsgraph).matrix_world, np.float64)
    with convert.Placed(obj, depsgraph) as mesh:
        if mesh is None or len(mesh.vertices) == 0:
            raise Refused(f'"{obj.name}" has no vertices: deselect it, or look at its modifiers')
        seen = seen_by(obj, mesh) if is_range_image(obj) else None
        if seen is None and len(mesh.polygons) == 0:
            raise Refused(
                f'"{obj.name}" has neither faces nor the attributes of a range image:'
                " select it alone and make a surface of its points, with Surface from Points"
            )
        usable.refuse_unusable(obj, matrix)
        usable.refuse_flattened(obj, matrix)
        usable.refuse_not_finite(obj, convert.positions(mesh))
        try:
            if seen is not None:
                return range_image(obj, mesh, matrix, *seen)
            content = surfrecon.Mesh(
                convert.positions(mesh),
                convert.triangles(mesh),
                colour=convert.vertex_colours(mesh),
                confidence=convert.vertex_values(mesh, "confidence", "FLOAT", np.float32),
            )
        except surfrecon.InputError as error:
            raise Refused(f'"{obj.name}": {error}') from error
        return content, matrix, obj.name


def has_faces(obj, depsgraph):
    """Whether an object has a surface: points have none. Anything but points and meshes is taken to have one."""
    if obj.type != "MESH":
        return obj.type != "POINTCLOUD"
    usable.readable(obj, depsgraph)
    with convert.Placed(obj, depsgraph) as mesh:
        return mesh is None or len(mesh.vertices) == 0 or len(mesh.polygons) > 0


def seen_by(obj, mesh):
    """The camera, and the row and column of each vertex. `None` if the mesh is no longer one vertex a pixel."""
    camera = camera_of(obj)
    row, column = (convert.vertex_values(mesh, name, "INT", np.int32) for name in ("range_row", "range_col"))
    if row is None or column is None or min(row.min(), column.min()) < 0:
        return None
    if row.max() >= camera.rows or column.max() >= camera.cols:
        return None
    taken = np.unique(row.astype(np.int64) * camera.cols + column)
    return (camera, row, column) if len(taken) == len(row) else None


def range_image(obj, mesh, matrix, camera, row, column):
    """The range image of an object at that matrix, whose vertices are of those pixels of the camera."""
    confidence = convert.vertex_values(mesh, "confidence", "FLOAT", np.float32)
    # Samples that nobody moved stay what they are to the bit, which rounded matrices would not leave them.
    is_pose = convert.is_rigid(matrix)
    image = surfrecon.RangeImage.from_vertices(
        camera,
        row,
        column,
        convert.positions(mesh),
        world_from_host=None if is_pose else matrix,
        colour=convert.vertex_colours(mesh),
        intensity=convert.vertex_values(mesh, "intensity", "FLOAT", np.float32),
        confidence=None if confidence is None else np.nan_to_num(np.maximum(confidence, 0)),
        name=obj.name,
    )
    if is_pose:
        image.world_from_sensor = convert.rigid(matrix) @ image.world_from_sensor
    return image


def sensor_of(obj, depsgraph, in_world):
    """The place where the rays of a range image start, in the world or in the object's own frame.

    `None` if nothing tells, or if they are parallel.
    """
    if not is_range_image(obj):
        return None
    matrix = np.array(obj.evaluated_get(depsgraph).matrix_world, np.float64) if in_world else np.eye(4)
    with convert.Placed(obj, depsgraph) as mesh:
        try:
            seen = None if mesh is None or len(mesh.vertices) == 0 else seen_by(obj, mesh)
            return None if seen is None else range_image(obj, mesh, matrix, *seen).sensor
        except (Refused, surfrecon.InputError):
            # Its vertices are points all the same.
            return None


def grid_lost(obj):
    """The words for a range image that is no longer one vertex a pixel."""
    if len(obj.modifiers) > 0:
        return f'The modifiers of "{obj.name}" leave no one vertex a pixel: turn them off in the viewport'
    return f'"{obj.name}" is no longer one vertex a pixel: import the scan again'
