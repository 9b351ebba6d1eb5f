# SPDX-License-Identifier: GPL-3.0-or-later
"""Marks of people: boxes and planes as objects, vertices that are selected or painted, points of the ruler."""

import numpy as np
import surfrecon

from . import convert, surfaces, usable
from .running import Refused
from .words import length

# The annotation layer that Blender's ruler writes.
RULER = "RulerData3D"

# A mesh whose box is thinner than this share of its size is a plane.
THIN = 1e-4

# Most vertices of a mesh that count as picked when all are selected: those of a face.
FACE = 4

# Sculpted masks and painted weights count from here on.
PAINTED = 0.5


def region_of(obj, depsgraph):
    """The `surfrecon.Box` that an object stands for and its matrix, or the `surfrecon.Plane` and `None`: a mesh or a
    cube's empty is its box, a flat mesh and any other empty the plane of its x and y, with its z above.
    """
    matrix = np.array(obj.evaluated_get(depsgraph).matrix_world, np.float64)
    usable.refuse_unusable(obj, matrix)
    try:
        if obj.type == "EMPTY" and obj.instance_type == "NONE":
            if obj.empty_display_type != "CUBE":
                return surfrecon.Plane(matrix[:3, 3], np.cross(matrix[:3, 0], matrix[:3, 1])), None
            size = obj.empty_display_size
            box = matrix @ np.diag([size, size, size, 1.0])
            return surfrecon.Box(box), box
        if obj.type != "MESH":
            raise Refused(f'"{obj.name}" is neither a mesh nor an empty: put a cube around what is meant, or a plane')
        if len(obj.data.polygons) == 0:
            raise Refused(f'"{obj.name}" has no faces: put a cube around what is meant, or a plane')
        corners = np.array(obj.bound_box, np.float64)
        low, high = corners.min(axis=0), corners.max(axis=0)
        middle, half = (low + high) / 2, (high - low) / 2
        if half[2] <= THIN * max(half[:2].max(), 1e-300):
            at = matrix[:3, :3] @ middle + matrix[:3, 3]
            return surfrecon.Plane(at, np.cross(matrix[:3, 0], matrix[:3, 1])), None
        box = np.diag([*half, 1.0])
        box[:3, 3] = middle
        return surfrecon.Box(matrix @ box), matrix @ box
    except surfrecon.InputError as problem:
        raise Refused(f'"{obj.name}" is no region: {problem}') from problem


def marked(obj, by):
    """(n,) bool: which vertices of an object are selected, in its active vertex group or masked. It refuses an object
    without such vertices.
    """
    mesh = obj.data
    count = len(mesh.vertices)
    if by == "SELECTED":
        found = np.empty(count, bool)
        mesh.vertices.foreach_get("select", found)
        what = "no selected vertex: select some in Edit Mode, and go back to Object Mode"
    elif by == "GROUP":
        group = obj.vertex_groups.active
        found = np.zeros(count, bool)
        if group is not None:
            weights = (max((g.weight for g in v.groups if g.group == group.index), default=0) for v in mesh.vertices)
            found = np.fromiter(weights, np.float32, count) >= PAINTED
        what = f"no vertex in its active vertex group with a weight of {PAINTED} or more: paint some in Weight Paint"
    else:
        values = convert.vertex_values(mesh, ".sculpt_mask", "FLOAT", np.float32)
        found = np.zeros(count, bool) if values is None else values >= PAINTED
        what = "no masked vertex: paint a mask in Sculpt Mode"
    if not found.any():
        raise Refused(f'"{obj.name}" has {what}')
    return found


def world_positions(obj, depsgraph):
    """(n, 3) float64: the vertices of an object's own mesh in the world."""
    matrix = np.array(obj.evaluated_get(depsgraph).matrix_world, np.float64)
    usable.refuse_unusable(obj, matrix)
    return convert.positions(obj.data) @ matrix[:3, :3].T + matrix[:3, 3]


def ruler_points(scene, count):
    """So many points of the scene's rulers, the last drawn first, in the world. It is `None` without such a ruler.

    A ruler of two points is a length, one that was bent has three.
    """
    # The name of annotations depends on Blender's version.
    notes = getattr(scene, "annotation", None) or getattr(scene, "grease_pencil", None)
    layer = notes.layers.get(RULER) if notes is not None else None
    if layer is None:
        return None
    for frame in layer.frames:
        for stroke in reversed(list(frame.strokes)):
            if len(stroke.points) >= count:
                points = np.array([point.co[:] for point in stroke.points], np.float64)
                # The middle of three is the corner.
                return points[[0, -1]] if count == 2 else points
    return None


# Ends of a ruler that lie off the surface by more than this share of its length make a wrong length of it.
OFF = 0.01

# An edge is near if the surface around an end lies so many times farther off than it lies aside.
STEEP = 10


