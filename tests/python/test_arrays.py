"""Arrays in and out: shapes, types, what is shared and what is copied."""

import gc
import re

import numpy as np
import pytest
import surfrecon

TRIANGLE = (np.eye(3), [[0, 1, 2]])


def address(array):
    return array.__array_interface__["data"][0]


@pytest.fixture
def mesh():
    return surfrecon.Mesh(
        np.eye(3),
        np.array([[0, 1, 2]], np.int32),
        colour=np.array([[1, 2, 3], [4, 5, 6], [7, 8, 9]], np.uint8),
        confidence=[0.5, 1, 2],
    )


@pytest.fixture
def image():
    points = np.random.default_rng(1).random((5, 7, 3), np.float32)
    points[2, 3] = np.nan
    return surfrecon.RangeImage.from_points(points, name="scan")


def test_views_share_memory_and_keep_it_alive(mesh):
    for get in (
        lambda m: m.positions,
        lambda m: m.triangles,
        lambda m: m.vertex_attributes["colour"],
        lambda m: m.vertex_attributes["confidence"],
    ):
        first, second = get(mesh), get(mesh)
        assert address(first) == address(second)
        assert not first.flags.owndata
    positions = surfrecon.Mesh(*TRIANGLE).positions
    gc.collect()
    assert np.array_equal(positions, np.eye(3))


def test_triangles_are_int32_without_a_copy(mesh):
    triangles = mesh.triangles
    signed = triangles.view(np.int32).reshape(-1)
    assert address(signed) == address(triangles)
    assert signed.dtype == np.int32 and signed.flags.c_contiguous


def test_views_refuse_writing(mesh, image):
    for array in (mesh.positions, mesh.triangles, image.points):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0
        with pytest.raises(ValueError, match="WRITEABLE"):
            array.flags.writeable = True


def test_a_view_outlives_a_change_of_its_image(image):
    points = image.points
    before = points.copy()
    image.colour = np.zeros((5, 7, 3), np.uint8)
    first = image.colour
    image.colour = np.full((5, 7, 4), 255, np.uint8)
    assert np.array_equal(points, before, equal_nan=True)
    assert first[0, 0].tolist() == [0, 0, 0, 255]
    assert image.colour.min() == 255


def test_points_of_a_grid_are_a_view(image):
    assert address(image.points) == address(image.points)
    assert image.points.dtype == np.float32 and image.points.shape == (5, 7, 3)
    assert image.valid.sum() == 34 and not image.valid[2, 3]


def test_values_are_a_view_and_points_follow_the_projection():
    z = np.arange(12.0).reshape(3, 4)
    image = surfrecon.RangeImage.orthographic(z, step=(0.5, -2), first=(10, 20))
    assert address(image.values) == address(image.values)
    assert image.points[2, 3].tolist() == [11.5, 16, 11]
    pinhole = surfrecon.RangeImage.pinhole(np.full((3, 4), 2.0), focal=(100, 50), centre=(1, 1))
    assert pinhole.points[2, 3].tolist() == [0.04, 0.04, 2]
    ray = surfrecon.RangeImage.pinhole(np.full((3, 4), 2.0), focal=(1, 1), centre=(1, 1), depth="ray")
    assert np.linalg.norm(ray.points[2, 3]) == pytest.approx(2)
    spherical = surfrecon.RangeImage.spherical(np.full((3, 4), 2.0), step=(0.1, 0.1))
    assert np.allclose(np.linalg.norm(spherical.points, axis=2), 2)
    assert image.projection == {"kind": "orthographic", "first": (10, 20), "step": (0.5, -2)}
    assert pinhole.projection["depth"] == "planar" and spherical.projection["kind"] == "spherical"


def test_world_points_are_posed_points(image):
    pose = np.array([[0, -1, 0, 1e7], [1, 0, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1.0]])
    image.world_from_sensor = pose
    assert np.array_equal(image.world_from_sensor, pose)
    expected = image.points.astype(float) @ pose[:3, :3].T + pose[:3, 3]
    assert np.allclose(image.world_points(), expected, rtol=0, atol=1e-8, equal_nan=True)


@pytest.mark.parametrize("dtype", [np.float32, np.float64, np.int16, ">f8"])
def test_positions_of_any_real_type(dtype):
    positions = np.arange(9).reshape(3, 3).astype(dtype)
    assert surfrecon.Mesh(positions, [[0, 1, 2]]).positions.tolist() == positions.tolist()
    assert surfrecon.Mesh(positions.T, [[0, 1, 2]]).positions.tolist() == positions.T.tolist()


