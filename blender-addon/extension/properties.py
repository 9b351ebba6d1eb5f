# SPDX-License-Identifier: GPL-3.0-or-later
"""Options of the operators and the sidebar, made from the library's parameter table: no default is written here."""

import math

import bpy
import surfrecon
from bpy.props import BoolProperty, FloatProperty, IntProperty, PointerProperty

# Blender's sliders need an end; the library itself has none. Its whole numbers have 31 bits.
LONGEST = 1e9
LARGEST = 2**31 - 1


def option(parameter):
    """A Blender property for a parameter of the library. Where the library measures the default, 0 asks for that."""
    words = {"name": parameter.name.replace("_", " ").capitalize(), "description": description(parameter)}
    default = parameter.default or 0
    if parameter.unit == "count" and parameter.maximum == 1:
        return BoolProperty(default=bool(default), **words)
    if parameter.unit == "count":
        largest = min(int(parameter.maximum), LARGEST)
        return IntProperty(default=int(default), min=int(parameter.minimum), max=largest, **words)
    limits = {"default": default, "min": parameter.minimum, "max": min(parameter.maximum, LONGEST)}
    if parameter.unit == "length":
        return FloatProperty(subtype="DISTANCE", unit="LENGTH", precision=5, step=0.1, **limits, **words)
    if parameter.unit == "angle":
        return FloatProperty(subtype="ANGLE", unit="ROTATION", **limits, **words)
    return FloatProperty(subtype="FACTOR", precision=3, **limits, **words)


def description(parameter):
    """The library's text, without the closing full stop that Blender adds itself."""
    text = parameter.text
    if parameter.default_from:
        text += f" 0: {parameter.default_from}."
    return text.removesuffix(".")


PARAMETERS = {p.name: p for p in surfrecon.parameters("merge") + surfrecon.parameters("triangulate")}


class MergeOptions:
    """The options of a merge, for the operator and the sidebar alike."""

    __annotations__ = {name: option(parameter) for name, parameter in PARAMETERS.items()} | {
        "close_holes": BoolProperty(
            name="Close holes",
            description="Close holes whose boundary is at most as long as the limit below",
            default=True,
        )
    }


def arguments(options):
    """Keyword arguments of `surfrecon.merge` from a `MergeOptions`; lengths in Blender's unit."""
    given = {}
    for name, parameter in PARAMETERS.items():
        value = getattr(options, name)
        # Blender's numbers are in single precision: the default, pi/2 say, may come back above its own limit.
        unchanged = math.isclose(value, parameter.default or 0, rel_tol=1e-6)
        given[name] = None if unchanged else min(value, parameter.maximum)
    if not options.close_holes:
        given["max_hole_length"] = 0.0
    return given


class SurfreconSettings(MergeOptions, bpy.types.PropertyGroup):
    """What the sidebar shows; saved with the scene."""


def register():
    """Adds the settings to scenes."""
    bpy.utils.register_class(SurfreconSettings)
    bpy.types.Scene.surfrecon = PointerProperty(type=SurfreconSettings)


def unregister():
    """Takes them away again."""
    del bpy.types.Scene.surfrecon
    bpy.utils.unregister_class(SurfreconSettings)
