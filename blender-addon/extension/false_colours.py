# SPDX-License-Identifier: GPL-3.0-or-later
"""False colours: distances or faults that a surface shows in colours. They are put on for looking, and taken off
without a trace.

The colours have a name of their own, which nothing reads as a surface's colour. What the mesh was before is noted with
it, as long as it shows them.
"""

import bpy
import numpy as np

from . import convert
from .scene import material_of_nodes, views_of

ATTRIBUTE, FIGURES, COLOURS = "error", "surfrecon_error", convert.FALSE_COLOURS
MAP_NODE, RAMP_NODE = "Error range", "Error colours"

# Attribute of faces that check for printing has found faults at, as places on the scale below; thickness of walls.
FAULT, WALL = "print_fault", "wall"
# Custom property of an object that was checked for printing.
PRINTED = "surfrecon_check_print"
OVERHANG, THIN, CROSSING = 0.55, 0.8, 1.0

# Views that were switched to show them: how, and what they were.
SWITCHED = {}

# Custom property of a mesh that shows them: what it was before.
BEFORE = "surfrecon_before_error"

# Custom property of an object that shows them: materials of its own, which its mesh does not have, by their slots.
OWN = "surfrecon_own_materials"

# Files of 0.1 don't say what it was.
BEFORE_OF_0_1 = {"active": "colour", "rendered": "colour", "measured": True, "bare": False}

# Position along the scale and sRGB colour: calm where the distance is small.
RAMP = (
    (0.0, (0.16, 0.33, 0.60)),
    (0.3, (0.20, 0.65, 0.66)),
    (0.55, (0.95, 0.90, 0.45)),
    (0.8, (0.93, 0.45, 0.20)),
    (1.0, (0.65, 0.06, 0.12)),
)


# Onto a mesh and off again


def store_distances(mesh, distances):
    """Stores a distance a vertex as an attribute, which goes again with the colours unless there was one before."""
    remember(mesh)
    convert.store(mesh, ATTRIBUTE, distances.astype(np.float32))


def store_faults(mesh, faults):
    """Stores a fault a face as an attribute, which goes again with the colours."""
    remember(mesh)
    convert.store(mesh, FAULT, faults, "FACE")


def show(obj, limit, material=None, attribute=ATTRIBUTE):
    """Gives the object a material that shows the attribute, or one that shows something already. Its mesh keeps its own
    materials, see `hide`.
    """
    remember(obj.data)
    is_given = material is not None
    if not obj.material_slots:
        obj.data.materials.append(None)
    material = material or next((slot.material for slot in obj.material_slots if shows_error(slot.material)), None)
    if material is None:
        material = error_material(f"{obj.name} error")
        # Materials of the object itself; `None` is nothing that a custom property can hold.
        own = {str(k): slot.material for k, slot in enumerate(obj.material_slots) if slot.link == "OBJECT"}
        obj[OWN] = {k: one for k, one in own.items() if one is not None}
    for slot in obj.material_slots:
        slot.link = "OBJECT"
        slot.material = material
    if not is_given:
        attribute_node(material).attribute_name = attribute
    material.node_tree.nodes[MAP_NODE].inputs["From Max"].default_value = limit
    attribute = attribute_node(material).attribute_name
    if attribute in obj.data.attributes:
        paint(obj.data, limit, attribute)


def hide(obj):
    """Gives the object back the materials of its mesh, and its mesh what it was."""
    worn = {slot.material for slot in obj.material_slots if shows_error(slot.material)}
    wear_own(obj)
    for material in worn:
        if material.users == 0:
            bpy.data.materials.remove(material)
    for name in (OWN, FIGURES):
        if name in obj:
            del obj[name]
    for mesh in {obj.data, *(level.mesh for level in obj.surfrecon_levels if level.mesh is not None)}:
        # Objects may share a mesh.
        if not any(other.data == mesh and is_shown(other) for other in bpy.data.objects):
            restore(mesh)


