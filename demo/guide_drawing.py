"""Drawing the pictures of the guides: objects of scans and surfaces, views of them, captions."""

import sys

import bpy
import numpy as np
from mathutils import Matrix, Vector
from stage import bounds, material, scan_colour, with_nodes

MODULE = "bl_ext.user_default.surfrecon"
CLAY, INK = (0.50, 0.43, 0.36), (0.02, 0.025, 0.03)
SAMPLES = 12
# Of points drawn as dots.
MOST = 60_000


def made(name, positions, triangles, colours=None, colour=CLAY):
    """An object of triangles, in one colour or in those of its vertices (linear light, 0 to 1)."""
    mesh = bpy.data.meshes.new(name)
    mesh.vertices.add(len(positions))
    mesh.vertices.foreach_set("co", np.asarray(positions, np.float32).ravel())
    mesh.loops.add(3 * len(triangles))
    mesh.loops.foreach_set("vertex_index", np.asarray(triangles, np.int32).ravel())
    mesh.polygons.add(len(triangles))
    mesh.polygons.foreach_set("loop_start", np.arange(0, 3 * len(triangles), 3, dtype=np.int32))
    mesh.update()
    if colours is not None:
        rgba = np.ones((len(positions), 4), np.float32)
        rgba[:, :3] = colours
        mesh.attributes.new("shown", "FLOAT_COLOR", "POINT").data.foreach_set("color", rgba.ravel())
    mesh.materials.append(material(name, colour if colours is None else "shown", 0.7))
    obj = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(obj)
    return obj


def linear(srgb):
    """Linear light of 8-bit colours."""
    share = np.asarray(srgb, float)[:, :3] / 255
    return np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)


def surface(mesh, colour=CLAY, coloured=False):
    """A mesh of the package."""
    colours = linear(mesh.vertex_attributes["colour"]) if coloured else None
    return made("Surface", mesh.positions, mesh.triangles, colours, colour)


def wires(mesh, thickness):
    """The edges of a mesh as thin beams."""
    obj = made("Wires", mesh.positions, mesh.triangles, colour=INK)
    beams = obj.modifiers.new("Wires", "WIREFRAME")
    beams.thickness, beams.use_replace, beams.use_boundary, beams.offset = thickness, True, True, 0.5
    # Even offsets would make spikes of needles.
    beams.use_even_offset = False
    return obj


