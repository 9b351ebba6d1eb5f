"""Programs for printing take what we close and prepare as it is: lib3mf, trimesh and ADMesh find nothing to repair."""

import json
import os
import re
import shutil
import subprocess

import numpy as np
import pytest
import surfrecon
from peers import lines_of, needs_peers
from shapes import torus_scans

needs_admesh = pytest.mark.skipif(not shutil.which("admesh"), reason="admesh is not installed: make test installs it")

# Of the volume, by which readers may be off.
OFF = 0.005
# Lines in which ADMesh counts what it repaired.
REPAIRS = ("Degenerate facets", "Edges fixed", "Facets removed", "Facets added", "Facets reversed", "Backwards edges")
REPAIRS += ("Normals fixed",)

LIB3MF = """
import json, sys
import lib3mf
model = lib3mf.get_wrapper().CreateModel()
reader = model.QueryReader("3mf")
reader.SetStrictModeActive(True)
reader.ReadFromFile(sys.argv[1])
objects = model.GetMeshObjects()
objects.MoveNext()
mesh = objects.GetCurrentMeshObject()
items = model.GetBuildItems()
items.MoveNext()
groups, colours = model.GetColorGroups(), 0
while groups.MoveNext():
    colours += groups.GetCurrentColorGroup().GetCount()
box = model.GetOutbox()
print(json.dumps({
    "warnings": reader.GetWarningCount(),
    "valid": mesh.IsValid(),
    "manifold": mesh.IsManifoldAndOriented(),
    "unit": model.GetUnit().name,
    "objects": objects.Count(),
    "items": items.Count(),
    "colours": colours,
    "triangles": mesh.GetTriangleCount(),
    "size": [high - low for low, high in zip(box.MinCoordinate, box.MaxCoordinate)],
}))
"""

TRIMESH = """
import json, sys
import trimesh
mesh = trimesh.load(sys.argv[1], force="mesh")
print(json.dumps({
    "watertight": bool(mesh.is_watertight),
    "winding": bool(mesh.is_winding_consistent),
    "volume": float(mesh.volume),
}))
"""


@pytest.fixture(scope="module")
def closed():
    """A closed surface in millimetres that scans saw half of, in colours."""
    scans = torus_scans(pixels=60)[:6]
    found = surfrecon.close(surfrecon.merge(scans).mesh, scans)
    assert found.report.is_closed and found.report.closed > 0
    mesh = found.mesh.transformed(surfrecon.Similarity(np.diag([20.0, 20.0, 20.0, 1.0])))
    places = np.clip((mesh.positions - mesh.positions.min(0)) / np.ptp(mesh.positions, axis=0), 0, 1)
    colour = np.column_stack([np.rint(255 * places), np.full(len(places), 255)]).astype(np.uint8)
    return surfrecon.Mesh(mesh.positions, mesh.triangles, colour=colour)


@pytest.fixture(scope="module")
def prepared(closed):
    """The same with a base, hollow and drained."""
    return surfrecon.prepare_print(closed, scale_to=70, flat_base=True, hollow=2, drain=4).mesh


@pytest.fixture
def mesh(request, closed):
    """A mesh to be judged: also a closed surface of another size, and one beside the origin."""
    if request.param in ("closed", "prepared"):
        return request.getfixturevalue(request.param)
    by = np.eye(4)
    if request.param == "beside":
        by[:3, 3] = 150, -120, 90
    else:
        by[:3, :3] *= request.param
    return closed.transformed(surfrecon.Similarity(by))


judged_3mf = pytest.mark.parametrize("mesh", ["closed", "prepared", 1e-9, "beside"], indirect=True)
# Judges of STL take places within 1e-8 for one, and faces of 1e-12 for points, whatever the size of the mesh.
judged_stl = pytest.mark.parametrize("mesh", ["closed", "prepared", 1e-3, "beside"], indirect=True)


def volume_of(mesh):
    a, b, c = (mesh.positions[mesh.triangles[:, k]] for k in range(3))
    return np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6


def told(program, path):
    """The findings of a program of the peers in a file."""
    return json.loads(lines_of(program, path, folder=path.parent)[-1])


