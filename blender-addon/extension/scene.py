# SPDX-License-Identifier: GPL-3.0-or-later
"""Results in the scene: collections, selection, colours by which scans are told apart."""

import colorsys
import contextlib

import bpy
import numpy as np
import surfrecon

from . import convert, hiding, surfaces
from .recording import POSES

GOLDEN = 0.618034

# The material that shows vertex colours.
COLOURS = "Scan colours"


def tint(obj, number):
    """Gives an object its own viewport colour: neighbours in number are far apart in hue."""
    obj.color = (*colorsys.hsv_to_rgb(number * GOLDEN % 1, 0.45, 0.9), 1)


def into_collection(context, name, objects, parent=None):
    """Links objects to a new collection of that name in another one or the scene's, and returns it."""
    collection = bpy.data.collections.new(name)
    (parent or context.scene.collection).children.link(collection)
    for obj in objects:
        collection.objects.link(obj)
    return collection


def link(context, obj):
    """Links an object where the user works, or to the scene's own collection if that one is hidden or linked."""
    collection = context.collection
    if (
        collection is None
        or collection.library is not None
        or not is_in(context.view_layer.layer_collection, collection)
    ):
        collection = context.scene.collection
    collection.objects.link(obj)


def is_in(layer_collection, collection):
    """Whether a view layer has a collection."""
    if layer_collection.exclude:
        return False
    return layer_collection.collection == collection or any(is_in(one, collection) for one in layer_collection.children)


# The vertex group of what was filled.
FILLED = "Filled"


def group_filled(obj):
    """Gives an object the vertex group of the corners of its filled faces, so that they are selected in edit mode."""
    mesh = obj.data
    if (fills := mesh.attributes.get("hole_fill")) is None:
        return
    filled = np.zeros(len(mesh.polygons), dtype=bool)
    fills.data.foreach_get("value", filled)
    corners = np.zeros(len(mesh.loops), dtype=np.int32)
    mesh.loops.foreach_get("vertex_index", corners)
    sides = np.zeros(len(mesh.polygons), dtype=np.int32)
    mesh.polygons.foreach_get("loop_total", sides)
    group = obj.vertex_groups.new(name=FILLED)
    group.add(np.unique(corners[np.repeat(filled, sides)]).tolist(), 1.0, "REPLACE")


# Properties by which Blender stores an object's place. Written back they give its matrix to the bit. No matrix does.
TRANSFORM = ("location", "rotation_euler", "rotation_quaternion", "rotation_axis_angle", "scale")


def whereabouts(obj):
    """The place of an object, and the frames it may stand for, for `put_back`."""
    return {name: tuple(getattr(obj, name)) for name in TRANSFORM} | {POSES: list(obj.get(POSES, ()))}


def put_back(obj, before):
    """Puts an object where it was."""
    for name in TRANSFORM:
        setattr(obj, name, before[name])
    if before[POSES]:
        obj[POSES] = before[POSES]
    elif POSES in obj:
        del obj[POSES]


def select_only(context, objects):
    """Selects these objects and nothing else. The first becomes the active one."""
    for obj in list(context.view_layer.objects.selected):
        obj.select_set(False)
    for obj in objects:
        obj.select_set(True)
    context.view_layer.objects.active = objects[0]


def put_forward(context, objects, sources):
    """Selects results, and hides what they were made from if the user likes: both lie in the same place."""
    if hiding.is_wished():
        hiding.hide(context, sources)
    into_local_views(context, objects)
    select_only(context, objects)


def views_of(context):
    """The areas of the 3D views that show the scene."""
    shown = context.screen is not None and context.window.scene == context.scene
    return [area for area in context.screen.areas if area.type == "VIEW_3D"] if shown else []


def into_local_views(context, objects):
    """Shows new objects in the views that show a few objects alone, too."""
    for area in views_of(context):
        if area.spaces.active.local_view is not None:
            for obj in objects:
                obj.local_view_set(area.spaces.active, True)


def dress(made, sources, depsgraph):
    """Gives an object the materials of the ones it was made from. Each face gets that of the nearest face there. If
    there are no materials, the object gets one that shows its colours.
    """
    sources = [obj for obj in sources if obj is not None and hasattr(obj.data, "materials")]
    materials = []
    # The error map's colours are those of the object, not of its mesh.
    for obj in sources:
        materials += [m for m in obj.data.materials if m is not None and m not in materials]
    for material in materials:
        made.data.materials.append(material)
    if len(materials) > 1 and made.type == "MESH" and len(made.data.polygons) > 0:
        number = {material.name_full: k for k, material in enumerate(materials)}
        mesh = made.data
        found = (convert.surface_with_materials(obj, depsgraph, number) for obj in sources)
        known = [one for one in found if one is not None]
        # A surface that can't be measured, since its source was broken meanwhile, keeps the first material.
        with contextlib.suppress(surfrecon.SurfreconError):
            if known:
                convert.store(mesh, "material_index", nearest(known, convert.centres(mesh, made.matrix_world)), "FACE")
    show_colours(made)


def nearest(known, centres):
    """For each centre the number that belongs to the nearest triangle of (positions, triangles, numbers)."""
    numbers = np.concatenate([numbers for _, _, numbers in known]).astype(np.int32)
    surface = surfaces.union([(positions, triangles, None) for positions, triangles, _ in known])
    return numbers[surfrecon.nearest_triangles(centres, surface)]


def show_colours(obj):
    """Gives an object without materials one that shows its vertex colours, if it has any."""
    if "colour" not in obj.data.attributes or len(obj.data.materials) > 0:
        return
    material = bpy.data.materials.get(COLOURS)
    if material is None:
        material = material_of_nodes(COLOURS)
        nodes = material.node_tree.nodes
        attribute = nodes.new("ShaderNodeAttribute")
        attribute.attribute_name = "colour"
        attribute.location = (-300, 300)
        shader = nodes["Principled BSDF"]
        shader.inputs["Roughness"].default_value = 0.8
        material.node_tree.links.new(attribute.outputs["Color"], shader.inputs["Base Color"])
    obj.data.materials.append(material)


def material_of_nodes(name):
    """A new material with a node tree."""
    material = bpy.data.materials.new(name)
    # From 5.0 on all have one, and saying so is deprecated.
    if bpy.app.version < (5, 0, 0):
        material.use_nodes = True
    return material
