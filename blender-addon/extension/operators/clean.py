# SPDX-License-Identifier: GPL-3.0-or-later
"""Remove what should not be merged from scans: samples in small parts, and those of low confidence."""

import bpy
import numpy as np
from bpy.props import FloatProperty, IntProperty

from .. import convert, pruning, scan_objects, usable
from ..job import JobOperator
from ..running import Handle, Refused, Task, still_there
from ..telling import tell, told

REPORT = "surfrecon_clean"


class SURFRECON_OT_clean(JobOperator, bpy.types.Operator):
    """Remove doubtful samples from the selected scans: small parts that hang on nothing, and low confidence"""

    bl_idname = "surfrecon.clean"
    bl_label = "Clean Scans"
    bl_options = {"REGISTER", "UNDO", "PRESET"}

    smallest: IntProperty(
        name="Smallest part",
        description="Parts of fewer samples than this, joined by triangles, are removed; 1 keeps all",
        default=50,
        min=1,
        soft_max=10000,
    )
    confidence: FloatProperty(
        name="Least confidence",
        description="Samples of less confidence are removed, where the scan has any; 0 keeps all",
        default=0,
        min=0,
        soft_max=1,
    )

    # The vertices that were there at the start tell what is removed.
    may_be_handed_over = False

    @classmethod
    def poll(cls, context):
        """There must be scans, in object mode."""
        if not super().poll(context):
            return False
        if not any(scan_objects.is_range_image(obj) for obj in context.selected_objects):
            cls.poll_message_set(told("Select imported scans in object mode"))
            return False
        return True

    def launch(self, context):
        """Gathers the samples of all scans, so that either all are cleaned or none."""
        scans = [obj for obj in context.selected_objects if scan_objects.is_range_image(obj)]
        self.scans = [Handle(obj) for obj in scans]
        samples = [self.samples(obj) for obj in scans]
        limits = (self.smallest, self.confidence)

        def look(note):
            found = []
            for k, scan in enumerate(samples):
                note(k / len(samples))
                found.append(samples_kept(*scan, *limits))
            return found

        return Task("Finding the parts", look)

    def samples(self, obj):
        """The name of a scan, the number of its samples, their confidences or `None`, and its triangles' corners."""
        usable.writable(obj)
        if obj.data.users > 1:
            raise Refused(
                f'"{obj.name}" shares its samples with another object: give it its own with'
                " Object > Relations > Make Single User"
            )
        mesh = obj.data
        if self.smallest > 1 and len(mesh.polygons) == 0:
            raise Refused(f'"{obj.name}" has no triangles that tell its parts: import it with Triangulate')
        confidence = convert.vertex_values(mesh, "confidence", "FLOAT", np.float32)
        return obj.name, len(mesh.vertices), confidence, convert.triangles(mesh) if self.smallest > 1 else None

    def finish(self, context, kept):
        """Removes what isn't kept."""
        scans = still_there(self.scans)
        for obj, (keep, _) in zip(scans, kept, strict=True):
            if len(obj.data.vertices) != len(keep):
                raise Refused(f'"{obj.name}" was changed meanwhile: try again')
        for obj, (keep, figures) in zip(scans, kept, strict=True):
            if not keep.all():
                pruning.keep_vertices(obj.data, keep)
            obj[REPORT] = figures
        small = sum(figures["small"] for _, figures in kept)
        doubtful = sum(figures["doubtful"] for _, figures in kept)
        tell(self, {"INFO"}, f"{small:,} samples in small parts and {doubtful:,} of low confidence removed")


def samples_kept(name, count, confidence, corners, smallest, least):
    """Whether each of so many samples stays, and the figures."""
    keep = np.ones(count, bool)
    if confidence is not None and least > 0:
        keep &= confidence >= least
    doubtful = count - int(keep.sum())
    if smallest > 1:
        corners = corners[keep[corners].all(axis=1)]
        parts = components(count, np.concatenate([corners[:, :2], corners[:, 1:]]))
        keep &= np.bincount(parts, minlength=count)[parts] >= smallest
    if not keep.any():
        raise Refused(f'Nothing would be left of "{name}": lower the limits')
    left = int(keep.sum())
    return keep, {"samples": left, "small": count - doubtful - left, "doubtful": doubtful}


def components(count, edges):
    """For each of so many vertices the smallest vertex that edges (m, 2) join it to."""
    label = np.arange(count)
    while True:
        a, b = label[edges[:, 0]], label[edges[:, 1]]
        if np.array_equal(a, b):
            return label
        low, high = np.minimum(a, b), np.maximum(a, b)
        np.minimum.at(label, high, low)
        # Shortcuts until every label names itself.
        while True:
            shorter = label[label]
            if np.array_equal(shorter, label):
                break
            label = shorter
