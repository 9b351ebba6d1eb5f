# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's export of glTF: false colours stay out of files. Its exporter calls what has these names in an add-on."""

import bpy

from . import false_colours

# What shows false colours, and how, while a file is written.
UNDRESSED = []


def glTF2_pre_export_callback(settings):  # noqa: N802 (the exporter's name)
    """Shows objects in their own materials for as long as a file is written."""
    UNDRESSED.clear()
    for obj in bpy.data.objects:
        if obj.library is None and obj.type == "MESH" and false_colours.is_shown(obj):
            UNDRESSED.append((obj, *false_colours.undress(obj)))


def glTF2_post_export_callback(settings):  # noqa: N802 (the exporter's name)
    """Shows the false colours again."""
    while UNDRESSED:
        false_colours.show(*UNDRESSED.pop())
