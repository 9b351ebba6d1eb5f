# SPDX-License-Identifier: GPL-3.0-or-later
"""Make a surface through the vertices or points of the selected objects."""

import bpy
import numpy as np
import surfrecon
from bpy.props import BoolProperty
from mathutils import Matrix

from .. import convert, declared
from ..chosen import Chosen
from ..job import JobOperator
from ..kept import Kept, fingerprint
from ..properties import draw_others, given, option
from ..running import Handle, Refused, gathered
from ..scan_objects import sensor_of
from ..scene import dress, link, put_forward
from ..sources import note
from ..telling import tell, told

REPORT = "surfrecon_reconstruct"

PARAMETERS = {p.name: p for p in surfrecon.parameters("reconstruct")}

# Points that the preview goes through.
PREVIEW_POINTS = 10_000


def one_a_point(sensors, parts):
    """(n, 3): where the points of each part were seen from, NaN where that is not known. It is `None` if it is known of
    no part.
    """
    if all(sensor is None for sensor in sensors):
        return None
    known = [np.nan if sensor is None else sensor for sensor in sensors]
    return np.concatenate([np.broadcast_to(k, part.shape) for k, part in zip(known, parts, strict=True)])


@declared.operator("reconstruct")
class SURFRECON_OT_reconstruct(JobOperator, bpy.types.Operator):
    """Runs the operation `reconstruct`."""

    bl_options = {"REGISTER", "UNDO", "PRESET"}

    __annotations__ = {name: option(parameter) for name, parameter in PARAMETERS.items()} | {
        "toward_camera": BoolProperty(
            name="Toward the camera",
            description="Turn the surface to the camera. Otherwise that of range images is turned to their sensors,"
            " closed surfaces outwards, open ones up",
            default=False,
        ),
    }

    @classmethod
    def poll(cls, context):
        """There must be points."""
        if not super().poll(context):
            return False
        if not context.selected_objects:
            cls.poll_message_set(told("Select point clouds, or meshes whose vertices are points"))
            return False
        return True

    def draw(self, context):
        """Sidebar of the last operation."""
        layout = self.layout
        layout.use_property_split = True
        draw_others(layout, self, PARAMETERS, {"closure"})
        row = layout.row()
        row.active = self.topology == "manifold"
        row.prop(self, "closure")
        layout.prop(self, "toward_camera")

    def launch(self, context):
        """Gathers the points. The reconstructor of the same points is used again."""
        chosen = Chosen(context.selected_objects)
        objects, self.said = chosen.objects, chosen.said()
        if not objects:
            raise Refused(f"Nothing but {chosen.others()} is selected: select points, or meshes")
        # One object keeps its own frame, so that it can be moved with what is made of it; several meet in the world.
        several = len(objects) > 1
        self.pose = Matrix() if several else objects[0].matrix_world.copy()
        self.sources = [Handle(obj) for obj in objects]
        if self.pose.determinant() == 0:
            raise Refused(f'"{objects[0].name}" is flattened by a scale of 0: set another one under Item > Transform')
        read = yield from gathered(
            context, objects, lambda *of: (*convert.points_of_object(*of, several), sensor_of(*of, several))
        )
        parts, colours, sensors = zip(*read, strict=True)
        colour = None if any(c is None for c in colours) else np.concatenate(colours)
        self.points, self.toward = np.concatenate(parts), self.camera(context)
        self.sensors = one_a_point(sensors, parts)
        # The redo panel's sliders carve anew the same tetrahedra.
        reconstructor = Kept.get(
            self.bl_idname,
            fingerprint(self.points, colour, self.sensors, self.toward),
            lambda: surfrecon.Reconstructor(self.points, colour=colour, sensors=self.sensors, toward=self.toward),
        )
        return surfrecon.Job.surface(reconstructor, **given(self, PARAMETERS))

    def camera(self, context):
        """The camera's place in the frame of the points, if the surface is to be turned to it."""
        if not self.toward_camera:
            return None
        if context.scene.camera is None:
            raise Refused("The scene has no camera to turn the surface to: add one")
        return np.array(self.pose.inverted() @ context.scene.camera.matrix_world.translation, np.float64)

    def preview(self, context):
        """The same through fewer points."""
        step = max(len(self.points) // PREVIEW_POINTS, 1)
        sensors = None if self.sensors is None else self.sensors[::step]
        reconstructor = surfrecon.Reconstructor(self.points[::step], sensors=sensors, toward=self.toward)
        return surfrecon.Job.surface(reconstructor, **given(self, PARAMETERS) | {"threads": 1})

    def preview_mesh(self, result):
        """Its surface and where it is."""
        return result.mesh, np.array(self.pose)

    def finish(self, context, result):
        """Puts the surface beside the points."""
        self.points = self.sensors = self.toward = None
        mesh = convert.mesh_from_result(f"{self.sources[0].name} surface", result.mesh)
        made = bpy.data.objects.new(mesh.name, mesh)
        made.matrix_world = self.pose
        made[REPORT] = convert.plain(result.report)
        link(context, made)
        sources = [source.get() for source in self.sources]
        note(made, sources, [source.name for source in self.sources])
        dress(made, sources, context.evaluated_depsgraph_get())
        put_forward(context, [made], sources)
        used, points = result.report["used"], result.report["points"]
        tell(self, {"INFO"}, f"{len(mesh.polygons):,} triangles through {used:,} of {points:,} points{self.said}")
