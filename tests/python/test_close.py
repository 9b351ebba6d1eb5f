"""Closing through Python: a surface with openings in, and nothing filled where a scan saw that nothing is."""

import json

import numpy as np
import pytest
import surfrecon
from command_line import run


@pytest.fixture(scope="module")
def shape():
    """A closed shape."""
    return surfrecon.sculpture(cell=6)


@pytest.fixture(scope="module")
def scans(shape):
    """Scans of it from around, none from below."""
    scans = surfrecon.virtual_scan(shape, surfrecon.turntable(shape, pixels=120, height_angle=0.6))
    for number, scan in enumerate(scans):
        scan.name = f"view{number}"
    return scans


@pytest.fixture(scope="module")
def merged(scans):
    """Their surface, with all its openings."""
    mesh = surfrecon.merge(scans, max_hole_length=0).mesh
    assert mesh.check()["boundary_loops"] > 0
    return mesh


@pytest.fixture(scope="module")
def closed(merged, scans):
    return surfrecon.close(merged, scans, flat_base=True)


def test_what_was_measured_stays_and_the_fill_is_marked(closed, merged):
    mesh, vertices, faces = closed.mesh, len(merged.positions), len(merged.triangles)
    assert np.array_equal(mesh.positions[:vertices], merged.positions)
    assert np.array_equal(mesh.triangles[:faces], merged.triangles)
    filled = np.asarray(mesh.face_attributes["hole_fill"]).astype(bool)
    assert not filled[:faces].any() and filled[faces:].all()
    assert np.asarray(mesh.vertex_attributes["interpolated"]).astype(bool)[vertices:].all()
    assert closed.report.added == (len(mesh.positions) - vertices, len(mesh.triangles) - faces)
    assert mesh.check()["is_manifold"]


def test_the_report_says_what_is_closed_and_what_is_open(closed):
    report, check = closed.report, closed.mesh.check()
    assert report.is_closed == check["is_closed"]
    assert (report.open_edges == 0) == report.is_closed
    assert report.closed > 0 and report.has_sight and 0 < report.filled_share < 0.5
    assert sum(report.left) == len(report.open)
    assert json.loads(report.json())["closed"] == report.closed


def test_nothing_is_filled_where_a_scan_saw_through(closed, merged, scans):
    assert not any_seen_through(closed, merged, scans)
    # The judge is not blind: it sees places half way to what a scan measured.
    samples = scans[0].world_points()[scans[0].valid]
    assert seen_through(scans[0], (samples + scans[0].sensor) / 2, closed.report.cell).mean() > 0.5


def any_seen_through(closed, merged, scans):
    """A judge of its own: of each filled face's centre, whether all of 3 x 3 pixels of a scan lie behind it."""
    centres = closed.mesh.positions[closed.mesh.triangles[len(merged.triangles) :]].mean(axis=1)
    slack = closed.report.merge_distance + closed.report.cell
    return any(seen_through(scan, centres, slack).any() for scan in scans)


def seen_through(scan, places, slack):
    """Whether a pinhole image saw past places, by more than `slack`, in 3 x 3 pixels."""
    at = (places - scan.world_from_sensor[:3, 3]) @ scan.world_from_sensor[:3, :3]
    depths = np.where(scan.valid, scan.points[..., 2], np.nan)
    focal, centre = np.array(scan.projection["focal"]), np.array(scan.projection["centre"])
    with np.errstate(divide="ignore", invalid="ignore"):
        pixel = np.round(at[:, :2] / at[:, 2:] * focal + centre).astype(int)
    inside = (at[:, 2] > 0) & ((pixel > 0) & (pixel < [scan.cols - 1, scan.rows - 1])).all(axis=1)
    past = inside.copy()
    for row in (-1, 0, 1):
        for col in (-1, 0, 1):
            depth = depths[pixel[inside, 1] + row, pixel[inside, 0] + col]
            past[inside] &= depth > at[inside, 2] + slack
    return past


def test_without_scans_the_shape_alone_decides(merged):
    closed = surfrecon.close(merged)
    assert not closed.report.has_sight and closed.report.closed > 0


def test_openings_may_stay(merged, scans):
    none = surfrecon.close(merged, scans, openings="none")
    assert len(none.mesh.positions) == len(merged.positions) and none.report.left[0] == len(none.report.open) > 0
    kind, text = none.report.open[0]
    assert kind == "not_asked" and "choose all, seen or holes" in text


