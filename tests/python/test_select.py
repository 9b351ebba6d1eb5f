"""Crop, mask and remove; the dominant plane; true size and ground."""

import math

import numpy as np
import pytest
import surfrecon
from shapes import torus, torus_scans

TILT = np.array([[0.36, 0.48, -0.8, 5.0], [-0.8, 0.6, 0, -7.0], [0.48, 0.64, 0.6, 2.0], [0, 0, 0, 1.0]])


@pytest.fixture(scope="module")
def scans():
    return torus_scans()


@pytest.fixture
def files(scans, tmp_path):
    """The same scans in files, placed by a list."""
    surfrecon.write_scans(tmp_path / "all.conf", scans)
    return surfrecon.open(tmp_path / "all.conf")


def table_scans(count=7, noise=0.0):
    """A torus that stands on a table, the plane z = -0.6 before it is placed."""
    ring = torus()
    side = np.array([[-3, -3, -0.6], [3, -3, -0.6], [3, 3, -0.6], [-3, 3, -0.6]], float)
    n = len(ring.positions)
    mesh = surfrecon.Mesh(
        np.concatenate([ring.positions, side]),
        np.concatenate([ring.triangles.astype(np.int64), [[n, n + 1, n + 2], [n, n + 2, n + 3]]]),
    )
    all_ = []
    for k in range(count):
        turn = 2 * np.pi * k / count
        eye = (3 * np.cos(turn), 3 * np.sin(turn), 2.5)
        camera = surfrecon.Camera.pinhole(90, 120, height_angle=0.9, eye=eye, target=(0, 0, -0.3))
        image = surfrecon.virtual_scan(mesh, camera, noise=noise, seed=k)
        image.name = f"scan{k:02}"
        image.world_from_sensor = TILT @ image.world_from_sensor
        all_.append(image)
    return all_


def samples(image):
    return image.world_points()[image.valid]


def same_mesh(a, b):
    return a.positions.tobytes() == b.positions.tobytes() and a.triangles.tobytes() == b.triangles.tobytes()


BOX = surfrecon.Box.between((-2, -2, -0.1), (0.4, 2, 2))


def test_boxes_and_planes_part_points():
    points = np.random.default_rng(3).uniform(-2, 2, (1000, 3))
    inside = ((points >= (-2, -2, -0.1)) & (points <= (0.4, 2, 2))).all(axis=1)
    assert (BOX.contains(points) == inside).all() and 0 < inside.sum() < 1000
    turned = surfrecon.Box(TILT @ np.diag([1, 0.5, 0.2, 1]))
    back = (points @ TILT[:3, :3].T + TILT[:3, 3], (np.abs(points) <= (1, 0.5, 0.2)).all(axis=1))
    assert (turned.contains(back[0]) == back[1]).all() and "Box of 2" in repr(turned)
    plane = surfrecon.Plane((0, 0, 1), (0, 0, 5), margin=0.25)
    assert np.allclose(plane.height(points), points[:, 2] - 1)
    assert (plane.contains(points) == (points[:, 2] <= 1.25)).all()
    assert plane.with_margin(0).margin == 0 and plane.share is None and plane.spread is None
    assert np.allclose(plane.flipped().height(points), 1 - points[:, 2])
    picked = surfrecon.Plane.through([(0, 0, 1), (1, 0, 1), (0, 1, 1)])
    assert picked.normal.tolist() == [0, 0, 1] and picked.point.tolist() == [0, 0, 1]
    below = surfrecon.Plane.through([(0, 0, 1), (1, 0, 1), (0, 1, 1)], above=(0, 0, 0))
    assert below.normal.tolist() == [0, 0, -1]


def test_what_is_kept_of_an_image_stays_as_it_was(scans):
    image = scans[0]
    kept, rest = image.keep(BOX), image.remove(BOX)
    assert (kept.valid ^ rest.valid == image.valid).all() and kept.valid.any() and rest.valid.any()
    assert (BOX.contains(samples(kept))).all() and not BOX.contains(samples(rest)).any()
    assert np.array_equal(kept.points[kept.valid], image.points[kept.valid])
    assert (kept.world_from_sensor == image.world_from_sensor).all() and kept.name == image.name
    assert kept.projection == image.projection
    mask = image.valid & (np.arange(image.cols) % 2 == 0)
    assert (image.keep(mask).valid == mask).all()
    assert (image.remove(mask).valid == image.valid & ~mask).all()


