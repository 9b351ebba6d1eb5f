"""Textures through Python: images of photos on a mesh, in the shapes and types that are promised."""

import numpy as np
import pytest
import surfrecon
from photos import around, coloured, photo_of, waves
from shapes import torus

SIZE = 128
PLAIN = dict(size=SIZE, refine_cameras=False, match_exposure=False, drop_highlights=False)


@pytest.fixture(scope="module")
def detail():
    return torus(48)


@pytest.fixture(scope="module")
def flat():
    return surfrecon.unwrap(torus(12), size=SIZE, padding=2).mesh


@pytest.fixture(scope="module")
def photos(detail):
    return around(detail)


@pytest.fixture(scope="module")
def textured(flat, detail, photos):
    return surfrecon.texture(flat, detail, photos, normal_map=True, height_map=True, occlusion_rays=4, **PLAIN)


def same_tiles(one, other):
    maps = ("colour", "mask", "normal", "height", "occlusion")
    pairs = [(getattr(a, name), getattr(b, name)) for a, b in zip(one.tiles, other.tiles, strict=True) for name in maps]
    return all((a is None and b is None) or np.array_equal(a, b) for a, b in pairs)


def test_images_have_the_shapes_and_types_that_are_promised(textured, photos):
    (tile,) = textured.tiles
    found = {
        name: (getattr(tile, name).shape, getattr(tile, name).dtype)
        for name in ("colour", "mask", "normal", "height", "occlusion")
    }
    plane, three = (SIZE, SIZE), (SIZE, SIZE, 3)
    assert found == {
        "colour": (three, np.uint8),
        "mask": (plane, np.uint8),
        "normal": (three, np.uint8),
        "height": (plane, np.uint16),
        "occlusion": (plane, np.uint8),
    }
    assert textured.size == SIZE and repr(textured) == f"<Textured 1 tile of {SIZE} texels>"
    assert textured.world_from_camera.shape == (len(photos), 4, 4)
    with pytest.raises(ValueError, match="read-only"):
        tile.colour[0] = 0


def test_the_report_counts_what_the_mask_shows(textured, photos):
    mask, report = textured.tiles[0].mask, textured.report
    assert set(np.unique(mask)) <= {0, 128, 255}
    assert report.texels == (mask > 0).sum() and report.seen == (mask == 255).sum() > 0.8 * report.texels
    assert report.tiles == 1 and [photo.name for photo in report.photos] == [photo.name for photo in photos]
    assert all(photo.texels > 0 and photo.reason == "" and photo.moved == 0 for photo in report.photos)
    low, high = report.heights
    assert low < 0 < high < 0.1


def test_texels_have_the_colours_of_the_places_behind_them(textured, flat, detail):
    # Colours of the detailed surface's vertices are known without any photo.
    known = surfrecon.texture(flat, coloured(detail), **PLAIN).tiles[0]
    seen = textured.tiles[0].mask == 255
    apart = np.abs(known.colour.astype(int) - textured.tiles[0].colour)[seen]
    assert apart.mean() < 4 and np.percentile(apart, 95) < 14


def test_without_photos_colours_are_those_of_vertices(flat, detail):
    found = surfrecon.texture(flat, coloured(detail), size=SIZE)
    assert set(np.unique(found.tiles[0].mask)) == {0, 128} and found.report.seen == 0
    assert found.report.photos == [] and found.report.differences is None and found.report.heights is None
    tile = found.tiles[0]
    assert tile.normal is None and tile.height is None and tile.occlusion is None
    one_colour = coloured(detail, lambda places: np.full(places.shape, (10, 200, 30), np.uint8))
    assert (surfrecon.texture(flat, one_colour, size=SIZE).tiles[0].colour == (10, 200, 30)).all()


def test_one_photo_colours_its_side_and_fills_the_other(flat, detail):
    red = photo_of(detail, "red", (0, 0, 6), lambda places: np.full(places.shape, (200, 40, 20), np.uint8))
    found = surfrecon.texture(flat, detail, [red], size=SIZE)
    mask = found.tiles[0].mask
    assert (mask == 255).any() and (mask == 128).any()
    # Pixels at the rim show the background as well.
    assert np.median(np.abs(found.tiles[0].colour[mask == 255].astype(int) - (200, 40, 20)).max(axis=-1)) < 2
    assert found.report.differences is None


