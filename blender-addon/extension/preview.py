# SPDX-License-Identifier: GPL-3.0-or-later
"""A rough picture of the result, drawn into the 3D views while the full job takes its time.

It is drawn, not added: nothing of the scene, the file or the undo steps knows of it.
"""

import bpy
import numpy as np
import surfrecon

# A user who waits longer than this gets a preview.
PATIENCE_SECONDS = 1.0

# Pixels of an image, and cells along a surface, that a preview is made of.
PIXELS, CELLS = 20_000, 64

COLOUR = np.array((0.55, 0.65, 0.80), np.float32)


class Preview:
    """The one preview there is."""

    owner = None
    job = None
    handle = None


def step(operator, context, running):
    """Starts the preview of an operator's job once that has taken a second and will take another, and draws it."""
    if Preview.owner is not operator:
        left = running.seconds_left()
        if bpy.app.background or running.seconds() < PATIENCE_SECONDS or (left is not None and left < PATIENCE_SECONDS):
            return
        Preview.owner = operator
        try:
            Preview.job = operator.preview(context)
        except (RuntimeError, ValueError, surfrecon.SurfreconError):
            Preview.job = None  # the full job will say what is wrong
        return
    if Preview.job is None or not Preview.job.done():
        return
    job, Preview.job = Preview.job, None
    try:
        mesh, matrix = operator.preview_mesh(job.result())
    except surfrecon.SurfreconError:
        return
    show(mesh.positions @ matrix[:3, :3].T + matrix[:3, 3], mesh.triangles, operator.home.scene)
    redraw_views()


def thinned(image):
    """A range image of fewer pixels."""
    points, projection = image.points, image.projection
    step = max(int(np.ceil(np.sqrt(points.shape[0] * points.shape[1] / PIXELS))), 1)
    seen = {"points": projection.get("viewing"), "orthographic": ("parallel", (0.0, 0.0, -1.0))}
    viewing = seen.get(projection["kind"], ("from", (0.0, 0.0, 0.0)))
    return surfrecon.RangeImage.from_points(points[::step, ::step], viewing=viewing)


def coarse(positions, triangles):
    """Positions and triangles of a surface whose vertices are moved to the middles of large cells."""
    low = positions.min(axis=0)
    cell = max(np.ptp(positions, axis=0).max() / CELLS, 1e-300)
    place = np.minimum((positions - low) / cell, CELLS).astype(np.int64)
    number = (place[:, 0] * (CELLS + 1) + place[:, 1]) * (CELLS + 1) + place[:, 2]
    _, first, cell_of = np.unique(number, return_index=True, return_inverse=True)
    corners = cell_of.reshape(-1)[triangles]
    a, b, c = corners.T
    return positions[first], corners[(a != b) & (b != c) & (c != a)]


def shaded(positions, triangles):
    """Corners (3 m, 3) and colours (3 m, 4) of flat-shaded triangles, float32."""
    corners = positions[triangles].astype(np.float32)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    normals /= np.where(lengths > 0, lengths, 1)
    light = 0.35 + 0.65 * np.abs(normals @ np.array((0.36, -0.48, 0.8), np.float32))
    colours = np.ones((len(triangles), 3, 4), np.float32)
    colours[..., :3] = (light[:, None] * COLOUR)[:, None]
    return corners.reshape(-1, 3), colours.reshape(-1, 4)


def show(positions, triangles, scene):
    """Draws a surface into all 3D views of the scene that has this number, until `end`."""
    import gpu
    from gpu_extras.batch import batch_for_shader

    shader = gpu.shader.from_builtin("SMOOTH_COLOR")
    corners, colours = shaded(positions, triangles)
    batch = batch_for_shader(shader, "TRIS", {"pos": corners, "color": colours})

    def draw():
        if bpy.context.scene.session_uid != scene:
            return
        gpu.state.depth_test_set("LESS_EQUAL")
        gpu.state.depth_mask_set(True)
        batch.draw(shader)
        gpu.state.depth_mask_set(False)
        gpu.state.depth_test_set("NONE")

    Preview.handle = bpy.types.SpaceView3D.draw_handler_add(draw, (), "WINDOW", "POST_VIEW")


def end():
    """Takes the preview away and stops its job."""
    if Preview.job is not None:
        Preview.job.cancel()
    if Preview.handle is not None:
        bpy.types.SpaceView3D.draw_handler_remove(Preview.handle, "WINDOW")
        redraw_views()
    Preview.owner = Preview.job = Preview.handle = None


def redraw_views():
    """Draws all 3D views anew."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()
