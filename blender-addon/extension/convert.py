# SPDX-License-Identifier: GPL-3.0-or-later
"""Arrays <-> Blender's meshes, transforms and custom properties. What knows mesh layers; `pruning` copies them, too.

A range image in Blender is a mesh of one vertex a valid pixel, with the vertex attributes `range_row` and `range_col`
and, where known, `confidence`, `intensity` and `colour`; the object has custom properties for the size of the grid and
the projection, and its matrix is the pose. So undo, save and reload keep it, and vertices may be moved or deleted.

Blender copies an array at once only into an attribute of exactly its type; everything here keeps to that.
"""

import bpy
import numpy as np
import surfrecon

from .running import Refused

ROWS, COLUMNS, PROJECTION, PARAMETERS = "range_rows", "range_columns", "range_projection", "range_parameters"

# Coordinates farther from zero than this many times their extent are stored around an origin of their own: Blender's
# single precision keeps 2^-24 of a coordinate, which then is at most 2^-20 of the extent.
FAR = 8

# Pieces that Blender draws between two control points of a surface.
RESOLUTION = 2

# Custom properties can be changed by anyone: no grid is larger.
MOST_PIXELS = 2**28

# A matrix of Blender is in single precision: departures from a rigid one below this are rounding.
ROUNDING = 1e-5


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
    """Stores one value an element as an attribute; an older one of that name is replaced."""
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
    mesh.uv_layers.new(name="UVMap", do_init=False)
    mesh.attributes["UVMap"].data.foreach_set("vector", grid.uvs[corners].reshape(-1))
    return mesh


def object_from_spline(context, name, spline):
    """A native NURBS surface of a `surfrecon.Spline`, the very same surface; an object that is linked nowhere yet.

    To Python Blender gives curves only: each row of control points becomes one, and Blender's own operator joins them.
    Coordinates are at first the place in the grid, so that it is seen afterwards where each point went.
    """
    control = spline.control
    # Rows of two points would be joined to something else than a surface.
    turned = control.shape[1] == 2
    if turned:
        control = control.transpose(1, 0, 2)
    rows, columns, _ = control.shape
    surface = bpy.data.curves.new(name, "SURFACE")
    # Blender draws the surface after each step.
    surface.resolution_u = surface.resolution_v = 1
    for row in range(1 if rows == 2 else rows):
        points = surface.splines.new("NURBS").points
        points.add(columns - 1)
        place = np.zeros((columns, 4), np.float32)
        place[:, 0], place[:, 1], place[:, 3] = np.arange(columns), row, 1
        points.foreach_set("co", place.reshape(-1))
    made = bpy.data.objects.new(name, surface)
    try:
        join(context, made, bpy.ops.curve.extrude if rows == 2 else bpy.ops.curve.make_segment)
    except RuntimeError as problem:
        bpy.data.curves.remove(surface)
        raise Refused(f"Blender refuses to make the surface: {problem}") from problem

    joined = surface.splines[0]
    count_u, count_v = joined.point_count_u, joined.point_count_v
    place = np.empty(4 * len(joined.points), np.float32)
    joined.points.foreach_get("co", place)
    place = place.reshape(count_v, count_u, 4)
    column, row = place[..., 0].astype(int), place[..., 1].astype(int)
    if rows == 2:
        row[1] = 1
    # A surface's front, where v x u points to, is to be the sensor's side.
    turn = (column[0, -1] - column[0, 0]) * (row[-1, 0] - row[0, 0])
    turn -= (column[-1, 0] - column[0, 0]) * (row[0, -1] - row[0, 0])
    if (turn > 0) == (spline.mirrored != turned):
        column, row = column[:, ::-1], row[:, ::-1]
    homogeneous = np.ones((count_v, count_u, 4), np.float32)
    homogeneous[..., :3] = control[row, column]
    joined.points.foreach_set("co", homogeneous.reshape(-1))
    joined.order_u = joined.order_v = spline.order
    joined.use_endpoint_u = joined.use_endpoint_v = True
    for each in (surface, joined):
        each.resolution_u = each.resolution_v = RESOLUTION
    return made