def test_a_black_photo_says_nothing_and_the_report_why(flat, detail, photos):
    black = photo_of(detail, "black", (0, 0, 6), lambda places: np.zeros(places.shape, np.uint8))
    black = surfrecon.Photo("black", np.zeros_like(black.read()), black.focal, black.centre, black.world_from_camera)
    found = surfrecon.texture(flat, detail, [black, *photos], **PLAIN)
    assert same_tiles(found, surfrecon.texture(flat, detail, photos, **PLAIN))
    assert found.report.photos[0].reason == "100 % of its pixels are black or overexposed"


def test_neither_threads_nor_the_order_of_photos_matter(flat, detail, photos):
    options = dict(size=SIZE, normal_map=True, height_map=True, occlusion_rays=2)
    one = surfrecon.texture(flat, detail, photos, threads=1, **options)
    two = surfrecon.texture(flat, detail, photos[::-1], threads=2, **options)
    assert same_tiles(one, two)
    assert np.array_equal(one.world_from_camera, two.world_from_camera[::-1])
    assert [photo.moved for photo in one.report.photos] == [photo.moved for photo in two.report.photos][::-1]


def test_cameras_are_moved_back_and_where_they_went_is_told(flat, detail):
    # Fine waves hold the cameras.
    right = around(detail, count=8, colour=lambda places: waves(4 * places), shape=(200, 240))
    pushed = []
    for k, photo in enumerate(right):
        pose = photo.world_from_camera
        pose[:3, 3] += 0.02 * np.array([(-1) ** k, np.sin(k), np.cos(k)])
        pushed.append(surfrecon.Photo(photo.name, photo.read(), photo.focal, photo.centre, pose))
    found = surfrecon.texture(flat, detail, pushed, size=SIZE)
    before, after = found.report.differences
    assert after < before and all(photo.moved > 0 for photo in found.report.photos)

    def pixels(pose, photo):
        places = np.c_[detail.positions, np.ones(len(detail.positions))] @ np.linalg.inv(pose).T
        return photo.focal[0] * places[:, :2] / places[:, 2:3]

    def error(poses):
        pairs = zip(poses, right, strict=True)
        apart = [pixels(pose, photo) - pixels(photo.world_from_camera, photo) for pose, photo in pairs]
        return np.linalg.norm(apart, axis=-1).mean()

    assert error(found.world_from_camera) < 0.5 * error([photo.world_from_camera for photo in pushed])


def test_what_can_not_be_textured_is_refused_with_the_remedy(flat, detail, photos):
    with pytest.raises(surfrecon.InputError, match="has no texture coordinates, but texturing needs some: unwrap it"):
        surfrecon.texture(detail, detail, photos)
    with pytest.raises(surfrecon.InputError, match="neither photos nor colours .* give at least one of the two"):
        surfrecon.texture(flat, detail)
    with pytest.raises(surfrecon.InputError, match="two photos are called photo 0: names must differ"):
        surfrecon.texture(flat, detail, [photos[0], photos[0]])
    with pytest.raises(surfrecon.ParameterError, match="size must be >= 16 and <= 16384, got 8"):
        surfrecon.texture(flat, detail, photos, size=8)
    with pytest.raises(TypeError, match="photo 1 must be a surfrecon.Photo, got"):
        surfrecon.texture(flat, detail, [photos[0], "photo.jpg"])
    huge = surfrecon.Photo("huge", list, (40, 40), (1, 1), np.eye(4), shape=(2**40, 2**40))
    with pytest.raises(surfrecon.OutOfMemoryError, match="use smaller tiles or photos"):
        surfrecon.texture(flat, detail, [huge], size=16)
    with pytest.raises(TypeError, match="sizes"):
        surfrecon.texture(flat, detail, photos, sizes=8)


def test_it_is_cancelled(flat, detail, photos):
    with pytest.raises(surfrecon.Cancelled):
        surfrecon.texture(flat, detail, photos, size=SIZE, progress=lambda stage, fraction: False)
    stages = []
    surfrecon.texture(flat, detail, photos, size=SIZE, progress=lambda stage, fraction: stages.append(fraction))
    assert stages[-1] == 1 and stages == sorted(stages)


def test_a_job_does_the_same(flat, detail, photos, textured):
    options = dict(normal_map=True, height_map=True, occlusion_rays=4, **PLAIN)
    found = surfrecon.Job.texture(flat, detail, photos, **options).result()
    assert same_tiles(found, textured)
    with pytest.raises(TypeError, match="photo 0"):
        surfrecon.Job.texture(flat, detail, [None])


