"""The import plugin: files with endings MeshLab leaves free open like any other."""

import numpy as np
from conftest import SCULPT, scalars
from files import write_set
from shapes import torus_scans


def test_a_set_of_scans_is_a_layer_each(document, tmp_path):
    images = torus_scans(pixels=40)[:3]
    document.set.load_new_mesh(str(write_set(tmp_path, images)))
    assert [layer.label() for layer in document.layers()] == [image.name for image in images]
    assert [layer.vertex_number() for layer in document.layers()] == [image.valid.sum() for image in images]
    assert document.run(SCULPT)["triangles"] > 0


def test_a_height_map_with_its_parameters(document, tmp_path):
    np.save(tmp_path / "map.npy", np.arange(12.0).reshape(3, 4))
    document.set.load_new_mesh(str(tmp_path / "map.npy"), scale=2.0, step=0.5)
    positions = document.current.vertex_matrix()
    assert positions[:, 2].max() == 22 and np.ptp(positions[:, 0]) == 1.5
    assert scalars(document.current, "range_col").max() == 3


def test_minus_one_is_no_default(document, refused, tmp_path):
    np.save(tmp_path / "map.npy", np.arange(12.0).reshape(3, 4))
    for name in ("scale", "step"):
        said = refused(document.set.load_new_mesh, str(tmp_path / "map.npy"), **{name: -1.0})
        assert f"{name} must be at least 0, got -1" in said


def test_a_broken_file_is_refused(document, refused, tmp_path):
    (tmp_path / "broken.pfm").write_text("Pf\n3 3\n")
    assert "broken.pfm" in refused(document.set.load_new_mesh, str(tmp_path / "broken.pfm"))
    assert len(document) == 0
