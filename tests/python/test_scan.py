"""The virtual scanner through Python."""

import time

import numpy as np
import pytest
import surfrecon
from shapes import torus, torus_distance, torus_scans


def test_scans_lie_on_the_shape():
    for scan in torus_scans():
        distance = torus_distance(scan.world_points()[scan.valid])
        assert scan.valid.any()
        # The mesh's chords run at most this far from the torus.
        assert np.abs(distance).max() < 0.002


def test_noise_and_wrong_poses_are_what_was_asked_for():
    exact, noisy = torus_scans(), torus_scans(noise=0.01, seed=5)
    for a, b in zip(exact, noisy, strict=True):
        both = a.valid & b.valid
        assert np.std((b.values - a.values)[both]) == pytest.approx(0.01, rel=0.1)
        assert np.array_equal(a.world_from_sensor, b.world_from_sensor)
    shifted = torus_scans(pose_shift=0.01)
    assert not np.array_equal(exact[0].world_from_sensor, shifted[0].world_from_sensor)
    errors = [b.world_from_sensor[:3, 3] - a.world_from_sensor[:3, 3] for a, b in zip(exact, shifted, strict=True)]
    assert 0.003 < np.std(errors) < 0.03


def test_a_scan_is_the_same_for_any_number_of_threads_and_one_camera():
    mesh = torus()
    cameras = surfrecon.turntable(mesh, pixels=50)
    several = surfrecon.virtual_scan(mesh, cameras, noise=0.01, seed=3, threads=1)
    one = surfrecon.virtual_scan(mesh, cameras[2], noise=0.01, seed=5, threads=2)
    assert np.array_equal(several[2].values, one.values, equal_nan=True)


def test_cameras_see_what_they_look_at():
    mesh = torus()
    for camera in (
        surfrecon.Camera.orthographic(40, 60, spacing=0.05, target=(0, 0, 0), toward=(0, 0, -1), up=(0, 1, 0)),
        surfrecon.Camera.pinhole(40, 60, height_angle=0.9, eye=(0, 0, 4), target=(0, 0, 0), up=(0, 1, 0)),
        surfrecon.Camera.spherical(40, 60, lowest=-1, highest=1, eye=(0, 0, 0.1)),
    ):
        assert (camera.rows, camera.cols) == (40, 60)
        image = surfrecon.virtual_scan(mesh, camera)
        assert image.valid.any() and np.array_equal(image.world_from_sensor, camera.world_from_sensor)


def test_vectors_may_be_tuples_lists_or_arrays():
    cameras = [
        surfrecon.Camera.pinhole(
            4, 4, height_angle=0.9, eye=kind((3, 0, 4)), target=kind((0, 0, 0)), up=kind((0, 1, 0))
        )
        for kind in (tuple, list, np.array)
    ]
    assert all((camera.world_from_sensor == cameras[0].world_from_sensor).all() for camera in cameras)
    with pytest.raises(surfrecon.InputError, match="target must have shape"):
        surfrecon.Camera.pinhole(4, 4, height_angle=0.9, eye=(3, 0, 4), target=(0, 0))


def test_the_triangulated_scan_keeps_its_grid():
    scan = torus_scans(pixels=60)[0]
    mesh = scan.triangulate()
    row, column = mesh.vertex_attributes["range_row"], mesh.vertex_attributes["range_col"]
    assert np.array_equal(mesh.positions, scan.points[row, column])
    assert scan.valid[row, column].all()
    check = mesh.check()
    assert check["is_manifold"] and not check["is_closed"] and check["triangles"] == len(mesh.triangles)


def test_check_knows_a_torus():
    check = torus().check()
    assert check["is_closed"] and check["genus"] == 1 and check["components"] == 1


def test_bad_scanners_are_refused():
    mesh = torus()
    with pytest.raises(surfrecon.ParameterError, match="noise must be .* >= 0, got -1"):
        surfrecon.virtual_scan(mesh, surfrecon.turntable(mesh, pixels=10), noise=-1)
    with pytest.raises(surfrecon.InputError, match="spacing must be > 0, got 0"):
        surfrecon.Camera.orthographic(4, 4, spacing=0, target=(0, 0, 0), toward=(0, 0, -1))
    with pytest.raises(surfrecon.InputError, match="no vertices"):
        surfrecon.turntable(surfrecon.Mesh(np.zeros((0, 3)), np.zeros((0, 3), int)))
    with pytest.raises(TypeError):
        surfrecon.virtual_scan(mesh, [3])


