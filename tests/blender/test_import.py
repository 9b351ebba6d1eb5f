"""File > Import > Range Scans."""

import re
import shutil
import struct
import threading
import time
from types import SimpleNamespace

import bpy
import numpy as np
import pytest
import surfrecon
from files import write_range_grid, write_set
from recordings import write_transforms
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
    # The choices of Blender's dialog when Up was just chosen: both on one axis.
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
    caught = set(handler.bl_file_extensions.split(";"))
    assert {".ply", ".conf", ".r3d", ".json", ".log", ".png", ".exr"} <= caught
    # Blender installs archives, and shows photos as references.
    assert not caught & {".zip", ".jpg", ".jpeg"}


@pytest.mark.parametrize(("ending", "up"), [("conf", "Y"), ("e57", "Z"), ("ptx", "Z"), ("las", "Z")])
def test_axes_follow_from_the_format_in_the_dialog(tmp_path, images, ending, up):
    conf = write_set(tmp_path, images[:2])
    path = conf.with_suffix(f".{ending}")
    if ending == "las":
        # Point format 0 of version 1.2: a header, and a point of 20 bytes a vertex.
        write_las(path, images[0].world_points()[images[0].valid])
    elif ending != "conf":
        grids = [
            surfrecon.RangeImage.from_points(i.world_points(), viewing=("from", (0, 0, 5)), name=i.name)
            for i in images[:2]
        ]
        surfrecon.write(path, grids)
    assert import_scans(path, orientation="FORMAT") == {"FINISHED"}
    collection = bpy.data.collections["torus"]
    points = np.concatenate([world(obj) for obj in collection.objects])
    expected = np.concatenate([i.world_points()[i.valid] for i in (images[:1] if ending == "las" else images[:2])])
    if up == "Y":
        expected = expected[:, [0, 2, 1]] * [1, -1, 1]
    assert np.allclose(points.min(axis=0), expected.min(axis=0), atol=1e-4)
    assert np.allclose(points.max(axis=0), expected.max(axis=0), atol=1e-4)


def test_phones_have_y_up_and_other_recordings_z(extension):
    axes_of = extension.formats.axes_of
    for name in ("Polycam", "Record3D", "3D Scanner App", "Stray Scanner"):
        assert axes_of(["scan"], [f"scan: 24 frames of {name}, 4 with colour"]) == ("-Z", "Y")
    for name in ("TUM", "ScanNet", "nerfstudio"):
        assert axes_of(["scan"], [f"scan: 24 frames of {name}, 4 with colour"]) == ("Y", "Z")


def test_the_size_that_results_is_said(conf, capfd):
    import_scans(conf, unit="MM")
    low, high = (getattr(np.concatenate([world(o) for o in bpy.data.objects]), f)(axis=0) for f in ("min", "max"))
    bpy.context.scene.unit_settings.system = "METRIC"
    said = next(line for line in capfd.readouterr().out.splitlines() if line.startswith("Info: 12 scans"))
    assert " x ".join(f"{1000 * side:.4g}" for side in high - low) + " mm" in said, (said, high - low)


def write_las(path, points):
    """Points as LAS 1.2 in tenths of millimetres."""
    header = bytearray(227)
    header[:4] = b"LASF"
    header[24:26] = bytes((1, 2))
    struct.pack_into("<HII", header, 94, 227, 227, 0)
    struct.pack_into("<BHI", header, 104, 0, 20, len(points))
    struct.pack_into("<I", header, 111, len(points))
    struct.pack_into("<6d", header, 131, 1e-4, 1e-4, 1e-4, 0, 0, 0)
    low, high = points.min(axis=0), points.max(axis=0)
    struct.pack_into("<6d", header, 179, high[0], low[0], high[1], low[1], high[2], low[2])
    rows = np.zeros(len(points), [("xyz", "<i4", 3), ("rest", "V8")])
    rows["xyz"] = np.round(np.asarray(points, float) * 1e4)
    path.write_bytes(bytes(header) + rows.tobytes())


def test_formats_that_say_their_unit_are_in_it(tmp_path, images, extension):
    grids = [surfrecon.RangeImage.from_points(images[0].world_points(), viewing=("from", (0, 0, 5)), name="hall")]
    surfrecon.write(tmp_path / "hall.e57", grids)
    printed = grids[0].triangulate().transformed(surfrecon.Similarity(np.diag([1000.0, 1000.0, 1000.0, 1.0])))
    printed.write(tmp_path / "printed.stl", metres_per_unit=0.001)
    printed.write(tmp_path / "silent.stl")
    preferences = bpy.context.preferences.addons[extension.__name__].preferences
    preferences.unit = "MM"
    try:
        for name in ("hall.e57", "printed.stl", "silent.stl"):
            assert import_scans(tmp_path / name) == {"FINISHED"}
    finally:
        preferences.unit = "M"
    size = max(by_name("hall").dimensions)
    assert size > 0.5
    assert np.allclose([max(by_name(name).dimensions) for name in ("printed", "silent")], size, rtol=1e-5)


