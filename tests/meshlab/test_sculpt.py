"""Import and sculpting in MeshLab: the grid of a range image survives what users do to layers."""

import numpy as np
import pytest
import surfrecon
from conftest import IMPORT, SCULPT, Document, has_scalars, length, matrix, scalars
from files import write_range_grid, write_set
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
    assert out["max_error"] == expected.max_error <= TOLERANCE
    assert out["full_triangles"] > out["triangles"]
    error = expected.mesh.vertex_attributes["error"].astype(float)
    assert np.array_equal(loaded.current.vertex_scalar_array(), error)


def test_a_default_is_the_library_s_though_meshlab_has_it_in_single_precision(document, tmp_path):
    """Whole numbers, so that a tolerance a millionth larger takes other triangles."""
    heights = np.round(1000 * np.random.default_rng(1).random((40, 40))).cumsum(axis=0) % 1001
    np.save(tmp_path / "whole.npy", heights)
    document.set.load_new_mesh(str(tmp_path / "whole.npy"))
    out = document.run(SCULPT)
    expected = surfrecon.sculpt(surfrecon.read(str(tmp_path / "whole.npy")))
    assert out["tolerance"] == expected.tolerance and out["triangles"] == len(expected.mesh.triangles)


def test_the_range_image_is_left_as_it_is(loaded):
    before = loaded.current.vertex_matrix(), loaded.current.face_matrix()
    name = loaded.current.label()
    loaded.run(SCULPT)
    assert loaded.current.label() == f"{name} sculpted" and len(loaded) == 2
    layer = loaded.named(name)
    assert np.array_equal(layer.vertex_matrix(), before[0]) and np.array_equal(layer.face_matrix(), before[1])


@pytest.mark.parametrize(
    ("here", "there"),
    [
        ({"effort": 2}, {"effort": 2}),
        ({"interpolate": False}, {"interpolate": False}),
        ({"simplify_borders": True}, {"simplify_borders": True}),
        ({"effort": 0}, {"effort": 0}),
    ],
)
def test_each_option_is_the_library_s(loaded, path, here, there):
    loaded.run(SCULPT, tolerance=length(TOLERANCE), **here)
    wanted = surfrecon.sculpt(surfrecon.open(str(path))[0].read(), tolerance=TOLERANCE, **there)
    same(loaded.current, wanted.mesh)


def test_angles_are_given_in_degrees(loaded, path):
    loaded.run(SCULPT, tolerance=length(TOLERANCE), min_angle=20)
    wanted = surfrecon.sculpt(surfrecon.open(str(path))[0].read(), tolerance=TOLERANCE, min_angle=np.radians(20))
    same(loaded.current, wanted.mesh)


def test_at_most_so_many_triangles(loaded):
    out = loaded.run(SCULPT, max_triangles=200)
    assert 100 < loaded.current.face_number() <= 200
    assert out["tolerance"] > 0


def test_each_kind_of_image_is_sculpted_as_the_library_does(document, tmp_path):
    """A height map and a depth image: their pixels see along other rays than those of a grid of points."""
    row, column = np.mgrid[0:50, 0:70]
    heights = np.sin(row / 9) * np.cos(column / 7) + 5
    np.save(tmp_path / "heights.npy", heights)
    for options, camera in (({}, {}), ({"camera": (80.0, 80, 35, 25)}, {"camera": "80 80 35 25"})):
        image = surfrecon.open(str(tmp_path / "heights.npy"), **options)[0].read()
        document.run(IMPORT, file=str(tmp_path / "heights.npy"), **camera)
        points = image.points[image.valid]
        assert np.allclose(document.current.vertex_matrix(), points, rtol=1e-15)
        out = document.run(SCULPT, tolerance=length(TOLERANCE))
        wanted = surfrecon.sculpt(image, tolerance=TOLERANCE)
        assert out["triangles"] == len(wanted.mesh.triangles) and out["max_error"] <= TOLERANCE
        assert np.allclose(document.current.vertex_matrix(), wanted.mesh.positions, rtol=1e-12)


