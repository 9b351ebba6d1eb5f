# SPDX-License-Identifier: GPL-3.0-or-later
"""Preferences of the extension: what holds for all scenes."""

import os

import bpy
import surfrecon
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty

from .translations import in_our_words

UNITS = (
    ("M", "Metres", ""),
    ("CM", "Centimetres", ""),
    ("MM", "Millimetres", ""),
    ("UM", "Micrometres", ""),
    ("IN", "Inches", ""),
    ("FT", "Feet", ""),
)


def limit_memory(preferences, context):
    """Tells the library."""
    surfrecon.set_memory_limit(int(preferences.memory * 1e9) or None)


class SurfreconPreferences(bpy.types.AddonPreferences):
    """Shown in Edit > Preferences > Add-ons > Range Scans."""

    bl_idname = __package__

    threads: IntProperty(
        name="Threads",
        description="Worker threads of all operations; 0: one a core. Results are the same for any number",
        default=0,
        min=0,
        max=1024,
        soft_max=os.cpu_count() or 8,
    )
    memory: FloatProperty(
        name="Memory limit",
        description="Gigabytes that one operation may take, as far as it can be foreseen; 0: all that is free. "
        "What would need more is refused before it begins",
        default=0,
        min=0,
        max=1e6,
        soft_max=64,
        precision=1,
        update=limit_memory,
    )
    unit: EnumProperty(
        name="Unit of files",
        description="Unit in which scans are taken to be measured, unless chosen otherwise when they are imported",
        items=UNITS,
        default="M",
    )
    hide_sources: BoolProperty(
        name="Hide sources",
        description="Hide the objects that a result was made from, so that the result is seen, rendered and exported. "
        "Show Sources shows them again",
        default=True,
    )

    def draw(self, context):
        """One row a preference."""
        layout = self.layout
        layout.use_property_split = True
        for name in ("threads", "memory", "unit", "hide_sources"):
            layout.prop(self, name)


def preference(name):
    """The value of a preference. It is the default where the extension runs without being installed as one."""
    addon = bpy.context.preferences.addons.get(__package__)
    if addon is None or addon.preferences is None:
        return SurfreconPreferences.bl_rna.properties[name].default
    return getattr(addon.preferences, name)


def register():
    """Registers them."""
    bpy.utils.register_class(in_our_words(SurfreconPreferences))
    surfrecon.set_memory_limit(int(preference("memory") * 1e9) or None)


def unregister():
    """Takes them away again."""
    surfrecon.set_memory_limit(None)
    bpy.utils.unregister_class(SurfreconPreferences)
