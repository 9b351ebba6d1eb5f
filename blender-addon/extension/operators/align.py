# SPDX-License-Identifier: GPL-3.0-or-later
"""Bring the selected scans to where they fit each other."""

import re

import bpy
import numpy as np
import surfrecon
from mathutils import Matrix

from .. import clouds, convert, declared, hiding, recording, scan_objects, surfaces, usable
from ..advice import advised
from ..chosen import RESULTS, Chosen
from ..false_colours import show_materials
from ..job import JobOperator
from ..properties import draw_others, given, option, threads
from ..running import Handle, Refused, gathered, still_there, waited
from ..scene import put_back, put_forward, select_only, whereabouts
from ..sources import sources_of, what_is_gone
from ..telling import tell, told
from ..words import number
from . import error_map

REPORT = "surfrecon_align"

PARAMETERS = {p.name: p for p in surfrecon.parameters("align")}

# The error of a matrix by single precision and a parent: entries of its rotation, and its location as a share of the
# coordinates or the object's size. An object farther off is held there.
ROUNDING = 1e-4


class Aligning(JobOperator):
    """Work that operators share which align the selected objects."""

    __annotations__ = {name: option(parameter) for name, parameter in PARAMETERS.items()} | {
        "show_misfit": bpy.props.BoolProperty(
            name="Show misfit",
            description=(
                "Colour the placed scans by how far each lies from the others where noise is averaged out:"
                " warp, what moved, a wrong place"
            ),
        )
    }

    @classmethod
    def poll(cls, context):
        """There must be something to align."""
        if not super().poll(context):
            return False
        if not context.selected_objects:
            cls.poll_message_set(told("Select the scans to align"))
            return False
        return True

    def draw(self, context):
        """Sidebar of the last operation."""
        layout = self.layout
        layout.use_property_split = True
        layout.prop(self, "start")
        row = layout.row()
        row.active = self.start == "rough"
        row.prop(self, "reach")
        draw_others(layout, self, PARAMETERS, {"start", "reach", "turntable"})
        layout.prop(self, "turntable")
        layout.prop(self, "show_misfit")

    def launch(self, context):
        """Gathers the selected scans, or those that the only selected object was merged from."""
        chosen = Chosen(context.selected_objects).without_shapes()
        # A result lies where the scans that it was made from are, and would hold them there.
        meant = set(chosen.objects)
        chosen.leave_out([obj for obj in chosen.objects if not meant.isdisjoint(sources_of(obj))], RESULTS)
        objects, self.said = chosen.objects, chosen.said()
        # Steps of a turntable go by names, and frames by their numbers: Blender's order of what is selected is none.
        objects.sort(key=lambda obj: natural(obj.name))
        self.result = None
        if len(objects) == 1 and len(sources_of(objects[0])) > 1:
            if gone := what_is_gone(objects[0]):
                tell(self, {"WARNING"}, f"{gone}: only the others are aligned")
            self.result, objects = Handle(objects[0]), sources_of(objects[0])
        if len(objects) < 2 and not any(recording.is_recording(obj) for obj in objects):
            raise Refused("Aligning takes at least two scans: select the others as well")
        for obj in objects:
            usable.movable(obj)
            if self.show_misfit and not recording.is_recording(obj):
                usable.writable(obj)
        # The place of each object before, and that of a scan in its object if somebody moved the vertices.
        self.before, self.scan_from_object, self.through_points = {}, {}, 0
        self.folder = surfrecon.MemoryFolder()
        found = yield from gathered(context, objects, self.scan_of_object)
        # The object that each scan is of, or that stands for it.
        ordered = recording.in_order(still_there(self.before), found)
        self.owners, scans = [Handle(obj) for obj, _ in ordered], [scan for _, scan in ordered]
        self.poses = [scan.world_from_sensor if isinstance(scan, surfrecon.Scan) else None for scan in scans]
        fixed = [k for k, (obj, _) in enumerate(ordered) if is_locked(obj)]
        return surfrecon.Job.align(scans, fixed=fixed, **given(self, PARAMETERS))

    def scan_of_object(self, obj, depsgraph):
        """The scan of an object to align, or a generator of the frames that it stands for."""
        if recording.is_recording(obj):
            self.before[Handle(obj)] = whereabouts(obj), Matrix(recording.refuse_scaled(obj, depsgraph))
            return recording.frames(obj, depsgraph)
        if not scan_objects.is_range_image(obj) and not scan_objects.has_faces(obj, depsgraph):
            return self.scan_of_points(obj, depsgraph)
        scan = scan_objects.scan_of_object(obj, depsgraph)
        is_image = isinstance(scan, surfrecon.RangeImage)
        if scan_objects.is_range_image(obj) and not is_image:
            tell(self, {"WARNING"}, f'"{obj.name}" is no longer one vertex a pixel: aligned as a plain mesh')
        matrix = self.note(obj, depsgraph)
        if is_image:
            self.scan_from_object[Handle(obj)] = np.linalg.inv(scan.world_from_sensor) @ matrix
        return scan

    def note(self, obj, depsgraph):
        """Notes where an object is, and returns its matrix. It refuses one that moving and turning can't place."""
        matrix = np.array(obj.evaluated_get(depsgraph).matrix_world, np.float64)
        if not convert.is_rigid(matrix):
            whose = "its scale and that of its parents" if obj.parent is not None else "its scale"
            raise Refused(
                f'"{obj.name}" is scaled, and aligning moves and turns only: apply {whose} with Object > Apply > Scale'
            )
        self.before[Handle(obj)] = whereabouts(obj), Matrix(matrix)
        return matrix

    def scan_of_points(self, obj, depsgraph):
        """The points of an object without faces if they have normals, else the surface through them, which stands for
        them: points alone have no sides. A generator for `gathered`.
        """
        name, (points, colour) = obj.name, convert.points_of_object(obj, depsgraph, False)
        normals = clouds.normals_of(obj, depsgraph)
        matrix = self.note(obj, depsgraph)
        if normals is not None:
            finite = np.isfinite(points).all(axis=1) & np.isfinite(normals).all(axis=1)
            if clouds.are_normals(points[finite], normals[finite]):
                some = None if colour is None else colour[finite]
                scan = clouds.scan_of(
                    self.folder, len(self.before), name, points[finite], normals[finite], some, convert.rigid(matrix)
                )
                self.scan_from_object[Handle(obj)] = np.linalg.inv(scan.world_from_sensor) @ matrix
                return scan
        self.through_points += 1
        reconstructor = surfrecon.Reconstructor(points, colour=colour)
        result = yield from waited(surfrecon.Job.surface(reconstructor, threads=threads(self)))
        if len(result.mesh.triangles) == 0:
            raise Refused(f'"{name}" has points through which there is no surface: deselect it')
        return surfaces.bulging(result.mesh), matrix, name

    def finish(self, context, result):
        """Moves the scans to where they belong."""
        report = result.report
        there = dict(zip(self.before, still_there(self.before), strict=True))
        objects, owners = list(there.values()), [there[owner] for owner in self.owners]
        before = {obj: self.before[handle] for handle, obj in there.items()}
        scan_from_object = {obj: self.scan_from_object.get(handle, np.eye(4)) for handle, obj in there.items()}
        frames = [obj for obj in objects if recording.is_recording(obj)]
        moved = {
            obj: Matrix(pose @ scan_from_object[obj])
            for obj, scan, pose in zip(owners, report.scans, result.world_from_scan, strict=True)
            if scan.state == "placed" and obj not in frames
        }
        place(context, before, moved)
        for obj in frames:
            place_frames(
                obj, before[obj][1], zip(owners, report.scans, self.poses, result.world_from_scan, strict=True)
            )
        lines = lines_of(report, owners, frames)
        figures = figures_of(lines, report)
        for obj in objects:
            obj[REPORT] = figures
        if self.result is not None:
            # It is no longer the surface of its scans: they are seen and selected instead, to be merged anew.
            hiding.show(context, objects)
            put_forward(context, objects, [self.result.get()])
        active = context.view_layer.objects.active
        if active not in objects:
            # The sidebar shows the report of the active object.
            context.view_layer.objects.active = objects[0]
        if self.show_misfit:
            numbers = {obj: k for k, obj in enumerate(owners) if has_misfit(obj)}
            map_misfit(context, numbers, scan_from_object, result)
        for name, state, _, reason in lines:
            if reason:
                what = "stays where it was, undecided" if state == "undecided" else "is not placed"
                tell(self, {"WARNING"}, f'"{name}" {what}: {reason}')
        self.all_placed = report.placed == len(self.owners)
        text = f"{report.placed} of {number(len(self.owners), 'scan', 'scans')} placed{self.said}"
        if self.through_points:
            clouds = number(self.through_points, "cloud", "clouds")
            text += f", {clouds} by the surface through the points"
        if self.all_placed:
            tell(self, {"INFO"}, text)
        else:
            tell(self, {"WARNING"}, f"{text}: see Report in the sidebar for the others")


