# SPDX-License-Identifier: GPL-3.0-or-later
"""Make a quad grid or a NURBS surface of the active scan: regular, and dense where the surface bends."""

import itertools

import bpy
import numpy as np
import surfrecon
from bpy.props import BoolProperty, EnumProperty, IntProperty
from mathutils import Matrix

from .. import convert, declared, scan_objects, splines, usable
from ..false_colours import show
from ..job import JobOperator
from ..preview import thinned
from ..properties import draw_others, given, option
from ..running import Handle, Refused
from ..scene import dress, link, put_forward
from ..sources import note, scan_behind
from ..telling import tell, told
from .error_map import round_up

REPORT = "surfrecon_quads"

PARAMETERS = {p.name: p for p in surfrecon.parameters("quads")}
SPLINE = {p.name: p for p in surfrecon.parameters("spline")}

KINDS = (
    ("QUADS", "Quads", "A mesh of quads, ready for subdivision, with the image coordinates as UV map"),
    ("TRIANGLES", "Triangles", "The same with each quad cut along the diagonal that lies nearer to the samples"),
    (
        "SURFACE",
        "NURBS Surface",
        "A surface object over the whole image. It continues the scan where nothing was measured",
    ),
)

# Options that stand together.
GROUPS = (
    ("tiles_down", "tiles_across"),
    ("max_error", "rms_error"),
    ("exponent", "floor", "smoothing", "curvature_unit", "curvature_limit", "background_curvature"),
    ("gap_passes", "gap_neighbours"),
)


@declared.operator("quads")
class SURFRECON_OT_quads(JobOperator, bpy.types.Operator):
    """Runs the operation `quads`."""

    bl_options = {"REGISTER", "UNDO", "PRESET"}

    __annotations__ = {name: option(parameter) for name, parameter in PARAMETERS.items()} | {
        "kind": EnumProperty(name="Result", items=KINDS, default="QUADS"),
        "subdivision": IntProperty(
            name="Subdivision",
            description="Levels of the subdivision modifier that the quads get; 0: none",
            default=0,
            min=0,
            max=6,
        ),
        "order": option(SPLINE["order"]),
        "control_rows": option(SPLINE["rows"]),
        "control_columns": option(SPLINE["columns"]),
        "show_error": BoolProperty(
            name="Show error",
            description="Colour each quad by the largest distance of the samples seen in it",
            default=False,
        ),
    }

    @classmethod
    def poll(cls, context):
        """There must be a scan."""
        if not super().poll(context):
            return False
        if scan_behind(context.object) is None:
            cls.poll_message_set(told("Make an imported scan the active object"))
            return False
        return True

    def draw(self, context):
        """Sidebar of the last operation."""
        layout = self.layout
        layout.use_property_split = True
        layout.prop(self, "kind")
        if self.kind == "SURFACE":
            column = layout.column(align=True)
            for name in ("order", "control_rows", "control_columns"):
                column.prop(self, name)
        else:
            if self.kind == "QUADS":
                layout.prop(self, "subdivision")
            layout.prop(self, "coverage")
            layout.prop(self, "show_error")
        column = layout.column(align=True)
        column.active = self.max_error == 0 and self.rms_error == 0
        for name in ("rows", "columns"):
            column.prop(self, name)
        for names in GROUPS:
            column = layout.column(align=True)
            for name in names:
                column.prop(self, name)
        draw_others(layout, self, PARAMETERS, {"coverage", "rows", "columns", *itertools.chain(*GROUPS)})

    def launch(self, context):
        """Gathers the scan."""
        obj = scan_behind(usable.active(context))
        image = scan_objects.scan_of_object(obj, context.evaluated_depsgraph_get())
        if not isinstance(image, surfrecon.RangeImage):
            raise Refused(scan_objects.grid_lost(obj))
        self.scan, self.pose = Handle(obj), Matrix(image.world_from_sensor)
        self.image = image
        options = given(self, PARAMETERS)
        if self.kind == "SURFACE":
            # It goes through all vertices, whatever quads they have.
            options["coverage"] = 0.0
        return surfrecon.Job.adaptive_quads(image, **options)

    def preview(self, context):
        """A grid of fewer pixels."""
        return surfrecon.Job.adaptive_quads(thinned(self.image), threads=1)

    def preview_mesh(self, result):
        """Its quads, cut, and where they are."""
        return result.triangles(), np.array(self.pose)

    def finish(self, context, result):
        """Puts the mesh or the surface beside the scan."""
        self.image = None
        figures = result.report | {"rows": result.rows, "columns": result.columns}
        if self.kind == "SURFACE":
            spline = result.spline(
                order=self.order, rows=self.control_rows or None, columns=self.control_columns or None
            )
            made = splines.object_from_spline(context, f"{self.scan.name} surface", spline)
            figures |= {"max_residual": spline.max_residual, "rms_residual": spline.rms_residual}
        else:
            mesh = convert.mesh_from_grid(f"{self.scan.name} quads", result, cut=self.kind == "TRIANGLES")
            made = bpy.data.objects.new(mesh.name, mesh)
            if self.kind == "QUADS" and self.subdivision > 0:
                modifier = made.modifiers.new("Subdivision", "SUBSURF")
                modifier.levels = modifier.render_levels = self.subdivision
        link(context, made)
        scan = self.scan.get()
        if self.kind != "SURFACE":
            made.matrix_world = self.pose
            dress(made, [scan], context.evaluated_depsgraph_get())
            if self.show_error:
                show(made, round_up(np.quantile(result.face_attributes["error"], 0.95)))
        made.matrix_world = self.pose
        made[REPORT] = convert.plain(figures)
        note(made, [scan], [self.scan.name])
        put_forward(context, [made], [scan])
        tell(
            self,
            {"INFO"},
            f"{result.rows} x {result.columns} vertices, {figures['quads']:,} quads, relative error "
            f"{figures['relative_error']:.4%}, uniform grid {figures['uniform_relative_error']:.4%}",
        )