def layout(names, texts):
    """A layout that notes what it is given: names of properties, texts of labels."""

    class Layout(SimpleNamespace):
        def prop(self, _, name):
            names.append(name)

        def panel(self, *_, **__):
            return Layout(), Layout()

        def label(self, text, **_):
            texts.append(text)

        def row(self, **_):
            return Layout()

        split = row

    return Layout()


@pytest.fixture
def dialog(extension):
    """Makes the importer's dialog for files: what it draws are names of properties, and texts of labels."""
    cls = extension.operators.import_scans.SURFRECON_OT_import_scans

    def made(*paths, **options):
        names, texts = [], []
        properties = bpy.ops.surfrecon.import_scans.get_rna_type().properties
        defaults = {name: prop.default for name, prop in properties.items() if hasattr(prop, "default")}
        arrays = {name: tuple(properties[name].default_array) for name in ("focal", "centre")}
        files = [SimpleNamespace(name=path.name) for path in paths]
        chosen = {"directory": str(paths[0].parent), "files": files, "orientation": "FORMAT", **options}

        class Dialog(SimpleNamespace):
            """Its methods are the operator's."""

            def __getattr__(self, name):
                value = vars(cls).get(name)
                return value.__get__(self) if callable(value) else value

        shown = Dialog(**{**defaults, **arrays, **chosen}, layout=layout(names, texts), by_hand=True)

        def draw(wait=30):
            names.clear()
            texts.clear()
            cls.draw(shown, bpy.context)
            extension.foreseen.Look.wait(wait)
            names.clear()
            texts.clear()
            cls.draw(shown, bpy.context)
            return names, texts

        return draw

    yield made
    extension.foreseen.Look.forget()
    extension.foreseen.Look.found.clear()


def test_the_dialog_shows_options_of_recordings_for_recordings_only(tmp_path, dialog, conf):
    ring = write_transforms(tmp_path / "ring", 2)
    for path in (ring, ring.parent, ring.parent / "depths" / "00000.png", tmp_path / "a.r3d", tmp_path / "a.zip"):
        assert {"frames", "cameras", "whole"} <= set(dialog(path)()[0]), path
    for path in (conf, conf.parent, conf.parent / "scan00.ply", tmp_path / "a.e57"):
        assert not {"frames", "cameras", "whole", "images"} & set(dialog(path)()[0]), path
    assert "images" in dialog(tmp_path / "terrain.tif")()[0]


def told_by_import(path, capfd, **options):
    """The size that an import says, which it knows from the objects."""
    capfd.readouterr()
    import_scans(path, **options)
    said = next(line for line in capfd.readouterr().out.splitlines() if line.startswith("Info: "))
    return next(part for part in re.split(r", |\. ", said) if " x " in part)


@pytest.mark.parametrize("unit", ["M", "MM", "IN"])
def test_the_dialog_shows_the_size_before_anything_is_imported(conf, dialog, capfd, unit):
    _, texts = dialog(conf, unit=unit)()
    assert not bpy.data.objects
    # Stanford's sets have Y up.
    told = told_by_import(conf, capfd, unit=unit, axis_forward="-Z", axis_up="Y")
    assert texts[0] == "Size" and texts[1] == told


def test_the_size_follows_the_axes_and_the_scale(conf, dialog, extension):
    size_of = {}
    for up, forward in (("Z", "Y"), ("Y", "-Z")):
        draw = dialog(conf, unit="CUSTOM", scale=3.0, orientation="AXES", axis_up=up, axis_forward=forward)
        size_of[up] = draw()[1][1].removesuffix(" m").split(" x ")
        assert len(extension.foreseen.Look.found) == 1
    assert size_of["Y"] == [size_of["Z"][k] for k in (0, 2, 1)]


def test_the_size_of_several_files_is_that_of_all(tmp_path, images, dialog, capfd):
    for image in images[:3]:
        write_range_grid(tmp_path / f"{image.name}.ply", image)
    paths = [tmp_path / f"{image.name}.ply" for image in images[:3]]
    one, all_of_them = (dialog(*some)()[1][1] for some in (paths[:1], paths))
    assert one != all_of_them
    files = [{"name": path.name} for path in paths]
    capfd.readouterr()
    bpy.ops.surfrecon.import_scans(directory=str(tmp_path), files=files)
    assert all_of_them in capfd.readouterr().out


def test_a_file_that_changed_is_looked_at_again(tmp_path, images, dialog):
    path = tmp_path / "one.ply"
    write_range_grid(path, images[0])
    before = dialog(path)()[1][1]
    shutil.copy(path, tmp_path / "kept.ply")
    grown = torus_scans(pixels=40)[0]
    points = np.asarray(grown.points) * 2
    write_range_grid(path, SimpleNamespace(valid=grown.valid, points=points, cols=grown.cols, rows=grown.rows))
    assert dialog(path)()[1][1] != before


