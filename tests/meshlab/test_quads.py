"""Quad grids in MeshLab: the library's own quads, kept as quads, and the surface through them."""

import numpy as np
import pytest
import surfrecon
from conftest import IMPORT, QUADS, length, matrix, scalars
from files import write_range_grid, write_set
from shapes import torus_scans


@pytest.fixture(scope="module")
def images():
    return torus_scans(pixels=90, noise=0.001)


@pytest.fixture
def loaded(document, tmp_path, images):
    write_range_grid(tmp_path / "one.ply", images[0])
    document.run(IMPORT, file=str(tmp_path / "one.ply"))
    return document


@pytest.fixture
def expected(loaded, tmp_path):
    return surfrecon.adaptive_quads(surfrecon.open(str(tmp_path / "one.ply"))[0].read())


def test_it_is_the_library_s_grid(loaded, expected):
    before = loaded.current.vertex_matrix(), loaded.current.label()
    out = loaded.run(QUADS)
    triangles = expected.triangles()
    assert np.array_equal(loaded.current.vertex_matrix(), triangles.positions)
    assert np.array_equal(loaded.current.face_matrix(), triangles.triangles)
    assert (out["rows"], out["columns"], out["quads"]) == (expected.rows, expected.columns, len(expected.quads))
    for name in ("relative_error", "uniform_relative_error", "rms_error", "max_error", "depth_extent"):
        assert out[name] == expected.report[name]
    assert out["relative_error"] <= out["uniform_relative_error"]
    assert np.array_equal(scalars(loaded.current, "range_row"), expected.vertex_attributes["range_row"])
    assert np.array_equal(loaded.current.vertex_tex_coord_matrix(), expected.uvs)
    assert loaded.current.label() == f"{before[1]} quads" and len(loaded) == 2
    assert np.array_equal(loaded.named(before[1]).vertex_matrix(), before[0])


def test_quads_are_written_as_quads(loaded, expected, tmp_path):
    loaded.run(QUADS)
    loaded.set.save_current_mesh(str(tmp_path / "quads.obj"))
    faces = [line.split()[1:] for line in (tmp_path / "quads.obj").read_text().splitlines() if line.startswith("f ")]
    assert len(faces) == len(expected.quads) and {len(face) for face in faces} == {4}


def test_a_wanted_error_chooses_the_size(loaded):
    name = loaded.current.label()
    coarse = loaded.run(QUADS, rms_error=length(0.02))
    loaded.named(name)
    fine = loaded.run(QUADS, rms_error=length(0.005))
    assert coarse["rms_error"] <= 0.02 and fine["rms_error"] <= 0.005 and coarse["quads"] < fine["quads"]
    loaded.named(name)
    assert loaded.run(QUADS, max_error=length(0.1))["max_error"] <= 0.1


def test_the_surface_is_the_library_s(loaded, expected):
    name = loaded.current.label()
    loaded.run(QUADS, surface_steps=3)
    assert len(loaded) == 3
    surface = loaded.named(f"{name} surface").vertex_matrix()
    rows, columns = 3 * (expected.rows - 1) + 1, 3 * (expected.columns - 1) + 1
    v, u = (x.reshape(-1) for x in np.meshgrid(np.linspace(0, 1, rows), np.linspace(0, 1, columns), indexing="ij"))
    assert np.allclose(surface, expected.spline().evaluate(u, v), atol=1e-9)


def test_the_result_lies_where_the_layer_lies(document, images, tmp_path):
    document.run(IMPORT, file=str(write_set(tmp_path, images[:1])))
    pose = matrix(document.current)
    document.run(QUADS)
    assert np.array_equal(matrix(document.current), pose)


@pytest.mark.parametrize(
    ("parameters", "said"),
    [
        ({"rows": 1}, "rows must be >= 2"),
        ({"rows": -3}, "rows must be at least 2"),
        ({"columns": 5000}, "ask for fewer columns or a smaller tiles_across"),
        ({"floor": -1}, "floor must be"),
        ({"coverage": 2}, "coverage must be >= 0 and <= 1, got 2"),
        ({"max_error": length(1), "rms_error": length(1)}, "not both"),
        ({"surface_steps": 2, "order": 9}, "order must be >= 2 and <= 4, got 9"),
        ({"rows": 2, "columns": 2, "tiles_down": 1, "tiles_across": 1, "coverage": 1}, "ask for more rows and columns"),
    ],
)
def test_wrong_parameters_are_named(loaded, refused, parameters, said):
    assert said in refused(loaded.run, QUADS, **parameters)
    assert len(loaded) == 1


def test_a_layer_without_a_grid_is_refused(document, refused):
    document.add(np.eye(3), np.array([[0, 1, 2]]), "plain")
    said = refused(document.run, QUADS)
    assert '"plain"' in said and "range_row" in said and "Import Range Images" in said
