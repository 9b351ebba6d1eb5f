# SPDX-License-Identifier: GPL-3.0-or-later
"""Find the plane that scans stand on, and remove it with what lies below."""

import bpy
import surfrecon

from .. import declared, recording
from ..job import JobOperator
from ..properties import draw_others, given, option
from ..running import Handle, gathered, still_there
from ..telling import tell, told
from ..words import length, number
from .select_region import apply_region, is_scan

PARAMETERS = {p.name: p for p in surfrecon.parameters("plane")}


@declared.operator("plane")
class SURFRECON_OT_remove_background(JobOperator, bpy.types.Operator):
    """Runs the operation `plane`."""

    bl_options = {"REGISTER", "UNDO"}
    # The vertices that were there at the start tell what is removed.
    may_be_handed_over = False

    __annotations__ = {name: option(parameter) for name, parameter in PARAMETERS.items()}

    @classmethod
    def poll(cls, context):
        """There must be scans, in object mode."""
        if not super().poll(context):
            return False
        if not any(is_scan(obj) for obj in context.selected_objects):
            cls.poll_message_set(told("Select the scans that stand on something"))
            return False
        return True

    def draw(self, context):
        """Panel of the last operation."""
        self.layout.use_property_split = True
        draw_others(self.layout, self, PARAMETERS, ())

    def launch(self, context):
        """Gathers the selected scans."""
        objects = [obj for obj in context.selected_objects if is_scan(obj)]
        self.scans = [Handle(obj) for obj in objects]
        scans = recording.of_all((yield from gathered(context, objects, recording.scan_or_frames)))
        return surfrecon.Job.dominant_plane(scans, **given(self, PARAMETERS))

    def finish(self, context, plane):
        """Removes what lies on the plane and below."""
        objects = still_there(self.scans)
        removed = apply_region(plane, None, objects, False, context.evaluated_depsgraph_get())
        text = f"The plane has {plane.share:.0%} of the samples, which spread by {length(context, plane.spread)}"
        tell(self, {"INFO"}, f"{text}; {removed:,} samples of {number(len(objects), 'scan', 'scans')} removed")
