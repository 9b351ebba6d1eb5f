# SPDX-License-Identifier: GPL-3.0-or-later
"""Merge the selected scans into one surface."""

import os

import bpy
import numpy as np
import surfrecon

from .. import convert, declared, hiding, measured, recording, scan_objects
from ..chosen import RESULTS, Chosen
from ..false_colours import ATTRIBUTE
from ..job import JobOperator
from ..kept_merge import KeptMerge
from ..properties import PARAMETERS, MergeOptions, arguments, threads
from ..running import Handle, Refused, gathered
from ..scene import dress, group_filled, link, put_forward
from ..sources import common_name, has_colours, note, sources_of, what_is_gone
from ..telling import tell, told
from ..words import number

REPORT = "surfrecon_report"

# Cells along the diagonal of what the preview merges.
PREVIEW_CELLS = 150

# The note on a merge for which memory was short.
IN_FILES = "memory was short, so it worked in temporary files"


class OfSelected(JobOperator, MergeOptions):
    """The common part of operators that merge the selected objects."""

    @classmethod
    def poll(cls, context):
        """There must be something to merge."""
        if not super().poll(context):
            return False
        if not context.selected_objects:
            cls.poll_message_set(told("Select the scans to merge"))
            return False
        return True

    def gather(self, context):
        """The selected scans, a generator for `launch`. Options that were not given are those of the sidebar."""
        settings = context.scene.surfrecon
        for name in PARAMETERS:
            if not self.properties.is_property_set(name):
                setattr(self, name, getattr(settings, name))
        objects = self.chosen(context)
        self.sources = [Handle(obj) for obj in objects]
        return recording.of_all((yield from gathered(context, objects, self.scan_of_object)))

    def chosen(self, context):
        """The selected scans, or what the selected results were merged from."""
        chosen = Chosen(context.selected_objects).without_shapes()
        merges = [obj for obj in chosen.objects if REPORT in obj]
        self.earlier = []
        if merges and len(merges) == len(chosen.objects):
            self.earlier = [Handle(obj) for obj in merges]
            scans = list(dict.fromkeys(source for obj in merges for source in sources_of(obj)))
            for gone in filter(None, map(what_is_gone, merges)):
                if not scans:
                    raise Refused(f"{gone}: select the scans")
                tell(self, {"WARNING"}, f"{gone}: only the others are merged")
            chosen.objects = scans
        else:
            # A result lies where the scans are that it was made from, and would count twice.
            meant = set(chosen.objects)
            results = [obj for obj in chosen.objects if obj in merges or not meant.isdisjoint(sources_of(obj))]
            chosen.leave_out(results, RESULTS)
        if not chosen.objects:
            raise Refused(f"Nothing but {chosen.others()} is selected: select the scans")
        self.said = chosen.said()
        return chosen.objects

    def scan_of_object(self, obj, depsgraph):
        """The scan of an object to merge, or a generator of the frames that it stands for."""
        if recording.is_recording(obj):
            return recording.frames(obj, depsgraph)
        scan = scan_objects.scan_of_object(obj, depsgraph)
        if scan_objects.is_range_image(obj) and not isinstance(scan, surfrecon.RangeImage):
            tell(self, {"WARNING"}, f'"{obj.name}" is no longer one vertex a pixel: merged as a plain mesh')
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
        self.count, self.coloured = len(self.scans), sum(map(has_colours, self.scans))
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
        sources = [source.get() for source in self.sources]
        there = [source for source in sources if source is not None]
        name = f"{common_name(there) if there else self.sources[0].name} merged"
        mesh = convert.mesh_from_result(name, result.mesh)
        merged = bpy.data.objects.new(name, mesh)
        figures, distances = convert.report_of("merge", result.report), result.distances
        figures["coloured"] = self.coloured
        if (colour := result.mesh.vertex_attributes.get("colour")) is not None:
            # A vertex that no scan saw in colour has the nearest colour, and is transparent.
            figures["seen_in_colour"] = float(np.mean(colour[:, 3] > 0))
        if (renewed := KeptMerge.renewed()) is not None:
            figures["renewed"] = renewed
        if distances is not None:
            convert.store(mesh, ATTRIBUTE, distances.astype(np.float32))
            figures |= {"rms_error": float(np.sqrt(np.mean(distances**2))), "max_error": float(distances.max())}
        merged[REPORT] = figures
        note(merged, sources, [source.name for source in self.sources])
        link(context, merged)
        if result.report.filled_area is not None:
            group_filled(merged)
        if distances is not None:
            context.view_layer.update()
            measured.note(merged)
        dress(merged, sources, context.evaluated_depsgraph_get())
        earlier = [one.get() for one in self.earlier]
        put_forward(context, [merged], sources + earlier)
        said = f"{number(self.count, 'scan', 'scans')} merged: {len(mesh.polygons):,} triangles{self.said}"
        if earlier and hiding.is_wished():
            said += f"; {number(len(earlier), 'earlier result is', 'earlier results are')} hidden"
        if result.report.in_files:
            KeptMerge.forget()
            said += f"; {IN_FILES}"
            if self.measure and distances is None:
                said += ", and it is not measured"
        tell(self, {"INFO"}, said)
        for _, text in result.report.warnings:
            tell(self, {"WARNING"}, text[0].upper() + text[1:])


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
