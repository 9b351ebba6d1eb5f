"""A range image as vertices that a host keeps, and back."""

import copy
import json
import pickle

import numpy as np
import pytest
import surfrecon

ROWS, COLS = 40, 50


def made(kind):
    """A bent surface as an image of that kind."""
    row, col = np.mgrid[0:ROWS, 0:COLS]
    values = 2 + 0.1 * np.sin(0.2 * row) * np.cos(0.15 * col)
    values[3:5, 7] = values[0, 0] = np.nan
    step = (0.01, -0.01)
    if kind == "orthographic":
        image = surfrecon.RangeImage.orthographic(values, step=step, first=(-0.2, 0.2))
    elif kind == "spherical":
        image = surfrecon.RangeImage.spherical(values, step=step, first=(-0.2, 0.2))
    elif kind == "points":
        bent = np.dstack([0.01 * col, 0.01 * row, -values])
        image = surfrecon.RangeImage.from_points(bent, viewing=("from", (0.1, 0.2, 3)))
    elif kind == "parallel":
        image = surfrecon.RangeImage.from_points(np.dstack([0.01 * col, 0.01 * row, -values]))
    else:
        image = surfrecon.RangeImage.pinhole(values, focal=(80, 81), centre=(25, 20), depth=kind)
    image.colour = np.random.default_rng(1).integers(0, 255, (ROWS, COLS, 4), np.uint8)
    image.intensity = row + col
    image.confidence = 1 / (1 + row)
    return image


KINDS = ["orthographic", "planar", "ray", "spherical", "points", "parallel"]


@pytest.fixture(params=KINDS)
def image(request):
    return made(request.param)


def similarity(scale=1.0, mirror=False):
    rotation = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0], [0.48, 0.64, 0.6]])
    matrix = np.eye(4)
    matrix[:3, :3] = scale * rotation @ np.diag([1, -1 if mirror else 1, 1])
    matrix[:3, 3] = 1, -2, 0.5
    return matrix


def moved(points, matrix):
    return points @ matrix[:3, :3].T + matrix[:3, 3]


def back(camera, mesh, positions=None, kept=slice(None), **more):
    """The image of a mesh's vertices with all their attributes."""
    attributes = {name: values[kept] for name, values in mesh.vertex_attributes.items()}
    row, col = attributes.pop("range_row"), attributes.pop("range_col")
    positions = (mesh.positions if positions is None else positions)[kept]
    return surfrecon.RangeImage.from_vertices(camera, row, col, positions, **attributes, **more)


def test_vertices_are_the_valid_pixels(image):
    mesh = image.to_mesh()
    assert set(mesh.vertex_attributes) == {"range_row", "range_col", "colour", "intensity", "confidence"}
    row, col = np.nonzero(image.valid)
    assert (mesh.vertex_attributes["range_row"] == row).all() and (mesh.vertex_attributes["range_col"] == col).all()
    assert np.allclose(mesh.positions, image.points[image.valid], atol=1e-12)
    for name in ("colour", "intensity", "confidence"):
        assert (mesh.vertex_attributes[name] == getattr(image, name)[image.valid]).all()
    surface = image.triangulate()
    assert (mesh.positions[mesh.triangles] == surface.positions[surface.triangles]).all()
    assert len(image.to_mesh(False).triangles) == len(image.to_mesh(faces=False).triangles) == 0
    assert (image.to_mesh(faces=False).positions == mesh.positions).all()


def test_what_was_not_moved_comes_back(image):
    image.world_from_sensor = similarity()
    same = back(image.grid_camera(), image.to_mesh(), world_from_host=image.world_from_sensor, name="scan")
    assert same.name == "scan" and same.projection == image.projection
    assert (same.world_from_sensor == image.world_from_sensor).all() and (same.valid == image.valid).all()
    assert np.allclose(same.points[same.valid], image.points[image.valid], atol=1e-9)
    for name in ("colour", "intensity", "confidence"):
        assert (getattr(same, name)[same.valid] == getattr(image, name)[image.valid]).all()