def test_no_camera_follows_a_cancel_that_came_as_the_one_before_was_done():
    mesh = surfrecon.sculpture(cell=4.0)

    def asked_at(pixels):
        """The share that was done when the cancel was asked for."""
        cameras = surfrecon.turntable(mesh, around=3, above=0, below=0, pixels=pixels)
        answered = []

        def late(stage, fraction):
            if fraction > 0 and not answered:
                # Meanwhile the first image is made, and nobody looks any more whether to go on with it.
                time.sleep(2.0)
                answered.append(fraction)
                return False
            return True

        with pytest.raises(surfrecon.Cancelled):
            surfrecon.virtual_scan(mesh, cameras, threads=1, progress=late)
        return answered[0]

    # On a fast or a busy machine the first image may be done before anybody is asked.
    assert any(asked_at(pixels) < 1 / 3 for pixels in (1000, 1000, 2000, 4000))


def test_scanning_reports_and_cancels():
    mesh = torus(200)
    cameras = surfrecon.turntable(mesh, pixels=1000)
    seen = []
    surfrecon.virtual_scan(mesh, cameras, progress=lambda stage, share: seen.append(share))
    assert seen and seen == sorted(seen) and seen[0] >= 0 and seen[-1] <= 1
    calls = []
    with pytest.raises(surfrecon.Cancelled):
        surfrecon.virtual_scan(mesh, cameras, progress=lambda stage, share: calls.append(share) or False)
    assert len(calls) == 1


def test_the_sculpture_is_closed_and_coloured():
    mesh = surfrecon.sculpture(cell=6)
    assert mesh.check()["is_closed"] and "colour" in mesh.vertex_attributes
    with pytest.raises(surfrecon.InputError, match="cell must be"):
        surfrecon.sculpture(cell=0.1)


def test_a_camera_by_its_intrinsics_is_the_same_camera():
    known = surfrecon.Camera.pinhole(60, 80, height_angle=0.6, eye=(3, 0, 2), target=(0, 0, 0))
    focal = 29.5 / np.tan(0.3)
    made = surfrecon.Camera.intrinsic(
        60, 80, focal=(focal, focal), centre=(39.5, 29.5), world_from_sensor=known.world_from_sensor
    )
    one, other = (surfrecon.virtual_scan(torus(), camera).points for camera in (known, made))
    assert np.allclose(one, other, equal_nan=True)
    with pytest.raises(surfrecon.InputError, match="world_from_sensor"):
        surfrecon.Camera.intrinsic(9, 9, focal=(9, 9), centre=(4, 4), world_from_sensor=2 * np.eye(4))


def test_jobs_scan_and_read_the_same(tmp_path):
    cameras = surfrecon.turntable(torus(), pixels=60)
    direct = surfrecon.virtual_scan(torus(), cameras, noise=0.01, seed=4)
    job = surfrecon.Job.virtual_scan(torus(), cameras, noise=0.01, seed=4)
    seen = []
    while not job.done():
        seen.append(job.progress()[1])
    assert seen == sorted(seen)
    for one, other in zip(direct, job.result(), strict=True):
        assert np.array_equal(one.points, other.points, equal_nan=True)
    one = surfrecon.Job.virtual_scan(torus(), cameras[0]).result()
    assert isinstance(one, surfrecon.RangeImage)
    with pytest.raises(surfrecon.ParameterError, match="noise"):
        surfrecon.Job.virtual_scan(torus(), cameras, noise=-1)

    for k, image in enumerate(direct):
        image.name = f"scan{k:02}"
    surfrecon.write_scans(tmp_path / "set.conf", direct)
    scans = surfrecon.open(tmp_path / "set.conf")
    for scan, read in zip(scans, surfrecon.Job.read(list(scans)).result(), strict=True):
        assert np.array_equal(scan.read().points, read.points, equal_nan=True)
    (tmp_path / "scan03.ply").write_text("ply")
    with pytest.raises(surfrecon.SurfreconError, match=r"scan03\.ply"):
        surfrecon.Job.read(list(scans)).result()
    job = surfrecon.Job.read(list(scans))
    job.cancel()
    with pytest.raises(surfrecon.SurfreconError):
        job.result()
