"""Files through Python: the formats themselves are tested in the core."""

import errno
import os
from pathlib import Path

import numpy as np
import pytest
import surfrecon
from shapes import torus, torus_scans

GRID = """ply
format ascii 1.0
obj_info num_cols 3
obj_info num_rows 2
element vertex 5
property float x
property float y
property float z
element range_grid 6
property list uchar int vertex_indices
end_header
0 0 0
1 0 0
2 0 0
0 1 0
1 1 0.5
1 0
1 1
1 2
1 3
1 4
0
"""

MESH = """ply
format ascii 1.0
element vertex 3
property float x
property float y
property float z
element face 1
property list uchar int vertex_indices
end_header
0 0 0
1 0 0
0 1 0
3 0 1 2
"""


def test_a_range_grid_reads_as_a_range_image(tmp_path):
    (tmp_path / "scan.ply").write_text(GRID)
    image = surfrecon.read(tmp_path / "scan.ply")
    assert isinstance(image, surfrecon.RangeImage) and image.name == "scan"
    assert (image.rows, image.cols) == (2, 3) and image.valid.sum() == 5
    assert [1, 1, 0.5] in image.points.reshape(-1, 3).tolist()


def test_a_mesh_reads_as_a_mesh(tmp_path):
    (tmp_path / "mesh.ply").write_text(MESH)
    mesh = surfrecon.read(str(tmp_path / "mesh.ply"))
    assert isinstance(mesh, surfrecon.Mesh) and mesh.triangles.tolist() == [[0, 1, 2]]


def test_several_files_open_as_one_set(tmp_path):
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "scan.ply").write_text(GRID)
    scans = surfrecon.open([tmp_path / "a" / "scan.ply", tmp_path / "b" / "scan.ply"])
    assert len(scans) == 2 and len({scan.name for scan in scans}) == 2
    assert [scan.path for scan in scans] == [tmp_path / "a" / "scan.ply", tmp_path / "b" / "scan.ply"]
    assert [scan.name for scan in scans[::-1]] == [scan.name for scan in reversed(list(scans))]
    assert scans[-1].name == scans[1].name and np.array_equal(scans[0].world_from_sensor, np.eye(4))
    with pytest.raises(IndexError, match="scan 2 of 2"):
        scans[2]


def test_a_damaged_file_is_a_format_error(tmp_path):
    (tmp_path / "cut.ply").write_text(GRID[:-20])
    with pytest.raises(surfrecon.FormatError, match=r"cut\.ply"):
        surfrecon.read(tmp_path / "cut.ply")
    (tmp_path / "other.bin").write_bytes(b"MZ\0\0")
    with pytest.raises(surfrecon.FormatError, match="unknown format"):
        surfrecon.open(tmp_path / "other.bin")


def test_scans_written_and_opened_again_stand_where_they_stood(tmp_path):
    images = torus_scans(pixels=40)
    images[0].colour = np.full((*images[0].valid.shape, 3), 0.5)
    surfrecon.write_scans(tmp_path / "ring.conf", images)
    scans = surfrecon.open(tmp_path / "ring.conf")
    assert [scan.name for scan in scans] == [image.name for image in images]
    for scan, image in zip(scans, images, strict=True):
        again = scan.read()
        assert np.array_equal(again.valid, image.valid)
        assert np.allclose(again.world_points(), image.world_points(), atol=1e-6, equal_nan=True)
    assert np.array_equal(scans[0].read().colour[images[0].valid], images[0].colour[images[0].valid])


def test_scans_without_names_of_their_own_are_refused(tmp_path):
    images = torus_scans(pixels=10)
    for name in ("", "scan01", "../scan", "a\\b"):
        images[0].name = name
        with pytest.raises(surfrecon.InputError, match="name of its own"):
            surfrecon.write_scans(tmp_path / "ring.conf", images)
    assert list(tmp_path.iterdir()) == []


def test_a_mesh_written_and_read_again_is_the_same(tmp_path):
    mesh = torus()
    mesh.write(tmp_path / "torus.ply")
    again = surfrecon.read(tmp_path / "torus.ply")
    assert np.array_equal(again.triangles, mesh.triangles)
    assert np.array_equal(again.positions, mesh.positions.astype(np.float32))
    with pytest.raises(surfrecon.InputError, match=r"must end in \.ply, \.glb, \.stl, \.3mf or \.obj"):
        mesh.write(tmp_path / "torus.3ds")
    with pytest.raises(surfrecon.SurfreconError, match="missing"):
        mesh.write(tmp_path / "missing" / "torus.ply")