def dots(parts, radius, most=MOST):
    """Points as small octahedra; `parts` are (points, colour) pairs."""
    skip = max(1, sum(len(points) for points, _ in parts) // most)
    points = np.vstack([points[::skip] for points, _ in parts])
    colours = np.vstack([np.broadcast_to(colour, (len(points[::skip]), 3)) for points, colour in parts])
    shape = radius * np.array([(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)])
    faces = np.array([(0, 2, 4), (2, 1, 4), (1, 3, 4), (3, 0, 4), (2, 0, 5), (1, 2, 5), (3, 1, 5), (0, 3, 5)])
    triangles = (faces[None] + 6 * np.arange(len(points))[:, None, None]).reshape(-1, 3)
    return made("Dots", (points[:, None] + shape).reshape(-1, 3), triangles, np.repeat(colours, 6, axis=0))


def apart(k, _count):
    """A colour for the k-th scan, unlike those of the scans beside it."""
    return scan_colour(k)


def samples(images, colour=apart):
    """The samples of images in the world, each image in its own colour."""
    return [(image.world_points()[image.valid], colour(k, len(images))) for k, image in enumerate(images)]


def cameras(poses, size, colour=apart):
    """A small pyramid where each camera stood."""
    shape = size * np.array([(0, 0, 0), (-0.7, -0.5, 1), (0.7, -0.5, 1), (0.7, 0.5, 1), (-0.7, 0.5, 1)])
    faces = np.array([(0, 1, 2), (0, 2, 3), (0, 3, 4), (0, 4, 1)])
    places = np.vstack([shape @ pose[:3, :3].T + pose[:3, 3] for pose in poses])
    colours = np.vstack([np.broadcast_to(colour(k, len(poses)), (5, 3)) for k in range(len(poses))])
    return made("Cameras", places, (faces[None] + 5 * np.arange(len(poses))[:, None, None]).reshape(-1, 3), colours)


def shaded(image, width):
    """The pixels of a range image as a picture of some width: how its samples face the sensor; paper where none is."""
    points = np.asarray(image.points, float)
    across, down = np.gradient(points, axis=1), np.gradient(points, axis=0)
    normals = np.cross(across, down)
    with np.errstate(invalid="ignore"):
        normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    light = 0.25 + 0.75 * np.abs(normals @ np.array((0.35, 0.35, 0.87)))
    pixels = np.where(np.isfinite(light)[..., None], light[..., None] * (222, 205, 184), 252)
    return enlarged(np.nan_to_num(pixels, nan=252).astype(np.uint8), width)


def enlarged(pixels, width):
    """Each pixel several times, so that it is seen as one."""
    times = max(1, round(width / pixels.shape[1]))
    return np.repeat(np.repeat(pixels, times, axis=0), times, axis=1)


def false_colours(values, low, high, none=(252, 252, 251)):
    """Numbers in the colours of the error map."""
    ramp = sys.modules[f"{MODULE}.false_colours"].RAMP
    places, colours = [at for at, _ in ramp], np.array([colour[:3] for _, colour in ramp])
    share = np.clip((np.nan_to_num(values) - low) / (high - low), 0, 1)
    shown = np.stack([np.interp(share, places, colours[:, k]) for k in range(3)], axis=-1)
    return np.where(np.isfinite(values)[..., None], 255 * shown, none).astype(np.uint8)


class Pictures:
    """Renders panels and keeps their captions."""

    def __init__(self, out):
        self.out, self.told = out, {}
        scene = bpy.context.scene
        render, cycles = scene.render, scene.cycles
        render.engine, render.film_transparent = "CYCLES", True
        render.image_settings.file_format, render.image_settings.color_mode = "PNG", "RGBA"
        scene.view_settings.view_transform = "Standard"
        cycles.device, cycles.samples, cycles.use_denoising = "CPU", SAMPLES, True
        cycles.denoiser, cycles.denoising_quality = "OPENIMAGEDENOISE", "BALANCED"
        cycles.max_bounces, cycles.diffuse_bounces, cycles.glossy_bounces = 3, 2, 1
        world = with_nodes(bpy.data.worlds.new("Guides"))
        world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.92, 0.96, 1, 1)
        world.node_tree.nodes["Background"].inputs["Strength"].default_value = 0.55
        scene.world = world

    def picture(self, name, *rows):
        """Says which panels a picture has, row by row."""
        self.told[name] = rows

    def pixels(self, name, pixels, title="", text=""):
        """A panel that is an image."""
        import made_scans

        (self.out / f"{name}.png").write_bytes(made_scans.png(np.ascontiguousarray(pixels)))
        return {"file": f"{name}.png", "title": title, "text": text}

    def view(
        self, name, objects, size, title="", text="", *, frame=None, azimuth=20, elevation=13, floor=True, room=1.06
    ):
        """A panel that shows objects, the camera set to the box around `frame` (by default all of them)."""
        scene = bpy.context.scene
        scene.render.resolution_x, scene.render.resolution_y = size
        boxes = [bounds(obj) for obj in frame or objects]
        low, high = np.min([box[0] for box in boxes], axis=0), np.max([box[1] for box in boxes], axis=0)
        extras = self._lights_and_camera(low, high, size, azimuth, elevation, floor, room)
        for obj in scene.objects:
            obj.hide_render = obj not in objects and obj not in extras
        scene.render.filepath = str(self.out / f"{name}.png")
        bpy.ops.render.render(write_still=True)
        for obj in extras:
            bpy.data.objects.remove(obj)
        print(f"  {name}", flush=True)
        return {"file": f"{name}.png", "title": title, "text": text}

    def _lights_and_camera(self, low, high, size, azimuth, elevation, floor, room):
        scene, depth = bpy.context.scene, 4 * float(np.linalg.norm(high - low))
        turn = Matrix.Rotation(np.radians(azimuth), 3, "Z") @ Matrix.Rotation(np.radians(90 - elevation), 3, "X")
        corners = np.array([(x, y, z) for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])
        seen = corners @ np.array(turn)
        centre = turn @ Vector((seen.min(axis=0) + seen.max(axis=0)) / 2)
        data = bpy.data.cameras.new("Guides")
        data.type, data.clip_end = "ORTHO", 10 * depth
        # The scale is that of the longer side of the picture.
        wide, high_ = np.ptp(seen[:, 0]), np.ptp(seen[:, 1])
        data.ortho_scale = room * max(wide, high_ * size[0] / size[1]) * max(1, size[1] / size[0])
        camera = bpy.data.objects.new("Guides", data)
        camera.matrix_world = Matrix.Translation(centre + turn @ Vector((0, 0, depth))) @ turn.to_4x4()
        made_here = [camera]
        for direction, energy, angle in (((0.55, -0.55, 0.75), 2.4, 20), ((-0.9, -0.5, 0.35), 0.6, 60)):
            light = bpy.data.lights.new("Guides", "SUN")
            light.energy, light.angle = energy, np.radians(angle)
            lamp = bpy.data.objects.new("Guides", light)
            from_there = Matrix.Rotation(np.radians(azimuth), 3, "Z") @ Vector(direction)
            lamp.rotation_euler = from_there.to_track_quat("Z", "Y").to_euler()
            made_here.append(lamp)
        if floor:
            half, z = 3 * depth, low[2] - 0.001 * depth
            corners = [(-half, -half, z), (half, -half, z), (half, half, z), (-half, half, z)]
            ground = made("Floor", np.array(corners) + (*centre[:2], 0), [(0, 1, 2), (0, 2, 3)])
            ground.is_shadow_catcher = True
            made_here.append(ground)
        for obj in made_here[: 1 + 2]:
            scene.collection.objects.link(obj)
        scene.camera = camera
        return made_here


def clear():
    """Removes what was drawn."""
    for obj in list(bpy.context.scene.objects):
        bpy.data.objects.remove(obj)
    for mesh in list(bpy.data.meshes):
        bpy.data.meshes.remove(mesh)
