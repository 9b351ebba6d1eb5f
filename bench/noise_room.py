"""Frames of a depth camera that is carried through a furnished room, with the noise of a Kinect; metres."""

import math

import noise_figures
import noise_scans
import noise_shapes
import numpy as np

# The first Kinect: 640 x 480, about 43 degrees high.
KINECT = noise_scans.Camera(480, 640, 580.0)
SMALL = noise_scans.Camera(60, 80, 72.5)
# Frames of one turn of the camera about the room.
TURN = 100
# Steps of the inverse depth, 1/m: 2.9 mm at 1 m.
STEP = 2.9e-3
FARTHEST = 4.5


def furnished(step=0.04):
    """The room, closed, seen from inside, and what stands in it: vertices and faces."""
    box, sphere = noise_shapes.box, noise_shapes.sphere
    parts = [box([-2.5, -2, 0], [2.5, 2, 2.6], step, inside_out=True)]
    # A cupboard, a shelf of four boards, a table with legs, a bench; boxes stand 5 mm apart from what they stand on.
    parts += [box([-2.45, -1.95, 0.005], [-1.85, -0.9, 1.9], step)]
    parts += [box([-1, 1.7, z], [0.6, 1.98, z + 0.03], step) for z in (0.4, 0.8, 1.2, 1.6)]
    parts += [box([1.3, -1.5, 0.70], [2.3, -0.4, 0.74], step)]
    parts += [box([x, y, 0.005], [x + 0.06, y + 0.06, 0.695], 0.03) for x in (1.35, 2.19) for y in (-1.45, -0.51)]
    parts += [box([1.7, 0.5, 0.005], [2.4, 1.8, 0.45], step)]
    # Balls on the table, the bench and the floor, and one that hangs.
    parts += [sphere([1.8, -0.9, 0.90], 0.15, 0.02), sphere([2.0, 1.1, 0.71], 0.25, 0.03)]
    parts += [sphere([-1.7, 1.2, 0.36], 0.35, 0.03), sphere([-0.6, -1.5, 1.9], 0.2, 0.03)]
    return noise_shapes.joined(parts)


def pose(k):
    """The pose of frame k: on an oval, looking ahead of the way, up and down in turn."""
    turn = 2 * math.pi * k / TURN
    eye = [0.7 * math.cos(turn), 0.5 * math.sin(turn), 1.4 + 0.2 * math.sin(0.37 * turn)]
    tilt = -0.15 + 0.5 * math.sin(4.3 * turn)
    toward = [math.cos(turn + 0.4), math.sin(turn + 0.4), math.tan(tilt)]
    return noise_shapes.look(np.array(eye), np.add(eye, toward))


def measured_depth(depth, generator):
    """Depth as a Kinect measures it: noise that grows with the distance, then steps of the disparity, then whole mm."""
    sigma = 1e-3 * (1.2 + 1.9 * (depth - 0.4) ** 2)
    noisy = np.maximum(depth + sigma * generator.standard_normal(depth.shape), 0.1)
    stepped = 1 / (np.maximum(np.round(1 / noisy / STEP), 1) * STEP)
    return np.where((depth > 0) & (depth < FARTHEST), np.round(1e3 * stepped), 0).astype(np.uint16)


def write(frames, camera, cell, folder):
    """Writes frames as PNG, one after the other; gives the truth, samples without errors and the noise's deviation."""
    import open3d

    vertices, faces = furnished(0.04 if camera is KINECT else 0.1)
    truth = noise_figures.Truth(vertices, faces)
    poses, rays = [pose(k) for k in range(frames)], camera.rays()
    noise_scans.write_camera(camera, poses, folder)
    every = max(1, frames * rays.shape[0] * rays.shape[1] // noise_figures.POINTS)
    samples, squares, count = [], 0.0, 0
    for k, placed in enumerate(poses):
        depth = truth.depth(placed, rays)
        truth.see(camera, placed, depth, 4 * cell)
        png = measured_depth(depth, np.random.default_rng([2, k]))
        open3d.t.io.write_image(str(folder / f"frame_{k:04}.png"), open3d.t.geometry.Image(png[..., None]))
        there = png > 0
        squares += float(np.sum((1e-3 * png - depth)[there] ** 2))
        count += int(there.sum())
        at = np.flatnonzero(there.ravel())[::every]
        samples.append((rays.reshape(-1, 3)[at] * depth.ravel()[at, None]) @ placed[:3, :3].T + placed[:3, 3])
    return truth, np.concatenate(samples), math.sqrt(squares / count) / cell
