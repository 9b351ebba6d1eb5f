"""The sculpt operator: its bound, the kept sculptor, the pose, messages."""

from importlib import import_module

import bpy
import numpy as np
import pytest
import surfrecon
from files import write_set
from shapes import torus, torus_scans
from test_merge import add_mesh


@pytest.fixture
def scan(tmp_path):
    image = torus_scans(pixels=120)[0]
    bpy.ops.surfrecon.import_scans(filepath=str(write_set(tmp_path, [image])))
    obj = bpy.data.objects[image.name]
    bpy.context.view_layer.objects.active = obj
    return obj


@pytest.fixture
def kept(extension):
    found = import_module(f"{extension.__name__}.kept").Kept
    found.forget()
    return found


def values(obj, name, domain="POINT"):
    layer = obj.data.attributes[name]
    assert layer.domain == domain
    found = np.empty(len(layer.data), np.float32)
    layer.data.foreach_get("value", found)
    return found


def test_the_mesh_stays_within_the_tolerance(scan):
    assert bpy.ops.surfrecon.sculpt(tolerance=0.004) == {"FINISHED"}
    made = bpy.context.object
    assert made is not scan and bpy.context.selected_objects == [made]
    figures = made["surfrecon_sculpt"].to_dict()
    assert figures["tolerance"] == pytest.approx(0.004, rel=1e-6)
    assert 0.001 < figures["max_error"] <= figures["tolerance"]
    assert len(made.data.polygons) == figures["triangles"] < 0.5 * figures["full_triangles"]
    errors = values(made, "face_error", "FACE")
    assert errors.max() == pytest.approx(figures["max_error"], rel=1e-6)
    assert values(made, "error").max() == errors.max()
    assert np.allclose(made.matrix_world, scan.matrix_world, atol=1e-6)
    assert not made.data.validate()
    # Its vertices are samples of the scan.
    samples = {tuple(v.co) for v in scan.data.vertices}
    assert all(tuple(v.co) in samples for v in made.data.vertices)


def test_another_tolerance_digs_with_the_same_sculptor(scan, kept):
    bpy.ops.surfrecon.sculpt(tolerance=0.004)
    first, coarse = kept.value, len(bpy.context.object.data.polygons)
    assert first is not None
    bpy.context.view_layer.objects.active = scan
    bpy.ops.surfrecon.sculpt(tolerance=0.001)
    assert kept.value is first
    assert len(bpy.context.object.data.polygons) > coarse
    # A scan that has changed is another one.
    scan.data.vertices[7].co.z += 0.01
    bpy.context.view_layer.objects.active = scan
    bpy.ops.surfrecon.sculpt(tolerance=0.001)
    assert kept.value is not first


def test_zero_takes_the_share_of_the_depth(scan):
    bpy.ops.surfrecon.sculpt(relative_tolerance=0.01)
    figures = bpy.context.object["surfrecon_sculpt"].to_dict()
    assert figures["tolerance"] == pytest.approx(0.01 * figures["depth_extent"], rel=1e-6)
    bpy.context.view_layer.objects.active = scan
    bpy.ops.surfrecon.sculpt(relative_tolerance=0)
    assert bpy.context.object["surfrecon_sculpt"]["max_error"] < 1e-6


def test_a_default_is_the_library_s_though_blender_has_it_in_single_precision(tmp_path):
    """Whole numbers, so that a tolerance a millionth larger takes other triangles."""
    heights = np.round(1000 * np.random.default_rng(1).random((40, 40))).cumsum(axis=0) % 1001
    np.save(tmp_path / "whole.npy", heights)
    bpy.ops.surfrecon.import_scans(filepath=str(tmp_path / "whole.npy"), unit="SCENE")
    assert bpy.ops.surfrecon.sculpt() == {"FINISHED"}
    figures = bpy.context.object["surfrecon_sculpt"].to_dict()
    assert figures["tolerance"] == surfrecon.sculpt(surfrecon.read(tmp_path / "whole.npy")).tolerance


def test_a_scaled_scan_keeps_its_place(scan):
    scan.scale = (2, 2, 2)
    bpy.context.view_layer.update()
    bpy.ops.surfrecon.sculpt(tolerance=0.004)
    made = bpy.context.object
    in_world = {tuple(round(x, 4) for x in scan.matrix_world @ v.co) for v in scan.data.vertices}
    placed = [tuple(round(x, 4) for x in made.matrix_world @ v.co) for v in made.data.vertices]
    assert np.mean([p in in_world for p in placed]) > 0.9
    assert made["surfrecon_sculpt"]["max_error"] <= 0.004 * (1 + 1e-6)


def test_the_options_of_the_library_reach_it(scan):
    def triangles(**options):
        bpy.context.view_layer.objects.active = scan
        assert bpy.ops.surfrecon.sculpt(tolerance=0.02, **options) == {"FINISHED"}
        return len(bpy.context.object.data.polygons)

    plain = triangles()
    assert triangles(effort=0) >= plain > triangles(simplify_borders=True)
    assert triangles(interpolate=False) < plain < triangles(min_angle=0.4)


def test_errors_are_shown_on_request(scan):
    bpy.ops.surfrecon.sculpt(tolerance=0.004, show_error=True)
    material = bpy.context.object.material_slots[0].material
    assert material.node_tree.nodes["Error range"].inputs["From Max"].default_value == pytest.approx(0.004)


def test_what_can_not_be_sculpted_is_named(scan):
    with pytest.raises(RuntimeError, match="no triangle comes of its 31 x 84 pixels"):
        bpy.ops.surfrecon.sculpt(edge_limit=1e-9)
    scan.data.attributes.remove(scan.data.attributes["range_row"])
    with pytest.raises(RuntimeError, match="no longer one vertex a pixel|neither faces nor"):
        bpy.ops.surfrecon.sculpt(tolerance=0.004)
    add_mesh("plain", torus())
    with pytest.raises(RuntimeError, match="Make an imported scan the active object"):
        bpy.ops.surfrecon.sculpt()
    assert len(bpy.data.objects) == 2


def test_a_result_can_be_sculpted_again_from_its_scan(scan):
    bpy.ops.surfrecon.sculpt(relative_tolerance=0.01)
    few = len(bpy.context.object.data.polygons)
    # Adjusting the last operation asks whether it could be called now, with its own result as the active object.
    assert bpy.ops.surfrecon.sculpt.poll()
    bpy.ops.surfrecon.sculpt(relative_tolerance=0.002)
    assert len(bpy.context.object.data.polygons) > few
    bpy.data.objects.remove(scan)
    assert not bpy.ops.surfrecon.sculpt.poll()


def test_the_operator_can_be_adjusted_and_undone(extension):
    operator = import_module(f"{extension.__name__}.operators.sculpt").SURFRECON_OT_sculpt
    assert operator.bl_options == {"REGISTER", "UNDO", "PRESET"}
    # Every option of the library is one of the operator's.
    names = {p.name for p in surfrecon.parameters("sculpt") + surfrecon.parameters("triangulate")}
    assert names <= set(bpy.ops.surfrecon.sculpt.get_rna_type().properties.keys())
