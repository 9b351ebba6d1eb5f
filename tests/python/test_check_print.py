"""Checks for printing through Python and on the command line: shapes whose faults are known."""

import json

import numpy as np
import pytest
import surfrecon
from command_line import run
from shapes import torus


def box(size=(1.0, 1.0, 1.0), at=(0.0, 0.0, 0.0)):
    """A closed box."""
    corners = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)], float) * size + at
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = [half for a, b, c, d in quads for half in ((a, b, c), (a, c, d))]
    return surfrecon.Mesh(corners, np.array(triangles))


def joined(*meshes):
    """Several meshes as one."""
    first = np.cumsum([0] + [len(mesh.positions) for mesh in meshes])
    triangles = [mesh.triangles + start for mesh, start in zip(meshes, first, strict=False)]
    return surfrecon.Mesh(np.vstack([mesh.positions for mesh in meshes]), np.vstack(triangles))


def kinds(checked):
    return [kind for kind, _ in checked.report.findings]


def marked(checked, name):
    return np.asarray(checked.mesh.face_attributes[name]).astype(bool)


def test_a_box_has_the_figures_of_a_box():
    checked = surfrecon.check_print(box((2, 3, 4)), min_wall=1.5, density=2)
    report = checked.report
    assert report.findings == [] and report.is_closed and report.is_manifold and report.parts == 1
    assert report.size == (2, 3, 4) and report.volume == pytest.approx(24) and report.weight == pytest.approx(48)
    assert report.thinnest_wall == pytest.approx(2) and report.is_fitting
    assert checked.crossings.shape == (0, 2) and checked.crossings.dtype == np.uint32
    assert repr(checked) == "<Checked 0 findings>"
    assert json.loads(report.json())["volume"] == report.volume


def test_crossing_faces_are_found_and_marked():
    checked = surfrecon.check_print(joined(box(), box(at=(0.5, 0.5, 0.5))))
    assert "crossing" in kinds(checked) and checked.report.parts == 2
    pairs = checked.crossings
    assert len(pairs) == checked.report.crossing_pairs > 0 and (pairs[:, 0] < pairs[:, 1]).all()
    assert np.array_equal(np.flatnonzero(marked(checked, "crossing")), np.unique(pairs))
    assert marked(checked, "crossing").sum() == checked.report.crossing_faces


def test_walls_are_measured_behind_each_face():
    plate = box((4, 4, 0.5))
    checked = surfrecon.check_print(plate, min_wall=0.8)
    assert kinds(checked) == ["thin"] and checked.report.thinnest_wall == pytest.approx(0.5)
    wall = checked.mesh.face_attributes["wall"]
    assert wall.dtype == np.float32 and wall[checked.report.thinnest_face] == pytest.approx(0.5)
    assert (wall < 0.8).sum() == checked.report.thin_faces
    # Nothing lies behind a lone face: its wall is as long as the diagonal.
    lone = surfrecon.check_print(surfrecon.Mesh([(0, 0, 0), (3, 0, 0), (0, 4, 0)], [(0, 1, 2)]))
    assert lone.report.thinnest_wall is None and lone.report.thinnest_face is None
    assert lone.mesh.face_attributes["wall"] == pytest.approx([5])


def test_overhangs_depend_on_the_direction_up():
    # A table: its plate hangs over, its leg stands.
    table = joined(box((0.2, 0.2, 1)), box((2, 2, 0.2), at=(-0.9, -0.9, 1.1)))
    checked = surfrecon.check_print(table)
    assert checked.report.overhang_area == pytest.approx(4)
    assert marked(checked, "overhang").sum() == checked.report.overhang_faces == 2
    assert surfrecon.check_print(box(), print_up="minus_z").report.overhang_faces == 0
    assert surfrecon.check_print(table, overhang=np.pi / 2).report.overhang_faces == 0


def test_it_must_fit_into_the_printer():
    mesh = box((2, 4, 1))
    assert surfrecon.check_print(mesh, printer_width=4, printer_depth=2, printer_height=1).report.is_fitting
    checked = surfrecon.check_print(mesh, printer_width=3, printer_depth=3)
    assert not checked.report.is_fitting and kinds(checked) == ["too_large"]
    assert "2 x 4 x 1 and does not fit into the printer of 3 x 3" in checked.report.findings[0][1]


def test_what_bounds_no_body_is_said_with_what_to_do():
    whole = torus(16)
    opened = surfrecon.check_print(surfrecon.Mesh(whole.positions, whole.triangles[1:]))
    assert opened.report.findings[0] == ("open", "Openings of the mesh: 1. Close them.")
    assert opened.report.volume is None and opened.report.open_edges == 3
    turned = surfrecon.check_print(surfrecon.Mesh(whole.positions, whole.triangles[:, ::-1]))
    assert "inside_out" in kinds(turned) and turned.report.volume < 0
    twice = surfrecon.check_print(surfrecon.Mesh(whole.positions, np.vstack([whole.triangles, whole.triangles[:1]])))
    assert kinds(twice)[0] == "not_manifold" and not twice.report.is_manifold


def test_other_attributes_stay_and_threads_change_nothing():
    mesh = torus(16)
    mesh = surfrecon.check_print(mesh).mesh
    again = surfrecon.check_print(mesh, threads=1)
    assert sorted(again.mesh.face_attributes) == ["crossing", "overhang", "wall"]
    assert np.array_equal(again.mesh.face_attributes["wall"], mesh.face_attributes["wall"])
    job = surfrecon.Job.check_print(mesh)
    assert job.result().report.volume == again.report.volume


def test_messages():
    with pytest.raises(surfrecon.ParameterError, match="min_wall"):
        surfrecon.check_print(box(), min_wall=-1)
    with pytest.raises(surfrecon.ParameterError, match="overhang"):
        surfrecon.check_print(box(), overhang=2)
    with pytest.raises(TypeError, match="mesh"):
        surfrecon.check_print([1, 2])
    with pytest.raises(surfrecon.Cancelled):
        surfrecon.check_print(torus(100), progress=lambda *_: False)


def test_the_command_lists_findings_and_ends_well(tmp_path):
    joined(box(), box(at=(0.5, 0.5, 0.5))).write(tmp_path / "two.ply")
    done = run("check", "two.ply", "--min-wall", "0.01", "--report", "report.json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "Pairs of faces that cross: " in done.stdout and "Move or remove these faces." in done.stdout
    assert json.loads((tmp_path / "report.json").read_text())["command"] == "check"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["report.json", "two.ply"]
    box().write(tmp_path / "box.stl")
    done = run("check", "box.stl", "-o", "marked.ply", cwd=tmp_path)
    assert done.returncode == 0 and "nothing is in the way of printing" in done.stdout
    header = (tmp_path / "marked.ply").read_bytes().split(b"end_header")[0]
    assert b"property float wall" in header and b"property uchar crossing" in header
    surfrecon.virtual_scan(torus(16), surfrecon.turntable(torus(16), pixels=40))[0].write(tmp_path / "scan.ply")
    done = run("check", "scan.ply", cwd=tmp_path)
    assert done.returncode == 1 and "give a mesh" in done.stderr
