"""The cluster operator: numbers, bounds, chains of levels and their slider, messages."""

import re
from importlib import import_module

import bpy
import numpy as np
import pytest
import surfrecon
from files import write_set
from mathutils import Matrix
from shapes import torus, torus_distance, torus_scans
from test_merge import add_mesh, surface


@pytest.fixture
def dense():
    return add_mesh("dense", torus())


def world_positions(obj):
    return np.array([(obj.matrix_world @ v.co)[:] for v in obj.data.vertices])


def test_as_many_vertices_as_asked_for_with_the_same_topology(dense):
    dense.matrix_world = Matrix.Translation((5, 0, 0)) @ Matrix.Rotation(1, 4, "X")
    bpy.context.view_layer.update()
    assert bpy.ops.surfrecon.remesh(vertices=300) == {"FINISHED"}
    made = bpy.context.object
    assert made is not dense and bpy.context.selected_objects == [made]
    assert len(made.data.vertices) == 300 == made["surfrecon_cluster"]["vertices"]
    assert np.allclose(made.matrix_world, dense.matrix_world, atol=1e-6)
    check = surface(made).check()
    assert check["is_manifold"] and check["genus"] == 1 and check["components"] == 1
    assert np.abs(torus_distance(surface(made).positions)).max() < 0.02
    assert np.degrees(made["surfrecon_cluster"]["after"]["smallest_angle"]) > 30
    assert not made.data.validate()
    assert len(dense.data.vertices) == len(torus().positions)


def test_as_many_triangles_as_asked_for_and_how_far_they_are_off(dense, capfd):
    dense.scale = (2, 2, 2)
    bpy.context.view_layer.update()
    assert bpy.ops.surfrecon.remesh(resolution="TRIANGLES", triangles=500) == {"FINISHED"}
    made = bpy.context.object
    figures = made["surfrecon_cluster"]
    assert len(made.data.polygons) == 500 == figures["triangles"]
    found = surfrecon.Mesh(world_positions(made), surface(made).triangles)
    dense_there = surfrecon.Mesh(world_positions(dense), torus().triangles)
    both = [surfrecon.surface_distance(*pair)["reached"] for pair in ((found, dense_there), (dense_there, found))]
    # In the scene's unit, and of single precision.
    assert max(both) <= figures["max_error"] * (1 + 1e-5) <= 1.02 * max(both)
    assert 0 < figures["rms_error"] < figures["max_error"]
    said = capfd.readouterr().out
    assert re.search(r"500 triangles, at most [0-9.]+ ?\w* from the original", said), said


def test_points_get_a_surface():
    made = add_mesh("points", torus())
    points = bpy.data.meshes.new("points")
    points.from_pydata([v.co[:] for v in made.data.vertices], [], [])
    made.data = points
    made.location = (1, 2, 3)
    bpy.context.view_layer.update()
    assert bpy.ops.surfrecon.remesh(vertices=300) == {"FINISHED"}
    result = bpy.context.object
    assert len(result.data.vertices) == 300 and result.location[:] == (1, 2, 3)
    check = surface(result).check()
    assert check["is_manifold"] and check["genus"] == 1 and check["boundary_loops"] == 0


@pytest.mark.skipif(bpy.app.version < (4, 3), reason="Blender 4.2 makes point clouds only in its nodes")
def test_point_clouds_get_a_surface():
    bpy.context.view_layer.objects.active = add_mesh("points", torus())
    bpy.context.object.select_set(True)
    bpy.ops.object.convert(target="POINTCLOUD")
    assert bpy.context.object.type == "POINTCLOUD"
    assert bpy.ops.surfrecon.remesh(vertices=300) == {"FINISHED"}
    assert len(bpy.context.object.data.vertices) == 300


def test_zero_takes_a_tenth(dense):
    bpy.ops.surfrecon.remesh()
    # A closed surface has an even number.
    assert len(bpy.context.object.data.polygons) == len(dense.data.polygons) // 10 // 2 * 2
    bpy.context.view_layer.objects.active = dense
    bpy.ops.surfrecon.remesh(resolution="VERTICES")
    assert len(bpy.context.object.data.vertices) == len(dense.data.vertices) // 10
    bpy.context.view_layer.objects.active = dense
    bpy.ops.surfrecon.remesh(resolution="PATCHES", patches=40)
    assert bpy.context.object["surfrecon_cluster"]["patches"] >= 40


