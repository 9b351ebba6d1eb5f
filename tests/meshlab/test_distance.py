"""The distance filter in MeshLab: exact at the vertices, bounded between them."""

import numpy as np
import pytest
from conftest import DISTANCE, matrix
from shapes import torus


@pytest.fixture
def planes(document):
    """A large triangle over a small, bumped one: the farthest point lies inside it, away from all vertices."""
    ground = np.array([[-9, -9, 0], [9, -9, 0], [0, 9, 0]], float)
    tent = np.array([[-3, -3, 1], [3, -3, 1], [0, 3, 1]], float)
    document.add(ground, np.array([[0, 1, 2]]), "ground")
    document.add(tent, np.array([[0, 1, 2]]), "tent")
    return document


def ids(document):
    return {layer.label(): layer.id() for layer in document.layers()}


def test_parallel_planes(planes):
    number = ids(planes)
    out = planes.run(DISTANCE, measured=number["tent"], reference=number["ground"])
    assert out["max"] == out["mean"] == out["rms"] == 1
    assert 1 <= out["bound"] <= 1.02
    layer = planes.current
    assert layer.label() == "tent distances" and np.array_equal(layer.vertex_scalar_array(), np.ones(3))
    assert len(planes) == 3


def test_signs(planes):
    number = ids(planes)
    out = planes.run(DISTANCE, measured=number["tent"], reference=number["ground"], signed=True)
    assert out["bias"] == 1
    planes.run("set_matrix", transformmatrix=np.diag([1.0, 1, -1, 1]), freeze=False)


def test_the_bound_holds_between_vertices(document):
    """Vertices touch the reference, the middle does not: vertices alone would say 0."""
    roof = np.array([[0, 0, 0], [2, 0, 0], [1, 0, 1], [0, 1, 0], [2, 1, 0], [1, 1, 1]], float)
    document.add(roof, np.array([[0, 1, 4], [0, 4, 3]]), "floor")
    document.add(roof, np.array([[0, 2, 5], [0, 5, 3], [2, 1, 4], [2, 4, 5]]), "roof")
    number = ids(document)
    out = document.run(DISTANCE, measured=number["floor"], reference=number["roof"], both_ways=True)
    assert out["max"] == 0
    true = np.sqrt(0.5)
    assert 0.98 * true <= out["max_found"] <= true <= out["bound"] <= 1.03 * true
    # From the ridge straight down to the floor.
    assert out["max_back"] == pytest.approx(1) and out["hausdorff_bound"] >= 1


def test_matrices_place_both_layers(document):
    mesh = torus(12)
    document.add(mesh.positions, mesh.triangles, "here")
    document.add(mesh.positions - [0, 0, 5], mesh.triangles, "there")
    shift = np.eye(4)
    shift[2, 3] = 5
    document.run("set_matrix", transformmatrix=shift, freeze=False)
    number = ids(document)
    out = document.run(DISTANCE, measured=number["there"], reference=number["here"])
    assert out["max"] < 1e-12
    assert np.array_equal(matrix(document.current), shift)


def test_points_can_be_measured_but_not_measured_against(document, refused):
    mesh = torus(12)
    document.add(mesh.positions, mesh.triangles, "torus")
    document.add(mesh.positions * 1.0, name="points")
    number = ids(document)
    assert document.run(DISTANCE, measured=number["points"], reference=number["torus"])["max"] == 0
    assert '"points" has no faces' in refused(
        document.run, DISTANCE, measured=number["torus"], reference=number["points"]
    )
    both = {"measured": number["points"], "reference": number["torus"], "both_ways": True}
    assert '"points" has no faces' in refused(document.run, DISTANCE, **both)
