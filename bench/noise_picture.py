"""The room of `noise.py` as one frame shows it and as merged from many: docs/pictures/room.jpg."""

import noise_figures
import noise_room
import noise_scans
import noise_shapes
import numpy as np
from ply import read_ply

# The eye of the picture, and the middle of what it shows: the table, the bench, and the balls on them.
EYE, TARGET = [-0.3, 0.5, 1.7], [2.0, -0.1, 0.5]
CAMERA = noise_scans.Camera(480, 560, 430.0)
LIGHT = np.array([-0.4, -0.6, -1.0]) / np.linalg.norm([-0.4, -0.6, -1.0])
GAP = 8


def shaded(normals):
    """Grey values of surfaces that face along these normals in the camera's frame; white for none."""
    there = np.isfinite(normals).all(-1)
    light = np.abs(np.where(there[..., None], normals, 0) @ LIGHT)
    grey = np.where(there, 40 + 190 * light, 255)
    return np.repeat(grey.astype(np.uint8)[..., None], 3, -1)


def surface(vertices, faces, pose, camera=CAMERA):
    """A camera's picture of a surface, in flat shades."""
    import open3d

    scene = open3d.t.geometry.RaycastingScene()
    scene.add_triangles(vertices.astype(np.float32), faces.astype(np.uint32))
    rays = camera.rays() @ pose[:3, :3].T
    start = np.broadcast_to(pose[:3, 3], rays.shape)
    hit = scene.cast_rays(open3d.core.Tensor(np.concatenate([start, rays], -1).astype(np.float32)))
    normals = hit["primitive_normals"].numpy() @ pose[:3, :3]
    normals[~np.isfinite(hit["t_hit"].numpy())] = np.nan
    return shaded(normals)


def frame(pose):
    """The picture of what a sensor measures from there, pixel joined to pixel."""
    truth = noise_figures.Truth(*noise_room.furnished(0.04))
    depth = noise_room.measured_depth(truth.depth(pose, CAMERA.rays()), np.random.default_rng(7)) * 1e-3
    points = CAMERA.rays() * np.where(depth > 0, depth, np.nan)[..., None]
    right = np.diff(points, axis=1, append=np.nan)
    down = np.diff(points, axis=0, append=np.nan)
    normals = np.cross(right, down)
    # Across a jump nothing is joined.
    normals[np.maximum(np.abs(right[..., 2]), np.abs(down[..., 2])) > 0.1] = np.nan
    return shaded(normals / np.linalg.norm(normals, axis=-1, keepdims=True))


def draw(results, out):
    """Draws a frame and, beside it, the files with merged frames."""
    import open3d

    pose = noise_shapes.look(np.array(EYE), np.array(TARGET))
    gap = np.full((CAMERA.rows, GAP, 3), 255, np.uint8)
    pictures = [frame(pose)]
    for result in results:
        mesh = read_ply(result)
        pictures += [gap, surface(mesh.vertices, mesh.faces, pose)]
    open3d.io.write_image(str(out), open3d.geometry.Image(np.hstack(pictures)), quality=80)
