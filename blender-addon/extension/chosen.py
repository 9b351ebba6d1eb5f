# SPDX-License-Identifier: GPL-3.0-or-later
"""The part of a selection that operators work on: scans and surfaces. The rest is left out, counted and said: cameras,
lights and empties, which Blender selects with all else, and shapes that a region was taken from.
"""

from . import recording, scan_objects
from .sources import sources_of
from .surfaces import SURFACES
from .words import number

# Custom property of a cube or plane that a region was taken from.
REGION = "surfrecon_region"

# Custom property of meshes and points that were imported as scans; range images and recordings say it themselves.
SCAN = "surfrecon_scan"

# Names for one and many objects that are no surface, by Blender's types.
OTHERS = {
    "CAMERA": ("camera", "cameras"),
    "LIGHT": ("light", "lights"),
    "LIGHT_PROBE": ("light", "lights"),
    "EMPTY": ("empty", "empties"),
}
REGIONS, RESULTS, REST = ("region", "regions"), ("result", "results"), ("other object", "other objects")
SHAPES = ("simple shape", "simple shapes")

# A mesh of no more vertices is a shape of Blender's, such as the cube of every new file, where there are scans.
CORNERS = 8


def is_scan(obj):
    """Whether an object was measured: a range image, frames of a recording, an imported mesh or cloud."""
    return scan_objects.is_range_image(obj) or recording.is_recording(obj) or SCAN in obj


def kind_of(obj):
    """One and many of what an object is that is no surface, or `None` for one that may be."""
    if REGION in obj:
        return REGIONS
    if obj.type in SURFACES or obj.type == "POINTCLOUD" or recording.is_recording(obj) or obj.instance_type != "NONE":
        return None
    return OTHERS.get(obj.type, REST)


def is_simple(obj):
    """Whether an object is a mesh of few vertices that was neither measured nor made of what was."""
    few = obj.type == "MESH" and len(obj.data.vertices) <= CORNERS and len(obj.modifiers) == 0
    return few and not is_scan(obj) and not sources_of(obj)


class Chosen:
    """The objects of a selection that are meant, and what was left out."""

    def __init__(self, objects):
        self.objects, self.counts = [], {}
        for obj in objects:
            kind = kind_of(obj)
            if kind is None:
                self.objects.append(obj)
            else:
                self.count(kind)

    def count(self, kind):
        """Notes that one more of a kind is left out."""
        self.counts[kind] = self.counts.get(kind, 0) + 1

    def without_shapes(self):
        """Leaves out cubes and planes if there are scans, or what was made of scans. It returns itself."""
        if any(is_scan(obj) or sources_of(obj) for obj in self.objects):
            self.leave_out([obj for obj in self.objects if is_simple(obj)], SHAPES)
        return self

    def leave_out(self, objects, kind):
        """Leaves out some of those that were meant so far."""
        for obj in objects:
            self.objects.remove(obj)
            self.count(kind)

    def others(self):
        """Counts of all that was left out, as people say them."""
        return ", ".join(number(count, *kind) for kind, count in sorted(self.counts.items()))

    def said(self):
        """The end of a sentence about what was done: what was left out, if anything was."""
        return f"; left out: {self.others()}" if self.counts else ""
