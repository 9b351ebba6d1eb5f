"""Aligning through Python: what is found, what is refused, drawing by hand, what does not fit, poses out, pictures."""

import gc
import threading

import numpy as np
import pytest
import surfrecon
import surfrecon.plot
from shapes import torus_scans


def rigid(generator):
    """A turn about any axis and a shift."""
    q, _ = np.linalg.qr(generator.normal(size=(3, 3)))
    pose = np.eye(4)
    pose[:3, :3] = q * np.sign(np.linalg.det(q))
    pose[:3, 3] = generator.normal(size=3) * 100
    return pose


def look():
    """Six views of the sculpture with the poses that they were taken from."""
    mesh = surfrecon.sculpture(cell=2.0)
    scans = surfrecon.virtual_scan(mesh, surfrecon.turntable(mesh, around=6, above=0, below=0, pixels=130))
    for k, scan in enumerate(scans):
        scan.name = f"view{k}"
    return scans


@pytest.fixture(scope="module")
def truth():
    return look()


@pytest.fixture(scope="module")
def heap():
    """The same thrown about."""
    generator = np.random.default_rng(5)
    scans = look()
    for scan in scans:
        scan.world_from_sensor = rigid(generator)
    return scans


@pytest.fixture(scope="module")
def aligned(heap):
    return surfrecon.align(heap)


@pytest.fixture(scope="module")
def aligner(heap):
    return surfrecon.Aligner(heap)


@pytest.fixture(scope="module")
def in_place(truth):
    """The scans where they belong, made ready."""
    return surfrecon.Aligner(truth)


def off_by(pose, wanted, scan):
    """Largest distance of a scan's samples from where they belong."""
    points = scan.points[scan.valid]
    return np.linalg.norm(points @ (pose - wanted)[:3, :3].T + (pose - wanted)[:3, 3], axis=1).max()


def pushed(scan, degrees, share, seed=0):
    """The pose of a scan that was turned about its middle and shifted by a share of its size."""
    direction = np.random.default_rng(seed).normal(size=3)
    x, y, z = direction / np.linalg.norm(direction)
    cross, turn = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]]), np.radians(degrees)
    points = scan.world_points()[scan.valid]
    pose = np.eye(4)
    pose[:3, :3] += np.sin(turn) * cross + (1 - np.cos(turn)) * cross @ cross
    pose[:3, 3] = (
        points.mean(0) - pose[:3, :3] @ points.mean(0) + share * np.ptp(points, axis=0).max() * np.array((x, y, z))
    )
    return pose @ scan.world_from_sensor


def revolved(radius, height=1.0, detail=96):
    """A closed surface of revolution about z, whose radius is a function of z."""
    z = np.linspace(-height, height, detail)
    turn = 2 * np.pi * np.arange(detail) / detail
    r = np.broadcast_to(radius(z), z.shape)[:, None]
    side = np.stack([r * np.cos(turn), r * np.sin(turn), np.repeat(z[:, None], detail, axis=1)], -1).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(detail - 1), np.arange(detail), indexing="ij")
    a, b = (i * detail + j).ravel(), (i * detail + (j + 1) % detail).ravel()
    first, n = np.arange(detail), len(side)
    last = n - detail + first
    faces = [
        np.stack([a, b, b + detail], 1),
        np.stack([a, b + detail, a + detail], 1),
        np.stack([np.full(detail, n), np.roll(first, -1), first], 1),
        np.stack([np.full(detail, n + 1), last, np.roll(last, -1)], 1),
    ]
    return surfrecon.Mesh(np.vstack([side, (0, 0, -height), (0, 0, height)]), np.concatenate(faces).astype(np.uint32))


def turned_scans(mesh, count):
    """What a sensor that stands still sees of a mesh on a turntable; its axis in the sensor's frame, and the angles."""
    cameras = surfrecon.turntable(mesh, around=count, above=0, below=0, pixels=130)
    scans = surfrecon.virtual_scan(mesh, cameras)
    sensor_from_world = np.linalg.inv(cameras[0].world_from_sensor)
    middle = mesh.bounds.mean(0)
    axis = sensor_from_world[:3, :3] @ middle + sensor_from_world[:3, 3], sensor_from_world[:3, :3] @ (0, 0, 1)
    angles = -2 * np.pi * np.arange(count) / count
    for k, scan in enumerate(scans):
        scan.name = f"step{k}"
    return scans, axis, angles


