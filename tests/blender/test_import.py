"""File > Import > Range Scans."""

from types import SimpleNamespace

import bpy
import numpy as np
import pytest
import surfrecon
from files import write_range_grid, write_set
from shapes import torus_scans


@pytest.fixture(scope="module")
def images():
    return torus_scans(pixels=40)


@pytest.fixture
def conf(tmp_path, images):
    return write_set(tmp_path, images)


def import_scans(path, **options):
    return bpy.ops.surfrecon.import_scans(filepath=str(path), **options)


def by_name(name):
    return bpy.data.objects[name]


def vertices(obj):
    flat = np.empty(3 * len(obj.data.vertices), np.float32)
    obj.data.vertices.foreach_get("co", flat)
    return flat.reshape(-1, 3)


def values(obj, name, dtype=np.int32):
    out = np.empty(len(obj.data.vertices), dtype)
    obj.data.attributes[name].data.foreach_get("value", out)
    return out


def world(obj):
    matrix = np.array(obj.matrix_world)
    return vertices(obj) @ matrix[:3, :3].T + matrix[:3, 3]


def test_one_object_a_scan_in_a_collection(conf, images):
    assert import_scans(conf) == {"FINISHED"}
    collection = bpy.data.collections["torus"]
    assert {obj.name for obj in collection.objects} == {image.name for image in images}
    assert set(bpy.context.selected_objects) == set(collection.objects)
    assert bpy.context.object in set(collection.objects)


def test_samples_poses_and_grids_arrive(conf, images):
    import_scans(conf)
    for image in images:
        obj = by_name(image.name)
        assert np.allclose(obj.matrix_world, image.world_from_sensor, atol=1e-6)
        assert (obj["range_rows"], obj["range_columns"]) == (image.rows, image.cols)
        row, column = values(obj, "range_row"), values(obj, "range_col")
        assert len(row) == image.valid.sum()
        assert np.allclose(vertices(obj), image.points[row, column], atol=1e-6)
        assert np.allclose(world(obj), image.world_points()[row, column], atol=1e-5)


def test_faces_are_those_of_the_library_and_valid(conf, images):
    import_scans(conf)
    for image in images:
        mesh = by_name(image.name).data
        assert len(mesh.polygons) == pytest.approx(len(image.triangulate().triangles), rel=0.01)
        assert not mesh.validate()


def test_points_only(conf, images):
    import_scans(conf, faces=False)
    for image in images:
        mesh = by_name(image.name).data
        assert len(mesh.polygons) == 0 and len(mesh.vertices) == image.valid.sum()


def test_unit_and_axes(conf, images):
    import_scans(conf, unit="MM", axis_forward="-Z", axis_up="Y")
    for image in images:
        obj = by_name(image.name)
        x, y, z = np.moveaxis(image.world_points()[values(obj, "range_row"), values(obj, "range_col")], -1, 0)
        assert np.allclose(world(obj), 0.001 * np.stack([x, -z, y], axis=1), atol=1e-8)
        assert np.allclose(obj.matrix_world.to_scale(), 1, atol=1e-6)


def test_forward_follows_up_in_the_dialog(extension):
    check = extension.operators.import_scans.SURFRECON_OT_import_scans.check
    # What Blender's dialog holds when Up was just chosen: both on one axis.
    for up, forward in (("Y", "-Z"), ("-Y", "Z"), ("X", "Y"), ("-Z", "Y")):
        dialog = SimpleNamespace(axis_up=up, axis_forward=up, up_before="Z")
        assert check(dialog, None)
        assert (dialog.axis_up, dialog.axis_forward, dialog.up_before) == (up, forward, up)


def test_a_custom_scale(conf):
    import_scans(conf, unit="CUSTOM", scale=10)
    assert np.linalg.norm(world(by_name("scan00")), axis=1).max() > 9


def test_several_files(tmp_path, images):
    for image in images[:3]:
        write_range_grid(tmp_path / f"{image.name}.ply", image)
    files = [{"name": f"{image.name}.ply"} for image in images[:3]]
    assert bpy.ops.surfrecon.import_scans(directory=str(tmp_path), files=files) == {"FINISHED"}
    assert len(bpy.data.collections[tmp_path.name].objects) == 3


def test_undo_is_one_step(conf, images):
    bpy.ops.ed.undo_push(message="before")
    import_scans(conf)
    bpy.ops.ed.undo_push(message="after")
    assert len(bpy.data.objects) == len(images)
    bpy.ops.ed.undo()
    assert len(bpy.data.objects) == 0 and len(bpy.data.collections) == 0


@pytest.mark.parametrize("victim", ["scan00.ply", "scan11.ply"])
@pytest.mark.parametrize("damage", ["missing", "cut", "empty"])
def test_a_bad_scan_is_named_and_nothing_stays(conf, victim, damage):
    path = conf.parent / victim
    if damage == "missing":
        path.unlink()
    else:
        path.write_text(path.read_text()[: -20 if damage == "cut" else 0])
    with pytest.raises(RuntimeError, match=victim.replace(".", r"\.")):
        import_scans(conf)
    assert not bpy.data.objects and not bpy.data.meshes and not bpy.data.collections


