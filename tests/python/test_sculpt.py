"""Sculpting through Python: arrays in, mesh and certificate out."""

import os
from pathlib import Path

import numpy as np
import pytest
import surfrecon


@pytest.fixture(scope="module")
def image():
    y, x = np.mgrid[:90, :120] / 20.0
    heights = np.sin(x) * np.cos(y)
    heights[30:40, 50:70] = np.nan
    return surfrecon.RangeImage.orthographic(heights, step=(0.05, -0.05))


def test_every_sample_is_within_the_tolerance(image):
    result = surfrecon.sculpt(image, tolerance=0.01)
    assert 0 < result.max_error <= result.max_error_single and result.max_error <= result.tolerance == 0.01
    errors = result.error_image
    assert errors.shape == (90, 120) and errors.dtype == np.float32
    assert np.array_equal(np.isnan(errors), ~image.valid)
    worst = np.abs(errors[result.worst_pixel])
    assert result.max_error <= worst == np.nanmax(np.abs(errors)) <= 0.01  # rounded up, and still within
    assert result.rms_error < result.p95_error < result.max_error
    report = result.report
    assert report["triangles"] == len(result.mesh.triangles) < 0.2 * report["full_triangles"]
    assert report["covered_pixels"] == image.valid.sum() and report["isolated_pixels"] == 0
    check = result.mesh.check()
    assert check["is_manifold"] and check["boundary_loops"] == 2
    rows, cols = result.mesh.vertex_attributes["range_row"], result.mesh.vertex_attributes["range_col"]
    assert np.array_equal(result.mesh.positions, image.points[rows, cols])
    assert result.mesh.face_attributes["error"].max() == worst


def test_a_sculptor_gives_what_a_single_call_gives(image):
    sculptor = surfrecon.Sculptor(image)
    coarse = sculptor.refine(relative_tolerance=0.05)
    fine = sculptor.refine(relative_tolerance=0.001)
    assert len(coarse.mesh.triangles) < len(fine.mesh.triangles)
    assert np.isclose(coarse.tolerance, 0.05 * sculptor.depth_extent)
    assert np.array_equal(coarse.mesh.triangles, surfrecon.sculpt(image, relative_tolerance=0.05).mesh.triangles)
    few = sculptor.at_most(300)
    assert 200 < len(few.mesh.triangles) <= 300 and few.max_error <= few.tolerance
    with pytest.raises(surfrecon.InputError, match="at most 3 triangles are asked for"):
        sculptor.at_most(3)
    levels = sculptor.levels([0.001, 0.01, 0.1])
    assert [level.tolerance for level in levels] == [0.001, 0.01, 0.1]
    assert sorted((len(level.mesh.triangles) for level in levels), reverse=True) == [
        len(level.mesh.triangles) for level in levels
    ]


def test_what_cannot_be_done_is_named(image):
    with pytest.raises(surfrecon.InputError, match="not both"):
        surfrecon.sculpt(image, tolerance=1.0, relative_tolerance=1.0)
    with pytest.raises(surfrecon.ParameterError, match="tolerance must be a finite number >= 0, got -1"):
        surfrecon.sculpt(image, tolerance=-1.0)
    with pytest.raises(TypeError):
        surfrecon.sculpt(np.zeros((3, 3)))


def test_progress_reports_and_cancels(image):
    noise = np.random.default_rng(1).random((900, 900))
    rough = surfrecon.RangeImage.orthographic(noise, step=(1.0, 1.0))
    sculptor = surfrecon.Sculptor(rough, threads=1)
    for no in (False, np.False_):
        for call in (
            lambda **watched: surfrecon.sculpt(rough, tolerance=0.1, threads=1, **watched),
            lambda **watched: sculptor.refine(tolerance=0.1, **watched),
            lambda **watched: sculptor.at_most(100_000, **watched),
            lambda **watched: sculptor.levels([0.1, 0.2], **watched),
        ):
            with pytest.raises(surfrecon.Cancelled):
                call(progress=lambda stage, fraction: no)  # noqa: B023


def test_what_progress_raises_comes_back_and_the_sculptor_lives_on(image):
    sculptor = surfrecon.Sculptor(image)
    expected = surfrecon.sculpt(image, tolerance=0.05).mesh.triangles

    def fail(stage, fraction):
        raise LookupError("mine")

    for call in (
        lambda: sculptor.refine(tolerance=0.001, progress=fail),
        lambda: sculptor.at_most(300, progress=fail),
        lambda: sculptor.levels([0.05, 0.001], progress=fail),
    ):
        with pytest.raises(LookupError, match="mine"):
            call()
        assert np.array_equal(sculptor.refine(tolerance=0.05).mesh.triangles, expected)


def test_any_array_of_real_numbers_is_an_image(image):
    heights = np.random.default_rng(3).integers(0, 50, (40, 60))
    read_only = heights.astype(float)
    read_only.flags.writeable = False
    meshes = [
        surfrecon.sculpt(surfrecon.RangeImage.orthographic(same, step=(1.0, 1.0)), tolerance=5.0).mesh.triangles
        for same in (
            heights,
            read_only,
            np.asfortranarray(heights),
            heights.astype(">f4"),
            heights.tolist(),
            np.repeat(heights, 2, 1)[:, ::2],
        )
    ]
    assert all(np.array_equal(mesh, meshes[0]) for mesh in meshes[1:])


