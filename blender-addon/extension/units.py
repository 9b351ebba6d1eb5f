# SPDX-License-Identifier: GPL-3.0-or-later
"""Lengths and numbers as people read them, in the scene's unit."""

import bpy


def length(context, value):
    """A length in the scene's unit."""
    settings = context.scene.unit_settings
    if settings.system == "NONE":
        return f"{value:.4g}"
    return bpy.utils.units.to_string(settings.system, "LENGTH", value * settings.scale_length, precision=4)


def number(count, one, many):
    """How many there are of what has these names."""
    return f"{count:,} {one if count == 1 else many}"
