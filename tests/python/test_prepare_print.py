"""Preparing a print through Python and on the command line: closed, without crossings, and as asked for."""

import json

import numpy as np
import pytest
import surfrecon
from command_line import run
from shapes import torus


@pytest.fixture
def ball():
    """A ball of 1, round enough to be hollowed out."""
    return surfrecon.Mesh(*sphere(24))


def sphere(count):
    """A ball by latitudes and longitudes."""
    poles = [(0.0, 0.0, -1.0), (0.0, 0.0, 1.0)]
    turns = 2 * np.pi * np.arange(2 * count) / (2 * count)
    lifts = np.pi * np.arange(1, count) / count - np.pi / 2
    rings = [(np.cos(t) * np.cos(f), np.sin(t) * np.cos(f), np.sin(f)) for f in lifts for t in turns]
    n = 2 * count
    faces = []
    for k in range(n):
        faces.append((0, 2 + (k + 1) % n, 2 + k))
        faces.append((1, 2 + (count - 2) * n + k, 2 + (count - 2) * n + (k + 1) % n))
        for ring in range(count - 2):
            a, b = 2 + ring * n + k, 2 + ring * n + (k + 1) % n
            faces += [(a, b, a + n), (b, b + n, a + n)]
    # Multiples of the smallest step below 1 of single precision are not rounded.
    return np.round(np.array(poles + rings) * 2**24) / 2**24, np.array(faces)


def printable(mesh):
    """Whether a mesh is closed, and no faces cross."""
    report = surfrecon.check_print(mesh).report
    return report.is_closed and report.crossing_pairs == 0


def test_without_options_nothing_changes(ball):
    prepared = surfrecon.prepare_print(ball)
    assert np.array_equal(prepared.mesh.positions, ball.positions)
    assert np.array_equal(prepared.mesh.triangles, ball.triangles)
    assert prepared.report.scale == 1 and prepared.report.notes == [] and prepared.report.base_height is None
    assert repr(prepared) == "<Prepared 1 part>" and len(prepared.parts) == 1
    assert json.loads(prepared.report.json())["parts"] == 1


def test_all_steps_together(ball):
    prepared = surfrecon.prepare_print(ball, scale_to=100, flat_base=True, base_height=5, hollow=8, drain=6)
    report = prepared.report
    assert max(report.size) == pytest.approx(100) and report.size[2] == pytest.approx(95)
    assert report.is_drained and report.shut_cavities == 0 and printable(prepared.mesh)
    assert report.volume < 0.6 * report.volume_before * report.scale**3
    assert report.thinnest_wall == pytest.approx(8, abs=report.hollow_cell)
    added = np.asarray(prepared.mesh.face_attributes["added"]).astype(bool)
    assert added.sum() == report.added_faces > 0


def test_a_base_that_is_not_given_is_low_and_wide(ball):
    report = surfrecon.prepare_print(ball, flat_base=True).report
    assert 0.004 <= report.base_height <= 0.04 + 1e-12 and report.base_faces > 0
    standing = surfrecon.prepare_print(ball, flat_base=True).mesh
    assert surfrecon.prepare_print(standing, flat_base=True).report.base_height == 0


def test_parts_are_closed_and_fit(ball):
    prepared = surfrecon.prepare_print(ball, printer_height=0.9)
    parts = prepared.parts
    assert len(parts) == prepared.report.parts == 3
    for part in parts:
        assert printable(part) and np.ptp(part.positions[:, 2]) <= 0.9
    volume = sum(surfrecon.check_print(part).report.volume for part in parts)
    assert volume == pytest.approx(prepared.report.volume_before)


