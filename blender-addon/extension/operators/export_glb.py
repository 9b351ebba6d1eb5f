# SPDX-License-Identifier: GPL-3.0-or-later
"""The selected surfaces as a GLB file, by Blender's own exporter: they alone, under their name, beside the scans."""

import os
import re

import bpy
from bpy.props import StringProperty

from ..imported import folder_of
from ..sources import all_sources_of
from ..telling import tell, told

# Letters that names of files can't have everywhere.
FORBIDDEN = r'[\\/:*?"<>|\x00-\x1f]'


class SURFRECON_OT_export_glb(bpy.types.Operator):
    """Write the selected surfaces, and nothing else, into a GLB file by Blender's glTF exporter"""

    bl_idname = "surfrecon.export_glb"
    bl_label = "Export GLB"

    filepath: StringProperty(
        name="File",
        description="The dialog proposes one",
        subtype="FILE_PATH",
        options={"HIDDEN", "SKIP_SAVE"},
    )

    @classmethod
    def poll(cls, context):
        """There must be a surface, and Blender's exporter."""
        if not any(is_surface(obj) for obj in context.selected_objects):
            cls.poll_message_set(told("Select the surface that is to go into the file"))
            return False
        if not hasattr(bpy.types, "EXPORT_SCENE_OT_gltf"):
            cls.poll_message_set(told("Blender's add-on glTF 2.0 is turned off: turn it on in the preferences"))
            return False
        return True

    def invoke(self, context, event):
        """Opens Blender's dialog, where a click writes the file."""
        return self.export("INVOKE_DEFAULT", self.filepath or proposed(context))

    def execute(self, context):
        """For scripts: writes the file."""
        return self.export("EXEC_DEFAULT", self.filepath or proposed(context))

    def export(self, how, path):
        """Calls Blender's exporter."""
        try:
            done = bpy.ops.export_scene.gltf(how, filepath=path, export_format="GLB", use_selection=True)
        except RuntimeError as problem:
            tell(self, {"ERROR"}, str(problem).strip())
            return {"CANCELLED"}
        # The dialog goes on by itself.
        return {"FINISHED"} if done == {"RUNNING_MODAL"} else done


def is_surface(obj):
    """Whether an object has faces that can go into a file."""
    return obj.type == "MESH" and len(obj.data.polygons) > 0


def proposed(context):
    """A path under the name of the active object: beside the file of this scene, else beside the scans."""
    surfaces = [obj for obj in context.selected_objects if is_surface(obj)]
    named = context.object if context.object in surfaces else surfaces[0]
    folder = os.path.dirname(bpy.data.filepath) or folder_of([named, *all_sources_of([named])]) or ""
    return os.path.join(folder, re.sub(FORBIDDEN, "_", named.name) + ".glb")