def test_a_mesh_is_written_as_gltf(tmp_path):
    mesh = surfrecon.Mesh(np.eye(3), [[0, 1, 2]], colour=np.full((3, 3), 0.5))
    mesh.write(tmp_path / "triangle.glb", metres_per_unit=0.001, up="z")
    content = (tmp_path / "triangle.glb").read_bytes()
    assert content[:4] == b"glTF" and int.from_bytes(content[8:12], "little") == len(content)
    assert b"COLOR_0" in content and b"0.001" in content
    with pytest.raises(surfrecon.ParameterError, match="up must be"):
        mesh.write(tmp_path / "triangle.glb", up="x")
    with pytest.raises(surfrecon.ParameterError, match="metres_per_unit must be a finite number > 0, got 0"):
        mesh.write(tmp_path / "other.glb", metres_per_unit=0)
    assert not (tmp_path / "other.glb").exists()


@pytest.mark.parametrize("ending", ["obj", "stl", "glb", "3mf", "ply"])
def test_write_and_read_meshes(tmp_path, ending):
    mesh = torus()
    surfrecon.write(tmp_path / f"torus.{ending}", mesh)
    again = surfrecon.read(tmp_path / f"torus.{ending}")
    assert again.check()["is_closed"] and len(again.triangles) == len(mesh.triangles)
    corners = [m.positions[m.triangles].mean(axis=1) for m in (mesh, again)]
    assert np.allclose(corners[0], corners[1], atol=1e-6)


@pytest.mark.parametrize("ending", ["ptx", "e57"])
def test_write_and_read_scans_in_place(tmp_path, ending):
    images = []
    for k, pose in enumerate(np.eye(4) for _ in range(2)):
        pose[:3, 3] = [4e6 + k, 5e6, 1]
        grid = np.dstack([*np.meshgrid(np.linspace(-1, 1, 5), np.linspace(-1, 1, 4)), np.full((4, 5), 3.0)])
        grid[k, 2] = np.nan
        image = surfrecon.RangeImage.from_points(grid, viewing=("from", (0, 0, 0)), name=f"scan {k}")
        image.world_from_sensor = pose
        images.append(image)
    surfrecon.write(tmp_path / f"two.{ending}", images)
    for scan, image in zip(surfrecon.open(tmp_path / f"two.{ending}"), images, strict=True):
        again = scan.read()
        assert np.array_equal(again.valid, image.valid)
        assert np.allclose(again.world_points(), image.world_points(), atol=1e-9, rtol=0, equal_nan=True)
    with pytest.raises(TypeError, match="content must be a Mesh"):
        surfrecon.write(tmp_path / f"two.{ending}", 3)
    images[0].write(tmp_path / f"one.{ending}")
    assert surfrecon.read(tmp_path / f"one.{ending}").rows == 4


def test_reading_shows_progress_and_can_be_cancelled(tmp_path):
    path = tmp_path / "many.xyz"
    path.write_text("1.25 2.5 3.75\n" * 2_000_000)
    (scan,) = surfrecon.open(path)
    ticks = []
    assert len(scan.read(progress=lambda *tick: ticks.append(tick)).positions) == 2_000_000
    assert all(stage == "reading" and 0 <= fraction <= 1 for stage, fraction in ticks)
    with pytest.raises(surfrecon.Cancelled):
        scan.read(progress=lambda *_: False)


def test_writing_shows_progress_and_can_be_cancelled(tmp_path):
    side = 400
    mesh = surfrecon.Mesh(*grid(side))
    image = surfrecon.RangeImage.from_points(
        mesh.positions.reshape(side, side, 3) + (0, 0, 5), viewing=("from", (0, 0, 0)), name="a"
    )
    for ending in ("ply", "obj", "stl", "glb"):
        ticks = []
        surfrecon.write(tmp_path / f"a.{ending}", mesh, progress=lambda *tick, ticks=ticks: ticks.append(tick))
        assert ticks and all(stage == "writing" and 0 <= share <= 1 for stage, share in ticks)
        assert ticks[-1][1] == 1
        (tmp_path / f"a.{ending}").write_text("old")
        with pytest.raises(surfrecon.Cancelled):
            mesh.write(tmp_path / f"a.{ending}", progress=lambda *_: False)
        assert (tmp_path / f"a.{ending}").read_text() == "old"
    for ending in ("conf", "ptx", "e57"):
        with pytest.raises(surfrecon.Cancelled):
            surfrecon.write(tmp_path / f"b.{ending}", [image], progress=lambda *_: False)
    assert sorted(file.name for file in tmp_path.iterdir()) == ["a.glb", "a.obj", "a.ply", "a.stl"]


