"""The studio of the demo: floor, lights, camera, and three panels that see their subjects from the same side."""

import colorsys

import bpy
import numpy as np
from mathutils import Matrix, Vector

# Linear light. The floor is neutral, so that the colours of scans and errors stand out.
FLOOR = (0.56, 0.57, 0.58)
CLAY = (0.50, 0.43, 0.36)
# Height of the camera above the horizon, degrees.
ELEVATION = 13
# A panel is this much wider and higher than its subject.
ROOM = 1.25, 1.12
# Height of the picture in pixels; its width follows from the subject.
PIXELS = 800
WIDEST = 2200
SAMPLES = 8


def material(name, colour=None, roughness=0.55):
    """A plain material of a colour, or of the colour attribute of that name."""
    made = with_nodes(bpy.data.materials.new(name))
    nodes, links = made.node_tree.nodes, made.node_tree.links
    shader = nodes["Principled BSDF"]
    shader.inputs["Roughness"].default_value = roughness
    if isinstance(colour, str):
        attribute = nodes.new("ShaderNodeAttribute")
        attribute.attribute_name = colour
        links.new(attribute.outputs["Color"], shader.inputs["Base Color"])
    else:
        shader.inputs["Base Color"].default_value = (*colour, 1)
    return made


def with_nodes(made):
    """A new material or world, with its tree of nodes."""
    # From 5.0 on all have one, and saying so is deprecated.
    if bpy.app.version < (5, 0, 0):
        made.use_nodes = True
    return made


def scan_colour(k):
    """A colour for the k-th scan: hues as far apart as a golden section keeps them, of even lightness."""
    red, green, blue = colorsys.hls_to_rgb((0.58 + 0.618034 * k) % 1, 0.58, 0.48)
    return red**2.2, green**2.2, blue**2.2


def bounds(obj):
    """Lower and upper corner of the box around an object, in the world."""
    corners = np.array([obj.matrix_world @ Vector(c) for c in obj.bound_box])
    return corners.min(axis=0), corners.max(axis=0)


def compose(merged, scans, azimuth):
    """Puts scans, merged surface and error map side by side; returns width, height and panel width in pixels.

    The scans and the surface stay where they are; what the picture shows left and right of the surface are instances.
    """
    scene = bpy.context.scene
    stage = Stage(scene, *bounds(merged), azimuth)
    for k, obj in enumerate(scans):
        # In place of the one that shows the colours the scans were read with.
        obj.data.materials.clear()
        obj.data.materials.append(material(obj.name, scan_colour(k)))
    group = scans[0].users_collection[0]
    instance = bpy.data.objects.new("Scans in the picture", None)
    instance.instance_type, instance.instance_collection = "COLLECTION", group
    instance.location = stage.offset(-1)
    instance.empty_display_size = 0.01
    scene.collection.objects.link(instance)
    # The scans themselves coincide with the surface: hidden until somebody ticks their collection.
    bpy.context.view_layer.layer_collection.children[group.name].exclude = True

    errors = bpy.data.objects.new("Error map", merged.data)
    errors.location = stage.offset(1)
    scene.collection.objects.link(errors)
    # Both share the mesh, so each has its materials on the object: the map takes those that the operator left there.
    for there, here in zip(errors.material_slots, merged.material_slots, strict=True):
        there.link = here.link = "OBJECT"
        there.material = here.material
        here.material = material("Surface", "colour" if "colour" in merged.data.attributes else CLAY)
    return stage.build()