@declared.operator("align")
class SURFRECON_OT_align(Aligning, bpy.types.Operator):
    """Runs the operation `align`."""

    bl_options = {"REGISTER", "UNDO", "PRESET"}


class SURFRECON_OT_align_merge(Aligning, bpy.types.Operator):
    """Align the selected scans and, once all of them are placed, merge them into one new surface"""

    bl_idname = "surfrecon.align_merge"
    bl_label = "Align and Merge"
    # Adjusting changes the merge, which is the last operation.
    bl_options = {"UNDO"}

    def finish(self, context, result):
        """Merges what was aligned, as an operation of its own. A scan in a wrong place would spoil the surface."""
        super().finish(context, result)
        if not self.all_placed:
            tell(
                self,
                {"WARNING"},
                "Nothing is merged, since not all scans are placed: Merge Scans takes them as they lie",
            )
            return
        select_only(context, still_there(self.before))
        # A window stays alive, and a script waits.
        bpy.ops.surfrecon.merge("INVOKE_DEFAULT" if self.is_watched() else "EXEC_DEFAULT", True)


def map_misfit(context, numbers, scan_from_object, result):
    """Colours the scans that have a place. `numbers` has their objects with their numbers. Parts that no other scan
    shows look as if they fitted.
    """
    found = {}
    for obj, k in numbers.items():
        matrix = scan_from_object[obj]
        if result.world_from_scan[k] is not None and len(obj.data.vertices):
            found[obj] = np.abs(result.misfit(k, convert.positions(obj.data) @ matrix[:3, :3].T + matrix[:3, 3]))
    known = np.concatenate([values[np.isfinite(values)] for values in found.values()] or [np.empty(0)])
    limit = error_map.scale_of(known)
    for obj, values in found.items():
        error_map.map_onto(obj, np.nan_to_num(values, nan=0.0), limit)
    if found:
        show_materials(context)