def wear_own(obj):
    """Shows the object in its own materials and those of its mesh."""
    own = obj[OWN].to_dict() if OWN in obj else {}
    for k, slot in enumerate(obj.material_slots):
        if slot.link == "OBJECT" and shows_error(slot.material):
            slot.material = own.get(str(k))
            slot.link = "OBJECT" if slot.material is not None else "DATA"


def undress(obj):
    """Shows the object as it really looks. It returns what `show` takes to show its false colours again."""
    shown = limit_of(obj), next(slot.material for slot in obj.material_slots if shows_error(slot.material))
    wear_own(obj)
    if COLOURS in obj.data.attributes:
        obj.data.attributes.remove(obj.data.attributes[COLOURS])
    real_ones_active(obj.data, obj.data[BEFORE].to_dict() if BEFORE in obj.data else BEFORE_OF_0_1)
    return shown


def is_shown(obj):
    """Whether an object shows false colours."""
    return any(shows_error(slot.material) for slot in obj.material_slots)


def shows_error(material):
    """Whether it is a material that `show` made."""
    return material is not None and material.node_tree is not None and MAP_NODE in material.node_tree.nodes


def attribute_node(material):
    """The node of such a material that reads the attribute."""
    return next(node for node in material.node_tree.nodes if node.bl_idname == "ShaderNodeAttribute")


def shows_faults(obj):
    """Whether an object shows faults for printing."""
    worn = (slot.material for slot in obj.material_slots)
    return any(shows_error(one) and attribute_node(one).attribute_name == FAULT for one in worn)


def limit_of(obj):
    """The distance of the last colour that an object shows."""
    material = next(slot.material for slot in obj.material_slots if shows_error(slot.material))
    return material.node_tree.nodes[MAP_NODE].inputs["From Max"].default_value


def remember(mesh):
    """Notes what a mesh is, unless it shows false colours already."""
    if BEFORE in mesh:
        return
    colours = mesh.color_attributes
    rendered = colours.render_color_index
    mesh[BEFORE] = {
        "active": colours.active_color_name or "",
        "rendered": colours[rendered].name if 0 <= rendered < len(colours) else "",
        "measured": ATTRIBUTE in mesh.attributes,
        "bare": len(mesh.materials) == 0,
    }


def restore(mesh):
    """Makes a mesh what it was."""
    before = mesh[BEFORE].to_dict() if BEFORE in mesh else BEFORE_OF_0_1
    for name in (COLOURS, FAULT) if before["measured"] else (COLOURS, FAULT, ATTRIBUTE):
        if name in mesh.attributes:
            mesh.attributes.remove(mesh.attributes[name])
    if before["bare"] and not any(mesh.materials):
        mesh.materials.clear()
    real_ones_active(mesh, before)
    if BEFORE in mesh:
        del mesh[BEFORE]


def real_ones_active(mesh, before):
    """Makes the colours active that were so before."""
    colours = mesh.color_attributes
    if before["active"] in colours:
        colours.active_color = colours[before["active"]]
    elif colours.active_color_name not in colours:
        # Blender 5.2 keeps the name of colours that are gone.
        colours.active_color_name = ""
    if before["rendered"] in colours:
        colours.render_color_index = colours.find(before["rendered"])


def grow(objects, scale):
    """Scales distances and figures of objects that are scaled. It scales the distances of a mesh once, even if several
    objects share it.
    """
    for obj in objects:
        if FIGURES in obj:
            obj[FIGURES] = {name: value * scale for name, value in obj[FIGURES].to_dict().items()}
    for material in {slot.material for obj in objects for slot in obj.material_slots if shows_error(slot.material)}:
        if attribute_node(material).attribute_name != FAULT:
            material.node_tree.nodes[MAP_NODE].inputs["From Max"].default_value *= scale
    lengths = {(obj.data, ATTRIBUTE) for obj in objects if obj.type == "MESH"}
    lengths |= {(obj.data, WALL) for obj in objects if PRINTED in obj}
    for mesh, name in lengths:
        layer = mesh.attributes.get(name)
        if layer is not None and layer.data_type == "FLOAT":
            values = np.empty(len(layer.data), np.float32)
            layer.data.foreach_get("value", values)
            layer.data.foreach_set("value", values * np.float32(scale))


# Their looks


