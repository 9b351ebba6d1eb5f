# SPDX-License-Identifier: GPL-3.0-or-later
"""3D views after an import: turned to the scans, with clip planes that fit, alone if something is in the way."""

import bpy
import numpy as np

from .chosen import is_simple
from .scene import into_local_views

# A view sees well what is from so many times larger than its near plane to so many times smaller than its far one.
LEAST_NEAR, LEAST_FAR = 100, 10
NEAR, FAR = 1000, 100

# The depths of a view keep no more apart than this.
MOST_RATIO = 1e6

# The tab in the sidebar. It is looked for so often until it is there.
TAB, LOOKS, LOOK_SECONDS = "Scans", 100, 0.05

# Areas whose views an import has put into local view.
ALONE = set()


def show(context, objects):
    """Turns all 3D views of the scene's windows to these objects, which are selected. Returns the name of an object
    that is in the way, for which they are in local view, or `None`.
    """
    context.view_layer.update()
    box = union(boxes(objects))
    obstacle = what_is_in_the_way(context, objects, box)
    into_local_views(context, objects)
    coloured = any("colour" in obj.data.attributes for obj in objects if obj.type == "MESH")
    for window in context.window_manager.windows:
        for area in window.screen.areas if window.scene == context.scene else ():
            region = next((region for region in area.regions if region.type == "WINDOW"), None)
            if area.type != "VIEW_3D" or region is None:
                continue
            view = area.spaces.active
            fit_clips(view, float(np.linalg.norm(box[1] - box[0])))
            if coloured and view.shading.type == "SOLID" and view.shading.color_type == "MATERIAL":
                view.shading.color_type = "VERTEX"
            # Outlines of many scans cover what is between them.
            view.overlay.show_outline_selected = False
            with context.temp_override(window=window, area=area, region=region):
                if obstacle is not None and view.local_view is None and bpy.ops.view3d.localview.poll():
                    bpy.ops.view3d.localview(frame_selected=False)
                    ALONE.add(area.as_pointer())
                if bpy.ops.view3d.view_selected.poll():
                    bpy.ops.view3d.view_selected()
    return None if obstacle is None else obstacle.name


def open_sidebar(context):
    """Opens the sidebar in the view that an import was begun in, with the tab that has what comes next. An open one
    stays as it is.
    """
    area = context.area
    if area is None or area.type != "VIEW_3D" or area.spaces.active.show_region_ui:
        return
    area.spaces.active.show_region_ui = True
    looks = iter(range(LOOKS))

    def choose():
        """Called by a timer: the tabs are known once they are drawn, and can't be chosen before."""
        region = next((region for region in area.regions if region.type == "UI"), None)
        try:
            region.active_panel_category = TAB
        except (AttributeError, TypeError):
            return None if next(looks, None) is None else LOOK_SECONDS
        return None

    bpy.app.timers.register(choose, first_interval=LOOK_SECONDS)


def fit_clips(view, extent):
    """Lets a view see what is so large. Planes that do so already stay."""
    if extent <= 0:
        return
    if view.clip_start > extent / LEAST_NEAR:
        view.clip_start = extent / NEAR
        view.clip_end = min(view.clip_end, view.clip_start * MOST_RATIO)
    if view.clip_end < extent * LEAST_FAR:
        view.clip_end = extent * FAR
        view.clip_start = max(view.clip_start, view.clip_end / MOST_RATIO)


def boxes(objects):
    """Corners (8, 3) of the objects in the world."""
    for obj in objects:
        matrix = np.array(obj.matrix_world)
        yield np.array(obj.bound_box) @ matrix[:3, :3].T + matrix[:3, 3]


def union(corners):
    """The lowest and the highest corner of boxes."""
    corners = np.concatenate(list(corners))
    if not len(corners):
        return np.zeros((2, 3))
    return corners.min(axis=0), corners.max(axis=0)


def what_is_in_the_way(context, objects, box):
    """Another object with a surface, in sight, that is in the way. Its box holds that of the objects, or it is a simple
    shape, as the cube of a new file, and cuts into their box. The result is `None` if there is no such object.
    """
    for obj in context.view_layer.objects:
        if obj.type == "MESH" and obj not in objects and obj.visible_get() and len(obj.data.polygons) > 0:
            low, high = union(boxes([obj]))
            encloses = (low <= box[0]).all() and (high >= box[1]).all()
            if encloses or (is_simple(obj) and (low < box[1]).all() and (high > box[0]).all()):
                return obj
    return None


def leave_empty(window_manager):
    """Takes views out of the local view that an import put them into, once nothing is in it: undo takes the scans away
    and leaves the view, in which nothing would ever be seen.
    """
    for window in window_manager.windows:
        for area in window.screen.areas:
            if area.as_pointer() not in ALONE or area.type != "VIEW_3D":
                continue
            view = area.spaces.active
            if view.local_view is not None and any(obj.visible_get(viewport=view) for obj in window.view_layer.objects):
                continue
            ALONE.discard(area.as_pointer())
            region = next(region for region in area.regions if region.type == "WINDOW")
            with bpy.context.temp_override(window=window, area=area, region=region):
                if view.local_view is not None and bpy.ops.view3d.localview.poll():
                    bpy.ops.view3d.localview(frame_selected=False)


@bpy.app.handlers.persistent
def after_undo(*_):
    """Called by Blender while it undoes: what changes views waits until that is done."""
    if ALONE and bpy.app.background:
        leave_empty(bpy.context.window_manager)
    elif ALONE:
        bpy.app.timers.register(lambda: leave_empty(bpy.context.window_manager), first_interval=0)


def register():
    """Watches for undo."""
    bpy.app.handlers.undo_post.append(after_undo)


def unregister():
    """No longer."""
    bpy.app.handlers.undo_post.remove(after_undo)
    ALONE.clear()
