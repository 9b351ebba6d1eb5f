# SPDX-License-Identifier: GPL-3.0-or-later
"""True size and ground: one transform of all that is selected, so that it stays together."""

import textwrap

import bpy
import numpy as np
import surfrecon
from bpy.props import EnumProperty, FloatProperty, FloatVectorProperty
from mathutils import Matrix

from .. import false_colours, recording, regions, reports, scaling, scan_objects, usable
from ..job import JobOperator, refuse_no_numbers
from ..preferences import preference
from ..running import Handle, Known, Refused, gathered, still_there
from ..sources import all_sources_of
from ..telling import in_object_mode, tell, told
from ..words import length, number, sentence
from .select_region import is_scan

# Pixels of the dialog at scale 1, and letters of a line in it.
WIDTH, LETTERS = 400, 52


class SURFRECON_OT_true_size(bpy.types.Operator):
    """Scale what is selected, and what it was made from, so that two picked points lie as far apart as in reality"""

    bl_idname = "surfrecon.true_size"
    bl_label = "True Size"
    bl_options = {"REGISTER", "UNDO"}

    distance: FloatProperty(
        name="True distance",
        description="How far the two points of the ruler, or the two selected vertices, lie apart in reality",
        subtype="DISTANCE",
        unit="LENGTH",
        precision=5,
        default=1.0,
        min=1e-9,
        soft_max=1e3,
        max=1e9,
        options={"SKIP_SAVE"},
    )

    ends: FloatVectorProperty(
        name="Ends",
        description="The ends of the ruler on the surface, if it was moved there",
        size=6,
        options={"HIDDEN", "SKIP_SAVE"},
    )

    # Said in the dialog: how the ends of the ruler lie, and whether that is to be mended.
    said, warns = None, False

    @classmethod
    def poll(cls, context):
        """There must be something to scale, in object mode."""
        if not in_object_mode(cls, context):
            return False
        return has_selection(cls, context)

    def invoke(self, context, event):
        """Asks for the distance. It begins with what was measured."""
        try:
            moved, self.said, self.warns = regions.ends_of_ruler(context, context.selected_objects)
            if moved is not None:
                self.ends = moved.ravel()
            a, b = self.picked(context)
        except Refused as problem:
            tell(self, {"ERROR"}, str(problem))
            return {"CANCELLED"}
        self.distance = float(np.linalg.norm(b - a))
        return context.window_manager.invoke_props_dialog(self, width=WIDTH)

    def draw(self, context):
        """The distance, and what makes it wrong."""
        self.layout.use_property_split = True
        self.layout.prop(self, "distance")
        for k, line in enumerate(textwrap.wrap(told(self.said or ""), LETTERS)):
            icon = "BLANK1" if k > 0 else "ERROR" if self.warns else "INFO"
            self.layout.label(text=line, icon=icon, translate=False)

    def picked(self, context):
        """The two points."""
        if self.properties.is_property_set("ends"):
            return np.array(self.ends, np.float64).reshape(2, 3)
        return regions.picked(context, 2)

    def execute(self, context):
        """Scales about the origin of the scene."""
        try:
            refuse_no_numbers(self)
            scale = surfrecon.true_size(*self.picked(context), self.distance).scale
            roots, taken = movable_roots(context)
            scaling.refuse_shared(roots)
            if self.said is None and not self.properties.is_property_set("ends"):
                _, self.said, self.warns = regions.ends_of_ruler(context, context.selected_objects, by_view=False)
        except (Refused, surfrecon.SurfreconError) as problem:
            tell(self, {"ERROR"}, sentence(problem))
            return {"CANCELLED"}
        family = family_of(context)
        for root in roots:
            scaling.grow(root, scale)
        # Measured distances are as much larger.
        false_colours.grow(family, scale)
        for obj in family:
            reports.grow(obj, scale)
        tell(self, {"INFO"}, f"Scaled by {scale:.6g}{went_along(taken)}")
        if self.said:
            tell(self, {"WARNING" if self.warns else "INFO"}, self.said)
        return {"FINISHED"}


