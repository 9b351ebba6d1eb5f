"""The quad grid operator: true quads with image coordinates, triangles, the native surface, messages, undo."""

from importlib import import_module

import bpy
import numpy as np
import pytest
import surfrecon
from files import write_set
from mathutils import Vector
from shapes import torus, torus_scans
from test_merge import add_mesh


@pytest.fixture
def scan(tmp_path):
    image = torus_scans(pixels=120)[0]
    bpy.ops.surfrecon.import_scans(filepath=str(write_set(tmp_path, [image])))
    obj = bpy.data.objects[image.name]
    bpy.context.view_layer.objects.active = obj
    return obj


def values(obj, name, count=1, dtype=np.float32, field="value"):
    layer = obj.data.attributes[name]
    found = np.empty(count * len(layer.data), dtype)
    layer.data.foreach_get(field, found)
    return found


def again(scan, **options):
    """Another result of the same scan."""
    bpy.context.view_layer.objects.active = scan
    assert bpy.ops.surfrecon.quads(**options) == {"FINISHED"}
    return bpy.context.object


def test_the_mesh_is_made_of_quads_that_know_the_image(scan):
    made = again(scan, rows=12, columns=12)
    assert made is not scan and bpy.context.selected_objects == [made]
    figures = made["surfrecon_quads"].to_dict()
    assert {len(polygon.vertices) for polygon in made.data.polygons} == {4}
    assert len(made.data.polygons) == figures["quads"] > 50
    assert figures["relative_error"] <= figures["uniform_relative_error"]
    assert np.allclose(made.matrix_world, scan.matrix_world, atol=1e-6)
    assert not made.data.validate()
    # Its vertices are samples of the scan, and the UV map says which.
    samples = {tuple(v.co) for v in scan.data.vertices}
    assert all(tuple(v.co) in samples for v in made.data.vertices)
    corner = values(made, ".corner_vert", dtype=np.int32)
    row, col = (values(made, name, dtype=np.int32)[corner] for name in ("range_row", "range_col"))
    uv = values(made, "UVMap", 2, field="vector").reshape(-1, 2)
    assert np.allclose(
        uv, np.stack([col / (scan["range_columns"] - 1), 1 - row / (scan["range_rows"] - 1)], 1), atol=1e-6
    )
    assert values(made, "error").max() <= np.float32(figures["max_error"])
    assert made.data.attributes["error"].domain == "FACE"
    # They look at the sensor, as the faces of the scan do.
    mean = [sum((p.normal * p.area for p in obj.data.polygons), start=Vector()) for obj in (made, scan)]
    assert mean[0].angle(mean[1]) < 0.1


def test_triangles_take_the_better_diagonal_and_keep_the_figures(scan):
    quads = again(scan, rows=12, columns=12)
    cut = again(scan, rows=12, columns=12, kind="TRIANGLES", show_error=True)
    assert {len(polygon.vertices) for polygon in cut.data.polygons} == {3}
    assert len(cut.data.polygons) == 2 * len(quads.data.polygons)
    assert len(cut.data.vertices) == len(quads.data.vertices) and "UVMap" in cut.data.uv_layers
    material = cut.material_slots[0].material
    limit = material.node_tree.nodes["Error range"].inputs["From Max"].default_value
    # A jump that a quad spans does not make all others look alike.
    errors = np.empty(len(quads.data.polygons), np.float32)
    quads.data.attributes["error"].data.foreach_get("value", errors)
    assert np.quantile(errors, 0.95) <= limit <= 2.5 * np.quantile(errors, 0.95)


def test_a_wanted_error_chooses_the_size(scan):
    coarse, fine = (again(scan, rms_error=error) for error in (0.02, 0.004))
    assert coarse["surfrecon_quads"]["rms_error"] <= 0.02 and fine["surfrecon_quads"]["rms_error"] <= 0.004
    assert len(coarse.data.polygons) < len(fine.data.polygons)


def test_subdivision_is_a_modifier(scan):
    made = again(scan, rows=6, columns=6, subdivision=2)
    assert [(m.type, m.levels) for m in made.modifiers] == [("SUBSURF", 2)]
    evaluated = made.evaluated_get(bpy.context.evaluated_depsgraph_get())
    assert len(evaluated.data.polygons) == 16 * len(made.data.polygons)