class Stage:
    """A scene for subjects within a box (its lower and upper corner)."""

    def __init__(self, scene, low, high, azimuth):
        self.scene = scene
        self.low, self.high = np.array(low), np.array(high)
        self.centre = Vector((self.low + self.high) / 2)
        turn = Matrix.Rotation(np.radians(azimuth), 3, "Z")
        tilt = np.radians(ELEVATION)
        self.toward = turn @ Vector((0, np.cos(tilt), -np.sin(tilt)))
        self.right = turn @ Vector((1, 0, 0))
        self.up = self.right.cross(self.toward)
        box = [Vector((x, y, z)) for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])]
        seen = np.array([((c - self.centre).dot(self.right), (c - self.centre).dot(self.up)) for c in box])
        width, height = 2 * np.abs(seen).max(axis=0)
        self.panel, self.height = float(ROOM[0] * width), float(ROOM[1] * height)
        self.depth = 4 * float(np.linalg.norm(self.high - self.low))

    def offset(self, panel):
        """Translation that brings a subject into panel -1, 0 or 1."""
        return self.right * (panel * self.panel)

    def build(self):
        """Floor, lights, camera and render settings; returns width, height and panel width in pixels."""
        shrink = min(1, WIDEST / (3 * self.panel / self.height * PIXELS))
        height = round(PIXELS * shrink)
        panel = round(height * self.panel / self.height)
        width = 3 * panel
        self._floor()
        for name, direction, energy, angle in (
            ("Key", (0.55, 0.55, -0.75), 2.6, 14),
            ("Fill", (-0.9, 0.5, -0.35), 0.7, 60),
            ("Rim", (-0.3, -0.9, -0.45), 1.1, 25),
        ):
            self._sun(name, direction, energy, angle)
        world = with_nodes(bpy.data.worlds.new("Studio"))
        world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.9, 0.95, 1, 1)
        world.node_tree.nodes["Background"].inputs["Strength"].default_value = 0.42
        self.scene.world = world
        self._camera(width, height)
        self._render_settings(width, height)
        return {"width": width, "height": height, "panel": panel}

    def _floor(self):
        size = 20 * self.depth
        corners = [(-size, -size, 0), (size, -size, 0), (size, size, 0), (-size, size, 0)]
        mesh = bpy.data.meshes.new("Floor")
        mesh.from_pydata(corners, [], [(0, 1, 2, 3)])
        mesh.materials.append(material("Floor", FLOOR, 0.9))
        floor = bpy.data.objects.new("Floor", mesh)
        floor.location = (*self.centre[:2], self.low[2])
        floor.hide_select = True
        self.scene.collection.objects.link(floor)

    def _sun(self, name, direction, energy, angle):
        light = bpy.data.lights.new(name, "SUN")
        light.energy, light.angle = energy, np.radians(angle)
        lamp = bpy.data.objects.new(name, light)
        x, y, z = direction
        along = self.right * x + self.right.cross(Vector((0, 0, 1))) * -y + Vector((0, 0, z))
        lamp.rotation_euler = along.to_track_quat("-Z", "Y").to_euler()
        lamp.location = self.centre - along * self.depth
        self.scene.collection.objects.link(lamp)

    def _camera(self, width, height):
        camera = bpy.data.cameras.new("Camera")
        camera.type = "ORTHO"
        # The longer side of the picture.
        camera.ortho_scale = max(3 * self.panel, self.height)
        camera.clip_end = 10 * self.depth
        eye = bpy.data.objects.new("Camera", camera)
        axes = Matrix((self.right, self.up, -self.toward)).transposed().to_4x4()
        eye.matrix_world = Matrix.Translation(self.centre - self.toward * self.depth) @ axes
        self.scene.collection.objects.link(eye)
        self.scene.camera = eye

    def _render_settings(self, width, height):
        render = self.scene.render
        render.engine = "CYCLES"
        render.resolution_x, render.resolution_y, render.resolution_percentage = width, height, 100
        render.image_settings.file_format = "PNG"
        self.scene.view_settings.view_transform = "Standard"
        cycles = self.scene.cycles
        cycles.device = "CPU"
        cycles.samples = SAMPLES
        cycles.use_denoising = True
        cycles.denoiser = "OPENIMAGEDENOISE"
        # The careful settings double the time of the whole picture and change little.
        cycles.denoising_quality, cycles.denoising_prefilter = "BALANCED", "FAST"
        cycles.max_bounces, cycles.diffuse_bounces, cycles.glossy_bounces = 2, 2, 1
        cycles.caustics_reflective = cycles.caustics_refractive = False
        render.use_persistent_data = False
