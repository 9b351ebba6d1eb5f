# SPDX-License-Identifier: GPL-3.0-or-later
"""Hides what a result was made from, in views, renders and exports, with the cameras of its frames. It also shows it
again.

Both lie in the same place, so that one of them is seen at a time.
"""

import bpy

from .preferences import preference

# Custom property of a hidden object: whether renders left it out before.
HIDDEN = "surfrecon_hidden"


def is_wished():
    """Whether the user likes sources to be hidden. Scripts without a window have nothing to see."""
    return preference("hide_sources") and not bpy.app.background


def hide(context, objects):
    """Hides objects, as far as they are still there, and the cameras that hang on them."""
    for obj in with_cameras(context.scene, objects):
        if obj.name in context.view_layer.objects:
            obj.hide_set(True)
        # Other files' objects are left as they are.
        if obj.library is None and HIDDEN not in obj:
            obj[HIDDEN] = obj.hide_render
            obj.hide_render = True


def show(context, objects):
    """Shows objects again that `hide` or the user has hidden, in renders as before."""
    for obj in with_cameras(context.scene, objects):
        if obj.name in context.view_layer.objects:
            obj.hide_set(False)
        if obj.library is None and HIDDEN in obj:
            obj.hide_render = bool(obj[HIDDEN])
            del obj[HIDDEN]


def is_hidden(obj):
    """Whether it was hidden here, and nobody has opened its eye in the outliner since."""
    return HIDDEN in obj and not obj.visible_get()


def with_cameras(scene, objects):
    """Objects and the cameras that hang on them, but for the one that renders are made with."""
    objects = [obj for obj in objects if obj is not None]
    cameras = [child for obj in objects for child in obj.children if child.type == "CAMERA"]
    return objects + [camera for camera in cameras if camera is not scene.camera and camera not in objects]
