"""Counts, numbers that must be finite, misspelt keywords, arrays and paths of any kind: what is said of wrong ones."""

import numpy as np
import pytest
import surfrecon
from shapes import torus, torus_scans

FAR = 2**70
EYE = {"eye": (0, 0, 3), "target": (0, 0, 0)}


def camera(kind, rows, cols):
    rest = {
        "orthographic": {"spacing": 1, "target": (0, 0, 0), "toward": (0, 0, -1)},
        "pinhole": {"height_angle": 1, **EYE},
        "intrinsic": {"focal": (9, 9), "centre": (1, 1), "world_from_sensor": np.eye(4)},
        "spherical": {"lowest": -1, "highest": 1, "eye": (0, 0, 0)},
    }
    return getattr(surfrecon.Camera, kind)(rows, cols, **rest[kind])


CAMERAS = ["orthographic", "pinhole", "intrinsic", "spherical"]
GRID = {"kind": "orthographic", "first": (0, 0), "step": (1, 1)}


def spline():
    x, y = np.meshgrid(np.arange(40) / 40, np.arange(40) / 40)
    image = surfrecon.RangeImage.orthographic(np.sin(3 * x) * np.cos(2 * y), step=(0.1, 0.1))
    return surfrecon.adaptive_quads(image, tiles_down=2, tiles_across=2).spline()


COUNTED = {
    **{f"{kind} rows": (lambda n, kind=kind: camera(kind, n, 4)) for kind in CAMERAS},
    **{f"{kind} cols": (lambda n, kind=kind: camera(kind, 4, n)) for kind in CAMERAS},
    "grid rows": lambda n: surfrecon.GridCamera(n, 4, GRID),
    "grid cols": lambda n: surfrecon.GridCamera(4, n, GRID),
    **{
        f"turntable {name}": (lambda n, name=name: surfrecon.turntable(torus(8), **{name: n}))
        for name in ("around", "above", "below", "pixels")
    },
    "put_source length": lambda n: surfrecon.MemoryFolder().put_source("a.ply", n, lambda at, most: b""),
}


@pytest.mark.parametrize("what", COUNTED)
def test_counts_say_what_they_may_be(what):
    name = what.split()[1]
    for number in (-1, -FAR, FAR):
        with pytest.raises(ValueError, match=rf"^{name} is {number}, but must be at least \d and below 2\^64\. \w"):
            COUNTED[what](number)
    for other in (2.0, "2", None if "turntable" not in what else 1.5):
        with pytest.raises(TypeError, match=f"^{name} is {other!r}, but must be a whole number"):
            COUNTED[what](other)
    COUNTED[what](np.int8(4))
    with pytest.raises(ValueError, match=f"{name} is a number of too many digits"):
        COUNTED[what](10**5000)


def test_the_points_of_a_spline_are_counted(tmp_path):
    made = spline()
    for number in (-1, 1, FAR):
        with pytest.raises(ValueError, match=f"^rows is {number}, but must be at least 2"):
            made.write(tmp_path / "a.obj", number, 4)
        with pytest.raises(ValueError, match=f"^columns is {number}, but must be at least 2"):
            made.write(tmp_path / "a.obj", 4, number)
    made.write(tmp_path / "a.obj", np.int64(4), 4)


@pytest.mark.parametrize(
    "call",
    [
        lambda n: surfrecon.Context(threads=n),
        lambda n: surfrecon.sculpture(cell=20, threads=n),
        lambda n: surfrecon.distances(np.zeros((1, 3)), torus(8), threads=n),
        lambda n: surfrecon.surface_distance(torus(8), torus(8), threads=n),
        lambda n: surfrecon.nearest_triangles(np.zeros((1, 3)), torus(8), threads=n),
        lambda n: surfrecon.Job.distances(np.zeros((1, 3)), torus(8), threads=n),
        lambda n: surfrecon.Job.surface_distance(torus(8), torus(8), threads=n),
        lambda n: surfrecon.merge([], threads=n),
    ],
)
def test_threads_say_what_they_may_be(call):
    for number in (-1, 1025, -FAR, FAR):
        with pytest.raises(surfrecon.ParameterError, match=f"threads must be >= 0 and <= 1024, got {number}"):
            call(number)


@pytest.mark.parametrize("merge", [surfrecon.merge_to_file, surfrecon.Job.merge_to_file])
def test_triangles_of_a_part_say_what_they_may_be(merge, tmp_path):
    for number in (-1, -FAR, FAR):
        with pytest.raises(surfrecon.ParameterError, match=f"part_triangles must be .*, got {number}"):
            merge([], tmp_path / "a.ply", part_triangles=number)


