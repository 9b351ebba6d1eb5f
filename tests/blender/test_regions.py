"""Keep or Remove, Remove Background, True Size and Ground: of objects, and of frames that stay in their files."""

from types import SimpleNamespace

import bpy
import numpy as np
import pytest
import surfrecon
from mathutils import Matrix
from recordings import write_transforms
from shapes import torus
from test_recording import corners, load, merge, rest, scans

VOXEL = 0.06


def standing_torus():
    """A torus on a floor, of which the frames see more than of the torus."""
    ring = surfrecon.Mesh(0.6 * torus().positions, torus().triangles)
    low = float(ring.positions[:, 2].min())
    floor = np.array([[x, y, low] for x, y in ((-3, -3), (3, -3), (3, 3), (-3, 3))], float)
    triangles = np.array([[0, 1, 2], [0, 2, 3]]) + len(ring.positions)
    return surfrecon.Mesh(np.concatenate([ring.positions, floor]), np.concatenate([ring.triangles, triangles])), low


@pytest.fixture(scope="module")
def standing(tmp_path_factory):
    subject, low = standing_torus()
    return write_transforms(tmp_path_factory.mktemp("standing") / "ring", 12, colour=None, subject=subject), low


def world(obj):
    matrix = np.array(obj.matrix_world)
    return np.array([v.co[:] for v in obj.data.vertices]) @ matrix[:3, :3].T + matrix[:3, 3]


def cube(low, high):
    bpy.ops.mesh.primitive_cube_add(size=1)
    made = bpy.context.object
    made.location, made.scale = (np.array(low) + high) / 2, np.array(high, float) - low
    bpy.context.view_layer.update()
    return made


def choose(objects, active):
    for obj in bpy.context.view_layer.objects:
        obj.select_set(obj in objects)
    active.select_set(True)
    bpy.context.view_layer.objects.active = active


def test_a_box_keeps_or_removes_of_objects_and_of_frames_in_their_files(standing):
    path, low = standing
    load(path, frames=3)
    low_corner, high_corner = np.array((-2, -2, low + 0.05)), np.array((0.1, 2, 2))
    choose([*scans(), rest()], cube(low_corner, high_corner))
    before = {obj.name: world(obj) for obj in scans()}
    assert bpy.ops.surfrecon.select_region(action="KEEP") == {"FINISHED"}
    region = surfrecon.Box.between(low_corner, high_corner)
    for obj in scans():
        inside = region.contains(before[obj.name])
        assert len(obj.data.vertices) == pytest.approx(inside.sum(), abs=2) and inside.sum() > 100
    # Still range images, with their rays.
    merged = merge([*scans(), rest()])
    places, faces = corners(merged)
    assert places[:, 0].max() < 0.1 + VOXEL and places[:, 2].min() > low
    truth = surfrecon.merge(surfrecon.keep(surfrecon.open(path), region), voxel=VOXEL).mesh
    assert abs(len(faces) - len(truth.triangles)) < 0.02 * len(faces)
    assert np.quantile(surfrecon.distances(places, truth), 0.99) < 1e-4


def test_what_frames_in_their_files_keep_goes_with_them(standing):
    path, low = standing
    load(path, frames=1)
    choose([rest()], cube((-2, -2, low + 0.05), (0.1, 2, 2)))
    bpy.ops.surfrecon.select_region(action="KEEP")
    before, _ = corners(merge([rest()]))
    bpy.ops.object.select_all(action="DESELECT")
    rest().matrix_world = matrix = Matrix.Translation((5, 1, 2)) @ Matrix.Rotation(2.0, 4, "Z")
    bpy.context.view_layer.update()
    after, _ = corners(merge([rest()]))
    back = np.linalg.inv(np.array(matrix))
    after = after @ back[:3, :3].T + back[:3, 3]
    assert np.allclose(after.max(axis=0), before.max(axis=0), atol=VOXEL)
    assert after[:, 0].max() < 0.1 + VOXEL


def test_a_plane_removes_what_lies_on_it_and_below(standing):
    path, low = standing
    load(path, frames=3)
    bpy.ops.mesh.primitive_plane_add(size=1, location=(0, 0, low + 0.1))
    plane = bpy.context.object
    choose([*scans(), rest()], plane)
    assert bpy.ops.surfrecon.select_region() == {"FINISHED"}
    assert all(world(obj)[:, 2].min() > low + 0.0999 for obj in scans())
    places, _ = corners(merge([*scans(), rest()]))
    assert places[:, 2].min() > low + 0.05
    # Turned over it removes the rest, of which nothing is left.
    plane.rotation_euler = (np.pi, 0, 0)
    plane.location.z = low
    bpy.context.view_layer.update()
    choose(scans(), plane)
    with pytest.raises(RuntimeError, match="Nothing would be left"):
        bpy.ops.surfrecon.select_region()