def test_the_size_of_a_long_recording_is_told_by_some_of_its_frames(tmp_path, dialog, extension):
    ring = write_transforms(tmp_path / "ring", extension.foreseen.MOST_FRAMES + 3)
    assert dialog(ring)()[1][1].startswith("about ")
    few = write_transforms(tmp_path / "few", 3)
    assert not dialog(few)()[1][1].startswith("about ")


def test_large_files_are_not_read_twice(conf, dialog, extension, monkeypatch):
    # Room for one scan of the set, and for none.
    monkeypatch.setattr(extension.foreseen, "MOST_BYTES", 1.5 * (conf.parent / "scan00.ply").stat().st_size)
    assert dialog(conf)()[1][1].startswith("about ")
    extension.foreseen.Look.found.clear()
    monkeypatch.setattr(extension.foreseen, "MOST_BYTES", 10)
    assert dialog(conf)()[1][1] == "known after the import"


def test_a_dialog_draws_while_files_are_read(conf, dialog, extension, monkeypatch):
    hold, seen = threading.Event(), extension.foreseen.seen
    monkeypatch.setattr(extension.foreseen, "seen", lambda *about: hold.wait(30) and seen(*about))
    draw = dialog(conf)
    started = time.monotonic()
    assert draw(wait=0)[1][1] == "being read" and time.monotonic() - started < 1
    hold.set()
    assert " x " in draw()[1][1]


def test_files_that_are_no_scans_have_no_size(tmp_path, dialog):
    (tmp_path / "none.ply").write_text("none")
    assert dialog(tmp_path / "none.ply")()[1][1] == "not known"
    assert "Size" not in dialog(tmp_path / "missing.ply")()[1]
    assert "Size" not in dialog(tmp_path)()[1]


def view():
    """The 3D view."""
    areas = bpy.context.window_manager.windows[0].screen.areas
    return next(area.spaces.active for area in areas if area.type == "VIEW_3D")


def test_a_view_sees_what_was_imported_whatever_its_size(conf):
    for scale in (1e-4, 1e5):
        import_scans(conf, unit="CUSTOM", scale=scale)
        extent = 2 * scale
        assert view().clip_start < extent / 100 and view().clip_end > 10 * extent
        assert not view().overlay.show_outline_selected
        assert view().clip_end / view().clip_start < 2e6


def test_scans_inside_an_object_are_shown_alone(conf, capfd):
    bpy.ops.mesh.primitive_cube_add(size=20)
    cube = bpy.context.object
    import_scans(conf)
    assert view().local_view is not None
    assert all(obj.visible_get(viewport=view()) for obj in bpy.data.collections["torus"].objects)
    assert not cube.visible_get(viewport=view())
    assert '"Cube" is in the way' in capfd.readouterr().out


def test_scans_that_a_new_file_s_cube_stands_in_are_shown_alone(conf, capfd):
    bpy.ops.mesh.primitive_cube_add(size=1)
    cube = bpy.context.object
    import_scans(conf)
    assert view().local_view is not None and not cube.visible_get(viewport=view())
    assert '"Cube" is in the way' in capfd.readouterr().out


def test_undo_of_an_import_shows_again_what_was_in_the_way(conf):
    bpy.ops.mesh.primitive_cube_add(size=20)
    cube = bpy.context.object
    bpy.ops.ed.undo_push(message="cube")
    import_scans(conf)
    bpy.ops.ed.undo_push(message="import")
    assert view().local_view is not None
    bpy.ops.ed.undo()
    cube = bpy.data.objects["Cube"]
    assert len(bpy.data.objects) == 1
    assert view().local_view is None and cube.visible_get(viewport=view())


def test_undo_after_an_import_keeps_the_scans_alone(conf):
    bpy.ops.mesh.primitive_cube_add(size=20)
    import_scans(conf)
    bpy.ops.ed.undo_push(message="import")
    bpy.context.object.location.x = 1
    bpy.ops.ed.undo_push(message="move")
    bpy.ops.ed.undo()
    assert view().local_view is not None


def test_scans_beside_a_cube_are_shown_with_it(conf, capfd):
    bpy.ops.mesh.primitive_cube_add(size=1, location=(40, 0, 0))
    import_scans(conf)
    assert view().local_view is None and "in the way" not in capfd.readouterr().out


def test_colours_are_shown_where_there_are_some(tmp_path, conf):
    import_scans(conf)
    assert view().shading.color_type == "MATERIAL"
    import_scans(write_transforms(tmp_path / "ring", 2))
    assert view().shading.color_type == "VERTEX"


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
