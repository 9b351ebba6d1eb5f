# SPDX-License-Identifier: GPL-3.0-or-later
"""Remove what should not be merged from scans: samples in small parts, and those of low confidence."""

import bpy
import numpy as np
from bpy.props import FloatProperty, IntProperty

from .. import convert
from ..job import Refused, Running, sentence

REPORT = "surfrecon_clean"


class SURFRECON_OT_clean(bpy.types.Operator):
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

    @classmethod
    def poll(cls, context):
        """There must be scans, in object mode."""
        if Running.job is not None:
            cls.poll_message_set(f"{Running.title} is running")
            return False
        if context.mode != "OBJECT" or not any(convert.is_range_image(obj) for obj in context.selected_objects):
            cls.poll_message_set("Select imported scans in object mode")
            return False
        return True

    def execute(self, context):
        """Looks at all scans first, so that either all are cleaned or none."""
        scans = [obj for obj in context.selected_objects if convert.is_range_image(obj)]
        try:
            kept = [(obj, *self.samples_kept(obj)) for obj in scans]
        except Refused as problem:
            self.report({"ERROR"}, sentence(problem))
            return {"CANCELLED"}
        small = sum(figures["small"] for _, _, figures in kept)
        doubtful = sum(figures["doubtful"] for _, _, figures in kept)
        for obj, keep, figures in kept:
            if not keep.all():
                convert.keep_vertices(obj.data, keep)
            obj[REPORT] = figures
        self.report({"INFO"}, f"{small:,} samples in small parts and {doubtful:,} of low confidence removed")
        return {"FINISHED"}

    def samples_kept(self, obj):
        """Which vertices stay, and the figures."""
        convert.writable(obj)
        if obj.data.users > 1:
            raise Refused(
                f'"{obj.name}" shares its samples with another object: give it its own with'
                " Object > Relations > Make Single User"
            )
        mesh = obj.data
        count = len(mesh.vertices)
        keep = np.ones(count, bool)
        confidence = convert.vertex_values(mesh, "confidence", "FLOAT", np.float32)
        if confidence is not None and self.confidence > 0:
            keep &= confidence >= self.confidence
        doubtful = count - int(keep.sum())
        if self.smallest > 1:
            if len(mesh.polygons) == 0:
                raise Refused(f'"{obj.name}" has no triangles that tell its parts: import it with Triangulate')
            corners = convert.triangles(mesh)
            corners = corners[keep[corners].all(axis=1)]
            parts = components(count, np.concatenate([corners[:, :2], corners[:, 1:]]))
            keep &= np.bincount(parts, minlength=count)[parts] >= self.smallest
        if not keep.any():
            raise Refused(f'Nothing would be left of "{obj.name}": lower the limits')
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
