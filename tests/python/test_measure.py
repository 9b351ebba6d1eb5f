"""Distances through Python."""

import numpy as np
import pytest
import surfrecon
from shapes import torus, torus_distance

CUBE = surfrecon.Mesh(
    [[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)],
    [
        *([0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1]),
        *([2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]),
    ],
)


def test_distances_to_a_cube_are_exact():
    points = [[0.5, 0.5, 2], [2, 2, 2], [0.5, 0.5, 0.75], [1, 1, 1]]
    assert surfrecon.distances(points, CUBE) == pytest.approx([1, 3**0.5, 0.25, 0])
    assert surfrecon.distances(points, CUBE, signed=True) == pytest.approx([1, 3**0.5, -0.25, 0])


def test_a_job_measures_the_same():
    points = np.random.default_rng(0).normal(size=(5000, 3))
    job = surfrecon.Job.distances(points, torus())
    assert np.array_equal(job.result(), surfrecon.distances(points, torus(), threads=1))


def test_distances_to_scans_are_those_to_their_surfaces():
    far = np.eye(4)
    far[2, 3] = 10
    points = [[0.5, 0.5, 4], [0.5, 0.5, 8], [3, 0.5, 0.5]]
    found = surfrecon.distances(points, [CUBE, (CUBE, far), (CUBE, far, "named")])
    assert found == pytest.approx([3, 2, 2])
    assert np.array_equal(surfrecon.Job.distances(points, [CUBE, (CUBE, far)]).result(), found)
    with pytest.raises(surfrecon.InputError, match="no triangle"):
        surfrecon.distances(points, [])
    with pytest.raises(TypeError, match="scan 0 must be"):
        surfrecon.distances(points, [7])


def test_the_nearest_triangle_is_at_the_distance():
    mesh = torus(60)
    centres = np.asarray(mesh.positions)[mesh.triangles].mean(axis=1)
    assert np.array_equal(surfrecon.nearest_triangles(centres, mesh, threads=1), np.arange(len(centres)))
    assert surfrecon.nearest_triangles(np.zeros((0, 3)), mesh).shape == (0,)
    with pytest.raises(surfrecon.InputError, match="point 1"):
        surfrecon.nearest_triangles([[0, 0, 0], [np.nan, 0, 0]], mesh)
    with pytest.raises(surfrecon.Cancelled):
        surfrecon.nearest_triangles(centres, mesh, progress=lambda stage, share: False)


def test_distances_near_a_torus_are_known():
    points = torus().positions + np.random.default_rng(0).normal(scale=0.03, size=(4608, 3))
    measured = surfrecon.distances(points, torus(300), signed=True)
    assert np.allclose(measured, torus_distance(points), rtol=0.03, atol=0.001)


def test_what_cannot_be_measured_is_refused():
    with pytest.raises(surfrecon.InputError, match=r"point 1 lies at \(0, inf, 0\): coordinates must be finite"):
        surfrecon.distances([[0, 0, 0], [0, np.inf, 0]], CUBE)
    with pytest.raises(surfrecon.InputError, match=r"point 0 lies at \(1e300, 0, 0\): .* at most 1e75"):
        surfrecon.distances([[1e300, 0, 0]], CUBE)
    with pytest.raises(surfrecon.InputError, match="no triangle"):
        surfrecon.distances([[0, 0, 0]], surfrecon.Mesh(np.eye(3), np.zeros((0, 3), int)))
    assert surfrecon.distances(np.zeros((0, 3)), CUBE).shape == (0,)


def test_the_bound_between_surfaces_holds_for_samples():
    coarse, fine = torus(12), torus(60)
    found = surfrecon.surface_distance(coarse, fine)
    weights = np.random.default_rng(1).dirichlet((1, 1, 1), size=(len(coarse.triangles), 60))
    samples = np.einsum("mkc,mcx->mkx", weights, coarse.positions[coarse.triangles]).reshape(-1, 3)
    dense = surfrecon.distances(samples, fine)
    assert dense.max() <= found["bound"] <= 1.011 * found["reached"] and dense.max() > 0.9 * found["reached"]
    assert np.array_equal(found["distances"], surfrecon.distances(coarse.positions, fine))
    assert found["max"] == found["distances"].max() <= found["reached"]
    assert found["rms"] == pytest.approx(np.sqrt(np.mean(found["distances"] ** 2)))
    job = surfrecon.Job.surface_distance(coarse, fine, threads=1).result()
    assert job["bound"] == found["bound"] and job["reached"] == found["reached"]


def test_the_same_surface_cut_otherwise_has_no_distance():
    square = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    one = surfrecon.Mesh(square, [[0, 1, 2], [0, 2, 3]])
    other = surfrecon.Mesh([*square, [0.3, 0.6, 0]], [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]])
    found = surfrecon.surface_distance(one, other)
    assert found["reached"] < 1e-15 and found["bound"] < 1e-3
    far = surfrecon.surface_distance(surfrecon.Mesh([[0.5, 0.5, 3]], np.zeros((0, 3), int)), one)
    assert far["reached"] == 3 and far["bound"] >= 3
    with pytest.raises(surfrecon.InputError, match="no triangle"):
        surfrecon.surface_distance(one, surfrecon.Mesh(square, np.zeros((0, 3), int)))
    with pytest.raises(surfrecon.Cancelled):
        surfrecon.surface_distance(one, other, progress=lambda *_: False)