def without_poses(scans, seed=5):
    """Copies of scans thrown about."""
    generator = np.random.default_rng(seed)
    copies = []
    for scan in scans:
        copy = surfrecon.RangeImage.from_points(scan.points, name=scan.name)
        copy.world_from_sensor = rigid(generator)
        copies.append(copy)
    return copies


def errors(truth, alignment):
    """Largest distance of a sample of each placed scan from where it belongs, in the distances of samples."""
    report = alignment.report
    kept = next(k for k, scan in enumerate(report.scans) if scan.state == "kept")
    truth_from_found = truth[kept].world_from_sensor @ np.linalg.inv(alignment.world_from_scan[kept])
    found = []
    for scan, pose, told in zip(truth, alignment.world_from_scan, report.scans, strict=True):
        if pose is None:
            found.append(np.nan)
            continue
        points = scan.points[scan.valid]
        points = np.column_stack([points, np.ones(len(points))])
        off = points @ (truth_from_found @ pose - scan.world_from_sensor).T
        found.append(np.linalg.norm(off, axis=1).max() / told.spacing)
    return np.array(found)


def test_each_finds_its_place(truth, aligned):
    off = errors(truth, aligned)
    assert np.all(off < 1.0), (off, str(aligned.report))
    report = aligned.report
    assert report.placed == len(truth) and report.groups == [list(range(len(truth)))]
    assert [scan.name for scan in report.scans] == [scan.name for scan in truth]
    assert sum(scan.state == "kept" for scan in report.scans) == 1
    assert all(not scan.reason and not scan.free for scan in report.scans)
    assert 0 < report.residual < max(scan.spacing for scan in report.scans)
    assert "6 of 6 scans placed" in str(report) and "6 placed" in repr(aligned)


def test_what_is_placed_merges(truth, aligned):
    mesh = surfrecon.merge(aligned.scans).mesh
    assert mesh.check()["is_manifold"]
    kept = next(k for k, scan in enumerate(aligned.report.scans) if scan.state == "kept")
    back = truth[kept].world_from_sensor @ np.linalg.inv(aligned.world_from_scan[kept])
    positions = mesh.positions @ back[:3, :3].T + back[:3, 3]
    distance = surfrecon.distances(positions, surfrecon.sculpture(cell=2.0))
    assert np.quantile(distance, 0.95) < aligned.report.scans[0].spacing


def test_the_given_scans_are_left_alone(heap, aligned):
    generator = np.random.default_rng(5)
    assert all(np.array_equal(scan.world_from_sensor, rigid(generator)) for scan in heap)
    kept = next(k for k, scan in enumerate(aligned.report.scans) if scan.state == "kept")
    assert np.array_equal(aligned.world_from_scan[kept], heap[kept].world_from_sensor)


def test_order_and_threads_change_no_bit(heap, aligned):
    order = [3, 0, 5, 1, 4, 2]
    other = surfrecon.align([heap[k] for k in order], threads=1)
    for place, k in enumerate(order):
        assert np.array_equal(other.world_from_scan[place], aligned.world_from_scan[k])
        assert np.array_equal(other.report.scans[place].covariance, aligned.report.scans[k].covariance)


def test_fixed_scans_stay(heap):
    result = surfrecon.align(heap, fixed=[2])
    assert np.array_equal(result.world_from_scan[2], heap[2].world_from_sensor)
    assert result.report.scans[2].state == "kept" and result.report.placed == len(heap)


def test_a_ball_is_left_out():
    a, b = np.meshgrid(np.linspace(0, 2 * np.pi, 60), np.linspace(0.02, np.pi - 0.02, 40), indexing="ij")
    grid = np.stack([np.sin(b) * np.cos(a), np.sin(b) * np.sin(a), np.cos(b)], axis=-1).reshape(-1, 3)
    triangles = [
        t for i in range(59) for j in range(39) for p in [i * 40 + j] for t in ([p, p + 1, p + 41], [p, p + 41, p + 40])
    ]
    ball = surfrecon.Mesh(grid, np.array(triangles, np.uint32))
    cameras = surfrecon.turntable(ball, around=8, above=0, below=0, pixels=90)
    result = surfrecon.align(surfrecon.virtual_scan(ball, cameras[:3]))
    assert result.report.placed == 0 and sum(pose is not None for pose in result.world_from_scan) == 1
    reasons = [scan.reason for scan in result.report.scans if scan.state != "kept"]
    assert any("turn" in reason for reason in reasons), reasons
    assert any(pair.state == "slides" and pair.free for pair in result.report.pairs)