def join(context, made, operator):
    """Runs an operator of the edit mode on all curves of an object, which is linked for as long as that takes."""
    layer, active = context.view_layer, context.view_layer.objects.active
    selected = context.selected_objects
    # The scene's own collection is never hidden.
    context.scene.collection.objects.link(made)
    try:
        for obj in selected:
            obj.select_set(False)
        made.select_set(True)
        layer.objects.active = made
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.curve.select_all(action="SELECT")
        operator()
        bpy.ops.object.mode_set(mode="OBJECT")
    finally:
        context.scene.collection.objects.unlink(made)
        layer.objects.active = active
        for obj in selected:
            obj.select_set(True)


def store_all(mesh, result):
    """Stores all attributes of vertices and faces of a result of the library."""
    for attribute, values in result.vertex_attributes.items():
        store(mesh, attribute, values)
    for attribute, values in result.face_attributes.items():
        # Blender's names are unique over all domains: the faces' `error` beside the vertices' is `face_error`.
        name = f"face_{attribute}" if attribute in result.vertex_attributes else attribute
        store(mesh, name, values, "FACE")


def origin_of(bounds):
    """What to take off coordinates before they lose precision: whole numbers, zero unless they lie far out."""
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
    mesh = new_mesh(name, coordinates, triangles)
    rows, columns = np.nonzero(valid)
    store(mesh, "range_row", rows.astype(np.int32))
    store(mesh, "range_col", columns.astype(np.int32))
    for attribute in ("confidence", "intensity", "colour"):
        values = getattr(image, attribute)
        if values is not None:
            store(mesh, attribute, values[valid])
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


def scale_range_image(obj, scale):
    """Scales the samples of a range image and its projection; its pose stays."""
    mesh = obj.data
    mesh.attributes["position"].data.foreach_set("vector", (positions(mesh) * scale).reshape(-1))
    mesh.update()
    if PARAMETERS in obj:
        projection = {"kind": obj[PROJECTION], **obj[PARAMETERS].to_dict()}
        if projection["kind"] == "points":
            projection = {"kind": "points", "viewing": (projection["viewing"], projection["vector"])}
        obj[PROJECTION], obj[PARAMETERS] = projection_properties(projection, scale)


def triangles(mesh):
    """(m, 3) int32; larger polygons are cut."""
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


def vertex_colours(mesh):
    """(n, 4) uint8 sRGB of the attribute `colour` or the active one, or `None`."""
    return colours_of(mesh.attributes.get("colour") or mesh.color_attributes.active_color)


def point_colours(cloud):
    """(n, 4) uint8 sRGB of the attribute `colour` or, since none is active, the first one of colours, or `None`."""
    colours = (layer for layer in cloud.attributes if layer.data_type in COLOURS)
    return colours_of(cloud.attributes.get("colour") or next(colours, None))


COLOURS = {"BYTE_COLOR", "FLOAT_COLOR"}


def colours_of(layer):
    """(n, 4) uint8 sRGB of an attribute, or `None` if it isn't one of colours of points."""
    if layer is None or layer.domain != "POINT" or layer.data_type not in COLOURS:
        return None
    values = np.empty(4 * len(layer.data), np.float32)
    layer.data.foreach_get("color_srgb", values)
    return np.rint(np.clip(values, 0, 1) * 255).astype(np.uint8).reshape(-1, 4)


