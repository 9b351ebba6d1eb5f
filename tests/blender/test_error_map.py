"""The error map: what it measures, shows and refuses."""

import bpy
import numpy as np
import pytest
from files import write_set
from shapes import torus, torus_scans
from test_merge import VOXEL, add_mesh


def errors(obj):
    values = np.empty(len(obj.data.vertices), np.float32)
    obj.data.attributes["error"].data.foreach_get("value", values)
    return values


@pytest.fixture
def merged(tmp_path):
    bpy.ops.surfrecon.import_scans(filepath=str(write_set(tmp_path, torus_scans(pixels=90, noise=0.001))))
    bpy.ops.surfrecon.merge(voxel=VOXEL)
    return bpy.context.object


def test_the_distance_to_the_scans_is_that_of_the_noise(merged):
    assert bpy.ops.surfrecon.error_map() == {"FINISHED"}
    assert np.quantile(errors(merged), 0.9) < 0.003
    figures = merged["surfrecon_error"].to_dict()
    assert figures["rms"] == pytest.approx(np.sqrt(np.mean(errors(merged).astype(float) ** 2)), rel=1e-4)
    assert figures["mean"] <= figures["rms"] <= figures["max"] and figures["p95"] <= figures["limit"]


def test_a_shifted_copy_is_as_far_as_it_was_shifted(extension):
    from mathutils import Matrix

    add_mesh("truth", torus(100))
    copy = add_mesh("copy", torus(100), Matrix.Diagonal((1, 1, 1, 1)))
    for vertex in copy.data.vertices:
        vertex.co.z += 0.05
    copy.data.update()
    bpy.ops.surfrecon.error_map()
    assert bpy.context.object is copy
    assert errors(copy).max() == pytest.approx(0.05, rel=0.01)
    assert copy["surfrecon_error"]["limit"] == pytest.approx(0.05)


def test_scaled_objects_are_measured_in_the_world():
    from mathutils import Matrix

    add_mesh("truth", torus(60), Matrix.Scale(2, 4))
    copy = add_mesh("copy", torus(60), Matrix.Scale(2, 4))
    bpy.ops.surfrecon.error_map()
    assert errors(copy).max() < 1e-6


def test_the_material_shows_the_attribute_and_is_made_once(merged):
    bpy.ops.surfrecon.error_map()
    material = merged.material_slots[0].material
    nodes = material.node_tree.nodes
    assert nodes["Error range"].inputs["From Max"].default_value == pytest.approx(merged["surfrecon_error"]["limit"])
    assert any(getattr(node, "attribute_name", "") == "error" for node in nodes)
    bpy.ops.surfrecon.error_map(limit=0.5)
    assert merged.material_slots[0].material is material and len(bpy.data.materials) == 1
    assert nodes["Error range"].inputs["From Max"].default_value == 0.5


def test_nothing_to_compare_with():
    add_mesh("alone", torus())
    with pytest.raises(RuntimeError, match='Select the scans that "alone" is to be compared with'):
        bpy.ops.surfrecon.error_map()
    assert not bpy.data.materials and "error" not in bpy.context.object.data.attributes


def test_full_scales_are_round(extension):
    from importlib import import_module

    round_up = import_module(f"{extension.__name__}.operators.error_map").round_up
    assert [round_up(x) for x in (0.0011, 0.2, 3, 7, 10)] == pytest.approx([0.002, 0.2, 5, 10, 10])
    assert round_up(0) == 1


def test_what_modifiers_move_is_measured_where_it_is_seen():
    add_mesh("truth", torus(100))
    copy = add_mesh("copy", torus(100))
    lift = copy.modifiers.new("Lift", "DISPLACE")
    lift.direction, lift.mid_level, lift.strength = "Z", 0, 0.05
    assert bpy.ops.surfrecon.error_map() == {"FINISHED"}
    assert errors(copy).max() == pytest.approx(0.05, rel=0.01)


def test_what_modifiers_add_has_no_error_and_is_said(capfd):
    add_mesh("truth", torus(60))
    copy = add_mesh("copy", torus(60))
    copy.modifiers.new("Subdivision", "SUBSURF")
    for operator in (bpy.ops.surfrecon.error_map, bpy.ops.surfrecon.measure):
        capfd.readouterr()
        assert operator() == {"FINISHED"}
        assert "which make other vertices" in capfd.readouterr().out
    assert len(errors(copy)) == len(copy.data.vertices) and errors(copy).max() < 1e-6


@pytest.fixture
def runs(monkeypatch):
    """How often distances were measured."""
    import surfrecon

    found, distances = [], surfrecon.Job.distances
    counted = lambda *given, **options: found.append(1) or distances(*given, **options)  # noqa: E731
    monkeypatch.setattr(surfrecon.Job, "distances", staticmethod(counted))
    return found


def test_what_the_merge_measured_is_not_measured_again(merged, runs):
    known = errors(merged)
    assert bpy.ops.surfrecon.error_map() == {"FINISHED"}
    assert not runs and np.array_equal(errors(merged), known)
    # The same again, at another scale, and what is measured really.
    bpy.ops.surfrecon.error_map(limit=0.5)
    assert not runs and merged["surfrecon_error"]["limit"] == 0.5
    del merged["surfrecon_measured"]
    bpy.ops.surfrecon.error_map()
    assert len(runs) == 1 and np.allclose(errors(merged), known, atol=1e-6)


@pytest.mark.parametrize("change", ["scan moved", "result moved", "vertex moved", "modifier", "misfit"])
def test_what_has_changed_since_is_measured_anew(merged, runs, change):
    scan = bpy.data.objects["scan00"]
    if change == "scan moved":
        scan.location.x += 0.1
    elif change == "result moved":
        merged.location.x += 0.1
    elif change == "vertex moved":
        merged.data.vertices[0].co.z += 0.1
    elif change == "modifier":
        scan.modifiers.new("cast", "CAST")
    else:
        merged.data.attributes["error"].data[0].value = 1.0
    bpy.context.view_layer.update()
    bpy.ops.surfrecon.error_map()
    assert len(runs) == 1


def test_the_map_is_unlit_and_has_the_colours_of_the_legend_at_once(merged, extension):
    areas = bpy.context.window_manager.windows[0].screen.areas
    shading = next(area.spaces.active.shading for area in areas if area.type == "VIEW_3D")
    before = shading.type, shading.color_type, shading.light
    bpy.ops.surfrecon.error_map()
    assert (shading.type, shading.color_type, shading.light) == ("SOLID", "VERTEX", "FLAT")
    nodes = merged.material_slots[0].material.node_tree.nodes
    assert {node.type for node in nodes} >= {"EMISSION", "OUTPUT_MATERIAL"} and "Principled BSDF" not in nodes
    bpy.ops.surfrecon.error_hide()
    assert (shading.type, shading.color_type, shading.light) == before