def test_what_is_known_too_badly_is_not_placed():
    """Smooth things seen by a few hundred pixels."""
    scans = torus_scans(pixels=30)
    for a in range(len(scans)):
        for b in range(a):
            two = [scans[b], scans[a]]
            result = surfrecon.align(two)
            off = errors(two, result)
            assert not np.any(off > 5.0), (a, b, off, str(result.report))


def test_meshes_and_clouds_with_normals_are_scans(truth, tmp_path):
    meshes = [(scan.triangulate(), np.eye(4), scan.name) for scan in truth[:3]]
    result = surfrecon.align(meshes)
    # Without sensors there is less evidence.
    assert np.nanmax(errors(truth[:3], result)) < 2.0 and result.report.placed >= 2
    mesh, pose, name = result.scans[0]
    assert isinstance(mesh, surfrecon.Mesh) and pose.shape == (4, 4) and name == "view0"
    (tmp_path / "bare.ply").write_text(
        "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\nend_header\n"
        "0 0 0\n1 0 0\n"
    )
    cloud = surfrecon.read(tmp_path / "bare.ply")
    with pytest.raises(surfrecon.InputError, match="no normals"):
        surfrecon.align([truth[1], cloud])
    with pytest.raises(TypeError):
        surfrecon.merge([truth[1], cloud])


def test_poses_are_written(truth, heap, tmp_path):
    surfrecon.write_scans(tmp_path / "heap.conf", heap)
    scans = surfrecon.open(tmp_path / "heap.conf")
    result = surfrecon.align(scans)
    for ending in ("conf", "mlp", "aln"):
        result.write(tmp_path / f"placed.{ending}")
        again = surfrecon.open(tmp_path / f"placed.{ending}")
        assert len(again) == len(heap)
        for scan, pose in zip(again, result.world_from_scan, strict=True):
            assert np.allclose(scan.world_from_sensor, pose, atol=1e-6), ending
    result.write(tmp_path / "placed.tum")
    assert len((tmp_path / "placed.tum").read_text().splitlines()) == len(heap) + 1
    with pytest.raises(surfrecon.InputError, match=r"\.conf"):
        result.write(tmp_path / "placed.txt")
    with pytest.raises(surfrecon.InputError, match="no file of its own"):
        surfrecon.align(heap[:2]).write(tmp_path / "other.conf")
    assert not (tmp_path / "other.conf").exists()


BAD_OPTIONS = [
    ({"fixed": [9]}, surfrecon.InputError, "fixed names scan 9, but there are 6"),
    ({"fixed": [-1]}, surfrecon.InputError, "fixed names scan -1, but scans are counted from 0"),
    ({"fixed": [2**70]}, surfrecon.InputError, "fixed names scan 1180591620717411303424"),
    ({"fixed": [0.5]}, TypeError, "fixed must name scans by whole numbers, got 0.5"),
    ({"fixed": 3}, TypeError, "fixed must be a list of numbers of scans, got 3"),
    ({"trusted": [(0, 0)]}, surfrecon.InputError, "twice"),
    (
        {"trusted": [(0, 1), (0, 1, 2)]},
        TypeError,
        r"entry 1 of trusted must be a pair \(a, b\) of scans, got \(0, 1, 2\)",
    ),
    ({"rejected": [(0, 9)]}, surfrecon.InputError, "rejected names scan 9"),
    ({"rejected": [(0, 1)], "trusted": [(1, 0)]}, surfrecon.InputError, "both trusted and rejected"),
    ({"picks": [(0, 1, (0, 0, 0), (0, 0, np.nan))]}, surfrecon.InputError, "finite"),
    ({"picks": [(0, 1, (0, 0), (0, 0, 1))]}, surfrecon.InputError, "point_a of pick 0"),
    ({"picks": [(0, 1, (0, 0, 0), (0, 0, 1), "much")]}, TypeError, "pick 0: its weight must be a real number"),
    ({"picks": [(0, 1, (0, 0, 0), (0, 0, 1), -1)]}, surfrecon.InputError, "pick 0: its weight must be .* got -1"),
    ({"picks": [(0, 9, (0, 0, 0), (0, 0, 1))]}, surfrecon.InputError, "pick 0 names scan 9"),
    ({"picks": ["a"]}, TypeError, "pick 0 must be a Pick"),
    (
        {"picks": [surfrecon.Pick(0, 1, (0, 0, 0), (0, 0, 1), normals=((0, 0, 1), (0, 0, 0)))]},
        surfrecon.InputError,
        "pick 0: a normal is zero",
    ),
    ({"axis": (0, 0, 1)}, TypeError, r"axis must be \(point, direction\), three numbers each, got \(0, 0, 1\)"),
    ({"axis": ((0, 0, 0), (0, 1))}, surfrecon.InputError, r"the axis' direction must have shape \(3,\), got \(2,\)"),
    ({"axis": ((0, 0, 0), (0, 0, 0))}, surfrecon.InputError, "the turntable's axis has a direction of 0"),
    ({"axis": ((0, np.nan, 0), (0, 0, 1))}, surfrecon.InputError, "the turntable's axis has .* not finite"),
    ({"angles": [0, 1, 2]}, surfrecon.InputError, "3 angles of the turntable are given for 6 scans"),
    ({"angles": []}, surfrecon.InputError, "angles has no entry"),
    (
        {"angles": [0, 1, 2, 3, np.inf, 5]},
        surfrecon.InputError,
        "the turntable's angle of scan 4 must be a number of radians",
    ),
    ({"angles": [0, 1, 2, 3, None, 5]}, TypeError, "angles must be real numbers"),
    ({"angles": np.zeros((6, 1))}, surfrecon.InputError, r"angles must have shape \(n,\), got \(6, 1\)"),
    ({"turntable": "yes"}, surfrecon.ParameterError, 'turntable must be "no", "turned" or "equal"'),
    ({"start": "near"}, surfrecon.ParameterError, "rough"),
    ({"min_overlap": 2}, surfrecon.ParameterError, "min_overlap"),
    ({"tolerance": -1}, surfrecon.ParameterError, "tolerance"),
]