@needs_peers
@judged_3mf
def test_lib3mf_reads_it_strictly_without_a_warning(tmp_path, mesh):
    path = tmp_path / "a.3mf"
    mesh.write(path, metres_per_unit=0.001)
    found = told(LIB3MF, path)
    assert (found["warnings"], found["objects"], found["items"]) == (0, 1, 1)
    assert found["valid"] and found["manifold"] and found["unit"] == "MilliMeter"
    assert found["triangles"] == len(mesh.triangles)
    assert np.allclose(found["size"], np.ptp(mesh.positions, axis=0), rtol=1e-5)
    assert (found["colours"] > 100) == ("colour" in mesh.vertex_attributes)


@needs_peers
@judged_stl
def test_trimesh_finds_it_closed_and_of_our_volume(tmp_path, mesh):
    path = tmp_path / "a.stl"
    mesh.write(path, metres_per_unit=0.001)
    found = told(TRIMESH, path)
    assert found["watertight"] and found["winding"]
    assert found["volume"] == pytest.approx(volume_of(mesh), rel=OFF)


@needs_admesh
@judged_stl
def test_admesh_repairs_nothing(tmp_path, mesh):
    path = tmp_path / "a.stl"
    mesh.write(path, metres_per_unit=0.001)
    told = subprocess.run(
        ["admesh", path.name], check=True, capture_output=True, text=True, cwd=tmp_path, timeout=120,
        stdin=subprocess.DEVNULL, env={**os.environ, "LC_ALL": "C"},
    ).stdout  # fmt: skip
    counts = {name: int(re.search(rf"{name} +: +(\d+)", told)[1]) for name in REPAIRS}
    assert counts == dict.fromkeys(REPAIRS, 0)
    assert re.search(r"Total disconnected facets +: +0 +0", told)
    facets = re.search(r"Number of facets +: +(\d+) +(\d+)", told)
    assert facets.groups() == (str(len(mesh.triangles)),) * 2
    assert re.search(r"Header +: (.*)", told)[1].strip() == "binary STL, mesh  UNITS=mm"
    if np.ptp(mesh.positions) > 1:
        # It prints six digits behind the point.
        assert float(re.search(r"Volume +: +([-\d.]+)", told)[1]) == pytest.approx(volume_of(mesh), rel=OFF)


@needs_peers
@needs_admesh
def test_the_judges_see_what_is_broken(tmp_path, closed):
    """A face turned round and one left out: each of the judges says so."""
    turned = np.array(closed.triangles)
    turned[7] = turned[7][::-1]
    surfrecon.Mesh(closed.positions, turned).write(tmp_path / "turned.3mf")
    surfrecon.Mesh(closed.positions, turned).write(tmp_path / "turned.stl")
    surfrecon.Mesh(closed.positions, turned[:-1]).write(tmp_path / "open.stl")
    assert not told(LIB3MF, tmp_path / "turned.3mf")["manifold"]
    assert not told(TRIMESH, tmp_path / "turned.stl")["winding"]
    assert not told(TRIMESH, tmp_path / "open.stl")["watertight"]
    found = subprocess.run(
        ["admesh", "turned.stl"], check=True, capture_output=True, text=True, cwd=tmp_path, stdin=subprocess.DEVNULL
    ).stdout
    assert re.search(r"Facets reversed +: +1", found)


def test_an_empty_mesh_is_no_print(tmp_path):
    empty = surfrecon.Mesh(np.zeros((0, 3)), np.zeros((0, 3), np.uint32))
    with pytest.raises(surfrecon.InputError, match="a 3MF file holds triangles, but the mesh has none: write PLY"):
        empty.write(tmp_path / "a.3mf")
    assert not list(tmp_path.iterdir())


def test_a_unit_in_the_header_of_stl_is_read(tmp_path, closed):
    """Coordinates stay as they are; without a unit the file is read as it was written."""
    closed.write(tmp_path / "plain.stl")
    closed.write(tmp_path / "mm.stl", metres_per_unit=0.001)
    plain, said = ((tmp_path / name).read_bytes() for name in ("plain.stl", "mm.stl"))
    assert plain[80:] == said[80:] and said.startswith(b"binary STL, mesh  UNITS=mm\0")
    assert b"UNITS" not in plain[:80]
    opened = surfrecon.open(tmp_path / "mm.stl")
    assert opened.notes == ["mm.stl: its header says millimetres: it is read in metres"]
    single = closed.positions.astype(np.float32).astype(float)
    find = lambda name: np.sort(surfrecon.read(tmp_path / name).positions, axis=0)  # noqa: E731
    assert np.array_equal(find("plain.stl"), np.sort(single, axis=0))
    assert np.array_equal(find("mm.stl"), np.sort(single, axis=0) * 0.001)