@pytest.mark.parametrize("scale", [1.0, 4.0])
@pytest.mark.parametrize("mirror", [1, -1])
@pytest.mark.parametrize("camera", ["", "80 80 35 25"])
def test_a_moved_range_image_is_still_one(document, tmp_path, camera, mirror, scale):
    """Freezing its matrix moves the vertices: the camera has to follow. `range_layer.cpp` asks it of all kinds."""
    row, column = np.mgrid[0:50, 0:70]
    np.save(tmp_path / "heights.npy", np.sin(row / 9) * np.cos(column / 7) + 5)
    document.run(IMPORT, file=str(tmp_path / "heights.npy"), camera=camera)
    name = document.current.label()
    before = document.run(SCULPT, tolerance=length(TOLERANCE))
    expected = document.current.vertex_matrix()
    document.named(name)
    motion = np.eye(4)
    motion[:3, :3] = scale * np.array([[0, -1, 0], [1, 0, 0], [0, 0, mirror]])
    motion[:3, 3] = 3, 4, 5
    document.run("set_matrix", transformmatrix=motion, freeze=True)
    out = document.run(SCULPT, tolerance=length(scale * TOLERANCE))
    assert out["triangles"] == pytest.approx(before["triangles"], rel=0.02)
    assert out["max_error"] == pytest.approx(scale * before["max_error"], rel=0.02)
    there, found = expected @ motion[:3, :3].T + motion[:3, 3], document.current.vertex_matrix()
    room = 2 * scale * TOLERANCE
    assert np.allclose(found.min(0), there.min(0), atol=room) and np.allclose(found.max(0), there.max(0), atol=room)


def test_a_project_keeps_no_grid_and_that_is_said(loaded, refused, tmp_path):
    """MeshLab writes no custom attributes into it."""
    before = loaded.current.vertex_matrix()
    loaded.set.save_current_mesh(str(tmp_path / "layer.ply"))
    loaded.set.save_project(str(tmp_path / "project.mlp"))
    again = Document()
    again.set.load_project(str(tmp_path / "project.mlp"))
    assert np.array_equal(again.current.vertex_matrix(), before)
    said = refused(again.run, SCULPT)
    assert "range_row" in said and "Import Range Images" in said


def test_the_result_lies_where_the_layer_lies(document, images, tmp_path):
    document.run(IMPORT, file=str(write_set(tmp_path, images[:1])))
    pose = matrix(document.current)
    assert np.allclose(pose, images[0].world_from_sensor, atol=1e-6)
    document.run(SCULPT)
    assert np.array_equal(matrix(document.current), pose)


def test_a_copy_of_the_layer(loaded, expected, refused):
    """MeshLab's copies lose what belongs to the layer as a whole, in some versions what belongs to vertices too."""
    loaded.run("generate_copy_of_current_mesh")
    if not has_scalars(loaded.current, "range_row"):
        assert "range_row" in refused(loaded.run, SCULPT)
        return
    out = loaded.run(SCULPT, tolerance=length(TOLERANCE))
    assert out["max_error"] <= TOLERANCE
    assert out["triangles"] == pytest.approx(len(expected.mesh.triangles), rel=0.2)


def test_deleted_vertices_are_holes(loaded):
    full = loaded.run(SCULPT, tolerance=length(0))["covered_pixels"]
    loaded.named(loaded.layers()[0].label())
    rows = scalars(loaded.current, "range_row")
    middle = float(np.median(rows))
    loaded.run("compute_selection_by_condition_per_vertex", condselect=f"range_row > {middle}")
    loaded.run("meshing_remove_selected_vertices")
    left = loaded.run(SCULPT, tolerance=length(0))["covered_pixels"]
    assert 0.3 * full < left < 0.7 * full


