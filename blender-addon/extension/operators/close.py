# SPDX-License-Identifier: GPL-3.0-or-later
"""Close the openings of the active surface, and keep out of what its scans saw to be empty."""

import bpy
import numpy as np
import surfrecon
from mathutils import Matrix

from .. import convert, declared, recording, scan_objects, usable
from ..job import JobOperator
from ..properties import draw_others, given, option
from ..running import Handle, Refused, gathered
from ..scene import dress, link, put_forward
from ..sources import all_sources_of, note, what_is_gone
from ..telling import tell, told
from ..words import sentence

REPORT = "surfrecon_close"

PARAMETERS = {p.name: p for p in surfrecon.parameters("close")}


@declared.operator("close")
class SURFRECON_OT_close_surface(JobOperator, bpy.types.Operator):
    """Runs the operation `close`."""

    bl_options = {"REGISTER", "UNDO", "PRESET"}

    __annotations__ = {name: option(parameter) for name, parameter in PARAMETERS.items()}

    @classmethod
    def poll(cls, context):
        """There must be a mesh."""
        if not super().poll(context):
            return False
        if context.object is None or context.object.type != "MESH":
            cls.poll_message_set(told("Make a surface the active object"))
            return False
        return True

    def draw(self, context):
        """Sidebar of the last operation."""
        layout = self.layout
        layout.use_property_split = True
        layout.prop(self, "openings")
        row = layout.row()
        row.active = self.openings == "holes"
        row.prop(self, "max_hole_length")
        layout.prop(self, "flat_base")
        row = layout.row()
        row.active = self.flat_base
        row.prop(self, "base_up")
        draw_others(layout, self, PARAMETERS, {"openings", "max_hole_length", "flat_base", "base_up"})

    def launch(self, context):
        """Gathers the surface, and the scans that are selected beside it, or that it was made from."""
        surface = usable.active(context)
        if scan_objects.is_range_image(surface):
            raise Refused(f'"{surface.name}" is a scan: merge the scans first, and close their surface')
        scans = [obj for obj in context.selected_objects if obj is not surface and says_what_it_saw(obj)]
        if not scans:
            scans = [obj for obj in all_sources_of([surface]) if says_what_it_saw(obj)]
            gone = what_is_gone(surface)
            if gone:
                tell(self, {"WARNING"}, f"{gone}: what they saw to be empty is not known")
        self.surface, self.scans = Handle(surface), [Handle(obj) for obj in scans]
        ((mesh, self.matrix, _),) = yield from gathered(context, [surface], scan_objects.scan_of_object)
        self.positions = mesh.positions
        read = yield from gathered(context, scans, recording.scan_or_frames)
        return surfrecon.Job.close(placed(mesh, self.matrix), recording.of_all(read), **given(self, PARAMETERS))

    def finish(self, context, result):
        """Puts the closed surface beside the open one."""
        surface, matrix = self.surface.get(), self.matrix
        name = f"{self.surface.name} closed"
        mesh = convert.mesh_from_result(name, result.mesh)
        local = (result.mesh.positions - matrix[:3, 3]) @ np.linalg.inv(matrix[:3, :3]).T
        # The measured vertices are those of the surface, to the bit.
        local[: len(self.positions)] = self.positions
        mesh.attributes["position"].data.foreach_set("vector", np.float32(local).reshape(-1))
        if is_mirrored(matrix):
            mesh.flip_normals()
        mesh.update()
        made = bpy.data.objects.new(name, mesh)
        made.matrix_world = Matrix(matrix.tolist())
        figures = convert.plain(result.report)
        figures["open"] = "\n".join(text for _, text in result.report.open)
        made[REPORT] = figures
        link(context, made)
        sources = self.scans or [self.surface]
        note(made, [source.get() for source in sources], [source.name for source in sources])
        dress(made, [surface], context.evaluated_depsgraph_get())
        put_forward(context, [made], [] if surface is None else [surface])
        report, self.positions = result.report, None
        tell(self, {"INFO"}, f"{report.closed:,} openings closed, {len(report.open):,} left open")
        if report.open:
            tell(self, {"WARNING"}, sentence(report.open[0][1]))


def says_what_it_saw(obj):
    """Whether an object is a scan whose rays may be known: a range image, or frames of a recording."""
    return scan_objects.is_range_image(obj) or recording.is_recording(obj)


def is_mirrored(matrix):
    """Whether a matrix turns the outside in."""
    return np.linalg.det(matrix[:3, :3]) < 0


def placed(mesh, matrix):
    """A mesh in the world. One that is mirrored there still has its outside outside."""
    triangles = mesh.triangles[:, ::-1] if is_mirrored(matrix) else mesh.triangles
    positions = mesh.positions @ matrix[:3, :3].T + matrix[:3, 3]
    return surfrecon.Mesh(positions, triangles, colour=mesh.vertex_attributes.get("colour"))