@pytest.mark.parametrize(("options", "error", "words"), BAD_OPTIONS, ids=lambda x: str(x)[:40])
def test_what_makes_no_sense_is_refused(heap, aligner, options, error, words):
    with pytest.raises(error, match=words):
        surfrecon.align(heap, **options)
    with pytest.raises(error, match=words):
        aligner.align(**options)
    with pytest.raises(error, match=words):
        surfrecon.Job.align(heap, **options).result()


@pytest.mark.parametrize(
    ("arguments", "options", "error", "words"),
    [
        ((-1, 0, (0, 0, 0), (0, 0, 0)), {}, surfrecon.InputError, "the pick names scan -1"),
        (("a", 0, (0, 0, 0), (0, 0, 0)), {}, TypeError, "must name scans by whole numbers, got 'a'"),
        ((0, 1, (0, 0, 0, 1), (0, 0, 0)), {}, surfrecon.InputError, r"point_a must have shape \(3,\), got \(4,\)"),
        ((0, 1, (0, 0, 0), (0, 0, 0)), {"normals": (0, 0, 1)}, TypeError, r"normals must be \(normal_a, normal_b\)"),
        ((0, 1, (0, 0, 0), (0, 0, 0)), {"normals": ((0, 1), (0, 0, 1))}, surfrecon.InputError, "normal_a must have"),
        ((0, 1, (0, 0, 0), (0, 0, 0)), {"weight": "1"}, TypeError, "weight"),
    ],
)
def test_what_is_no_pick_is_refused(arguments, options, error, words):
    with pytest.raises(error, match=words):
        surfrecon.Pick(*arguments, **options)


def test_a_pick_tells_what_it_is():
    pick = surfrecon.Pick(0, 2, (1, 2, 3), np.arange(3.0), normals=((0, 0, 1), (1, 0, 0)), weight=2)
    assert (pick.a, pick.b, pick.weight) == (0, 2, 2.0)
    assert (pick.point_a, pick.point_b) == ([1, 2, 3], [0, 1, 2]) and pick.normals == ([0, 0, 1], [1, 0, 0])
    assert "scans 0 and 2" in repr(pick) and "with normals" in repr(pick)
    assert surfrecon.Pick(0, 1, (0, 0, 0), (0, 0, 0)).normals is None


def test_one_scan_and_scaled_ones_are_refused(truth):
    with pytest.raises(surfrecon.InputError, match="at least two"):
        surfrecon.align(truth[:1])
    mesh = truth[0].triangulate()
    with pytest.raises(surfrecon.InputError, match="big.*scale"):
        surfrecon.align([truth[1], (mesh, np.diag([2.0, 2, 2, 1]), "big")])


def test_an_aligner_gives_the_same_as_often_as_wanted(aligner, aligned):
    assert len(aligner) == 6 and "6 scans" in repr(aligner)
    told = aligner.align(rejected=[(0, 1)])
    assert any(pair.state == "rejected" for pair in told.report.pairs)
    for other in (aligner.align(), aligned.aligner.align(threads=1)):
        assert all(np.array_equal(a, b) for a, b in zip(other.world_from_scan, aligned.world_from_scan, strict=True))
    made = surfrecon.Job.aligner(aligned.scans, threads=1).result()
    assert isinstance(made, surfrecon.Aligner) and len(made) == 6


