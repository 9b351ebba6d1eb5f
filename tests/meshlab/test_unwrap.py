"""Unwrapping in MeshLab: the library's own coordinates at the corners of the faces, which stay as they are."""

import numpy as np
import pytest
import surfrecon
from conftest import UNWRAP
from shapes import torus


def added(document):
    """The library's mesh of the ring that the document gets."""
    ring = torus(16)
    mesh = surfrecon.Mesh(np.asarray(ring.positions, float), ring.triangles)
    document.add(mesh.positions, np.asarray(mesh.triangles), "ring")
    return mesh


def test_corners_get_the_coordinates_of_the_library(document):
    ring = added(document)
    out = document.run(UNWRAP, size=512, padding=2, tiles=2)
    expected = surfrecon.unwrap(ring, size=512, padding=2, tiles=2)
    corners = expected.uv[expected.mesh.triangles].reshape(-1, 2)
    assert np.array_equal(document.current.wedge_tex_coord_matrix().astype(np.float32), corners)
    assert np.array_equal(document.current.face_matrix(), ring.triangles)
    assert document.current.label() == "ring" and len(document) == 1
    assert out["charts"] == expected.report.charts and out["tiles"] == expected.report.tiles == 2
    assert out["texels_per_unit"] == pytest.approx(expected.report.texels_per_unit)


def test_a_mirrored_layer_keeps_its_outside(document):
    ring = added(document)
    document.set.set_matrix(transformmatrix=np.diag([-2.0, 2.0, 2.0, 1.0]), freeze=False)
    out = document.run(UNWRAP, size=512, padding=2)
    mirrored = surfrecon.Mesh(ring.positions * [-2, 2, 2], ring.triangles[:, [0, 2, 1]])
    expected = surfrecon.unwrap(mirrored, size=512, padding=2)
    corners = expected.uv[expected.mesh.triangles[:, [0, 2, 1]]].reshape(-1, 2)
    assert np.array_equal(document.current.wedge_tex_coord_matrix().astype(np.float32), corners)
    assert out["texels_per_unit"] == pytest.approx(expected.report.texels_per_unit)


def test_a_layer_without_faces_is_named(document):
    document.add(np.zeros((3, 3)), name="points")
    with pytest.raises(Exception, match="has no faces"):
        document.run(UNWRAP)