@pytest.mark.parametrize("order", [2, 3, 4])
@pytest.mark.parametrize("size", [(0, 0), (5, 7)])
def test_the_surface_is_the_library_s_own(scan, extension, order, size):
    scan_objects = import_module(f"{extension.__name__}.scan_objects")
    made = again(scan, kind="SURFACE", order=order, control_rows=size[0], control_columns=size[1])
    image = scan_objects.scan_of_object(scan, bpy.context.evaluated_depsgraph_get())
    grid = surfrecon.adaptive_quads(image)
    spline = grid.spline(order=order, rows=size[0] or None, columns=size[1] or None)
    assert made.type == "SURFACE" and len(made.data.splines) == 1
    joined = made.data.splines[0]
    rows, columns, _ = spline.control.shape
    assert {joined.point_count_u, joined.point_count_v} == {rows, columns} and len(joined.points) == rows * columns
    assert np.allclose(made.matrix_world, scan.matrix_world, atol=1e-6)
    # Points that Blender draws lie on the library's surface.
    joined.resolution_u = joined.resolution_v = 3
    drawn = made.evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh()
    points = np.array([v.co for v in drawn.vertices])
    faces = np.array([polygon.normal for polygon in drawn.polygons])
    u, v = np.meshgrid(np.linspace(0, 1, 400), np.linspace(0, 1, 400))
    dense = spline.evaluate(u.ravel(), v.ravel())
    step = max(np.linalg.norm(np.diff(dense.reshape(400, 400, 3), axis=k), axis=2).max() for k in (0, 1))
    nearest = [np.sqrt(((dense - p) ** 2).sum(1).min()) for p in points[:: max(len(points) // 150, 1)]]
    assert max(nearest) < step
    corners = spline.evaluate([0, 1, 0, 1], [0, 0, 1, 1])
    for corner in corners:
        assert np.abs(points - corner).sum(1).min() < 1e-5
    # Its front is the sensor's side, like that of the quads.
    front = grid.triangles()
    a, b, c = (front.positions[front.triangles[:, k]] for k in range(3))
    assert faces.mean(0) @ np.cross(b - a, c - a).sum(0) > 0


def test_the_smallest_surfaces(scan):
    for rows, columns in ((2, 2), (2, 5), (5, 2)):
        made = again(scan, kind="SURFACE", order=2, rows=rows, columns=columns, tiles_down=1, tiles_across=1)
        assert len(made.data.splines[0].points) == rows * columns


def test_one_undo_takes_it_away(scan):
    # The bpy module crashes when an operator pushes its own step without a window: the test pushes for it.
    bpy.ops.ed.undo_push(message="before")
    names, name = {obj.name for obj in bpy.data.objects}, scan.name
    for kind in ("QUADS", "SURFACE"):
        again(bpy.data.objects[name], kind=kind)
        made = bpy.context.object.name
        bpy.ops.ed.undo_push(message="after")
        assert {obj.name for obj in bpy.data.objects} == names | {made}
        bpy.ops.ed.undo()
        assert {obj.name for obj in bpy.data.objects} == names
        bpy.ops.ed.redo()
        assert "surfrecon_quads" in bpy.data.objects[made]
        bpy.ops.ed.undo()


def test_what_can_not_be_gridded_is_named(scan):
    objects = len(bpy.data.objects)
    with pytest.raises(RuntimeError, match='ask for fewer rows or a smaller "Tiles down"'):
        bpy.ops.surfrecon.quads(rows=5000)
    with pytest.raises(RuntimeError, match='Give "Max error" or "RMS error", not both'):
        bpy.ops.surfrecon.quads(max_error=1, rms_error=1)
    with pytest.raises(RuntimeError, match="none of the 1 x 1 quads is covered"):
        bpy.ops.surfrecon.quads(rows=2, columns=2, tiles_down=1, tiles_across=1, coverage=1)
    with pytest.raises(RuntimeError, match="control points: order 4 over"):
        bpy.ops.surfrecon.quads(kind="SURFACE", control_rows=2)
    scan.data.attributes.remove(scan.data.attributes["range_row"])
    with pytest.raises(RuntimeError, match="no longer one vertex a pixel|neither faces nor"):
        bpy.ops.surfrecon.quads()
    assert len(bpy.data.objects) == objects
    add_mesh("plain", torus())
    with pytest.raises(RuntimeError, match="Make an imported scan the active object"):
        bpy.ops.surfrecon.quads()


def test_the_operator_has_every_option_of_the_library(extension):
    operator = import_module(f"{extension.__name__}.operators.quads").SURFRECON_OT_quads
    assert operator.bl_options == {"REGISTER", "UNDO", "PRESET"}
    properties = bpy.ops.surfrecon.quads.get_rna_type().properties
    for parameter in surfrecon.parameters("quads"):
        prop = properties[parameter.name]
        assert prop.default == pytest.approx(parameter.default or 0)
        assert prop.hard_max == pytest.approx(min(parameter.maximum, 1e9))
        assert prop.description == extension.properties.description(parameter)


def test_the_figures_are_in_the_sidebar(scan, extension):
    reports = extension.reports
    made = again(scan, kind="SURFACE", control_rows=6)
    lines = dict(reports.quads_lines(bpy.context, made["surfrecon_quads"]))
    assert lines["Vertices"] == "9 x 9" and lines["Relative error"].endswith(" %")
    assert "Surface off the grid by" in lines
