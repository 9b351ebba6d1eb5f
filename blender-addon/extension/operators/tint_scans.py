# SPDX-License-Identifier: GPL-3.0-or-later
"""Show each scan in a colour of its own, so that overlaps are seen."""

import bpy

from ..chosen import Chosen, is_scan
from ..scene import tint, views_of
from ..telling import tell, told
from ..words import number


class SURFRECON_OT_tint_scans(bpy.types.Operator):
    """Show each scan in a colour of its own in the solid view: overlaps are seen, and how well the scans fit"""

    bl_idname = "surfrecon.tint_scans"
    bl_label = "Colour by Scan"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        """There must be scans, or surfaces that are taken for scans."""
        if not scans_of(context):
            cls.poll_message_set(told("There is no scan in the scene: import some, or select meshes"))
            return False
        return True

    def execute(self, context):
        """Colours the selected scans, or all, and turns the view to objects' colours."""
        scans = [obj for obj in scans_of(context) if obj.library is None]
        for k, obj in enumerate(sorted(scans, key=lambda obj: obj.name)):
            tint(obj, k)
        for area in views_of(context):
            area.spaces.active.shading.type = "SOLID"
            area.spaces.active.shading.color_type = "OBJECT"
        tell(self, {"INFO"}, f"{number(len(scans), 'scan', 'scans')} coloured")
        return {"FINISHED"}


def scans_of(context):
    """The selected scans and meshes, or all scans that there are."""
    selected = [obj for obj in Chosen(context.selected_objects).objects if obj.type != "EMPTY"]
    return selected or [obj for obj in context.view_layer.objects if is_scan(obj) and obj.type != "EMPTY"]
