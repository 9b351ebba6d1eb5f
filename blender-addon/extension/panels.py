# SPDX-License-Identifier: GPL-3.0-or-later
"""The sidebar tab "Scans", in the order of the work: bring in, look, clean, align and merge, measure, reduce."""

import bpy

from . import chosen, scan_objects
from .declared import OPERATIONS
from .false_colours import (
    CROSSING,
    FIGURES,
    OVERHANG,
    RAMP_NODE,
    THIN,
    is_shown,
    limit_of,
    shows_error,
    shows_faults,
)
from .imported import IMPORTED, import_lines, import_of
from .menus import FILES
from .operators.merge import REPORT
from .operators.show_sources import are_shown, meant
from .recording import FRAMES, is_recording
from .reports import LINES, lie_apart
from .running import Running
from .sources import what_is_gone
from .summary import SURFACES, folded, in_short
from .telling import told
from .translations import NAMES, OPERATORS, word
from .words import fits, length, letters, number, wrapped

ALIGN = ("surfrecon.align", "SNAP_ON")
GLB = ("surfrecon.export_glb", "EXPORT")

# The share of the width that labels of figures have.
LABELS = 0.45

# The share of the width that the text of a bar has.
BAR = 0.85


class ScansPanel:
    """The place of the panels."""

    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Scans"
    bl_translation_context = NAMES

    # Of its buttons the operators and the icons.
    operators = ()

    def draw(self, context):
        """Its buttons."""
        buttons(self.layout, *self.operators)


def buttons(layout, *operators):
    """One button an operator (name, icon). They wait while something runs, and the one that was pressed shows the
    progress: it is seen wherever one has scrolled to, and no other button moves. Returns the column.
    """
    column = layout.column(align=True)
    column.operator_context = "INVOKE_DEFAULT"
    for name, icon in operators:
        button(column, name, icon)
    return column


def button(column, name, icon, **look):
    """One of `buttons`."""
    row = column.row(align=True)
    if Running.job is not None and Running.title == label_of(name):
        # The stage stands at the top, where there is more room.
        row.progress(factor=Running.fraction, type="BAR", text=Running.text(letters=0))
        row.operator("surfrecon.cancel", text="", icon="CANCEL")
        return
    row.enabled = Running.job is None
    row.operator(name, icon=icon, **look)


def label_of(name):
    """The name of an operator, in English."""
    return getattr(bpy.types, f"SURFRECON_OT_{name.removeprefix('surfrecon.')}").bl_label


class SURFRECON_PT_running(ScansPanel, bpy.types.Panel):
    """The running job, and the selection."""

    bl_label = "Range Scans"
    bl_options = {"HIDE_HEADER"}

    def draw(self, context):
        """The progress, or what the buttons would work on."""
        layout = self.layout
        if Running.job is not None:
            # As many rows as otherwise: what is below stays where it is.
            row = layout.row()
            row.label(text=Running.title, text_ctxt=OPERATORS)
            row.operator("surfrecon.cancel", text="", icon="CANCEL", emboss=False)
            column = layout.column(align=True)
            column.progress(factor=Running.fraction, type="BAR", text=Running.text(BAR * letters(context)))
            button(column, *GLB)
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
        buttons(layout, ("surfrecon.select_scans", "RESTRICT_SELECT_OFF"), GLB)


class SURFRECON_PT_bring(ScansPanel, bpy.types.Panel):
    """Scans from files and from the scene itself."""

    bl_label = "Bring In"

    operators = (
        ("surfrecon.import_scans", "IMPORT"),
        ("surfrecon.reproject", "CAMERA_DATA"),
        ("surfrecon.virtual_scan", "OUTLINER_OB_CAMERA"),
    )


class SURFRECON_PT_look(ScansPanel, bpy.types.Panel):
    """How scans are shown."""

    bl_label = "Look"

    operators = (("surfrecon.tint_scans", "COLOR"),)

    def draw(self, context):
        """Its buttons, and the switch of a result's sources."""
        column = buttons(self.layout, *self.operators)
        sources = meant(context)
        # It stays where nothing has sources: buttons below it would jump whenever a result is made.
        button(column, "surfrecon.show_sources", "HIDE_OFF", depress=bool(sources) and are_shown(sources))


