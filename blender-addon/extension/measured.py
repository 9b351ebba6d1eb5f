# SPDX-License-Identifier: GPL-3.0-or-later
"""Distances that a merge measured, for the error map. They hold as long as the surface and its scans are unchanged."""

import hashlib

import numpy as np

from . import convert, recording
from .false_colours import ATTRIBUTE
from .sources import pairs_of

# Custom property of a result: what it and its scans were when it was measured.
MEASURED = "surfrecon_measured"


def note(merged):
    """Notes what a result and its scans are, whose distances are its attribute."""
    mark = mark_of(merged)
    if mark is not None:
        merged[MEASURED] = mark


def distances_of(merged):
    """The distances of the vertices, or `None` where they are not known or hold no longer."""
    if merged.get(MEASURED) is None or merged[MEASURED] != mark_of(merged):
        return None
    return convert.vertex_values(merged.data, ATTRIBUTE, "FLOAT", np.float32).astype(np.float64)


def mark_of(merged):
    """A text that changes with anything that the distances depend on. It is `None` where that can't be told."""
    sources = [source for _, source in pairs_of(merged)]
    distances = convert.vertex_values(merged.data, ATTRIBUTE, "FLOAT", np.float32)
    if distances is None or not sources or None in sources:
        return None
    found = hashlib.blake2b(distances.tobytes(), digest_size=16)
    for obj in (merged, *sources):
        if len(obj.modifiers) > 0 or obj.constraints or obj.type not in {"MESH", "EMPTY"}:
            return None
        if obj.type == "MESH" and obj.data.shape_keys is not None:
            return None
        found.update(np.array(obj.matrix_world, np.float32).tobytes())
        if obj.type == "MESH":
            found.update(convert.positions(obj.data).tobytes())
            found.update(convert.triangles(obj.data).tobytes())
        else:
            for name in (recording.PATHS, recording.FRAMES, recording.SCALE, recording.POSES, recording.SELECTIONS):
                found.update(repr(plain(obj.get(name))).encode())
    return found.hexdigest()


def plain(value):
    """A custom property as it is written: arrays by their numbers."""
    return list(value) if hasattr(value, "to_list") else value
