"""The part of a selection that operators work on: all that is no scan is left out and counted."""

import bpy
import pytest
from files import write_set
from recordings import write_transforms
from shapes import torus, torus_scans
from test_merge import VOXEL, add_mesh
from test_recording import load
from test_sources import only

COUNT = 4


@pytest.fixture
def scene(tmp_path):
    """Scans, and what a new scene has besides; all of it is selected, as the key A does."""
    bpy.ops.surfrecon.import_scans(filepath=str(write_set(tmp_path, torus_scans(pixels=60)[:COUNT])))
    scans = bpy.context.selected_objects
    for name, data in (
        ("Light", bpy.data.lights.new("Light", "POINT")),
        ("Camera", bpy.data.cameras.new("Camera")),
        ("Camera 2", bpy.data.cameras.new("Camera")),
        ("Empty", None),
    ):
        bpy.context.scene.collection.objects.link(bpy.data.objects.new(name, data))
    bpy.ops.object.select_all(action="SELECT")
    return scans


def said(capfd):
    return capfd.readouterr().out


LEFT_OUT = "left out: 2 cameras, 1 empty, 1 light"


def test_merging_all_leaves_out_what_is_no_scan(scene, capfd):
    bpy.data.objects["Light"].select_set(True)
    bpy.context.view_layer.objects.active = bpy.data.objects["Light"]
    assert bpy.ops.surfrecon.merge(voxel=VOXEL) == {"FINISHED"}
    assert bpy.context.object["surfrecon_report"]["scans"] == COUNT
    assert f"{COUNT} scans merged" in (text := said(capfd)) and LEFT_OUT in text


def test_merging_all_to_a_file_too(scene, capfd, tmp_path):
    assert bpy.ops.surfrecon.merge_to_file(filepath=str(tmp_path / "merged.ply"), voxel=VOXEL) == {"FINISHED"}
    assert LEFT_OUT in said(capfd)


def test_aligning_all_leaves_out_what_is_no_scan(scene, capfd):
    assert bpy.ops.surfrecon.align() == {"FINISHED"}
    assert scene[0]["surfrecon_align"]["of"] == COUNT and LEFT_OUT in said(capfd)


@pytest.mark.parametrize("operator", ["error_map", "measure"])
def test_measuring_to_all_leaves_out_what_is_no_scan(scene, capfd, operator):
    measured = add_mesh("torus", torus(40))
    assert getattr(bpy.ops.surfrecon, operator)() == {"FINISHED"}
    assert bpy.context.object is measured and LEFT_OUT in said(capfd)


def test_a_surface_through_points_leaves_out_what_has_none(scene, capfd):
    assert bpy.ops.surfrecon.reconstruct() == {"FINISHED"}
    assert LEFT_OUT in said(capfd)


def test_nothing_but_cameras_is_refused(scene):
    for obj in scene:
        obj.select_set(False)
    for operator in (bpy.ops.surfrecon.merge, bpy.ops.surfrecon.reconstruct):
        with pytest.raises(RuntimeError, match="Nothing but 2 cameras, 1 empty, 1 light is selected"):
            operator()


def test_merging_a_result_merges_its_sources_again(scene, extension, monkeypatch, capfd):
    monkeypatch.setattr(extension.hiding, "is_wished", lambda: True)
    bpy.ops.surfrecon.merge(voxel=VOXEL)
    first = bpy.context.object
    assert not any(obj.visible_get() for obj in scene)
    assert bpy.ops.surfrecon.merge(voxel=VOXEL / 2) == {"FINISHED"}
    again = bpy.context.object
    assert again is not first and len(again.data.polygons) > 2 * len(first.data.polygons)
    assert again["surfrecon_report"]["scans"] == COUNT
    assert extension.sources.sources_of(again) == scene
    assert not first.visible_get() and first.hide_render and "1 earlier result is hidden" in said(capfd)


