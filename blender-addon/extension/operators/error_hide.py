# SPDX-License-Identifier: GPL-3.0-or-later
"""Take the error map's colours away again."""

import bpy

from ..false_colours import hide, is_shown, show_as_before
from ..telling import told


class SURFRECON_OT_error_hide(bpy.types.Operator):
    """Show the selected objects in their own materials again, as they were before they were measured"""

    bl_idname = "surfrecon.error_hide"
    bl_label = "Hide Error Map"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        """Something must show an error map."""
        shown = any(is_shown(obj) for obj in context.selected_objects)
        if not shown:
            cls.poll_message_set(told("No selected object shows an error map: select one that does"))
        return shown

    def execute(self, context):
        """Gives them their materials back."""
        for obj in context.selected_objects:
            if is_shown(obj):
                hide(obj)
        show_as_before(context)
        return {"FINISHED"}
