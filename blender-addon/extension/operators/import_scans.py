# SPDX-License-Identifier: GPL-3.0-or-later
"""File > Import > Range Scans: one object a scan, in a collection named after the set."""

import os

import bpy
import numpy as np
import surfrecon
from bpy.props import (
    BoolProperty,
    CollectionProperty,
    EnumProperty,
    FloatProperty,
    FloatVectorProperty,
    IntProperty,
    StringProperty,
)
from bpy_extras.io_utils import ImportHelper, axis_conversion, orientation_helper, poll_file_object_drop
from mathutils import Matrix

from .. import cameras, clouds, convert, declared, foreseen, formats, recording, scan_objects
from ..adjusting import Adjusting
from ..chosen import SCAN
from ..formats import DROPPED, ENDINGS
from ..imported import note_import
from ..job import JobOperator
from ..placing import in_world, place, set_name
from ..preferences import preference
from ..properties import option
from ..running import Refused
from ..scene import into_collection, select_only, show_colours, tint
from ..telling import tell, told
from ..translations import NAMES, word
from ..views import open_sidebar, union
from ..views import show as show_in_views
from ..words import fits, number, sentence, size

READING = {p.name: p for p in surfrecon.parameters("open")}

# A dialog waits so long for the size of what was dropped: it is in sight at once, unless the files are many.
SIZE_SECONDS = 0.5

# The share of names in Blender's rows of a name and a value.
NAMES_SHARE = 0.4

# Letters beside a name in the popup of dropped files.
POPUP_LETTERS = 25

UNITS = {"M": 1.0, "CM": 0.01, "MM": 0.001, "UM": 1e-6, "IN": 0.0254, "FT": 0.3048}