def test_selected_and_painted_vertices(standing):
    path, _ = standing
    load(path, frames=2)
    obj = scans()[0]
    count = len(obj.data.vertices)
    choose([obj], obj)
    chosen = np.zeros(count, bool)
    chosen[:500] = True
    obj.data.vertices.foreach_set("select", chosen)
    assert bpy.ops.surfrecon.select_region(by="SELECTED") == {"FINISHED"}
    assert len(obj.data.vertices) == count - 500
    group = obj.vertex_groups.new(name="paint")
    group.add(list(range(100)), 0.8, "REPLACE")
    group.add(list(range(100, 200)), 0.2, "REPLACE")
    assert bpy.ops.surfrecon.select_region(by="GROUP") == {"FINISHED"}
    assert len(obj.data.vertices) == count - 600
    with pytest.raises(RuntimeError, match="no masked vertex: paint a mask in Sculpt Mode"):
        bpy.ops.surfrecon.select_region(by="MASK")
    mask = obj.data.attributes.new(".sculpt_mask", "FLOAT", "POINT")
    values = np.zeros(count - 600, np.float32)
    values[:1000] = 1
    mask.data.foreach_set("value", values)
    assert bpy.ops.surfrecon.select_region(by="MASK", action="KEEP") == {"FINISHED"}
    assert len(obj.data.vertices) == 1000
    with pytest.raises(RuntimeError, match="Make the cube or the plane the active object"):
        bpy.ops.surfrecon.select_region()


def test_the_background_is_found_and_removed_undone_too(standing):
    path, low = standing
    load(path, frames=3)
    choose([*scans(), rest()], scans()[0])
    bpy.ops.ed.undo_push(message="before")
    before = sum(len(obj.data.vertices) for obj in scans())
    assert bpy.ops.surfrecon.remove_background() == {"FINISHED"}
    bpy.ops.ed.undo_push(message="after")
    for obj in scans():
        assert world(obj)[:, 2].min() > low and len(obj.data.vertices) > 100
    assert sum(len(obj.data.vertices) for obj in scans()) < 0.7 * before
    places, _ = corners(merge([*scans(), rest()]))
    # Points beside the torus were floor.
    assert np.linalg.norm(places[:, :2], axis=1).max() < 1
    bpy.ops.ed.undo()
    assert sum(len(obj.data.vertices) for obj in scans()) == before and "recording_selections" not in rest()


def test_no_plane_is_refused(tmp_path):
    load(write_transforms(tmp_path / "ring", 4, colour=None))
    with pytest.raises(RuntimeError, match="plane"):
        bpy.ops.surfrecon.remove_background(min_share=0.9)


@pytest.mark.parametrize("plain", [True, False])
def test_what_is_left_keeps_all_it_had(standing, extension, plain):
    load(standing[0], frames=1, cameras=False)
    obj = scans()[0]
    mesh = obj.data
    if not plain:
        obj.vertex_groups.new(name="slow").add([0, 5], 0.5, "REPLACE")
    count = len(mesh.vertices)
    mesh.attributes.new("by_face", "INT", "FACE").data.foreach_set(
        "value", np.arange(len(mesh.polygons), dtype=np.int32)
    )
    mesh.attributes.new("by_corner", "FLOAT2", "CORNER")
    colours = mesh.attributes.new("tint", "FLOAT_COLOR", "POINT")
    colours.data.foreach_set("color", np.linspace(0, 1, 4 * count, dtype=np.float32))
    mesh.color_attributes.active_color = mesh.color_attributes["tint"]
    assert extension.pruning.is_plain(mesh) == plain
    places, rows = (
        extension.convert.positions(mesh),
        extension.convert.vertex_values(mesh, "range_row", "INT", np.int32),
    )
    faces = np.array([p.vertices[:] for p in mesh.polygons])
    keep = np.random.default_rng(1).random(count) < 0.9
    extension.pruning.keep_vertices(mesh, keep)
    assert np.array_equal(extension.convert.positions(mesh), places[keep])
    assert np.array_equal(extension.convert.vertex_values(mesh, "range_row", "INT", np.int32), rows[keep])
    stays = keep[faces].all(axis=1)
    number = np.cumsum(keep) - 1
    assert np.array_equal(np.array([p.vertices[:] for p in mesh.polygons]), number[faces[stays]])
    found = [value.value for value in mesh.attributes["by_face"].data]
    assert found == np.flatnonzero(stays).tolist()
    left = np.array([value.color[:] for value in mesh.attributes["tint"].data])
    assert np.allclose(left.reshape(-1), np.linspace(0, 1, 4 * count).reshape(-1, 4)[keep].reshape(-1), atol=1e-6)
    assert mesh.color_attributes.active_color_name == "tint" and not mesh.validate()
    assert "by_corner" in mesh.attributes and len(mesh.attributes["by_corner"].data) == len(mesh.loops)
    if not plain:
        assert any(len(v.groups) for v in mesh.vertices) == bool(keep[0] or keep[5])


