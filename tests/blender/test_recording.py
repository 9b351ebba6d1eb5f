"""Recordings of depth cameras and phones: some frames as objects with cameras, one object that stands for the rest."""

import contextlib
import zipfile
from importlib import import_module
from types import SimpleNamespace

import bpy
import numpy as np
import pytest
import surfrecon
from mathutils import Matrix
from recordings import CENTRE, FOCAL, SIZE, write_redwood, write_transforms

COUNT, FEW = 60, 8
VOXEL = 0.06


@pytest.fixture(scope="module")
def transforms(tmp_path_factory):
    return write_transforms(tmp_path_factory.mktemp("recordings") / "ring", COUNT)


def load(path, **options):
    return bpy.ops.surfrecon.import_scans(filepath=str(path), **{"frames": FEW, **options})


def scans():
    return [obj for obj in bpy.data.objects if "range_rows" in obj]


def rest():
    (found,) = (obj for obj in bpy.data.objects if "recording_paths" in obj)
    return found


def views():
    return [obj for obj in bpy.data.objects if obj.type == "CAMERA"]


def merge(objects, **options):
    for obj in bpy.context.view_layer.objects:
        obj.select_set(obj in objects)
    assert bpy.ops.surfrecon.merge(voxel=VOXEL, measure=False, **options) == {"FINISHED"}
    return bpy.context.object


def corners(obj):
    """Triangles of an object as places in the world, in an order of their own."""
    mesh, matrix = obj.data, np.array(obj.matrix_world)
    places = np.array([v.co[:] for v in mesh.vertices]) @ matrix[:3, :3].T + matrix[:3, 3]
    return places, np.array([p.vertices[:] for p in mesh.polygons])


