# SPDX-License-Identifier: GPL-3.0-or-later
"""Arrays <-> Blender's meshes, transforms and custom properties. This file knows mesh layers. `pruning` copies
them, too.

Blender copies an array at once only into an attribute of exactly its type. Everything here keeps to that.
"""

import bpy
import numpy as np
import surfrecon

from . import usable
from .running import Refused

# Coordinates farther from zero than this many times their extent are stored around an origin of their own: Blender's
# single precision keeps 2^-24 of a coordinate, which then is at most 2^-20 of the extent.
FAR = 8

# The difference that single precision leaves between the identity and a rotation times its transpose.
ROUNDING = 2e-5


# Arrays -> meshes


def new_mesh(name, coordinates, corners, sides=3):
    """A mesh from flat float32 coordinates and flat int32 corners of faces with so many sides."""
    mesh = bpy.data.meshes.new(name)
    fill(mesh, coordinates, corners, sides)
    return mesh


def fill(mesh, coordinates, corners, sides=3):
    """Gives an empty mesh vertices and faces."""
    count = len(corners) // sides
    mesh.vertices.add(len(coordinates) // 3)
    mesh.loops.add(sides * count)
    mesh.polygons.add(count)
    if len(coordinates):
        mesh.attributes["position"].data.foreach_set("vector", coordinates)
    if count:
        mesh.attributes[".corner_vert"].data.foreach_set("value", corners)
        # The property is unsigned: a signed array would be converted one by one.
        mesh.polygons.foreach_set("loop_start", np.arange(0, sides * count, sides, dtype=np.uint32))
    mesh.update(calc_edges=True)


def store(mesh, name, values, domain="POINT"):
    """Stores one value an element as an attribute. It replaces an older attribute of that name."""
    older = mesh.attributes.get(name)
    if older is not None:
        mesh.attributes.remove(older)
    if values.dtype == np.uint8:
        layer = mesh.attributes.new(name, "FLOAT_COLOR", domain)
        # Colours of a byte a channel would take a quarter of the memory, but Blender converts these one by one.
        layer.data.foreach_set("color", surfrecon.linear_colours(values))
        mesh.color_attributes.active_color = mesh.color_attributes[name]
        mesh.color_attributes.render_color_index = mesh.color_attributes.active_color_index
        return
    kind = {"float32": "FLOAT", "int32": "INT", "bool": "BOOLEAN"}[values.dtype.name]
    layer = mesh.attributes.new(name, kind, domain)
    layer.data.foreach_set("value", np.ascontiguousarray(values))


def mesh_from_result(name, result, origin=(0.0, 0.0, 0.0), scale=1.0):
    """A Blender mesh with all attributes of a `surfrecon.Mesh`, around `origin` and scaled."""
    mesh = new_mesh(name, result.positions_f32(origin, scale), result.triangles.view(np.int32).reshape(-1))
    store_all(mesh, result)
    return mesh


def mesh_from_grid(name, grid, cut):
    """A Blender mesh of a `surfrecon.QuadGrid` with image coordinates as UV map: quads, or cut into triangles."""
    result = grid.triangles() if cut else grid
    corners = (result.triangles if cut else result.quads).view(np.int32).reshape(-1)
    mesh = new_mesh(name, result.positions_f32(), corners, 3 if cut else 4)
    store_all(mesh, result)
    store_uv(mesh, grid.uvs[corners])
    return mesh


def store_uv(mesh, coordinates):
    """Writes the texture coordinates of all corners, float32, into the active UV map. Makes one if there is none."""
    layer = mesh.uv_layers.active or mesh.uv_layers.new(name="UVMap", do_init=False)
    mesh.attributes[layer.name].data.foreach_set("vector", np.ascontiguousarray(coordinates).reshape(-1))


def store_all(mesh, result):
    """Stores all attributes of vertices and faces of a result of the library."""
    of_vertices = result.vertex_attributes
    if {"s", "t"} <= of_vertices.keys() and len(mesh.loops):
        coordinates = np.column_stack([of_vertices.pop("s"), of_vertices.pop("t")])
        store_uv(mesh, coordinates[result.triangles])
    for attribute, values in of_vertices.items():
        store(mesh, attribute, values)
    for attribute, values in result.face_attributes.items():
        # Blender's names are unique over all domains: the faces' `error` beside the vertices' is `face_error`.
        name = f"face_{attribute}" if attribute in result.vertex_attributes else attribute
        store(mesh, name, values, "FACE")


def origin_of(bounds):
    """The shift to take off coordinates before they lose precision: whole numbers, zero unless they lie far out."""
    if bounds is None:
        return np.zeros(3)
    low, high = bounds
    far = max(np.abs(low).max(), np.abs(high).max()) > FAR * (high - low).max()
    return np.round((low + high) / 2) if far else np.zeros(3)


def object_from_mesh(name, content, scale):
    """An object from a `surfrecon.Mesh` of a file, and the origin in the file's unit that was taken off."""
    origin = origin_of(content.bounds)
    mesh = mesh_from_result(name, content, tuple(origin), scale)
    return bpy.data.objects.new(name, mesh), origin


def object_from_points(name, content, scale):
    """An object of vertices only, and the origin in the file's unit that was taken off."""
    points = content.positions
    origin = origin_of((points.min(axis=0), points.max(axis=0)) if len(points) else None)
    coordinates = ((content.positions - origin) * scale).astype(np.float32).reshape(-1)
    mesh = new_mesh(name, coordinates, np.empty(0, np.int32))
    if content.colour is not None:
        store(mesh, "colour", content.colour)
    if content.intensity is not None:
        store(mesh, "intensity", content.intensity)
    return bpy.data.objects.new(name, mesh), origin


# Meshes -> arrays


class Placed:
    """The evaluated mesh of an object, as long as it is in use: `with Placed(obj, depsgraph) as mesh`."""

    def __init__(self, obj, depsgraph):
        self.evaluated = obj.evaluated_get(depsgraph)

    def __enter__(self):
        """The mesh with modifiers applied."""
        return self.evaluated.to_mesh()

    def __exit__(self, *_):
        self.evaluated.to_mesh_clear()


def positions(mesh):
    """(n, 3) float32."""
    flat = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.attributes["position"].data.foreach_get("vector", flat)
    return flat.reshape(-1, 3)


def triangles(mesh):
    """(m, 3) int32: the triangles. Larger polygons are cut."""
    if len(mesh.loops) == 3 * len(mesh.polygons):
        flat = np.empty(len(mesh.loops), np.int32)
        mesh.attributes[".corner_vert"].data.foreach_get("value", flat)
    else:
        mesh.calc_loop_triangles()
        flat = np.empty(3 * len(mesh.loop_triangles), np.int32)
        mesh.loop_triangles.foreach_get("vertices", flat)
    return flat.reshape(-1, 3)


def faces_of_triangles(mesh):
    """The number of the face that each of the `triangles` belongs to."""
    if len(mesh.loops) == 3 * len(mesh.polygons):
        return np.arange(len(mesh.polygons))
    mesh.calc_loop_triangles()
    faces = np.empty(len(mesh.loop_triangles), np.int32)
    mesh.loop_triangle_polygons.foreach_get("value", faces)
    return faces


def centres(mesh, matrix):
    """(m, 3) float64: the middles of the faces in the world."""
    flat = np.empty(3 * len(mesh.polygons), np.float32)
    mesh.polygons.foreach_get("center", flat)
    matrix = np.array(matrix, np.float64)
    return flat.reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3]


