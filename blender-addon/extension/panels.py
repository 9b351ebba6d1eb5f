# SPDX-License-Identifier: GPL-3.0-or-later
"""The sidebar tab "Scans" and the entry in File > Import."""

import math

import bpy

from . import convert
from .job import Running
from .operators.cluster import REPORT as CLUSTERED
from .operators.error_map import FIGURES, RAMP_NODE
from .operators.import_scans import ENDINGS
from .operators.merge import REPORT
from .operators.quads import REPORT as GRIDDED
from .operators.reconstruct import REPORT as RECONSTRUCTED
from .operators.sculpt import REPORT as SCULPTED


class ScansPanel:
    """Where the panels are."""

    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Scans"


class SURFRECON_PT_merge(ScansPanel, bpy.types.Panel):
    """Importing and merging."""

    bl_label = "Range Scans"

    def draw(self, context):
        """Buttons, or the progress of what is running."""
        layout = self.layout
        if Running.job is not None:
            layout.label(text=Running.title)
            layout.progress(factor=Running.fraction, type="BAR", text=f"{Running.stage} {Running.fraction:.0%}")
            layout.operator("surfrecon.cancel", icon="CANCEL")
            return
        layout.operator_context = "INVOKE_DEFAULT"
        layout.operator("surfrecon.import_scans", icon="IMPORT")
        scans = [obj for obj in context.selected_objects if convert.is_range_image(obj)]
        others = [
            obj for obj in context.selected_objects if obj.type == "MESH" and obj not in scans and REPORT not in obj
        ]
        layout.label(text=f"Selected: {len(scans)} scans, {len(others)} meshes")
        layout.operator("surfrecon.merge", icon="MOD_REMESH")
        layout.operator("surfrecon.sculpt", icon="MOD_DECIM")
        layout.operator("surfrecon.quads", icon="MESH_GRID")
        layout.operator("surfrecon.reconstruct", icon="OUTLINER_DATA_POINTCLOUD")
        layout.operator("surfrecon.cluster", icon="MOD_TRIANGULATE")
        obj = context.object
        if obj is not None and len(obj.surfrecon_levels) > 0:
            layout.prop(obj, "surfrecon_level")


class SURFRECON_PT_options(ScansPanel, bpy.types.Panel):
    """Options of the merge."""

    bl_label = "Merge Options"
    bl_parent_id = "SURFRECON_PT_merge"

    def draw(self, context):
        """One row an option; lengths of 0 are measured from the scans."""
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        settings = context.scene.surfrecon
        layout.label(text="0: measured from the scans", icon="INFO")
        column = layout.column(align=True)
        column.prop(settings, "voxel")
        column.prop(settings, "merge_distance")
        column = layout.column(align=True)
        column.prop(settings, "close_holes")
        row = column.row()
        row.active = settings.close_holes
        row.prop(settings, "max_hole_length")
        layout.prop(settings, "min_component_share", text="Smallest part")
        column = layout.column(align=True)
        column.prop(settings, "edge_limit")
        column.prop(settings, "grazing_limit")
        layout.prop(settings, "threads")


class SURFRECON_PT_report(ScansPanel, bpy.types.Panel):
    """Figures of what made the active object."""

    bl_label = "Result"
    bl_parent_id = "SURFRECON_PT_merge"

    @classmethod
    def poll(cls, context):
        """Only for results."""
        return context.object is not None and any(name in context.object for name in LINES)

    def draw(self, context):
        """Two columns: what, how much."""
        split = self.layout.split(factor=0.5)
        names, values = split.column(), split.column()
        obj = context.object
        kind = next(name for name in LINES if name in obj)
        for name, value in LINES[kind](context, obj[kind]):
            names.label(text=name)
            values.label(text=value)


class SURFRECON_PT_error(ScansPanel, bpy.types.Panel):
    """Distances of the active object to the scans."""

    bl_label = "Error Map"
    bl_parent_id = "SURFRECON_PT_merge"

    @classmethod
    def poll(cls, context):
        """Only for meshes that aren't scans."""
        return (
            context.object is not None and context.object.type == "MESH" and not convert.is_range_image(context.object)
        )

    def draw(self, context):
        """The button, then the legend and the figures."""
        layout = self.layout
        if Running.job is None:
            layout.operator_context = "INVOKE_DEFAULT"
            layout.operator("surfrecon.error_map", icon="COLOR")
        if FIGURES not in context.object:
            return
        figures = context.object[FIGURES].to_dict()
        for slot in context.object.material_slots:
            if slot.material is not None and slot.material.use_nodes and RAMP_NODE in slot.material.node_tree.nodes:
                layout.template_color_ramp(slot.material.node_tree.nodes[RAMP_NODE], "color_ramp")
                row = layout.row()
                row.label(text=length(context, 0))
                row.label(text=length(context, figures["limit"]))
                break
        split = layout.split(factor=0.5)
        names, values = split.column(), split.column()
        for name in ("mean", "rms", "p95", "max"):
            names.label(text={"rms": "RMS", "p95": "95 % below"}.get(name, name.capitalize()))
            values.label(text=length(context, figures[name]))


