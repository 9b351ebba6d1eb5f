"""The same input gives the same bytes through the C library and through Python, operation by operation.

That C gives those of the core is tested in Rust. SURFRECON_LIBRARY names the built library.
"""

import ctypes
import json
import os

import c_library
import numpy as np
import photos
import pytest
import shapes
import surfrecon
from c_library import Library

LIBRARY = os.environ.get("SURFRECON_LIBRARY")
pytestmark = pytest.mark.skipif(not LIBRARY, reason="SURFRECON_LIBRARY is not set")

# Another way to see for each operation, turned and away from the origin.
POSE = np.array([[0.36, 0.48, -0.8, 5], [-0.8, 0.6, 0, -2], [0.48, 0.64, 0.6, 0.1], [0, 0, 0, 1]])


@pytest.fixture
def c():
    library = Library(LIBRARY)
    yield library
    library.close()


def hill(kind="orthographic", rows=40, cols=50):
    """A bent surface with all attributes and missing pixels."""
    row, col = np.mgrid[0:rows, 0:cols]
    values = 2 + 0.1 * np.sin(0.2 * row) * np.cos(0.15 * col)
    values[3:5, 7] = values[0, 0] = np.nan
    if kind == "orthographic":
        image = surfrecon.RangeImage.orthographic(values, step=(0.01, -0.01), first=(-0.2, 0.2), name=kind)
    elif kind == "spherical":
        image = surfrecon.RangeImage.spherical(values, step=(0.01, -0.01), first=(-0.2, 0.2), name=kind)
    elif kind == "points":
        image = surfrecon.RangeImage.from_points(np.dstack([0.01 * col, -0.01 * row, -values]), name=kind)
    else:
        image = surfrecon.RangeImage.pinhole(values, focal=(80, 81), centre=(25, 20), depth=kind, name=kind)
    image.world_from_sensor = POSE
    image.colour = np.random.default_rng(1).integers(0, 255, (rows, cols, 4), np.uint8)
    image.intensity = row + col
    image.confidence = 1 / (1 + row)
    return image


KINDS = ["orthographic", "planar", "ray", "spherical", "points"]


def same(found, expected):
    """Two arrays, whatever their types, hold the same numbers to the bit."""
    found, expected = (np.zeros(0) if one is None else np.asarray(one) for one in (found, expected))
    assert found.size == expected.size
    assert found.astype(expected.dtype).tobytes() == expected.tobytes()


def same_mesh(c, handle, mesh):
    """A mesh of C's is one of Python's, attributes included."""
    assert len(mesh.positions) > 3
    same(c.mesh_positions(handle), mesh.positions)
    same(c.mesh_triangles(handle), mesh.triangles)
    for domain, expected in (1, mesh.vertex_attributes), (2, mesh.face_attributes):
        found = c.attributes(handle, domain)
        assert found.keys() == expected.keys()
        for name, values in expected.items():
            same(found[name], values)


def same_image(c, handle, image):
    """An image of C's is one of Python's."""
    rows, cols, _ = c.image_size(handle)
    assert (rows, cols) == (image.rows, image.cols)
    same(c.image_samples(handle), image.points if image.values is None else image.values)
    projection, pose = c.image_camera(handle)
    expected = c.projection(image.projection)
    assert (projection.kind, *projection.numbers) == (expected.kind, *expected.numbers)
    same(pose, image.world_from_sensor)
    for found, attribute in zip(
        c.image_attributes(handle), (image.colour, image.intensity, image.confidence), strict=True
    ):
        same(found, attribute)


def same_report(struct, report, least):
    """The figures that both reports name are the same, and there are at least so many."""
    shared = [field for field, *_ in struct._fields_ if field in report]
    assert len(shared) >= least, sorted(report)
    for field in shared:
        number, expected = getattr(struct, field), report[field]
        # Python says nothing where C has the number that stands for it.
        if isinstance(expected, (bool, int, float)):
            assert number == expected, field


