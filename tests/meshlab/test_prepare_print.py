"""Preparing a print in MeshLab: the library's own result, as a layer for each part."""

import numpy as np
import pytest
import surfrecon
from conftest import PREPARE_PRINT, length
from shapes import torus


def added(document):
    """The library's mesh of the ring that the document gets."""
    ring = torus(16)
    mesh = surfrecon.Mesh(np.asarray(ring.positions, float), ring.triangles)
    document.add(mesh.positions, np.asarray(mesh.triangles), "ring")
    return mesh


def test_it_is_the_mesh_of_the_library(document):
    ring = added(document)
    out = document.run(PREPARE_PRINT, scale_to=length(0.1), flat_base=True)
    expected = surfrecon.prepare_print(ring, scale_to=0.1, flat_base=True)
    made = document.current
    assert made.label() == "ring for printing" and len(document) == 2
    # Both are rounded to single precision on the way, in another order.
    assert np.allclose(made.vertex_matrix(), expected.mesh.positions, atol=1e-7)
    assert np.array_equal(made.face_matrix(), expected.mesh.triangles)
    selected = np.asarray(made.face_selection_array()).astype(bool)
    assert np.array_equal(selected, np.asarray(expected.mesh.face_attributes["added"]).astype(bool))
    assert out["base_faces"] == expected.report.base_faces > 0


def test_each_part_is_a_layer(document):
    ring = added(document)
    width = float(np.ptp(ring.positions[:, 0]))
    out = document.run(PREPARE_PRINT, printer_width=length(0.6 * width))
    assert out["parts"] == 2 and len(document) == 3
    assert document.current.label() == "ring for printing 2"


def test_an_open_layer_is_refused_with_the_remedy(document):
    ring = torus(16)
    document.add(np.asarray(ring.positions, float), np.asarray(ring.triangles[1:]), "ring")
    with pytest.raises(Exception, match="close it first"):
        document.run(PREPARE_PRINT, flat_base=True)
    assert len(document) == 1
