"""Pickle and copy: what pools of processes are handed, and what a copy shares with its original."""

import copy
import os
import pickle
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import numpy as np
import pytest
import surfrecon
from shapes import torus, torus_scans
from test_frames import recording  # noqa: F401 (a fixture)

CRS = "EPSG:25832"
POSE = np.array([[0.36, 0.48, -0.8, 5.1], [-0.8, 0.6, 0, -7.3], [0.48, 0.64, 0.6, 2.7], [0, 0, 0, 1.0]])


def image_of(samples, **made):
    """A range image with all that one may have."""
    image = samples(np.random.default_rng(3).random((4, 5) if "viewing" not in made else (4, 5, 3)), **made)
    generator = np.random.default_rng(4)
    image.world_from_sensor = POSE
    image.colour = generator.integers(0, 256, (4, 5, 4)).astype(np.uint8)
    image.intensity = generator.random((4, 5))
    image.confidence = generator.random((4, 5))
    image.crs = CRS
    return image


def images():
    yield image_of(surfrecon.RangeImage.pinhole, focal=(1 / 3, 7.1), centre=(0.1, 2), depth="ray", name="σ")
    yield image_of(surfrecon.RangeImage.orthographic, step=(0.1, -0.3), first=(1e5, -1 / 7), name="map")
    yield image_of(surfrecon.RangeImage.spherical, step=(0.01, -0.02))
    yield image_of(surfrecon.RangeImage.from_points, viewing=("from", (0.1, 0.2, 1 / 3)), name="points")
    yield surfrecon.RangeImage.orthographic(np.full((2, 2), np.nan), step=(1, 1))


def things():
    mesh = torus(8)
    yield mesh.with_crs(CRS)
    yield surfrecon.merge(torus_scans(30), voxel=0.1).mesh
    yield torus_scans(30)[0].triangulate()
    # A file in double precision where single would break what is certified.
    yield surfrecon.sculpt(torus_scans(30)[0], tolerance=1e-7).mesh
    yield from images()
    yield next(images()).to_cloud()
    yield surfrecon.Camera.pinhole(3, 4, height_angle=0.7, eye=(1, 2, 3), target=(0.1, 0, 0))
    yield surfrecon.Camera.spherical(3, 4, lowest=-0.3, highest=1 / 3, eye=(0.1, 0, 0))
    yield surfrecon.Box(POSE)
    yield surfrecon.Box.between((0.1, 0.2, 0.3), (1, 2, 3))
    yield surfrecon.Plane((0.1, 0.2, 0.3), (1, 2, 3), margin=0.7)
    yield surfrecon.dominant_plane([surfrecon.RangeImage.orthographic(np.zeros((20, 20)), step=(0.1, 0.1))])
    yield surfrecon.Pick(0, 2, (1 / 3, 2, 3), (4, 5, 6), normals=((0, 0, 1), (0.1, 1, 0)), weight=1 / 7)


ATTRIBUTES = {
    surfrecon.Mesh: ["positions", "triangles", "vertex_attributes", "face_attributes", "crs"],
    surfrecon.PointCloud: ["positions", "normals", "colour", "intensity", "sensor", "world_from_cloud", "crs"],
    surfrecon.RangeImage: ["name", "rows", "cols", "projection", "points", "values", "world_from_sensor", "sensor"]
    + ["colour", "intensity", "confidence", "crs", "valid"],
    surfrecon.Camera: ["rows", "cols", "projection", "world_from_sensor"],
    surfrecon.Box: [],
    surfrecon.Plane: ["point", "normal", "margin", "share", "spread"],
    surfrecon.Pick: ["a", "b", "point_a", "point_b", "normals", "weight"],
    surfrecon.Scan: ["name", "path", "part", "world_from_sensor", "crs"],
    surfrecon.Frame: ["name", "path", "part", "world_from_sensor", "crs", "has_colour"],
}


def plain(value):
    if isinstance(value, dict):
        return [(name, plain(one)) for name, one in value.items()]
    return (str(value.dtype), value.shape, value.tobytes()) if isinstance(value, np.ndarray) else value


def told(thing):
    """All that can be read of a thing, to the bit; run in other processes."""
    found = {name: plain(getattr(thing, name)) for name in ATTRIBUTES[type(thing)]}
    if isinstance(thing, surfrecon.Scan):
        found["content"] = told(thing.read())
    if isinstance(thing, surfrecon.Box | surfrecon.Plane):
        grid = np.stack(np.meshgrid(*[np.linspace(-8, 8, 21)] * 3), axis=-1).reshape(-1, 3)
        found["inside"] = plain(thing.contains(grid))
    return [type(thing).__name__, repr(thing), found]


@pytest.fixture
def files(tmp_path):
    """Scans in files, with all that may be said of them after they were opened."""
    surfrecon.write_scans(tmp_path / "all.conf", torus_scans(30)[:2])
    scans = surfrecon.open(tmp_path / "all.conf", crs=CRS)
    scans = scans.keep(surfrecon.Box.between((-1.1, -1.2, -1.3), (1.1, 1.2, 1 / 3))).transformed(POSE)
    shape = scans[0].read().valid.shape
    return scans.remove([np.arange(np.prod(shape)).reshape(shape) % 7 == 0, None])