@pytest.mark.parametrize("kind", KINDS)
def test_images_and_what_hosts_keep_of_them(c, kind):
    image = hill(kind)
    handle = c.image(image)
    same_image(c, handle, image)
    points = np.zeros((image.rows * image.cols, 3))
    c.image_world_points(handle, points.size, out_points=points)
    same(points, image.world_points())

    for faces in True, False:
        same_mesh(c, c.image_to_mesh(handle, faces), image.to_mesh(faces))
    mesh, camera, struct = image.to_mesh(), image.grid_camera(), c.image_grid_camera(handle)
    assert struct.anchor_count == len(camera.anchors)
    if struct.anchor_count:
        anchors = struct.anchors[: struct.anchor_count]
        same(np.array([[anchor.row, anchor.col, *anchor.point] for anchor in anchors]), camera.anchors)
    mirrored = np.diag([1.0, 1, -1, 1])
    positions = (mesh.positions @ mirrored[:3, :3] * 3).astype(np.float32)
    attributes = dict(mesh.vertex_attributes)
    row, col = attributes.pop("range_row"), attributes.pop("range_col")
    back = surfrecon.RangeImage.from_vertices(
        camera, row, col, positions, world_from_host=POSE, name="back", **attributes
    )
    values = (attributes[name] for name in ("colour", "intensity", "confidence"))
    same_image(c, c.image_from_vertices(struct, row, col, positions, *values, POSE, "back"), back)


def bounds(call, handle):
    low, high = np.zeros(3), np.zeros(3)
    call(handle, out_min=low, out_max=high)
    return np.array([low, high])


def test_bounds_counts_and_positions_in_single_precision(c):
    image = hill("ray")
    handle = c.image(image)
    world = image.world_points().reshape(-1, 3)
    same(bounds(c.image_bounds, handle), [np.nanmin(world, axis=0), np.nanmax(world, axis=0)])
    cloud = c.image_to_cloud(handle)
    assert np.allclose(bounds(c.cloud_bounds, cloud), bounds(c.image_bounds, handle), atol=1e-12)
    assert c.cloud_size(cloud) == np.isfinite(world[:, 0]).sum()
    mesh = image.triangulate()
    handle = c.mesh(mesh)
    assert c.mesh_size(handle) == [len(mesh.positions), len(mesh.triangles)]
    same(bounds(c.mesh_bounds, handle), mesh.bounds)
    for origin in None, (4e6, -5e6, 0.3):
        near = np.zeros((len(mesh.positions), 3), np.float32)
        c.mesh_positions_f32(handle, origin, near.size, out_positions=near)
        same(near.ravel(), mesh.positions_f32(origin=origin or (0, 0, 0)))


def test_a_triangulation(c):
    image = hill("ray")
    params = c.struct("triangulate_params", edge_limit=0.05, grazing_limit=1.2)
    same_mesh(c, c.image_triangulate(c.image(image), params), image.triangulate(edge_limit=0.05, grazing_limit=1.2))


def test_a_virtual_scan(c):
    mesh = shapes.torus()
    camera = surfrecon.turntable(mesh, pixels=90)[3]
    image = surfrecon.virtual_scan(mesh, camera, noise=0.01, dropout=0.1, seed=7)
    params = c.struct("scan_params", noise=0.01, dropout=0.1, seed=7)
    place = camera.rows, camera.cols, camera.projection, camera.world_from_sensor
    same_image(c, c.scan_mesh(c.mesh(mesh), *place, params), image)


@pytest.mark.parametrize("kind", KINDS)
def test_sculpting(c, kind):
    image = hill(kind)
    sculptor = surfrecon.Sculptor(image, min_angle=0.3)
    handle = c.sculptor_create(c.image(image), c.struct("sculpt_params", min_angle=0.3))
    for tolerance in 0.02, 0.002:
        mesh, certificate = c.sculptor_refine(handle, tolerance)
        sculpted = sculptor.refine(tolerance=tolerance)
        same_mesh(c, mesh, sculpted.mesh)
        same_report(certificate, sculpted.report, 3)
        assert certificate.max_error == sculpted.max_error
        assert certificate.rms_error == sculpted.rms_error
    mesh, certificate = c.sculptor_at_most(handle, 500)
    sculpted = sculptor.at_most(500)
    same_mesh(c, mesh, sculpted.mesh)
    assert certificate.triangles == len(sculpted.mesh.triangles)


