# SPDX-License-Identifier: GPL-3.0-or-later
"""An operation that is adjusted in the panel of the last operation and takes too long to keep the window waiting."""

import bpy

from . import hiding
from .running import Running
from .scene import put_back, whereabouts


class Adjusting:
    """An adjusted operation that takes too long to keep the window waiting.

    Blender runs an adjusted operator after it has undone the first result, and brings that back if the operator is
    cancelled. So it is cancelled, but its job is handed to a modal operator of the same kind, and when that ends what
    it made takes the place of the first result. If the user stops it, the first result stays as it is.
    """

    # Attributes of the operator whose job goes on, and what was there before it.
    handed = before = None
    # The thing that the last such operation replaced: undoing brings it back, and adjusting again replaces it.
    replaced = None

    @classmethod
    def hand_over(cls, operator, before):
        """Lets another operator go on with the running job, once Blender is done with its own steps."""
        name, options = operator.bl_idname, operator.as_keywords()
        category, _, short = name.partition("_OT_")
        call = getattr(getattr(bpy.ops, category.lower()), short)
        cls.handed, cls.before = dict(vars(operator)), before

        def go_on():
            try:
                with in_view():
                    call("INVOKE_DEFAULT", True, **options)
            except RuntimeError:  # it can't go on in what is there now
                Running.cancel()
            finally:
                cls.handed = cls.before = None

        bpy.app.timers.register(go_on, first_interval=0.0)

    @classmethod
    def adopt(cls, operator):
        """Makes an operator the one that goes on."""
        for name, value in cls.handed.items():
            setattr(operator, name, value)
        operator.replaces = cls.before.replaced_by()


class Before:
    """The selection, its places and all that was there before an operation."""

    def __init__(self, context):
        self.selected = {obj.name: whereabouts(obj) for obj in context.selected_objects}
        self.active = context.object.name if context.object is not None else None
        self.objects, self.collections = set(bpy.data.objects.keys()), set(bpy.data.collections.keys())
        self.made = self.made_in = ()

    def replaced_by(self):
        """This, with the names of what has come since."""
        self.made = sorted(set(bpy.data.objects.keys()) - self.objects)
        self.made_in = sorted(set(bpy.data.collections.keys()) - self.collections)
        return self

    def there(self):
        """Whether what was made is in the file: the operation that replaced it was undone."""
        return all(name in bpy.data.objects for name in self.made)

    def select(self, context):
        """Selects what was selected then, where it was."""
        for obj in context.selected_objects:
            obj.select_set(False)
        for name, before in self.selected.items():
            obj = context.view_layer.objects.get(name)
            if obj is not None:
                # The result that is there has hidden or moved what it was made from.
                hiding.show(context, [obj])
                obj.select_set(True)
                put_back(obj, before)
        context.view_layer.update()
        context.view_layer.objects.active = context.view_layer.objects.get(self.active or "")

    def replace(self):
        """Removes what was made then. The new things take its names."""
        for kind, names in ((bpy.data.objects, self.made), (bpy.data.collections, self.made_in)):
            for name in names:
                old = kind.get(name)
                if old is None:
                    continue
                data = getattr(old, "data", None)
                kind.remove(old)
                label = data.name if data is not None else ""
                if data is not None and data.users == 0:
                    bpy.data.batch_remove([data])
                successor = kind.get(f"{name}.001")
                if successor is not None:
                    successor.name = name
                    if data is not None:
                        successor.data.name = label


def in_view():
    """The context of a 3D view, which timers lack."""
    manager = bpy.context.window_manager
    for window in manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                region = next(region for region in area.regions if region.type == "WINDOW")
                return bpy.context.temp_override(window=window, area=area, region=region)
    return bpy.context.temp_override(window=manager.windows[0])
