# SPDX-License-Identifier: GPL-3.0-or-later
"""Range scans of anything in the scene: what one camera sees, and what all cameras see with a scanner's noise."""

import itertools

import bpy
import numpy as np
import surfrecon
from bpy.props import BoolProperty, EnumProperty, FloatProperty
from mathutils import Matrix

from .. import cameras, declared, scan_objects, surfaces
from ..chosen import REGION
from ..job import JobOperator
from ..preferences import preference
from ..preview import PIXELS
from ..properties import draw_others, given, option
from ..running import Refused
from ..scene import into_collection, select_only, show_colours, tint
from ..telling import tell, told

PARAMETERS = {p.name: p for p in surfrecon.parameters("scan")}

# Options that stand together.
GROUPS = (
    ("cameras", "percent", "faces"),
    ("noise", "noise_grazing", "quantum"),
    ("dropout", "dropout_grazing"),
    ("max_range", "backfaces"),
    ("pose_shift", "pose_turn"),
)


class ScanOperator(JobOperator):
    """The common part of both operators: cameras to choose, and what is done with the images."""

    bl_options = {"REGISTER", "UNDO", "PRESET"}

    percent: FloatProperty(
        name="Resolution",
        description="Size of the scan's grid as a percentage of that of the rendered picture",
        subtype="PERCENTAGE",
        default=50,
        min=0.1,
        max=1000,
        soft_max=100,
    )
    faces: BoolProperty(
        name="Triangulate",
        description="Connect neighbouring samples by triangles, leaving out jumps; off: vertices only",
        default=True,
    )

    @classmethod
    def poll(cls, context):
        """There must be something to scan."""
        if not super().poll(context):
            return False
        if not any(obj.type in surfaces.SURFACES or obj.instance_type != "NONE" for obj in context.selected_objects):
            cls.poll_message_set(told("Select the objects to scan"))
            return False
        return True

    def scan(self, context, chosen, **options):
        """The job that scans the selected objects with the chosen cameras."""
        depsgraph = context.evaluated_depsgraph_get()
        subjects = [obj for obj in context.selected_objects if REGION not in obj]
        surface = surfaces.surface_of(subjects, depsgraph)
        rows, columns = cameras.resolution(context.scene, self.percent)
        views = [cameras.scanner(camera, context.scene, depsgraph, rows, columns) for camera in chosen]
        self.names = [camera.name for camera in chosen]
        objects = [obj for obj in subjects if obj.type != "CAMERA"]
        self.subject = objects[0].name if len(objects) == 1 else "the scene"
        # The preview sees every few pixels.
        few = [max(int(n / max((rows * columns / PIXELS) ** 0.5, 1)), 2) for n in (rows, columns)]
        self.rough = surface, [cameras.scanner(camera, context.scene, depsgraph, *few) for camera in chosen]
        return surfrecon.Job.virtual_scan(surface, views, **options)

    def preview(self, context):
        """The images of the cameras, with fewer pixels."""
        return surfrecon.Job.virtual_scan(*self.rough, threads=1)

    def preview_mesh(self, images):
        """All images as one surface in the world."""
        parts = []
        for image in images:
            try:
                mesh = image.triangulate()
            except surfrecon.InputError:
                # A camera may see too little for a triangle.
                continue
            matrix = image.world_from_sensor
            parts.append((mesh.positions @ matrix[:3, :3].T + matrix[:3, 3], mesh.triangles, None))
        return surfaces.union(parts), np.eye(4)

    def finish(self, context, images):
        """An object a camera that saw something, in a collection of their own."""
        self.rough = None
        seen = [(name, image) for name, image in zip(self.names, images, strict=True) if image.valid.any()]
        if not seen:
            who = f'"{self.names[0]}" sees nothing'
            if len(self.names) > 1:
                who = f"None of the {len(self.names)} cameras sees anything"
            what = "point a camera at it, raise the resolution or the largest range, or lower the dropouts"
            raise Refused(f"{who} of {self.subject}: {what}")
        made = []
        for name, image in seen:
            obj = scan_objects.object_from_range_image(f"{name} scan", image, 1.0, self.faces)
            obj.matrix_world = Matrix(image.world_from_sensor.tolist())
            made.append(obj)
        into_collection(context, f"Scans of {self.subject}", made)
        for k, obj in enumerate(made):
            tint(obj, k)
            show_colours(obj)
        select_only(context, made)
        samples = sum(len(obj.data.vertices) for obj in made)
        blind = len(self.names) - len(made)
        text = f"{len(made)} scans, {samples:,} samples" if len(made) > 1 else f"{samples:,} samples"
        tell(self, {"INFO"}, text + (f", {blind} cameras saw nothing" if blind else ""))


class SURFRECON_OT_reproject(ScanOperator, bpy.types.Operator):
    """Make a range scan of what the scene's camera sees of the selected objects, so that it can be sculpted"""

    bl_idname = "surfrecon.reproject"
    bl_label = "Scan from Camera"

    def draw(self, context):
        """Panel of the last operation."""
        self.layout.use_property_split = True
        for name in ("percent", "faces"):
            self.layout.prop(self, name)

    def launch(self, context):
        """Gathers the surface and the camera."""
        if context.scene.camera is None:
            raise Refused("The scene has no camera to scan from: add one, or make one active with Ctrl Numpad 0")
        return self.scan(context, [context.scene.camera], backfaces=True, threads=preference("threads") or None)


@declared.operator("scan")
class SURFRECON_OT_virtual_scan(ScanOperator, bpy.types.Operator):
    """Runs the operation `scan`."""

    __annotations__ = (
        ScanOperator.__annotations__
        | {name: option(parameter) for name, parameter in PARAMETERS.items()}
        | {
            "cameras": EnumProperty(
                name="Cameras",
                description="Which cameras scan",
                items=(
                    ("ALL", "All", "All visible cameras of the scene"),
                    ("SELECTED", "Selected", "The selected cameras"),
                    ("ACTIVE", "Active", "The scene's active camera"),
                ),
            )
        }
    )

    def draw(self, context):
        """Panel of the last operation."""
        layout = self.layout
        layout.use_property_split = True
        for names in GROUPS:
            column = layout.column(align=True)
            for name in names:
                column.prop(self, name)
        draw_others(layout, self, PARAMETERS, set(itertools.chain(*GROUPS)))

    def launch(self, context):
        """Gathers the surface and the cameras."""
        if self.cameras == "ACTIVE":
            chosen = [context.scene.camera] if context.scene.camera is not None else []
        else:
            pool = context.selected_objects if self.cameras == "SELECTED" else context.visible_objects
            chosen = sorted((obj for obj in pool if obj.type == "CAMERA"), key=lambda obj: obj.name)
        if not chosen:
            which = {"ALL": "visible", "SELECTED": "selected", "ACTIVE": "active"}[self.cameras]
            raise Refused(f"There is no {which} camera to scan with: add one, or choose other cameras")
        return self.scan(context, chosen, **given(self, PARAMETERS))