@pytest.mark.parametrize(("degrees", "share"), [(5, 0.02), (10, 0.05)])
def test_a_scan_is_drawn_back_to_where_it_belongs(truth, in_place, aligned, degrees, share):
    for k, scan in enumerate(truth):
        start = pushed(scan, degrees, share, seed=k)
        spacing = aligned.report.scans[k].spacing
        assert off_by(start, scan.world_from_sensor, scan) > 2 * spacing
        snap = in_place.snap(k, start)
        off = off_by(snap.world_from_scan, scan.world_from_sensor, scan)
        assert snap.state == "fits" and not snap.free and off < spacing, (k, snap, off)
        assert k not in snap.touches and {(k + 1) % 6, (k - 1) % 6} <= set(snap.touches)
        assert 0.2 < snap.overlap <= 1 and 0 < snap.residual < spacing and snap.balance > 0 and snap.seen_through < 0.1
        moved = off_by(start, snap.world_from_scan, scan)
        assert moved <= snap.moved < 3 * moved and "fits" in repr(snap)


def test_a_scan_is_drawn_to_those_that_have_a_pose(truth, aligner):
    """What was not aligned by itself is placed by hand beside what was."""
    poses = [scan.world_from_sensor for scan in truth]
    poses[3] = None
    start = pushed(truth[3], 5, 0.02)
    snap = aligner.snap(3, start, poses=poses)
    assert snap.state == "fits" and off_by(snap.world_from_scan, truth[3].world_from_sensor, truth[3]) < 3.0
    poses[4] = None
    beside = aligner.snap(3, start, poses=poses)
    assert 4 not in beside.touches and 2 in beside.touches
    # Alone, and far from all, it stays where it is.
    far = start.copy()
    far[:3, 3] += 1e4
    for lonely in (aligner.snap(3, start, poses=[None] * 6), aligner.snap(3, far, poses=poses)):
        assert lonely.state == "nothing" and lonely.touches == [] and lonely.moved == 0
    assert np.allclose(lonely.world_from_scan, far, rtol=0, atol=1e-8)


def test_what_slides_is_said_to_when_it_is_drawn():
    ball = revolved(lambda z: np.sqrt(np.maximum(1 - z * z, 0)))
    scans = surfrecon.virtual_scan(ball, surfrecon.turntable(ball, around=8, above=0, below=0, pixels=90)[:2])
    snap = surfrecon.Aligner(scans).snap(1, pushed(scans[1], 2, 0.01))
    assert snap.state == "slides" and any(kind == "turn" for kind, _, _ in snap.free)


GOOD, SCALED, MIRRORED = np.eye(4), np.diag([2.0, 2, 2, 1]), np.diag([1.0, 1, -1, 1])
NOT_A_NUMBER = np.where(GOOD == 1, GOOD, np.nan)


@pytest.mark.parametrize(
    ("scan", "pose", "options", "error", "words"),
    [
        (6, GOOD, {}, surfrecon.InputError, r"there is no scan 6: there are 6 \(counted from 0\)"),
        (-1, GOOD, {}, surfrecon.InputError, "scan names scan -1, but scans are counted from 0"),
        (0.5, GOOD, {}, TypeError, "whole numbers, got 0.5"),
        (0, np.eye(3), {}, surfrecon.InputError, r"world_from_scan must have shape \(4, 4\), got \(3, 3\)"),
        (0, SCALED, {}, surfrecon.InputError, "world_from_scan must be rigid"),
        (0, MIRRORED, {}, surfrecon.InputError, "world_from_scan must be rigid"),
        (0, NOT_A_NUMBER, {}, surfrecon.InputError, "world_from_scan has an entry that is not finite"),
        (0, "here", {}, TypeError, "world_from_scan must be real numbers"),
        (0, GOOD, {"poses": [GOOD] * 5}, surfrecon.InputError, "5 poses are given for 6 scans"),
        (0, GOOD, {"poses": 3}, TypeError, "poses must be a list of 4 x 4 matrices or None"),
        (0, GOOD, {"poses": [GOOD] * 5 + [SCALED]}, surfrecon.InputError, "the pose of scan 5 must be rigid"),
        (
            0,
            GOOD,
            {"poses": [GOOD, NOT_A_NUMBER] + [None] * 4},
            surfrecon.InputError,
            "the pose of scan 1 has an entry",
        ),
        (0, GOOD, {"reach": 0}, surfrecon.ParameterError, "reach must be .* > 0, got 0"),
        (0, GOOD, {"tolerance": -1}, surfrecon.ParameterError, "tolerance must be .* > 0, got -1"),
        (0, GOOD, {"min_overlap": 1.5}, surfrecon.ParameterError, "min_overlap must be"),
        (0, GOOD, {"threads": -1}, surfrecon.ParameterError, "threads must be"),
        (0, GOOD, {"start": "rough"}, TypeError, r"snap\(\) got an unexpected keyword argument 'start'"),
    ],
    ids=lambda x: str(x)[:30],
)
def test_a_snap_that_makes_no_sense_is_refused(aligner, scan, pose, options, error, words):
    with pytest.raises(error, match=words):
        aligner.snap(scan, pose, **options)


