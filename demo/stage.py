"""The studio of the demo: floor, lights, camera, and three panels that see their subjects from the same side."""

import bpy
import numpy as np
from mathutils import Matrix, Vector

# Background and floor, linear; light and neutral so that the colours of the error map stand out.
FLOOR = (0.72, 0.73, 0.74)
CLAY = (0.62, 0.55, 0.48)
# Azimuth of the camera around the vertical, 0 looking along +y, and its height above the horizon; degrees.
ELEVATION = 14
# Width of a panel: this many times the subject's largest extent seen from the camera.
ROOM = 1.22
SAMPLES = 12


def material(name, colour=None, roughness=0.55):
    """A plain material, or one that takes each object's viewport colour."""
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    shader = made.node_tree.nodes["Principled BSDF"]
    shader.inputs["Roughness"].default_value = roughness
    shader.inputs["Specular IOR Level"].default_value = 0.3
    if colour is None:
        info = made.node_tree.nodes.new("ShaderNodeObjectInfo")
        made.node_tree.links.new(info.outputs["Color"], shader.inputs["Base Color"])
    else:
        shader.inputs["Base Color"].default_value = (*colour, 1)
    return made


def bounds(objects):
    """Corners of the box around objects, in the world."""
    corners = np.array([obj.matrix_world @ Vector(c) for obj in objects for c in obj.bound_box])
    return corners.min(axis=0), corners.max(axis=0)


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
        self.width, self.height = 2 * np.abs(seen).max(axis=0)
        self.panel = ROOM * max(self.width, 0.8 * self.height)
        self.depth = 4 * float(np.linalg.norm(self.high - self.low))

    def offset(self, panel):
        """Translation that brings a subject into panel -1, 0 or 1."""
        return self.right * (panel * self.panel)

    def build(self, width, height):
        """Floor, lights, camera and render settings for a picture of that many pixels."""
        self._floor()
        for name, direction, energy, angle in (
            ("Key", (0.55, 0.55, -0.75), 2.6, 14),
            ("Fill", (-0.9, 0.5, -0.35), 0.7, 60),
            ("Rim", (-0.3, -0.9, -0.45), 1.1, 25),
        ):
            self._sun(name, direction, energy, angle)
        world = bpy.data.worlds.new("Studio")
        world.use_nodes = True
        world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.9, 0.95, 1, 1)
        world.node_tree.nodes["Background"].inputs["Strength"].default_value = 0.42
        self.scene.world = world
        self._camera(width, height)
        self._render_settings(width, height)

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
        camera.ortho_scale = 3 * self.panel * max(1, height / width)
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
        cycles.max_bounces, cycles.diffuse_bounces, cycles.glossy_bounces = 2, 2, 1
        cycles.caustics_reflective = cycles.caustics_refractive = False
        render.use_persistent_data = False
