# SPDX-License-Identifier: GPL-3.0-or-later
"""Presets of operators: those that come with the extension (the folder `presets`), and the user's own, which follow an
operator to its new name.
"""

import contextlib
import os
import shutil

import bpy

from .telling import tell
from .words import number

FOLDER = os.path.dirname(__file__)

# Former identifier of an operator that has presets -> today's.
RENAMED = {"surfrecon.cluster": "surfrecon.remesh"}

# Today's identifier -> former one and number of presets that were taken over, as long as nobody was told.
news = {}


def folder_of(operator):
    """The folder in which Blender saves the user's presets of an operator."""
    return os.path.join(bpy.utils.user_resource("SCRIPTS", path="presets"), "operator", operator)


def take_over(former, operator):
    """Copies the user's presets of an operator's former name to today's name, which has no folder yet: what is deleted
    there later stays deleted.
    """
    old, new = folder_of(former), folder_of(operator)
    presets = [name for name in os.listdir(old) if name.endswith(".py")] if os.path.isdir(old) else []
    if presets and not os.path.exists(new):
        shutil.copytree(old, new)
        news[operator] = former, len(presets)


def tell_news(operator, identifier):
    """Lets an operator say, once, that it has the presets of its former name."""
    if identifier in news:
        former, count = news.pop(identifier)
        tell(operator, {"INFO"}, f"{number(count, 'preset', 'presets')} of {former} taken over")


def register():
    """Lets Blender look into the folder, and takes over presets of former names."""
    bpy.utils.register_preset_path(FOLDER)
    for former, operator in RENAMED.items():
        # A folder that can't be written is no reason to do without the extension.
        with contextlib.suppress(OSError):
            take_over(former, operator)


def unregister():
    """And no more."""
    news.clear()
    bpy.utils.unregister_preset_path(FOLDER)
