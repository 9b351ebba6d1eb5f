"""Checks for printing through Python and on the command line: shapes whose faults are known."""

import itertools
import json
import random
from fractions import Fraction

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
    checked = surfrecon.check_print(box((2, 3, 4)), min_wall=1.5, max_wall=3, density=2)
    report = checked.report
    assert report.findings == [] and report.is_closed and report.is_manifold and report.bodies == 1
    assert report.size == (2, 3, 4) and report.volume == pytest.approx(24) and report.weight == pytest.approx(48)
    assert report.thinnest_wall == pytest.approx(2) and report.is_fitting
    assert checked.crossings.shape == (0, 2) and checked.crossings.dtype == np.uint32
    assert repr(checked) == "<Checked 0 findings>"
    assert json.loads(report.json())["volume"] == report.volume


def test_crossing_faces_are_found_and_marked():
    checked = surfrecon.check_print(joined(box(), box(at=(0.5, 0.5, 0.5))))
    assert "crossing" in kinds(checked) and checked.report.bodies == 2
    pairs = checked.crossings
    assert len(pairs) == checked.report.crossing_pairs > 0 and (pairs[:, 0] < pairs[:, 1]).all()
    assert np.array_equal(np.flatnonzero(marked(checked, "crossing")), np.unique(pairs))
    assert marked(checked, "crossing").sum() == checked.report.crossing_faces


def minus(a, b):
    return [x - y for x, y in zip(a, b, strict=True)]


def dot(a, b):
    return sum(x * y for x, y in zip(a, b, strict=True))


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def common_part(p, q, t):
    """The ends of what a segment has in common with a triangle, without rounding."""
    normal = cross(minus(t[1], t[0]), minus(t[2], t[0]))
    bounds = [(dot(minus(p, t[0]), normal), dot(minus(q, t[0]), normal))]
    bounds += [(-a, -b) for a, b in bounds]
    for a, b in ((0, 1), (1, 2), (2, 0)):
        inward = cross(normal, minus(t[b], t[a]))
        bounds.append((dot(minus(p, t[a]), inward), dot(minus(q, t[a]), inward)))
    first, last = Fraction(0), Fraction(1)
    for a, b in bounds:
        if a == b and a < 0:
            return []
        if b > a:
            first = max(first, a / (a - b))
        elif b < a:
            last = min(last, a / (a - b))
    return [[x + (y - x) * u for x, y in zip(p, q, strict=True)] for u in (first, last)] if first <= last else []


def crosses(s, t):
    """Whether two triangles of fractions have points in common that are not those of a shared corner or edge."""
    if any(not any(cross(minus(u[1], u[0]), minus(u[2], u[0]))) for u in (s, t)):
        return False
    shared = [corner for corner in s if corner in t]
    if len(shared) == 3:
        return True
    sides = [(a[i - 1], a[i], b) for a, b in ((s, t), (t, s)) for i in range(3)]
    for point in itertools.chain.from_iterable(common_part(*side) for side in sides):
        if not shared or any(cross(minus(point, shared[0]), minus(shared[-1], shared[0]))):
            return True
        if len(shared) == 1 and point != shared[0]:
            return True
    return False


def nudged(x, to):
    """The next number. Zero stays: products with the smallest numbers would underflow."""
    return float(np.nextafter(x, to)) if x else 0.0


def hard_triangles(seed, count=30):
    """Triangles in a plane or off it by one rounding, slivers, and such that share corners and edges."""
    chance = random.Random(seed)
    u, v = ([chance.randint(-3, 3) for _ in range(3)] for _ in range(2))
    corners = []

    def corner():
        a, b = chance.randint(0, 4), chance.randint(0, 4)
        place = [0.1 * (a * x + b * y) for x, y in zip(u, v, strict=True)]
        if chance.random() < 0.3:
            axis = chance.randrange(3)
            place[axis] = nudged(place[axis], chance.choice((-9.0, 9.0)))
        if chance.random() < 0.15:
            place = [x + chance.choice((-0.1, 0.1)) for x in place]
        return [float(x) for x in place]

    for _ in range(count):
        triangle = [chance.choice(corners) if corners and chance.random() < 0.3 else corner() for _ in range(3)]
        if chance.random() < 0.3:
            share = chance.random()
            triangle[2] = [a + share * (b - a) for a, b in zip(*triangle[:2], strict=True)]
            axis = chance.randrange(3)
            triangle[2][axis] = nudged(triangle[2][axis], 9.0)
        corners += triangle
    return np.array(corners).reshape(-1, 3, 3)


