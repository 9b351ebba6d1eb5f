# SPDX-License-Identifier: GPL-3.0-or-later
"""Options of the operators and the sidebar, made from the library's parameter table: no default is written here."""

import math
import re

import bpy
import surfrecon
from bpy.props import BoolProperty, FloatProperty, IntProperty, PointerProperty

from .preferences import preference
from .translations import in_our_words

# Blender's sliders need an end; the library itself has none. Its whole numbers have 31 bits.
LONGEST = 1e9
LARGEST = 2**31 - 1


# Where the library's name says little to people.
LABELS = {"min_component_share": "Smallest part (share)"}


def option(parameter, name=None):
    """A Blender property for a parameter of the library. Where the library measures the default, 0 asks for that."""
    words = {"name": name or label(parameter), "description": description(parameter)}
    default = parameter.default or 0
    least = min(parameter.minimum, default)
    if parameter.minimum_excluded and default > 0:
        # Sliders have no open ends.
        least += math.radians(0.1) if parameter.unit == "angle" else 1e-6 * default
    if parameter.unit == "count" and parameter.maximum == 1:
        return BoolProperty(default=bool(default), **words)
    if parameter.unit == "count":
        largest = min(int(parameter.maximum), LARGEST)
        return IntProperty(default=int(default), min=int(least), max=largest, **words)
    limits = {"default": default, "min": least, "max": min(parameter.maximum, LONGEST)}
    if parameter.unit == "length":
        return FloatProperty(subtype="DISTANCE", unit="LENGTH", precision=5, step=0.1, **limits, **words)
    if parameter.unit == "angle":
        return FloatProperty(subtype="ANGLE", unit="ROTATION", **limits, **words)
    if parameter.maximum > 100 * default > 0:
        # A slider over the whole range would be of no use.
        return FloatProperty(precision=5 if default < 0.01 else 3, step=100 * default / 20, **limits, **words)
    return FloatProperty(subtype="FACTOR", precision=3, **limits, **words)


def label(parameter):
    """The name of a parameter for people."""
    return LABELS.get(parameter.name) or parameter.name.replace("_", " ").capitalize().replace("Rms", "RMS")


def description(parameter):
    """The library's text as it reads beside a button, without the closing full stop that Blender adds itself."""
    text = parameter.text
    if parameter.default_from:
        # What 0 does in the library is not what it does here, where it asks for the default.
        text = re.sub(r"(?<!\S)0 [^.;]*; (\w)", lambda found: found[1].upper(), text)
        text = re.sub(r"; 0 [^.;]*", "", text) + f" 0: {parameter.default_from}."
    if parameter.unit == "count" and parameter.maximum == 1:
        text = re.sub(r"(?<![\w ] )\b([01]):? (?=\w)", lambda found: ("off: ", "on: ")[int(found[1])], text)
        text = text[:1].upper() + text[1:]
    # Other parameters are told by the names they have here.
    return re.sub(r"\b([a-z]+)_([a-z]+)\b", r"\1 \2", text).removesuffix(".")


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

    def draw_options(self, layout):
        """One row an option, but for the threads."""
        column = layout.column(align=True)
        column.prop(self, "voxel")
        column.prop(self, "merge_distance")
        column = layout.column(align=True)
        column.prop(self, "close_holes")
        row = column.row()
        row.active = self.close_holes
        row.prop(self, "max_hole_length")
        layout.prop(self, "min_component_share")
        column = layout.column(align=True)
        column.prop(self, "edge_limit")
        column.prop(self, "grazing_limit")


def given(options, parameters):
    """Keyword arguments of the library from an operator's options: `None` where the library's default stands."""
    found = {}
    for name, parameter in parameters.items():
        value = getattr(options, name)
        # Blender's numbers are in single precision: the default, pi/2 say, may come back above its own limit.
        unchanged = math.isclose(value, parameter.default or 0, rel_tol=1e-6)
        found[name] = None if unchanged else min(value, parameter.maximum)
        if parameter.unit == "count" and not isinstance(value, bool) and found[name] is not None:
            found[name] = int(found[name])
    if "threads" in parameters:
        found["threads"] = threads(options)
    return found


def threads(options):
    """Worker threads: those of the operator, else of the preferences, else `None` for the library's own choice."""
    return options.threads or preference("threads") or None


def arguments(options):
    """Keyword arguments of `surfrecon.merge` from a `MergeOptions`; lengths in Blender's unit."""
    found = given(options, {name: p for name, p in PARAMETERS.items() if name != "threads"})
    if not options.close_holes:
        found["max_hole_length"] = 0.0
    return found


class SurfreconSettings(MergeOptions, bpy.types.PropertyGroup):
    """What the sidebar shows; saved with the scene."""


def register():
    """Adds the settings to scenes."""
    bpy.utils.register_class(in_our_words(SurfreconSettings))
    bpy.types.Scene.surfrecon = PointerProperty(type=SurfreconSettings)


def unregister():
    """Takes them away again."""
    del bpy.types.Scene.surfrecon
    bpy.utils.unregister_class(SurfreconSettings)
