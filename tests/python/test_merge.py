"""The merge through Python: inputs, progress, cancelling, the interpreter lock, jobs."""

import gc
import os
import re
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest
import surfrecon
from shapes import torus, torus_distance, torus_scans
from system import resident

VOXEL = 0.06


@pytest.fixture(scope="module")
def images():
    return torus_scans(pixels=90, noise=0.001, pose_shift=0.001)


@pytest.fixture(scope="module")
def many():
    """Enough work to watch: about a second."""
    return torus_scans(pixels=700)


def same(a, b):
    return np.array_equal(a.positions, b.positions) and np.array_equal(a.triangles, b.triangles)


def test_the_surface_is_the_torus(images):
    result = surfrecon.merge(images, voxel=VOXEL)
    check = result.mesh.check()
    assert check["is_manifold"] and check["components"] == 1 and check["genus"] == 1
    distance = np.abs(torus_distance(result.mesh.positions))
    assert np.quantile(distance, 0.99) < 0.01 and distance.max() < VOXEL
    report = result.report
    assert report.scans == len(images) and report.voxel == VOXEL and sum(report.faces) == len(result.mesh.triangles)
    assert report.as_dict() == dict(report)


def test_a_result_comes_back_from_a_file(images, tmp_path):
    mesh = surfrecon.merge(images, voxel=VOXEL).mesh
    mesh.write(tmp_path / "merged.ply")
    back = surfrecon.read(tmp_path / "merged.ply")
    assert np.array_equal(back.positions.astype(np.float32), mesh.positions.astype(np.float32))
    assert np.array_equal(back.triangles, mesh.triangles)
    for kind in ("vertex_attributes", "face_attributes"):
        before, after = getattr(mesh, kind), getattr(back, kind)
        assert before.keys() == after.keys() and len(before) > 0
        assert all(np.array_equal(before[name], after[name]) for name in before)


def test_any_mixture_and_order_of_sources_makes_the_same_surface(images, tmp_path):
    surfrecon.write_scans(tmp_path / "ring.conf", images)
    scans = surfrecon.open(tmp_path / "ring.conf")
    from_set = surfrecon.merge(scans, voxel=VOXEL).mesh
    read = [scan.read() for scan in scans]
    assert same(surfrecon.merge(read, voxel=VOXEL).mesh, from_set)
    mixed = [scan if k % 2 else image for k, (scan, image) in enumerate(zip(scans, read, strict=True))]
    assert same(surfrecon.merge(mixed[::-1], voxel=VOXEL, threads=1).mesh, from_set)


def test_scans_of_other_exposures_are_made_equally_bright_and_one_without_colours_takes_none_away():
    images = torus_scans(pixels=90)
    greys = [120 + 10 * k for k in range(len(images) - 1)]
    for image, grey in zip(images, greys, strict=False):
        image.colour = np.full((image.rows, image.cols, 3), grey, np.uint8)
    assert images[-1].colour is None
    result = surfrecon.merge(images, voxel=VOXEL)
    colours = result.mesh.vertex_attributes["colour"]
    seen = colours[:, 3] > 0
    assert seen.mean() > 0.8 and np.ptp(colours[seen, :3].astype(int)) <= 4
    gains = np.array(result.report.colour_gains)
    light = surfrecon.linear_colours(np.array([[grey] * 3 + [255] for grey in greys], np.uint8)).reshape(-1, 4)[:, 0]
    assert gains.shape == (len(images), 3) and (gains[-1] == 1).all()
    assert np.allclose(gains[:-1, 0] * light, np.mean(gains[:-1, 0] * light), rtol=0.02)
    as_they_are = surfrecon.merge(images, voxel=VOXEL, match_exposure=False)
    assert as_they_are.report.colour_gains == []
    assert np.ptp(as_they_are.mesh.vertex_attributes["colour"][:, :3].astype(int)) > 30


def test_meshes_are_placed_by_their_matrices():
    mesh = torus()
    moved = np.eye(4)
    moved[:3, 3] = (10, 20, 30)
    made = surfrecon.merge([(mesh, moved)], voxel=0.05).mesh
    for extreme in (np.min, np.max):
        assert np.allclose(extreme(made.positions, 0), extreme(mesh.positions, 0) + (10, 20, 30), atol=0.02)
    # Mirroring turns triangles around; the surface's outside stays outside.
    mirrored = surfrecon.merge([(mesh, np.diag([-1.0, 1, 1, 1]), "mirrored")], voxel=0.05).mesh
    for surface in (made, mirrored):
        assert surface.check()["is_closed"]
        assert volume(surface) == pytest.approx(volume(mesh), rel=0.01)