def test_a_job_refines_on_its_own_thread(image):
    sculptor = surfrecon.Sculptor(image)
    result = surfrecon.Job.refine(sculptor, tolerance=0.05).result()
    same = sculptor.refine(tolerance=0.05)
    assert np.array_equal(result.mesh.triangles, same.mesh.triangles) and result.max_error == same.max_error
    with pytest.raises(surfrecon.ParameterError, match="tolerance"):
        surfrecon.Job.refine(sculptor, tolerance=-1.0)


def test_more_effort_leaves_fewer_triangles(image):
    counts = [len(surfrecon.sculpt(image, tolerance=0.05, effort=effort).mesh.triangles) for effort in (0, 1, 2)]
    assert counts[0] > counts[1] >= counts[2]


def test_vertices_off_their_samples_stay_on_their_rays(image):
    free = surfrecon.sculpt(image, tolerance=0.02, interpolate=False)
    assert len(free.mesh.triangles) < len(surfrecon.sculpt(image, tolerance=0.02, effort=2).mesh.triangles)
    assert free.max_error <= 0.02 * (1 + 1e-9)
    rows, cols = free.mesh.vertex_attributes["range_row"], free.mesh.vertex_attributes["range_col"]
    off = free.mesh.positions - image.points[rows, cols]
    assert np.all(off[:, :2] == 0) and 0 < np.abs(off[:, 2]).max() <= 0.02
    with pytest.raises(surfrecon.ParameterError, match="min_angle must be >= 0 and <= "):
        surfrecon.sculpt(image, tolerance=0.02, min_angle=3.0)


def test_simplified_borders_have_fewer_triangles_and_cover_the_same_samples():
    y, x = np.mgrid[:90, :120] / 20.0
    heights = np.where(y < 1 + 0.6 * x + 0.3 * np.sin(3 * x), np.sin(x) * np.cos(y), np.nan)
    image = surfrecon.RangeImage.orthographic(heights, step=(0.05, -0.05))
    kept, simplified = (surfrecon.sculpt(image, tolerance=0.05, simplify_borders=s) for s in (False, True))
    assert len(simplified.mesh.triangles) < 0.95 * len(kept.mesh.triangles)
    assert simplified.max_error <= 0.05 * (1 + 1e-9)
    assert np.array_equal(np.isnan(simplified.error_image), np.isnan(kept.error_image))


def test_a_number_of_triangles_that_is_none_is_named(image):
    sculptor = surfrecon.Sculptor(image)
    for wrong in (-1, -(10**30)):
        with pytest.raises(surfrecon.ParameterError, match=f"triangles must be a whole number >= 0, got {wrong}"):
            sculptor.at_most(wrong)
    with pytest.raises(TypeError, match="triangles must be a whole number, got float"):
        sculptor.at_most(2.5)
    assert sculptor.at_most(10**30).max_error < 1e-9
    assert len(sculptor.at_most(np.int64(300)).mesh.triangles) <= 300


def test_numbers_of_any_size_are_shown_in_few_digits():
    heights = np.arange(12.0).reshape(3, 4) * 1e70
    sculptor = surfrecon.Sculptor(surfrecon.RangeImage.orthographic(heights, step=(1e70, 1e70)))
    assert len(repr(sculptor)) < 80 and len(repr(sculptor.refine(tolerance=1e-300))) < 120


REAL = ["stanford_bunny/bun000.ply", "stanford_dragon_stand/dragonStandRight_0.ply", "dem/N37E015.hgt"]


@pytest.mark.parametrize("file", REAL)
def test_real_scans_and_terrain_stay_within_the_bound(file):
    data = os.environ.get("SURFRECON_DATA")
    if not data or not (Path(data) / file).is_file():
        pytest.skip(f"{file} is not in SURFRECON_DATA")
    sculptor = surfrecon.Sculptor(surfrecon.read(Path(data) / file))
    full = None
    for share in (0.0028, 0.00041):
        result = sculptor.refine(relative_tolerance=share)
        assert result.max_error <= result.tolerance * (1 + 1e-9) + 1e-12 * sculptor.depth_extent
        assert result.mesh.check()["is_manifold"]
        full = full or result.report["full_triangles"]
        assert len(result.mesh.triangles) < 0.8 * full


def test_a_sculptor_is_made_by_a_job(image):
    options = {"effort": 0, "edge_limit": 0.2}
    made = surfrecon.Job.sculptor(image, **options).result()
    assert isinstance(made, surfrecon.Sculptor)
    result, same = made.refine(tolerance=0.01), surfrecon.Sculptor(image, **options).refine(tolerance=0.01)
    assert np.array_equal(result.mesh.triangles, same.mesh.triangles)
    with pytest.raises(surfrecon.ParameterError, match="effort"):
        surfrecon.Job.sculptor(image, effort=9)
    job = surfrecon.Job.sculptor(surfrecon.RangeImage.from_points(sheet(700), viewing=("parallel", (0, 0, -1))))
    job.cancel()
    with pytest.raises(surfrecon.Cancelled):
        job.result()


def sheet(side):
    y, x = np.mgrid[:side, :side].astype(float)
    return np.dstack([x, -y, 5 * np.sin(x / 9)])