@pytest.mark.parametrize("region", [BOX, surfrecon.Plane((0, 0, 0), (0.2, 0.3, 1), margin=0.05)])
def test_a_merge_of_what_is_kept_is_that_of_scans_cropped_by_hand(files, region):
    by_hand = []
    for scan in files:
        image = scan.read()
        values = image.points.copy()
        outside = ~region.contains(image.world_points().reshape(-1, 3)).reshape(image.valid.shape)
        values[outside] = np.nan
        cut = surfrecon.RangeImage.from_points(values, viewing=image.projection["viewing"], name=image.name)
        cut.world_from_sensor = image.world_from_sensor
        cut.confidence, cut.colour, cut.intensity = image.confidence, image.colour, image.intensity
        by_hand.append(cut)
    expected = surfrecon.merge(by_hand, voxel=0.06).mesh
    kept = files.keep(region)
    assert isinstance(kept, surfrecon.ScanSet) and kept.notes == files.notes and len(kept) == len(files)
    for threads in (1, 3):
        assert same_mesh(surfrecon.merge(kept, voxel=0.06, threads=threads).mesh, expected)
    assert same_mesh(surfrecon.merge(list(reversed(list(kept))), voxel=0.06).mesh, expected)
    assert same_mesh(surfrecon.merge(surfrecon.keep([s.read() for s in files], region), voxel=0.06).mesh, expected)
    assert len(expected.positions) < len(surfrecon.merge(files, voxel=0.06).mesh.positions)


def test_selections_stay_with_the_samples(files):
    """Kept samples stay kept wherever the scan is placed later, and whatever size it is given."""
    scan = files[3]
    size = surfrecon.true_size((0, 0, 0), (1, 0, 0), 10)
    moved = scan.keep(BOX).transformed(size).transformed(surfrecon.Similarity(TILT))
    valid = scan.keep(BOX).read().valid
    assert (moved.read().valid == valid).all()
    expected = surfrecon.Similarity(TILT) @ size
    assert np.allclose(samples(moved.read()), expected.apply(samples(scan.read().keep(BOX))), atol=1e-4)
    assert np.allclose(moved.world_from_sensor, moved.read().world_from_sensor)
    back = moved.transformed(expected.inverse())
    assert np.allclose(samples(back.read()), samples(scan.keep(BOX).read()), atol=1e-5)
    later = scan.transformed(size).keep(surfrecon.Box.between((-20, -20, -1), (4, 20, 20)))
    assert (later.read().valid == valid).mean() > 0.999


def test_masks_are_of_one_scan_each(files, scans):
    marks = [np.random.default_rng(k).random(scan.valid.shape) < 0.5 for k, scan in enumerate(scans)]
    kept = files.keep([marks[0], None, *marks[2:]])
    assert (kept[0].read().valid == scans[0].valid & marks[0]).all()
    assert (kept[1].read().valid == scans[1].valid).all()
    for k, image in enumerate(surfrecon.remove(scans, marks)):
        assert (image.valid == scans[k].valid & ~marks[k]).all()
    with pytest.raises(surfrecon.InputError, match="masks for .* scans"):
        files.keep(marks[1:])
    with pytest.raises(surfrecon.InputError, match=r"the mask has 3 x 5 pixels, but the image"):
        files[0].keep(np.zeros((3, 5), bool)).read()
    with pytest.raises(surfrecon.InputError, match=rf"{scans[1].name}.*the mask has"):
        surfrecon.keep(scans, [marks[0], np.zeros((3, 5), bool), *marks[2:]])


def test_meshes_and_clouds(tmp_path):
    mesh = torus()
    kept = mesh.keep(BOX)
    inside = BOX.contains(mesh.positions)
    assert np.array_equal(kept.positions, mesh.positions[inside])
    assert len(kept.triangles) == inside[mesh.triangles].all(axis=1).sum()
    assert np.array_equal(mesh.remove(~inside).positions, kept.positions)
    placed = mesh.keep(BOX, world_from_mesh=np.diag([1, 1, -1, 1]))
    assert np.array_equal(placed.positions, mesh.positions[BOX.contains(mesh.positions * (1, 1, -1))])
    (cut, pose, name), (_, _, unnamed) = surfrecon.keep([(mesh, np.eye(4), "ring"), mesh], BOX)
    assert np.array_equal(cut.positions, kept.positions) and (pose == np.eye(4)).all()
    assert name == "ring" and unnamed.startswith("mesh")
    path = tmp_path / "points.xyz"
    np.savetxt(path, mesh.positions[::7], fmt="%.17g")
    cloud = surfrecon.read(path)
    assert np.array_equal(cloud.keep(BOX).positions, cloud.positions[BOX.contains(cloud.positions)])
    assert np.array_equal(surfrecon.open(path)[0].keep(BOX).read().positions, cloud.keep(BOX).positions)
    doubled = cloud.transformed(surfrecon.Similarity(np.diag([2, 2, 2, 1])))
    assert np.array_equal(doubled.positions, 2 * cloud.positions)


