"""Checks for printing in MeshLab: the library's own figures, with faults selected and walls as the quality of faces."""

import numpy as np
import pytest
import surfrecon
from conftest import CHECK_PRINT, length
from shapes import torus


@pytest.fixture
def two_rings():
    """Two rings that cross each other."""
    ring = torus(16)
    positions = np.asarray(ring.positions, float)
    both = np.vstack([positions, positions + [0.7, 0.1, 0.05]])
    return surfrecon.Mesh(both, np.vstack([ring.triangles, ring.triangles + len(positions)]))


def test_faults_are_selected_and_walls_are_quality(document, two_rings):
    document.add(np.asarray(two_rings.positions, float), np.asarray(two_rings.triangles), "rings")
    out = document.run(CHECK_PRINT, min_wall=length(0.1))
    expected = surfrecon.check_print(two_rings, min_wall=0.1)
    marks = expected.mesh.face_attributes
    assert np.allclose(document.current.face_scalar_array(), marks["wall"], rtol=1e-6)
    selected = np.asarray(document.current.face_selection_array()).astype(bool)
    faults = np.asarray(marks["crossing"]).astype(bool) | np.asarray(marks["overhang"]).astype(bool)
    assert np.array_equal(selected, faults) and 0 < selected.sum() < len(selected)
    assert out["crossing_pairs"] == expected.report.crossing_pairs > 0
    assert out["is_closed"] and out["thin_faces"] == expected.report.thin_faces
    assert document.current.label() == "rings" and len(document) == 1


def test_a_layer_without_faces_is_named(document):
    document.add(np.zeros((3, 3)), name="points")
    with pytest.raises(Exception, match="has no faces"):
        document.run(CHECK_PRINT)
