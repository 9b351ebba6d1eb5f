# SPDX-License-Identifier: GPL-3.0-or-later
"""Select scans, and not the cameras that came with them."""

import bpy

from .. import chosen
from ..scene import select_only
from ..telling import in_object_mode, tell, told
from ..words import number


class SURFRECON_OT_select_scans(bpy.types.Operator):
    """Select the scans in the collection of the active object, or all that are seen, and nothing else"""

    bl_idname = "surfrecon.select_scans"
    bl_label = "Select Scans"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        """There must be scans that are seen, in object mode."""
        if not in_object_mode(cls, context):
            return False
        if not any(chosen.is_scan(obj) for obj in context.view_layer.objects):
            cls.poll_message_set(told("There is no range scan in the scene: import some"))
            return False
        return True

    def execute(self, context):
        """Selects them. One of them is the active object."""
        scans = [obj for obj in context.view_layer.objects if can_be_selected(obj)]
        if not scans:
            tell(self, {"ERROR"}, "All scans are hidden: show them with their eyes, or with Show Sources")
            return {"CANCELLED"}
        active = context.view_layer.objects.active
        collections = set() if active is None else set(active.users_collection)
        scans = [obj for obj in scans if not collections.isdisjoint(obj.users_collection)] or scans
        if active in scans:
            # The first one becomes the active object.
            scans.sort(key=lambda obj: obj is not active)
        select_only(context, scans)
        tell(self, {"INFO"}, f"{number(len(scans), 'scan', 'scans')} selected")
        return {"FINISHED"}


def can_be_selected(obj):
    """Whether an object is a scan that is seen and may be selected."""
    return chosen.is_scan(obj) and chosen.REGION not in obj and obj.visible_get() and not obj.hide_select