def ruler(*points):
    """A scene as Blender's ruler leaves it. Python can't draw one."""
    stroke = SimpleNamespace(points=[SimpleNamespace(co=Matrix.Translation(p).translation) for p in points])
    layer = SimpleNamespace(frames=[SimpleNamespace(strokes=[stroke])])
    return SimpleNamespace(annotation=SimpleNamespace(layers={"RulerData3D": layer}))


def test_the_ruler_is_read(extension):
    read = extension.regions.ruler_points
    assert np.allclose(read(ruler((1, 2, 3), (4, 5, 6)), 2), [(1, 2, 3), (4, 5, 6)])
    # A bent one: its ends, and all of it.
    assert np.allclose(read(ruler((1, 2, 3), (0, 0, 0), (4, 5, 6)), 2), [(1, 2, 3), (4, 5, 6)])
    assert len(read(ruler((1, 2, 3), (0, 0, 0), (4, 5, 6)), 3)) == 3
    assert read(ruler((1, 2, 3), (4, 5, 6)), 3) is None and read(bpy.context.scene, 2) is None


def test_true_size_scales_scans_frames_cameras_and_results_alike(standing, extension, monkeypatch):
    path, _ = standing
    load(path, frames=3)
    merged = merge([*scans(), rest()])
    before, _ = corners(merged)
    poses = {obj.name: np.array(obj.matrix_world) for obj in bpy.data.objects}
    clip = {obj.name: obj.data.clip_end for obj in bpy.data.objects if obj.type == "CAMERA"}
    # Two vertices of a mesh that say a length of 0.5.
    known = bpy.data.meshes.new("known")
    known.from_pydata([(0, 0, 0), (0.5, 0, 0)], [], [])
    stick = bpy.data.objects.new("stick", known)
    bpy.context.scene.collection.objects.link(stick)
    known.vertices.foreach_set("select", [True, True])
    choose([*scans(), rest(), merged], stick)
    stick.select_set(True)
    assert bpy.ops.surfrecon.true_size(distance=1.5) == {"FINISHED"}
    bpy.context.view_layer.update()
    for obj in scans():
        assert np.allclose(np.array(obj.matrix_world)[:3, :3], poses[obj.name][:3, :3], atol=1e-6)
        assert np.allclose(obj.matrix_world.translation, 3 * poses[obj.name][:3, 3], atol=1e-5)
        image = extension.scan_objects.scan_of_object(obj, bpy.context.evaluated_depsgraph_get())
        assert image.projection["kind"] == "pinhole"
    for name, far in clip.items():
        obj = bpy.data.objects[name]
        assert np.allclose(obj.matrix_world.translation, 3 * poses[name][:3, 3], atol=1e-5)
        assert obj.data.clip_end == pytest.approx(3 * far)
    assert np.allclose(corners(merged)[0], 3 * before, atol=1e-5)
    choose([*scans(), rest()], rest())
    assert bpy.ops.surfrecon.merge(voxel=3 * VOXEL, measure=False) == {"FINISHED"}
    again, _ = corners(bpy.context.object)
    assert np.allclose(again.max(axis=0), 3 * before.max(axis=0), atol=3 * VOXEL)
    choose([rest()], rest())
    with pytest.raises(RuntimeError, match="No points are picked"):
        bpy.ops.surfrecon.true_size(distance=1)


@pytest.mark.parametrize(("lift", "said"), [(0.0, False), (0.1, True)])
def test_ends_of_the_ruler_that_lie_in_the_air_are_told(extension, monkeypatch, capfd, lift, said):
    bpy.ops.mesh.primitive_plane_add(size=4)
    ends = np.array([(0.3, 0.4, 0), (1.3, 0.4, lift)])
    monkeypatch.setattr(extension.regions, "ruler_points", lambda scene, count: ends[:count])
    assert bpy.ops.surfrecon.true_size(distance=2) == {"FINISHED"}
    text = "The ends of the ruler lie 0 m and 10 cm off the surface: drag them with Ctrl held"
    assert (text in capfd.readouterr().out) == said


