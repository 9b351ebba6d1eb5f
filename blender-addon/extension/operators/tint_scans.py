# SPDX-License-Identifier: GPL-3.0-or-later
"""Show each scan in a colour of its own, so that overlaps are seen."""

import bpy

from .. import scan_objects
from ..scene import tint


class SURFRECON_OT_tint_scans(bpy.types.Operator):
    """Show each scan in a colour of its own in the solid view: overlaps are seen, and how well the scans fit"""

    bl_idname = "surfrecon.tint_scans"
    bl_label = "Colour by Scan"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        """There must be scans."""
        if not any(scan_objects.is_range_image(obj) for obj in context.view_layer.objects):
            cls.poll_message_set("There is no range scan in the scene: import some")
            return False
        return True

    def execute(self, context):
        """Colours the selected scans, or all, and turns the view to objects' colours."""
        scans = [obj for obj in context.selected_objects if scan_objects.is_range_image(obj)]
        scans = scans or [obj for obj in context.view_layer.objects if scan_objects.is_range_image(obj)]
        scans = [obj for obj in scans if obj.library is None]
        for number, obj in enumerate(sorted(scans, key=lambda obj: obj.name)):
            tint(obj, number)
        for area in context.screen.areas if context.screen else ():
            if area.type == "VIEW_3D":
                area.spaces.active.shading.type = "SOLID"
                area.spaces.active.shading.color_type = "OBJECT"
        self.report({"INFO"}, f"{len(scans)} scans coloured")
        return {"FINISHED"}