def test_misfit_has_the_shape_of_the_scan(truth, aligned, tmp_path):
    found = aligned.misfit(0)
    assert found.shape == truth[0].valid.shape and found.dtype == np.float64
    met = np.isfinite(found)
    assert not np.any(met & ~truth[0].valid) and 0.3 < met[truth[0].valid].mean() < 1
    told = aligned.report.scans[0]
    assert np.quantile(np.abs(found[met]), 0.9) < 0.5 * told.spacing and 0 < told.misfit < 0.5 * told.spacing
    # The same at points that are given, in their shape.
    points = truth[0].points
    assert np.array_equal(aligned.misfit(0, points), found, equal_nan=True)
    assert np.array_equal(aligned.misfit(0, points[met]), found[met])
    by_poses = aligned.aligner.misfit(0, aligned.world_from_scan, points[met])
    assert np.array_equal(by_poses, found[met])
    far = aligned.misfit(0, [(1e9, 0, 0), (np.inf, 0, 0), (np.nan, 0, 0)])
    assert far.shape == (3,) and np.isnan(far).all() and aligned.misfit(0, np.empty((0, 3))).shape == (0,)
    # On disk, as meshes, and as a cloud.
    surfrecon.write_scans(tmp_path / "heap.conf", truth)
    on_disk = surfrecon.Aligner(surfrecon.open(tmp_path / "heap.conf"))
    assert on_disk.misfit(0).ndim == 2 and np.isfinite(on_disk.misfit(0)).sum() > 0.9 * met.sum()
    mesh = truth[0].triangulate()
    corners = mesh.positions[mesh.triangles]
    normals = np.zeros(mesh.positions.shape)
    for side in range(3):
        np.add.at(
            normals, mesh.triangles[:, side], np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        )
    lines = "\n".join(" ".join(map(repr, map(float, row))) for row in np.hstack([mesh.positions, normals]))
    names = "\n".join(f"property double {name}" for name in ("x", "y", "z", "nx", "ny", "nz"))
    (tmp_path / "cloud.ply").write_text(
        f"ply\nformat ascii 1.0\nelement vertex {len(normals)}\n{names}\nend_header\n{lines}\n"
    )
    cloud = surfrecon.read(tmp_path / "cloud.ply")
    mixed = surfrecon.Aligner([(mesh, truth[0].world_from_sensor), cloud, truth[1]])
    place = truth[0].world_from_sensor
    assert mixed.misfit(0).shape == (len(mesh.positions),) and np.isfinite(mixed.misfit(0)).any()
    assert mixed.misfit(1, [place, place, None]).shape == (len(cloud.positions),)


