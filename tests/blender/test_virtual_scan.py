"""Scans of what is in the scene: the cameras' geometry, noise, and that what comes out is a range image."""

import math

import bpy
import numpy as np
import pytest
import surfrecon
from mathutils import Matrix, Vector
from shapes import torus, torus_distance
from test_merge import add_mesh, surface


def camera_at(name, place, target=(0, 0, 0), **settings):
    camera = bpy.data.objects.new(name, bpy.data.cameras.new(name))
    bpy.context.scene.collection.objects.link(camera)
    toward = Vector(target) - Vector(place)
    camera.matrix_world = Matrix.Translation(place) @ toward.to_track_quat("-Z", "Y").to_matrix().to_4x4()
    for key, value in settings.items():
        setattr(camera.data, key, value)
    bpy.context.scene.camera = camera
    bpy.context.view_layer.update()
    return camera


@pytest.fixture
def scene():
    render = bpy.context.scene.render
    render.resolution_x, render.resolution_y, render.resolution_percentage = 160, 120, 100
    return bpy.context.scene


def image_of(extension, obj):
    image = extension.scan_objects.scan_of_object(obj, bpy.context.evaluated_depsgraph_get())
    assert isinstance(image, surfrecon.RangeImage)
    return image


@pytest.mark.parametrize(
    "settings",
    [
        {"type": "PERSP"},
        {"type": "PERSP", "lens": 30, "shift_x": 0.1, "shift_y": -0.05},
        {"type": "PERSP", "sensor_fit": "VERTICAL"},
        {"type": "ORTHO", "ortho_scale": 4},
        {"type": "ORTHO", "ortho_scale": 4, "shift_x": 0.1},
    ],
)
def test_samples_lie_on_the_object_and_at_the_pixels_where_blender_draws_them(scene, extension, settings):
    from bpy_extras.object_utils import world_to_camera_view

    camera = camera_at("Eye", (3, -3, 2.5), **settings)
    add_mesh("torus", torus(100))
    assert bpy.ops.surfrecon.reproject(percent=50) == {"FINISHED"}
    scan = bpy.context.object
    assert scan.name == "Eye scan" and scan.users_collection[0].name == "Scans of torus"
    image = image_of(extension, scan)
    assert (image.rows, image.cols) == (60, 80) and image.valid.sum() > 300
    world = image.world_points()
    assert np.abs(torus_distance(world[image.valid])).max() < 0.002
    for row, column in np.argwhere(image.valid)[::97]:
        seen = world_to_camera_view(scene, camera, Vector(world[row, column]))
        assert seen.x * 80 - 0.5 == pytest.approx(column, abs=0.01)
        assert (1 - seen.y) * 60 - 0.5 == pytest.approx(row, abs=0.01)


def test_a_panorama_sees_all_around(scene, extension):
    camera_at("Eye", (0, 0, 0), target=(0, 1, 0), type="PANO")
    add_mesh("sphere", surfrecon.Mesh(torus(40).positions, torus(40).triangles))
    bpy.ops.surfrecon.reproject()
    image = image_of(extension, bpy.context.object)
    assert image.valid.any(axis=0).all()
    assert np.abs(torus_distance(image.world_points()[image.valid])).max() < 0.01


def test_a_scan_can_be_sculpted_and_several_merged(scene):
    for k in range(6):
        angle = k * math.pi / 3
        camera_at(f"Eye {k}", (4 * math.cos(angle), 4 * math.sin(angle), 2 if k % 2 else -2))
    add_mesh("torus", torus(60))
    assert bpy.ops.surfrecon.virtual_scan(percent=100) == {"FINISHED"}
    scans = bpy.context.selected_objects
    assert len(scans) == 6 and len({tuple(obj.color) for obj in scans}) == 6
    bpy.ops.surfrecon.merge(voxel=0.08)
    made = surface(bpy.context.object)
    assert made.check()["is_manifold"]
    assert np.quantile(np.abs(torus_distance(made.positions)), 0.99) < 0.02
    for obj in bpy.context.selected_objects:
        obj.select_set(False)
    scans[0].select_set(True)
    bpy.context.view_layer.objects.active = scans[0]
    assert bpy.ops.surfrecon.sculpt(tolerance=0.01) == {"FINISHED"}