def test_quads_and_their_spline(c):
    image = hill()
    grid = surfrecon.adaptive_quads(image, tiles_down=2, tiles_across=3, rows=5, columns=5)
    handle, report = c.quads_create(
        c.image(image), c.struct("quads_params", tiles_down=2, tiles_across=3, rows=5, columns=5)
    )
    same_report(report, grid.report, 12)
    rows, cols, positions, pixels, background = c.quads_grid(handle)
    assert (rows, cols) == (grid.rows, grid.columns)
    same(positions, grid.grid)
    same(pixels, grid.pixels)
    same(background, grid.background.astype(np.uint8))
    positions, uvs, corners, errors = c.quads_faces(handle)
    same(positions, grid.positions)
    same(uvs, grid.uvs)
    same(corners, grid.quads)
    same(errors, grid.face_attributes["error"])
    same_mesh(c, c.quads_triangles(handle), grid.triangles())

    residuals = np.zeros(1), np.zeros(1)
    spline, expected = (
        c.spline_create(
            handle, c.struct("spline_params", order=3), out_max_residual=residuals[0], out_rms_residual=residuals[1]
        ),
        grid.spline(order=3),
    )
    assert (*residuals[0], *residuals[1]) == (expected.max_residual, expected.rms_residual)
    rows, cols, control = c.spline_control(spline)
    assert (rows, cols) == expected.control.shape[:2]
    same(control, expected.control)
    point = np.zeros(3)
    c.spline_point(spline, 0.3, 0.6, out_point=point)
    same(point, expected.evaluate([0.3], [0.6]))


def noisy_points():
    """Points of the torus, some wrong in every way."""
    points = shapes.torus(detail=24).positions
    points = points + np.random.default_rng(3).normal(0, 0.004, points.shape)
    return np.concatenate([points, points[:2], [[np.nan, 0, 0], [0, 0, 3]]])


def test_a_surface_through_points(c):
    points = noisy_points()
    colours = np.random.default_rng(4).integers(0, 255, (len(points), 4), np.uint8)
    result = surfrecon.reconstruct(points, factor=1.3, colour=colours, closure="open")
    handle = c.reconstructor_create(c.cloud_create(points, None, colours, None, None), None)
    params = c.struct("reconstruct_params", factor=1.3, closure="SRF_CLOSURE_OPEN")
    dropped = np.zeros(len(points), np.uint8)
    mesh, report = c.reconstructor_surface(handle, params, out_dropped=dropped)
    same_mesh(c, mesh, result.mesh)
    same_report(report, result.report, 12)
    numbers = {name.lower().removeprefix("srf_dropped_"): value for name, value in c.constants.items()}
    assert set(result.dropped) >= {"not_finite", "duplicate"}
    for reason, indices in result.dropped.items():
        same(np.flatnonzero(dropped == numbers[reason]), indices.astype(np.int64))


