# SPDX-License-Identifier: GPL-3.0-or-later
"""File > Export > Range Scans: the selected scans with grids and poses, in formats Blender has no exporter for."""

import os

import bpy
import numpy as np
import surfrecon
from bpy.props import EnumProperty, FloatProperty, StringProperty

from .. import declared, scan_objects
from ..by_format import ExportByFormat
from ..job import refuse_no_numbers
from ..running import Refused
from ..telling import tell
from ..words import sentence

# Words for the formats that the library writes.
WORDS = {
    "conf": ("Stanford (.conf)", "A list that places the scans, and beside it a range-grid PLY for each"),
    "ptx": ("PTX (.ptx)", "One text file of all scans, seen from a point each"),
    "e57": ("E57 (.e57)", "One binary file of all scans, seen from a point each"),
}
FORMATS = tuple(
    (ending.upper(), *WORDS.get(ending, (f"{name} (.{ending})", "")))
    for name, endings in surfrecon.formats(written="images").items()
    for ending in endings
)


@declared.operator("write")
class SURFRECON_OT_export_scans(bpy.types.Operator, ExportByFormat):
    """Runs the operation `write`."""

    bl_options = {"PRESET"}

    filename_ext = ".conf"
    filter_glob: StringProperty(default=";".join(f"*.{kind.lower()}" for kind, *_ in FORMATS), options={"HIDDEN"})
    file_format: EnumProperty(name="Format", items=FORMATS, default="CONF")
    scale: FloatProperty(
        name="Scale", description="Units of the file a unit of the scene", default=1.0, min=1e-9, max=1e9
    )

    def draw(self, context):
        """The options beside the file browser."""
        self.layout.use_property_split = True
        self.layout.prop(self, "file_format")
        self.layout.prop(self, "scale")

    def execute(self, context):
        """Writes all or nothing but grids without a list."""
        objects = [obj for obj in context.selected_objects if scan_objects.is_range_image(obj)]
        try:
            refuse_no_numbers(self)
            if not objects:
                raise Refused("No range scan is selected: select objects that File > Import > Range Scans has made")
            depsgraph = context.evaluated_depsgraph_get()
            path = self.path()
            images = [self.image(obj, depsgraph) for obj in objects]
            surfrecon.write_scans(path, images)
            note = surfrecon.crs_note(path, "images", next((image.crs for image in images if image.crs), None))
        except (Refused, surfrecon.SurfreconError) as problem:
            tell(self, {"ERROR"}, sentence(problem))
            return {"CANCELLED"}
        if note:
            tell(self, {"WARNING"}, sentence(note))
        tell(self, {"INFO"}, f"{len(objects)} scans written to {os.path.basename(path)}")
        return {"FINISHED"}

    def image(self, obj, depsgraph):
        """The range image of an object in the file's unit, where it was before importing moved it."""
        image = scan_objects.scan_of_object(obj, depsgraph)
        if not isinstance(image, surfrecon.RangeImage):
            raise Refused(f'"{obj.name}" is no longer one vertex a pixel: export it as a mesh')
        pose = np.array(image.world_from_sensor)
        for collection in obj.users_collection:
            pose[:3, 3] += origin_of(collection)
            image.crs = crs_of(collection) or image.crs
        image.world_from_sensor = pose
        if self.scale != 1.0:
            image = image.transformed(surfrecon.Similarity(np.diag([self.scale, self.scale, self.scale, 1.0])))
        return image


def origin_of(collection):
    """The origin that importing took off the scans of a collection."""
    try:
        origin = np.array(collection.get("world_origin", (0.0, 0.0, 0.0)), np.float64)
    except (TypeError, ValueError):
        origin = None
    if origin is None or origin.shape != (3,) or not np.isfinite(origin).all():
        raise Refused(
            f'The collection "{collection.name}" has a world_origin that is no place:'
            " set its custom property to three numbers, or delete it"
        )
    return origin


def crs_of(collection):
    """The text of the coordinate reference system that importing found for the scans of a collection."""
    crs = collection.get("crs")
    if crs is not None and not isinstance(crs, str):
        raise Refused(
            f'The collection "{collection.name}" has a crs that is no text: set its custom property, or delete it'
        )
    return crs
