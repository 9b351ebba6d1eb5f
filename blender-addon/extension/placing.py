# SPDX-License-Identifier: GPL-3.0-or-later
"""Places of imported scans: near enough to the origin for Blender's numbers, and what their set is called."""

import os

import numpy as np
from mathutils import Matrix

from . import convert

# Blender's matrices are in single precision: scans that lie further from the origin than this many times their own size
# would lose digits, so the whole set is moved.
FARTHEST = 64


def set_name(paths):
    """A name for the collection: the side file's, the only file's, or the folder's."""
    stems = [os.path.splitext(os.path.basename(path))[0] for path in paths]
    for path, stem in zip(paths, stems, strict=True):
        if path.lower().endswith((".conf", ".mlp", ".aln")):
            return stem
    return stems[0] if len(stems) == 1 else os.path.basename(os.path.dirname(paths[0])) or "Scans"


def place(made, axes, origin):
    """Gives the objects their matrices. It returns the offset that all were moved by, or `None`."""
    poses = np.array([axes @ pose for _, pose in made])
    extent = max(max(np.abs(np.array(obj.bound_box)).max() for obj, _ in made), 1e-12)
    boxes = [np.array(obj.bound_box) @ pose[:3, :3].T + pose[:3, 3] for (obj, _), pose in zip(made, poses, strict=True)]
    centre = poses[:, :3, 3].mean(axis=0)
    offset = None
    if origin == "CENTRE":
        corners = np.concatenate(boxes)
        offset = (corners.min(axis=0) + corners.max(axis=0)) / 2
    elif origin == "AUTO" and np.abs(centre).max() > FARTHEST * extent:
        # A round number, so that adding it by hand is easy.
        step = 10 ** np.floor(np.log10(extent))
        offset = np.round(centre / step) * step
    if offset is not None:
        poses[:, :3, 3] -= offset
    for (obj, _), pose in zip(made, poses, strict=True):
        obj.matrix_world = Matrix(pose.tolist())
    return offset


def in_world(obj):
    """The lowest and the highest corner of an object's vertices in the world."""
    matrix = np.array(obj.matrix_world, np.float32)
    points = convert.positions(obj.data) @ matrix[:3, :3].T + matrix[:3, 3]
    return np.array([points.min(axis=0), points.max(axis=0)]) if len(points) else np.empty((0, 3))