def test_a_largest_error_holds_in_the_scene_s_unit(dense):
    dense.scale = (2, 2, 3)
    bpy.context.view_layer.update()
    bpy.ops.surfrecon.remesh(resolution="ERROR", max_error=0.05)
    made = bpy.context.object
    found = surfrecon.Mesh(world_positions(made), surface(made).triangles)
    assert len(made.data.vertices) < len(dense.data.vertices)
    assert np.abs(surfrecon.distances(world_positions(dense), found)).max() <= 0.05 * (1 + 1e-5)


def test_a_chain_is_one_object_with_a_slider(dense):
    bpy.ops.surfrecon.remesh(vertices=400, levels=3)
    made = bpy.context.object
    assert [len(level.mesh.vertices) for level in made.surfrecon_levels] == [400, 100, 25]
    assert len(made.data.vertices) == 400
    made.surfrecon_level = 2
    assert len(made.data.vertices) == 25 == made["surfrecon_cluster"]["vertices"]
    made.surfrecon_level = 9
    assert len(made.data.vertices) == 25
    made.surfrecon_level = 0
    assert len(made.data.vertices) == 400
    # An object without levels has nothing to show.
    dense.surfrecon_level = 1
    assert len(dense.data.vertices) == len(torus().positions)


def test_a_chain_may_count_triangles(dense):
    bpy.ops.surfrecon.remesh(triangles=800, levels=3)
    assert [len(level.mesh.polygons) for level in bpy.context.object.surfrecon_levels] == [800, 200, 50]


def test_levels_that_are_not_shown_are_saved(dense, tmp_path):
    bpy.ops.surfrecon.remesh(vertices=400, levels=2)
    name = bpy.context.object.name
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "levels.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "levels.blend"))
    made = bpy.data.objects[name]
    made.surfrecon_level = 1
    assert len(made.data.vertices) == 100


def test_a_chain_may_be_separate_objects(dense):
    bpy.ops.surfrecon.remesh(vertices=400, levels=3, separate=True)
    assert sorted(len(obj.data.vertices) for obj in bpy.context.selected_objects) == [25, 100, 400]
    assert len(bpy.context.object.data.vertices) == 400


def test_a_scan_is_clustered_in_its_place(tmp_path):
    image = torus_scans(pixels=90)[0]
    bpy.ops.surfrecon.import_scans(filepath=str(write_set(tmp_path, [image])))
    scan = bpy.data.objects[image.name]
    bpy.context.view_layer.objects.active = scan
    bpy.ops.surfrecon.remesh(vertices=200)
    made = bpy.context.object
    assert np.abs(torus_distance(world_positions(made))).max() < 0.05


def test_what_can_not_be_clustered_is_named(dense):
    with pytest.raises(RuntimeError, match='Set "Max error"'):
        bpy.ops.surfrecon.remesh(resolution="ERROR")
    points = bpy.data.objects.new("points", bpy.data.meshes.new("points"))
    points.data.from_pydata([(0, 0, 0), (1, 0, 0)], [], [])
    bpy.context.collection.objects.link(points)
    bpy.context.view_layer.objects.active = points
    with pytest.raises(RuntimeError, match="at least 3 different points"):
        bpy.ops.surfrecon.remesh()
    bpy.context.view_layer.objects.active = None
    with pytest.raises(RuntimeError, match="Make a mesh or a point cloud the active object"):
        bpy.ops.surfrecon.remesh()
    assert len(bpy.data.objects) == 2


def test_the_operator_has_the_library_s_options(extension):
    operator = import_module(f"{extension.__name__}.operators.cluster").SURFRECON_OT_remesh
    assert operator.bl_options == {"REGISTER", "UNDO", "PRESET"}
    names = {p.name for p in surfrecon.parameters("cluster")}
    assert names <= set(bpy.ops.surfrecon.remesh.get_rna_type().properties.keys())


def test_results_are_called_after_the_operator(dense):
    bpy.ops.surfrecon.remesh(vertices=300)
    assert bpy.context.object.name == f"{dense.name} remeshed" == bpy.context.object.data.name
    bpy.context.view_layer.objects.active = dense
    bpy.ops.surfrecon.remesh(vertices=300, levels=2, separate=True)
    assert [obj.name for obj in bpy.context.selected_objects] == [f"{dense.name} remeshed {k}" for k in range(2)]