def test_pickle_keeps_everything():
    count = 0
    for thing in things():
        for protocol in (2, pickle.HIGHEST_PROTOCOL):
            again = pickle.loads(pickle.dumps(thing, protocol))
            assert again is not thing and told(again) == told(thing), thing
        count += 1
    assert count > 15


def test_a_sculpted_mesh_is_written_as_precisely_after_pickling(tmp_path):
    mesh = surfrecon.sculpt(torus_scans(30)[0], tolerance=1e-9).mesh
    mesh.write(tmp_path / "a.ply")
    pickle.loads(pickle.dumps(mesh)).write(tmp_path / "b.ply")
    assert (tmp_path / "a.ply").read_bytes() == (tmp_path / "b.ply").read_bytes()


def test_arrays_may_travel_outside_of_the_pickle():
    mesh, buffers = torus(20), []
    small = pickle.dumps(mesh, 5, buffer_callback=buffers.append)
    assert (
        len(small) < 1000
        and sum(buffer.raw().nbytes for buffer in buffers) == mesh.positions.nbytes + mesh.triangles.nbytes
    )
    assert told(pickle.loads(small, buffers=buffers)) == told(mesh)


def test_copies_of_what_never_changes_are_the_thing_itself(files):
    for thing in [*(thing for thing in things() if not isinstance(thing, surfrecon.RangeImage)), files, files[0]]:
        assert copy.copy(thing) is thing and copy.deepcopy(thing) is thing


def test_a_copy_of_an_image_is_an_image_of_its_own():
    for image in images():
        for copied in (copy.copy(image), copy.deepcopy(image)):
            assert told(copied) == told(image)
            copied.name, copied.intensity, copied.crs = "other", None, "EPSG:4978"
            copied.world_from_sensor = np.eye(4)
            assert told(copied) != told(image)
        assert copy.deepcopy([image, image])[0].name == image.name


def test_scans_are_handed_over_by_the_path_of_their_file(files, monkeypatch):
    monkeypatch.chdir(files[0].path.parent)
    relative = surfrecon.open(["all.conf"])
    for scans in (files, relative):
        again = pickle.loads(pickle.dumps(scans))
        assert isinstance(again, surfrecon.ScanSet) and again.notes == scans.notes
        for scan, same in zip(scans, again, strict=True):
            assert same.path.is_absolute() and np.array_equal(same.world_from_sensor, scan.world_from_sensor)
            assert told(same.read()) == told(scan.read()) and (same.name, same.crs) == (scan.name, scan.crs)


def test_frames_find_their_recording_again(recording, tmp_path):  # noqa: F811
    frames = surfrecon.open(recording)
    moved = frames.transformed(np.diag([2.0, 2, 2, 1]))
    for frame, same in zip([*frames, *moved], pickle.loads(pickle.dumps([*frames, *moved])), strict=True):
        assert isinstance(same, surfrecon.Frame) and told(same) == told(frame)
    other = tmp_path / "other"
    other.mkdir()
    for file in recording.iterdir():
        (other / file.name).write_bytes(file.read_bytes())
    given = pickle.dumps(surfrecon.open(other)[1])
    text = (other / "frame_00001.json").read_text()
    (other / "frame_00001.json").write_text(text.replace("88.0", "90.0", 1))
    with pytest.raises(surfrecon.InputError, match="frame frame_00001 of .*other is no longer listed as it was"):
        pickle.loads(given)


def test_scans_in_memory_say_that_others_do_not_see_them():
    folder = surfrecon.MemoryFolder()
    torus(8).write(folder / "mesh.ply")
    scan = surfrecon.open(folder / "mesh.ply")[0]
    assert copy.deepcopy(scan) is scan
    with pytest.raises(
        surfrecon.InputError, match=r"mesh\.ply lies in the memory of this process, but .*\. Write the file"
    ):
        pickle.dumps(scan)


def test_a_pool_of_new_processes_is_handed_all_of_them(files, recording):  # noqa: F811
    given = [next(images()), torus(8), next(images()).to_cloud(), files[0], surfrecon.open(recording)[0]]
    given += [surfrecon.Box(POSE), surfrecon.Plane((0, 0, 1), (0, 0, 1)), surfrecon.turntable(torus(8))[0]]
    # No thread of the library waits in a process that begins anew.
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        assert pool.submit(os.getpid).result() != os.getpid()
        assert list(pool.map(told, given)) == [told(thing) for thing in given]


def test_what_is_no_object_s_is_refused():
    _, (kind, parts) = torus(8).__reduce__()
    again = torus(8).__reduce__()[0]
    for changed, says in [
        ({"crs": ("", True)}, "coordinate reference system"),
        ({"triangles": np.full((1, 3), 10**6, np.uint32)}, "vertex"),
        ({"positions": np.zeros((4, 2))}, "positions must have shape"),
    ]:
        with pytest.raises(surfrecon.InputError, match=says):
            again(kind, parts | changed)
    with pytest.raises(surfrecon.InputError, match="part 'triangles' is missing"):
        again(kind, {name: part for name, part in parts.items() if name != "triangles"})
    with pytest.raises(surfrecon.InputError, match="no kind"):
        again("torus", parts)
