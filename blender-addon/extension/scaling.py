# SPDX-License-Identifier: GPL-3.0-or-later
"""Objects in another size, about the origin of the scene. Scans, frames in their files and cameras stay rigid: samples
and distances take the scale, so that a range image keeps its rays.
"""

from mathutils import Matrix

from . import recording, scan_objects, usable
from .running import Refused


def is_rigid(obj):
    """Whether an object is scaled by what it holds and not by its matrix."""
    return obj.type == "CAMERA" or scan_objects.is_range_image(obj) or recording.is_recording(obj)


def rigid_family(obj):
    """An object and what hangs on it, as far as it is scaled by what it holds."""
    if is_rigid(obj):
        yield obj
        for child in obj.children:
            yield from rigid_family(child)


def refuse_shared(roots):
    """Refuses scans and cameras whose data can't be scaled, or that another object shares."""
    family = [obj for root in roots for obj in rigid_family(root)]
    for obj in family:
        usable.movable(obj)
        if obj.data is None:
            continue
        usable.writable(obj)
        if scan_objects.is_range_image(obj):
            scan_objects.camera_of(obj)
        if obj.data.users > 1:
            raise Refused(
                f'"{obj.name}" shares its data with another object: give it its own with'
                " Object > Relations > Make Single User"
            )


def grow(obj, scale, is_root=True):
    """Scales an object and all that hang on it."""
    if is_root:
        matrix = obj.matrix_world.copy()
        matrix.translation *= scale
        if not is_rigid(obj):
            matrix = matrix @ Matrix.Diagonal((scale, scale, scale, 1))
        obj.matrix_world = matrix
    else:
        # Their places are said in the frame of the parent, whose own scale has not changed.
        obj.matrix_parent_inverse.translation *= scale
        obj.location *= scale
        obj.delta_location *= scale
        if not is_rigid(obj):
            obj.scale *= scale
    if not is_rigid(obj):
        return
    if obj.type == "CAMERA":
        for name in ("clip_start", "clip_end", "display_size", "ortho_scale"):
            setattr(obj.data, name, getattr(obj.data, name) * scale)
    elif recording.is_recording(obj):
        recording.grow(obj, scale)
    else:
        scan_objects.scale_range_image(obj, scale)
    for child in obj.children:
        grow(child, scale, is_root=False)