def surface_with_materials(obj, depsgraph, number):
    """An object's positions (n, 3) in the world, triangles (m, 3) and the number of each one's material by its name, or
    `None` without faces.
    """
    with Placed(obj, depsgraph) as mesh:
        if mesh is None or len(mesh.polygons) == 0:
            return None
        index = np.zeros(len(mesh.polygons), np.int32)
        mesh.polygons.foreach_get("material_index", index)
        numbers = [0 if m is None else number.get(m.name_full, 0) for m in obj.data.materials] or [0]
        matrix = np.array(obj.matrix_world, np.float64)
        placed = positions(mesh) @ matrix[:3, :3].T + matrix[:3, 3]
        index = index[faces_of_triangles(mesh)]
        return placed, triangles(mesh), np.array(numbers)[np.minimum(index, len(numbers) - 1)]


def vertex_values(mesh, name, kind, dtype):
    """The values of a vertex attribute of that kind, or `None`."""
    layer = mesh.attributes.get(name)
    if layer is None or layer.domain != "POINT" or layer.data_type != kind:
        return None
    values = np.empty(len(mesh.vertices), dtype)
    layer.data.foreach_get("value", values)
    return values


def vertex_colours(geometry):
    """(n, 4) uint8 sRGB of what the colours of a mesh or a point cloud are, or `None`: see `real_colours`."""
    return colours_of(real_colours(geometry))


COLOURS = {"BYTE_COLOR", "FLOAT_COLOR"}

