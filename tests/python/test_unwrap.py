"""Texture coordinates through Python and on the command line: without flips and overlaps, and as asked for."""

import json

import numpy as np
import pytest
import surfrecon
from command_line import run
from peers import lines_of, needs_peers
from shapes import torus

SMALL = dict(size=512, padding=2)

# Of each triangle its corners in space, and in the texture.
TRIMESH = """
import sys
import numpy as np
import trimesh
mesh = trimesh.load(sys.argv[1], force="mesh", process=False)
np.savez(sys.argv[2], corners=mesh.vertices[mesh.faces], uv=np.asarray(mesh.visual.uv)[mesh.faces])
"""


def doubled(uv, triangles):
    """Twice the areas of triangles in the texture, exactly: coordinates are multiples of 2^-24."""
    a, b, c = np.moveaxis(uv[triangles].astype(np.float64), 1, 0)
    return (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]


def covered(uv, triangles, size):
    """Of each texel of the first tile how many triangles hold its middle, none of which lies on an edge."""
    counts = np.zeros((size, size), int)
    corners = uv[triangles].astype(np.float64) * size
    for low, high, (a, b, c) in zip(corners.min(axis=1), corners.max(axis=1), corners, strict=True):
        (left, bottom), (right, top) = np.floor(low).astype(int), np.ceil(high).astype(int)
        x, y = np.meshgrid(np.arange(left, right) + 0.4987, np.arange(bottom, top) + 0.5013)
        sides = [(q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0]) for p, q in ((a, b), (b, c), (c, a))]
        counts[bottom:top, left:right] += np.all([side > 0 for side in sides], axis=0)
    return counts


@pytest.fixture(scope="module")
def ring():
    return torus(16)


@pytest.fixture(scope="module")
def unwrapped(ring):
    return surfrecon.unwrap(ring, **SMALL)


def test_triangles_stay_and_none_is_flipped(ring, unwrapped):
    mesh, report = unwrapped.mesh, unwrapped.report
    assert np.array_equal(unwrapped.source[mesh.triangles], ring.triangles)
    assert np.array_equal(mesh.positions, ring.positions[unwrapped.source])
    assert (doubled(unwrapped.uv, mesh.triangles) > 0).all() and report.collapsed == 0
    assert unwrapped.uv.dtype == np.float32 and unwrapped.uv.min() >= 0 and unwrapped.uv.max() <= 1
    assert np.array_equal(np.unique(unwrapped.chart), np.arange(report.charts))
    assert repr(unwrapped) == f"<Unwrapped {report.charts} charts, 1 tile>"
    assert json.loads(report.json())["tiles"] == 1


def test_no_two_triangles_overlap(unwrapped):
    counts = covered(unwrapped.uv, unwrapped.mesh.triangles, 512)
    assert counts.max() == 1
    assert counts.mean() == pytest.approx(unwrapped.report.used, abs=0.01) and unwrapped.report.used > 0.3


def test_figures_are_those_of_the_coordinates(ring, unwrapped):
    a, b, c = np.moveaxis(ring.positions[ring.triangles], 1, 0)
    surface = np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()
    texels = doubled(unwrapped.uv, unwrapped.mesh.triangles).sum() * 512**2
    assert unwrapped.report.texels_per_unit == pytest.approx(np.sqrt(texels / surface))
    assert 1 <= unwrapped.report.stretch < unwrapped.report.stretch_p95 < 4


def test_the_mesh_has_them_as_attributes(unwrapped):
    of_vertices = unwrapped.mesh.vertex_attributes
    assert np.array_equal(np.column_stack([of_vertices["s"], of_vertices["t"]]), unwrapped.uv)
    assert np.array_equal(of_vertices["source_vertex"], unwrapped.source)
    assert np.array_equal(unwrapped.mesh.face_attributes["chart"], unwrapped.chart)
    with pytest.raises(ValueError, match="read-only"):
        unwrapped.uv[0] = 0


def test_tiles_and_texels_are_as_asked_for(ring, unwrapped):
    four = surfrecon.unwrap(ring, tiles=4, **SMALL)
    assert 1 < four.report.tiles <= 4
    assert four.report.texels_per_unit > 1.5 * unwrapped.report.texels_per_unit
    wanted = 1.6 * unwrapped.report.texels_per_unit
    dense = surfrecon.unwrap(ring, texels_per_unit=wanted, **SMALL)
    assert dense.report.texels_per_unit == pytest.approx(wanted, rel=0.01)
    tiles = np.floor(dense.uv[dense.mesh.triangles].mean(axis=1)).astype(int)
    assert len(np.unique(tiles, axis=0)) == dense.report.tiles > 1