@pytest.mark.parametrize("noise", [0.0, 0.004])
def test_the_table_is_found_and_goes(noise):
    scans = table_scans(noise=noise)
    plane = surfrecon.dominant_plane(scans)
    up = TILT[:3, :3] @ (0, 0, 1)
    assert math.acos(min(1, plane.normal @ up)) < 1e-6 + noise
    assert abs(plane.height([TILT[:3, :3] @ (0, 0, -0.6) + TILT[:3, 3]])[0]) < 1e-6 + noise / 2
    assert 0.5 < plane.share < 0.98 and plane.spread < 1e-5 + 2 * noise and plane.margin >= 3 * plane.spread
    same = surfrecon.dominant_plane(list(reversed(scans)), threads=1)
    assert same.point.tobytes() + same.normal.tobytes() == plane.point.tobytes() + plane.normal.tobytes()
    job = surfrecon.Job.dominant_plane(scans)
    assert job.result().normal.tobytes() == plane.normal.tobytes()
    left = surfrecon.remove(scans, plane)
    heights = np.concatenate([(samples(s) - TILT[:3, 3]) @ TILT[:3, :3] for s in left])[:, 2]
    assert heights.min() > -0.6 and 0.02 < len(heights) / sum(s.valid.sum() for s in scans) < 0.5
    ground = surfrecon.ground(plane)
    assert ground.scale == 1 and np.allclose(np.linalg.det(ground.matrix), 1)
    level = np.concatenate([samples(s) for s in surfrecon.transformed(scans, ground)])[:, 2]
    assert np.median(np.abs(level)) < 1e-6 + noise and level.max() > 0.9
    down = np.concatenate([samples(s) for s in surfrecon.transformed(scans, surfrecon.ground(plane, up="-y"))])[:, 1]
    assert np.median(np.abs(down)) < 1e-6 + noise and down.min() < -0.9


def test_where_there_is_no_table_that_is_said(scans, tmp_path):
    z = np.linspace(-1, 1, 5000)
    turn = np.arange(len(z)) * np.pi * (3 - 5**0.5)
    ball = np.stack([np.sqrt(1 - z**2) * np.cos(turn), np.sqrt(1 - z**2) * np.sin(turn), z], axis=1)
    np.savetxt(tmp_path / "ball.xyz", ball)
    with pytest.raises(surfrecon.InputError, match="no plane stands out.*three points"):
        surfrecon.dominant_plane(surfrecon.open(tmp_path / "ball.xyz"))
    with pytest.raises(surfrecon.ParameterError, match="min_share"):
        surfrecon.dominant_plane(scans, min_share=2)
    with pytest.raises(surfrecon.Cancelled):
        surfrecon.dominant_plane(scans, progress=lambda *_: False)
    with pytest.raises(TypeError, match="tolerence"):
        surfrecon.dominant_plane(scans, tolerence=2)


def test_true_size_scales_what_is_merged(files):
    size = surfrecon.true_size((1, 0, 0), (-1, 0, 0), 200)
    assert size.scale == 100
    large = files.transformed(size)
    for before, after in zip(files, large, strict=True):
        assert np.allclose(after.world_from_sensor[:3, :3], before.world_from_sensor[:3, :3], atol=1e-15)
        assert np.allclose(after.world_from_sensor[:3, 3], 100 * before.world_from_sensor[:3, 3])
    small_mesh, large_mesh = (surfrecon.merge(s, voxel=v).mesh for s, v in ((files, 0.08), (large, 8)))
    assert np.allclose(large_mesh.bounds, 100 * small_mesh.bounds, atol=2)
    moved = small_mesh.transformed(size)
    assert np.allclose(moved.positions, 100 * small_mesh.positions)
    assert np.allclose(moved.vertex_attributes["noise"], 100 * small_mesh.vertex_attributes["noise"])


def test_scans_without_samples_are_passed_over(files):
    half = surfrecon.Box.between((-9, -9, 0.3), (9, 9, 9))
    images = [scan.read() for scan in files.keep(half)]
    gone = surfrecon.Box.between((50, 50, 50), (51, 51, 51))
    mixed = [images[0].keep(gone), *images, files[0].keep(gone)]
    assert same_mesh(surfrecon.merge(mixed, voxel=0.06).mesh, surfrecon.merge(images, voxel=0.06).mesh)
    for scans in (files.keep(gone), surfrecon.keep(images, gone)):
        with pytest.raises(surfrecon.InputError, match="check what was kept of them"):
            surfrecon.merge(scans)
        with pytest.raises(surfrecon.InputError, match="check what was kept of them"):
            surfrecon.dominant_plane(scans)