def grid(side):
    """Vertices and triangles of a square, bent."""
    x, y = np.meshgrid(np.arange(side) / side - 0.5, np.arange(side) / side - 0.5)
    a = (np.arange(side - 1)[:, None] * side + np.arange(side - 1)).reshape(-1)
    triangles = np.concatenate([np.stack([a, a + 1, a + side], 1), np.stack([a + 1, a + side + 1, a + side], 1)])
    return np.dstack([x, y, x * y]).reshape(-1, 3), triangles


def test_ply_is_binary_or_text(tmp_path):
    mesh = torus()
    sizes = {}
    for encoding in ("binary", "ascii"):
        mesh.write(tmp_path / "torus.ply", encoding=encoding)
        content = (tmp_path / "torus.ply").read_bytes()
        assert (b"format ascii" in content[:40]) == (encoding == "ascii")
        assert np.array_equal(surfrecon.read(tmp_path / "torus.ply").triangles, mesh.triangles)
        sizes[encoding] = len(content)
    assert sizes["ascii"] > sizes["binary"]
    with pytest.raises(surfrecon.ParameterError, match='encoding must be "binary", .* or "ascii", got "text"'):
        mesh.write(tmp_path / "torus.ply", encoding="text")
    with pytest.raises(surfrecon.InputError, match="only .ply has the encoding"):
        mesh.write(tmp_path / "torus.obj", encoding="ascii")


def test_levels_of_detail_go_into_one_file(tmp_path):
    fine, coarse = torus(), surfrecon.Mesh(np.eye(3), [[0, 1, 2]])
    surfrecon.write(tmp_path / "torus.glb", fine, coarser=[coarse])
    assert b"MSFT_lod" in (tmp_path / "torus.glb").read_bytes()
    assert len(surfrecon.read(tmp_path / "torus.glb").triangles) == len(fine.triangles)
    with pytest.raises(surfrecon.InputError, match=r"only \.glb holds coarser levels"):
        fine.write(tmp_path / "torus.stl", coarser=[coarse])
    with pytest.raises(surfrecon.InputError, match="level 1 has"):
        coarse.write(tmp_path / "torus.glb", coarser=[fine])


def test_intensities_of_points_arrive(tmp_path):
    (tmp_path / "a.xyz").write_text("//X Y Z Intensity\n1 2 3 0.5\n4 5 6 0.25\n")
    cloud = surfrecon.read(tmp_path / "a.xyz")
    assert cloud.intensity.tolist() == [0.5, 0.25]
    surfrecon.write(tmp_path / "b.ply", cloud)
    assert surfrecon.read(tmp_path / "b.ply").intensity.tolist() == [0.5, 0.25]