@pytest.mark.parametrize(
    ("smooth", "noisy_points"),
    [(None, "moved"), (0.3, "moved"), (0.3, "put_back"), (None, "as_clean")],
    ids=["auto", "smooth", "put back", "as clean"],
)
def test_a_surface_through_noisy_points(c, smooth, noisy_points):
    points = shapes.noisy_sphere()
    result = surfrecon.reconstruct(points, smooth=smooth, noisy_points=noisy_points)
    dropped = np.zeros(len(points), np.uint8)
    mesh, report = c.reconstructor_surface(
        c.reconstructor_create(c.cloud_create(points, None, None, None, None), None),
        c.struct(
            "reconstruct_params",
            noisy_points=f"SRF_NOISY_POINTS_{noisy_points.upper()}",
            **({} if smooth is None else {"smooth": smooth}),
        ),
        out_dropped=dropped,
    )
    same_mesh(c, mesh, result.mesh)
    same_report(report, result.report, 12)
    assert {"noise", "spacing", "smoothing", "moved"} <= result.report.keys()
    assert min(report.noise, report.spacing) > 0
    assert (report.smoothing > 0) == (report.moved > 0) == (noisy_points == "moved")
    assert report.smoothing != 0.3 or smooth == 0.3
    assert report.outliers == len(result.dropped["outlier"])
    assert (report.outliers > 100) == (noisy_points != "as_clean")
    same(np.flatnonzero(dropped == c.constants["SRF_DROPPED_OUTLIER"]), result.dropped["outlier"].astype(np.int64))


def test_a_surface_through_the_points_of_an_image(c):
    x, y = np.meshgrid(np.arange(40.0), np.arange(40.0))
    points = np.stack([x, y, 100 + np.where(x < 20, 0, 12.0) + y**2 / 64], 2)
    image = surfrecon.RangeImage.from_points(points, viewing=("from", (20, 20, -1000)))
    image.world_from_sensor = POSE
    cloud = c.image_to_cloud(c.image(image))
    of_image, of_cloud = np.zeros(3), np.zeros(3)
    c.image_sensor(c.image(image), out_sensor=of_image)
    c.cloud_sensor(cloud, out_sensor=of_cloud)
    same(of_image, image.sensor)
    same(of_cloud, image.to_cloud().sensor)
    reconstructor, dropped = c.reconstructor_create(cloud, None), np.zeros(1600, np.uint8)
    mesh, _ = c.reconstructor_surface(reconstructor, c.struct("reconstruct_params"), out_dropped=dropped)
    same_mesh(c, mesh, surfrecon.reconstruct(image.to_cloud()).mesh)


def test_clusters(c):
    mesh = shapes.torus(detail=24)
    points = mesh.positions
    handles = {
        "mesh": (c.mesh(mesh), mesh),
        "cloud": (c.cloud_create(points, None, None, None, None), points),
    }
    for kind, (handle, content) in handles.items():
        params = c.struct("cluster_params", vertices=200, fitting=1)
        found, report = getattr(c, f"{kind}_cluster")(handle, params)
        clustered = surfrecon.cluster(content, vertices=200, fitting=1)
        same_mesh(c, found, clustered.mesh)
        same_report(report, clustered.report, 7)


def test_a_closed_surface(c, truth):
    merged = surfrecon.merge(truth).mesh
    mesh = surfrecon.Mesh(merged.positions, merged.triangles)
    merger = c.merger_create()
    for scan in truth:
        c.merger_add_image(merger, c.image(scan))
    for scans, handle in ([], None), (truth, merger):
        found, report = c.mesh_close(c.mesh(mesh), handle, c.struct("close_params", flat_base=1))
        closed = surfrecon.close(mesh, scans, flat_base=True)
        same_mesh(c, found, closed.mesh)
        same_report(report, closed.report, 10)


def test_a_check_for_printing(c, truth):
    merged = surfrecon.merge(truth).mesh
    mesh = surfrecon.Mesh(merged.positions, merged.triangles)
    found, report = c.mesh_check_print(c.mesh(mesh), c.struct("check_print_params", min_wall=0.05, density=2.0))
    checked = surfrecon.check_print(mesh, min_wall=0.05, density=2.0)
    same_mesh(c, found, checked.mesh)
    same_report(report, checked.report, 10)


def test_a_print_made_ready(c):
    ring = shapes.torus(detail=16)
    options = dict(scale_to=10.0, flat_base=True, printer_width=6.0)
    params = c.struct("prepare_print_params", **(options | {"flat_base": 1}))
    found, report = c.mesh_prepare_print(c.mesh(ring), params)
    prepared = surfrecon.prepare_print(ring, **options)
    same_mesh(c, found, prepared.mesh)
    same_report(report, prepared.report, 10)
    same_mesh(c, c.mesh_part(found, 1), prepared.parts[1])