@pytest.mark.parametrize("path", ["", "nowhere.conf", "folder"])
def test_a_path_that_is_no_scan(tmp_path, path):
    (tmp_path / "folder").mkdir()
    with pytest.raises(RuntimeError):
        import_scans(tmp_path / path if path else "")
    assert not bpy.data.objects and not bpy.data.collections


def test_scans_far_away_are_moved_and_say_so(tmp_path, images):
    far = np.array([4.5e6, 5.1e6, 300.0])
    moved = torus_scans(pixels=40)
    for image in moved:
        pose = np.array(image.world_from_sensor)
        pose[:3, 3] += far
        image.world_from_sensor = pose
    conf = write_set(tmp_path, moved)
    import_scans(conf)
    origin = np.array(bpy.data.collections["torus"]["world_origin"])
    for image in images:
        obj = by_name(image.name)
        truth = image.world_points()[values(obj, "range_row"), values(obj, "range_col")] + far
        # The .conf keeps nine digits: centimetres out here.
        assert np.allclose(world(obj).astype(float) + origin, truth, atol=0.02)


@pytest.mark.parametrize("ending", ["xyz", "obj"])
def test_georeferenced_coordinates_keep_their_millimetres(tmp_path, ending):
    random = np.random.default_rng(5)
    points = np.array([4.5e6, 5.1e6, 300.0]) + random.uniform(-20, 20, (200, 3)).round(3)
    path = tmp_path / f"survey.{ending}"
    lines = "\n".join(" ".join(repr(float(x)) for x in p) for p in points)
    if ending == "obj":
        surfrecon.Mesh(points, np.arange(198).reshape(-1, 3)).write(path)
    else:
        path.write_text(lines)
    assert import_scans(path) == {"FINISHED"}
    origin = np.array(bpy.data.collections["survey"]["world_origin"])
    # Half of single precision's last digit of 20 m.
    assert np.abs(world(by_name("survey")).astype(float) + origin - points).max() < 2e-6


def test_colours_and_confidences_arrive(extension, images):
    image = images[0]
    shape = (image.rows, image.cols)
    image.colour = np.random.default_rng(0).integers(0, 256, (*shape, 4), np.uint8)
    image.confidence = np.random.default_rng(1).random(shape)
    obj = extension.scan_objects.object_from_range_image("scan", image, 1.0, True)
    assert np.array_equal(extension.convert.vertex_colours(obj.data), image.colour[image.valid])
    assert np.array_equal(values(obj, "confidence", np.float32), image.confidence[image.valid])


def test_dropping_a_file_uses_the_importer():
    handler = bpy.types.SURFRECON_FH_scans
    assert handler.bl_import_operator == "surfrecon.import_scans"
    assert {".ply", ".conf"} <= set(handler.bl_file_extensions.split(";"))


def test_a_height_map_becomes_a_terrain(tmp_path):
    heights = np.arange(12, dtype=np.float32).reshape(3, 4)
    heights[1, 1] = np.nan
    np.save(tmp_path / "terrain.npy", heights)
    assert import_scans(tmp_path / "terrain.npy", pixel_step=2, pixel_scale=0.5) == {"FINISHED"}
    obj = by_name("terrain")
    assert len(obj.data.vertices) == 11 and len(obj.data.polygons) > 0
    assert np.allclose(world(obj).max(axis=0), [6, 4, 5.5])


def test_depth_images_with_their_camera_and_poses(tmp_path):
    np.save(tmp_path / "a.npy", np.full((4, 4), 2000, np.uint16))
    (tmp_path / "a.xf").write_text("1 0 0 10\n0 1 0 0\n0 0 1 0\n0 0 0 1\n")
    done = import_scans(tmp_path / "a.npy", images="DEPTHS", focal=(2, 2), centre=(1.5, 1.5))
    assert done == {"FINISHED"}
    points = world(by_name("a"))
    assert np.allclose(points.min(axis=0), [8.5, -1.5, 2]) and np.allclose(points.max(axis=0), [11.5, 1.5, 2])


@pytest.mark.parametrize("ending", ["ptx", "e57"])
def test_scans_of_one_file_stand_in_their_places(tmp_path, images, ending):
    grids = []
    for k, image in enumerate(images[:2]):
        grid = surfrecon.RangeImage.from_points(image.points, viewing=("from", (0, 0, 5)), name=f"station {k}")
        grid.world_from_sensor = image.world_from_sensor
        grids.append(grid)
    surfrecon.write(tmp_path / f"hall.{ending}", grids)
    assert import_scans(tmp_path / f"hall.{ending}") == {"FINISHED"}
    collection = bpy.data.collections["hall"]
    assert len(collection.objects) == 2
    for obj, image in zip(sorted(collection.objects, key=lambda o: o.name), images, strict=False):
        expected = image.world_points()[image.valid]
        assert len(obj.data.vertices) == len(expected)
        assert np.allclose(world(obj).mean(axis=0), expected.mean(axis=0), atol=1e-5)