def has_misfit(obj):
    """Whether misfit can be shown on an object: Blender's point clouds and frames in their files have no vertices."""
    return obj.type == "MESH"


def natural(name):
    """The key that sorts "scan 10" after "scan 9"."""
    return [(int(part), "") if part.isdecimal() else (-1, part) for part in re.split(r"(\d+)", name)]


def is_locked(obj):
    """Whether the user keeps an object from being moved and turned at all."""
    return all(obj.lock_location) and all(obj.lock_rotation)


def place(context, before, moved):
    """Puts objects to their new matrices, and all others of `before` where they were: (`whereabouts`, matrix).

    Raises `Refused` if one of them doesn't go there. Then all are where they were.
    """
    for obj, (there, _) in before.items():
        put_back(obj, there)
    # Parents first: they take their children along.
    for obj in sorted(before, key=generation):
        matrix = moved.get(obj, before[obj][1])
        if obj.parent is not None:
            context.view_layer.update()
        if obj in moved or is_off(obj, matrix):
            obj.matrix_world = matrix
    context.view_layer.update()
    for obj, (_, matrix) in before.items():
        if is_off(obj, moved.get(obj, matrix)):
            for other, (there, _) in before.items():
                put_back(other, there)
            raise Refused(
                f'"{obj.name}" does not stay where it is put: turn off constraints and drivers,'
                " or lock location and rotation, so that the others come to it"
            )


def place_frames(obj, matrix, scans):
    """Notes with the object that stands for frames, at that matrix, where they belong. Of each scan: its owner,
    its report, the pose it had and the one found. Frames that have no place stay where they were.
    """
    own = [(scan, here, there) for owner, scan, here, there in scans if owner == obj]
    if any(scan.state == "placed" for scan, _, _ in own):
        poses = [there if scan.state == "placed" else here for scan, here, there in own]
        recording.put(obj, np.array(matrix), poses)


def generation(obj):
    """How many objects it hangs on."""
    return 0 if obj.parent is None else 1 + generation(obj.parent)


def is_off(obj, matrix):
    """Whether an object lies elsewhere."""
    off = np.abs(np.array(obj.matrix_world) - np.array(matrix))
    reach = max(np.abs(matrix.translation).max(), obj.dimensions.length)
    return off[:3, :3].max() > ROUNDING or off[:3, 3].max() > ROUNDING * reach


def lines_of(report, owners, frames):
    """Name, state, deviation and reason of each scan. Frames in their files, which may be thousands, are counted by the
    object that stands for them, the state and the reason. Their deviation is the largest.
    """
    lines, counted = [], {}
    for scan, owner in zip(report.scans, owners, strict=True):
        if owner not in frames:
            lines.append((owner.name, scan.state, float(scan.deviation), advised(scan.reason)))
            continue
        key = owner.name, scan.state, advised(scan.reason)
        count, most = counted.get(key, (0, 0.0))
        counted[key] = count + 1, max(most, float(scan.deviation))
    for (owner, state, reason), (count, most) in counted.items():
        lines.append((f"{owner} ({count:,})", state, most, reason))
    return lines


def figures_of(lines, report):
    """The figures that the sidebar shows: all of the report, but for those of its scans and pairs. Scans have a line
    each, and a heap of a thousand scans has half a million pairs.
    """
    whole = {row.name: report[row.name] for row in surfrecon.figures("align") if row.kind != "report"}
    names, states, deviations, reasons = ([*column] for column in zip(*lines, strict=True))
    return convert.plain(
        whole
        | {
            "of": len(report.scans),
            "groups": len(report.groups),
            "names": names,
            "states": states,
            "deviations": deviations,
            "reasons": reasons,
            "messages": "\n".join(report.messages),
        }
    )