def test_picks_have_finite_numbers():
    good = {"point_a": (0, 0, 0), "point_b": (1, 1, 1), "normals": ((0, 0, 1), (0, 1, 0)), "weight": 1}
    surfrecon.Pick(0, 1, **good)
    for bad in (np.nan, np.inf, -np.inf):
        for name in ("point_a", "point_b"):
            with pytest.raises(surfrecon.InputError, match=f"{name} of the pick has the number -?(nan|inf), but"):
                surfrecon.Pick(0, 1, **good | {name: (0, bad, 0)})
        with pytest.raises(surfrecon.InputError, match="normal_b of the pick has the number"):
            surfrecon.Pick(0, 1, **good | {"normals": ((0, 0, 1), (bad, 0, 0))})
        with pytest.raises(surfrecon.InputError, match="weight of the pick has the number"):
            surfrecon.Pick(0, 1, **good | {"weight": bad})
        with pytest.raises(surfrecon.InputError, match="point_b of pick 0 has the number"):
            surfrecon.align(torus_scans(8)[:2], picks=[(0, 1, (0, 0, 0), (bad, 0, 0))])


def structs_with(bad):
    """Ways to make a struct of plain numbers with a bad one."""
    return (
        lambda: surfrecon.Plane((bad, 0, 0), (0, 0, 1)),
        lambda: surfrecon.Plane((0, 0, 0), (0, 0, bad)),
        lambda: surfrecon.Plane((0, 0, 0), (0, 0, 1), margin=bad),
        lambda: surfrecon.Box.between((bad, 0, 0), (1, 1, 1)),
        lambda: surfrecon.Box(np.diag([1, 1, bad, 1])),
        lambda: surfrecon.Similarity(np.diag([bad, 1, 1, 1])),
        lambda: surfrecon.true_size((0, 0, 0), (1, 0, 0), bad),
        lambda: surfrecon.ground(surfrecon.Plane((0, 0, 0), (0, 0, 1)), up=(0, 0, bad)),
        lambda: surfrecon.GridCamera(4, 4, GRID | {"step": (bad, 1)}),
        lambda: surfrecon.GridCamera(4, 4, GRID, [[0, 0, bad, 0, 0]]),
        lambda: surfrecon.Camera.pinhole(4, 4, height_angle=bad, **EYE),
        lambda: surfrecon.Camera.pinhole(4, 4, height_angle=1, eye=(0, 0, bad), target=(0, 0, 0)),
        lambda: surfrecon.Camera.intrinsic(4, 4, focal=(bad, 1), centre=(0, 0), world_from_sensor=np.eye(4)),
        lambda: surfrecon.Camera.spherical(4, 4, lowest=bad, highest=1, eye=(0, 0, 0)),
        lambda: surfrecon.RangeImage.orthographic(np.zeros((2, 2)), step=(bad, 1)),
        lambda: surfrecon.RangeImage.pinhole(np.ones((2, 2)), focal=(1, 1), centre=(bad, 1)),
        lambda: surfrecon.RangeImage.from_points(np.zeros((2, 2, 3)), viewing=("from", (bad, 0, 0))),
    )


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_structs_of_plain_numbers_take_none_that_is_not_finite(bad):
    for make in structs_with(bad):
        with pytest.raises(ValueError):
            make()


