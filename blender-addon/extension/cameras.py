# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's cameras as virtual scanners, and cameras of recordings as Blender's: the same view, pixel for pixel."""

import math

import bpy
import numpy as np
import surfrecon
from mathutils import Matrix

from . import convert
from .running import Refused

# Pixels of one image; more are a slip of the render settings.
MOST_PIXELS = 2**28


def resolution(scene, percent=100.0):
    """Rows and columns of the scene's pictures."""
    render = scene.render
    share = render.resolution_percentage / 100 * percent / 100
    rows, columns = (max(int(n * share), 1) for n in (render.resolution_y, render.resolution_x))
    if rows * columns > MOST_PIXELS:
        raise Refused(f"{rows:,} x {columns:,} pixels are too many: lower the resolution in the output properties")
    if rows < 2 or columns < 2:
        raise Refused("A scan needs at least 2 x 2 pixels: raise the resolution, here or in the output properties")
    return rows, columns


def scanner(camera, scene, depsgraph, rows, columns):
    """The `surfrecon.Camera` that sees what Blender renders through a camera object, with so many pixels.

    Perspective with its shift, orthographic, and panoramic, which becomes a scanner that sees all around about the
    camera's vertical. The camera's own scale does not count, as in Blender.
    """
    place, turn, _ = camera.evaluated_get(depsgraph).matrix_world.decompose()
    pose = Matrix.LocRotScale(place, turn, None)
    if not np.isfinite(np.array(pose)).all():
        raise Refused(f'The camera "{camera.name}" has a location or rotation that is no number: check it in N, Item')
    data = camera.evaluated_get(depsgraph).data
    right, up, back = (pose.to_3x3().col[k] for k in range(3))
    if data.type == "PANO":
        lowest = math.pi * (0.5 - 0.5 / rows)
        return surfrecon.Camera.spherical(rows, columns, lowest=-lowest, highest=lowest, eye=tuple(place), up=tuple(up))
    render = scene.render
    seen = np.array(
        camera.calc_matrix_camera(
            depsgraph, x=columns, y=rows, scale_x=render.pixel_aspect_x, scale_y=render.pixel_aspect_y
        )
    )
    across, down = seen[0, 0] * columns / 2, seen[1, 1] * rows / 2
    if data.type == "ORTHO":
        if abs(across - down) > 1e-4 * down:
            raise Refused("Orthographic scans need square pixels: set both aspects in the output properties to 1")
        middle = place - right * (seen[0, 3] / seen[0, 0]) - up * (seen[1, 3] / seen[1, 1])
        return surfrecon.Camera.orthographic(
            rows, columns, spacing=1 / down, target=tuple(middle), toward=tuple(-back), up=tuple(up)
        )
    # The sensor has y down and looks along +z; whole numbers are the centres of pixels.
    world_from_sensor = np.array(pose, np.float64) @ np.diag([1.0, -1.0, -1.0, 1.0])
    return surfrecon.Camera.intrinsic(
        rows,
        columns,
        focal=(across, down),
        centre=(columns / 2 * (1 - seen[0, 2]) - 0.5, rows / 2 * (1 + seen[1, 2]) - 0.5),
        world_from_sensor=convert.rigid(world_from_sensor),
    )


# Width of the film in mm, Blender's own default: what the focal length is said for.
FILM = 36.0

# From a sensor with y down that looks along z to Blender's cameras, with y up, that look along -z.
TURNED = np.diag([1.0, -1.0, -1.0, 1.0])


def of_frame(camera, scan, scan_pose, scale):
    """A camera object that sees what a frame's `surfrecon.Camera` saw, as a child of the scan's object.

    It is linked nowhere yet. The frame lies at `scan_pose` in the files, a unit of which is `scale` units of the scene.
    Pixels that are not square are a matter of the scene, not of a camera: height follows from width.
    """
    data = bpy.data.cameras.new(f"{scan.name} camera")
    rows, columns = camera.rows, camera.cols
    (across, down), (x, y) = camera.projection["focal"], camera.projection["centre"]
    data.sensor_fit, data.sensor_width, data.sensor_height = "HORIZONTAL", FILM, FILM * rows / columns
    data.lens = abs(across) * FILM / columns
    # Shares of the width; whole numbers are the centres of pixels. A negative length has the picture mirrored.
    data.shift_x = math.copysign(1, across) * ((columns - 1) / 2 - x) / columns
    data.shift_y = math.copysign(1, down) * (y - (rows - 1) / 2) / columns
    depths = convert.positions(scan.data)[:, 2]
    nearest = float(depths.min())
    data.clip_start, data.clip_end, data.display_size = nearest / 2, 2 * float(depths.max()), nearest / 4
    made = bpy.data.objects.new(data.name, data)
    made.parent = scan
    local = np.linalg.inv(scan_pose) @ np.array(camera.world_from_sensor) @ TURNED
    local[:3, 3] *= scale
    made.matrix_basis = Matrix(local.tolist())
    return made


def take_picture_size(scene, made, camera):
    """Makes a camera that of a scene that has none, with pictures of its size: its view is what was recorded."""
    if scene.camera is None:
        scene.camera = made
        scene.render.resolution_x, scene.render.resolution_y = camera.cols, camera.rows