def test_any_layer_that_knows_its_pixels_is_a_range_image(document):
    """Another filter, or a script, may say which pixel each vertex is."""
    row, column = (x.reshape(-1).astype(float) for x in np.mgrid[0:30, 0:40])
    positions = np.column_stack([column, -row, np.sin(row / 9) * np.cos(column / 7)])
    corner = (np.arange(29)[:, None] * 40 + np.arange(39)).reshape(-1)
    quads = np.stack([corner, corner + 40, corner + 41, corner + 1], 1)
    layer = document.add(positions, np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]), "made")
    layer.add_vertex_custom_scalar_attribute(row, "range_row")
    layer.add_vertex_custom_scalar_attribute(column, "range_col")
    out = document.run(SCULPT, tolerance=length(0.125))
    assert out["covered_pixels"] == 1200 and out["max_error"] <= 0.125
    assert out["triangles"] < 500
    normals = document.current.face_normal_matrix()
    assert (normals[:, 2] > 0).all()


def test_a_layer_without_a_grid_is_refused(document, refused):
    document.add(np.eye(3), np.array([[0, 1, 2]]), "plain")
    said = refused(document.run, SCULPT)
    assert '"plain"' in said and "range_row" in said and "Import Range Images" in said


def test_a_grid_with_a_pixel_twice_is_refused(document, refused):
    layer = document.add(np.eye(3), np.array([[0, 1, 2]]), "twice")
    layer.add_vertex_custom_scalar_attribute(np.zeros(3), "range_row")
    layer.add_vertex_custom_scalar_attribute(np.array([0.0, 1, 1]), "range_col")
    assert "row 0, column 1" in refused(document.run, SCULPT)


@pytest.mark.parametrize("value", [-1.0, 0.5, 1e30, np.nan, 4e9])
def test_a_grid_of_nonsense_is_refused(document, refused, value):
    layer = document.add(np.eye(3), np.array([[0, 1, 2]]), "nonsense")
    layer.add_vertex_custom_scalar_attribute(np.array([0, 1, value]), "range_row")
    layer.add_vertex_custom_scalar_attribute(np.arange(3.0), "range_col")
    assert '"nonsense"' in refused(document.run, SCULPT)
    assert len(document) == 1


@pytest.mark.parametrize(
    ("parameters", "said"),
    [
        ({"max_triangles": -1}, "at least 0"),
        ({"max_triangles": 1}, "triangles"),
        ({"tolerance": length(-1)}, "tolerance"),
        ({"min_angle": 45}, "min_angle must be 0 to 30 degrees, got 45"),
        ({"effort": 3}, "effort must be >= 0 and <= 2, got 3"),
    ],
)
def test_wrong_parameters_are_named(loaded, refused, parameters, said):
    assert said in refused(loaded.run, SCULPT, **parameters)
    assert len(loaded) == 1


def test_what_can_not_be_imported_is_said(document, refused, tmp_path):
    assert "Choose the file" in refused(document.run, IMPORT)
    missing = tmp_path / "missing.ply"
    assert "missing.ply" in refused(document.run, IMPORT, file=str(missing))
    broken = tmp_path / "broken.ply"
    broken.write_text("ply\nformat ascii 1.0\nelement vertex 3\n")
    assert "broken.ply" in refused(document.run, IMPORT, file=str(broken))
    np.save(tmp_path / "flat.npy", np.zeros((4, 4)))
    assert "fx fy cx cy" in refused(document.run, IMPORT, file=str(tmp_path / "flat.npy"), camera="525 525")
    assert len(document) == 0


def test_points_only_on_request(document, images, tmp_path):
    path = write_set(tmp_path, images[:2])
    document.run(IMPORT, file=str(path), faces=False)
    assert [layer.face_number() for layer in document.layers()] == [0, 0]
    out = document.run(SCULPT, tolerance=length(TOLERANCE))
    assert out["max_error"] <= TOLERANCE