def looking_down(is_perspective, height=10.0):
    """A context whose view looks down from the z axis."""
    view = SimpleNamespace(view_matrix=Matrix.Translation((0, 0, -height)), is_perspective=is_perspective)
    context = bpy.context
    return SimpleNamespace(
        scene=context.scene,
        space_data=SimpleNamespace(region_3d=view),
        evaluated_depsgraph_get=context.evaluated_depsgraph_get,
        region=None,
        preferences=context.preferences,
    )


@pytest.mark.parametrize(("is_perspective", "grown"), [(False, 1.0), (True, 2.0)])
def test_ends_of_the_ruler_go_to_what_is_seen_below_them(extension, monkeypatch, is_perspective, grown):
    bpy.ops.mesh.primitive_plane_add(size=8)
    plane = bpy.context.object
    bpy.ops.mesh.primitive_plane_add(size=8, location=(0, 0, -1))
    ends = np.array([(-0.5, 0.2, 5), (0.7, 0.3, 5)])
    monkeypatch.setattr(extension.regions, "ruler_points", lambda scene, count: ends)
    found, said, warns = extension.regions.ends_of_ruler(looking_down(is_perspective), [bpy.context.object, plane])
    assert np.allclose(found, ends * (grown, grown, 0), atol=1e-5) and not warns
    assert said.endswith("off the surface: what is seen below them is taken")


def test_an_end_of_the_ruler_that_is_snapped_stays(extension, monkeypatch):
    bpy.ops.mesh.primitive_plane_add(size=8, rotation=(0, 0.3, 0))
    ends = np.array([(0.0, 0, 0), (1.0, 0, 0)])
    monkeypatch.setattr(extension.regions, "ruler_points", lambda scene, count: ends)
    found, _, warns = extension.regions.ends_of_ruler(looking_down(False), [bpy.context.object])
    assert np.allclose(found, [(0, 0, 0), (1, 0, -np.tan(0.3))], atol=1e-5) and not warns


@pytest.mark.parametrize(
    ("ends", "why"),
    [
        ([(-0.5, 0, 5), (0.5, 0, 4)], "the view was turned since"),
        ([(-0.5, 0, 5), (6.0, 0, 5)], "nothing is seen below an end"),
        ([(-0.5, 0, 5), (3.99, 0, 5)], "an end is at a border"),
    ],
)
def test_ends_of_the_ruler_stay_in_the_air_where_nothing_decides(extension, monkeypatch, ends, why):
    bpy.ops.mesh.primitive_plane_add(size=8)
    monkeypatch.setattr(extension.regions, "ruler_points", lambda scene, count: np.array(ends))
    found, said, warns = extension.regions.ends_of_ruler(looking_down(False), [bpy.context.object])
    assert found is None and warns, why
    assert said.endswith("off the surface: drag them with Ctrl held, which snaps them")


def test_the_length_is_that_between_the_ends_on_the_surface(extension, monkeypatch):
    bpy.ops.mesh.primitive_plane_add(size=4)
    plane = bpy.context.object
    ends = np.array([(-0.5, 0, 0.5), (0.5, 0, 0.5)])
    monkeypatch.setattr(extension.regions, "ruler_points", lambda scene, count: ends)
    assert bpy.ops.surfrecon.true_size(distance=3, ends=(-0.75, 0, 0, 0.75, 0, 0)) == {"FINISHED"}
    bpy.context.view_layer.update()
    assert plane.dimensions.x == pytest.approx(8)


def test_nothing_is_scaled_or_grounded_that_would_not_stay(standing, extension, monkeypatch):
    path, _ = standing
    load(path, frames=2)
    monkeypatch.setattr(extension.regions, "ruler_points", lambda scene, least: np.eye(3)[:least])
    first, second = scans()[:2]
    before = {obj.name: np.array(obj.matrix_world) for obj in bpy.data.objects}
    choose([first, second], second)

    def refused():
        for ask in (lambda: bpy.ops.surfrecon.true_size(distance=2), lambda: bpy.ops.surfrecon.ground(by="PICKED")):
            with pytest.raises(RuntimeError, match=f'"{second.name}" does not stay where it is put: turn off its'):
                ask()
        assert all(np.array_equal(obj.matrix_world, before[obj.name]) for obj in bpy.data.objects)

    second.keyframe_insert("location")
    refused()
    second.animation_data_clear()
    held = second.constraints.new("LIMIT_LOCATION")
    refused()
    held.mute = True
    # Deltas are part of where an object lies.
    first.delta_location = (0.1, 0.2, 0.3)
    bpy.context.view_layer.update()
    lay = first.matrix_world.translation.copy()
    scale = bpy.ops.surfrecon.true_size(distance=2 * 2**0.5)
    bpy.context.view_layer.update()
    assert scale == {"FINISHED"} and np.allclose(first.matrix_world.translation, 2 * lay, atol=1e-5)