def test_the_same_bytes_for_any_order_and_number_of_threads(closed, merged, scans):
    other = surfrecon.close(merged, scans[::-1], flat_base=True, threads=1)
    assert np.array_equal(other.mesh.positions, closed.mesh.positions)
    assert np.array_equal(other.mesh.triangles, closed.mesh.triangles)


def test_messages(merged, scans, shape):
    with pytest.raises(surfrecon.ParameterError, match='openings must be "all", "seen", "holes" or "none"'):
        surfrecon.close(merged, openings="most")
    with pytest.raises(TypeError, match="mesh"):
        surfrecon.close(scans[0])
    twice = surfrecon.Mesh(merged.positions, np.vstack([merged.triangles, merged.triangles[:1]]))
    with pytest.raises(surfrecon.InputError, match="manifold"):
        surfrecon.close(twice)
    with pytest.raises(surfrecon.Cancelled):
        surfrecon.close(merged, scans, progress=lambda *_: False)


def test_jobs(merged, scans, closed):
    job = surfrecon.Job.close(merged, scans, flat_base=True)
    assert np.array_equal(job.result().mesh.positions, closed.mesh.positions)


def test_the_command(merged, scans, closed, tmp_path):
    merged.write(tmp_path / "surface.ply", encoding="binary_double")
    surfrecon.write_scans(tmp_path / "placed.conf", scans)
    done = run("close", "surface.ply", "placed.conf", "-o", "closed.ply", "--flat-base", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "openings closed" in done.stdout + done.stderr
    made = surfrecon.read(tmp_path / "closed.ply")
    assert made.check()["boundary_loops"] <= closed.mesh.check()["boundary_loops"] + 2
    scans[0].write(tmp_path / "one.ply")
    done = run("close", "one.ply", "-o", "other.ply", cwd=tmp_path)
    assert done.returncode != 0 and "give the surface first" in done.stderr


def test_a_merge_closes_its_surface(scans, merged, tmp_path):
    result = surfrecon.merge(scans, close="all", flat_base=True)
    report = result.report
    after = surfrecon.close(merged, scans, cell=report.voxel, merge_distance=report.merge_distance, flat_base=True)
    assert np.array_equal(result.mesh.positions, after.mesh.positions)
    assert np.array_equal(result.mesh.triangles, after.mesh.triangles)
    assert report.filled_share == after.report.filled_share and report.holes[0] == after.report.closed
    assert not any_seen_through(after, merged, scans)
    # The same bytes from files, and from the command line.
    surfrecon.write_scans(tmp_path / "scans.e57", scans)
    options = {"voxel": report.voxel, "close": "all", "flat_base": True}
    surfrecon.merge_to_file(
        surfrecon.open(tmp_path / "scans.e57"), tmp_path / "files.ply", workspace=tmp_path, **options
    )
    surfrecon.merge(surfrecon.open(tmp_path / "scans.e57"), **options).mesh.write(tmp_path / "memory.ply")
    voxel = repr(report.voxel)
    run("merge", tmp_path / "scans.e57", "-o", tmp_path / "line.ply", "--voxel", voxel, "--close", "all", "--flat-base")
    files, memory = ((tmp_path / f"{name}.ply").read_bytes() for name in ("files", "memory"))
    # The command line notes besides how it was made.
    line, read = (surfrecon.read(tmp_path / f"{name}.ply") for name in ("line", "memory"))
    assert files == memory and np.array_equal(line.positions, read.positions)
    assert np.array_equal(line.triangles, read.triangles)


def test_a_merge_leaves_all_open_or_only_what_was_seen_through(scans, merged):
    assert np.array_equal(surfrecon.merge(scans, close="none").mesh.triangles, merged.triangles)
    holes = surfrecon.merge(scans, max_hole_length=1e4).report
    assert holes.filled_area is None and holes.holes_seen_through <= holes.holes[1] < len(merged.triangles)
    with pytest.raises(ValueError, match='close must be "all", "seen", "holes" or "none"'):
        surfrecon.merge(scans, close="some")


def test_a_merge_refuses_options_without_use(scans):
    with pytest.raises(
        surfrecon.InputError, match="flat_base is given, but has no use unless more than holes is closed"
    ):
        surfrecon.merge(scans, close="holes", flat_base=True)
    with pytest.raises(surfrecon.InputError, match="base_up is given without flat_base"):
        surfrecon.merge(scans, close="all", base_up="y")


def test_a_surface_that_is_inside_out_is_in_the_report(merged):
    turned = surfrecon.Mesh(merged.positions, merged.triangles[:, ::-1])
    assert surfrecon.close(merged).report.warnings == []
    assert [kind for kind, _ in surfrecon.close(turned).report.warnings] == ["looks_inward"]
