"""Clustering in MeshLab: the library's own meshes, in their place, and a chain of layers."""

import numpy as np
import pytest
import surfrecon
from conftest import CLUSTER, length, matrix
from shapes import torus


@pytest.fixture
def dense(document):
    document.add(np.asarray(torus().positions, float), np.asarray(torus().triangles), "dense")
    return document


def test_it_is_the_library_s_mesh(dense):
    out = dense.run(CLUSTER, vertices=300)
    expected = surfrecon.cluster(torus(), vertices=300)
    assert np.array_equal(dense.current.vertex_matrix(), expected.mesh.positions)
    assert np.array_equal(dense.current.face_matrix(), expected.mesh.triangles)
    assert dense.current.label() == "dense clustered" and len(dense) == 2
    assert out["vertices"] == 300 and out["triangles"] == 600
    assert out["after_smallest_angle"] == expected.report["after"]["smallest_angle"]


def test_a_tenth_by_default_and_a_largest_error(dense):
    count = len(torus().positions)
    dense.run(CLUSTER)
    assert dense.current.vertex_number() == count // 10
    dense.named("dense")
    out = dense.run(CLUSTER, max_error=length(0.01))
    assert out["max_error"] <= 0.01 and out["vertices"] == dense.current.vertex_number() < count


def test_as_many_triangles_as_asked_for_and_how_far_they_are_off(dense):
    out = dense.run(CLUSTER, triangles=501)
    expected = surfrecon.cluster(torus(), triangles=501)
    assert np.array_equal(dense.current.vertex_matrix(), expected.mesh.positions)
    assert out["triangles"] == 500 == dense.current.face_number()
    assert out["max_error"] == expected.report["max_error"] > out["rms_error"] == expected.report["rms_error"] > 0


def test_levels_are_layers(dense):
    dense.run(CLUSTER, vertices=400, levels=3)
    names = ["dense clustered 0", "dense clustered 1", "dense clustered 2"]
    assert [dense.named(name).vertex_number() for name in names] == [400, 100, 25]


def test_a_placed_layer_stays_in_its_place(dense):
    moved = np.eye(4)
    moved[0, 3] = 3
    dense.run("set_matrix", transformmatrix=moved, freeze=False)
    dense.run(CLUSTER, vertices=300)
    assert matrix(dense.current)[0, 3] == 3
    assert np.array_equal(dense.current.vertex_matrix(), surfrecon.cluster(torus(), vertices=300).mesh.positions)


def test_vertices_without_faces_are_points(document):
    document.add(np.asarray(torus().positions, float), name="points")
    out = document.run(CLUSTER, vertices=300)
    expected = surfrecon.cluster(torus().positions, vertices=300)
    assert np.array_equal(document.current.vertex_matrix(), expected.mesh.positions)
    assert expected.mesh.check()["genus"] == 1 and out["off_surface"] == 0


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"vertices": -1}, "vertices must be at least 0, got -1"),
        ({"fitting": 101}, "fitting must be >= 0 and <= 100, got 101"),
        ({"levels": 0}, "The number of levels must be 1 to 16, got 0"),
        (
            {"levels": 2, "max_error": length(0.1)},
            "A largest error, or a number of patches or triangles, goes with one level",
        ),
        ({"levels": 2, "triangles": 300}, "A largest error, or a number of patches or triangles, goes with one level"),
        ({"triangles": 300, "vertices": 300}, "one of vertices, patches, max_error and triangles"),
        ({"adaptivity": 5.0}, "adaptivity must be >= 0 and <= 2, got 5"),
    ],
)
def test_what_can_not_be_done_is_named(dense, refused, options, text):
    assert text in refused(dense.run, CLUSTER, **options)
    assert len(dense) == 1
