"""Closing in MeshLab: the library's own surface, with the fill selected, and layers that say where nothing is."""

import numpy as np
import pytest
import surfrecon
from conftest import CLOSE, IMPORT, length


@pytest.fixture(scope="module")
def scans():
    shape = surfrecon.sculpture(cell=8)
    scans = surfrecon.virtual_scan(shape, surfrecon.turntable(shape, pixels=80, height_angle=0.6))
    for number, scan in enumerate(scans):
        scan.name = f"view{number}"
    return scans


@pytest.fixture(scope="module")
def merged(scans):
    """Their surface with its openings."""
    mesh = surfrecon.merge(scans, max_hole_length=0).mesh
    return surfrecon.Mesh(mesh.positions, mesh.triangles)


def add(document, mesh):
    document.add(np.asarray(mesh.positions, float), np.asarray(mesh.triangles), "open")


def test_it_is_the_library_s_surface_and_the_fill_is_selected(document, merged):
    add(document, merged)
    out = document.run(CLOSE, flat_base=True)
    expected = surfrecon.close(merged, flat_base=True)
    assert np.array_equal(document.current.vertex_matrix(), expected.mesh.positions)
    assert np.array_equal(document.current.face_matrix(), expected.mesh.triangles)
    assert document.current.label() == "open closed"
    assert document.current.selected_face_number() == len(expected.mesh.triangles) - len(merged.triangles) > 0
    assert out["open_edges"] == expected.report.open_edges and not out["has_sight"]


def test_range_images_in_other_layers_say_where_nothing_is(document, scans, merged, tmp_path):
    surfrecon.write_scans(tmp_path / "scans.e57", scans)
    document.run(IMPORT, file=str(tmp_path / "scans.e57"))
    add(document, merged)
    out = document.run(CLOSE)
    assert out["has_sight"] and out["closed"] > 0
    assert np.array_equal(document.current.face_matrix()[: len(merged.triangles)], merged.triangles)


def test_holes_alone(document, merged):
    add(document, merged)
    out = document.run(CLOSE, openings="Holes", max_hole_length=length(20.0))
    expected = surfrecon.close(merged, openings="holes", max_hole_length=20.0).report
    assert (out["closed"], out["left_too_long"]) == (expected.closed, expected.left[1]) and expected.left[1] > 0


def test_what_can_t_be_closed_is_named(document, refused):
    document.add(np.zeros((3, 3)), name="points")
    assert "has no faces" in refused(document.run, CLOSE)
    document.add(np.eye(3), np.array([[0, 1, 2], [0, 1, 2]]), "twice")
    assert "must be an oriented manifold" in refused(document.run, CLOSE)