def test_texture_coordinates(c):
    ring = shapes.torus(detail=16)
    found, report = c.mesh_unwrap(c.mesh(ring), c.struct("unwrap_params", size=512, padding=2, tiles=4))
    unwrapped = surfrecon.unwrap(ring, size=512, padding=2, tiles=4)
    same_mesh(c, found, unwrapped.mesh)
    same_report(report, unwrapped.report, 10)
    same(c.attributes(found, 1)["s"], unwrapped.uv[:, 0])
    same(c.attributes(found, 1)["t"], unwrapped.uv[:, 1])
    same(c.attributes(found, 1)["source_vertex"], unwrapped.source.view(np.int32))
    same(c.attributes(found, 2)["chart"], unwrapped.chart)


def test_textures(c):
    ring, fine = shapes.torus(detail=8), photos.coloured(shapes.torus(detail=16))
    flat = surfrecon.unwrap(ring, size=128, padding=2).mesh
    taken = photos.around(fine, count=3)
    taken.append(photos.photo_of(fine, "deep", (0, 0, 6), depths=np.full((10, 12), 6.0, np.float32)))
    options = dict(size=128, normal_map=True, height_map=True, occlusion_rays=2)
    handles = []
    for photo in taken:
        rows, cols = photo.shape
        projection = dict(kind="pinhole", focal=photo.focal, centre=photo.centre, depth="planar")
        pixels, depths = photo.read().reshape(-1, 3), photo.read_depths()
        size = (0, 0) if depths is None else depths.shape
        measured = None if depths is None else depths.reshape(-1)
        pose, name = photo.world_from_camera, photo.name
        handles.append(c.photo_create(rows, cols, projection, pixels, pose, name, *size, measured))
    params = c.struct("texture_params", **options)
    found, report = c.mesh_texture(c.mesh(flat), c.mesh(fine), handles, len(handles), params)
    textured = surfrecon.texture(flat, fine, taken, **options)
    same_report(report, textured.report, 3)
    assert c.textures_size(found) == [128, 1]
    (tile,) = textured.tiles
    for number, image in enumerate((tile.colour, tile.mask, tile.normal, tile.height, tile.occlusion), 1):
        same(c.textures_image(found, 0, number).reshape(image.shape), image)
    for k, (photo, pose) in enumerate(zip(textured.report.photos, textured.world_from_camera, strict=True)):
        same(c.textures_pose(found, k), pose)
        same_report(c.textures_photo(found, k), photo, 3)
        assert c.textures_reason(found, k) == photo.reason


def test_an_alignment_and_one_scan_drawn_to_the_others(c, truth, heap, aligned, in_place):
    aligner, still = c.aligner_create(), c.aligner_create()
    for scan, placed in zip(heap, truth, strict=True):
        c.aligner_add_image(aligner, c.image(scan))
        c.aligner_add_image(still, c.image(placed))
    alignment = c.aligner_run(aligner, None)
    assert aligned.report.placed == len(heap)
    for i, expected in enumerate(aligned.report.scans):
        scan = c.alignment_scan(alignment, i)
        same(np.array(scan.world_from_scan.matrix).reshape(4, 4).T, expected.world_from_scan)
        same(np.array(scan.covariance), expected.covariance)
        assert (scan.overlap, scan.residual) == (expected.overlap, expected.residual)
    report = c.alignment_report(alignment)
    assert (report.placed, report.compared, report.residual) == (
        aligned.report.placed,
        aligned.report.compared,
        aligned.report.residual,
    )
    lines = [c.alignment_message(alignment, i) for i in range(report.messages_count)]
    assert lines == aligned.report.messages

    poses = np.array([scan.world_from_sensor for scan in truth])
    poses[1, :3, 3] += 0.01
    snap = in_place.snap(1, poses[1])
    touches = np.zeros(len(truth), np.uint8)
    struct = c.aligner_snap(still, 1, poses, len(truth), None, out_touches=touches)
    assert snap.touches
    same(np.array(struct.world_from_scan.matrix).reshape(4, 4).T, snap.world_from_scan)
    assert np.flatnonzero(touches).tolist() == sorted(snap.touches)