def sculpt_lines(context, figures):
    """The figures of a sculpted scan as (name, value) texts."""
    figures = figures.to_dict()
    full = max(figures["full_triangles"], 1)
    yield "Triangles", f"{figures['triangles']:,}"
    yield "Of all", f"{100 * figures['triangles'] / full:.1f} %"
    yield "Tolerance", length(context, figures["tolerance"])
    yield "Largest error", length(context, figures["max_error"])
    yield "RMS error", length(context, figures["rms_error"])
    yield "Samples not covered", f"{figures['isolated_pixels']:,}"
    yield "Time", f"{sum(figures['seconds'].values()):.2f} s"


def reconstruct_lines(context, figures):
    """The figures of a surface through points as (name, value) texts."""
    figures = figures.to_dict()
    yield "Points", f"{figures['points']:,}"
    yield "On the surface", f"{figures['used']:,}"
    yield "Not finite, copies", f"{figures['not_finite']:,}, {figures['duplicate']:,}"
    yield "Inside, outside", f"{figures['inside']:,}, {figures['outside']:,}"
    yield "Taken as", "closed" if figures["closed"] else "open"
    yield "Tetrahedra", f"{figures['tetrahedra']:,}"
    # The seconds of a surface include those of its stages.
    seconds = figures["seconds"]
    yield "Time", f"{seconds['sort'] + seconds['tetrahedralize'] + seconds['surface']:.2f} s"


def quads_lines(context, figures):
    """The figures of a quad grid as (name, value) texts."""
    figures = figures.to_dict()
    yield "Vertices", f"{figures['rows']} x {figures['columns']}"
    yield "Quads", f"{figures['quads']:,}"
    yield "Tiles", "{} x {}".format(*figures["tiles"])
    for name, text in (("relative_error", "Relative error"), ("uniform_relative_error", "Of the uniform grid")):
        yield text, f"{100 * figures[name]:.4g} %"
    for name, text in (("rms_error", "RMS error"), ("max_error", "Largest error")):
        yield text, length(context, figures[name])
    if "max_residual" in figures:
        yield "Surface off the grid by", length(context, figures["max_residual"])
    yield "Gaps filled", f"{figures['gaps_filled']:,}"
    yield "Time", f"{sum(figures['seconds'].values()):.2f} s"


def merge_lines(context, report):
    """The figures of a merge's report as (name, value) texts."""
    report = report.to_dict()
    faces = report["faces"]
    total = max(sum(faces), 1)
    closed, left = report["holes"]
    parts, _ = report["dropped_components"]
    yield "Scans", f"{report['scans']}"
    yield "Their triangles", f"{report['input_triangles']:,}"
    yield "Triangles", f"{int(sum(faces)):,}"
    yield "Voxel", length(context, report["voxel"])
    yield "Merge distance", length(context, report["merge_distance"])
    if "overlap_residual" in report:
        yield "Scans disagree by", length(context, report["overlap_residual"])
    yield "Holes closed, left", f"{closed}, {left}"
    yield "Closed up to", length(context, report["max_hole_length"])
    yield "Small parts dropped", f"{parts}"
    yield "Case a, b, c", ", ".join(f"{100 * n / total:.1f}" for n in faces) + " %"
    yield "Time", f"{sum(report['seconds'].values()):.2f} s"
    yield "Memory", f"{report['working_bytes'] / 1e6:.0f} MB"


def cluster_lines(context, figures):
    """The figures of a clustered surface as (name, value) texts."""
    figures = figures.to_dict()
    yield "Vertices", f"{figures['vertices']:,}"
    yield "Triangles", f"{figures['triangles']:,}"
    yield "Mean smallest angle", f"{math.degrees(figures['mean_smallest_angle']):.1f}°"
    yield "Smallest angle", f"{math.degrees(figures['smallest_angle']):.1f}°"
    if "max_error" in figures:
        yield "Largest error", length(context, figures["max_error"])
    if figures["kept_input"]:
        yield "Result", "the input: nothing coarser is that near"
    if figures["cut_edges"]:
        yield "Edges cut", f"{figures['cut_edges']:,}"


def length(context, value):
    """A length in the scene's unit."""
    settings = context.scene.unit_settings
    if settings.system == "NONE":
        return f"{value:.4g}"
    return bpy.utils.units.to_string(settings.system, "LENGTH", value * settings.scale_length, precision=4)


# Custom property of a result -> its lines.
LINES = {
    REPORT: merge_lines,
    SCULPTED: sculpt_lines,
    GRIDDED: quads_lines,
    RECONSTRUCTED: reconstruct_lines,
    CLUSTERED: cluster_lines,
}


def menu_import(self, context):
    """The entry in File > Import."""
    self.layout.operator("surfrecon.import_scans", text=f"Range Scans ({', '.join(ENDINGS)})")


def menu_export(self, context):
    """The entry in File > Export."""
    self.layout.operator("surfrecon.export_scans", text="Range Scans (.conf, .ptx, .e57)")


CLASSES = (SURFRECON_PT_merge, SURFRECON_PT_options, SURFRECON_PT_report, SURFRECON_PT_error)


def register():
    """Registers panels and menu."""
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    bpy.types.TOPBAR_MT_file_import.append(menu_import)
    bpy.types.TOPBAR_MT_file_export.append(menu_export)


def unregister():
    """Takes them away again."""
    bpy.types.TOPBAR_MT_file_export.remove(menu_export)
    bpy.types.TOPBAR_MT_file_import.remove(menu_import)
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
