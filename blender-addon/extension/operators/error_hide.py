# SPDX-License-Identifier: GPL-3.0-or-later
"""Take the error map's colours away again."""

import bpy

from .error_map import SWITCHED, hide, shows_error


class SURFRECON_OT_error_hide(bpy.types.Operator):
    """Show the selected objects in their own materials again; the measured errors stay as an attribute"""

    bl_idname = "surfrecon.error_hide"
    bl_label = "Hide Error Map"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        """Something must show an error map."""
        shown = any(shows_error(slot.material) for obj in context.selected_objects for slot in obj.material_slots)
        if not shown:
            cls.poll_message_set("No selected object shows an error map")
        return shown

    def execute(self, context):
        """Gives them their materials back."""
        for obj in context.selected_objects:
            hide(obj)
        for area in context.screen.areas if context.screen else ():
            if area.as_pointer() in SWITCHED and area.type == "VIEW_3D":
                SWITCHED.discard(area.as_pointer())
                if area.spaces.active.shading.type == "MATERIAL":
                    area.spaces.active.shading.type = "SOLID"
        return {"FINISHED"}