@pytest.mark.parametrize("mirror", [False, True])
@pytest.mark.parametrize("baked", [False, True])
def test_the_projection_stays_of_its_kind_however_the_vertices_are_moved(image, mirror, baked):
    mesh = image.to_mesh()
    matrix = similarity(0.3, mirror)
    positions = (moved(mesh.positions, matrix) if baked else mesh.positions).astype(np.float32)
    kept = np.random.default_rng(5).random(len(positions)) < 0.5
    again = back(image.grid_camera(), mesh, positions, kept, world_from_host=None if baked else matrix)
    assert again.projection["kind"] == image.projection["kind"] and again.valid.sum() == kept.sum()
    pose = again.world_from_sensor
    assert np.allclose(pose[:3, :3] @ pose[:3, :3].T, np.eye(3)) and np.linalg.det(pose[:3, :3]) > 0
    there = moved(image.points[image.valid][kept], matrix)
    assert np.allclose(again.world_points()[again.valid], there, atol=2e-6)
    for name in ("colour", "intensity", "confidence"):
        assert (getattr(again, name)[again.valid] == getattr(image, name)[image.valid][kept]).all()


def test_what_was_edited_or_stretched_is_a_grid_of_points(image):
    mesh = image.to_mesh()
    edited = mesh.positions.astype(np.float32)
    edited[::7] += (0.02, 0.03, 0.01)
    stretch = similarity() @ np.diag([1, 2, 0.5, 1])
    for positions, matrix in ((edited, similarity(2.0)), (mesh.positions, stretch)):
        again = back(image.grid_camera(), mesh, positions, world_from_host=matrix)
        assert again.projection["kind"] == "points"
        assert np.allclose(again.world_points()[again.valid], moved(positions, matrix), atol=5e-6)


def test_a_host_stores_the_camera_and_has_its_own_unit(image):
    camera = image.grid_camera()
    assert (camera.rows, camera.cols) == (ROWS, COLS) and camera.projection == image.projection
    assert camera.anchors.shape == (256, 5) and camera.anchors.dtype == np.float64
    row, col = camera.anchors[:, :2].astype(int).T
    assert np.allclose(image.points[row, col], camera.anchors[:, 2:], atol=1e-12)
    stored = surfrecon.GridCamera(camera.rows, camera.cols, camera.projection, camera.anchors.tolist())
    assert (stored.anchors == camera.anchors).all() and stored.projection == camera.projection
    assert repr(stored) == "<GridCamera 40 x 50 pixels, 256 anchors>"
    mesh = image.to_mesh()
    larger = stored.scaled(1000)
    assert np.allclose(larger.anchors[:, 2:], 1000 * camera.anchors[:, 2:])
    again = back(larger, mesh, (1000 * mesh.positions).astype(np.float32))
    assert again.projection == larger.projection and (again.world_from_sensor == np.eye(4)).all()
    # Lists, as what hosts store often comes back as.
    listed = surfrecon.GridCamera(ROWS, COLS, json.loads(json.dumps(camera.projection)))
    assert listed.projection == camera.projection and listed.anchors.shape == (0, 5)
    assert listed != camera == pickle.loads(pickle.dumps(camera)) == copy.deepcopy(camera)


def test_without_anchors_vertices_lie_in_the_sensor_s_frame(image):
    bare = surfrecon.GridCamera(ROWS, COLS, image.projection)
    again = back(bare, image.to_mesh(), world_from_host=similarity(0.3, True))
    assert again.projection["kind"] == image.projection["kind"]