@pytest.mark.parametrize("dtype", [np.int32, np.uint32, np.int64, np.uint64, np.uint8])
def test_triangles_of_any_integer_type(dtype):
    assert surfrecon.Mesh(np.eye(3), np.array([[2, 1, 0]], dtype)).triangles.tolist() == [[2, 1, 0]]


def test_positions_f32_is_flat(mesh):
    flat = mesh.positions_f32()
    assert flat.dtype == np.float32 and flat.tolist() == np.eye(3).reshape(-1).tolist()


def test_colours_from_bytes_and_shares():
    colours = [[1.0, 0.5, 0.0]] * 3
    mesh = surfrecon.Mesh(*TRIANGLE, colour=colours)
    assert mesh.vertex_attributes["colour"][0].tolist() == [255, 128, 0, 255]


@pytest.mark.parametrize(
    ("positions", "triangles", "error", "text"),
    [
        (np.eye(4), [[0, 1, 2]], surfrecon.InputError, "positions must have shape (n, 3), got (4, 4)"),
        (np.zeros(3), [[0, 1, 2]], surfrecon.InputError, "positions must have shape (n, 3), got (3,)"),
        (np.eye(3), [[0, 1, 3]], surfrecon.InputError, "triangle 0 names vertex 3, but there are only 3 vertices"),
        (np.eye(3), [[0, 1, 2], [0, 1, -1]], surfrecon.InputError, "triangle 1 names vertex -1"),
        (np.eye(3), [[0, 1, 2**40]], surfrecon.InputError, "triangle 0 names vertex 1099511627776"),
        (np.eye(3) * np.nan, [[0, 1, 2]], surfrecon.InputError, "vertex 0 has a coordinate that is not finite"),
        (np.eye(3), [[0, 1, 2.0]], TypeError, "triangles must be integers, got float64"),
        (np.eye(3) * 1j, [[0, 1, 2]], TypeError, "positions must be real numbers, got complex128"),
        (["abc"], [[0, 1, 2]], TypeError, "positions must be real numbers, got str"),
        (None, [[0, 1, 2]], TypeError, "positions must be real numbers, got object"),
    ],
)
def test_bad_meshes_are_refused_by_name(positions, triangles, error, text):
    with pytest.raises(error, match=re.escape(text)):
        surfrecon.Mesh(positions, triangles)


@pytest.mark.parametrize(
    ("options", "error", "text"),
    [
        ({"colour": np.zeros((2, 3), np.uint8)}, surfrecon.InputError, "colour must have shape (3, n), got (2, 3)"),
        ({"colour": np.zeros((3, 2), np.uint8)}, surfrecon.InputError, "colour must have 3 or 4 channels, got 2"),
        ({"colour": np.zeros((3, 3), np.uint16)}, TypeError, "colour must be uint8 or float, got uint16"),
        ({"confidence": [1, -1, 1]}, surfrecon.InputError, "confidence of vertex 1 must be a finite number >= 0"),
        ({"confidence": [1, 1]}, surfrecon.InputError, "confidence must have shape (3,), got (2,)"),
    ],
)
def test_bad_attributes_are_refused_by_name(options, error, text):
    with pytest.raises(error, match=re.escape(text)):
        surfrecon.Mesh(*TRIANGLE, **options)


@pytest.mark.parametrize(
    ("pose", "text"),
    [
        (np.eye(3), "world_from_sensor must have shape (4, 4), got (3, 3)"),
        (np.diag([2.0, 2, 2, 1]), "world_from_sensor must be rigid"),
        (np.diag([-1.0, 1, 1, 1]), "world_from_sensor must be rigid"),
        (np.diag([0.0, 1, 1, 1]), "flattens space"),
        (np.ones((4, 4)), "must end with the row 0 0 0 1"),
        (np.eye(4) * np.nan, "must have finite entries"),
    ],
)
def test_bad_poses_are_refused_and_change_nothing(image, pose, text):
    with pytest.raises(surfrecon.InputError, match=re.escape(text)):
        image.world_from_sensor = pose
    assert np.array_equal(image.world_from_sensor, np.eye(4))


