# SPDX-License-Identifier: GPL-3.0-or-later
"""Remesh the active surface or points to well-shaped triangles, at one resolution or as a chain of levels of detail."""

from types import SimpleNamespace

import bpy
import numpy as np
import surfrecon
from bpy.props import BoolProperty, CollectionProperty, EnumProperty, IntProperty, PointerProperty
from mathutils import Matrix

from .. import convert, declared, presets, scan_objects, usable
from ..job import JobOperator
from ..kept import Kept, fingerprint
from ..preview import coarse
from ..properties import draw_others, given, option
from ..running import Handle, Known, Refused, Task
from ..scene import dress, link, put_forward
from ..sources import note
from ..telling import tell, told
from ..translations import NAMES
from ..words import length

REPORT = "surfrecon_cluster"

PARAMETERS = {p.name: p for p in surfrecon.parameters("cluster")}
# The parameters that say how fine the result is. The others hold for each.
RESOLUTIONS = {"TRIANGLES": "triangles", "ERROR": "max_error", "VERTICES": "vertices", "PATCHES": "patches"}
# Resolutions whose counts a chain of levels falls by.
COUNTED = ("TRIANGLES", "VERTICES")
OPTIONS = tuple(name for name in PARAMETERS if name not in RESOLUTIONS.values())


class Level(bpy.types.PropertyGroup):
    """A mesh of a chain. The pointer keeps it in the file while another level is shown."""

    mesh: PointerProperty(type=bpy.types.Mesh)


