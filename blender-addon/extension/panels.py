# SPDX-License-Identifier: GPL-3.0-or-later
"""The sidebar tab "Scans", in the order of the work: bring in, look, clean, align and merge, reduce, measure."""

import bpy

from . import chosen, scan_objects
from .false_colours import FIGURES, RAMP_NODE, is_shown, limit_of, shows_error
from .operators.merge import REPORT
from .operators.show_sources import are_shown, meant
from .recording import FRAMES, is_recording
from .reports import LINES, lie_apart
from .running import Running
from .sources import what_is_gone
from .translations import NAMES, OPERATORS, word
from .words import length, number, wrapped

ALIGN = ("surfrecon.align", "SNAP_ON")


class ScansPanel:
    """Where the panels are."""

    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Scans"
    bl_translation_context = NAMES


def buttons(layout, *operators):
    """One button an operator (name, icon); they wait while something runs."""
    column = layout.column(align=True)
    column.enabled = Running.job is None
    column.operator_context = "INVOKE_DEFAULT"
    for name, icon in operators:
        column.operator(name, icon=icon)


class SURFRECON_PT_running(ScansPanel, bpy.types.Panel):
    """What is running, and what is selected."""

    bl_label = "Range Scans"
    bl_options = {"HIDE_HEADER"}

    def draw(self, context):
        """The progress, or what the buttons would work on."""
        layout = self.layout
        if Running.job is not None:
            layout.label(text=Running.title, text_ctxt=OPERATORS)
            layout.progress(factor=Running.fraction, type="BAR", text=Running.text())
            layout.operator("surfrecon.cancel", icon="CANCEL")
            return
        scans = [obj for obj in context.selected_objects if scan_objects.is_range_image(obj)]
        meshes = [obj for obj in context.selected_objects if obj.type == "MESH" and obj not in scans]
        meshes = [obj for obj in meshes if chosen.kind_of(obj) is None]
        # Those that operators leave out.
        others = [obj for obj in context.selected_objects if chosen.kind_of(obj) is not None]
        counts = (scans, "scan", "scans"), (meshes, "mesh", "meshes"), (others, "other", "others")
        texts = [number(len(some), word(one), word(many)) for some, one, many in counts if some or one != "other"]
        frames = sum(len(obj[FRAMES]) for obj in context.selected_objects if is_recording(obj))
        if frames:
            texts.append(number(frames, word("frame in its file"), word("frames in their files")))
        layout.label(text=f"{word('Selection')}: {', '.join(texts)}", translate=False)
        buttons(layout, ("surfrecon.select_scans", "RESTRICT_SELECT_OFF"))


class SURFRECON_PT_bring(ScansPanel, bpy.types.Panel):
    """Scans from files and from the scene itself."""

    bl_label = "Bring In"

    def draw(self, context):
        """Its buttons."""
        buttons(
            self.layout,
            ("surfrecon.import_scans", "IMPORT"),
            ("surfrecon.reproject", "CAMERA_DATA"),
            ("surfrecon.virtual_scan", "OUTLINER_OB_CAMERA"),
        )


class SURFRECON_PT_look(ScansPanel, bpy.types.Panel):
    """How scans are shown."""

    bl_label = "Look"

    def draw(self, context):
        """Its buttons, and the switch of a result's sources."""
        buttons(self.layout, ("surfrecon.tint_scans", "COLOR"))
        sources = meant(context)
        if sources:
            self.layout.operator("surfrecon.show_sources", icon="HIDE_OFF", depress=are_shown(sources))


class SURFRECON_PT_place(ScansPanel, bpy.types.Panel):
    """How large scans are, and where the ground is."""

    bl_label = "Size and Ground"

    def draw(self, context):
        """Its buttons."""
        buttons(
            self.layout,
            ("surfrecon.true_size", "FIXED_SIZE"),
            ("surfrecon.ground", "VIEW_PERSPECTIVE"),
        )


class SURFRECON_PT_clean(ScansPanel, bpy.types.Panel):
    """What should not be merged."""

    bl_label = "Clean"

    def draw(self, context):
        """Its buttons."""
        buttons(
            self.layout,
            ("surfrecon.clean", "BRUSH_DATA"),
            ("surfrecon.box_around", "CUBE"),
            ("surfrecon.keep_inside", "SELECT_INTERSECT"),
            ("surfrecon.remove_inside", "SELECT_SUBTRACT"),
            ("surfrecon.remove_background", "AXIS_TOP"),
        )


class SURFRECON_PT_merge(ScansPanel, bpy.types.Panel):
    """One surface of many scans, or of points."""

    bl_label = "Merge"

    def draw(self, context):
        """Its buttons."""
        buttons(
            self.layout,
            ALIGN,
            ("surfrecon.merge", "MOD_REMESH"),
            ("surfrecon.merge_to_file", "EXPORT"),
            ("surfrecon.reconstruct", "OUTLINER_DATA_POINTCLOUD"),
        )