def test_damaged_frames_are_skipped_and_said(tmp_path, capfd):
    path = write_transforms(tmp_path / "ring", COUNT)
    # One that becomes an object, and one that stays in its file.
    for k in (COUNT // (2 * FEW), 20):
        image = path.parent / "depths" / f"{k:05}.png"
        damaged = bytearray(image.read_bytes())
        middle = len(damaged) // 2
        damaged[middle : middle + 8] = 8 * b"\xff"
        image.write_bytes(damaged)
    assert load(path) == {"FINISHED"}
    assert len(scans()) == FEW - 1 and len(views()) == FEW - 1
    assert "Warning: 1 frame is damaged and skipped: " in capfd.readouterr().out
    merged = merge([rest(), *scans()])
    assert merged["surfrecon_report"]["scans"] == COUNT - 1 and len(merged.data.polygons) > 1000


def test_frames_become_one_collection_of_scans_cameras_and_one_object_for_the_rest(transforms):
    assert load(transforms) == {"FINISHED"}
    collection = bpy.data.collections["transforms"]
    assert len(scans()) == FEW and set(scans()) | {rest()} == set(collection.objects)
    assert len(rest()["recording_frames"]) == COUNT - FEW
    # Spread evenly: the middle of each part.
    taken = sorted(set(range(COUNT)) - set(rest()["recording_frames"]))
    assert taken == [(2 * k + 1) * COUNT // (2 * FEW) for k in range(FEW)]
    (inner,) = collection.children
    assert set(inner.objects) == set(views()) and len(views()) == FEW
    # Ready to be merged: the cameras are not among what is selected.
    assert set(bpy.context.selected_objects) == set(collection.objects)


def test_samples_poses_and_colours_are_those_of_the_library(transforms):
    load(transforms)
    frames = {frame.name: frame for frame in surfrecon.open(transforms)}
    for obj in scans():
        image = frames[obj.name].read()
        assert np.allclose(obj.matrix_world, image.world_from_sensor, atol=1e-6)
        places = np.array([v.co[:] for v in obj.data.vertices])
        assert np.allclose(places, image.points[image.valid], atol=1e-6)
        colours = np.array([c.color_srgb[:] for c in obj.data.attributes["colour"].data])
        assert np.abs(colours[:, :3] * 255 - (200, 100, 50)).max() < 0.51


def test_cameras_see_what_the_frames_saw(transforms, extension):
    load(transforms)
    scanner = extension.cameras.scanner
    frames = {frame.name: frame for frame in surfrecon.open(transforms)}
    depsgraph = bpy.context.evaluated_depsgraph_get()
    assert (bpy.context.scene.render.resolution_x, bpy.context.scene.render.resolution_y) == (2 * SIZE[1], 2 * SIZE[0])
    assert bpy.context.scene.camera in views()
    for view in views():
        there = frames[view.parent.name].camera
        seen = scanner(view, bpy.context.scene, depsgraph, there.rows, there.cols)
        assert np.allclose(seen.projection["focal"], there.projection["focal"], rtol=1e-5)
        assert np.allclose(seen.projection["centre"], there.projection["centre"], atol=1e-3)
        assert np.allclose(seen.world_from_sensor, there.world_from_sensor, atol=1e-6)
        assert 0 < view.data.clip_start < 1 < view.data.clip_end


def test_a_merge_with_the_rest_is_the_merge_of_all_frames(transforms):
    load(transforms)
    merged = merge([*scans(), rest()])
    truth = surfrecon.merge(surfrecon.open(transforms), voxel=VOXEL)
    places, faces = corners(merged)
    # The vertices of objects are in single precision, which may put a crossing into the next cell.
    assert abs(len(faces) - len(truth.mesh.triangles)) < 0.002 * len(faces)
    far = surfrecon.distances(places, truth.mesh)
    assert np.quantile(far, 0.999) < 1e-4
    assert merged["surfrecon_report"]["scans"] == COUNT
    # Without the rest it is another surface.
    alone = merge(scans())
    assert len(alone.data.polygons) != len(faces)


def test_frames_that_all_stay_in_their_file_merge_to_the_bytes_of_the_library(transforms):
    load(transforms, frames=1)
    others = rest()
    merged = merge([others])
    frames = surfrecon.open(transforms)
    # Blender keeps the voxel in single precision.
    voxel = float(np.float32(VOXEL))
    truth = surfrecon.merge([frames[k] for k in others["recording_frames"]], voxel=voxel).mesh
    places, faces = corners(merged)
    assert np.array_equal(faces, truth.triangles) and np.array_equal(places, truth.positions.astype(np.float32))
    assert "colour" in merged.data.attributes


def test_the_rest_goes_where_its_object_is_moved_turned_and_scaled(transforms):
    load(transforms, frames=1)
    before, _ = corners(merge([rest()]))
    rest().matrix_world = matrix = Matrix.LocRotScale((3, -2, 5), Matrix.Rotation(1, 3, (1, 2, 3)), (2, 2, 2))
    bpy.context.view_layer.update()
    for obj in bpy.context.view_layer.objects:
        obj.select_set(obj == rest())
    assert bpy.ops.surfrecon.merge(voxel=2 * VOXEL, measure=False) == {"FINISHED"}
    after, _ = corners(bpy.context.object)
    back = np.linalg.inv(np.array(matrix))
    after = after @ back[:3, :3].T + back[:3, 3]
    # The grid lies elsewhere, the surface does not.
    cloud = surfrecon.merge(surfrecon.open(transforms), voxel=VOXEL).mesh
    assert np.quantile(surfrecon.distances(after, cloud), 0.9) < 0.1 * VOXEL
    assert np.allclose(after.min(axis=0), before.min(axis=0), atol=VOXEL)


@pytest.mark.parametrize("scale", [(1, 2, 1), (-1, 1, 1), (0, 0, 0), (1, 1, 0)])
def test_a_rest_that_is_stretched_or_mirrored_is_refused(transforms, scale):
    load(transforms)
    rest().scale = scale
    bpy.context.view_layer.update()
    with pytest.raises(RuntimeError, match="scaled differently along its axes or mirrored"):
        bpy.ops.surfrecon.merge()


def test_unit_and_axes_hold_for_the_rest_as_for_the_objects(transforms):
    bpy.context.scene.unit_settings.scale_length = 0.5
    load(transforms, axis_forward="-Z", axis_up="Y")
    places, _ = corners(merge([*scans(), rest()]))
    one, _ = corners(merge(scans()))
    # Metres, whatever is preferred: two units each.
    assert np.allclose(places.min(axis=0), one.min(axis=0), atol=0.2)
    assert np.allclose(places.max(axis=0), one.max(axis=0), atol=0.2)
    x, y, z = np.ptp(places, axis=0)
    assert x == pytest.approx(z, rel=0.1) and y < 0.6 * x and x > 4


def test_recordings_are_in_metres_whatever_is_preferred(transforms, extension):
    preferences = bpy.context.preferences.addons[extension.__name__].preferences
    preferences.unit = "MM"
    try:
        load(transforms)
        assert max(scans()[0].dimensions) > 1
        bpy.ops.wm.read_homefile(use_empty=True)
        load(transforms, unit="MM")
        assert max(scans()[0].dimensions) < 0.01
        assert rest()["recording_scale"] == pytest.approx(0.001)
    finally:
        preferences.unit = "M"


def test_saving_and_undo_keep_the_rest(transforms, tmp_path):
    bpy.ops.ed.undo_push(message="before")
    load(transforms)
    bpy.ops.ed.undo_push(message="after")
    bpy.ops.ed.undo()
    assert not bpy.data.objects and not bpy.data.collections
    bpy.ops.ed.redo()
    first, _ = corners(merge([*scans(), rest()]))
    bpy.data.objects.remove(bpy.context.object)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "saved.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "saved.blend"))
    second, _ = corners(merge([*scans(), rest()]))
    assert np.array_equal(first, second)


def test_files_that_are_gone_or_other_are_said(tmp_path):
    folder = tmp_path / "gone"
    path = write_transforms(folder, 12, colour=None)
    load(path)
    folder.rename(tmp_path / "elsewhere")
    with pytest.raises(
        RuntimeError, match=r'"transforms: 4 more frames" stands for frames of .*cannot be opened.*put the'
    ):
        bpy.ops.surfrecon.merge()
    # The remedy that the message names.
    rest()["recording_paths"] = str(tmp_path / "elsewhere" / "transforms.json")
    assert bpy.ops.surfrecon.merge(voxel=VOXEL) == {"FINISHED"}
    write_transforms(tmp_path / "other", 9, colour=None)
    rest()["recording_paths"] = str(tmp_path / "other")
    rest().hide_set(False)
    rest().select_set(True)
    with pytest.raises(RuntimeError, match="had 12 frames, and now it has 9: import it again"):
        bpy.ops.surfrecon.merge()


def test_a_frame_whose_image_is_gone_changes_the_recording(tmp_path):
    path = write_transforms(tmp_path / "cut", 12, colour=None)
    load(path)
    lost = tmp_path / "cut" / "depths" / f"{rest()['recording_frames'][0]:05}.png"
    lost.unlink()
    before = set(bpy.data.objects)
    with pytest.raises(RuntimeError, match="had 12 frames, and now it has 11: import it again"):
        bpy.ops.surfrecon.merge()
    assert set(bpy.data.objects) == before


def test_few_frames_have_no_rest(tmp_path):
    load(write_transforms(tmp_path / "few", 5, colour=None), cameras=False)
    assert len(scans()) == 5 and not views()
    assert not [obj for obj in bpy.data.objects if "recording_paths" in obj]


def test_folders_archives_and_one_file_of_a_folder_open_the_recording(tmp_path):
    folder = write_redwood(tmp_path / "redwood", 6)
    for given in (folder, f"{folder}/"):
        bpy.ops.wm.read_homefile(use_empty=True)
        load(given)
        assert len(scans()) == 6 and bpy.data.collections.get("redwood")
    # A file browser hands over its folder and a file without a name.
    bpy.ops.wm.read_homefile(use_empty=True)
    bpy.ops.surfrecon.import_scans(filepath=f"{folder}/", directory=f"{folder}/", files=[{"name": ""}])
    assert len(scans()) == 6
    for name in ("depth/000003.png", "color/000002.png", "camera.json", "trajectory.log"):
        bpy.ops.wm.read_homefile(use_empty=True)
        load(folder / name)
        assert len(scans()) == 6 and bpy.data.collections.get("redwood"), name
    bpy.ops.wm.read_homefile(use_empty=True)
    load(folder / "depth/000003.png", whole=False, images="DEPTHS", focal=FOCAL, centre=CENTRE)
    assert len(scans()) == 1 and not views()
    with zipfile.ZipFile(tmp_path / "packed.zip", "w") as archive:
        for file in sorted(folder.rglob("*")):
            archive.write(file, file.relative_to(tmp_path))
    bpy.ops.wm.read_homefile(use_empty=True)
    load(tmp_path / "packed.zip", frames=2)
    assert len(scans()) == 2 and len(rest()["recording_frames"]) == 4
    assert len(corners(merge([*scans(), rest()]))[1]) > 500


def test_dropping_a_file_of_a_folder_opens_the_recording(tmp_path):
    """Blender hands a file over by its ending; folders have none, so that it takes no folder (seen in 4.2 to 5.0)."""
    folder = write_redwood(tmp_path / "dropped", 3)
    drop = bpy.ops.wm.drop_import_file
    assert drop("EXEC_DEFAULT", directory=f"{tmp_path}/", files=[{"name": "dropped"}]) == {"CANCELLED"}
    drop("EXEC_DEFAULT", directory=f"{folder}/", files=[{"name": "trajectory.log"}])
    assert len(scans()) == 3


def test_aligning_moves_frames_in_their_files(tmp_path):
    path = write_transforms(tmp_path / "aligned", 12, colour=None)
    load(path, frames=4)
    # The objects of half of the frames are off; a locked rest holds the truth.
    truth = {obj.name: np.array(obj.matrix_world) for obj in scans()}
    for obj in scans():
        obj.matrix_world = Matrix.Translation((0.03, -0.02, 0.02)) @ Matrix.Rotation(0.03, 4, "X") @ obj.matrix_world
    rest().lock_location = rest().lock_rotation = (True, True, True)
    bpy.context.view_layer.update()
    assert bpy.ops.surfrecon.align(start="rough") == {"FINISHED"}
    assert "recording_poses" not in rest()
    for obj in scans():
        assert np.allclose(obj.matrix_world, truth[obj.name], atol=0.01), obj.name
    # Now the rest is off, and its frames come to the objects.
    rest().lock_location = rest().lock_rotation = (False, False, False)
    for obj in scans():
        obj.lock_location = obj.lock_rotation = (True, True, True)
    rest().location = (0.03, 0.02, -0.03)
    bpy.context.view_layer.update()
    before, _ = corners(merge([rest()]))
    bpy.data.objects.remove(bpy.context.object)
    for obj in bpy.context.view_layer.objects:
        obj.select_set(obj in scans() or obj == rest())
    assert bpy.ops.surfrecon.align(start="rough") == {"FINISHED"}
    assert tuple(rest().location) == pytest.approx((0.03, 0.02, -0.03)) and "recording_poses" in rest()
    after, _ = corners(merge([rest()]))
    surface = surfrecon.merge(surfrecon.open(path), voxel=VOXEL).mesh
    assert np.median(surfrecon.distances(after, surface)) < 0.3 * np.median(surfrecon.distances(before, surface))
    # Its frames alone are scans enough.
    for obj in bpy.context.view_layer.objects:
        obj.select_set(obj == rest())
    assert bpy.ops.surfrecon.align(start="rough") == {"FINISHED"}
    assert rest()["surfrecon_align"]["of"] == 8
    rest().scale = (2, 2, 2)
    for obj in bpy.context.view_layer.objects:
        obj.select_set(obj in scans() or obj == rest())
    bpy.context.view_layer.update()
    with pytest.raises(RuntimeError, match="is scaled, and aligning moves and turns only"):
        bpy.ops.surfrecon.align()


def test_the_error_map_measures_to_frames_in_their_files(transforms):
    load(transforms, frames=1)
    merged = merge([rest()])
    assert bpy.ops.surfrecon.error_map() == {"FINISHED"}
    assert merged["surfrecon_error"]["rms"] < 0.1 * VOXEL


def test_frames_with_colours_become_objects_first(tmp_path, extension):
    spread = extension.recording.spread
    assert spread([True] * 10, 3) == spread([False] * 10, 3) == [1, 5, 8] and spread([False] * 3, 9) == [0, 1, 2]
    assert spread([False, False, True, False, False, True, False, False], 2) == [2, 5]
    path = write_transforms(tmp_path / "ring", 8)
    for k in (0, 1, 3, 4, 6, 7):
        (path.parent / "images" / f"{k:05}.png").unlink()
    load(path, frames=2)
    assert sorted(obj.name for obj in scans()) == ["00002", "00005"]
    assert all("colour" in obj.data.attributes for obj in scans())


def handed_over(monkeypatch, extension, **options):
    """Places of the scans, in the order in which aligning gets them."""
    align, places = import_module(f"{extension.__name__}.operators.align"), []

    def note(scans, **given):
        places.extend(np.array(scan.world_from_sensor)[:3, 3] for scan in scans)
        return surfrecon.Job.align(scans, **given)

    known = {name: getattr(surfrecon, name) for name in dir(surfrecon)}
    monkeypatch.setattr(align, "surfrecon", SimpleNamespace(**known | {"Job": SimpleNamespace(align=note)}))
    with contextlib.suppress(RuntimeError):
        bpy.ops.surfrecon.align(**options)
    return np.array(places)


def test_frames_are_aligned_in_the_order_of_their_recording(tmp_path, extension, monkeypatch):
    path = write_transforms(tmp_path / "ring", 12, colour=None)
    load(path, frames=4)
    for k, obj in enumerate(scans()):
        obj.name = f"{9 - k}"
    for obj in bpy.context.view_layer.objects:
        obj.select_set(obj in scans() or obj == rest())
    places = handed_over(monkeypatch, extension, start="sequence")
    expected = [np.array(scan.world_from_sensor)[:3, 3] for scan in surfrecon.open(path)]
    assert np.allclose(places, expected, atol=1e-5)


def test_scans_of_no_recording_are_aligned_in_the_order_of_their_names(tmp_path, extension, monkeypatch):
    load(write_transforms(tmp_path / "ring", 4, colour=None))
    for k, obj in enumerate(scans()):
        obj.name = f"view {12 - k}"
    del scans()[0]["recording_frame"]
    for obj in bpy.context.view_layer.objects:
        obj.select_set(obj in scans())
    expected = [bpy.data.objects[f"view {k}"].matrix_world.translation for k in (9, 10, 11, 12)]
    expected = [tuple(place) for place in expected]
    assert np.allclose(handed_over(monkeypatch, extension, start="sequence"), expected, atol=1e-5)
