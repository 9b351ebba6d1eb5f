# SPDX-License-Identifier: GPL-3.0-or-later
"""Work of an operator that it needs again when it is adjusted: sculptors, tetrahedra, chains of levels.

One thing is kept at most, for as long as its operator is the last one: it goes when another operator runs, when another
file is read, and a few seconds after the panel of the last operation is no longer the operator's.
"""

import hashlib

import bpy
import numpy as np

LOOK_SECONDS = 10.0


def look_later(look, seconds):
    """Calls `look` from time to time, in a window: it returns when to look again, or `None`."""
    if not bpy.app.background and not bpy.app.timers.is_registered(look):
        bpy.app.timers.register(look, first_interval=seconds, persistent=True)


def listeners(kept, look):
    """A module's functions to register and unregister: `kept` forgets when another file is read, and at the end."""

    @bpy.app.handlers.persistent
    def forget(*_):
        kept.forget()

    def register():
        bpy.app.handlers.load_pre.append(forget)

    def unregister():
        bpy.app.handlers.load_pre.remove(forget)
        if bpy.app.timers.is_registered(look):
            bpy.app.timers.unregister(look)
        kept.forget()

    return register, unregister


class Kept:
    """The one thing, its key and the operator it belongs to."""

    owner = key = value = None

    @classmethod
    def get(cls, owner, key, make):
        """The thing kept under that key by the operator, else what `make()` returns, kept from now on."""
        found = cls.find(owner, key)
        return cls.keep(owner, key, make()) if found is None else found

    @classmethod
    def find(cls, owner, key):
        """The thing kept under that key by the operator, else `None`, and nothing is kept any more."""
        if (owner, key) != (cls.owner, cls.key):
            cls.forget()
        return cls.value

    @classmethod
    def keep(cls, owner, key, value):
        """Keeps a thing, and returns it."""
        cls.owner, cls.key, cls.value = owner, key, value
        look_later(look, LOOK_SECONDS)
        return value

    @classmethod
    def only_of(cls, owner):
        """Forgets what belongs to another operator."""
        if cls.owner != owner:
            cls.forget()

    @classmethod
    def forget(cls):
        """Gives its memory back."""
        cls.owner = cls.key = cls.value = None


def fingerprint(*arrays):
    """A key for the contents of arrays, or of `None`."""
    content = hashlib.sha256()
    for values in arrays:
        content.update(b"-" if values is None else np.ascontiguousarray(values).tobytes())
    return content.digest()


def look():
    """Forgets what can't be adjusted any more. As a timer, it returns when to look again."""
    operators = bpy.context.window_manager.operators
    if Kept.owner is not None and (not operators or operators[-1].bl_idname != Kept.owner):
        Kept.forget()
    return None if Kept.owner is None else LOOK_SECONDS


register, unregister = listeners(Kept, look)