# The name of colours that are put on for looking, and are no colours of anything.
FALSE_COLOURS = "error_colour"


def real_colours(geometry):
    """The attribute that is a surface's own colour, or `None`: the one of the name that importing and merging give it,
    else, as scans have no other, the first one of colours that the user's own mesh has.

    Whichever is active is merely the one that is seen or painted.
    """
    own = geometry.attributes.get("colour")
    if own is not None or "range_row" in geometry.attributes:
        return own
    others = (layer for layer in geometry.attributes if layer.domain == "POINT" and layer.data_type in COLOURS)
    return next((layer for layer in others if layer.name != FALSE_COLOURS), None)


def colours_of(layer):
    """(n, 4) uint8 sRGB of an attribute, or `None` if it isn't one of colours of points."""
    if layer is None or layer.domain != "POINT" or layer.data_type not in COLOURS:
        return None
    values = np.empty(4 * len(layer.data), np.float32)
    layer.data.foreach_get("color_srgb", values)
    return np.rint(np.clip(values, 0, 1) * 255).astype(np.uint8).reshape(-1, 4)


def seen_positions(obj, depsgraph):
    """(n, 3) float32 in the object's frame: its vertices as its modifiers move them, or `None` if they make others."""
    if len(obj.modifiers) == 0:
        return positions(obj.data)
    with Placed(obj, depsgraph) as mesh:
        if mesh is None or len(mesh.vertices) != len(obj.data.vertices) or usable.shows_instances(obj, depsgraph):
            return None
        return positions(mesh)


def points_of_object(obj, depsgraph, in_world):
    """(n, 3) float64: the points of a point cloud, or the vertices of what has any, with modifiers. They are in the
    world or in the object's own frame. The second value is their (n, 4) colours or `None`.

    Raises `Refused` with a sentence about the object.
    """
    usable.readable(obj, depsgraph)
    evaluated = obj.evaluated_get(depsgraph)
    if obj.type == "POINTCLOUD":
        flat = np.empty(3 * len(evaluated.data.points), np.float32)
        evaluated.data.attributes["position"].data.foreach_get("vector", flat)
        points, colour = flat.reshape(-1, 3), vertex_colours(evaluated.data)
    elif obj.type in {"MESH", "CURVE", "SURFACE", "META", "FONT"}:
        with Placed(obj, depsgraph) as mesh:
            # Blender 4.2 has no positions where there are no vertices.
            if mesh is None or len(mesh.vertices) == 0:
                raise Refused(f'"{obj.name}" has no vertices: deselect it')
            points, colour = positions(mesh), vertex_colours(mesh)
    else:
        raise Refused(f'"{obj.name}" has no points: deselect it')
    if len(points) == 0:
        raise Refused(f'"{obj.name}" has no vertices: deselect it')
    points = points.astype(np.float64)
    if in_world:
        matrix = np.array(evaluated.matrix_world, np.float64)
        usable.refuse_unusable(obj, matrix)
        points = points @ matrix[:3, :3].T + matrix[:3, 3]
    return points, colour


# Transforms


def is_rigid(matrix):
    """Whether a matrix (4 x 4) of Blender moves and turns only."""
    turn = matrix[:3, :3]
    return np.abs(turn.T @ turn - np.eye(3)).max() < ROUNDING and np.linalg.det(turn) > 0


def rigid(matrix):
    """The rotation nearest to that of a matrix from single precision, with the same translation."""
    left, _, right = np.linalg.svd(matrix[:3, :3])
    exact = matrix.copy()
    exact[:3, :3] = left @ right
    return exact


# Custom properties


def report_of(operation, report):
    """A report as custom properties hold it. Of what it tells a person they have the texts, a line each."""
    told = [row.name for row in surfrecon.figures(operation) if row.kind == "warning"]
    return plain(report) | {name: "\n".join(text for _, text in report[name]) for name in told}


def plain(value):
    """A value as custom properties can hold it: 32-bit integers, floats, strings (lists of them a line each), dicts.

    Of lists of lists it is one list of what these hold.
    """
    if isinstance(value, dict):
        return {k: plain(v) for k, v in value.items() if v is not None}
    if isinstance(value, tuple | list):
        if value and isinstance(value[0], str):
            return "\n".join(value)
        parts = [plain(v) for v in value]
        numbers = [n for part in parts for n in (part if isinstance(part, list) else [part])]
        return [float(v) for v in numbers] if any(isinstance(v, float) for v in numbers) else numbers
    if isinstance(value, int) and not -(2**31) <= value < 2**31:
        return float(value)
    return value