def test_misfit_is_what_lies_apart(truth, in_place, aligned):
    spacing = aligned.report.scans[0].spacing
    before = in_place.misfit(0)
    # Nearer to its sensor it lies outside.
    poses = [scan.world_from_sensor for scan in truth]
    for sign in (1, -1):
        poses[0] = truth[0].world_from_sensor
        poses[0][:3, 3] += sign * 0.5 * spacing * poses[0][:3, 2]
        shift = in_place.misfit(0, poses) - before
        assert 0.1 < sign * np.nanmedian(shift) / spacing < 0.5
    # A part that has moved shows where it is.
    points = truth[0].points.copy()
    met = np.argwhere(np.isfinite(before))
    row, col = met[len(met) // 2]
    part = np.s_[max(row - 8, 0) : row + 8, max(col - 8, 0) : col + 8]
    points[part] += (0, 0, spacing)
    bent = surfrecon.RangeImage.from_points(points)
    bent.world_from_sensor = truth[0].world_from_sensor
    change = surfrecon.Aligner([bent, *truth[1:]]).misfit(0) - before
    is_part = np.zeros(change.shape, bool)
    is_part[part] = True
    assert change[row, col] > 0.4 * spacing
    far = ~is_part & np.isfinite(change)
    far[max(row - 16, 0) : row + 16, max(col - 16, 0) : col + 16] = False
    assert np.quantile(np.abs(change[far]), 0.95) < 0.2 * spacing


@pytest.mark.parametrize(
    ("arguments", "error", "words"),
    [
        ((6,), surfrecon.InputError, "there is no scan 6"),
        ((-1,), surfrecon.InputError, "scan names scan -1"),
        ((0, [None] * 6), surfrecon.InputError, "scan 0 has no pose"),
        ((0, [GOOD] * 7), surfrecon.InputError, "7 poses are given for 6 scans"),
        ((0, [GOOD] * 5 + [MIRRORED]), surfrecon.InputError, "the pose of scan 5 must be rigid"),
        ((0, None, (0, 0, 0)), surfrecon.InputError, r"points must have shape \(n, 3\), got \(3,\)"),
        ((0, None, np.zeros((2, 2, 2))), surfrecon.InputError, r"points must have shape \(n, n, 3\), got \(2, 2, 2\)"),
        ((0, None, "all"), TypeError, "points must be real numbers"),
    ],
    ids=lambda x: str(x)[:30],
)
def test_a_misfit_that_makes_no_sense_is_refused(aligner, arguments, error, words):
    with pytest.raises(error, match=words):
        aligner.misfit(*arguments)


def test_misfit_of_what_is_not_placed_is_refused(truth):
    plane = surfrecon.RangeImage.orthographic(np.zeros((20, 20)), step=(1.0, 1.0))
    result = surfrecon.align([*truth[:2], plane])
    assert result.world_from_scan[2] is None
    with pytest.raises(surfrecon.InputError, match="scan 2 has no pose"):
        result.misfit(2)


@pytest.mark.parametrize("turntable", ["turned", "equal"])
def test_a_turntable_is_found(turntable):
    scans, (point, direction), angles = turned_scans(surfrecon.sculpture(cell=2.0), 8)
    result = surfrecon.align(without_poses(scans), turntable=turntable)
    off = errors(scans, result)
    assert np.all(off < 1.5), (off, str(result.report))
    found = result.report.turntable
    at, along = map(np.array, found.axis)
    sign = np.sign(along @ direction)
    assert abs(along @ direction) > 0.9999 and abs(np.linalg.norm(along) - 1) < 1e-9
    apart = (at - point) - (at - point) @ direction * direction
    assert np.linalg.norm(apart) < result.report.scans[0].spacing
    turns = np.array(found.angles)
    assert np.all((turns >= 0) & (turns < 2 * np.pi))
    wrapped = (turns - sign * angles + np.pi) % (2 * np.pi) - np.pi
    assert np.abs(wrapped).max() < 0.02, (turns, angles)
    assert "about" in repr(found)
    # What was found can be given.
    again = surfrecon.align(without_poses(scans), axis=found.axis, angles=found.angles)
    assert np.all(errors(scans, again) < 1.5), str(again.report)


def test_a_vase_has_a_place_where_axis_and_angles_are_given():
    vase = revolved(lambda z: 0.5 + 0.15 * np.cos(4 * z))
    scans, axis, angles = turned_scans(vase, 8)
    alone = surfrecon.align(without_poses(scans))
    assert alone.report.placed == 0 and alone.report.turntable is None
    for result in (
        surfrecon.align(without_poses(scans), axis=axis, angles=angles),
        surfrecon.Job.align(without_poses(scans), axis=np.array(axis), angles=angles.tolist()).result(),
    ):
        assert result.report.placed == 8 and np.all(errors(scans, result) < 2.0), str(result.report)
        assert np.allclose(result.report.turntable.axis[1], axis[1], atol=1e-3)


def test_angles_of_scans_without_a_place_are_none():
    scans, axis, _ = turned_scans(surfrecon.sculpture(cell=2.0), 8)
    plane = surfrecon.RangeImage.orthographic(np.zeros((20, 20)), step=(1.0, 1.0))
    result = surfrecon.align([*without_poses(scans)[:4], plane], axis=axis)
    assert result.report.placed == 4 and result.report.turntable.angles[4] is None


def test_two_picks_with_normals_place_what_may_turn():
    vase = revolved(lambda z: 0.5 + 0.15 * np.cos(4 * z))
    scans = surfrecon.virtual_scan(vase, surfrecon.turntable(vase, around=8, above=0, below=0, pixels=130)[:2])
    heap = without_poses(scans)
    poses = [scan.world_from_sensor for scan in scans]
    # On the side that both see.
    between = sum(pose[:3, 3] for pose in poses)
    azimuth = np.arctan2(between[1], between[0])
    z = np.array([-0.4, 0.5])
    radius, slope = 0.5 + 0.15 * np.cos(4 * z), -0.6 * np.sin(4 * z)
    turn = azimuth + np.array([0.1, -0.1])
    points = np.stack([radius * np.cos(turn), radius * np.sin(turn), z], 1)
    normals = np.stack([np.cos(turn), np.sin(turn), -slope], 1)
    own = [(points - pose[:3, 3]) @ pose[:3, :3] for pose in poses]
    turned = [normals @ pose[:3, :3] for pose in poses]
    bare = [(0, 1, own[0][k], own[1][k]) for k in range(2)]
    told = [surfrecon.Pick(*bare[k], normals=(turned[0][k], turned[1][k])) for k in range(2)]
    assert surfrecon.align(heap).report.placed == 0
    result = surfrecon.align(heap, picks=told)
    assert result.report.placed == 2 and np.all(errors(scans, result) < 3.0), str(result.report)
    # Three points do as well, as tuples or as picks.
    own = [
        np.vstack([p, (np.array((0.6 * np.cos(azimuth), 0.6 * np.sin(azimuth), 0.05)) - pose[:3, 3]) @ pose[:3, :3]])
        for p, pose in zip(own, poses, strict=True)
    ]
    bare = [(0, 1, own[0][k], own[1][k]) for k in range(3)]
    by_tuples = surfrecon.align(heap, picks=bare)
    by_picks = surfrecon.align(heap, picks=[bare[0], surfrecon.Pick(*bare[1]), [*bare[2], 1.0]])
    assert by_tuples.report.placed == 2
    assert np.array_equal(by_tuples.world_from_scan[1], by_picks.world_from_scan[1])


def test_cancelling_ends_it(heap):
    with pytest.raises(surfrecon.Cancelled):
        surfrecon.align(heap, progress=lambda stage, fraction: False)
    for start in (surfrecon.Job.align, surfrecon.Job.aligner):
        job = start(heap)
        job.cancel()
        with pytest.raises(surfrecon.Cancelled):
            job.result()
    aligner = surfrecon.Aligner(heap)
    for call in (
        lambda **watch: surfrecon.Aligner(heap, **watch),
        aligner.align,
        lambda **watch: aligner.snap(0, np.eye(4), **watch),
        lambda **watch: aligner.misfit(0, **watch),
    ):
        with pytest.raises(surfrecon.Cancelled):
            call(progress=lambda stage, fraction: False)
        with pytest.raises(ZeroDivisionError):
            call(progress=lambda stage, fraction: 1 / 0)


def test_a_job_gives_the_same_and_progress_rises(heap, aligned):
    seen = []
    result = surfrecon.align(heap, progress=lambda stage, fraction: seen.append((stage, fraction)))
    assert [f for _, f in seen] == sorted(f for _, f in seen) and {"reading scans"} < {stage for stage, _ in seen}
    job = surfrecon.Job.align(heap).result()
    for other in (result, job):
        assert all(np.array_equal(a, b) for a, b in zip(other.world_from_scan, aligned.world_from_scan, strict=True))


def test_the_lock_is_released(heap):
    counted = 0
    done = threading.Event()

    def count():
        nonlocal counted
        while not done.is_set():
            counted += 1

    thread = threading.Thread(target=count)
    thread.start()
    surfrecon.align(heap)
    done.set()
    thread.join()
    gc.collect()
    assert counted > 1000


def test_a_picture_of_the_pairs(aligned):
    import matplotlib

    matplotlib.use("agg")
    ax = surfrecon.plot.alignment(aligned)
    assert "6 of 6" in ax.get_title()


def test_a_picture_of_what_lies_apart(aligned, truth):
    import matplotlib

    matplotlib.use("agg")
    ax = surfrecon.plot.misfit(aligned, 2, unit="mm")
    assert ax.get_title().startswith("view2, RMS ")
    assert np.array_equal(np.ma.filled(ax.images[0].get_array(), np.nan), aligned.misfit(2), equal_nan=True)
    meshes = surfrecon.align([(scan.triangulate(), scan.world_from_sensor) for scan in truth[:2]], fixed=[0, 1])
    with pytest.raises(ValueError, match="scan 0 is no range image"):
        surfrecon.plot.misfit(meshes, 0)
