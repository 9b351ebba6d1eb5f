# SPDX-License-Identifier: GPL-3.0-or-later
"""The place where a job was begun: scene, view layer and collection, which its result goes to, whatever is shown then.
Numbers stand for them, which hold through undo and new names.
"""

import contextlib

import bpy

from .running import Refused


class Home:
    """A scene, a view layer and a collection."""

    def __init__(self, context):
        self.scene, self.layer = context.scene.session_uid, context.view_layer.name
        self.collection = None if context.collection is None else context.collection.session_uid

    def find(self):
        """The scene. It refuses a scene that is gone."""
        found = by_number(bpy.data.scenes, self.scene)
        if found is None:
            raise Refused("The scene in which this was begun was removed meanwhile: try again in another")
        return found

    def there(self, context):
        """For `with`: the context is that of the scene, the view layer and the collection."""
        scene = self.find()
        layer = scene.view_layers.get(self.layer) or scene.view_layers[0]
        collection = by_number((scene.collection, *scene.collection.children_recursive), self.collection)
        if (scene, layer, collection) == (context.scene, context.view_layer, context.collection):
            return contextlib.nullcontext()
        collection = collection or layer.active_layer_collection.collection
        members = {"scene": scene, "view_layer": layer, "collection": collection}
        if layer != context.view_layer:
            # Blender asks the window for these, which shows another scene.
            active, selected = layer.objects.active, list(layer.objects.selected)
            members |= {"object": active, "active_object": active, "selected_objects": selected}
        return context.temp_override(**members)


def by_number(found, number):
    """The one of these with a number, or `None`."""
    return next((one for one in found if one.session_uid == number), None)