def readable(obj, depsgraph):
    """Refuses an object whose surface or points can't be had as the user sees them."""
    if obj.type == "EMPTY" and obj.instance_type == "COLLECTION":
        raise Refused(
            f'"{obj.name}" is an instance of a collection: make its objects real with'
            " Object > Apply > Make Instances Real, or deselect it"
        )
    # Blender doesn't evaluate what nobody sees.
    if len(obj.modifiers) > 0 and not obj.visible_get():
        raise Refused(f'"{obj.name}" is hidden, and so is what its modifiers make of it: show it, or apply them')
    if shows_instances(obj, depsgraph):
        raise Refused(
            f'"{obj.name}" shows instances, which are not its own surface: make them real with'
            " Object > Apply > Make Instances Real, or by the node Realize Instances"
        )


def shows_instances(obj, depsgraph):
    """Whether something is drawn in an object's name, by geometry nodes, particles or its children."""
    by_nodes = any(modifier.type in {"NODES", "PARTICLE_SYSTEM"} for modifier in obj.modifiers)
    if obj.instance_type == "NONE" and not by_nodes:
        return False
    return any(
        instance.is_instance and instance.parent is not None and instance.parent.original == obj
        for instance in depsgraph.object_instances
    )


def active(context):
    """The active object; refuses one that the user doesn't see."""
    if not context.object.visible_get():
        raise Refused(f'"{context.object.name}" is the active object and hidden: show it, or click another one')
    return context.object


def writable(obj):
    """Refuses an object whose mesh can't be changed."""
    refuse_linked(obj, obj.data.library or obj.library)


def movable(obj):
    """Refuses an object that can't be moved."""
    refuse_linked(obj, obj.library)


def refuse_linked(obj, library):
    """Refuses an object if the library is one: it is another file's."""
    if library is not None:
        raise Refused(
            f'"{obj.name}" is linked from another file, which is left as it is: make it local with'
            " Object > Relations > Make Local"
        )


def seen_positions(obj, depsgraph):
    """(n, 3) float32 in the object's frame: its vertices as its modifiers move them, or `None` if they make others."""
    if len(obj.modifiers) == 0:
        return positions(obj.data)
    with Placed(obj, depsgraph) as mesh:
        if mesh is None or len(mesh.vertices) != len(obj.data.vertices) or shows_instances(obj, depsgraph):
            return None
        return positions(mesh)


def points_of_object(obj, depsgraph, in_world):
    """(n, 3) float64: the points of a point cloud, or the vertices of what has any, with modifiers, in the world or in
    the object's own frame; and their (n, 4) colours or `None`.

    Raises `Refused` with a sentence about the object.
    """
    readable(obj, depsgraph)
    evaluated = obj.evaluated_get(depsgraph)
    if obj.type == "POINTCLOUD":
        flat = np.empty(3 * len(evaluated.data.points), np.float32)
        evaluated.data.attributes["position"].data.foreach_get("vector", flat)
        points, colour = flat.reshape(-1, 3), point_colours(evaluated.data)
    elif obj.type in {"MESH", "CURVE", "SURFACE", "META", "FONT"}:
        with Placed(obj, depsgraph) as mesh:
            # Blender 4.2 has no positions where there are no vertices.
            if mesh is None or len(mesh.vertices) == 0:
                raise Refused(f'"{obj.name}" has no vertices')
            points, colour = positions(mesh), vertex_colours(mesh)
    else:
        raise Refused(f'"{obj.name}" has no points: deselect it')
    if len(points) == 0:
        raise Refused(f'"{obj.name}" has no vertices')
    points = points.astype(np.float64)
    if in_world:
        matrix = np.array(evaluated.matrix_world, np.float64)
        refuse_unusable(obj, matrix)
        points = points @ matrix[:3, :3].T + matrix[:3, 3]
    return points, colour


def is_range_image(obj):
    """Whether the object says of itself that it is a range image."""
    return ROWS in obj and COLUMNS in obj


