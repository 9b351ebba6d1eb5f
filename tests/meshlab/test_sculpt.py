"""Import and sculpting in MeshLab: the grid of a range image survives what users do to layers."""

import numpy as np
import pytest
import surfrecon
from conftest import IMPORT, SCULPT, length
from files import write_range_grid
from shapes import torus_scans

# See VOXEL in test_merge.py.
TOLERANCE = 1 / 128


@pytest.fixture(scope="module")
def images():
    return torus_scans(pixels=60, noise=0.001)


@pytest.fixture
def path(tmp_path, images):
    file = tmp_path / "one.ply"
    write_range_grid(file, images[0])
    return file


@pytest.fixture
def loaded(document, path):
    document.run(IMPORT, file=str(path))
    return document


@pytest.fixture
def expected(path):
    return surfrecon.sculpt(surfrecon.open(str(path))[0].read(), tolerance=TOLERANCE)


def same(layer, mesh):
    assert np.array_equal(layer.vertex_matrix(), mesh.positions)
    assert np.array_equal(layer.face_matrix(), mesh.triangles)


def test_it_is_the_library_s_mesh(loaded, expected):
    out = loaded.run(SCULPT, tolerance=length(TOLERANCE))
    same(loaded.current, expected.mesh)
    assert out["tolerance"] == TOLERANCE and out["triangles"] == loaded.current.face_number()
    assert out["full_triangles"] > out["triangles"]
    error = expected.mesh.vertex_attributes["error"].astype(float)
    assert np.array_equal(loaded.current.vertex_scalar_array(), error)
