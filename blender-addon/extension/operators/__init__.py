# SPDX-License-Identifier: GPL-3.0-or-later
"""The operators, a file each. What is in a file here is found and registered, and its translations are learned."""

import importlib
import inspect
import pkgutil

import bpy

from .. import telling, translations
from ..translations import in_our_words

MODULES = [importlib.import_module(f".{module.name}", __package__) for module in pkgutil.iter_modules(__path__)]


def _classes():
    """The classes of all files that Blender knows by an identifier. Operators come before classes that name them."""
    found = [
        item
        for module in MODULES
        for item in vars(module).values()
        if isinstance(item, type) and inspect.getmodule(item) is module and "bl_idname" in vars(item)
    ]
    return sorted(found, key=lambda item: (not issubclass(item, bpy.types.Operator), item.bl_idname))


CLASSES = tuple(_classes())


def _learn():
    """Gives the dictionaries what files say of their own operation in other languages."""
    labels = {cls.bl_label for cls in CLASSES if issubclass(cls, bpy.types.Operator)}
    for module in MODULES:
        for code, words in getattr(module, "TRANSLATIONS", {}).items():
            translations.learn(code, labels, words["names"], words["tips"])
            telling.learn(code, words["names"], words["sentences"])


_learn()


def register():
    """Registers them, and what else a file registers."""
    for cls in CLASSES:
        bpy.utils.register_class(in_our_words(cls))
    for module in MODULES:
        if hasattr(module, "register"):
            module.register()


def unregister():
    """Unregisters them."""
    for module in reversed(MODULES):
        if hasattr(module, "unregister"):
            module.unregister()
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