class SURFRECON_PT_options(ScansPanel, bpy.types.Panel):
    """Options of the merge."""

    bl_label = "Merge Options"
    bl_parent_id = "SURFRECON_PT_merge"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        """One row an option; lengths of 0 are measured from the scans."""
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        layout.label(text="0: measured from the scans", text_ctxt=NAMES, icon="INFO")
        context.scene.surfrecon.draw_options(layout)
        layout.prop(context.scene.surfrecon, "threads")


class SURFRECON_PT_reduce(ScansPanel, bpy.types.Panel):
    """Lighter meshes."""

    bl_label = "Reduce"

    def draw(self, context):
        """Its buttons."""
        buttons(
            self.layout,
            ("surfrecon.sculpt", "MOD_DECIM"),
            ("surfrecon.quads", "MESH_GRID"),
            ("surfrecon.remesh", "MOD_TRIANGULATE"),
        )
        # The slider of an object with levels of detail.
        obj = context.object
        if obj is not None and len(obj.surfrecon_levels) > 0:
            self.layout.prop(obj, "surfrecon_level")


class SURFRECON_PT_measure(ScansPanel, bpy.types.Panel):
    """How near a result is."""

    bl_label = "Measure"

    def draw(self, context):
        """Its buttons."""
        buttons(self.layout, ("surfrecon.error_map", "COLORSET_04_VEC"), ("surfrecon.measure", "DRIVER_DISTANCE"))


class SURFRECON_PT_error(ScansPanel, bpy.types.Panel):
    """The colours of the error map and what they mean."""

    bl_label = "Error Map"
    bl_parent_id = "SURFRECON_PT_measure"

    @classmethod
    def poll(cls, context):
        """Only for objects that show one."""
        return context.object is not None and is_shown(context.object)

    def draw(self, context):
        """The legend and the figures."""
        layout = self.layout
        material = next(slot.material for slot in context.object.material_slots if shows_error(slot.material))
        nodes = material.node_tree.nodes
        layout.template_color_ramp(nodes[RAMP_NODE], "color_ramp")
        limit = limit_of(context.object)
        row = layout.row()
        for share in (0, 0.5, 1):
            cell = row.row()
            cell.alignment = ("LEFT", "CENTER", "RIGHT")[int(2 * share)]
            cell.label(text=length(context, share * limit))
        layout.operator("surfrecon.error_hide", icon="X")
        if FIGURES not in context.object:
            return
        figures = context.object[FIGURES].to_dict()
        split = layout.split(factor=0.5)
        names, values = split.column(), split.column()
        for name in ("mean", "rms", "p95", "max"):
            names.label(text={"rms": "RMS", "p95": "95 % below"}.get(name, name.capitalize()), text_ctxt=NAMES)
            values.label(text=length(context, figures[name]))


class SURFRECON_PT_report(ScansPanel, bpy.types.Panel):
    """Figures of what made the active object, and of what measured it."""

    bl_label = "Report"

    @classmethod
    def poll(cls, context):
        """Only for results."""
        return context.object is not None and any(name in context.object for name in LINES)

    def draw(self, context):
        """Two columns: what, how much. What has no value is a sentence over both."""
        obj = context.object
        for name, lines in LINES.items():
            if name not in obj:
                continue
            try:
                figures = list(lines(context, obj[name]))
            except (AttributeError, KeyError, TypeError, ValueError):
                # Custom properties can be changed by anyone.
                continue
            box = self.layout.box().column()
            for what, value in figures:
                if value is None:
                    sentence(context, box, what)
                    continue
                row = box.split(factor=0.55)
                row.label(text=what, text_ctxt=NAMES)
                row.label(text=value)
            if name == REPORT and lie_apart(obj[name]):
                buttons(box, ALIGN)
        if gone := what_is_gone(obj):
            sentence(context, self.layout.box().column(), gone)


def sentence(context, layout, text):
    """A text over as many lines as it takes."""
    column = layout.column(align=True)
    for line in wrapped(context, text):
        column.label(text=line, translate=False)


CLASSES = (
    SURFRECON_PT_running,
    SURFRECON_PT_bring,
    SURFRECON_PT_look,
    SURFRECON_PT_place,
    SURFRECON_PT_clean,
    SURFRECON_PT_merge,
    SURFRECON_PT_options,
    SURFRECON_PT_reduce,
    SURFRECON_PT_measure,
    SURFRECON_PT_error,
    SURFRECON_PT_report,
)


def register():
    """Registers the panels."""
    for cls in CLASSES:
        bpy.utils.register_class(cls)


def unregister():
    """Takes them away again."""
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