@pytest.mark.parametrize("ending", ["ply", "glb", "obj", "stl", "ptx", "e57", "conf"])
def test_a_full_disk_leaves_nothing_and_no_half_file(tmp_path, ending):
    """The system refuses to let any file grow beyond a number of bytes, for every number that matters."""
    resource = pytest.importorskip("resource")
    image = surfrecon.RangeImage.from_points(np.full((3, 4, 3), 2.0), viewing=("from", (0, 0, 0)), name="a")
    image.colour = np.full((3, 4, 3), 7, np.uint8)
    content = image if ending in {"ptx", "e57", "conf"} else surfrecon.Mesh(np.eye(3), [[0, 1, 2]])
    path = tmp_path / f"scan.{ending}"
    surfrecon.write(path, [content] if ending == "conf" else content)
    largest = max(file.stat().st_size for file in tmp_path.iterdir())
    before = {file.name: file.read_bytes() for file in tmp_path.iterdir()}
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    failed = 0
    for room in range(0, largest, 1 + largest // 200):
        resource.setrlimit(resource.RLIMIT_FSIZE, (room, hard))
        try:
            surfrecon.write(path, [content] if ending == "conf" else content)
        except surfrecon.FileError as problem:
            failed += 1
            assert str(tmp_path) in str(problem)
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
        assert {file.name: file.read_bytes() for file in tmp_path.iterdir()} == before
    assert failed > 20


def test_formats_have_endings():
    assert {"ply", "conf"} <= {ending for endings in surfrecon.formats().values() for ending in endings}


def test_what_the_registry_says_is_written_is_and_nothing_else(tmp_path):
    depths = np.add.outer(np.arange(30.0), np.arange(40.0)) / 100 + 2
    image = surfrecon.RangeImage.pinhole(depths, focal=(40, 40), centre=(20, 15), name="seen")
    (tmp_path / "points.xyz").write_text("0 0 0\n1 0 0\n0 1 0\n")
    points = surfrecon.read(tmp_path / "points.xyz")
    contents = {
        "mesh": lambda path: torus(12).write(path),
        "quads": lambda path: surfrecon.adaptive_quads(image).write(path),
        "points": lambda path: surfrecon.write(path, points),
        "image": lambda path: image.write(path),
        "images": lambda path: surfrecon.write_scans(path, [image]),
    }
    every = {ending for kind in contents for endings in surfrecon.formats(written=kind).values() for ending in endings}
    for kind, write in contents.items():
        known = {ending for endings in surfrecon.formats(written=kind).values() for ending in endings}
        for ending in sorted(every):
            path = tmp_path / kind / f"{kind}.{ending.upper()}"
            path.parent.mkdir(exist_ok=True)
            if ending in known:
                write(path)
                assert len(surfrecon.open(path)) == 1
            else:
                with pytest.raises(surfrecon.InputError, match=r"the name must end in \..*" + sorted(known)[0]):
                    write(path)
                assert not path.exists()
    with pytest.raises(surfrecon.InputError, match="there is no range image to write"):
        surfrecon.write_scans(tmp_path / "none.conf", [])
    assert not (tmp_path / "none.conf").exists()
    with pytest.raises(surfrecon.InputError, match='written must be one of "mesh", .*, got "cake"'):
        surfrecon.formats(written="cake")


def test_numbers_of_images_are_heights_or_depths(tmp_path):
    heights = np.arange(12, dtype=np.float32).reshape(3, 4)
    heights[1, 1] = np.nan
    np.save(tmp_path / "map.npy", heights)
    image = surfrecon.read(tmp_path / "map.npy", step=2, offset=1)
    assert image.valid.sum() == 11
    assert image.points[0, 3].tolist() == [6, 4, 4] and image.points[2, 0].tolist() == [0, 0, 9]
    depths = np.array([[0, 1000], [2000, 65535]], np.uint16)
    np.save(tmp_path / "depth.npy", depths)
    image = surfrecon.read(tmp_path / "depth.npy", camera=(2, 2, 0.5, 0.5))
    assert image.valid.tolist() == [[False, True], [True, False]]
    assert np.allclose(image.points[1, 0], [-0.5, 0.5, 2])
    (tmp_path / "camera.json").write_text('{"fx": 2, "fy": 2, "cx": 0.5, "cy": 0.5}')
    (tmp_path / "trajectory.log").write_text("0 0 1\n1 0 0 5\n0 1 0 6\n0 0 1 7\n0 0 0 1\n")
    scans = surfrecon.open([tmp_path / name for name in ("trajectory.log", "depth.npy", "camera.json")])
    assert np.allclose(scans[0].read().world_points()[1, 0], [4.5, 6.5, 9])
    with pytest.raises(surfrecon.ParameterError, match="pixels must be"):
        surfrecon.open(tmp_path / "map.npy", pixels="colour")
    with pytest.raises(surfrecon.ParameterError, match="scale must be a finite number > 0, got 0"):
        surfrecon.open(tmp_path / "map.npy", scale=0)


@pytest.mark.skipif("SURFRECON_DATA" not in os.environ, reason="SURFRECON_DATA is not set")
def test_the_bunny_opens():
    scans = surfrecon.open(Path(os.environ["SURFRECON_DATA"]) / "stanford_bunny" / "bun.conf")
    assert len(scans) == 10 and scans.notes
    triangles = sum(len(scan.read().triangulate().triangles) for scan in scans)
    assert 690_000 < triangles < 691_600


def seen_image():
    depth = 2 + 0.1 * np.sin(np.arange(60 * 80)).reshape(60, 80)
    return surfrecon.RangeImage.pinhole(depth, focal=(80, 80), centre=(39.5, 29.5), name="before")


def test_an_image_may_change_while_a_call_uses_it(tmp_path):
    """A callback, or another thread, changes the image; the call goes on with what it was given."""
    calls = {
        "ply": lambda image, progress: image.write(tmp_path / "a.ply", progress=progress),
        "ptx": lambda image, progress: surfrecon.write(tmp_path / "a.ptx", image, progress=progress),
        "conf": lambda image, progress: surfrecon.write_scans(tmp_path / "a.conf", [image], progress=progress),
        "sculpt": lambda image, progress: surfrecon.sculpt(image, tolerance=0.01, progress=progress),
        "merge": lambda image, progress: surfrecon.merge([image], progress=progress),
    }
    for name, call in calls.items():
        image, seen = seen_image(), []

        def change(stage, share, image=image, seen=seen):
            image.name = "after"
            image.confidence = np.ones((60, 80))
            image.world_from_sensor = np.diag([-1.0, -1.0, 1.0, 1.0])
            seen.append((image.name, image.rows, float(image.confidence.sum())))
            return True

        call(image, change)
        assert seen and set(seen) == {("after", 60, 4800.0)}, name
    # The file has the name and the pose that the image had when the call began.
    (tmp_path / "plain").mkdir()
    surfrecon.write_scans(tmp_path / "plain" / "a.conf", [seen_image()])
    written, plain = (surfrecon.open(folder / "a.conf")[0] for folder in (tmp_path, tmp_path / "plain"))
    assert written.name == "before" and np.array_equal(written.world_from_sensor, plain.world_from_sensor)


def test_errors_of_files_have_the_systems_number(tmp_path):
    resource = pytest.importorskip("resource")
    image = seen_image()
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    for ending in ("ply", "ptx", "e57"):
        resource.setrlimit(resource.RLIMIT_FSIZE, (4096, limits[1]))
        try:
            with pytest.raises(surfrecon.FileError) as raised:
                image.write(tmp_path / f"large.{ending}")
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        assert raised.value.errno == errno.EFBIG, f"{ending}: {raised.value}"
    (tmp_path / "kept.ply").write_text("kept")
    (tmp_path / "kept.ply").chmod(0o444)
    with pytest.raises(surfrecon.FileError, match="read-only") as raised:
        image.write(tmp_path / "kept.ply")
    assert raised.value.errno == errno.EACCES
    with pytest.raises(surfrecon.FileError) as raised:
        image.write("/proc/a.ply")
    assert raised.value.errno == errno.ENOENT
    assert [path.name for path in tmp_path.iterdir()] == ["kept.ply"]


def test_indices_beyond_all_are_shown_as_they_are():
    """The largest of an unsigned type, often meant as -1, is told by its own number."""
    for kind in (np.uint8, np.uint16, np.uint32, np.uint64, np.int64):
        largest = np.iinfo(kind).max
        with pytest.raises(surfrecon.InputError, match=rf"\b{largest}\b") as raised:
            surfrecon.Mesh(np.eye(3), np.array([[0, 1, largest]], dtype=kind))
        assert "-1" not in str(raised.value)


def test_files_with_several_names_are_left_alone(tmp_path):
    mesh = surfrecon.Mesh(np.eye(3), [[0, 1, 2]])
    mesh.write(tmp_path / "a.ply")
    before = (tmp_path / "a.ply").read_bytes()
    os.link(tmp_path / "a.ply", tmp_path / "b.ply")
    with pytest.raises(surfrecon.InputError, match=r"2 names \(hard links\)"):
        surfrecon.Mesh(2 * np.eye(3), [[0, 1, 2]]).write(tmp_path / "b.ply")
    assert (tmp_path / "a.ply").samefile(tmp_path / "b.ply") and (tmp_path / "b.ply").read_bytes() == before


def test_images_of_a_list_that_have_no_names_of_their_own_are_told_how_to_get_one(tmp_path):
    images = torus_scans(pixels=10)[:2]
    for name in ("", "twice", "a/b"):
        for image in images:
            image.name = name
        with pytest.raises(surfrecon.InputError) as problem:
            surfrecon.write_scans(tmp_path / "scans.conf", images)
        assert f'"{name}": each image needs a name of its own' in str(problem.value)
        assert "image.name = " in str(problem.value)
    assert not list(tmp_path.iterdir())
