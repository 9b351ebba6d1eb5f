# SPDX-License-Identifier: GPL-3.0-or-later
"""Sculpt the active scan: few triangles, none farther from a sample than a tolerance."""

import bpy
import numpy as np
import surfrecon
from bpy.props import BoolProperty
from mathutils import Matrix

from .. import convert, declared, scan_objects, usable
from ..false_colours import show
from ..job import JobOperator
from ..kept import Kept, fingerprint
from ..preview import thinned
from ..properties import draw_others, given, option
from ..running import Handle, Refused
from ..scene import dress, link, put_forward
from ..sources import note, scan_behind
from ..telling import tell, told
from ..words import length

REPORT = "surfrecon_sculpt"

PARAMETERS = {p.name: p for p in surfrecon.parameters("sculpt") + surfrecon.parameters("triangulate")}
TOLERANCES = ("tolerance", "relative_tolerance")
# The parameters that a sculptor is made with. The tolerance may change afterwards.
MAKING = tuple(name for name in PARAMETERS if name not in TOLERANCES)


def key_of(image, options):
    """The key that tells sculptors apart: an image and some of the library's options."""
    content = fingerprint(image.points, image.colour, image.confidence)
    return (content, repr(image.projection), image.rows, tuple(sorted(options.items(), key=str)))


@declared.operator("sculpt")
class SURFRECON_OT_sculpt(JobOperator, bpy.types.Operator):
    """Runs the operation `sculpt`."""

    bl_options = {"REGISTER", "UNDO", "PRESET"}

    __annotations__ = {name: option(parameter) for name, parameter in PARAMETERS.items()} | {
        "show_error": BoolProperty(
            name="Show error", description="Colour the mesh by its distance to the samples", default=False
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
        layout.prop(self, "tolerance")
        row = layout.row()
        row.active = self.tolerance == 0
        row.prop(self, "relative_tolerance")
        draw_others(layout, self, PARAMETERS, TOLERANCES)
        layout.prop(self, "show_error")

    def launch(self, context):
        """Gathers the scan. The sculptor of the same scan is used again."""
        obj = scan_behind(usable.active(context))
        image = scan_objects.scan_of_object(obj, context.evaluated_depsgraph_get())
        if not isinstance(image, surfrecon.RangeImage):
            raise Refused(scan_objects.grid_lost(obj))
        self.scan, self.pose = Handle(obj), Matrix(image.world_from_sensor)
        options = given(self, {name: PARAMETERS[name] for name in MAKING})
        self.image, self.key = image, key_of(image, options)
        # The redo panel's sliders dig again with the same sculptor.
        sculptor = Kept.find(self.bl_idname, self.key)
        return surfrecon.Job.sculptor(image, **options) if sculptor is None else self.refine(sculptor)

    def refine(self, sculptor):
        """The job that digs."""
        return surfrecon.Job.refine(sculptor, **self.tolerances())

    def tolerances(self):
        """One of both, or none for the library's own, which single precision would change."""
        found = given(self, {name: PARAMETERS[name] for name in TOLERANCES})
        return {"tolerance": found["tolerance"]} if found["tolerance"] is not None else found

    def preview(self, context):
        """The same of fewer pixels, quickly dug."""
        tolerance = {"tolerance": self.tolerance} if self.tolerance > 0 else {"relative_tolerance": 0.01}
        return surfrecon.Job.refine(surfrecon.Sculptor(thinned(self.image), effort=0, threads=1), **tolerance)

    def preview_mesh(self, result):
        """Its mesh and where it is."""
        return result.mesh, np.array(self.pose)

    def finish(self, context, result):
        """Digs with the sculptor once that is made, then puts the mesh beside the scan."""
        if isinstance(result, surfrecon.Sculptor):
            return self.refine(Kept.keep(self.bl_idname, self.key, result))
        self.image = None
        mesh = convert.mesh_from_result(f"{self.scan.name} sculpted", result.mesh)
        made = bpy.data.objects.new(mesh.name, mesh)
        made.matrix_world = self.pose
        figures = result.report | {"max_error": result.max_error, "rms_error": result.rms_error}
        made[REPORT] = convert.plain(figures)
        scan = self.scan.get()
        note(made, [scan], [self.scan.name])
        link(context, made)
        dress(made, [scan], context.evaluated_depsgraph_get())
        if self.show_error:
            show(made, result.tolerance or max(result.max_error, 1e-9))
        put_forward(context, [made], [scan])
        share = len(mesh.polygons) / max(result.report["full_triangles"], 1)
        tell(
            self,
            {"INFO"},
            f"{len(mesh.polygons):,} triangles, {share:.1%} of all, largest error {length(context, result.max_error)}",
        )
        return None
