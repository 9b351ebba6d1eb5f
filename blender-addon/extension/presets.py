# SPDX-License-Identifier: GPL-3.0-or-later
"""Presets that come with the extension, beside those that users save: the folder `presets`."""

import os

import bpy

FOLDER = os.path.dirname(__file__)


def register():
    """Lets Blender look into the folder."""
    bpy.utils.register_preset_path(FOLDER)


def unregister():
    """And no more."""
    bpy.utils.unregister_preset_path(FOLDER)