def samples_of_frames(extension):
    """How many samples each frame in its file has."""
    walk = extension.recording.frames(rest(), bpy.context.evaluated_depsgraph_get())
    while True:
        try:
            next(walk)
        except StopIteration as ended:
            return [scan.read().valid.sum() for scan in ended.value]


def test_what_is_kept_of_frames_stays_with_its_samples_wherever_aligning_puts_them(standing, extension):
    path, low = standing
    load(path, frames=3)
    recording = extension.recording
    plane = surfrecon.Plane((0, 0, low), (0, 0, 1), margin=0.02)
    box = np.diag([0.4, 0.5, 5.0, 1.0])
    random = np.random.default_rng(1)

    def aligned():
        """Frames as aligning might put them."""
        world_from_recording = recording.placement(rest(), bpy.context.evaluated_depsgraph_get())
        poses = np.tile(np.eye(4), (len(rest()["recording_frames"]), 1, 1))
        scans = surfrecon.open(path)
        for pose, number in zip(poses, rest()["recording_frames"], strict=True):
            turn = Matrix.Rotation(random.normal(0, 0.2), 4, "X") @ Matrix.Translation(random.normal(0, 0.3, 3))
            pose[:] = np.array(turn) @ world_from_recording @ scans[number].world_from_sensor
        recording.put(rest(), world_from_recording, poses)

    whole = samples_of_frames(extension)
    recording.note_selection(rest(), plane, False, np.eye(4))
    without_floor = samples_of_frames(extension)
    assert sum(without_floor) < 0.9 * sum(whole)
    aligned()
    assert samples_of_frames(extension) == without_floor
    recording.note_selection(rest(), box, True, np.eye(4))
    kept = samples_of_frames(extension)
    assert 0 < sum(kept) < sum(without_floor)
    aligned()
    aligned()
    assert samples_of_frames(extension) == kept
    recording.grow(rest(), 2.0)
    assert samples_of_frames(extension) == kept


@pytest.mark.parametrize("baked", [False, True])
def test_a_plane_becomes_the_ground(standing, baked):
    path, low = standing
    tilt = Matrix.Translation((1, 2, 3)) @ Matrix.Rotation(0.4, 4, "X")
    # AUTO: imported scans come with all vertices selected, which picks none.
    for by in ("FOUND", "AUTO", "OBJECT", "PICKED"):
        bpy.ops.wm.read_homefile(use_empty=True)
        load(path, frames=3)
        for obj in [*scans(), rest()]:
            obj.matrix_world = tilt @ obj.matrix_world
        bpy.context.view_layer.update()
        if baked:
            # Then only their vertices tell where they were seen from.
            choose(scans(), scans()[0])
            bpy.ops.object.transform_apply(location=True, rotation=True, scale=True)
        chosen = [*scans(), rest()]
        active = chosen[0]
        if by == "OBJECT":
            active = bpy.data.objects.new("plane", None)
            bpy.context.scene.collection.objects.link(active)
            active.matrix_world = tilt @ Matrix.Translation((0, 0, low))
        elif by == "PICKED":
            mesh = bpy.data.meshes.new("corners")
            mesh.from_pydata([(0, 0, low), (1, 0, low), (0, -1, low), (0, 0, 7)], [], [])
            active = bpy.data.objects.new("corners", mesh)
            bpy.context.scene.collection.objects.link(active)
            active.matrix_world = tilt
            mesh.vertices.foreach_set("select", [True, True, True, False])
        bpy.context.view_layer.update()
        choose(chosen, active)
        assert bpy.ops.surfrecon.ground(by=by) == {"FINISHED"}
        bpy.context.view_layer.update()
        places, _ = corners(merge(chosen))
        # The floor is at 0 and the torus above.
        assert abs(np.quantile(places[:, 2], 0.2)) < 0.005 and places[:, 2].max() > 0.3, by