def test_a_photo_keeps_what_it_is_made_of():
    generator = np.random.default_rng(5)
    pixels = generator.integers(0, 256, (20, 30, 3)).astype(np.uint8)
    depths = generator.random((10, 15)).astype(np.float32)
    pose = np.eye(4)
    pose[:3, 3] = 1, 2, 3
    photo = surfrecon.Photo("one", pixels, (40, 41), (14.5, 9.5), pose, depths)
    assert (photo.name, photo.shape, photo.focal, photo.centre) == ("one", (20, 30), (40, 41), (14.5, 9.5))
    assert np.array_equal(photo.world_from_camera, pose) and np.array_equal(photo.read(), pixels)
    assert np.array_equal(photo.read_depths(), depths) and repr(photo) == '<Photo "one" 20 x 30>'
    alpha = np.dstack([pixels, np.zeros((20, 30), np.uint8)])
    again = surfrecon.Photo("two", alpha, (40, 41), (14.5, 9.5), pose)
    assert np.array_equal(again.read(), pixels) and again.read_depths() is None


def test_depths_of_a_photo_hide_what_lies_behind(flat, detail):
    eye = (0, 0, 6)
    clear = photo_of(detail, "one", eye)
    near = photo_of(detail, "one", eye, depths=np.full((100, 120), 1.0))
    seen = [surfrecon.texture(flat, coloured(detail), [photo], **PLAIN).report.seen for photo in (clear, near)]
    assert seen[0] > 0 and seen[1] == 0


def test_pixels_may_be_given_when_they_are_needed(flat, detail, photos, textured):
    asked = []

    def lazy(photo):
        def pixels():
            asked.append(photo.name)
            return photo.read()

        shape = photo.shape
        return surfrecon.Photo(photo.name, pixels, photo.focal, photo.centre, photo.world_from_camera, shape=shape)

    given = [lazy(photo) for photo in photos]
    assert asked == []
    found = surfrecon.texture(flat, detail, given, **PLAIN)
    assert np.array_equal(found.tiles[0].colour, textured.tiles[0].colour)
    # To be compared, and for the tile.
    assert sorted(asked) == sorted(2 * [photo.name for photo in photos])


def test_an_exception_of_a_function_comes_out(flat, detail):
    def gone():
        raise FileNotFoundError("photo.jpg is gone")

    photo = surfrecon.Photo("one", gone, (40, 40), (14.5, 9.5), np.eye(4), shape=(20, 30))
    with pytest.raises(FileNotFoundError, match="is gone"):
        surfrecon.texture(flat, detail, [photo], size=SIZE)
    with pytest.raises(FileNotFoundError, match="is gone"):
        photo.read()
    with pytest.raises(FileNotFoundError, match="is gone"):
        surfrecon.Job.texture(flat, detail, [photo], size=SIZE).result()
    other = surfrecon.Photo("two", lambda: np.zeros((5, 6, 3), np.uint8), (4, 4), (2, 2), np.eye(4), shape=(20, 30))
    with pytest.raises(surfrecon.InputError, match="has 6 x 5 pixels, but its camera 30 x 20: scale the camera or"):
        surfrecon.texture(flat, detail, [other], size=SIZE)


def test_photos_that_can_not_be_used_are_refused_at_once():
    pixels = np.zeros((20, 30, 3), np.uint8)
    usual = dict(name="one", pixels=pixels, focal=(40, 40), centre=(14.5, 9.5), world_from_camera=np.eye(4))

    def make(**changed):
        return surfrecon.Photo(**usual | changed)

    make()
    with pytest.raises(TypeError, match=r"shape must be \(rows, cols\) if a function gives the pixels"):
        make(pixels=lambda: pixels)
    with pytest.raises(surfrecon.InputError, match=r"the pixels of one must have 3 or 4 channels, got 2"):
        make(pixels=np.zeros((20, 30, 2), np.uint8))
    with pytest.raises(surfrecon.InputError, match="scale the camera or the photo"):
        make(shape=(40, 60))
    with pytest.raises(surfrecon.InputError, match="world_from_camera must be rigid"):
        make(world_from_camera=np.diag([2.0, 2, 2, 1]))
    with pytest.raises(surfrecon.InputError, match="focal length fx must be above 0, got -40"):
        make(focal=(-40, 40))
    with pytest.raises(surfrecon.InputError, match="depths of 0 x 0 pixels"):
        make(depths=np.zeros((0, 0)))
    with pytest.raises(TypeError, match="shapes"):
        make(shapes=(20, 30))