def test_what_can_not_be_printed_is_refused_with_the_remedy(ball):
    opened = surfrecon.Mesh(ball.positions, ball.triangles[1:])
    with pytest.raises(surfrecon.InputError, match="has 1 opening: close it first"):
        surfrecon.prepare_print(opened)
    with pytest.raises(surfrecon.InputError, match="flip its faces first"):
        surfrecon.prepare_print(surfrecon.Mesh(ball.positions, ball.triangles[:, ::-1]))
    with pytest.raises(surfrecon.SurfreconError, match="drain is given without hollow"):
        surfrecon.prepare_print(ball, flat_base=True, drain=0.1)
    with pytest.raises(surfrecon.SurfreconError, match="base_height is given without flat_base"):
        surfrecon.prepare_print(ball, base_height=0.1)
    with pytest.raises(surfrecon.SurfreconError, match="drain_sides is given without drain"):
        surfrecon.prepare_print(ball, drain_sides=8)
    within = surfrecon.Mesh(
        np.concatenate([ball.positions, 0.1 * ball.positions]),
        np.concatenate([ball.triangles, ball.triangles + len(ball.positions)]),
    )
    with pytest.raises(surfrecon.InputError, match="1 body lies in the solid of another, the first at"):
        surfrecon.prepare_print(within)


def test_a_job_does_the_same(ball):
    options = dict(flat_base=True, hollow=0.2)
    job = surfrecon.Job.prepare_print(ball, **options)
    expected = surfrecon.prepare_print(ball, threads=1, **options)
    found = job.result()
    assert np.array_equal(found.mesh.positions, expected.mesh.positions)
    assert np.array_equal(found.mesh.triangles, expected.mesh.triangles)


def test_it_is_cancelled(ball):
    with pytest.raises(surfrecon.Cancelled):
        surfrecon.prepare_print(ball, hollow=0.2, progress=lambda stage, fraction: False)


def test_the_command_writes_a_file_for_each_part(tmp_path, ball):
    torus(16).write(tmp_path / "ring.ply")
    ball.write(tmp_path / "ball.ply")
    one = run("prepare", tmp_path / "ring.ply", "-o", tmp_path / "one.stl", "--scale-to", "50", "--flat-base")
    assert one.returncode == 0, one.stderr
    (scan,) = surfrecon.open(tmp_path / "one.stl")
    assert np.ptp(scan.read().positions, axis=0).max() == pytest.approx(50, rel=1e-6)
    cut = run("prepare", tmp_path / "ball.ply", "-o", tmp_path / "cut.ply", "--printer-height", "1")
    assert cut.returncode == 0, cut.stderr
    assert "the parts are in 2 files" in cut.stdout + cut.stderr
    files = sorted(path.name for path in tmp_path.glob("cut*"))
    assert len(files) == 2
    for name in files:
        (scan,) = surfrecon.open(tmp_path / name)
        assert printable(scan.read())


def test_parts_of_an_earlier_run_are_named(tmp_path, ball):
    ball.write(tmp_path / "ball.ply")
    for height, older in (("0.7", ""), ("1", "cut-2-of-3.ply to cut-3-of-3.ply: of an earlier run")):
        done = run("prepare", "ball.ply", "-o", "cut.ply", "--printer-height", height, cwd=tmp_path)
        assert done.returncode == 0 and ("earlier run" in done.stderr + done.stdout) == bool(older)
        assert older in done.stderr + done.stdout
    options = ("--printer-height", "1", "--part-triangles", "9")
    done = run("prepare", "ball.ply", "-o", "cut.ply", *options, cwd=tmp_path)
    assert done.returncode == 2 and "leave out" in done.stderr, done.stderr
    assert "--scale-side" in run("prepare", "ball.ply", "-o", "a.ply", "--scale-side", "height", cwd=tmp_path).stderr


def test_the_command_refuses_points(tmp_path):
    (tmp_path / "points.xyz").write_text("0 0 0\n1 0 0\n0 1 0\n", "utf-8")
    done = run("prepare", tmp_path / "points.xyz", "-o", tmp_path / "out.stl")
    assert done.returncode != 0 and "give a closed mesh" in done.stderr
    assert not (tmp_path / "out.stl").exists()