@pytest.mark.parametrize(
    "call, given, meant",
    [
        (lambda **given: surfrecon.merge([], **given), "voxel_size", "voxel"),
        (lambda **given: surfrecon.merge([], **given), "progres", "progress"),
        (lambda **given: surfrecon.merge_to_file([], "a.ply", **given), "workspce", "workspace"),
        (lambda **given: surfrecon.sculpt(next(iter(torus_scans(8))), **given), "toleranse", "tolerance"),
        (lambda **given: surfrecon.open("a", **given), "scalle", "scale"),
        (lambda **given: surfrecon.read("a", **given), "camara", "camera"),
        (lambda **given: surfrecon.align([], **given), "trustd", "trusted"),
        (lambda **given: surfrecon.Aligner([], **given), "thread", "threads"),
        (lambda **given: torus(8).write("a.ply", **given), "provenence", "provenance"),
        (lambda **given: torus_scans(8)[0].triangulate(**given), "edge_limits", "edge_limit"),
        (lambda **given: surfrecon.cluster(torus(8), **given), "vertexes", "vertices"),
        (lambda **given: surfrecon.virtual_scan(torus(8), [], **given), "noize", "noise"),
        (lambda **given: surfrecon.reconstruct(np.zeros((4, 3)), **given), "color", "colour"),
        (lambda **given: surfrecon.Merger([]).merge(**given), "mesure", "measure"),
        (lambda **given: surfrecon.Job.merge([], **given), "voxl", "voxel"),
        (lambda **given: surfrecon.turntable(torus(8), **given), "pixel", "pixels"),
        (lambda **given: surfrecon.sculpture(**given), "cel", "cell"),
        (lambda **given: surfrecon.Context(**given), "thread", "threads"),
        (lambda **given: surfrecon.Mesh(np.eye(3), [[0, 1, 2]], **given), "color", "colour"),
        (lambda **given: surfrecon.Plane((0, 0, 0), (0, 0, 1), **given), "margn", "margin"),
        (lambda **given: surfrecon.Plane.through(np.eye(3), **given), "abve", "above"),
        (lambda **given: surfrecon.Pick(0, 1, (0, 0, 0), (0, 0, 0), **given), "normal", "normals"),
        (lambda **given: surfrecon.RangeImage.from_points(np.zeros((2, 2, 3)), **given), "veiwing", "viewing"),
        (lambda **given: surfrecon.distances(np.zeros((1, 3)), torus(8), **given), "thread", "threads"),
        (lambda **given: surfrecon.surface_distance(torus(8), torus(8), **given), "sined", "signed"),
        (lambda **given: surfrecon.keep([], torus(8), **given), "progres", "progress"),
        (lambda **given: surfrecon.ground(surfrecon.Plane((0, 0, 0), (0, 0, 1)), **given), "ups", "up"),
        (lambda **given: surfrecon.formats(**given), "writen", "written"),
    ],
)
def test_misspelt_keywords_are_told_what_was_meant(call, given, meant):
    with pytest.raises(TypeError, match=rf"got an unexpected keyword argument '{given}'\. Did you mean '{meant}'\?"):
        call(**{given: 1})


@pytest.mark.parametrize(
    "call, given, meant",
    [
        (lambda: surfrecon.align([], start="sequnce"), "sequnce", "sequence"),
        (lambda: surfrecon.parameters("mereg"), "mereg", "merge"),
        (lambda: surfrecon.figures("quds"), "quds", "quads"),
        (lambda: surfrecon.formats(written="mehs"), "mehs", "mesh"),
        (lambda: surfrecon.merge([], files="allways"), "allways", "always"),
        (lambda: surfrecon.reconstruct(np.zeros((4, 3)), topology="manifolt"), "manifolt", "manifold"),
    ],
)
def test_misspelt_words_are_told_what_was_meant(call, given, meant):
    refused = (surfrecon.ParameterError, surfrecon.InputError)
    with pytest.raises(refused, match=rf'"{given}"\. Did you mean "{meant}"\?'):
        call()


def test_misspelt_figures_and_endings_are_told_what_was_meant(tmp_path):
    report = torus(8).check()
    with pytest.raises(AttributeError, match=r"CheckReport has no 'trianlges'\. Did you mean 'triangles'\?"):
        _ = report.trianlges
    with pytest.raises(KeyError, match=r"CheckReport has no 'trianlges'\. Did you mean 'triangles'\?"):
        _ = report["trianlges"]
    with pytest.raises(surfrecon.InputError, match=r"to hold a mesh\. Did you mean \.ply\?"):
        torus(8).write(tmp_path / "a.pyl")
    with pytest.raises(surfrecon.InputError, match=r"there is no name before \.ply: call it scan\.ply"):
        torus(8).write(tmp_path / ".ply")


def test_a_keyword_that_is_like_none_is_told_what_there_is():
    with pytest.raises(
        TypeError, match=r"open\(\) got an unexpected keyword argument 'zzz'\. It takes allow_outside, .*step\."
    ):
        surfrecon.open("a", zzz=1)
    # A parameter that a function leaves to others is not offered.
    with pytest.raises(TypeError, match="'max_errors'") as refused:
        surfrecon.cluster_levels(torus(8), [20], max_errors=1)
    assert "Did you mean 'max_error'" not in str(refused.value)


def unaligned(array, dtype=None):
    """The same numbers at an odd address, as views into records of files lie."""
    array = np.asarray(array, dtype)
    raw = np.zeros(array.nbytes + 1, np.uint8)
    view = raw[1:].view(array.dtype).reshape(array.shape)
    view[...] = array
    assert not view.flags.aligned
    return view