@orientation_helper(axis_forward="Y", axis_up="Z")
@declared.operator("open")
class SURFRECON_OT_import_scans(JobOperator, bpy.types.Operator, ImportHelper):
    """Runs the operation `open`."""

    bl_options = {"REGISTER", "UNDO", "PRESET"}
    gathering = "Opening the files"

    filename_ext = ".conf"
    filter_glob: StringProperty(default=";".join("*" + ending for ending in ENDINGS), options={"HIDDEN"})
    filepath: StringProperty(subtype="FILE_PATH", options={"HIDDEN", "SKIP_SAVE"})
    directory: StringProperty(subtype="DIR_PATH", options={"HIDDEN", "SKIP_SAVE"})
    files: CollectionProperty(type=bpy.types.OperatorFileListElement, options={"HIDDEN", "SKIP_SAVE"})

    faces: BoolProperty(
        name="Triangulate",
        description="Connect neighbouring samples by triangles, leaving out jumps; off: vertices only",
        default=True,
    )
    unit: EnumProperty(
        name="Unit",
        description="Unit of the files' coordinates",
        items=(
            ("PREFERRED", "As preferred", "The unit chosen in the preferences of this extension"),
            ("M", "Metres", ""),
            ("CM", "Centimetres", ""),
            ("MM", "Millimetres", ""),
            ("UM", "Micrometres", ""),
            ("IN", "Inches", ""),
            ("FT", "Feet", ""),
            ("SCENE", "Scene units", "One unit of the files is one unit of the scene, whatever that measures"),
            ("CUSTOM", "Other", "By the scale below"),
        ),
        default="PREFERRED",
    )
    orientation: EnumProperty(
        name="Axes",
        description="Which way is up in the files",
        items=(
            ("FORMAT", "As the format", "Y is up in Stanford sets, glTF and recordings of phones, and Z in all others"),
            ("AXES", "As below", "As Forward and Up say"),
        ),
        # Scripts say their axes, and dialogs begin with those of the format.
        default="AXES",
        options={"SKIP_SAVE"},
    )
    scale: FloatProperty(name="Scale", description="Scene units a unit of the files", default=1.0, min=1e-9, max=1e9)
    origin: EnumProperty(
        name="Origin",
        description="Where the scans' own origin goes. Blender's numbers have seven digits",
        items=(
            ("AUTO", "Move if far", "Scans that lie so far out that digits would be lost are moved, all alike"),
            ("KEEP", "Keep", "Coordinates stay as they are"),
            ("CENTRE", "Centre", "The middle of all scans comes to the scene's origin"),
        ),
        default="AUTO",
    )
    frame: BoolProperty(
        name="Frame",
        description="Turn the 3D views to the imported scans, show their colours, fit the clip planes, and open the "
        "sidebar",
        default=True,
    )
    frames: IntProperty(
        name="Frames as objects",
        description="At most so many frames of a recording become objects, spread evenly over it; one more object "
        "stands for all others, which are read when they are merged or aligned",
        default=50,
        min=1,
        max=10000,
        soft_max=500,
    )
    cameras: BoolProperty(
        name="Cameras",
        description="Make a camera of each frame that becomes an object, as it was recorded",
        default=True,
    )
    whole: BoolProperty(
        name="Whole recording",
        description="One image or list out of a recording's folder stands for all of it: folders can't be dropped",
        default=True,
    )
    images: EnumProperty(
        name="Images",
        description="What the pixels of images are; a camera's file among the chosen ones makes them depths",
        items=(
            ("HEIGHTS", "Height maps", "Heights seen from above"),
            ("DEPTHS", "Depth images", "Depths seen by the camera below"),
        ),
        default="HEIGHTS",
    )
    focal: FloatVectorProperty(name="Focal length", description="In pixels", size=2, default=(525, 525), min=1e-3)
    centre: FloatVectorProperty(
        name="Centre", description="Centre of the image, in pixels", size=2, default=(319.5, 239.5)
    )
    depth: option(READING["depth"])
    pixel_scale: option(READING["scale"])
    # In the files' unit.
    pixel_step: option(READING["step"], in_scene=False)
    pixels: option(READING["pixels"])
    poses: option(READING["poses"])
    axes: option(READING["axes"])

    by_hand = False
    # The last choice of what is up, as far as `check` has seen it.
    up_before = None
    # The axes that the dialog began with.
    axes_before = None

    @classmethod
    def poll(cls, context):
        """One job at a time."""
        return super().poll(context)

    def invoke(self, context, event):
        """A dropped file opens a small dialog, the menu a file browser."""
        if Adjusting.handed is not None:
            return self.watch(context)
        self.by_hand = True
        self.up_before = self.axis_up
        self.axes_before = self.axis_forward, self.axis_up
        if not self.properties.is_property_set("orientation"):
            self.orientation = "FORMAT"
        if paths := self.paths_at_hand(context):
            foreseen.Look.at(paths, self.whole, self.reading())
            foreseen.Look.wait(SIZE_SECONDS)
        return self.invoke_popup(context)

    def follows_format(self):
        """Whether the files' format says which way is up. A preset of earlier versions changes the axes alone."""
        return self.orientation == "FORMAT" and self.axes_before in (None, (self.axis_forward, self.axis_up))

    def check(self, context):
        """Forward follows Up when that is chosen: else Blender's dialogs take back a choice of the axis Forward has."""
        if self.up_before not in (None, self.axis_up):
            self.axis_forward = {"Y": "-Z", "-Y": "Z"}.get(self.axis_up, "Y")
            self.up_before = self.axis_up
            return True
        return super().check(context)

    def draw(self, context):
        """The options beside the file browser."""
        layout = self.layout
        layout.use_property_split = True
        layout.prop(self, "faces")
        layout.prop(self, "unit")
        if self.unit == "CUSTOM":
            layout.prop(self, "scale")
        layout.prop(self, "orientation")
        if not self.follows_format():
            layout.prop(self, "axis_forward")
            layout.prop(self, "axis_up")
        if self.by_hand:
            self.draw_size(context)
        layout.prop(self, "origin")
        layout.prop(self, "frame")
        path = self.path_at_hand(context)
        if formats.is_recording(path):
            header, body = layout.panel("surfrecon_recordings")
            header.label(text="Recordings", text_ctxt=NAMES)
            if body is not None:
                for name in ("frames", "cameras", "whole", "poses", "axes"):
                    body.prop(self, name)
        if not formats.is_image(path):
            return
        header, body = layout.panel("surfrecon_images", default_closed=True)
        header.label(text="Images", text_ctxt=NAMES)
        if body is None:
            return
        body.prop(self, "images")
        if self.images == "DEPTHS":
            body.prop(self, "focal")
            body.prop(self, "centre")
            body.prop(self, "depth")
        else:
            body.prop(self, "pixel_step")
            body.prop(self, "pixels")
        body.prop(self, "pixel_scale")

    def draw_size(self, context):
        """The size that the files will have, by the unit and the axes that are chosen."""
        foreseen.Look.popup = context.region_popup
        paths = self.paths_at_hand(context)
        if not paths:
            return
        text = self.size_text(context, foreseen.Look.at(paths, self.whole, self.reading()))
        # The region of a popup is the one that it covers, which is wider.
        if len(text) <= POPUP_LETTERS and fits(context, text, 1 - NAMES_SHARE):
            row = self.layout.split(factor=NAMES_SHARE)
            label = row.row()
            label.alignment = "RIGHT"
            label.label(text="Size", text_ctxt=NAMES)
            row.label(text=text, translate=False)
        else:
            self.layout.label(text="Size", text_ctxt=NAMES)
            row = self.layout.row()
            row.alignment = "RIGHT"
            row.label(text=text, translate=False)

    def size_text(self, context, seen):
        """The size of files in which this was seen, in words."""
        if seen is None:
            return told("being read")
        if isinstance(seen, foreseen.TooLarge):
            return told("known after the import")
        if isinstance(seen, Exception) or seen.low is None:
            return told("not known")
        axes = self.axis_forward, self.axis_up
        if self.follows_format():
            axes = formats.axes_of(seen.paths, seen.notes)
        turned = np.abs(axis_conversion(from_forward=axes[0], from_up=axes[1])) @ (seen.high - seen.low)
        text = size(context, turned * self.factor(context, seen.paths, seen.notes, seen.of_frames))
        return f"{word('about')} {text}" if seen.is_part else text

    def paths_at_hand(self, context):
        """All files that are chosen in the file browser, or were dropped, as `launch` takes them."""
        first = self.path_at_hand(context)
        params = getattr(context.space_data, "params", None)
        if params is not None and hasattr(params, "directory"):
            folder = os.fsdecode(params.directory)
            names = [entry.name for entry in getattr(context, "selected_files", None) or ()]
        else:
            folder, names = self.directory, [entry.name for entry in self.files]
        paths = [os.path.join(folder, name) for name in names if name] or [first]
        # A folder alone is one that is looked into, unless it is a recording's.
        return [path for path in paths if os.path.isfile(path) or formats.is_recording(path)]

    def path_at_hand(self, context):
        """The first of the files that are chosen in the file browser, or were dropped."""
        params = getattr(context.space_data, "params", None)
        if params is not None and hasattr(params, "directory"):
            return os.path.join(os.fsdecode(params.directory), params.filename)
        name = self.files[0].name if self.files else ""
        return os.path.join(self.directory, name) if name else self.filepath

    def reading(self):
        """Keyword arguments of `surfrecon.open`."""
        depths = self.images == "DEPTHS"
        return {
            "camera": (*self.focal, *self.centre) if depths else None,
            "depth": self.depth,
            "scale": self.pixel_scale or None,
            "step": self.pixel_step or None,
            "pixels": self.pixels,
            "poses": self.poses,
            "axes": self.axes,
        }

    def execute(self, context):
        """After the dialog the window stays alive while files are read. Scripts wait."""
        foreseen.Look.forget()
        if self.by_hand and not bpy.app.background:
            self.by_hand = False
            return self.watch(context)
        return super().execute(context)

    def cancel(self, context):
        """The dialog is closed, or Blender ends the operator."""
        foreseen.Look.forget()
        super().cancel(context)

    def launch(self, context):
        """Looks what the files hold. It reads only what becomes an object."""
        paths = [os.path.join(self.directory, f.name) for f in self.files if f.name] or [self.filepath]
        # A file browser that is asked for a folder puts a separator behind it.
        paths = [os.path.normpath(path) if os.path.isdir(path) else path for path in paths]
        self.paths, self.opened = yield from recording.opened(paths, self.whole, self.reading())
        if not len(self.opened):
            raise Refused(f"{os.path.basename(self.paths[0])} holds no scan: choose another file")
        if self.follows_format():
            self.axis_forward, self.axis_up = formats.axes_of(self.paths, self.opened.notes)
        # An adjustment begins with the axes that were taken.
        self.orientation = "AXES"
        numbers = [k for k, scan in enumerate(self.opened) if isinstance(scan, surfrecon.Frame)]
        coloured = [self.opened[k].has_colour for k in numbers]
        chosen = {numbers[k] for k in recording.spread(coloured, self.frames)}
        self.others = [k for k in numbers if k not in chosen]
        staying = set(self.others)
        self.numbers = [k for k in range(len(self.opened)) if k not in staying]
        self.scans = [self.opened[k] for k in self.numbers]
        return recording.reading(self.scans)

    def factor(self, context, paths, notes, of_frames):
        """Units of the scene a unit of these files. Recordings and some formats are in metres."""
        preferred = "M" if of_frames or formats.is_in_metres(paths, notes) else preference("unit")
        unit = preferred if self.unit == "PREFERRED" else self.unit
        length = context.scene.unit_settings.scale_length
        return {"CUSTOM": self.scale, "SCENE": 1.0}.get(unit) or UNITS[unit] / length

    def finish(self, context, contents):
        """Puts the scans into a collection. Nothing stays if anything fails."""
        of_frames = all(isinstance(scan, surfrecon.Frame) for scan in self.opened)
        factor = self.factor(context, self.paths, self.opened.notes, of_frames)
        made, views, blind, damaged = [], [], 0, []
        try:
            for index, scan in zip(self.numbers, self.scans, strict=True):
                # Each is given back as soon as Blender has it.
                content, camera = contents.pop(0)
                if isinstance(content, surfrecon.FormatError):
                    damaged.append(sentence(content))
                    continue
                if camera is not None and not content.valid.any():
                    blind += 1
                    continue
                made.append(self.object_of(scan, content, factor))
                if camera is not None:
                    recording.note_frame(made[-1][0], self.paths, index)
                if camera is not None and self.cameras:
                    obj, _ = made[-1]
                    views.append((cameras.of_frame(camera, obj, np.array(content.world_from_sensor), factor), camera))
        except surfrecon.SurfreconError:
            remove([obj for obj, _ in made] + [view for view, _ in views])
            raise
        if damaged and not made:
            raise Refused(damaged[0])
        if not made:
            read = number(blind, "frame", "frames")
            raise Refused(f"No sample of the {read} that were read can be trusted: record the scene once more")
        objects = [obj for obj, _ in made]
        name = set_name(self.paths)
        collection = into_collection(context, name, objects)
        offset = place(made, self.blender_from_files(), self.origin)
        if offset is not None:
            collection["world_origin"] = [float(x) for x in offset]
            if self.origin == "AUTO":
                tell(
                    self,
                    {"WARNING"},
                    "The scans lie far from the origin and were moved: see the collection's world_origin",
                )
        self.keep_crs(collection, factor)
        for i, obj in enumerate(objects):
            tint(obj, i)
            show_colours(obj)
        if views:
            into_collection(context, f"{name} cameras", [view for view, _ in views], collection)
            cameras.take_picture_size(context.scene, *views[0])
        chosen = objects + self.stand_for_others(collection, factor, offset)
        select_only(context, chosen)
        if self.frame and (obstacle := show_in_views(context, chosen)) is not None:
            tell(self, {"INFO"}, f'"{obstacle}" is in the way: the scans are shown alone, in local view')
        if self.frame and self.is_watched():
            open_sidebar(context)
        self.tell(context, collection, objects, blind, damaged)

    def tell(self, context, collection, objects, blind, damaged):
        """Says in a line what came, and the rest in the report."""
        samples = sum(len(obj.data.vertices) for obj in objects)
        coloured = sum("colour" in obj.data.attributes for obj in objects)
        notes = []
        if damaged:
            skipped = f"{number(len(damaged), 'frame is', 'frames are')} damaged and skipped"
            notes.append(f"{skipped}: {damaged[0]}")
            tell(self, {"WARNING"}, notes[0])
        if blind:
            notes.append(f"{number(blind, 'frame has', 'frames have')} no sample to be trusted")
        notes += self.opened.notes
        note_import(collection, self.paths[0], len(objects), coloured, samples, len(self.others), notes)
        texts = [number(len(objects), "scan", "scans"), number(samples, "sample", "samples")]
        if 0 < coloured < len(objects):
            texts.append(f"{coloured:,} with colours")
        if self.others:
            texts.append(number(len(self.others), "frame in its file", "frames in their files"))
        low, high = union(map(in_world, objects))
        texts.append(size(context, high - low))
        more = f". Report has {number(len(notes), 'note', 'notes')}" if notes else ""
        tell(self, {"INFO"}, f"{', '.join(texts)}{more}")

    def keep_crs(self, collection, factor):
        """The coordinate reference system that the scans lie in, where they lie in one as they stand here."""
        try:
            crs = self.opened.crs
        except surfrecon.SurfreconError as problem:
            tell(self, {"WARNING"}, sentence(problem))
            return
        if crs is None:
            return
        if factor == 1.0 and np.array_equal(self.blender_from_files(), np.eye(4)):
            collection["crs"] = crs
        else:
            tell(self, {"WARNING"}, "Scaled or turned, the scans are in no coordinate reference system any more")

    def stand_for_others(self, collection, factor, offset):
        """A list with the object that stands for the frames that become none. It is empty without such frames."""
        if not self.others:
            return []
        name = f"{collection.name}: {number(len(self.others), 'more frame', 'more frames')}"
        others = recording.stand_for(name, self.paths, self.reading(), self.others, len(self.opened), factor)
        matrix = self.blender_from_files()
        if offset is not None:
            matrix[:3, 3] -= offset
        others.matrix_world = Matrix(matrix.tolist())
        others.empty_display_size = max(max(obj.dimensions) for obj in collection.objects) / 10
        collection.objects.link(others)
        return [others]

    def object_of(self, scan, content, factor):
        """The object of a scan, not yet placed, and its matrix."""
        pose = np.array(scan.world_from_sensor)
        if isinstance(content, surfrecon.RangeImage):
            pose = np.array(content.world_from_sensor)
            obj = scan_objects.object_from_range_image(scan.name, content, factor, self.faces)
        elif isinstance(content, surfrecon.Mesh):
            obj, origin = convert.object_from_mesh(scan.name, content, factor)
            obj[SCAN] = True
            pose[:3, 3] += pose[:3, :3] @ origin
        else:
            obj, origin = convert.object_from_points(scan.name, content, factor)
            if content.normals is not None:
                clouds.store_normals(obj.data, content.normals)
            obj[SCAN] = True
            pose[:3, 3] += pose[:3, :3] @ origin
        pose[:3, 3] *= factor
        return obj, pose

    def blender_from_files(self):
        """4 x 4: from the files' axes to Blender's."""
        return np.array(axis_conversion(from_forward=self.axis_forward, from_up=self.axis_up).to_4x4())


class SURFRECON_FH_scans(bpy.types.FileHandler):
    """Scans dropped into a view."""

    bl_idname = "SURFRECON_FH_scans"
    bl_label = "Range Scans"
    bl_import_operator = "surfrecon.import_scans"
    bl_file_extensions = ";".join(DROPPED)

    @classmethod
    def poll_drop(cls, context):
        """Whether files can be dropped here: where objects can be."""
        return poll_file_object_drop(context)


def remove(objects):
    """Removes objects and their meshes."""
    objects = list(objects)
    bpy.data.batch_remove([obj.data for obj in objects] + objects)


def unregister():
    """Ends what a dialog looks at."""
    foreseen.Look.forget()