def test_moved_vertices_of_which_too_few_are_known_are_refused(image):
    """A guess would be seen from a wrong place, and its surface turned inside out."""
    camera, mesh = image.grid_camera(), image.to_mesh()
    known = {(int(row), int(col)) for row, col in camera.anchors[:2, :2]}
    row, col = (mesh.vertex_attributes[name] for name in ("range_row", "range_col"))
    few = np.array([(r, c) in known for r, c in zip(row, col, strict=True)])
    positions = moved(mesh.positions, similarity()).astype(np.float32)
    with pytest.raises(surfrecon.InputError, match="only 2 of those .* nothing tells from where they were seen"):
        back(camera, mesh, positions, kept=few)
    # All is known of vertices where they were, or where the matrix takes them.
    assert back(camera, mesh, kept=few, world_from_host=similarity()).projection["kind"] == image.projection["kind"]
    assert back(camera, mesh, positions, kept=few, world_from_host=similarity()).valid.sum() == 2


def test_an_edit_stays_however_far_off_another_lies():
    image = made("planar")
    camera, mesh = image.grid_camera(), image.to_mesh()
    edited = mesh.positions.copy()
    edited[3::7] += (0.02, 0.02, 0)
    edited[0] *= 1e4
    again = back(camera, mesh, edited)
    assert np.allclose(again.world_points()[again.valid], edited, rtol=1e-6, atol=1e-6)


def test_what_is_no_range_image_is_refused():
    image = made("planar")
    camera, mesh = image.grid_camera(), image.to_mesh()
    row, col = (mesh.vertex_attributes[name].copy() for name in ("range_row", "range_col"))

    def refused(words, row=row, col=col, positions=mesh.positions, camera=camera, **more):
        with pytest.raises(surfrecon.InputError, match=words):
            surfrecon.RangeImage.from_vertices(camera, row, col, positions, **more)

    outside, twice, infinite = row.astype(np.int64), col.copy(), mesh.positions.copy()
    outside[9], twice[3], infinite[4] = 2**40, twice[2], np.inf
    refused("vertex 9 is pixel", row=outside)
    refused("vertices 2 and 3 are both pixel", col=twice)
    refused("vertex 4", positions=infinite)
    refused("row must have shape", row=row[:-1])
    refused("flattens", world_from_host=np.diag([1.0, 0, 1, 1]))
    refused("in one plane", positions=mesh.positions * (1, 1, 0))
    refused("in one place", positions=np.ones_like(mesh.positions))
    refused("^pixel .*confidence is -1", confidence=np.full(len(row), -1.0))
    refused("1048576 x 1048576", camera=surfrecon.GridCamera(2**20, 2**20, image.projection))
    with pytest.raises(TypeError):
        surfrecon.RangeImage.from_vertices(camera, row.astype(float), col, mesh.positions)


def test_a_camera_that_cannot_be_is_refused():
    projection = {"kind": "pinhole", "focal": (1, 1), "centre": (0, 0), "depth": "planar"}
    anchors = np.zeros((2, 5))
    for arguments, words in (
        ((-1, 1, projection), "rows is -1, but must be at least 0"),
        ((1, 1, projection | {"focal": (0, 1)}), "focal length fx"),
        ((1, 1, projection | {"depth": "deep"}), 'depth of projection must be "planar" or "ray"'),
        ((1, 1, projection | {"kind": "fish"}), "kind of projection must be"),
        ((1, 1, {"kind": "orthographic", "first": (0, 0)}), 'projection must have "step"'),
        ((1, 1, projection, anchors + 1), "anchor 0 is pixel"),
        ((1, 1, projection, anchors + 0.5), "must be whole numbers"),
        ((1, 1, projection, np.zeros((257, 5))), "at most 256 anchors"),
        ((1, 1, projection, anchors[:, :4]), "anchors must have shape"),
    ):
        with pytest.raises(surfrecon.InputError, match=words):
            surfrecon.GridCamera(*arguments)
    for scale in (0, -1, np.nan):
        with pytest.raises(surfrecon.InputError, match="scale must be > 0"):
            surfrecon.GridCamera(1, 1, projection).scaled(scale)