def volume(mesh):
    a, b, c = (mesh.positions[mesh.triangles[:, i]] for i in range(3))
    return np.einsum("ij,ij->", a, np.cross(b, c)) / 6


def test_progress_runs_on_the_calling_thread_and_rises(many):
    ticks = []
    surfrecon.merge(many, progress=lambda stage, share: ticks.append((threading.get_ident(), stage, share)))
    shares = [share for _, _, share in ticks]
    assert {thread for thread, _, _ in ticks} == {threading.get_ident()}
    assert shares == sorted(shares) and shares[0] >= 0 and shares[-1] <= 1
    assert all(stage for _, stage, _ in ticks)


def test_other_threads_run_meanwhile(many):
    stop, ticks = threading.Event(), []

    def tick():
        while not stop.wait(0.001):
            ticks.append(time.monotonic())

    thread = threading.Thread(target=tick)
    thread.start()
    start = time.monotonic()
    surfrecon.merge(many, voxel=0.004)
    end = time.monotonic()
    stop.set()
    thread.join()
    times = [start, *(t for t in ticks if start < t < end), end]
    # With the lock held this would be the whole call.
    assert max(np.diff(times)) < 0.3 * (end - start)


def test_cancelling_at_every_tick_raises_and_leaves_nothing(many):
    surfrecon.merge(many, voxel=0.004)
    gc.collect()
    before = resident()
    cancelled = 0
    for limit in range(8):
        # Asked once more after it said no, it would raise StopIteration.
        answers = iter([None] * limit + [False])
        try:
            surfrecon.merge(many, voxel=0.004, progress=lambda *_, answers=answers: next(answers))
        except surfrecon.Cancelled:
            cancelled += 1
    # How many are asked that late depends on the machine; the first always is.
    assert cancelled >= 1
    gc.collect()
    # A leak of one call would show: a finished one holds tens of megabytes.
    assert resident() - before < 200e6


def test_cancelling_answers_at_once(many):
    cancelled = []

    def cancel(*_):
        cancelled.append(time.monotonic())
        return False

    with pytest.raises(surfrecon.Cancelled):
        surfrecon.merge(many, voxel=0.002, progress=cancel)
    assert time.monotonic() - cancelled[0] < 0.5


def test_an_exception_of_the_callback_comes_out(many):
    with pytest.raises(ZeroDivisionError):
        surfrecon.merge(many, progress=lambda *_: 1 / 0)


@pytest.mark.skipif(sys.platform == "win32", reason="signals differ")
def test_ctrl_c_cancels():
    script = """
import os, signal, sys
sys.path.insert(0, sys.argv[1])
import surfrecon
from shapes import torus_scans
scans = torus_scans(pixels=400)
# A shell that runs things in the background has them ignore it.
signal.signal(signal.SIGINT, signal.default_int_handler)
def interrupt(stage, fraction):
    os.kill(os.getpid(), signal.SIGINT)
try:
    surfrecon.merge(scans, voxel=0.002, progress=interrupt)
except KeyboardInterrupt:
    sys.exit(42)
"""
    command = [sys.executable, "-c", script, os.path.dirname(__file__)]
    assert subprocess.run(command, timeout=60, check=False).returncode == 42
    assert signal.getsignal(signal.SIGINT) is not None


def test_a_job_makes_the_same_surface(images):
    job = surfrecon.Job.merge(images, voxel=VOXEL)
    shares = []
    while not job.done():
        stage, share = job.progress()
        shares.append(share)
        time.sleep(0.001)
    assert shares == sorted(shares)
    result = job.result()
    assert same(result.mesh, surfrecon.merge(images, voxel=VOXEL).mesh)
    with pytest.raises(RuntimeError, match="already fetched"):
        job.result()


def test_a_job_cancels_at_once(many):
    job = surfrecon.Job.merge(many, voxel=0.002)
    time.sleep(0.05)
    start = time.monotonic()
    job.cancel()
    with pytest.raises(surfrecon.Cancelled):
        job.result()
    assert time.monotonic() - start < 0.5


