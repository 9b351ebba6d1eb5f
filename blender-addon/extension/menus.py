# SPDX-License-Identifier: GPL-3.0-or-later
"""Entries in Blender's own menus: File > Import and Export, and Object > Range Scans."""

import bpy
import surfrecon

from . import operators
from .formats import ENDINGS
from .translations import word

# Endings of files that range scans are written into.
WRITTEN = [f".{ending}" for endings in surfrecon.formats(written="images").values() for ending in endings]

# Operators that stand in the menus of files.
FILES = ("surfrecon.import_scans", "surfrecon.export_scans")

# The order of the work; a line between groups.
OBJECT = (
    ("surfrecon.reproject", "surfrecon.virtual_scan"),
    ("surfrecon.select_scans", "surfrecon.tint_scans", "surfrecon.show_sources"),
    ("surfrecon.true_size", "surfrecon.ground"),
    ("surfrecon.clean", "surfrecon.remove_background"),
    ("surfrecon.box_around", "surfrecon.keep_inside", "surfrecon.remove_inside"),
    ("surfrecon.align", "surfrecon.merge", "surfrecon.align_merge", "surfrecon.merge_to_file", "surfrecon.reconstruct"),
    ("surfrecon.close_surface",),
    ("surfrecon.sculpt", "surfrecon.quads", "surfrecon.remesh", "surfrecon.unwrap"),
    ("surfrecon.error_map", "surfrecon.error_hide", "surfrecon.measure", "surfrecon.check_print"),
    ("surfrecon.prepare_print",),
    ("surfrecon.export_glb", "surfrecon.export_for_printing"),
)


def groups():
    """The groups of the menu. Operators that no group names come last."""
    named = {*FILES, *(name for group in OBJECT for name in group)}
    others = [cls.bl_idname for cls in operators.CLASSES if issubclass(cls, bpy.types.Operator) and not hidden(cls)]
    rest = tuple(name for name in others if name not in named)
    return (*OBJECT, rest) if rest else OBJECT


def hidden(cls):
    """Whether no menu and no search has the operator: a former name."""
    return "INTERNAL" in getattr(cls, "bl_options", ())


class SURFRECON_MT_object(bpy.types.Menu):
    """Everything that works on the selected objects."""

    bl_idname = "SURFRECON_MT_object"
    bl_label = "Range Scans"

    def draw(self, context):
        """One entry an operator."""
        layout = self.layout
        layout.operator_context = "INVOKE_DEFAULT"
        for k, group in enumerate(groups()):
            if k > 0:
                layout.separator()
            for name in group:
                layout.operator(name)


def menu_import(self, context):
    """The entry in File > Import."""
    self.layout.operator("surfrecon.import_scans", text=f"{word('Range Scans')} ({', '.join(ENDINGS)})")


def menu_export(self, context):
    """The entry in File > Export."""
    self.layout.operator("surfrecon.export_scans", text=f"{word('Range Scans')} ({', '.join(WRITTEN)})")


def menu_object(self, context):
    """The entry in the Object menu."""
    self.layout.separator()
    self.layout.menu(SURFRECON_MT_object.bl_idname)


ENTRIES = (
    ("TOPBAR_MT_file_import", menu_import),
    ("TOPBAR_MT_file_export", menu_export),
    ("VIEW3D_MT_object", menu_object),
)


def register():
    """Adds the entries."""
    bpy.utils.register_class(SURFRECON_MT_object)
    for menu, entry in ENTRIES:
        getattr(bpy.types, menu).append(entry)


def unregister():
    """Takes them away again."""
    for menu, entry in reversed(ENTRIES):
        getattr(bpy.types, menu).remove(entry)
    bpy.utils.unregister_class(SURFRECON_MT_object)