@pytest.mark.parametrize("seed", range(8))
def test_crossings_are_those_of_fractions(seed):
    triangles = hard_triangles(seed)
    mesh = surfrecon.Mesh(triangles.reshape(-1, 3), np.arange(3 * len(triangles)).reshape(-1, 3))
    exact = [[[Fraction(x) for x in corner] for corner in triangle] for triangle in triangles.tolist()]
    known = [pair for pair in itertools.combinations(range(len(exact)), 2) if crosses(*(exact[i] for i in pair))]
    assert 10 < len(known) < len(exact) * (len(exact) - 1) // 4
    assert [tuple(pair) for pair in surfrecon.check_print(mesh).crossings.tolist()] == known


def test_walls_are_measured_behind_each_face():
    plate = box((4, 4, 0.5))
    checked = surfrecon.check_print(plate, min_wall=0.8)
    assert kinds(checked) == ["thin"] and checked.report.thinnest_wall == pytest.approx(0.5)
    wall = checked.mesh.face_attributes["wall"]
    assert wall.dtype == np.float32 and wall[checked.report.thinnest_face] == pytest.approx(0.5)
    assert (wall < 0.8).sum() == checked.report.thin_faces
    # Thicker walls are not measured: a tenth of the diagonal is 0.57.
    thick = surfrecon.check_print(box((4, 4, 0.8)))
    assert thick.report.thinnest_wall is None and thick.report.wall_limit == pytest.approx(32.64**0.5 / 10)
    assert np.allclose(thick.mesh.face_attributes["wall"], thick.report.wall_limit)
    # Nothing lies behind a lone face.
    lone = surfrecon.check_print(surfrecon.Mesh([(0, 0, 0), (3, 0, 0), (0, 4, 0)], [(0, 1, 2)]))
    assert lone.report.thinnest_wall is None and lone.report.thinnest_face is None
    assert lone.report.wall_limit == 0.5 and lone.mesh.face_attributes["wall"] == pytest.approx([0.5])


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
    assert "2 x 4 x 1: too large for the printer's width and depth of 3 x 3" in checked.report.findings[0][1]


def test_what_bounds_no_body_is_said_with_what_to_do():
    whole = torus(16)
    opened = surfrecon.check_print(surfrecon.Mesh(whole.positions, whole.triangles[1:]))
    assert opened.report.findings[0] == ("open", "Openings of the mesh: 1. Close them.")
    assert opened.report.volume is None and opened.report.open_edges == 3
    turned = surfrecon.check_print(surfrecon.Mesh(whole.positions, whole.triangles[:, ::-1]))
    assert "inside_out" in kinds(turned) and turned.report.volume < 0
    twice = surfrecon.check_print(surfrecon.Mesh(whole.positions, np.vstack([whole.triangles, whole.triangles[:1]])))
    assert kinds(twice)[0] == "not_manifold" and not twice.report.is_manifold


def test_bodies_are_judged_one_by_one():
    whole = box((4, 4, 4))
    lone = box(at=(9, 0, 0))
    lone = surfrecon.Mesh(lone.positions, lone.triangles[:, ::-1])
    assert "inside_out" in kinds(surfrecon.check_print(joined(whole, lone)))
    cavity = box(at=(1, 1, 1))
    cavity = surfrecon.Mesh(cavity.positions, cavity.triangles[:, ::-1])
    assert not {"inside_out", "several_bodies"} & set(kinds(surfrecon.check_print(joined(whole, cavity))))
    several = surfrecon.check_print(joined(whole, box(at=(9, 0, 0))))
    assert several.report.findings[0][0] == "several_bodies" and several.report.bodies == 2
    assert "The smallest has a volume of 1, at (" in several.report.findings[0][1]


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
    done = run("check", "box.stl", "--overhang", "45", cwd=tmp_path)
    assert done.returncode != 0 and "in radians or in degrees as 80deg, got 45" in done.stderr, done.stderr
    done = run("check", "scan.ply", cwd=tmp_path)
    assert done.returncode == 1 and "give a mesh" in done.stderr