def ends_of_ruler(context, objects, by_view=True):
    """The two ends of the ruler, (2, 3), where the surface below them is, a sentence about that, and whether it warns.
    `None` and no sentence where the ends need not be moved, as without a ruler.

    Dragged without snapping they lie in a plane of the view. As long as the view looks along it, the surface that is
    seen below an end is what was pointed at. Without `by_view` ends are never moved: a script has no view.
    """
    points = ruler_points(context.scene, 2)
    if points is None or not np.isfinite(points).all():
        return None, None, False
    shown = [obj for obj in objects if obj.visible_get()]
    depsgraph = context.evaluated_depsgraph_get()
    try:
        off = surfrecon.distances(points, surfaces.surface_of(shown, depsgraph))
    except (Refused, surfrecon.SurfreconError):
        # Points have no surface that could tell.
        return None, None, False
    reach = OFF * np.linalg.norm(points[1] - points[0])
    if off.sum() <= reach:
        return None, None, False
    lay = "The ends of the ruler lie {} and {} off the surface".format(
        *(length(context, float(distance)) for distance in off)
    )
    found = seen_below(context, points, off > reach / 2, shown, depsgraph) if by_view else None
    if found is None:
        return None, f"{lay}: drag them with Ctrl held, which snaps them", True
    return found, f"{lay}: what is seen below them is taken", False


def seen_below(context, points, lifted, objects, depsgraph):
    """Points (2, 3) of a ruler that was drawn in this view. Lifted points are moved along the view to the surface that
    is seen there. The result is `None` where there is no view, the ruler lies across it, or an end is near an edge of
    what is seen.
    """
    view = getattr(context.space_data, "region_3d", None)
    if view is None:
        return None
    world_from_view = np.array(view.view_matrix.inverted(), np.float64)
    eye, right, up, ahead = (*(world_from_view[:3, k] for k in (3, 0, 1)), -world_from_view[:3, 2])
    depths = (points - eye) @ ahead
    ruler = np.linalg.norm(points[1] - points[0])
    if abs(depths[1] - depths[0]) > OFF / 10 * ruler or (view.is_perspective and depths.min() <= 0):
        return None
    found = points.copy()
    for k in np.flatnonzero(lifted):
        aside = OFF * ruler
        around = [points[k] + aside * step for step in (0 * up, right, -right, up, -up)]
        hits = [cast(eye, ahead, view.is_perspective, point, objects, depsgraph) for point in around]
        if any(hit is None for hit in hits):
            return None
        depth = [(hit - eye) @ ahead for hit in hits]
        scale = depth[0] / depths[k] if view.is_perspective else 1.0
        if max(depth) - min(depth) > STEEP * aside * scale:
            return None
        found[k] = hits[0]
    return found


def cast(eye, ahead, is_perspective, point, objects, depsgraph):
    """The place on objects that the view sees at a point, the nearest to the eye. `None` where it sees past them."""
    best = None
    for obj in objects:
        if obj.type != "MESH":
            continue
        evaluated = obj.evaluated_get(depsgraph)
        from_world = np.linalg.inv(np.array(evaluated.matrix_world, np.float64))
        direction = point - eye if is_perspective else ahead
        # A view without perspective sees what is behind its own place, too.
        begin = eye if is_perspective else point - 2 * ahead * far(point, evaluated)
        local = from_world[:3, :3] @ begin + from_world[:3, 3], from_world[:3, :3] @ direction
        hit, place, _, _ = evaluated.ray_cast(*local)
        if hit:
            matrix = np.array(evaluated.matrix_world, np.float64)
            place = matrix[:3, :3] @ np.array(place) + matrix[:3, 3]
            if best is None or (place - best) @ ahead < 0:
                best = place
    return best


def far(point, obj):
    """No vertex of an object is farther than this from a point."""
    matrix = np.array(obj.matrix_world, np.float64)
    corners = np.array(obj.bound_box) @ matrix[:3, :3].T + matrix[:3, 3]
    return float(np.linalg.norm(corners - point, axis=1).max())


def picked(context, count):
    """Points that were picked: those of the ruler, else the selected vertices of the active object. It refuses other
    numbers of vertices than two, or fewer than three where three are asked for. All vertices of a mesh count as none.
    """
    points = ruler_points(context.scene, count)
    if points is not None:
        return points
    obj = context.object
    how = "measure it with the ruler (the Measure tool), or select"
    if obj is None or obj.type != "MESH":
        raise Refused(f"No points are picked: {how} {count} vertices of the active object in Edit Mode")
    chosen = np.empty(len(obj.data.vertices), bool)
    obj.data.vertices.foreach_get("select", chosen)
    found = int(chosen.sum())
    # New meshes come with all their vertices selected, which picks none of them.
    if found == len(chosen) > FACE:
        found = 0
    if found != count if count == 2 else found < count:
        wanted = f"exactly {count}" if count == 2 else f"{count} or more"
        number = f"{found:,}" if found else "no"
        raise Refused(f'"{obj.name}" has {number} picked vertices: {how} {wanted} of them in Edit Mode')
    return world_positions(obj, context.evaluated_depsgraph_get())[chosen]


def plane_of(points, above):
    """The plane that lies nearest to three or more points. The place `above` lies on its upper side."""
    if not np.isfinite(points).all():
        raise Refused("A picked point has a coordinate that is no number: pick others")
    middle = points.mean(axis=0)
    _, sizes, axes = np.linalg.svd(points - middle, full_matrices=False)
    if sizes[1] <= 1e-9 * sizes[0] or sizes[0] == 0:
        raise Refused("The points lie on one line, through which there are many planes: pick others")
    normal = axes[2]
    return surfrecon.Plane(middle, -normal if normal @ (above - middle) < 0 else normal)