def scan_of_object(obj, depsgraph):
    """What `surfrecon.merge` takes for an object: a `RangeImage`, or a mesh with its matrix and name. Modifiers count.

    Raises `Refused` with a sentence about the object.
    """
    readable(obj, depsgraph)
    if obj.type not in {"MESH", "CURVE", "SURFACE", "META", "FONT"}:
        raise Refused(f'"{obj.name}" is no mesh: deselect it')
    matrix = np.array(obj.evaluated_get(depsgraph).matrix_world, np.float64)
    with Placed(obj, depsgraph) as mesh:
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
        refuse_unusable(obj, matrix)
        if np.linalg.det(matrix[:3, :3]) == 0:
            raise Refused(f'"{obj.name}" is flattened by a scale of 0')
        refuse_not_finite(obj, positions(mesh))
        try:
            content = surfrecon.Mesh(
                positions(mesh),
                triangles(mesh),
                colour=vertex_colours(mesh),
                confidence=vertex_values(mesh, "confidence", "FLOAT", np.float32),
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
    row = vertex_values(mesh, "range_row", "INT", np.int32)
    column = vertex_values(mesh, "range_col", "INT", np.int32)
    if row is None or column is None or min(row.min(), column.min()) < 0:
        return None
    if row.max() >= rows or column.max() >= columns:
        return None
    taken = np.bincount(row.astype(np.int64) * columns + column)
    if taken.max() > 1:
        return None
    pose, rest = rigid_and_rest(obj, matrix)
    samples = positions(mesh)
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

    confidence = vertex_values(mesh, "confidence", "FLOAT", np.float32)
    if confidence is not None:
        image.confidence = on_grid(np.nan_to_num(np.maximum(confidence, 0)), 0)
    intensity = vertex_values(mesh, "intensity", "FLOAT", np.float32)
    if intensity is not None:
        image.intensity = on_grid(intensity, 0)
    colour = vertex_colours(mesh)
    if colour is not None:
        image.colour = on_grid(colour, 0)
    return image


# What single precision makes of coordinates, as a share of the largest.
ROUNDED = 1e-6


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


# Beyond this many units no coordinate has digits left for a shape.
FARTHEST = 1e15


def refuse_unusable(obj, matrix):
    """Refuses a matrix with which nothing can be computed."""
    if not np.all(np.abs(matrix) < FARTHEST):
        raise Refused(
            f'"{obj.name}" has a location, rotation or scale that is no number or far too large:'
            " check it in the sidebar under Item > Transform"
        )


def refuse_not_finite(obj, points):
    """Refuses points whose coordinates are no numbers."""
    finite = np.isfinite(points)
    if not finite.all():
        number = int(np.argmin(finite.all(axis=1)))
        raise Refused(
            f'"{obj.name}" has a vertex whose coordinates are no numbers: in the Python console,'
            f" C.object.data.vertices[{number}].co = (0, 0, 0) makes it one that can be selected and deleted"
        )


def grid_lost(obj):
    """What to say of a range image that is no longer one vertex a pixel."""
    if len(obj.modifiers) > 0:
        return f'The modifiers of "{obj.name}" leave no one vertex a pixel: turn them off in the viewport'
    return f'"{obj.name}" is no longer one vertex a pixel: import the scan again'


def rigid_and_rest(obj, matrix):
    """The rigid part of a matrix (4 x 4) and what must be applied to the samples first (3 x 3), `None` for nothing.

    The rest holds scale, shear and mirroring; it is the polar decomposition, so a rigid matrix stays as it is.
    """
    refuse_unusable(obj, matrix)
    left, stretch, right = np.linalg.svd(matrix[:3, :3])
    if stretch[-1] <= 1e-7 * stretch[0]:
        raise Refused(f'"{obj.name}" is flattened by a scale of 0')
    rotation = left @ np.diag([1, 1, np.sign(np.linalg.det(left @ right))]) @ right
    rest = rotation.T @ matrix[:3, :3]
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = rotation, matrix[:3, 3]
    return pose, None if np.abs(rest - np.eye(3)).max() < ROUNDING else rest


# Custom properties


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