@declared.operator("cluster")
class SURFRECON_OT_remesh(JobOperator, bpy.types.Operator):
    """Runs the operation `cluster`."""

    bl_options = {"REGISTER", "UNDO", "PRESET"}

    __annotations__ = {name: option(parameter) for name, parameter in PARAMETERS.items()} | {
        "resolution": EnumProperty(
            name="Resolution",
            description="What the mesh is to have",
            items=(
                ("TRIANGLES", "Triangles", "A number of triangles"),
                ("ERROR", "Largest error", "As many triangles as both surfaces take to lie this near to each other"),
                ("VERTICES", "Vertices", "A number of vertices"),
                ("PATCHES", "Patches", "A number of patches, of about three vertices each"),
            ),
        ),
        "levels": IntProperty(
            name="Levels",
            description="Meshes of a chain, each with a quarter of the triangles, or vertices, of the one before",
            default=1,
            min=1,
            max=16,
        ),
        "separate": BoolProperty(
            name="An object a level",
            description="Make an object of each level. Otherwise one object has them all, and its slider shows one",
            default=False,
        ),
    }

    @classmethod
    def poll(cls, context):
        """There must be a surface or points."""
        if not super().poll(context):
            return False
        if context.object is None or context.object.type not in {"MESH", "POINTCLOUD"}:
            cls.poll_message_set(told("Make a mesh or a point cloud the active object"))
            return False
        return True

    def draw(self, context):
        """Sidebar of the last operation."""
        layout = self.layout
        layout.use_property_split = True
        layout.prop(self, "resolution")
        layout.prop(self, RESOLUTIONS[self.resolution])
        if self.resolution in COUNTED:
            layout.prop(self, "levels")
            row = layout.row()
            row.active = self.levels > 1
            row.prop(self, "separate")
        draw_others(layout, self, PARAMETERS, RESOLUTIONS.values())

    def figures(self, level):
        """The report of a level, with lengths in the scene's unit. An uneven scale makes them larger."""
        lengths = {name: float(stretch(self.pose) * level.report[name]) for name in ("max_error", "rms_error")}
        return convert.plain(level.report | lengths)

    def asked(self):
        """The resolution. A script that gives a number alone means that number."""
        if not self.properties.is_property_set("resolution"):
            for resolution, name in RESOLUTIONS.items():
                if self.properties.is_property_set(name):
                    return resolution
        return self.resolution

    def launch(self, context):
        """Gathers the surface, or the points of what has no faces."""
        presets.tell_news(self, "surfrecon.remesh")
        obj = usable.active(context)
        mesh, matrix = self.input = dense(obj, context.evaluated_depsgraph_get())
        self.source, self.pose = Handle(obj), Matrix(matrix)
        options = given(self, {name: PARAMETERS[name] for name in OPTIONS})
        number_of_threads = options.pop("threads")
        self.kept = Kept.get(self.bl_idname, (content(mesh), tuple(options.items())), dict)
        options["threads"] = number_of_threads
        self.counts = ()
        self.resolution = self.asked()
        if self.resolution in COUNTED:
            counted = RESOLUTIONS[self.resolution]
            count = getattr(self, counted) or tenth(mesh, counted)
            self.counts = tuple((counted, max(count // 4**level, 1)) for level in range(self.levels))
            # Each level is made from the one before: the first few of a chain are that shorter chain.
            if self.kept.get("counts", ())[: self.levels] == self.counts:
                return Known(self.kept["chain"][: self.levels])
            levels = [count for _, count in self.counts]
            return surfrecon.Job.cluster(mesh, levels=levels, levels_of=counted, **options)
        if self.resolution == "PATCHES":
            return surfrecon.Job.cluster(mesh, patches=self.patches or None, **options)
        if self.max_error == 0:
            asked = PARAMETERS["max_error"].label
            raise Refused(f'Set "{asked}": how far the surface and the result may lie from each other')
        # The bound is in the scene's unit, the surface in its own: what stretches it most counts.
        return surfrecon.Job.cluster(mesh, max_error=self.max_error / stretch(matrix), **options)

    def preview(self, context):
        """The surface in large cells. Points have no preview yet."""
        mesh, _ = self.input
        if isinstance(mesh, surfrecon.Mesh):
            return Task("preview", lambda note: SimpleNamespace(mesh=coarse(mesh.positions, mesh.triangles)))
        return None

    def preview_mesh(self, result):
        """Its surface and where it is."""
        positions, triangles = result.mesh
        return SimpleNamespace(positions=positions, triangles=triangles), np.array(self.pose)

    def finish(self, context, result):
        """Puts the meshes beside the surface."""
        chain = result if isinstance(result, list) else [result]
        if len(self.counts) >= len(self.kept.get("counts", ())):
            self.kept.update(counts=self.counts, chain=chain)
        self.kept = self.input = None
        source, surface, depsgraph = self.source.get(), self.source.name, context.evaluated_depsgraph_get()
        meshes = []
        for number, level in enumerate(chain):
            name = f"{surface} remeshed" + (f" {number}" if len(chain) > 1 else "")
            mesh = convert.mesh_from_result(name, level.mesh)
            meshes.append(mesh)
        one = not self.separate or len(chain) == 1
        made = []
        for mesh, level in zip(meshes[:1] if one else meshes, chain, strict=False):
            obj = bpy.data.objects.new(f"{surface} remeshed" if one else mesh.name, mesh)
            obj.matrix_world = self.pose
            obj[REPORT] = self.figures(level)
            note(obj, [source], [surface])
            link(context, obj)
            made.append(obj)
        if one and len(chain) > 1:
            for mesh, level in zip(meshes, chain, strict=True):
                mesh[REPORT] = self.figures(level)
                made[0].surfrecon_levels.add().mesh = mesh
                made[0].data = mesh
                dress(made[0], [source], depsgraph)
            made[0].data = meshes[0]
        else:
            for obj in made:
                dress(obj, [source], depsgraph)
        put_forward(context, made, [source])
        counts = ", ".join(f"{len(level.mesh.triangles):,}" for level in chain)
        error = length(context, max(self.figures(level)["max_error"] for level in chain))
        tell(self, {"INFO"}, f"{counts} triangles, at most {error} from the original")


class SURFRECON_OT_cluster(bpy.types.Operator):
    """The former name of Remesh, for scripts"""

    bl_idname = "surfrecon.cluster"
    bl_label = "Remesh"
    bl_options = {"UNDO", "INTERNAL"}

    __annotations__ = dict(SURFRECON_OT_remesh.__annotations__)

    @classmethod
    def poll(cls, context):
        """As of Remesh."""
        return bpy.ops.surfrecon.remesh.poll()

    def execute(self, context):
        """Remeshes, and tells the name."""
        return self.remesh("EXEC_DEFAULT")

    def invoke(self, context, event):
        """For keys that call it."""
        return self.remesh("INVOKE_DEFAULT")

    def remesh(self, how):
        """Calls Remesh with what was given."""
        tell(self, {"WARNING"}, "surfrecon.cluster is called surfrecon.remesh now")
        given = {name: getattr(self, name) for name in self.__annotations__ if self.properties.is_property_set(name)}
        return bpy.ops.surfrecon.remesh(how, **given)


def dense(obj, depsgraph):
    """The surface of an object as a mesh, or the points (n, 3) of an object without faces. The second value is its
    matrix.
    """
    if scan_objects.is_range_image(obj) or (obj.type == "MESH" and len(obj.evaluated_get(depsgraph).data.polygons) > 0):
        content = scan_objects.scan_of_object(obj, depsgraph)
        if isinstance(content, surfrecon.RangeImage):
            return content.triangulate(), content.world_from_sensor
        return content[0], content[1]
    return convert.points_of_object(obj, depsgraph, False)[0], np.array(obj.matrix_world, np.float64)


def tenth(mesh, counted):
    """A tenth of a surface's triangles or vertices. Of points there are about twice as many triangles."""
    if not isinstance(mesh, surfrecon.Mesh):
        return max(len(mesh) // (10 if counted == "vertices" else 5), 1)
    return max(len(mesh.positions if counted == "vertices" else mesh.triangles) // 10, 1)


def stretch(matrix):
    """The most by which a matrix makes a length longer."""
    return np.linalg.svd(np.array(matrix)[:3, :3])[1][0]


def content(mesh):
    """A key for a surface, or for points."""
    if isinstance(mesh, surfrecon.Mesh):
        return fingerprint(mesh.positions, mesh.triangles, *mesh.vertex_attributes.values())
    return fingerprint(mesh)


def show_level(obj, context):
    """The slider of an object with levels was moved."""
    levels = obj.surfrecon_levels
    if len(levels) == 0:
        return
    if obj.surfrecon_level >= len(levels):
        # A slider's end is the same for all objects.
        obj.surfrecon_level = len(levels) - 1
        return
    mesh = levels[obj.surfrecon_level].mesh
    if mesh is not None and obj.data != mesh:
        obj.data = mesh
        if REPORT in mesh:
            obj[REPORT] = mesh[REPORT]


def register():
    """Gives objects their levels and the slider."""
    bpy.utils.register_class(Level)
    bpy.types.Object.surfrecon_levels = CollectionProperty(type=Level)
    bpy.types.Object.surfrecon_level = IntProperty(
        name="Level",
        translation_context=NAMES,
        description="Which of the levels of detail the object shows: 0 is the finest",
        min=0,
        max=15,
        update=show_level,
    )


def unregister():
    """Takes them away again."""
    del bpy.types.Object.surfrecon_level
    del bpy.types.Object.surfrecon_levels
    bpy.utils.unregister_class(Level)
