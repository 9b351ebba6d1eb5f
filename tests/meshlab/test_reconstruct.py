"""Surfaces through points in MeshLab: the library's surface, in the layer's frame, with what is refused."""

import numpy as np
import pytest
import surfrecon
from conftest import IMPORT, RECONSTRUCT, matrix, scalars


def sphere(count):
    """Points on a sphere, evenly spread."""
    i = np.arange(count)
    z = 1 - (2 * i + 1) / count
    ring, angle = np.sqrt(1 - z * z), np.pi * (5**0.5 - 1) * i
    return np.stack([ring * np.cos(angle), ring * np.sin(angle), z], 1)


def volume(layer):
    a, b, c = np.moveaxis(layer.vertex_matrix()[layer.face_matrix()], 1, 0)
    return float((a * np.cross(b, c)).sum() / 6)


def same(layer, mesh):
    assert np.array_equal(layer.vertex_matrix(), mesh.positions)
    assert np.array_equal(layer.face_matrix(), mesh.triangles)


def test_it_is_the_library_s_surface(document):
    points = np.concatenate([sphere(700), [[0, 0, 3.0]], sphere(700)[5:6]])
    document.add(points, name="points")
    out = document.run(RECONSTRUCT)
    expected = surfrecon.reconstruct(points)
    same(document.current, expected.mesh)
    assert document.current.label() == "points surface" and len(document) == 2
    assert volume(document.current) > 4
    assert (out["points"], out["used"], out["outside"], out["duplicates"]) == (702, 700, 1, 1) and out["closed"]
    assert out["tetrahedra"] == expected.report["tetrahedra"]
    assert np.array_equal(scalars(document.current, "source_point"), np.arange(700))
    assert document.named("points").vertex_number() == 702


def test_options_are_the_library_s(document):
    points = sphere(2000)
    points = points[points[:, 2] < 0.9]
    document.add(points, name="cut")
    for threshold in ("local", "global"):
        for closure in ("auto", "closed", "open"):
            document.named("cut")
            document.run(
                RECONSTRUCT,
                factor=1.3,
                threshold=["local", "global"].index(threshold),
                closure=["auto", "closed", "open"].index(closure),
            )
            made = surfrecon.reconstruct(points, factor=1.3, threshold=threshold, closure=closure)
            same(document.current, made.mesh)
    document.add(sphere(2000), name="whole")
    document.run(RECONSTRUCT, topology=1, factor=2.0)
    same(document.current, surfrecon.reconstruct(sphere(2000), topology="free", factor=2.0).mesh)


def test_normals_turn_it(document):
    points = sphere(500)
    document.add(points, name="points", v_normals_matrix=-points)
    document.run(RECONSTRUCT, use_normals=True)
    assert volume(document.current) < 0
    document.named("points")
    document.run(RECONSTRUCT)
    assert volume(document.current) > 0


def test_colours_and_the_layer_s_place_are_kept(document):
    points = sphere(300)
    colours = np.linspace(0, 1, 1200).reshape(-1, 4)
    layer = document.add(points, name="points", v_color_matrix=colours)
    document.set.set_matrix(transformmatrix=np.array([[0, -1, 0, 5.0], [1, 0, 0, 6], [0, 0, 1, 7], [0, 0, 0, 1]]))
    placed = matrix(document.named("points"))
    document.run(RECONSTRUCT)
    assert np.array_equal(matrix(document.current), placed)
    assert np.array_equal(document.current.vertex_color_matrix(), document.named("points").vertex_color_matrix())
    assert layer.vertex_number() == 300


def test_what_cannot_be_done_is_named(document, refused):
    document.add(sphere(2), name="few")
    assert "at least 3 different points" in refused(document.run, RECONSTRUCT)
    document.add(sphere(50) * (1, 1, 0), name="flat")
    assert "one plane, which encloses nothing" in refused(document.run, RECONSTRUCT, closure=1)
    document.add(sphere(50), name="fine")
    assert "factor must be >= 1 and <= 2, got 3" in refused(document.run, RECONSTRUCT, factor=3)
    document.add(np.full((50, 3), np.nan), name="broken")
    assert "of 50 given, 0 are" in refused(document.run, RECONSTRUCT)
    assert len(document) == 4


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_vertices_that_are_no_numbers_are_left_out_and_counted(document, value):
    points = sphere(300)
    points[[3, 77], [1, 2]] = value
    document.add(points, name="broken")
    out = document.run(RECONSTRUCT)
    same(document.current, surfrecon.reconstruct(points).mesh)
    assert (out["not_finite"], out["used"]) == (2, 298)
    assert np.array_equal(scalars(document.current, "source_point"), np.delete(np.arange(300), [3, 77]))


@pytest.mark.parametrize("factor", [1.0, 2.0])
def test_huge_coordinates_are_points_too(document, factor):
    document.add(1e30 * sphere(200), name="far")
    document.run(RECONSTRUCT, factor=factor)
    assert document.current.face_number() == 2 * 200 - 4


def test_an_imported_range_image_knows_its_sensor(document, tmp_path):
    x, y = np.meshgrid(np.arange(40.0), np.arange(40.0)) + 0.2 * np.random.default_rng(1).random((2, 40, 40))
    points = np.stack([x, y, 100 + np.where(x < 20, 0, 20.0) + y**2 / 64], 2).astype(np.float32)
    image = surfrecon.RangeImage.from_points(points, viewing=("from", (0, 0, 0)))
    image.world_from_sensor = [[1, 0, 0, 5], [0, 1, 0, 6], [0, 0, 1, 7], [0, 0, 0, 1]]
    surfrecon.write_scans(tmp_path / "scan.e57", [image])
    document.run(IMPORT, file=str(tmp_path / "scan.e57"))
    vertices = document.current.vertex_matrix()
    document.run(RECONSTRUCT)
    expected = surfrecon.reconstruct(vertices, sensors=(0, 0, 0)).mesh
    assert np.array_equal(document.current.face_matrix(), expected.triangles)
    assert not np.array_equal(surfrecon.reconstruct(vertices, toward=(0, 0, 0)).mesh.triangles, expected.triangles)
