# SPDX-License-Identifier: GPL-3.0-or-later
"""Spline surfaces as Blender's own NURBS objects."""

import bpy
import numpy as np

from .running import Refused

# Pieces that Blender draws between two control points of a surface.
RESOLUTION = 2


def object_from_spline(context, name, spline):
    """A native NURBS surface of a `surfrecon.Spline`, the very same surface. The object is linked nowhere yet.

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
