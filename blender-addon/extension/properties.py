# SPDX-License-Identifier: GPL-3.0-or-later
"""Options of the operators and the sidebar, made from the library's parameter table: no default is written here."""

import math

import bpy
import surfrecon
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, PointerProperty

from .preferences import preference
from .translations import in_our_words

# Blender's sliders need an end; the library itself has none. Its whole numbers have 31 bits.
LONGEST = 1e9
LARGEST = 2**31 - 1
# Counts beyond are typed, not dragged.
MANY = 1_000_000


def option(parameter, in_scene=True):
    """A Blender property for a parameter of the library. Where the data give the default, 0 asks for that.

    Lengths are in the scene's unit, or plain numbers.
    """
    words = {"name": parameter.label, "description": description(parameter)}
    if parameter.kind == "flag":
        return BoolProperty(default=parameter.default, **words)
    if parameter.kind == "choice":
        items = [(name, label, text.removesuffix(".")) for name, label, text in parameter.choices]
        return EnumProperty(items=items, default=parameter.default, **words)
    default = parameter.default or 0
    least = min(parameter.minimum, default)
    if parameter.minimum_excluded and default > 0:
        # Sliders have no open ends.
        least += math.radians(0.1) if parameter.kind == "angle" else 1e-6 * default
    if parameter.kind == "count":
        largest = min(int(parameter.maximum), LARGEST)
        return IntProperty(default=default, min=int(least), max=largest, soft_max=min(largest, MANY), **words)
    limits = {"default": default, "min": max(least, -LONGEST), "max": min(parameter.maximum, LONGEST)}
    if parameter.kind == "length" and in_scene:
        return FloatProperty(subtype="DISTANCE", unit="LENGTH", precision=5, step=0.1, **limits, **words)
    if parameter.kind == "angle":
        return FloatProperty(subtype="ANGLE", unit="ROTATION", **limits, **words)
    if default == 0 and parameter.maximum == math.inf:
        return FloatProperty(precision=5, **limits, **words)
    if parameter.maximum > 100 * default > 0:
        # A slider over the whole range would be of no use.
        return FloatProperty(precision=5 if default < 0.01 else 3, step=100 * default / 20, **limits, **words)
    return FloatProperty(subtype="FACTOR", precision=3, **limits, **words)


def description(parameter):
    """The library's text as it reads beside a button, without the closing full stop that Blender adds itself."""
    text = parameter.text
    if parameter.name == "threads":
        return "Worker threads; the result is the same for any number. 0: as many as the preferences say"
    if parameter.default_from:
        # The effect of 0 in the library is not that of 0 here.
        text += f" 0: {parameter.default_from}"
    elif parameter.off:
        text += f" {'Off' if parameter.kind == 'flag' else '0'}: {parameter.off}"
    return text.removesuffix(".")


def draw_others(layout, options, parameters, drawn):
    """A row for each parameter that has no place of its own. Threads are a matter of the preferences."""
    for name in parameters:
        if name != "threads" and name not in drawn:
            layout.prop(options, name)


PARAMETERS = {p.name: p for p in surfrecon.parameters("merge") + surfrecon.parameters("triangulate")}


class MergeOptions:
    """The options of a merge, for the operator and the sidebar alike."""

    __annotations__ = {name: option(parameter) for name, parameter in PARAMETERS.items()}

    def draw_options(self, layout):
        """One row an option, but for the threads."""
        distances, limits = ("voxel", "merge_distance"), ("edge_limit", "grazing_limit")
        column = layout.column(align=True)
        for name in distances:
            column.prop(self, name)
        column = layout.column(align=True)
        column.prop(self, "close")
        closing = ("max_hole_length", "flat_base", "base_up")
        for name in closing:
            row = column.row()
            row.active = name not in idle(self)
            row.prop(self, name)
        draw_others(layout, self, PARAMETERS, {*distances, "close", *closing, *limits})
        column = layout.column(align=True)
        for name in limits:
            column.prop(self, name)


def given(options, parameters):
    """Keyword arguments of the library from an operator's options: `None` where the library's default stands."""
    found = {}
    for name, parameter in parameters.items():
        value = getattr(options, name)
        if parameter.kind in {"flag", "choice"}:
            unchanged = value == parameter.default
        else:
            # Blender's numbers are in single precision: the default, pi/2 say, may come back above its own limit.
            unchanged = math.isclose(value, parameter.default or 0, rel_tol=1e-6)
            value = min(value, int(parameter.maximum) if parameter.kind == "count" else parameter.maximum)
        found[name] = None if unchanged else value
    if "threads" in parameters:
        found["threads"] = threads(options)
    return found


def threads(options):
    """Worker threads: those of the operator, else of the preferences, else `None` for the library's own choice."""
    return options.threads or preference("threads") or None


def arguments(options):
    """Keyword arguments of `surfrecon.merge` from a `MergeOptions`. Lengths are in Blender's unit."""
    used = {name: p for name, p in PARAMETERS.items() if name != "threads"}
    return given(options, used) | dict.fromkeys(idle(options) - {"max_hole_length"})


def idle(options):
    """The options of closing that have no use with the others: they are greyed out."""
    found = {"max_hole_length"} if options.close != "holes" else set()
    if options.close not in {"all", "seen"}:
        found |= {"flat_base", "base_up"}
    elif not options.flat_base:
        found.add("base_up")
    return found


class SurfreconSettings(MergeOptions, bpy.types.PropertyGroup):
    """The settings in the sidebar, saved with the scene."""


def register():
    """Adds the settings to scenes."""
    bpy.utils.register_class(in_our_words(SurfreconSettings))
    bpy.types.Scene.surfrecon = PointerProperty(type=SurfreconSettings)


def unregister():
    """Takes them away again."""
    del bpy.types.Scene.surfrecon
    bpy.utils.unregister_class(SurfreconSettings)
