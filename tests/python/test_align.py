"""Aligning through Python: what is found, what is refused, poses out, jobs, the picture of the pairs."""

import gc
import logging
import threading

import numpy as np
import pytest
import surfrecon
import surfrecon.plot
from heaps import errors, rigid
from shapes import torus_scans


def test_each_finds_its_place(truth, aligned):
    off = errors(truth, aligned)
    assert np.all(off < 1.0), (off, str(aligned.report))
    report = aligned.report
    assert report.placed == len(truth) and report.groups == [list(range(len(truth)))]
    assert [scan.name for scan in report.scans] == [scan.name for scan in truth]
    assert sum(scan.state == "kept" for scan in report.scans) == 1
    assert all(not scan.reason and not scan.freedoms for scan in report.scans)
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
    assert any(pair.state == "slides" and pair.freedoms for pair in result.report.pairs)


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


def test_a_reach_that_bounds_nothing_is_told(heap, caplog):
    for options, said in (({}, False), ({"reach": 0.5}, True), ({"reach": 0.5, "start": "rough"}, False)):
        caplog.clear()
        with caplog.at_level(logging.WARNING, "surfrecon"):
            report = surfrecon.align(heap[:2], **options).report
        told = 'reach, 0.5, is not used: it bounds rough poses, and start is not rough. Say start = "rough".'
        assert (told in caplog.messages) == (told in report.messages) == said


def test_scans_that_nothing_decides_stay_and_are_named(truth):
    wall = surfrecon.RangeImage.orthographic(np.zeros((40, 40)), step=(3, 3), name="wall")
    aside = np.eye(4)
    aside[0, 3] = 400
    wall.world_from_sensor = aside
    result = surfrecon.align([*truth, wall], start="rough", reach=16)
    *others, last = result.report.scans
    assert result.report.placed == len(truth) and all(scan.state in ("placed", "kept") for scan in others)
    assert last.state == "undecided" and last.deviation == 16 and "no place was found" in last.reason
    assert np.array_equal(result.world_from_scan[-1], aside)
    assert '"wall" stays where it was given: nothing decides where it belongs' in result.report.messages
    # Of a heap it is left out.
    assert surfrecon.align([*truth, wall]).report.scans[-1].state == "unplaced"


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
    assert len((tmp_path / "placed.tum").read_text().splitlines()) == 2 * len(heap) + 1
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
        "pick 0: a normal must be finite and not 0",
    ),
    ({"axis": (0, 0, 1)}, TypeError, r"axis must be \(point, direction\), three numbers each, got \(0, 0, 1\)"),
    ({"axis": ((0, 0, 0), (0, 1))}, surfrecon.InputError, r"the axis' direction must have shape \(3,\), got \(2,\)"),
    (
        {"axis": ((0, 0, 0), (0, 0, 0))},
        surfrecon.InputError,
        "the turntable's axis must have finite numbers and a direction that is not 0",
    ),
    ({"axis": ((0, np.nan, 0), (0, 0, 1))}, surfrecon.InputError, "the turntable's axis must have finite numbers"),
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


def test_one_scan_and_scaled_ones_are_refused(truth):
    with pytest.raises(surfrecon.InputError, match="at least two"):
        surfrecon.align(truth[:1])
    mesh = truth[0].triangulate()
    with pytest.raises(surfrecon.InputError, match="big.*scale"):
        surfrecon.align([truth[1], (mesh, np.diag([2.0, 2, 2, 1]), "big")])


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
