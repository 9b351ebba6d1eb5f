"""Help of the user when scans are aligned: picks, turntables, drawing one by hand, looking at what does not fit."""

import numpy as np
import pytest
import surfrecon
import surfrecon.plot
from heaps import errors, off_by, pushed, revolved, turned_scans, without_poses


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
        assert snap.state == "fits" and not snap.freedoms and off < spacing, (k, snap, off)
        assert k not in snap.touches and {(k + 1) % 6, (k - 1) % 6} <= set(snap.touches)
        assert 0.2 < snap.overlap <= 1 and 0 < snap.residual < spacing and snap.balance > 0 and snap.seen_through < 0.1
        moved = off_by(start, snap.world_from_scan, scan)
        assert moved <= snap.moved < 3 * moved and "fits" in repr(snap)


def test_a_scan_is_drawn_to_those_that_have_a_pose(truth, aligner):
    """A scan that was not aligned by itself is placed by hand beside those that were."""
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
    assert snap.state == "slides" and any(way.turns for way in snap.freedoms)
    assert all(len(way.direction) == len(way.point) == 3 for way in snap.freedoms)


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
        (0, NOT_A_NUMBER, {}, surfrecon.InputError, "world_from_scan must have finite entries"),
        (0, "here", {}, TypeError, "world_from_scan must be real numbers"),
        (0, GOOD, {"poses": [GOOD] * 5}, surfrecon.InputError, "5 poses are given for 6 scans"),
        (0, GOOD, {"poses": [GOOD]}, surfrecon.InputError, "1 pose is given for 6 scans: give a list of as many as"),
        (0, GOOD, {"poses": 3}, TypeError, "poses must be a list of 4 x 4 matrices or None"),
        (0, GOOD, {"poses": [GOOD] * 5 + [SCALED]}, surfrecon.InputError, "the pose of scan 5 must be rigid"),
        (
            0,
            GOOD,
            {"poses": [GOOD, NOT_A_NUMBER] + [None] * 4},
            surfrecon.InputError,
            "the pose of scan 1 must have finite entries",
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
    assert repr(found).startswith("TurntableFound(axis=")
    # The axis and the angles that were found can be given.
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


def test_a_picture_of_what_lies_apart(aligned, truth):
    import matplotlib

    matplotlib.use("agg")
    ax = surfrecon.plot.misfit(aligned, 2, unit="mm")
    assert ax.get_title().startswith("view2, RMS ")
    assert np.array_equal(np.ma.filled(ax.images[0].get_array(), np.nan), aligned.misfit(2), equal_nan=True)
    meshes = surfrecon.align([(scan.triangulate(), scan.world_from_sensor) for scan in truth[:2]], fixed=[0, 1])
    with pytest.raises(ValueError, match="scan 0 is no range image"):
        surfrecon.plot.misfit(meshes, 0)
