"""One case of closing as a picture: what was measured, what nobody saw, two results with what was filled marked."""

import noise_figures
import noise_scans
import noise_shapes
import numpy as np

CASE = "sculpture, 28 % unseen, noise 0"
# Each pixel is the mean of so many rays across and down.
FINE, ROWS, COLS, GAP = 2, 640, 420, 8
CLAY, UNSEEN, FILLED = (0.80, 0.74, 0.66), (0.90, 0.42, 0.16), (0.36, 0.60, 0.86)
LIGHT = np.array([-0.45, -0.6, -0.9]) / np.linalg.norm([-0.45, -0.6, -0.9])


def eye_of(truth, shots):
    """A place from where much that was not seen is in view: the cameras' middle mirrored, a little above."""
    middle = shots.poses[:, :2, 3].mean(0)
    away = -middle / max(float(np.linalg.norm(middle)), 1e-9)
    turned = np.array([away[0] - 0.9 * away[1], away[1] + 0.9 * away[0]])
    turned *= 3.2 * truth.size / np.linalg.norm(turned)
    return np.array([*turned, 0.5 * truth.size])


def panel(surface, coloured, marked, pose, camera):
    """A picture of a surface; what `marked` says of points on it is in the other colour."""
    rays = camera.rays() @ pose[:3, :3].T
    start = np.broadcast_to((pose[:3, 3] - surface.middle) / surface.size, rays.shape)
    found = surface.scene.cast_rays(surface.tensor(np.concatenate([start, rays], -1).astype(np.float32)))
    depth, hit = found["t_hit"].numpy(), found["primitive_ids"].numpy()
    there = np.isfinite(depth)
    normals = surface.normals[np.where(there, hit, 0)] @ pose[:3, :3]
    light = 0.35 + 0.65 * np.abs(normals @ LIGHT)
    points = (start + depth[..., None] * rays)[there] * surface.size + surface.middle
    colours = np.ones((*there.shape, 3))
    colours[there] = np.where(marked(points)[:, None], coloured, CLAY) * light[there, None]
    return colours.reshape(ROWS, FINE, COLS, FINE, 3).mean((1, 3))


def draw(shots, truth, merged, results, cell, out):
    """Writes close.jpg: the measured surface, the truth with what was not seen, the results with what was filled."""
    import open3d

    known, reach = noise_figures.Surface(*merged), 1.5 * cell
    camera = noise_scans.Camera(ROWS * FINE, COLS * FINE, 2.65 * ROWS * FINE)
    pose = noise_shapes.look(eye_of(truth, shots), np.array([0, 0, -0.04 * truth.size]))

    def far(points):
        return known.distances(points) > reach

    def nowhere(points):
        return np.zeros(len(points), bool)

    surfaces = [(known, CLAY, nowhere), (truth, UNSEEN, far)]
    surfaces += [(noise_figures.Surface(*result), FILLED, far) for result in results]
    gap = np.ones((ROWS, GAP, 3))
    panels = [part for one in surfaces for part in (panel(*one, pose, camera), gap)][:-1]
    image = (255 * np.clip(np.hstack(panels), 0, 1)).astype(np.uint8)
    open3d.io.write_image(str(out / "close.jpg"), open3d.geometry.Image(np.ascontiguousarray(image)), quality=85)
