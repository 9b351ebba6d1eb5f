"""A box around what is selected, and two buttons that keep or remove what is in it."""

import bpy
import numpy as np
import pytest
import surfrecon
from files import write_set
from shapes import torus_scans
from test_panels import draw
from test_regions import world
from test_sources import only


@pytest.fixture
def scans(tmp_path):
    bpy.ops.surfrecon.import_scans(filepath=str(write_set(tmp_path, torus_scans(pixels=60)[:4])))
    return bpy.context.selected_objects


def corners(obj):
    bpy.context.view_layer.update()
    places = world(obj)
    return places.min(axis=0), places.max(axis=0)


def test_the_box_holds_what_is_selected(scans):
    turned = scans[0]
    turned.rotation_euler = (0.3, 0.4, 0.5)
    bpy.context.view_layer.update()
    expected = np.concatenate([world(obj) for obj in scans])
    assert bpy.ops.surfrecon.box_around() == {"FINISHED"}
    box = bpy.context.object
    assert bpy.context.selected_objects == [box] and box not in scans
    low, high = corners(box)
    assert np.allclose(low, expected.min(axis=0), atol=1e-5) and np.allclose(high, expected.max(axis=0), atol=1e-5)
    # One looks through it, and it is no part of the picture.
    assert box.display_type == "WIRE" and box.hide_render
    assert not box.data.validate()


@pytest.mark.parametrize("keep", [True, False])
def test_box_and_button_are_all_it_takes(scans, keep):
    bpy.ops.surfrecon.box_around()
    box = bpy.context.object
    box.scale.x /= 2
    box.location.x -= box.scale.x
    low, high = corners(box)
    region = surfrecon.Box.between(low, high)
    left = [(region.contains(world(obj)) == keep).sum() for obj in scans]
    assert (bpy.ops.surfrecon.keep_inside if keep else bpy.ops.surfrecon.remove_inside)() == {"FINISHED"}
    assert [len(obj.data.vertices) for obj in scans] == pytest.approx(left, abs=2)
    assert set(bpy.context.selected_objects) == set(scans)
    # And once more, with the box as it lies.
    only(box)
    assert (bpy.ops.surfrecon.keep_inside if keep else bpy.ops.surfrecon.remove_inside)() == {"FINISHED"}


def test_scans_that_are_selected_with_the_box_are_meant_alone(scans):
    bpy.ops.surfrecon.box_around()
    box = bpy.context.object
    box.scale *= 0.8
    bpy.context.view_layer.update()
    counts = [len(obj.data.vertices) for obj in scans]
    scans[0].select_set(True)
    bpy.ops.surfrecon.keep_inside()
    assert len(scans[0].data.vertices) < counts[0]
    assert [len(obj.data.vertices) for obj in scans[1:]] == counts[1:]


def test_there_are_two_buttons_and_a_third_for_the_box(extension):
    texts = draw(extension.panels.SURFRECON_PT_clean)
    assert {"surfrecon.box_around", "surfrecon.keep_inside", "surfrecon.remove_inside"} <= set(texts)
    assert "surfrecon.select_region" not in texts
    # Scripts may still call the former one.
    assert "INTERNAL" in bpy.types.SURFRECON_OT_select_region.bl_options


def test_a_box_is_not_scanned(scans):
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    bpy.context.scene.collection.objects.link(camera)
    camera.location = (0, 0, 9)
    bpy.context.scene.camera = camera
    bpy.ops.surfrecon.box_around()
    with pytest.raises(RuntimeError, match="has no faces"):
        bpy.ops.surfrecon.reproject(percent=5)


def test_nothing_with_vertices_is_refused():
    empty = bpy.data.objects.new("empty", None)
    bpy.context.scene.collection.objects.link(empty)
    empty.select_set(True)
    with pytest.raises(RuntimeError, match="No selected object has vertices to make a box around"):
        bpy.ops.surfrecon.box_around()
    assert len(bpy.data.objects) == 1 and not bpy.data.meshes


def test_a_plain_cube_of_the_user_is_no_box_before_it_is_used(scans):
    bpy.ops.mesh.primitive_cube_add(size=1)
    assert not bpy.ops.surfrecon.keep_inside.poll()