def test_planes_regions_and_sizes(c):
    flat = surfrecon.RangeImage.pinhole(np.full((40, 50), 2.0), focal=(80, 81), centre=(25, 20))
    flat.world_from_sensor = POSE
    scans = [hill("spherical"), flat]
    plane = surfrecon.dominant_plane(scans, tolerance=0.01)
    aligner = c.aligner_create()
    for scan in scans:
        c.aligner_add_image(aligner, c.image(scan))
    struct = c.dominant_plane(aligner, c.struct("plane_params", tolerance=0.01))
    assert struct.is_found
    same(np.array(struct.point), plane.point)
    same(np.array(struct.normal), plane.normal)
    assert (struct.margin, struct.share, struct.spread) == (plane.margin, plane.share, plane.spread)

    # C's goes through its numbers.
    plane = surfrecon.Plane(plane.point, plane.normal, margin=plane.margin)
    up = np.array([0.0, 0, 1])
    grounded, true = surfrecon.ground(plane, up="z"), surfrecon.true_size((0, 0, 0), (1, 2, 2), 6)
    same(c.ground(struct, up), grounded.matrix)
    same(c.true_size(np.zeros(3), np.array([1.0, 2, 2]), 6), true.matrix)

    box = POSE @ np.diag([0.2, 0.3, 4, 1])
    mask = np.zeros((40, 50), np.uint8)
    mask[10:30, 5:40] = 1
    regions = [
        (surfrecon.Box(box), c.region_box(box)),
        (plane, c.region_below(struct)),
        (mask.astype(bool), c.region_mask(mask.reshape(-1, 1), 40, 50)),
    ]
    image = hill("planar")
    for region, handle in regions:
        for keep, expected in (1, image.keep(region)), (0, image.remove(region)):
            selected = c.image(image)
            removed = c.image_select(selected, handle, keep)
            assert removed == np.count_nonzero(image.valid) - np.count_nonzero(expected.valid)
            same_image(c, selected, expected)
    moved = c.image(image)
    c.image_transform(moved, true.matrix)
    same_image(c, moved, image.transformed(true))
    mesh = image.triangulate()
    moved = c.mesh(mesh)
    c.mesh_transform(moved, true.matrix)
    same_mesh(c, moved, mesh.transformed(true))


def test_a_merge(c, tmp_path):
    scans = shapes.torus_scans(pixels=60, noise=0.002)[:6]
    for k, scan in enumerate(scans):
        scan.colour = np.full((scan.rows, scan.cols, 4), 40 * k, np.uint8)
    mesh = scans.pop().triangulate()
    result = surfrecon.merge([*scans, (mesh, POSE, "apart")], merge_distance=0.05, max_hole_length=0.3)
    merger = c.merger_create()
    for scan in scans:
        c.merger_add_image(merger, c.image(scan))
    c.merger_add_mesh(merger, c.mesh(mesh), POSE, "apart")
    merged, report = c.merger_run(merger, c.struct("merge_params", merge_distance=0.05, max_hole_length=0.3))
    same_mesh(c, merged, result.mesh)
    names = [name for name in dir(result.report) if not name.startswith("_")]
    same_report(report, {name: getattr(result.report, name) for name in names}, 15)
    params = c.struct("merge_params", merge_distance=0.05, max_hole_length=0.3)
    merged, report = c.merger_run_in_files(merger, params, 0, 0, tmp_path)
    scans.append((mesh, POSE, "apart"))
    in_files = surfrecon.merge(scans, merge_distance=0.05, max_hole_length=0.3, workspace=tmp_path)
    same_mesh(c, merged, in_files.mesh)
    same_mesh(c, merged, result.mesh)
    assert (report.in_files, in_files.report.in_files, result.report.in_files) == (1, True, False)
    report = c.merger_write(merger, tmp_path / "c.ply", params, 10**9, tmp_path, None, '{"made": "by hand"}')
    given = {"merge_distance": 0.05, "max_hole_length": 0.3, "provenance": {"made": "by hand"}}
    expected = surfrecon.merge_to_file(scans, tmp_path / "python.ply", **given)
    assert (tmp_path / "c.ply").read_bytes() == (tmp_path / "python.ply").read_bytes()
    same_report(report, {name: getattr(expected, name) for name in names}, 15)


