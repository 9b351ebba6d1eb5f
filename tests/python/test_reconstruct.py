"""Surfaces from scattered points through Python."""

import numpy as np
import pytest
import shapes
import surfrecon


def sphere(count, radius=1.0):
    """Points on a sphere, evenly spread."""
    i = np.arange(count)
    z = 1 - (2 * i + 1) / count
    ring, angle = np.sqrt(1 - z * z), np.pi * (5**0.5 - 1) * i
    return radius * np.stack([ring * np.cos(angle), ring * np.sin(angle), z], 1)


def volume(mesh):
    """Positive where triangles are counter-clockwise seen from outside."""
    a, b, c = np.moveaxis(mesh.positions[mesh.triangles], 1, 0)
    return float((a * np.cross(b, c)).sum() / 6)


def test_all_points_of_a_sphere_are_on_its_surface():
    points = sphere(1000)
    colour = np.arange(3000).reshape(-1, 3).astype(np.uint8)
    result = surfrecon.reconstruct(points, colour=colour)
    check = result.mesh.check()
    assert check["is_closed"] and check["is_manifold"] and check["genus"] == 0
    assert np.array_equal(result.mesh.positions, points) and len(result.mesh.triangles) == 2 * 1000 - 4
    assert 4.1 < volume(result.mesh) < 4 / 3 * np.pi
    assert np.array_equal(result.mesh.vertex_attributes["source_point"], np.arange(1000))
    assert np.array_equal(result.mesh.vertex_attributes["colour"][:, :3], colour)
    report = result.report
    assert report["points"] == report["used"] == 1000 and report["closed"] and report["tetrahedra"] > 1000


def test_what_is_dropped_is_named_with_its_reason():
    points = np.concatenate([sphere(500), [[np.nan, 0, 0]], sphere(500)[7:8], [[0, 0, 2.0]]])
    result = surfrecon.reconstruct(points)
    dropped = {reason: which.tolist() for reason, which in result.dropped.items()}
    assert dropped == {"not_finite": [500], "duplicate": [501], "inside": [], "outside": [502], "outlier": []}


def test_another_factor_gives_what_a_call_of_its_own_gives():
    points = sphere(2000)
    gap = points[points[:, 2] < 0.9]
    reconstructor = surfrecon.Reconstructor(gap)
    first = reconstructor.surface(closure="open")
    assert first.mesh.check()["boundary_loops"] == 1
    assert reconstructor.surface().mesh.check()["is_closed"]
    for factor in (1.0, 1.5, 2.0):
        again = reconstructor.surface(closure="open", factor=factor)
        alone = surfrecon.reconstruct(gap, closure="open", factor=factor)
        assert np.array_equal(again.mesh.triangles, alone.mesh.triangles)
    assert "tetrahedralize" in first.report["seconds"]


def test_sensors_and_normals_turn_the_surface():
    points = sphere(500)
    assert volume(surfrecon.reconstruct(points, sensors=(0, 0, 0)).mesh) < 0
    assert volume(surfrecon.reconstruct(points, sensors=2 * points).mesh) > 0
    assert volume(surfrecon.reconstruct(points, normals=-points).mesh) < 0


def test_an_open_surface_stays_open():
    y, x = np.mgrid[:40, :40] / 10.0
    points = np.stack([x, y, np.sin(x) * np.cos(y)], -1).reshape(-1, 3)
    result = surfrecon.reconstruct(points)
    check = result.mesh.check()
    assert not result.report["closed"] and check["is_manifold"] and check["boundary_loops"] == 1


def test_what_cannot_be_done_is_named():
    points = sphere(100)
    with pytest.raises(surfrecon.ParameterError, match="factor must be >= 1 and <= 2, got 3"):
        surfrecon.reconstruct(points, factor=3.0)
    with pytest.raises(surfrecon.ParameterError, match='topology must be "manifold" or "free", got "fluid"'):
        surfrecon.reconstruct(points, topology="fluid")
    with pytest.raises(surfrecon.InputError, match="at least 3 different points"):
        surfrecon.reconstruct(points[:2])
    with pytest.raises(surfrecon.InputError, match="one plane, which encloses nothing"):
        surfrecon.reconstruct(points * (1, 1, 0), closure="closed")
    with pytest.raises(surfrecon.InputError, match="3 normals for 100 points"):
        surfrecon.Reconstructor(points, normals=points[:3])
    with pytest.raises(surfrecon.InputError, match="sensor"):
        surfrecon.Reconstructor(points, sensors=points[:3])
    with pytest.raises(surfrecon.InputError, match="toward"):
        surfrecon.Reconstructor(points, toward=points[:3])


