# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's export of glTF: false colours and hidden sources stay out of files. Its exporter calls what has these names
in an add-on.
"""

import bpy

from . import false_colours, hiding

# Objects that show false colours, and their looks, while a file is written.
UNDRESSED = []


def glTF2_pre_export_callback(settings):
    """Shows objects in their own materials for as long as a file is written."""
    UNDRESSED.clear()
    for obj in bpy.data.objects:
        if obj.library is None and obj.type == "MESH" and false_colours.is_shown(obj):
            UNDRESSED.append((obj, *false_colours.undress(obj)))


def glTF2_post_export_callback(settings):
    """Shows the false colours again."""
    while UNDRESSED:
        false_colours.show(*UNDRESSED.pop())


class glTF2ExportUserExtension:
    """Leaves out what a result was made from, as long as that is hidden. By itself the exporter takes it along."""

    def gather_tree_filter_tag_hook(self, tree, settings):
        """Says which nodes of the scene don't go into the file."""
        for node in tree.nodes.values():
            if node.blender_object is not None and hiding.is_hidden(node.blender_object):
                node.keep_tag = False