def test_what_can_not_be_unwrapped_is_refused_with_the_remedy(ring):
    with pytest.raises(surfrecon.InputError, match="has no triangles"):
        surfrecon.unwrap(surfrecon.Mesh(ring.positions, np.empty((0, 3), int)))
    with pytest.raises(surfrecon.InputError, match="use less padding or larger tiles"):
        surfrecon.unwrap(ring, size=64, padding=16)
    with pytest.raises(surfrecon.InputError, match="tiles or texels_per_unit, not both"):
        surfrecon.unwrap(ring, tiles=2, texels_per_unit=10)
    with pytest.raises(surfrecon.InputError, match="1 to 10\\^9 are allowed"):
        surfrecon.unwrap(ring, texels_per_unit=1e-9)
    with pytest.raises(surfrecon.ParameterError, match="cone"):
        surfrecon.unwrap(ring, cone=2)


def test_a_job_does_the_same_on_any_number_of_threads(ring, unwrapped):
    found = surfrecon.Job.unwrap(ring, threads=1, **SMALL).result()
    assert np.array_equal(found.uv, unwrapped.uv) and np.array_equal(found.source, unwrapped.source)
    assert np.array_equal(found.mesh.triangles, unwrapped.mesh.triangles)


def test_it_is_cancelled(ring):
    with pytest.raises(surfrecon.Cancelled):
        surfrecon.unwrap(ring, progress=lambda stage, fraction: False)


def test_the_command_tells_the_figures(tmp_path, ring, unwrapped):
    ring.write(tmp_path / "ring.ply")
    done = run("unwrap", tmp_path / "ring.ply", "-o", tmp_path / "out.ply", "--size", "512", "--padding", "2")
    assert done.returncode == 0, done.stderr
    assert f"charts: {unwrapped.report.charts}, tiles: 1" in done.stdout
    (scan,) = surfrecon.open(tmp_path / "out.ply")
    assert len(scan.read().positions) == len(unwrapped.mesh.positions)


def test_the_command_tells_of_triangles_without_area(tmp_path, ring):
    line = [[9, 9, 9], [9, 9, 8], [9, 9, 7]]
    first = len(ring.positions)
    triangles = np.vstack([ring.triangles, [[first, first + 1, first + 2]]])
    surfrecon.Mesh(np.vstack([ring.positions, line]), triangles).write(tmp_path / "ring.ply")
    done = run("unwrap", tmp_path / "ring.ply", "-o", tmp_path / "out.ply", "--size", "512")
    assert done.returncode == 0, done.stderr
    assert "an area in the texture: 1, 0.00% of the surface" in done.stdout


def test_the_command_refuses_points_and_files_without_coordinates(tmp_path, ring):
    (tmp_path / "points.xyz").write_text("0 0 0\n1 0 0\n0 1 0\n", "utf-8")
    done = run("unwrap", tmp_path / "points.xyz", "-o", tmp_path / "out.obj")
    assert done.returncode != 0 and "give a mesh" in done.stderr
    ring.write(tmp_path / "ring.ply")
    done = run("unwrap", tmp_path / "ring.ply", "-o", tmp_path / "out.stl")
    assert done.returncode != 0 and "end its name in .obj, .glb or .ply" in done.stderr
    assert not list(tmp_path.glob("out.*"))


@pytest.mark.parametrize("ending", ["obj", "glb", "ply"])
def test_files_keep_the_coordinates_to_the_bit(tmp_path, ring, ending):
    # In two tiles, as UDIM has them.
    unwrapped = surfrecon.unwrap(ring, tiles=2, **SMALL)
    assert unwrapped.uv.max() > 1
    unwrapped.mesh.write(tmp_path / f"ring.{ending}")
    read = surfrecon.read(tmp_path / f"ring.{ending}")
    assert np.array_equal(read.triangles, unwrapped.mesh.triangles)
    attributes = read.vertex_attributes
    assert np.array_equal(np.column_stack([attributes["s"], attributes["t"]]), unwrapped.uv)
    assert (doubled(unwrapped.uv, read.triangles) > 0).all()


# Of OBJ and PLY trimesh reads coordinates only with Pillow. Blender's own readers do in tests/blender.
@needs_peers
def test_trimesh_reads_the_same_coordinates(tmp_path, unwrapped):
    path, found = tmp_path / "ring.glb", tmp_path / "found.npz"
    unwrapped.mesh.write(path)
    lines_of(TRIMESH, path, found, folder=tmp_path)
    mesh, read = unwrapped.mesh, np.load(found)
    assert np.allclose(read["corners"], mesh.positions[mesh.triangles], atol=1e-6)
    assert np.allclose(read["uv"], unwrapped.uv[mesh.triangles], rtol=0, atol=1e-7)


def test_remeshing_leaves_texture_coordinates_out(unwrapped):
    assert unwrapped.mesh.vertex_attributes.keys() >= {"s", "t"}
    assert not surfrecon.cluster(unwrapped.mesh, vertices=60).mesh.vertex_attributes.keys() & {"s", "t"}