def test_a_list_of_poses_can_t_say_another_size(scans, tmp_path):
    for scan in scans[:3]:
        scan.write(tmp_path / f"{scan.name}.ply")
    large = surfrecon.open(sorted(tmp_path.glob("*.ply"))).transformed(surfrecon.true_size((0, 0, 0), (1, 0, 0), 2))
    with pytest.raises(surfrecon.InputError, match="another size than its file"):
        surfrecon.align(large).write(tmp_path / "all.conf")


@pytest.mark.parametrize(
    ("call", "match"),
    [
        (lambda s: surfrecon.Box(np.diag([1, 1, 0, 1.0])), "the box is flat"),
        (lambda s: surfrecon.Box(np.full((4, 4), np.nan)), "must have finite entries"),
        (lambda s: surfrecon.Box(np.eye(3)), "shape"),
        (lambda s: surfrecon.Box.between((0, 0, 0), (1, 0, 1)), "along y"),
        (lambda s: surfrecon.Plane((0, 0, 0), (0, 0, 0)), "the normal of the plane"),
        (lambda s: surfrecon.Plane((0, 0, 0), (0, 0, 1), margin=np.nan), "the margin of the plane"),
        (lambda s: surfrecon.Plane.through([(0, 0, 0), (1, 1, 1), (2, 2, 2)]), "on one line"),
        (lambda s: surfrecon.Plane.through(np.eye(3), above=(1, 0, 0)), "lies on the plane"),
        (lambda s: surfrecon.Similarity(np.diag([1, 2, 1, 1.0])), "scale all directions alike"),
        (lambda s: surfrecon.Similarity(np.diag([-1, 1, 1, 1.0])), "mirrors"),
        (lambda s: surfrecon.true_size((1, 1, 1), (1, 1, 1), 3), "pick two that lie apart"),
        (lambda s: surfrecon.true_size((1, 1, 1), (1, 1, 2), -3), "the true distance must be > 0"),
        (lambda s: surfrecon.ground(surfrecon.Plane((0, 0, 0), (0, 0, 1)), up="up"), "up must be one of"),
        (lambda s: s[0].keep(np.zeros((2, 2), bool)), "the mask has 2 x 2"),
        (lambda s: s[0].keep(np.zeros((2, 2, 2), bool)), "a mask must have shape"),
        (lambda s: s[0].transformed(surfrecon.true_size((0, 0, 0), (1e-40, 0, 0), 9e34)), "too large|at most 1e75"),
    ],
)
def test_bad_input_is_refused_by_name(scans, call, match):
    with pytest.raises(surfrecon.InputError, match=match):
        call(scans)


@pytest.mark.parametrize("region", [3, "box", np.eye(4), object(), None])
def test_what_is_no_region_is_a_type_error(scans, region):
    with pytest.raises(TypeError, match="region must be"):
        scans[0].keep(region)
    with pytest.raises(TypeError, match="region must be"):
        surfrecon.keep(scans[:1], region if region is None or np.ndim(region) == 0 else [region])


def test_aligning_names_what_has_no_samples(truth):
    gone = surfrecon.Box.between((1e5, 1e5, 1e5), (2e5, 2e5, 2e5))
    aligned = surfrecon.align([*truth[:3], truth[3].keep(gone)])
    states = [scan.state for scan in aligned.report.scans]
    assert states[3] == "unplaced" and "unplaced" not in states[:2] and aligned.report.scans[3].reason


def test_a_matrix_does_for_a_similarity():
    mesh, matrix = torus(8), np.diag([2.0, 2.0, 2.0, 1.0])
    expected = mesh.transformed(surfrecon.Similarity(matrix)).positions
    assert np.array_equal(mesh.transformed(matrix).positions, expected)
    with pytest.raises(surfrecon.InputError, match=r"similarity must have shape \(4, 4\), got \(3, 3\)"):
        mesh.transformed(np.eye(3))


def test_a_scan_without_a_name_is_told_by_its_number(tmp_path):
    image = surfrecon.RangeImage.from_points(np.zeros((3, 3, 3)))
    with pytest.raises(surfrecon.InputError, match="^image 0: its rays are parallel"):
        surfrecon.write_scans(tmp_path / "a.ptx", [image])
