# SPDX-License-Identifier: GPL-3.0-or-later
"""Colour a surface by its distance to the scans it was made from, or to any other surface."""

import bpy
import numpy as np
import surfrecon

from .. import convert, recording, usable
from ..job import JobOperator
from ..running import Refused, gathered
from ..scene import material_of_nodes, sources_of
from ..words import length

ATTRIBUTE, FIGURES, COLOURS = "error", "surfrecon_error", "error_colour"
# Views that the error map has switched from the solid view, which shows no materials.
SWITCHED = set()
MAP_NODE, RAMP_NODE = "Error range", "Error colours"

# Position along the scale and sRGB colour: calm where the distance is small.
RAMP = (
    (0.0, (0.16, 0.33, 0.60)),
    (0.3, (0.20, 0.65, 0.66)),
    (0.55, (0.95, 0.90, 0.45)),
    (0.8, (0.93, 0.45, 0.20)),
    (1.0, (0.65, 0.06, 0.12)),
)


class SURFRECON_OT_error_map(JobOperator, bpy.types.Operator):
    """Colour the active surface by its distance to the other selected objects, or to its sources"""

    bl_idname = "surfrecon.error_map"
    bl_label = "Error Map"
    bl_options = {"REGISTER", "UNDO"}

    limit: bpy.props.FloatProperty(
        name="Full scale",
        description="Distance of the last colour. 0: a round number above 95 % of the distances",
        subtype="DISTANCE",
        unit="LENGTH",
        precision=5,
        min=0,
        # Another surface has other distances.
        options={"SKIP_SAVE"},
    )

    @classmethod
    def poll(cls, context):
        """There must be a surface."""
        if not super().poll(context):
            return False
        if context.object is None or context.object.type != "MESH":
            cls.poll_message_set("Make a mesh the active object")
            return False
        return True

    def launch(self, context):
        """Gathers the vertices and what they are measured against."""
        measured = usable.active(context)
        usable.writable(measured)
        references = [obj for obj in context.selected_objects if obj is not measured]
        if not references:
            references = sources_of(measured)
        if not references:
            raise Refused(f'Select the scans that "{measured.name}" is to be compared with as well')
        self.measured = measured.name
        (points,) = yield from gathered(context, [measured], self.points_of)
        scans = yield from gathered(context, references, recording.scan_or_frames)
        return surfrecon.Job.distances(points, recording.of_all(scans))

    def points_of(self, measured, depsgraph):
        """The vertices of an object in the world."""
        points = convert.seen_positions(measured, depsgraph)
        if points is None:
            # The distances are stored in the object's own vertices.
            self.report({"WARNING"}, f'"{measured.name}" is measured without its modifiers, which make other vertices')
            points = convert.positions(measured.data)
        usable.refuse_not_finite(measured, points)
        matrix = np.array(measured.matrix_world)
        return points @ matrix[:3, :3].T + matrix[:3, 3]

    def finish(self, context, distances):
        """Stores the distances and shows them."""
        measured = bpy.data.objects.get(self.measured)
        if measured is None or len(measured.data.vertices) != len(distances):
            raise Refused(f'"{self.measured}" was changed meanwhile: try again')
        limit = self.limit or scale_of(distances)
        map_onto(measured, distances, limit)
        show_materials(context)
        figures = measured[FIGURES]
        rms, most = (length(context, figures[name]) for name in ("rms", "max"))
        self.report({"INFO"}, f'"{measured.name}": RMS distance {rms}, largest {most}')


def scale_of(distances):
    """The distance of the last colour."""
    return round_up(np.quantile(distances, 0.95)) if len(distances) else 1.0


def map_onto(obj, distances, limit):
    """Stores the distances of the vertices, with their figures, and gives the object a material that shows them."""
    convert.store(obj.data, ATTRIBUTE, distances.astype(np.float32))
    obj[FIGURES] = {
        "mean": float(np.mean(distances)),
        "rms": float(np.sqrt(np.mean(distances**2))),
        "p95": float(np.quantile(distances, 0.95)),
        "max": float(np.max(distances)),
        "limit": float(limit),
    }
    show(obj, limit)


def show_materials(context):
    """Lets views that show no materials do so."""
    for area in context.screen.areas if context.screen else ():
        if area.type == "VIEW_3D" and area.spaces.active.shading.type == "SOLID":
            if context.scene.render.engine == "BLENDER_WORKBENCH":  # which has no view of materials
                area.spaces.active.shading.color_type = "VERTEX"
            else:
                area.spaces.active.shading.type = "MATERIAL"
                SWITCHED.add(area.as_pointer())


def round_up(value):
    """The next of 1, 2, 5, 10, 20 ... in any power of ten; 1 for 0."""
    if not value > 0:
        return 1.0
    power = 10.0 ** np.floor(np.log10(value))
    return float(next(step * power for step in (1, 2, 5, 10) if step * power >= value * (1 - 1e-9)))


def show(obj, limit):
    """Gives the object a material that shows the attribute; its mesh keeps its own materials, see `hide`."""
    if not obj.material_slots:
        obj.data.materials.append(None)
    material = next((slot.material for slot in obj.material_slots if shows_error(slot.material)), None)
    if material is None:
        material = error_material(f"{obj.name} error")
    for slot in obj.material_slots:
        slot.link = "OBJECT"
        slot.material = material
    material.node_tree.nodes[MAP_NODE].inputs["From Max"].default_value = limit
    # For the solid view with the shading colour "Attribute".
    if ATTRIBUTE in obj.data.attributes:
        obj.data.attributes.active = obj.data.attributes[ATTRIBUTE]
        paint(obj.data, limit)


def shows_error(material):
    """Whether it is a material that `show` made."""
    return material is not None and material.node_tree is not None and MAP_NODE in material.node_tree.nodes


def hide(obj):
    """Gives the object back the materials of its mesh."""
    for slot in obj.material_slots:
        if slot.link == "OBJECT" and shows_error(slot.material):
            slot.material = None
            slot.link = "DATA"


def paint(mesh, limit):
    """Stores the error as colours too: Workbench shows no other attributes."""
    layer = mesh.attributes[ATTRIBUTE]
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


def face_starts(mesh):
    """The first corner of each face."""
    starts = np.empty(len(mesh.polygons), np.int32)
    mesh.polygons.foreach_get("loop_start", starts)
    return starts


def error_material(name):
    """A material that colours by the attribute `error`."""
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
    shader = nodes["Principled BSDF"]
    shader.inputs["Roughness"].default_value = 0.6
    for k, node in enumerate((attribute, scale, ramp)):
        node.location = (-900 + 250 * k, 300)
    links.new(attribute.outputs["Fac"], scale.inputs["Value"])
    links.new(scale.outputs["Result"], ramp.inputs["Fac"])
    links.new(ramp.outputs["Color"], shader.inputs["Base Color"])
    return material


def linear(x):
    """Linear light of an sRGB channel."""
    return x / 12.92 if x <= 0.04045 else ((x + 0.055) / 1.055) ** 2.4