class SURFRECON_PT_place(ScansPanel, bpy.types.Panel):
    """How large scans are, and where the ground is."""

    bl_label = "Size and Ground"

    operators = (
        ("surfrecon.true_size", "FIXED_SIZE"),
        ("surfrecon.ground", "VIEW_PERSPECTIVE"),
    )


class SURFRECON_PT_clean(ScansPanel, bpy.types.Panel):
    """Removes what should not be merged."""

    bl_label = "Clean"

    operators = (
        ("surfrecon.clean", "BRUSH_DATA"),
        ("surfrecon.box_around", "CUBE"),
        ("surfrecon.keep_inside", "SELECT_INTERSECT"),
        ("surfrecon.remove_inside", "SELECT_SUBTRACT"),
        ("surfrecon.remove_background", "AXIS_TOP"),
    )


class SURFRECON_PT_merge(ScansPanel, bpy.types.Panel):
    """One surface of many scans, or of points."""

    bl_label = "Merge"

    operators = (
        ALIGN,
        ("surfrecon.merge", "MOD_REMESH"),
        ("surfrecon.align_merge", "AUTOMERGE_ON"),
        ("surfrecon.merge_to_file", "EXPORT"),
        ("surfrecon.reconstruct", "OUTLINER_DATA_POINTCLOUD"),
        ("surfrecon.close_surface", "MESH_UVSPHERE"),
    )


class SURFRECON_PT_options(ScansPanel, bpy.types.Panel):
    """Options of the merge."""

    bl_label = "Merge Options"
    bl_parent_id = "SURFRECON_PT_merge"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        """One row an option. Lengths of 0 are measured from the scans."""
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        layout.label(text="0: measured from the scans", text_ctxt=NAMES, icon="INFO")
        context.scene.surfrecon.draw_options(layout)
        layout.prop(context.scene.surfrecon, "threads")


class SURFRECON_PT_measure(ScansPanel, bpy.types.Panel):
    """How near a result is."""

    bl_label = "Measure"

    operators = (
        ("surfrecon.error_map", "COLORSET_04_VEC"),
        ("surfrecon.measure", "DRIVER_DISTANCE"),
        ("surfrecon.check_print", "CHECKMARK"),
    )


class SURFRECON_PT_error(ScansPanel, bpy.types.Panel):
    """The colours of the error map and what they mean."""

    bl_label = "Error Map"
    bl_parent_id = "SURFRECON_PT_measure"

    @classmethod
    def poll(cls, context):
        """Only for objects that show one."""
        return context.object is not None and is_shown(context.object) and not shows_faults(context.object)

    def draw(self, context):
        """The legend and the figures."""
        layout = self.layout
        draw_ramp(layout, context.object)
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


def draw_ramp(layout, obj):
    """The scale of the colours that an object shows."""
    material = next(slot.material for slot in obj.material_slots if shows_error(slot.material))
    layout.template_color_ramp(material.node_tree.nodes[RAMP_NODE], "color_ramp")


class SURFRECON_PT_faults(ScansPanel, bpy.types.Panel):
    """The colours of faults for printing and what they mean."""

    bl_label = "Faults for Printing"
    bl_parent_id = "SURFRECON_PT_measure"

    @classmethod
    def poll(cls, context):
        """Only for objects that show them."""
        return context.object is not None and shows_faults(context.object)

    def draw(self, context):
        """The legend."""
        layout = self.layout
        draw_ramp(layout, context.object)
        split = layout.split(factor=LABELS)
        places, names = split.column(), split.column()
        faults = (0, word("None")), (OVERHANG, word("Overhang")), (THIN, word("Thin wall"))
        for place, name in (*faults, (CROSSING, word("Crosses another"))):
            places.label(text=f"{place:g}", translate=False)
            names.label(text=name, translate=False)
        layout.operator("surfrecon.error_hide", icon="X")