def test_turning_to_a_place_only_turns():
    points = np.random.default_rng(0).normal(size=(500, 3))
    points /= np.linalg.norm(points, axis=1)[:, None]
    made = surfrecon.Reconstructor(points, toward=(0, 0, 0)).surface().mesh
    corners = made.positions[made.triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert ((normals * corners.mean(axis=1)).sum(axis=1) < 0).all()


def test_a_range_image_s_points_know_their_sensor():
    x, y = np.meshgrid(np.arange(40.0), np.arange(40.0)) + 0.2 * np.random.default_rng(1).random((2, 40, 40))
    # The right half lies twenty behind the left one.
    points = np.stack([x, y, 100 + np.where(x < 20, 0, 20.0) + y**2 / 64], 2).astype(np.float32)
    image = surfrecon.RangeImage.from_points(points, viewing=("from", (20, 20, -1000)))
    image.world_from_sensor = [[1, 0, 0, 5], [0, 1, 0, 6], [0, 0, 1, 7], [0, 0, 0, 1]]
    assert np.allclose(image.sensor, (25, 26, -993))
    cloud = image.to_cloud()
    assert np.array_equal(cloud.sensor, (20, 20, -1000)) and np.array_equal(cloud.positions, points.reshape(-1, 3))
    assert np.array_equal(cloud.world_from_cloud, image.world_from_sensor) and len(cloud.normals) == 1600
    assert np.allclose(cloud.transformed(surfrecon.Similarity(np.diag([2, 2, 2, 1.0]))).sensor, (40, 40, -2000))
    known = surfrecon.reconstruct(cloud).mesh
    told = surfrecon.reconstruct(cloud.positions, sensors=(20, 20, -1000)).mesh
    assert np.array_equal(known.triangles, told.triangles)
    # Without normals it would also be turned the other way.
    unknown = surfrecon.reconstruct(cloud.positions, toward=(20, 20, -1000)).mesh
    assert not np.array_equal(known.triangles, unknown.triangles)
    parallel = surfrecon.RangeImage.from_points(points)
    assert parallel.sensor is None and parallel.to_cloud().sensor is None


def test_points_in_one_plane_are_triangulated_in_it():
    u, v = np.meshgrid(np.arange(30.0), np.arange(20.0))
    keep = ~((u > 10) & (u < 18) & (v > 6) & (v < 14))
    points = u[keep][:, None] * (2.0, 2.0, 1.0) + v[keep][:, None] * (1.0, -2.0, 2.0)
    colour = np.arange(4 * len(points), dtype=np.uint8).reshape(-1, 4)
    made = surfrecon.reconstruct(points, colour=colour)
    assert len(made.mesh.positions) == len(points) and np.array_equal(made.mesh.positions, points)
    assert made.report["tetrahedra"] == 0 and not made.report["closed"]
    a, b, c = points[made.mesh.triangles.T]
    normals = np.cross(b - a, c - a)
    assert (normals[:, 2] > 0).all(), "upwards"
    # 9 for each square of the lattice; of the hole no more than its corners is closed.
    squares = np.linalg.norm(normals, axis=1).sum() / 2 / 9
    assert 29 * 19 - 64 <= squares < 29 * 19 - 64 / 2
    assert np.array_equal(made.mesh.vertex_attributes["colour"], colour)


LINE = np.arange(20.0)[:, None] * (1.0, 2.0, 3.0)
BAD = {
    "empty": np.zeros((0, 3)),
    "one": np.ones((1, 3)),
    "two": sphere(2),
    "collinear": LINE,
    "all equal": np.ones((1000, 3)),
    "nothing finite": np.full((50, 3), np.nan),
    "infinite": np.full((50, 3), np.inf),
}


@pytest.mark.parametrize("name", BAD)
@pytest.mark.parametrize("topology", ["manifold", "free"])
def test_points_without_a_surface_are_refused_with_the_reason(name, topology):
    with pytest.raises(surfrecon.InputError, match="at least 3 different points|one line") as problem:
        surfrecon.reconstruct(BAD[name], topology=topology)
    if "3 different" in str(problem.value):
        assert f"of {len(BAD[name])} given" in str(problem.value)


@pytest.mark.parametrize("scale", [1e-300, 1e-150, 1e150, 1e300])
def test_any_scale_gives_the_same_surface(scale):
    points = sphere(300)
    same = surfrecon.reconstruct(points).mesh.triangles
    assert len(same) == 2 * 300 - 4
    made = surfrecon.reconstruct(points * scale)
    assert len(made.mesh.triangles) == len(same) and made.mesh.check()["is_closed"]


def test_copies_and_points_that_are_no_numbers_change_nothing():
    points = sphere(400)
    alone = surfrecon.reconstruct(points)
    bad = [[np.nan, 0, 0], [np.inf, 0, 0], [0, -np.inf, 0]]
    made = surfrecon.reconstruct(np.concatenate([*[points] * 5, bad]))
    assert np.array_equal(made.mesh.positions, alone.mesh.positions)
    assert np.array_equal(made.mesh.triangles, alone.mesh.triangles)
    assert len(made.dropped["duplicate"]) == 1600 and made.dropped["not_finite"].tolist() == [2000, 2001, 2002]


def test_one_point_at_the_end_of_the_world_spoils_nothing():
    points = np.concatenate([sphere(400), [[1e300, 1e300, -1e300]]])
    made = surfrecon.reconstruct(points)
    assert made.dropped["outside"].tolist() == [400] and made.mesh.check()["is_closed"]


def test_progress_reports_and_cancels():
    points = np.random.default_rng(1).normal(size=(150_000, 3))
    points /= np.linalg.norm(points, axis=1)[:, None]
    with pytest.raises(surfrecon.Cancelled):
        surfrecon.reconstruct(points, threads=1, progress=lambda stage, fraction: False)
    job = surfrecon.Job.surface(surfrecon.Reconstructor(points), threads=1)
    job.cancel()
    with pytest.raises(surfrecon.Cancelled):
        job.result()


def test_a_busy_reconstructor_says_so():
    points = np.random.default_rng(1).normal(size=(150_000, 3))
    points /= np.linalg.norm(points, axis=1)[:, None]
    reconstructor = surfrecon.Reconstructor(points)
    told = []

    def again(stage, fraction):
        try:
            reconstructor.surface()
        except surfrecon.InputError as problem:
            told.append(str(problem))
        return False

    with pytest.raises(surfrecon.Cancelled):
        reconstructor.surface(progress=again)
    assert "another surface" in told[0]


def test_places_and_colours_that_are_none_are_named():
    points = np.random.default_rng(0).normal(size=(100, 3))
    nan = np.nan
    with pytest.raises(surfrecon.InputError, match=r"sensor origin lies at \(NaN, NaN, NaN\), .* or no sensor where"):
        surfrecon.reconstruct(points, sensors=[nan] * 3)
    some = np.full((100, 3), nan)
    some[3] = (0, nan, 1)
    with pytest.raises(surfrecon.InputError, match=r"sensor origin 3 lies at \(0, NaN, 1\), .* or three NaN where"):
        surfrecon.reconstruct(points, sensors=some)
    with pytest.raises(surfrecon.InputError, match=r"toward.* finite coordinates .* got \(NaN, 0, 0\)"):
        surfrecon.reconstruct(points, toward=(nan, 0, 0))
    with pytest.raises(surfrecon.InputError, match=r"colour: floats must be from 0 to 1, got 255. .*uint8"):
        surfrecon.reconstruct(points, colour=np.full((100, 3), 255.0))
    with pytest.raises(surfrecon.InputError, match=r"got -0\.5"):
        surfrecon.reconstruct(points, colour=np.full((100, 3), -0.5))
    white = surfrecon.reconstruct(points, colour=np.full((100, 3), 1.0)).mesh
    assert (white.vertex_attributes["colour"] == 255).all()


def test_what_are_no_points_says_what_to_give(tmp_path):
    depths = 2 + 0.1 * np.random.default_rng(0).random((9, 9))
    image = surfrecon.RangeImage.pinhole(depths, focal=(9, 9), centre=(4, 4))
    for call in (surfrecon.reconstruct, surfrecon.Reconstructor):
        with pytest.raises(TypeError, match=r"got a RangeImage: give its \.to_cloud\(\)"):
            call(image)
        with pytest.raises(TypeError, match=r"got a Mesh: give its \.positions"):
            call(image.triangulate())
        path = tmp_path / "points.ply"
        surfrecon.write(path, image.to_cloud())
        for given in (path, str(path)):
            with pytest.raises(TypeError, match=r"got a path: give what surfrecon\.read\(path\) returns"):
                call(given)
        scans = surfrecon.open(path)
        with pytest.raises(TypeError, match=r"got a ScanSet: give what \.read\(\) of one of its scans returns"):
            call(scans)
        with pytest.raises(TypeError, match=r"got a Scan: give what its \.read\(\) returns"):
            call(scans[0])
    with pytest.raises(TypeError, match=r"got a RangeImage: give its \.triangulate\(\), or its \.to_cloud\(\)"):
        surfrecon.cluster(image, vertices=20)


def test_outliers_around_clean_points_are_left_out_unless_all_are_wanted():
    rng = np.random.default_rng(2)
    points = rng.normal(size=(5000, 3))
    points /= np.linalg.norm(points, axis=1)[:, None]
    points = np.concatenate([points, rng.uniform(-1, 1, (250, 3))])
    found = surfrecon.reconstruct(points)
    outliers = found.dropped["outlier"]
    assert len(outliers) > 150 and (outliers < 5000).sum() < 5 and found.report.closed
    assert abs(np.linalg.norm(found.mesh.positions, axis=1) - 1).max() < 0.2
    assert len(surfrecon.reconstruct(points, noisy_points="as_clean").dropped["outlier"]) == 0


def off_the_sphere(made):
    """Root mean square of the distances of the vertices from the unit sphere."""
    return np.sqrt(((np.linalg.norm(made.mesh.positions, axis=1) - 1) ** 2).mean())


def test_noisy_points_are_smoothed_unless_the_surface_is_to_go_through_them():
    points = shapes.noisy_sphere()
    options = [{}, {"smooth": 0.3}, {"noisy_points": "put_back"}]
    smoothed, near, through = (surfrecon.reconstruct(points, **option) for option in options)
    for made in (smoothed, near, through):
        # The measured figures of the points are the same whatever is made of them. Their noise is one spacing.
        assert made.report["noise"] == smoothed.report["noise"] and made.report["spacing"] == smoothed.report["spacing"]
        outliers = made.dropped["outlier"]
        assert (outliers >= 5000).sum() > 120 and (outliers < 5000).sum() < 50
        check = made.mesh.check()
        assert check["is_closed"] and check["is_manifold"] and check["genus"] == 0
    assert smoothed.report["spacing"] == pytest.approx(shapes.NOISY_SPACING, rel=0.1)
    assert smoothed.report["noise"] == pytest.approx(shapes.NOISY_SPACING, rel=0.25)
    assert near.report["smoothing"] == 0.3 and smoothed.report["smoothing"] > 0.3
    assert through.report["smoothing"] == through.report["moved"] == 0
    used = through.mesh.vertex_attributes["source_point"]
    assert np.array_equal(through.mesh.positions, points[used])
    for made, part in ((smoothed, 0.25), (near, 0.5)):
        assert made.report["moved"] == pytest.approx(shapes.NOISY_SPACING, rel=0.25)
        assert off_the_sphere(made) < part * off_the_sphere(through)
    both = surfrecon.reconstruct(points, smooth=0.3, noisy_points="put_back")
    assert np.array_equal(both.mesh.triangles, near.mesh.triangles) and both.report["smoothing"] == 0
    used = both.mesh.vertex_attributes["source_point"]
    assert np.array_equal(both.mesh.positions, points[used])


def test_noise_may_be_ignored():
    points = shapes.noisy_sphere()
    made = surfrecon.reconstruct(points, noisy_points="as_clean")
    assert made.report["noise"] > 0.5 * made.report["spacing"]
    assert made.report["smoothing"] == made.report["moved"] == len(made.dropped["outlier"]) == 0
    used = made.mesh.vertex_attributes["source_point"]
    assert np.array_equal(made.mesh.positions, points[used])
    assert not made.report.closed and made.mesh.check()["is_manifold"]
    with_a_radius = surfrecon.reconstruct(points, noisy_points="as_clean", smooth=0.3)
    assert np.array_equal(with_a_radius.mesh.triangles, made.mesh.triangles)