class SURFRECON_OT_ground(JobOperator, bpy.types.Operator):
    """Turn and move what is selected, and what it was made from, so that a picked or found plane becomes the ground"""

    bl_idname = "surfrecon.ground"
    bl_label = "Ground"
    bl_options = {"REGISTER", "UNDO"}
    # An adjusted plane is that of where things were before: Blender has taken the first move back by then.
    may_be_handed_over = False

    by: EnumProperty(
        name="Plane",
        description="What becomes the ground",
        items=(
            (
                "AUTO",
                "Picked or largest",
                "The points that are picked, else the plane that the selected scans stand on",
            ),
            ("PICKED", "Picked points", "Three points of a bent ruler, else three or more selected vertices or a face"),
            ("OBJECT", "Active object", "The plane of the active mesh or empty, whose z points up"),
            ("FOUND", "Largest plane", "The plane that the selected scans stand on"),
        ),
    )

    @classmethod
    def poll(cls, context):
        """There must be something to move."""
        return super().poll(context) and has_selection(cls, context)

    def draw(self, context):
        """Panel of the last operation."""
        self.layout.use_property_split = True
        self.layout.prop(self, "by")

    def launch(self, context):
        """Finds the plane."""
        # The user may select others meanwhile.
        roots, self.taken = movable_roots(context)
        self.roots = [Handle(obj) for obj in roots]
        objects = [obj for obj in family_of(context) if is_scan(obj)]
        points = None
        if self.by in ("AUTO", "PICKED"):
            try:
                points = regions.picked(context, 3)
            except Refused:
                if self.by == "PICKED" or not objects:
                    raise
        if self.by == "FOUND" or (self.by == "AUTO" and points is None):
            if not objects:
                raise Refused("Select the scans that stand on something")
            scans = recording.of_all((yield from gathered(context, objects, recording.scan_or_frames)))
            return surfrecon.Job.dominant_plane(scans, threads=preference("threads") or None)
        if self.by == "OBJECT":
            if context.object is None:
                raise Refused("Make the plane the active object")
            plane, _ = regions.region_of(context.object, context.evaluated_depsgraph_get())
            if not isinstance(plane, surfrecon.Plane):
                raise Refused(f'"{context.object.name}" is a box: make a flat mesh or an empty the active object')
            return Known(plane)
        # Cameras look at a ground from above.
        images = [obj for obj in objects if scan_objects.is_range_image(obj)]
        found = yield from gathered(context, images, scan_objects.scan_of_object)
        eyes = [scan.world_from_sensor[:3, 3] for scan in found if isinstance(scan, surfrecon.RangeImage)]
        above = np.mean(eyes, axis=0) if eyes else points.mean(axis=0) + (0, 0, 1)
        return Known(regions.plane_of(points, above))

    def finish(self, context, plane):
        """Moves everything alike."""
        matrix = Matrix(surfrecon.ground(plane).matrix.tolist())
        for root in still_there(self.roots):
            root.matrix_world = matrix @ root.matrix_world
        text = "The plane is the ground now"
        if plane.share is not None:
            text += f". It has {plane.share:.0%} of the samples, which spread by {length(context, plane.spread)}"
        tell(self, {"INFO"}, text + went_along(self.taken))


def has_selection(cls, context):
    """For `poll`: whether something is selected."""
    if not context.selected_objects:
        cls.poll_message_set(told("Select the scans and what was made of them"))
        return False
    return True


def family_of(context):
    """The selected objects and what they were made from, which lies in the same place and has the same size."""
    return [*context.selected_objects, *all_sources_of(context.selected_objects)]


def movable_roots(context):
    """The selected objects, and what they were made from, that no other one takes along. The second value is how many
    of their sources were not selected. It refuses objects that can't be moved.
    """
    family = family_of(context)
    roots = [obj for obj in family if set(family).isdisjoint(ancestors(obj))]
    for obj in roots:
        refuse_held(obj)
    return roots, len(family) - len(context.selected_objects)


def went_along(taken):
    """The end of a sentence about sources that were not selected, if there are any."""
    return f"; {number(taken, 'source', 'sources')} went along" if taken else ""


def refuse_held(obj):
    """Refuses an object that can't be moved, or would not stay where it is put."""
    usable.movable(obj)
    animation = obj.animation_data
    is_animated = animation is not None and (animation.action is not None or len(animation.drivers) > 0)
    if is_animated or any(not constraint.mute for constraint in obj.constraints):
        raise Refused(
            f'"{obj.name}" does not stay where it is put: turn off its constraints, keyframes and drivers,'
            " or select what it follows instead"
        )


def ancestors(obj):
    """The objects that it hangs on."""
    while obj.parent is not None:
        obj = obj.parent
        yield obj
