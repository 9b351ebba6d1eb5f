# SPDX-License-Identifier: GPL-3.0-or-later
"""Lengths, numbers, times and errors as people read them."""

import re
import textwrap

import bpy
import surfrecon

from .advice import advised


def length(context, value):
    """A length in the scene's unit."""
    settings = context.scene.unit_settings
    if settings.system == "NONE":
        return f"{value:.4g}"
    return bpy.utils.units.to_string(settings.system, "LENGTH", value * settings.scale_length, precision=4)


def number(count, one, many):
    """How many there are of what has these names."""
    return f"{count:,} {one if count == 1 else many}"


# What parameters are called whose names in code are no words. Names of files and objects stay as they are.
TABLES = ("plane", "align", "merge", "triangulate", "sculpt", "quads", "reconstruct", "cluster")
LABELS = {p.name: p.label for table in TABLES for p in surfrecon.parameters(table) if "_" in p.name}
CODE_NAMES = re.compile(rf'(?<![\w"/.-])({"|".join(LABELS)})(?![\w"/.-])')


def sentence(problem):
    """The text of an error as people read it: the library's begin in small letters and name parameters as code does."""
    text = CODE_NAMES.sub(lambda name: f'"{LABELS[name[0]]}"', advised(str(problem)))
    # What begins with a file's or a scan's name is followed by a colon.
    return text[:1].upper() + text[1:] if re.match(r"[a-z]+[ ,]", text) else text


# Width of a letter of the interface's font in pixels at scale 1: that of wide lines, with a share of the margins.
LETTER = 7.3


def wrapped(context, text):
    """The lines of a text that is as wide as the region."""
    # The scale is 0 where nothing is drawn.
    letter = LETTER * (context.preferences.system.ui_scale or 1)
    return textwrap.wrap(text, max(int(context.region.width / letter), 20))


def duration(seconds):
    """A time for people: no more digits than an estimate has."""
    seconds = max(int(seconds + 0.5), 1)
    if seconds < 100:
        return f"{seconds} s"
    minutes = (seconds + 30) // 60
    return f"{minutes} min" if minutes < 100 else f"{minutes // 60} h {minutes % 60} min"
