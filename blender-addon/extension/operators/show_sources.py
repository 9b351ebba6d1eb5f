# SPDX-License-Identifier: GPL-3.0-or-later
"""One switch for what a result was made from: seen and rendered, or out of the way."""

import bpy

from .. import hiding
from ..sources import sources_of, what_is_gone
from ..telling import tell, told
from ..words import number


class SURFRECON_OT_show_sources(bpy.types.Operator):
    """Show what the active result was made from, in views and in renders, or hide it if it is shown"""

    bl_idname = "surfrecon.show_sources"
    bl_label = "Show Sources"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        """There must be a result whose sources are there."""
        if not meant(context):
            cls.poll_message_set(
                told("Make a result the active object whose sources are still there, or select its sources")
            )
            return False
        return True

    def execute(self, context):
        """Shows all of them, unless all are shown."""
        sources = meant(context)
        text = number(len(sources), "source", "sources")
        if are_shown(sources):
            hiding.hide(context, sources)
            tell(self, {"INFO"}, f"{text} hidden, in views and in renders")
        else:
            hiding.show(context, sources)
            tell(self, {"INFO"}, f"{text} shown, in views and in renders")
        if context.object is not None and (gone := what_is_gone(context.object)):
            tell(self, {"WARNING"}, gone)
        return {"FINISHED"}


def meant(context):
    """The sources of the active result. Without one, they are the selected sources that renders still leave out. Alt+H
    shows such sources in views alone.
    """
    sources = [] if context.object is None else sources_of(context.object)
    return sources or [obj for obj in context.selected_objects if hiding.HIDDEN in obj]


def are_shown(objects):
    """Whether all objects are seen, and none is kept from renders."""
    return all(obj.visible_get() and hiding.HIDDEN not in obj for obj in objects)
