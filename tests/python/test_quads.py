"""Quad grids through Python: arrays in, a regular grid of quads and a spline surface out."""

import numpy as np
import pytest
import surfrecon


@pytest.fixture(scope="module")
def image():
    y, x = np.mgrid[:150, :170] / 30.0
    heights = np.sin(x) * np.cos(y) + 2.0 * np.exp(-((x - 3.0) ** 2 + (y - 2.0) ** 2) * 20.0)
    heights[:20, :30] = np.nan
    heights[100, 100] = np.nan
    image = surfrecon.RangeImage.orthographic(heights, step=(0.05, -0.05))
    colour = np.zeros((150, 170, 3), np.uint8)
    colour[..., 0] = np.arange(150)[:, None]
    image.colour = colour
    return image


def test_a_grid_is_regular_and_better_than_the_uniform_one(image):
    grid = surfrecon.adaptive_quads(image)
    assert grid.report["tiles"] == (2, 2) and (grid.rows, grid.columns) == (17, 17)
    pixels = grid.pixels.astype(int)
    assert pixels.shape == (17, 17, 2) and grid.grid.shape == (17, 17, 3)
    assert (np.diff(pixels[..., 0], axis=0) > 0).all() and (np.diff(pixels[..., 1], axis=1) > 0).all()
    measured = ~grid.background
    assert np.array_equal(grid.grid[measured], image.points[pixels[..., 0], pixels[..., 1]][measured])
    report = grid.report
    assert 0 < report["relative_error"] < report["uniform_relative_error"] and not report["is_uniform"]
    assert report["gaps_filled"] == 1 and report["valid_pixels"] == image.valid.sum()
    assert len(grid.quads) == report["quads"] < 256
    assert grid.quads.max() == len(grid.positions) - 1
    assert grid.face_attributes["error"].max() <= np.float32(report["max_error"])
    rows, cols = grid.vertex_attributes["range_row"], grid.vertex_attributes["range_col"]
    assert np.allclose(grid.uvs, np.stack([cols / 169, 1 - rows / 149], 1), atol=1e-6)
    assert np.array_equal(grid.vertex_attributes["colour"][:, 0], rows.astype(np.uint8))
    assert np.array_equal(grid.positions_f32().reshape(-1, 3), grid.positions.astype(np.float32))
    with pytest.raises(ValueError, match="read-only"):
        grid.grid[0] = 0


def test_quads_face_the_sensor_and_are_a_manifold(image):
    grid = surfrecon.adaptive_quads(image, rows=7, columns=5)
    a, b, c, _ = (grid.positions[grid.quads[:, k]] for k in range(4))
    assert (np.cross(b - a, c - a)[:, 2] > 0).all()
    check = grid.triangles().check()
    assert check["is_manifold"] and check["components"] == 1 and check["triangles"] == 2 * len(grid.quads)


def test_rows_and_columns_follow_from_an_error(image):
    for option, figure in (("max_error", "max_error"), ("rms_error", "rms_error")):
        coarse, fine = (surfrecon.adaptive_quads(image, **{option: error}) for error in (0.1, 0.01))
        assert coarse.report[figure] <= 0.1 and fine.report[figure] <= 0.01
        assert coarse.rows * coarse.columns < fine.rows * fine.columns
    with pytest.raises(surfrecon.InputError, match="not both"):
        surfrecon.adaptive_quads(image, max_error=1.0, rms_error=1.0)


