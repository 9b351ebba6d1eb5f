# SPDX-License-Identifier: GPL-3.0-or-later
"""Merge the selected scans straight into a file: what should never be one object."""

import os

import bpy
import surfrecon
from bpy.props import EnumProperty, StringProperty
from bpy_extras.io_utils import ExportHelper

from ..chosen import Chosen
from ..properties import MergeOptions, arguments, threads
from ..sources import common_name
from ..telling import tell
from ..words import number
from .merge import OfSelected


class SURFRECON_OT_merge_to_file(OfSelected, bpy.types.Operator, ExportHelper):
    """Merge the selected scans straight into a PLY file, also more of them than memory holds. No object is made"""

    bl_idname = "surfrecon.merge_to_file"
    bl_label = "Merge to File"
    bl_options = {"PRESET"}

    filename_ext = ".ply"

    __annotations__ = MergeOptions.__annotations__ | {
        "filter_glob": StringProperty(default="*.ply", options={"HIDDEN"}),
        "encoding": EnumProperty(
            name="Coordinates",
            description="Numbers of the file. Far from the origin coordinates are in double precision anyway",
            items=(
                ("BINARY", "Single precision", "Seven digits, relative to where the surface lies"),
                ("BINARY_DOUBLE", "Double precision", "All digits, in a file almost twice as large"),
            ),
            default="BINARY",
        ),
    }

    may_be_handed_over = by_hand = False

    def invoke(self, context, event):
        """Asks for the file."""
        self.by_hand = True
        if not self.filepath:
            scans = Chosen(context.selected_objects).objects
            self.filepath = f"{bpy.path.clean_name(common_name(scans))} merged.ply" if scans else "merged.ply"
        return ExportHelper.invoke(self, context, event)

    def draw(self, context):
        """The options beside the file browser."""
        layout = self.layout
        layout.use_property_split = True
        self.draw_options(layout)
        layout.prop(self, "encoding")

    def execute(self, context):
        """After the dialog the window stays alive while files are read. Scripts wait."""
        if self.by_hand and not bpy.app.background:
            self.by_hand = False
            return self.watch(context)
        return super().execute(context)

    def launch(self, context):
        """Merges what is selected. What memory does not hold is beside the file meanwhile."""
        if not self.filepath:
            raise surfrecon.InputError("No file is named for the surface: choose one, or give its path")
        scans = yield from self.gather(context)
        self.count = len(scans)
        self.path = bpy.path.ensure_ext(bpy.path.abspath(self.filepath), self.filename_ext)
        options = {"encoding": self.encoding.lower(), "threads": threads(self)}
        return surfrecon.Job.merge_to_file(scans, self.path, **arguments(self), **options)

    def finish(self, context, report):
        """The scene stays as it is."""
        merged = f"{number(self.count, 'scan', 'scans')} merged: {sum(report.faces):,} triangles"
        tell(self, {"INFO"}, f"{merged} in {os.path.basename(self.path)}{self.said}")