def test_noise_dropout_and_range(scene, extension):
    camera_at("Eye", (0, 0, 5))
    add_mesh("torus", torus(60))
    bpy.ops.surfrecon.virtual_scan(noise=0.02, dropout=0.3, seed=3)
    noisy = image_of(extension, bpy.context.object)
    torus_object = bpy.data.objects["torus"]
    for obj in bpy.context.selected_objects:
        obj.select_set(False)
    torus_object.select_set(True)
    bpy.ops.surfrecon.virtual_scan()
    exact = image_of(extension, bpy.context.object)
    assert noisy.valid.sum() == pytest.approx(0.7 * exact.valid.sum(), rel=0.05)
    both = noisy.valid & exact.valid
    assert np.std((noisy.world_points() - exact.world_points())[both], axis=0)[2] == pytest.approx(0.02, rel=0.1)
    for obj in bpy.context.selected_objects:
        obj.select_set(False)
    torus_object.select_set(True)
    with pytest.raises(RuntimeError, match='"Eye" sees nothing of torus'):
        bpy.ops.surfrecon.virtual_scan(max_range=1)


def test_instances_modifiers_colours_and_mirrors(scene, extension):
    camera_at("Eye", (0, 0, 6))
    obj = add_mesh("torus", torus(60), Matrix.Diagonal((-1, 1, 1, 1)))
    layer = obj.data.attributes.new("colour", "BYTE_COLOR", "POINT")
    layer.data.foreach_set("color_srgb", np.tile(np.float32([1, 0, 0.2, 1]), len(obj.data.vertices)))
    array = obj.modifiers.new("Displace", "DISPLACE")
    array.strength, array.mid_level = 0.1, 0
    bpy.context.view_layer.update()
    # Front faces only: mirrored ones must have been turned.
    assert bpy.ops.surfrecon.virtual_scan(backfaces=False) == {"FINISHED"}
    image = image_of(extension, bpy.context.object)
    points = image.world_points()[image.valid] * [-1, 1, 1]
    assert np.median(torus_distance(points)) == pytest.approx(0.1, abs=0.01)
    assert (image.colour[image.valid] == [255, 0, 51, 255]).all()
    assert bpy.context.object.data.materials[0].name == "Scan colours"


def test_undo_and_saving_keep_it_a_range_image(scene, extension, tmp_path):
    camera_at("Eye", (0, 0, 6))
    add_mesh("torus", torus(30))
    bpy.ops.ed.undo_push(message="before")
    bpy.ops.surfrecon.reproject()
    bpy.ops.ed.undo_push(message="after")
    bpy.ops.ed.undo()
    assert "Eye scan" not in bpy.data.objects and "Scans of torus" not in bpy.data.collections
    bpy.ops.ed.redo()
    before = image_of(extension, bpy.data.objects["Eye scan"]).world_points()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scan.blend"))
    bpy.ops.wm.read_homefile(use_empty=True)
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "scan.blend"))
    after = image_of(extension, bpy.data.objects["Eye scan"]).world_points()
    assert np.array_equal(before, after, equal_nan=True)


def test_bad_selections(scene):
    assert not bpy.ops.surfrecon.reproject.poll()
    add_mesh("torus", torus(20))
    with pytest.raises(RuntimeError, match="The scene has no camera to scan from"):
        bpy.ops.surfrecon.reproject()
    with pytest.raises(RuntimeError, match="There is no visible camera to scan with"):
        bpy.ops.surfrecon.virtual_scan()
    camera_at("Eye", (0, 0, 6), target=(0, 0, 12))
    with pytest.raises(RuntimeError, match='"Eye" sees nothing of torus: point a camera at it'):
        bpy.ops.surfrecon.reproject()
    with pytest.raises(RuntimeError, match="There is no selected camera"):
        bpy.ops.surfrecon.virtual_scan(cameras="SELECTED")
    scene.render.resolution_x = scene.render.resolution_y = 60000
    with pytest.raises(RuntimeError, match="are too many: lower the resolution"):
        bpy.ops.surfrecon.reproject(percent=1000)
    scene.render.resolution_x = scene.render.resolution_y = 4
    with pytest.raises(RuntimeError, match="at least 2 x 2 pixels"):
        bpy.ops.surfrecon.reproject(percent=1)
    assert [obj.name for obj in bpy.data.objects if obj.type == "MESH"] == ["torus"]


def test_cancelling_leaves_the_scene_as_it_was(scene, extension, monkeypatch):
    camera_at("Eye", (0, 0, 6))
    add_mesh("torus", torus(20))
    running = extension.job.Running

    def ended(original=running.ended):
        running.job.cancel()
        while not original():
            pass
        return True

    monkeypatch.setattr(running, "ended", ended)
    scene.render.resolution_x = scene.render.resolution_y = 8000
    assert bpy.ops.surfrecon.virtual_scan(percent=100) == {"CANCELLED"}
    assert sorted(bpy.data.objects.keys()) == ["Eye", "torus"] and not bpy.data.collections
