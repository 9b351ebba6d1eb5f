# SPDX-License-Identifier: GPL-3.0-or-later
"""Lengths, numbers, times and errors as people read them."""

import re
import textwrap

import bpy
import surfrecon

from .advice import advised

# Units that a scene is set to by hand, in metres. Metres and feet are what every new scene has, and tell nothing: in
# them a length is told by the unit that suits it.
CHOSEN_UNITS = {
    "KILOMETERS": ("km", 1000.0),
    "CENTIMETERS": ("cm", 0.01),
    "MILLIMETERS": ("mm", 0.001),
    "MICROMETERS": ("µm", 1e-6),
    "MILES": ("mi", 1609.344),
    "INCHES": ("in", 0.0254),
    "THOU": ("thou", 0.0000254),
}

# Units that suit lengths by their size, the largest first, in metres. Blender's own choice tells millimetres in thou.
SUITING_UNITS = {
    "METRIC": {"km": 1000.0, "m": 1.0, "cm": 0.01, "mm": 0.001, "µm": 1e-6},
    "IMPERIAL": {"mi": 1609.344, "ft": 0.3048, "in": 0.0254, "thou": 0.0000254},
}
# Inches are told down to thousandths.
LEAST_INCHES = 0.001


def length(context, value):
    """A length in the scene's unit, and in that one that is chosen there."""
    settings = context.scene.unit_settings
    if settings.system == "NONE":
        return f"{value:.4g}"
    metres = value * settings.scale_length
    if settings.length_unit in CHOSEN_UNITS:
        return in_unit(metres, *CHOSEN_UNITS[settings.length_unit])
    if settings.system == "IMPERIAL":
        return in_unit(metres, *imperial(metres))
    return bpy.utils.units.to_string(settings.system, "LENGTH", metres, precision=4)


def in_unit(metres, unit, size):
    """A length in a unit of so many metres."""
    return f"{metres / size:,.4g} {unit}" if abs(metres / size) < 1000 else f"{metres / size:,.0f} {unit}"


def imperial(metres):
    """The imperial unit that suits a length, and its metres."""
    units = SUITING_UNITS["IMPERIAL"]
    if metres == 0:
        return "ft", units["ft"]
    least = {unit: size * (LEAST_INCHES if unit == "in" else 1) for unit, size in units.items()}
    return next(((unit, units[unit]) for unit in units if abs(metres) >= least[unit]), ("thou", units["thou"]))


def size(context, dimensions):
    """Width, depth and height: in one unit, which suits the largest and is said once."""
    settings = context.scene.unit_settings
    sides = [length(context, side) for side in dimensions]
    unit = max(zip(dimensions, sides, strict=True))[1].rpartition(" ")[2]
    units = SUITING_UNITS.get(settings.system, {})
    if settings.length_unit not in CHOSEN_UNITS and unit in units:
        scale = settings.scale_length / units[unit]
        sides = [f"{side * scale:.4g} {unit}" for side in dimensions]
    if all(side.endswith(f" {unit}") for side in sides):
        sides[:-1] = [side.removesuffix(f" {unit}") for side in sides[:-1]]
    return " x ".join(sides)


def number(count, one, many):
    """How many there are of what has these names."""
    return f"{count:,} {one if count == 1 else many}"


# Labels of parameters whose names in code are no words. Names of files and objects stay as they are.
FILES = ("open", "write")
LABELS = {p.name: p.label for p in surfrecon.parameters() if "_" in p.name and p.operation not in FILES}
CODE_NAMES = re.compile(rf'(?<![\w"/.-])({"|".join(LABELS)})(?![\w"/.-])')


def sentence(problem):
    """The text of an error as people read it: the library's begin in small letters and name parameters as code does."""
    text = CODE_NAMES.sub(lambda name: f'"{LABELS[name[0]]}"', advised(str(problem)))
    # The name of a file or a scan at the beginning is followed by a colon.
    return text[:1].upper() + text[1:] if re.match(r"[a-z]+[ ,]", text) else text


# Width of a letter of the interface's font in pixels at scale 1: that of wide lines, with a share of the margins.
LETTER = 7.3


def wrapped(context, text):
    """The lines of a text that is as wide as the region."""
    return textwrap.wrap(text, max(int(letters(context)), 20))


def letters(context):
    """How many letters the region is wide."""
    # The scale is 0 where nothing is drawn.
    return context.region.width / (LETTER * (context.preferences.system.ui_scale or 1))


def fits(context, text, share):
    """Whether a text fits into a share of the region's width."""
    return len(text) <= share * letters(context)


def duration(seconds):
    """A time for people: no more digits than an estimate has."""
    seconds = max(int(seconds + 0.5), 1)
    if seconds < 100:
        return f"{seconds} s"
    minutes = (seconds + 30) // 60
    return f"{minutes} min" if minutes < 100 else f"{minutes // 60} h {minutes % 60} min"