def paint(mesh, limit, attribute):
    """Stores an attribute as colours too: Workbench shows no other attributes."""
    layer = mesh.attributes[attribute]
    values = np.empty(len(layer.data), np.float32)
    layer.data.foreach_get("value", values)
    share = np.clip(np.abs(np.nan_to_num(values, nan=limit)) / max(limit, 1e-30), 0, 1)
    places = [place for place, _ in RAMP]
    colours = np.ones((len(values), 4), np.float32)
    for k in range(3):
        colours[:, k] = np.interp(share, places, [linear(colour[k]) for _, colour in RAMP])
    if layer.domain == "FACE":
        # Blender has colours of vertices and corners only.
        colours = np.repeat(colours, np.diff(np.append(face_starts(mesh), len(mesh.loops))), axis=0)
    older = mesh.attributes.get(COLOURS)
    if older is not None:
        mesh.attributes.remove(older)
    domain = "CORNER" if layer.domain == "FACE" else "POINT"
    made = mesh.color_attributes.new(COLOURS, "FLOAT_COLOR", domain)
    made.data.foreach_set("color", colours.reshape(-1))
    mesh.color_attributes.active_color = mesh.color_attributes[COLOURS]
    # They are seen, and others stay those that are rendered.
    rendered = mesh.color_attributes.find(mesh[BEFORE]["rendered"])
    if rendered >= 0:
        mesh.color_attributes.render_color_index = rendered


def face_starts(mesh):
    """The first corner of each face."""
    starts = np.empty(len(mesh.polygons), np.int32)
    mesh.polygons.foreach_get("loop_start", starts)
    return starts


def error_material(name):
    """A material that colours by the attribute `error`, until `show` says another."""
    material = material_of_nodes(name)
    nodes, links = material.node_tree.nodes, material.node_tree.links
    attribute = nodes.new("ShaderNodeAttribute")
    attribute.attribute_name = ATTRIBUTE
    scale = nodes.new("ShaderNodeMapRange")
    scale.name = scale.label = MAP_NODE
    ramp = nodes.new("ShaderNodeValToRGB")
    ramp.name = ramp.label = RAMP_NODE
    elements = ramp.color_ramp.elements
    while len(elements) < len(RAMP):
        elements.new(1)
    for element, (position, colour) in zip(elements, RAMP, strict=True):
        element.position = position
        element.color = (*(linear(x) for x in colour), 1)
    # Unlit: light would change the colours of the legend.
    nodes.remove(nodes["Principled BSDF"])
    shader = nodes.new("ShaderNodeEmission")
    shader.location = (10, 300)
    links.new(shader.outputs["Emission"], nodes["Material Output"].inputs["Surface"])
    for k, node in enumerate((attribute, scale, ramp)):
        node.location = (-900 + 250 * k, 300)
    links.new(attribute.outputs["Fac"], scale.inputs["Value"])
    links.new(scale.outputs["Result"], ramp.inputs["Fac"])
    links.new(ramp.outputs["Color"], shader.inputs["Color"])
    return material


def linear(x):
    """Linear light of an sRGB channel."""
    return x / 12.92 if x <= 0.04045 else ((x + 0.055) / 1.055) ** 2.4


# Views


def show_materials(context):
    """Lets solid views show false colours, unlit: as they are in the legend, and at once, since nothing is compiled."""
    for area in views_of(context):
        shading = area.spaces.active.shading
        if shading.type == "SOLID":
            wanted = {"color_type": "VERTEX", "light": "FLAT"}
            SWITCHED.setdefault(area.as_pointer(), (wanted, {name: getattr(shading, name) for name in wanted}))
            for name, value in wanted.items():
                setattr(shading, name, value)


def show_as_before(context):
    """Puts views back that `show_materials` has switched, unless the user has switched them again since."""
    for area in views_of(context):
        if area.as_pointer() in SWITCHED:
            wanted, before = SWITCHED.pop(area.as_pointer())
            shading = area.spaces.active.shading
            if shading.type == "SOLID" and all(getattr(shading, name) == value for name, value in wanted.items()):
                for name, value in before.items():
                    setattr(shading, name, value)