def test_distances(c):
    mesh, other = shapes.torus(detail=24), shapes.torus(detail=30)
    points = noisy_points()
    points = points[np.isfinite(points).all(axis=1)]
    distances = np.zeros(len(points))
    figures = c.mesh_distances(c.mesh(mesh), points, 1, 0, out_distances=distances)
    same(distances, surfrecon.distances(points, mesh, signed=True))
    assert figures.count == len(points)
    assert figures.max == np.abs(distances).max()

    expected = surfrecon.surface_distance(mesh, other)
    at_vertices = np.zeros(len(mesh.positions))
    figures = c.mesh_surface_distance(c.mesh(mesh), c.mesh(other), 0, 0, out_distances=at_vertices)
    same_report(figures, expected, 9)
    same(at_vertices, expected.distances)


def test_files(c, tmp_path):
    mesh, image = shapes.torus(detail=12), hill("spherical")
    for ending in "ply", "obj", "stl", "glb":
        mesh.write(tmp_path / f"python.{ending}")
        # The name inside is the file's.
        (tmp_path / ending).mkdir()
        path = tmp_path / ending / f"python.{ending}"
        c.mesh_write(c.mesh(mesh), path, None)
        assert path.read_bytes() == (tmp_path / f"python.{ending}").read_bytes()
    image.write(tmp_path / "scan.ptx")
    scans = surfrecon.open(tmp_path / "scan.ptx")
    paths = (ctypes.c_char_p * 1)(str(tmp_path / "scan.ptx").encode())
    opened = c.scans_open(paths, 1, None)
    content, found, _, _ = c.scans_read(opened, 0)
    assert content == c.constants["SRF_CONTENT_IMAGE"]
    same_image(c, found, scans[0].read())


def test_systems_and_provenance(c, tmp_path):
    """Files say the same, whoever writes and reads them."""
    crs, made = "EPSG:25832+7837", {"by": "a test", "of": [1, {"two": "ä"}]}
    mesh = shapes.torus(detail=12).with_crs(crs)
    handle = c.mesh(mesh)
    c.mesh_set_crs(handle, crs)
    assert c.mesh_crs(handle, c_library.TEXT) == [crs, len(crs)]
    for ending in "ply", "obj", "glb":
        (tmp_path / ending).mkdir()
        ours, theirs = tmp_path / f"a.{ending}", tmp_path / ending / f"a.{ending}"
        mesh.write(ours, provenance=made)
        c.mesh_write_from(handle, theirs, None, json.dumps(made))
        assert ours.read_bytes() == theirs.read_bytes()
        assert surfrecon.provenance(theirs) == json.loads(c.file_provenance(ours, c_library.TEXT)[0]) == made
        opened = c.scans_open((ctypes.c_char_p * 1)(str(ours).encode()), 1, None)
        assert c.scans_crs(opened, 0, c_library.TEXT)[0] == surfrecon.open(theirs)[0].crs == crs
    image = hill("spherical")
    image.crs = crs
    surfrecon.write_scans(tmp_path / "a.e57", [image], provenance=made)
    of_c = c.image(image)
    c.image_set_crs(of_c, crs)
    c.images_write_e57_from((ctypes.c_void_p * 1)(of_c.value), 1, tmp_path / "b.e57", json.dumps(made))
    assert (tmp_path / "a.e57").read_bytes() == (tmp_path / "b.e57").read_bytes()
    assert surfrecon.provenance(tmp_path / "b.e57") == made