def test_a_merge_that_measures_is_one_call(images):
    plain = surfrecon.merge(images, voxel=0.06)
    assert plain.distances is None
    ticks = []
    measured = surfrecon.merge(images, voxel=0.06, measure=True, progress=lambda *tick: ticks.append(tick))
    assert np.array_equal(measured.mesh.positions, plain.mesh.positions)
    # To what the merge itself made of the scans.
    expected = surfrecon.distances(plain.mesh.positions, images)
    assert np.array_equal(measured.distances, expected)
    shares = [share for _, share in ticks]
    assert shares == sorted(shares)
    job = surfrecon.Job.merge(images, voxel=0.06, measure=True)
    seen = []
    while not job.done():
        seen.append(job.progress()[1])
    assert seen == sorted(seen)
    assert np.array_equal(job.result().distances, expected)


def test_a_merge_is_cancelled_also_while_it_measures(images):
    job = surfrecon.Job.merge(images, voxel=0.02, measure=True)
    while not job.done() and job.progress()[0] not in {"reading the scans", "measuring"}:
        pass
    job.cancel()
    with pytest.raises(surfrecon.Cancelled):
        job.result()


def test_a_dropped_job_stops(many):
    job = surfrecon.Job.merge(many, voxel=0.002)
    time.sleep(0.02)
    del job
    deadline = time.monotonic() + 5
    while any("surfrecon-job" in name for name in thread_names()):
        assert time.monotonic() < deadline
        time.sleep(0.02)


def thread_names():
    names = []
    for thread in os.listdir("/proc/self/task"):
        try:
            with open(f"/proc/self/task/{thread}/comm") as comm:
                names.append(comm.read().strip())
        except FileNotFoundError:
            pass
    return names


def test_errors_of_a_job_come_with_its_result(tmp_path):
    surfrecon.write_scans(tmp_path / "ring.conf", torus_scans(pixels=20))
    scans = surfrecon.open(tmp_path / "ring.conf")
    (tmp_path / "scan03.ply").unlink()
    with pytest.raises(surfrecon.FileError, match="scan03"):
        surfrecon.Job.merge(scans).result()
    with pytest.raises(surfrecon.ParameterError, match=re.escape("voxel must be a finite number > 0, got -1")):
        surfrecon.Job.merge(scans, voxel=-1)


def test_changing_an_image_does_not_change_a_running_job(images):
    expected = surfrecon.merge(images, voxel=VOXEL).mesh
    image = images[0]
    pose = image.world_from_sensor
    job = surfrecon.Job.merge(images, voxel=VOXEL)
    image.world_from_sensor = np.eye(4)
    try:
        assert same(job.result().mesh, expected)
    finally:
        image.world_from_sensor = pose


def test_nothing_to_merge():
    with pytest.raises(surfrecon.InputError):
        surfrecon.merge([])


def test_scans_that_do_not_fit_are_told_of():
    """A corner seen from one place, and the same image moved, or never placed."""
    row, col = np.mgrid[0:40, 0:50]

    def seen(name, depth, shift=(0, 0, 0)):
        image = surfrecon.RangeImage.pinhole(depth, focal=(60, 60), centre=(25, 20), name=name)
        image.world_from_sensor = np.block([[np.eye(3), np.reshape(shift, (3, 1))], [np.zeros((1, 3)), 1]])
        return image

    corner = 2 + 0.01 * np.abs(col - 25.0) + 0.004 * row
    fits = surfrecon.merge([seen("a", corner), seen("b", corner, (0, 0, 1e-9))]).report
    assert fits.warnings == []
    [(kind, text)] = surfrecon.merge([seen("a", corner), seen("b", corner)]).report.warnings
    assert kind == "no_poses" and "stand at one place. Unless the camera stood still, align them first" in text
    [(kind, text)] = surfrecon.merge([seen("a", corner), seen("b", corner + 0.2)]).report.warnings
    assert kind == "no_poses" and text.startswith("no scan has a pose: all 2 stand at one place")
    [(kind, text)] = surfrecon.merge([seen("a", corner), seen("b", corner, (0, 0, 0.2))]).report.warnings
    assert kind == "apart" and "align them first" in text