def test_poses_of_few_digits_become_rigid(image):
    # As 7-Scenes has them: off by 1e-4.
    given = np.array(
        [[0.7035, 0.3190, -0.6349, -0.9], [-0.3710, 0.9270, 0.0548, -0.3], [0.6060, 0.1970, 0.7705, 0.8], [0, 0, 0, 1]]
    )
    image.world_from_sensor = given
    taken = image.world_from_sensor
    axes = taken[:3, :3]
    assert np.abs(axes.T @ axes - np.eye(3)).max() < 1e-15
    assert np.abs(axes - given[:3, :3]).max() < 2e-4 and np.array_equal(taken[:, 3], given[:, 3])
    image.world_from_sensor = taken
    assert np.array_equal(image.world_from_sensor, taken), "what is rigid stays as it is"


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: surfrecon.RangeImage.from_points(np.zeros((3, 3))), "points must have shape (n, n, 3), got (3, 3)"),
        (lambda: surfrecon.RangeImage.from_points(np.zeros((2, 2, 3)), viewing=("parallel", (0, 0, 0))), "direction"),
        (
            lambda: surfrecon.RangeImage.from_points(np.zeros((2, 2, 3)), viewing=("above", (0, 0, 1))),
            "'above'|\"above",
        ),
        (lambda: surfrecon.RangeImage.from_points(np.zeros((2, 2, 3)), viewing=3), "viewing must be"),
        (lambda: surfrecon.RangeImage.orthographic(np.zeros((2, 2)), step=(0, 1)), "step"),
        (lambda: surfrecon.RangeImage.pinhole(np.zeros((2, 2)), focal=(1, np.nan), centre=(0, 0)), "focal"),
        (lambda: surfrecon.RangeImage.spherical(np.zeros(2), step=(1, 1)), "values must have shape"),
    ],
)
def test_bad_images_are_refused(make, text):
    with pytest.raises(surfrecon.InputError, match=text if "|" in text else re.escape(text)):
        make()


def test_bad_confidences_are_refused_and_change_nothing(image):
    confidence = np.ones((5, 7))
    confidence[2, 3] = -1  # an invalid pixel: means nothing
    image.confidence = confidence
    confidence[1, 1] = np.nan
    with pytest.raises(surfrecon.InputError, match=re.escape("pixel (1, 1)")):
        image.confidence = confidence
    assert image.confidence[1, 1] == 1


def test_points_far_away_are_refused_before_they_lose_detail():
    x, y = np.meshgrid(np.arange(5.0), np.arange(4.0))
    points = np.stack([x, y, np.zeros_like(x)], axis=2) * 0.01 + 1 / 3
    assert surfrecon.RangeImage.from_points(points).valid.all()
    with pytest.raises(surfrecon.InputError, match="put it into world_from_sensor"):
        surfrecon.RangeImage.from_points(points + 4.5e6)
    image = surfrecon.RangeImage.from_points(points)
    pose = np.eye(4)
    pose[:3, 3] = 4.5e6
    image.world_from_sensor = pose
    assert np.allclose(image.world_points(), points + 4.5e6, rtol=0, atol=1e-7)


def test_an_empty_mesh_is_a_mesh():
    mesh = surfrecon.Mesh(np.zeros((0, 3)), np.zeros((0, 3), np.int32))
    assert mesh.positions.shape == (0, 3) and mesh.triangles.shape == (0, 3) and mesh.positions_f32().shape == (0,)


def test_colours_become_linear_light():
    colours = np.random.default_rng(4).integers(0, 256, (1000, 4), np.uint8)
    found = surfrecon.linear_colours(colours)
    assert found.dtype == np.float32 and found.shape == (4000,)
    share = colours / 255
    light = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)
    light[:, 3] = share[:, 3]
    assert np.allclose(found.reshape(-1, 4), light, rtol=0, atol=1e-7)
    # Any layout of memory.
    assert np.array_equal(surfrecon.linear_colours(colours[::2]), found.reshape(-1, 4)[::2].reshape(-1))
    assert np.array_equal(surfrecon.linear_colours(np.asfortranarray(colours)), found)
    assert len(surfrecon.linear_colours(colours[:0])) == 0
    with pytest.raises(surfrecon.InputError, match=r"colours must have shape \(n, 4\), got \(1000, 3\)"):
        surfrecon.linear_colours(colours[:, :3])
    for wrong in (colours.astype(np.uint16), colours.astype(np.int8), colours / 255, "red"):
        with pytest.raises((TypeError, surfrecon.InputError), match="colours must"):
            surfrecon.linear_colours(wrong)


def test_masked_entries_are_no_numbers():
    heights = np.ma.masked_array(np.arange(20).reshape(4, 5), np.eye(4, 5))
    image = surfrecon.RangeImage.orthographic(heights, step=(1.0, 1.0))
    assert np.array_equal(image.valid, ~heights.mask)
    plain = surfrecon.RangeImage.orthographic(np.ma.masked_array(heights.data), step=(1.0, 1.0))
    assert plain.valid.all()
    masked = np.ma.masked_array([[0, 1, 2]], [[False, False, True]])
    with pytest.raises(TypeError, match="integers, got masked entries: leave these out"):
        surfrecon.Mesh(np.eye(3), masked)
