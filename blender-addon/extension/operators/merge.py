# SPDX-License-Identifier: GPL-3.0-or-later
"""Merge the selected scans into one surface."""

import os

import bpy
import numpy as np
import surfrecon

from .. import convert, declared, recording, scan_objects
from ..false_colours import ATTRIBUTE
from ..job import JobOperator
from ..kept_merge import KeptMerge
from ..properties import PARAMETERS, MergeOptions, arguments, threads
from ..running import Refused, gathered
from ..scene import SCANS, dress, link, put_forward
from ..words import number

REPORT = "surfrecon_report"

# Cells along the diagonal of what the preview merges.
PREVIEW_CELLS = 150

# What is said of a merge for which memory was short.
IN_FILES = "memory was short, so it worked in temporary files"


class OfSelected(JobOperator, MergeOptions):
    """What operators share that merge the selected objects."""

    @classmethod
    def poll(cls, context):
        """There must be something to merge."""
        if not super().poll(context):
            return False
        if not context.selected_objects:
            cls.poll_message_set("Select the scans to merge")
            return False
        return True

    def gather(self, context):
        """The selected scans, a generator for `launch`. Options that were not given are those of the sidebar."""
        settings = context.scene.surfrecon
        for name in [*PARAMETERS, "close_holes"]:
            if not self.properties.is_property_set(name):
                setattr(self, name, getattr(settings, name))
        objects = [obj for obj in context.selected_objects if REPORT not in obj]
        if not objects:
            raise Refused("Only results of earlier merges are selected: select the scans")
        self.names = [obj.name for obj in objects]
        return recording.of_all((yield from gathered(context, objects, self.scan_of_object)))

    def scan_of_object(self, obj, depsgraph):
        """What is merged of an object, or a generator of the frames that it stands for."""
        if recording.is_recording(obj):
            return recording.frames(obj, depsgraph)
        scan = scan_objects.scan_of_object(obj, depsgraph)
        if scan_objects.is_range_image(obj) and not isinstance(scan, surfrecon.RangeImage):
            self.report({"WARNING"}, f'"{obj.name}" is no longer one vertex a pixel: merged as a plain mesh')
        return scan


@declared.operator("merge")
class SURFRECON_OT_merge(OfSelected, bpy.types.Operator):
    """Runs the operation `merge`."""

    bl_options = {"REGISTER", "UNDO", "PRESET"}

    __annotations__ = MergeOptions.__annotations__ | {
        "measure": bpy.props.BoolProperty(
            name="Measure",
            description="Measure how far the surface lies from the scans; the error map is then at hand",
            default=True,
        )
    }

    def draw(self, context):
        """Sidebar of the last operation."""
        layout = self.layout
        layout.use_property_split = True
        self.draw_options(layout)
        layout.prop(self, "measure")

    def launch(self, context):
        """Merges what is selected, of which the last merge may have left something."""
        self.scans = yield from self.gather(context)
        self.count = len(self.scans)
        options = {"files": "if_needed", "workspace": temporary(), "measure": self.measure, "threads": threads(self)}
        return surfrecon.Job.merge(KeptMerge.of(self.scans), **arguments(self), **options)

    def preview(self, context):
        """The same with large cells, of what is at hand already."""
        scans = [scan for scan in self.scans if not isinstance(scan, surfrecon.Scan)]
        if not scans:
            return None
        corners = np.concatenate([box(scan) for scan in scans])
        extent = np.linalg.norm(corners.max(axis=0) - corners.min(axis=0))
        return surfrecon.Job.merge(scans, voxel=max(extent / PREVIEW_CELLS, self.voxel), threads=1)

    def preview_mesh(self, result):
        """Its surface and where it is."""
        return result.mesh, np.eye(4)

    def finish(self, context, result):
        """Puts the surface into the scene."""
        if len(result.mesh.triangles) == 0:
            raise Refused("Nothing is left of the surface: choose a smaller voxel, or keep smaller components")
        self.scans = None
        mesh = convert.mesh_from_result("Merged", result.mesh)
        merged = bpy.data.objects.new("Merged", mesh)
        figures, distances = result.report.as_dict(), result.distances
        figures["warnings"] = "\n".join(text for _, text in result.report.warnings)
        if (renewed := KeptMerge.renewed()) is not None:
            figures["renewed"] = renewed
        if distances is not None:
            convert.store(mesh, ATTRIBUTE, distances.astype(np.float32))
            figures |= {"rms_error": float(np.sqrt(np.mean(distances**2))), "max_error": float(distances.max())}
        merged[REPORT] = convert.plain(figures)
        # Custom properties can't hold a list of strings.
        merged[SCANS] = "\n".join(self.names)
        link(context, merged)
        sources = [bpy.data.objects.get(name) for name in self.names]
        dress(merged, sources, context.evaluated_depsgraph_get())
        put_forward(context, [merged], sources)
        said = f"{number(self.count, 'scan', 'scans')} merged: {len(mesh.polygons):,} triangles"
        if result.report.in_files:
            KeptMerge.forget()
            said += f"; {IN_FILES}"
            if self.measure and distances is None:
                said += ", and it is not measured"
        self.report({"INFO"}, said)
        for _, text in result.report.warnings:
            self.report({"WARNING"}, text[0].upper() + text[1:])


def temporary():
    """A folder for files that go again: the one that the user has set for them."""
    return bpy.app.tempdir if os.path.isdir(bpy.app.tempdir) else None


def box(scan):
    """Corners that hold a scan, in the world."""
    if isinstance(scan, surfrecon.RangeImage):
        points, matrix = scan.points[scan.valid], scan.world_from_sensor
    else:
        points, matrix = scan[0].positions, scan[1]
    low, high = points.min(axis=0), points.max(axis=0)
    corners = np.array(np.meshgrid(*zip(low, high, strict=True))).reshape(3, -1).T
    return corners @ matrix[:3, :3].T + matrix[:3, 3]