def test_a_result_beside_its_scans_is_no_scan(scene, capfd):
    only(scene[0])
    bpy.ops.surfrecon.sculpt(relative_tolerance=0.01)
    for obj in scene:
        obj.select_set(True)
    bpy.ops.surfrecon.merge(voxel=VOXEL)
    assert bpy.context.object["surfrecon_report"]["scans"] == COUNT and "left out: 1 result" in said(capfd)


def test_the_cube_of_a_new_file_is_no_scan(scene, capfd, extension, monkeypatch):
    monkeypatch.setattr(extension.hiding, "is_wished", lambda: True)
    bpy.ops.mesh.primitive_cube_add(size=2)
    bpy.ops.object.select_all(action="SELECT")
    bpy.ops.surfrecon.align()
    assert scene[0]["surfrecon_align"]["of"] == COUNT and "1 simple shape" in said(capfd)
    bpy.ops.object.select_all(action="SELECT")
    bpy.ops.surfrecon.merge(voxel=VOXEL)
    assert bpy.context.object["surfrecon_report"]["scans"] == COUNT and "1 simple shape" in said(capfd)
    # And beside the result, once the scans are hidden.
    bpy.ops.object.select_all(action="SELECT")
    bpy.ops.surfrecon.merge(voxel=VOXEL)
    assert bpy.context.object["surfrecon_report"]["scans"] == COUNT
    # Alone it may be anything.
    only(bpy.data.objects["Cube"])
    bpy.ops.surfrecon.merge(voxel=0.11)
    assert bpy.context.object["surfrecon_report"]["scans"] == 1


def test_a_shape_that_a_region_was_taken_from_is_never_a_scan(scene, capfd):
    bpy.ops.object.select_all(action="DESELECT")
    bpy.ops.mesh.primitive_cube_add(size=2, location=(-0.8, 0, 0))
    cube = bpy.context.object
    for obj in scene:
        obj.select_set(True)
    assert bpy.ops.surfrecon.select_region(action="REMOVE") == {"FINISHED"}
    assert not cube.select_get() and set(bpy.context.selected_objects) == set(scene)
    assert bpy.context.object in scene
    cube.select_set(True)
    bpy.ops.surfrecon.merge(voxel=VOXEL)
    assert bpy.context.object["surfrecon_report"]["scans"] == COUNT and "left out: 1 region" in said(capfd)


# Selecting


def test_select_scans_selects_no_cameras(tmp_path):
    load(write_transforms(tmp_path / "ring", 8), frames=4)
    wanted = set(bpy.context.selected_objects)
    bpy.ops.object.select_all(action="SELECT")
    assert set(bpy.context.selected_objects) > wanted
    assert bpy.ops.surfrecon.select_scans() == {"FINISHED"}
    assert set(bpy.context.selected_objects) == wanted and bpy.context.object in wanted


def test_select_scans_takes_those_of_the_active_collection(scene, tmp_path):
    (tmp_path / "more").mkdir()
    bpy.ops.surfrecon.import_scans(filepath=str(write_set(tmp_path / "more", torus_scans(pixels=40)[:2], name="two")))
    more = set(bpy.context.selected_objects)
    only(next(iter(more)))
    bpy.ops.surfrecon.select_scans()
    assert set(bpy.context.selected_objects) == more
    bpy.context.view_layer.objects.active = bpy.data.objects["Light"]
    bpy.ops.surfrecon.select_scans()
    assert set(bpy.context.selected_objects) == more | set(scene)


def test_imported_meshes_are_scans(tmp_path):
    import surfrecon

    surfrecon.Mesh(torus().positions, torus().triangles).write(tmp_path / "torus.stl")
    bpy.ops.surfrecon.import_scans(filepath=str(tmp_path / "torus.stl"))
    scan = bpy.context.object
    add_mesh("other", torus())
    bpy.ops.surfrecon.select_scans()
    assert bpy.context.selected_objects == [scan]


def test_hidden_scans_can_not_be_selected(scene):
    for obj in scene:
        obj.hide_set(True)
    with pytest.raises(RuntimeError, match="All scans are hidden"):
        bpy.ops.surfrecon.select_scans()
