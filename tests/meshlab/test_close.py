"""Closing in MeshLab: the library's own surface, with the fill selected."""

import numpy as np
import pytest
import surfrecon
from conftest import CLOSE


@pytest.fixture
def open_ball():
    """A ball without its lower end."""
    mesh = surfrecon.sculpture(cell=8)
    low = mesh.positions[:, 2].min()
    keep = (mesh.positions[mesh.triangles][:, :, 2] > low + 8).all(axis=1)
    used, triangles = np.unique(mesh.triangles[keep], return_inverse=True)
    return surfrecon.Mesh(mesh.positions[used], triangles.reshape(-1, 3))


def test_it_is_the_library_s_surface_and_the_fill_is_selected(document, open_ball):
    document.add(np.asarray(open_ball.positions, float), np.asarray(open_ball.triangles), "open")
    out = document.run(CLOSE)
    expected = surfrecon.close(open_ball)
    assert np.array_equal(document.current.vertex_matrix(), expected.mesh.positions)
    assert np.array_equal(document.current.face_matrix(), expected.mesh.triangles)
    assert document.current.label() == "open closed"
    assert document.current.selected_face_number() == len(expected.mesh.triangles) - len(open_ball.triangles) > 0
    assert out["open_edges"] == expected.report.open_edges


def test_what_can_t_be_closed_is_named(document):
    document.add(np.zeros((3, 3)), name="points")
    with pytest.raises(Exception, match="has no faces"):
        document.run(CLOSE)
