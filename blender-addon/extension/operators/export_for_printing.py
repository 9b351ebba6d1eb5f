# SPDX-License-Identifier: GPL-3.0-or-later
"""The selected surfaces as one file for a slicer, in millimetres: 3MF, which says its unit and colours, or STL."""

import os

import bpy
import numpy as np
import surfrecon
from bpy.props import EnumProperty, StringProperty

from ..by_format import ExportByFormat
from ..running import Refused
from ..surfaces import surface_of
from ..telling import tell, told
from ..words import number, sentence
from .export_glb import is_surface, proposed

FORMATS = (
    ("3MF", "3MF (.3mf)", "Says its unit, and has the colours of the surface"),
    (
        "STL",
        "STL (.stl)",
        "Triangles alone, for slicers that read no 3MF. They see no unit: choose millimetres there",
    ),
)

# Millimetres in a metre.
MILLIMETRES = 1000.0


class SURFRECON_OT_export_for_printing(bpy.types.Operator, ExportByFormat):
    """Write the selected surfaces, and nothing else, into a file for a slicer, in millimetres"""

    bl_idname = "surfrecon.export_for_printing"
    bl_label = "Export for Printing"
    bl_options = {"PRESET"}

    filename_ext = ".3mf"
    filter_glob: StringProperty(default="*.3mf;*.stl", options={"HIDDEN"})
    file_format: EnumProperty(name="Format", items=FORMATS, default="3MF")

    @classmethod
    def poll(cls, context):
        """There must be a surface."""
        if any(is_surface(obj) for obj in context.selected_objects):
            return True
        cls.poll_message_set(told("Select the surface that is to go into the file"))
        return False

    def invoke(self, context, event):
        """Opens the dialog of files."""
        self.filepath = os.path.splitext(proposed(context))[0] + self.ending
        return super().invoke(context, event)

    def draw(self, context):
        """The options beside the file browser."""
        self.layout.use_property_split = True
        self.layout.prop(self, "file_format")

    def execute(self, context):
        """Writes the file, and says its size and whether it is closed."""
        surfaces = [obj for obj in context.selected_objects if is_surface(obj)]
        scale = MILLIMETRES * context.scene.unit_settings.scale_length
        path = self.path()
        try:
            mesh = surface_of(surfaces, context.evaluated_depsgraph_get())
            mesh = mesh.transformed(surfrecon.Similarity(np.diag([scale, scale, scale, 1.0])))
            mesh.write(path, metres_per_unit=1 / MILLIMETRES)
            report = mesh.check()
        except (Refused, surfrecon.SurfreconError) as problem:
            tell(self, {"ERROR"}, sentence(problem))
            return {"CANCELLED"}
        used = mesh.positions[np.unique(mesh.triangles)]
        size = " × ".join(f"{extent:.1f}" for extent in np.ptp(used, axis=0))
        tell(self, {"INFO"}, f"{os.path.basename(path)}: {size} mm")
        if not report.is_manifold:
            tell(
                self, {"WARNING"}, "The surface is no manifold, so slicers may print it wrongly: merge its scans again"
            )
        elif not report.is_closed:
            holes = number(report.boundary_loops, "hole", "holes")
            tell(self, {"WARNING"}, f"The surface has {holes}, which slicers close in their own way: close them first")
        return {"FINISHED"}
