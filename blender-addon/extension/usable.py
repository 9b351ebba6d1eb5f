# SPDX-License-Identifier: GPL-3.0-or-later
"""Refuses, in a sentence about the object, what can't be used, changed or moved as the user sees it."""

import numpy as np

from .running import Refused

# Beyond this many units no coordinate has digits left for a shape.
FARTHEST = 1e15

# A matrix with a smallest scale below this share of its largest has rounding where a shape was.
FLAT = 1e-7


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
    """The active object. It refuses one that the user doesn't see."""
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


def refuse_unusable(obj, matrix):
    """Refuses a matrix with which nothing can be computed."""
    if not np.all(np.abs(matrix) < FARTHEST):
        raise Refused(
            f'"{obj.name}" has a location, rotation or scale that is no number or far too large:'
            " check it in the sidebar under Item > Transform"
        )


def refuse_flattened(obj, matrix):
    """Refuses a matrix that leaves nothing of a shape."""
    sizes = np.linalg.svd(matrix[:3, :3])[1]
    if sizes[-1] <= FLAT * sizes[0]:
        raise Refused(
            f'"{obj.name}" is flattened by a scale of 0: set another one under Item > Transform, or its parent\'s'
        )


def refuse_not_finite(obj, points):
    """Refuses points whose coordinates are no numbers."""
    finite = np.isfinite(points)
    if not finite.all():
        number = int(np.argmin(finite.all(axis=1)))
        raise Refused(
            f'"{obj.name}" has a vertex whose coordinates are no numbers: enter C.object.data.vertices[{number}].co ='
            " (0, 0, 0) in the Python console, then select and delete it"
        )
