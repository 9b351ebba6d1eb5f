# SPDX-License-Identifier: GPL-3.0-or-later
"""A box around what is selected, to be moved and scaled to what is meant."""

import bpy
import numpy as np

from .. import chosen, regions
from ..running import Refused
from ..scene import link, select_only
from ..sources import note
from ..telling import in_object_mode, tell, told
from ..words import sentence

# A box of nothing but points of a plane has this share of its size as its height.
LEAST = 0.01

CORNERS = [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
FACES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]


class SURFRECON_OT_box_around(bpy.types.Operator):
    """Make a box around the selected scans, for Keep Inside and Remove Inside: move and scale it to what is meant"""

    bl_idname = "surfrecon.box_around"
    bl_label = "Box around Selection"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        """There must be something, in object mode."""
        if not in_object_mode(cls, context):
            return False
        if not context.selected_objects:
            cls.poll_message_set(told("Select the scans that the box is to hold"))
            return False
        return True

    def execute(self, context):
        """Makes the box, which alone is selected then."""
        meant = chosen.Chosen(context.selected_objects).objects
        depsgraph = context.evaluated_depsgraph_get()
        try:
            places = [regions.world_positions(obj, depsgraph) for obj in meant if obj.type == "MESH"]
            places = np.concatenate([points for points in places if len(points)] or [np.empty((0, 3))])
            if not len(places) or not np.isfinite(places).all():
                raise Refused("No selected object has vertices to make a box around: select the scans")
        except Refused as problem:
            tell(self, {"ERROR"}, sentence(problem))
            return {"CANCELLED"}
        low, high = places.min(axis=0), places.max(axis=0)
        half = np.maximum((high - low) / 2, LEAST * max((high - low).max(), 1e-6))
        mesh = bpy.data.meshes.new("Box")
        mesh.from_pydata(CORNERS, [], FACES)
        box = bpy.data.objects.new("Box", mesh)
        box.location, box.scale = (low + high) / 2, half
        box.display_type, box.hide_render = "WIRE", True
        box[chosen.REGION] = True
        note(box, meant, [obj.name for obj in meant])
        link(context, box)
        select_only(context, [box])
        tell(self, {"INFO"}, "Move and scale the box, then press Keep Inside or Remove Inside")
        return {"FINISHED"}