def test_arrays_may_lie_anywhere():
    mesh = torus(8)
    same = surfrecon.Mesh(
        unaligned(mesh.positions),
        unaligned(mesh.triangles),
        colour=unaligned(np.ones((len(mesh.positions), 3)), np.float32),
        confidence=unaligned(np.ones(len(mesh.positions)), np.float32),
    )
    assert np.array_equal(same.positions, mesh.positions) and np.array_equal(same.triangles, mesh.triangles)
    record = np.zeros(6, [("flag", "u1"), ("z", "f8")])
    record["z"] = np.arange(6)
    image = surfrecon.RangeImage.orthographic(record["z"].reshape(2, 3), step=(1, 1))
    assert np.array_equal(image.values, np.arange(6.0).reshape(2, 3))
    image.world_from_sensor = unaligned(np.eye(4))
    points = surfrecon.RangeImage.from_points(unaligned(np.zeros((2, 2, 3)), np.float32))
    assert points.valid.all()
    assert surfrecon.Plane(unaligned(np.zeros(3)), (0, 0, 1)).margin == 0


def test_paths_may_be_bytes(tmp_path):
    mesh, folder = torus(8), str(tmp_path).encode()
    mesh.write(folder + b"/mesh.ply")
    assert np.array_equal(surfrecon.read(folder + b"/mesh.ply").triangles, mesh.triangles)
    assert len(surfrecon.open(folder)) == len(surfrecon.open([folder + b"/mesh.ply"])) == 1
    assert surfrecon.provenance(folder + b"/mesh.ply") == surfrecon.provenance(tmp_path / "mesh.ply")
    assert surfrecon.recording_of(folder + b"/mesh.ply") is None
    assert surfrecon.crs_note(folder + b"/mesh.stl", "mesh", "EPSG:25832")
    scans = torus_scans(20)
    surfrecon.write_scans(folder + b"/all.conf", scans)
    surfrecon.merge_to_file(scans, folder + b"/merged.ply", workspace=folder, voxel=0.2)
    assert (tmp_path / "merged.ply").is_file()
    with pytest.raises(surfrecon.InputError, match="only .ply is written piece by piece"):
        surfrecon.merge_to_file(scans, folder + b"/merged.obj")
    with pytest.raises(TypeError, match="open files with surfrecon.open"):
        surfrecon.merge(folder)
    for wrong in (3, None, bytearray(b"a.ply")):
        with pytest.raises(TypeError, match="must be a path, a binary file object"):
            surfrecon.read(wrong)


def test_any_iterable_of_paths_is_opened(tmp_path):
    paths = [tmp_path / f"{name}.ply" for name in "cab"]
    for path in paths:
        torus(8).write(path)
    names = [path.stem for path in paths]
    for given in (paths, tuple(paths), iter(paths), (path for path in paths), dict.fromkeys(paths), map(str, paths)):
        assert [scan.name for scan in surfrecon.open(given)] == names
    assert {scan.name for scan in surfrecon.open(set(paths))} == set(names)
    assert len(surfrecon.open(tmp_path.glob("*.ply"))) == 3
    with open(paths[0], "rb") as file, open(paths[1], "rb") as other:
        assert len(surfrecon.open(file)) == len(surfrecon.open(iter([other]))) == 1
    with pytest.raises(surfrecon.InputError, match="no file"):
        surfrecon.open(iter([]))
    with pytest.raises(TypeError, match="paths must be a path, .* or another iterable of these, got .*int"):
        surfrecon.open(3)
    with pytest.raises(ZeroDivisionError):
        surfrecon.open(1 / 0 for _ in "a")


def test_slices_of_a_set_are_sets(tmp_path):
    surfrecon.write_scans(tmp_path / "all.conf", torus_scans(20))
    scans = surfrecon.open(tmp_path / "all.conf")
    names = [scan.name for scan in scans]
    for part in (slice(2, 5), slice(None, None, -1), slice(-1, 1, -2), slice(5, 2), slice(None), slice(-3, None)):
        some = scans[part]
        assert isinstance(some, surfrecon.ScanSet) and some.notes == scans.notes
        assert [scan.name for scan in some] == names[part] and len(some) == len(names[part])
    box = surfrecon.Box.between((-9, -9, -9), (9, 9, 9))
    assert len(scans[::-2].keep(box)) == len(names[::-2]) and scans[::-1][::-1][0] is scans[0]
    assert surfrecon.merge(scans[:6], voxel=0.2).mesh.positions.size