class SURFRECON_PT_reduce(ScansPanel, bpy.types.Panel):
    """Lighter meshes, and what else surfaces become."""

    bl_label = "Reduce"

    operators = (
        ("surfrecon.sculpt", "MOD_DECIM"),
        ("surfrecon.quads", "MESH_GRID"),
        ("surfrecon.remesh", "MOD_TRIANGULATE"),
        ("surfrecon.prepare_print", "MOD_SOLIDIFY"),
        ("surfrecon.unwrap", "UV"),
    )

    def draw(self, context):
        """Its buttons, those that no panel has, and the slider of levels."""
        buttons(self.layout, *self.operators, *others())
        # The slider of an object with levels of detail.
        obj = context.object
        if obj is not None and len(obj.surfrecon_levels) > 0:
            self.layout.prop(obj, "surfrecon_level")


def others():
    """Operators that operations declare and no panel names: those that are new."""
    named = {name for panel in CLASSES for name, _ in panel.operators}
    declared = (operation.operator for operation in OPERATIONS.values() if operation.operator is not None)
    names = (f"surfrecon.{identifier}" for identifier, _, _ in declared)
    return [(name, "MESH_DATA") for name in names if name not in named and name not in FILES]


class SURFRECON_PT_report(ScansPanel, bpy.types.Panel):
    """Figures of what made the active object, and of what measured it."""

    bl_label = "Report"

    @classmethod
    def poll(cls, context):
        """Only for results, and for what was imported."""
        obj = context.object
        return obj is not None and (any(name in obj for name in LINES) or import_of(obj) is not None)

    def draw(self, context):
        """The object's name, five lines and what is said in sentences. Other figures are folded."""
        obj = context.object
        self.layout.label(text=obj.name, icon="OBJECT_DATA", translate=False)
        summary = lines_of(in_short, context, obj)
        if summary:
            rows(context, self.layout.box().column(), summary)
        for name, lines in LINES.items():
            figures = lines_of(lines, context, obj[name]) if name in obj else []
            if not figures:
                continue
            first, rest = folded(figures, summary and name in SURFACES)
            needs_aligning = name == REPORT and lie_apart(obj[name])
            if first or needs_aligning:
                box = self.layout.box().column()
                rows(context, box, first)
                if needs_aligning:
                    buttons(box, ALIGN)
            if rest:
                header, body = self.layout.panel(f"{name}_figures", default_closed=True)
                header.label(text="All figures", text_ctxt=NAMES)
                if body is not None:
                    rows(context, body.column(), rest)
        if gone := what_is_gone(obj):
            sentence(context, self.layout.box().column(), gone)
        imported = import_of(obj)
        if imported is not None:
            box = self.layout.box().column()
            box.label(text=imported.name, icon="IMPORT", translate=False)
            rows(context, box, lines_of(import_lines, context, imported[IMPORTED]))


def lines_of(lines, context, what):
    """The (name, value) texts. There are none where they can't be told, since anyone can change custom properties."""
    try:
        return list(lines(context, what))
    except (AttributeError, KeyError, TypeError, ValueError):
        return []


def rows(context, layout, figures):
    """Two columns: what, how much. What has no value is a sentence over both."""
    for what, value in figures:
        if value is None:
            sentence(context, layout, what)
            continue
        if fits(context, word(what), LABELS) and fits(context, value, 1 - LABELS):
            row = layout.split(factor=LABELS)
            row.label(text=what, text_ctxt=NAMES)
            row.label(text=value, translate=False)
        else:
            layout.label(text=what, text_ctxt=NAMES)
            row = layout.row()
            row.alignment = "RIGHT"
            row.label(text=value, translate=False)


def sentence(context, layout, text):
    """A text over as many lines as it takes."""
    column = layout.column(align=True)
    for line in wrapped(context, told(text)):
        column.label(text=line, translate=False)


CLASSES = (
    SURFRECON_PT_running,
    SURFRECON_PT_bring,
    SURFRECON_PT_look,
    SURFRECON_PT_place,
    SURFRECON_PT_clean,
    SURFRECON_PT_merge,
    SURFRECON_PT_options,
    SURFRECON_PT_measure,
    SURFRECON_PT_error,
    SURFRECON_PT_faults,
    SURFRECON_PT_reduce,
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