def test_a_spline_runs_through_the_grid(image):
    grid = surfrecon.adaptive_quads(image)
    spline = grid.spline()
    assert spline.order == 4 and spline.control.shape == (17, 17, 3) and spline.max_residual < 1e-9
    corners = spline.evaluate([0, 1, 0, 1], [0, 0, 1, 1])
    assert np.allclose(corners, grid.grid[[0, 0, -1, -1], [0, -1, 0, -1]])
    smooth = grid.spline(order=3, rows=8, columns=9)
    assert smooth.control.shape == (8, 9, 3) and 0 < smooth.rms_residual <= smooth.max_residual
    along_u, along_v = smooth.knots
    assert len(along_u) == 12 and len(along_v) == 11 and along_u[2] == 0 and along_u[-3] == 1
    with pytest.raises(surfrecon.InputError, match="3 rows of control points"):
        grid.spline(rows=3)
    with pytest.raises(surfrecon.InputError, match="as long as each other"):
        spline.evaluate([0.0], [0.0, 1.0])
    with pytest.raises(surfrecon.InputError, match="parameters 1 must be numbers"):
        spline.evaluate([0.0, np.nan], [0.0, 1.0])
    # Quads of the surface face the sensor: u x v points toward it where it is mirrored.
    along_u, along_v = (spline.evaluate([0.5 + du], [0.5 + dv]) for du, dv in ((0.01, 0), (0, 0.01)))
    middle = spline.evaluate([0.5], [0.5])
    assert spline.mirrored == (np.cross(along_u - middle, along_v - middle)[0, 2] > 0)


def test_written_quads_stay_quads(image, tmp_path):
    grid = surfrecon.adaptive_quads(image)
    grid.write(tmp_path / "grid.obj")
    faces = [line.split()[1:] for line in (tmp_path / "grid.obj").read_text().splitlines() if line.startswith("f ")]
    assert len(faces) == len(grid.quads) and {len(face) for face in faces} == {4}
    grid.write(tmp_path / "grid.ply")
    triangles = 2 * len(grid.quads)
    assert len(surfrecon.read(tmp_path / "grid.ply").triangles) == triangles
    grid.spline().write(tmp_path / "spline.obj", 20, 30)
    assert (tmp_path / "spline.obj").read_text().count("\nf ") == 19 * 29
    with pytest.raises(surfrecon.InputError, match="must end in .ply or .obj"):
        grid.write(tmp_path / "grid.stl")


def test_jobs_cancel_and_errors(image):
    grid = surfrecon.Job.adaptive_quads(image, rows=5, columns=None).result()
    assert np.array_equal(grid.pixels, surfrecon.adaptive_quads(image, rows=5).pixels)
    with pytest.raises(TypeError, match="unexpected keyword argument 'row'"):
        surfrecon.Job.adaptive_quads(image, row=5)
    with pytest.raises(surfrecon.ParameterError, match="rows must be >= 2 and <= .*, got 1"):
        surfrecon.adaptive_quads(image, rows=1)
    with pytest.raises(surfrecon.InputError, match="ask for fewer rows or a smaller tiles_down"):
        surfrecon.adaptive_quads(image, rows=150)
    for values, problem in (
        (np.full((9, 9), np.nan), "no pixel is valid"),
        (np.full((9, 9), np.inf), "no pixel is valid"),
        (np.zeros((0, 0)), "at least 2 x 2 pixels, the image has 0 x 0"),
        (np.zeros((1, 1)), "at least 2 x 2 pixels, the image has 1 x 1"),
        (np.zeros((1, 40)), "at least 2 x 2 pixels, the image has 1 x 40"),
        (np.zeros((3, 3)), "ask for fewer rows or a smaller tiles_down"),
        (np.where(np.eye(9) > 0, 1e308, -1e308), "use a larger unit"),
    ):
        with pytest.raises(surfrecon.InputError, match=problem):
            surfrecon.adaptive_quads(surfrecon.RangeImage.orthographic(values, step=(1.0, -1.0)))
    with pytest.raises(surfrecon.ParameterError, match="max_error must be a finite number >= 0, got NaN"):
        surfrecon.adaptive_quads(image, max_error=np.nan)
    one, two = (surfrecon.adaptive_quads(image, threads=n) for n in (1, 2))
    assert np.array_equal(one.pixels, two.pixels) and np.array_equal(one.grid, two.grid)
