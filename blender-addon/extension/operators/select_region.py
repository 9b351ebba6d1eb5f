# SPDX-License-Identifier: GPL-3.0-or-later
"""Keep or remove samples of scans before they are merged or aligned: by a box, a plane, a selection, by painting."""

import bpy
import numpy as np
from bpy.props import EnumProperty

from .. import chosen, hiding, pruning, recording, regions, scan_objects, usable
from ..running import Refused
from ..scene import select_only
from ..sources import sources_of
from ..telling import in_object_mode, tell, told
from ..words import number, sentence


class InRegion:
    """The common part of operators that keep or remove samples in a region."""

    bl_options = {"REGISTER", "UNDO"}

    by: EnumProperty(
        name="Region",
        description="What is in the region",
        items=(
            ("OBJECT", "Active object", "What lies in the active cube, or on the active plane and below it"),
            ("SELECTED", "Selected vertices", "Vertices that are selected in Edit Mode"),
            ("GROUP", "Vertex group", "Vertices of weight 0.5 or more in the active vertex group"),
            ("MASK", "Sculpt mask", "Vertices that are masked by half or more in Sculpt Mode"),
        ),
    )

    @classmethod
    def poll(cls, context):
        """There must be scans, in object mode."""
        if not in_object_mode(cls, context):
            return False
        if not scans_of(context):
            cls.poll_message_set(told("Select the scans, and last the cube or plane: Box around Selection makes a box"))
            return False
        return True

    def draw(self, context):
        """Panel of the last operation."""
        self.layout.use_property_split = True
        self.layout.prop(self, "by")

    def execute(self, context):
        """Looks at all scans before any is changed."""
        try:
            removed, count = self.run(context)
        except Refused as problem:
            tell(self, {"ERROR"}, sentence(problem))
            return {"CANCELLED"}
        tell(self, {"INFO"}, f"{removed:,} samples of {number(count, 'scan', 'scans')} removed")
        return {"FINISHED"}

    def run(self, context):
        """How many samples go, and of how many scans."""
        depsgraph, keep = context.evaluated_depsgraph_get(), self.action == "KEEP"
        scans = scans_of(context)
        if self.by != "OBJECT":
            stay = [obj.name for obj in scans if recording.is_recording(obj)]
            if stay:
                tell(self, {"WARNING"}, f'All is kept of "{stay[0]}", which has no vertices: take a cube or a plane')
            scans = [obj for obj in scans if not recording.is_recording(obj)]
            if not scans:
                raise Refused("Select the scans whose vertices are selected or painted")
            return select(scans, [regions.marked(obj, self.by) for obj in scans], keep), len(scans)
        shape = context.object
        if shape is None or shape in scans:
            raise Refused("Make the cube or the plane the active object: select the scans first, and it last")
        removed = apply_region(*regions.region_of(shape, depsgraph), scans, keep, depsgraph)
        put_aside(context, shape, scans)
        return removed, len(scans)


class SURFRECON_OT_keep_inside(InRegion, bpy.types.Operator):
    """Of the selected scans keep only what lies in the active box or below the active plane, is selected or painted"""

    bl_idname = "surfrecon.keep_inside"
    bl_label = "Keep Inside"

    action = "KEEP"


class SURFRECON_OT_remove_inside(InRegion, bpy.types.Operator):
    """Of the selected scans remove what lies in the active box or below the active plane, is selected or painted"""

    bl_idname = "surfrecon.remove_inside"
    bl_label = "Remove Inside"

    action = "REMOVE"


class SURFRECON_OT_select_region(InRegion, bpy.types.Operator):
    """The former name of Keep Inside and Remove Inside, for scripts"""

    bl_idname = "surfrecon.select_region"
    bl_label = "Keep or Remove"
    bl_options = {"UNDO", "INTERNAL"}

    action: EnumProperty(
        name="Action",
        items=(
            ("REMOVE", "Remove", "Remove what is in the region"),
            ("KEEP", "Keep only", "Remove what is not in the region"),
        ),
    )

    def execute(self, context):
        """Keeps or removes, and tells the names."""
        tell(
            self, {"WARNING"}, "surfrecon.select_region is called surfrecon.keep_inside and surfrecon.remove_inside now"
        )
        return super().execute(context)


def is_scan(obj):
    """Whether samples of it can be selected."""
    return scan_objects.is_range_image(obj) or recording.is_recording(obj)


def scans_of(context):
    """The selected scans, or those that the active box was made around."""
    scans = [obj for obj in context.selected_objects if is_scan(obj)]
    if scans or context.object is None or chosen.REGION not in context.object:
        return scans
    return [obj for obj in sources_of(context.object) if is_scan(obj) and obj.visible_get()]


def put_aside(context, shape, scans):
    """Selects scans instead of the shape that a region was taken from, which is no scan from now on."""
    if shape.library is None:
        shape[chosen.REGION] = True
    seen = [obj for obj in scans if obj.visible_get()]
    if seen:
        select_only(context, seen)


def apply_region(region, world_from_box, objects, keep, depsgraph):
    """Keeps or removes what lies in a region, of scans and of frames that stay in their files. A box needs its
    matrix, too. The function returns how many samples of scans went.
    """
    scans = [obj for obj in objects if not recording.is_recording(obj)]
    marks = [region.contains(regions.world_positions(obj, depsgraph)) for obj in scans]
    others = [(obj, recording.placement(obj, depsgraph)) for obj in objects if recording.is_recording(obj)]
    removed = select(scans, marks, keep)
    for obj, matrix in others:
        recording.note_selection(obj, region if world_from_box is None else world_from_box, keep, matrix)
    return removed


def select(objects, marks, keep):
    """Keeps or removes marked vertices of all scans, or of none where something is refused. It returns how many went.

    A scan of which nothing would be left stays as it is, if others keep something, and is hidden. It is no longer
    selected, so it is not merged.
    """
    stay = [mark if keep else ~mark for mark in marks]
    for obj in objects:
        usable.writable(obj)
        if obj.data.users > 1:
            raise Refused(
                f'"{obj.name}" shares its samples with another object: give it its own with'
                " Object > Relations > Make Single User"
            )
    if objects and not any(mark.any() for mark in stay):
        raise Refused("Nothing would be left of the scans: check the region, and what is kept of it")
    removed = 0
    for obj, mark in zip(objects, stay, strict=True):
        removed += int(np.count_nonzero(~mark))
        if not mark.any():
            hiding.hide(bpy.context, [obj])
        elif not mark.all():
            pruning.keep_vertices(obj.data, mark)
    return removed
