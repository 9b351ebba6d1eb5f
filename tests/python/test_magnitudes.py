"""Finite in, finite out: numbers whose products leave the range of doubles are refused by name, or worked with."""

import itertools
import re
import warnings

import numpy as np
import pytest
import surfrecon
from shapes import torus

TINY = [5e-324, 1e-320, 1e-308, 1e-200, 1e-154, 1e-80, 1e-30, 1e-7]
NUMBERS = [*TINY, 1e7, 1e30, 1e37, 1e39, 0.9e75, 1.1e75, 1e100, 1e154, 1e200, 1e307]
SIDE = 12


def numbers_of(answer):
    """All numbers of an answer: arrays, dicts, tuples, meshes, images."""
    if isinstance(answer, surfrecon.Mesh):
        answer = [answer.positions, *answer.vertex_attributes.values(), *answer.face_attributes.values()]
    if isinstance(answer, surfrecon.RangeImage):
        valid = answer.valid
        answer = [answer.points[valid], answer.world_points()[valid], answer.world_from_sensor]
    if isinstance(answer, dict):
        answer = list(answer.values())
    if isinstance(answer, list | tuple):
        return np.concatenate([[0.0], *map(numbers_of, answer)])
    if answer is None or isinstance(answer, str):
        return np.zeros(0)
    return np.asarray(answer, float).ravel()


def heights():
    rows, cols = np.mgrid[:SIDE, :SIDE]
    return np.sin(0.4 * rows) * np.cos(0.5 * cols) + 5.0


def bumps(scale=1.0):
    return surfrecon.RangeImage.orthographic(heights() * scale, step=(0.1 * scale, -0.1 * scale))


def grid(scale=1.0):
    rows, cols = np.mgrid[:SIDE, :SIDE]
    return np.stack([cols * 0.1, rows * 0.1, heights()], -1) * scale


def affine(scale=1.0, shift=0.0):
    matrix = np.diag([scale, scale, scale, 1.0])
    matrix[:3, 3] = shift
    return matrix


def scaled(mesh, scale):
    return surfrecon.Mesh(mesh.positions * scale, mesh.triangles)


def measured_image(image):
    mesh = image.triangulate()
    return [image, mesh]


def sculpted(image, **options):
    made = surfrecon.sculpt(image, **{"relative_tolerance": 0.01, **options})
    return [
        made.mesh,
        made.tolerance,
        made.max_error,
        made.rms_error,
        made.p95_error,
        made.error_image[~np.isnan(made.error_image)],
    ]


def quads(image, **options):
    made = surfrecon.adaptive_quads(image, **options)
    return [made.positions, made.positions_f32(), made.uvs, {k: v for k, v in made.report.items() if k != "seconds"}]


def spline(image):
    made = surfrecon.adaptive_quads(image).spline()
    return [made.control, made.max_residual, made.rms_residual, made.evaluate([0.3, 1e308, -1e308], [0.7, 0.5, 0.2])]


def scans_of(cameras, mesh=None, **options):
    return [surfrecon.virtual_scan(mesh or SMALL, camera, **options) for camera in cameras[:3]]


def merged(scans, **options):
    made = surfrecon.merge(scans, **options)
    report = {k: v for k, v in made.report.as_dict().items() if k not in ("seconds", "scan_names")}
    return [made.mesh, report]


def surface(points, **options):
    made = surfrecon.reconstruct(points, **options)
    return [made.mesh, {k: v for k, v in made.report.items() if k != "seconds"}]


SMALL = torus(10)
POINTS = SMALL.positions
UNIT = POINTS / np.linalg.norm(POINTS, axis=1)[:, None]
Image, Camera = surfrecon.RangeImage, surfrecon.Camera
VIEW = {"target": (0, 0, 0), "toward": (0, 0, -1), "up": (0, 1, 0)}
EYE = {"eye": (0, -6, 0), "target": (0, 0, 0)}

CALLS = {
    "mesh": lambda x: [scaled(SMALL, x), scaled(SMALL, x).bounds],
    "mesh_confidence": lambda x: surfrecon.Mesh(POINTS, SMALL.triangles, confidence=np.full(len(POINTS), x)),
    "mesh_check": lambda x: scaled(SMALL, x).check(),
    "positions_f32": lambda x: scaled(SMALL, x).positions_f32(),
    "positions_f32_scale": lambda x: SMALL.positions_f32(scale=x),
    "positions_f32_origin": lambda x: SMALL.positions_f32(origin=(x, 0, -x)),
    "distances": lambda x: surfrecon.distances(POINTS * x, scaled(SMALL, x), signed=True),
    "distances_points": lambda x: surfrecon.distances(POINTS * x, SMALL),
    "distances_mesh": lambda x: surfrecon.distances(POINTS, scaled(SMALL, x), signed=True),
    "distances_placed": lambda x: surfrecon.distances(POINTS, [(SMALL, affine(x))]),
    "nearest_triangles": lambda x: surfrecon.nearest_triangles(POINTS * x, SMALL),
    "surface_distance": lambda x: surfrecon.surface_distance(scaled(SMALL, x), scaled(torus(7), x), signed=True),
    "surface_distance_mesh": lambda x: surfrecon.surface_distance(scaled(SMALL, x), SMALL),
    "surface_distance_reference": lambda x: surfrecon.surface_distance(SMALL, scaled(SMALL, x)),
    "cluster": lambda x: surfrecon.cluster(scaled(SMALL, x), vertices=50).mesh,
    "cluster_points": lambda x: surfrecon.cluster(torus(24).positions * x, vertices=50).mesh,
    "cluster_error": lambda x: surfrecon.cluster(SMALL, max_error=x).mesh,
    "reconstruct": lambda x: surface(POINTS * x),
    "reconstruct_normals": lambda x: surface(POINTS, normals=UNIT * x),
    "reconstruct_sensor": lambda x: surface(POINTS, sensors=(x, x, x)),
    "reconstruct_factor": lambda x: surface(POINTS, factor=x),
    "orthographic": lambda x: measured_image(bumps(x)),
    "orthographic_values": lambda x: measured_image(Image.orthographic(heights() * x, step=(0.1, 0.1))),
    "orthographic_step": lambda x: measured_image(Image.orthographic(heights(), step=(x, x))),
    "orthographic_first": lambda x: measured_image(Image.orthographic(heights(), step=(0.1, 0.1), first=(x, -x))),
    "pinhole_values": lambda x: measured_image(Image.pinhole(heights() * x, focal=(9, 9), centre=(6, 6))),
    "pinhole_focal": lambda x: measured_image(Image.pinhole(heights(), focal=(x, x), centre=(6, 6))),
    "pinhole_focal_ray": lambda x: measured_image(Image.pinhole(heights(), focal=(x, 9), centre=(6, 6), depth="ray")),
    "pinhole_centre": lambda x: measured_image(Image.pinhole(heights(), focal=(9, 9), centre=(x, -x))),
    "spherical_values": lambda x: measured_image(Image.spherical(heights() * x, step=(0.01, 0.01))),
    "spherical_step": lambda x: measured_image(Image.spherical(heights(), step=(x, x))),
    "spherical_first": lambda x: measured_image(Image.spherical(heights(), step=(0.01, 0.01), first=(x, x))),
    "from_points": lambda x: measured_image(Image.from_points(grid(x))),
    "from_points_direction": lambda x: measured_image(Image.from_points(grid(), viewing=("parallel", (0, x, -x)))),
    "from_points_origin": lambda x: measured_image(Image.from_points(grid(), viewing=("from", (0, x, x)))),
    "image_pose": lambda x: posed(x),
    "image_intensity": lambda x: with_attribute("intensity", x),
    "image_confidence": lambda x: with_attribute("confidence", x),
    "edge_limit": lambda x: bumps().triangulate(edge_limit=x),
    "sculpt": lambda x: sculpted(bumps(x)),
    "sculpt_tolerance": lambda x: sculpted(bumps(), relative_tolerance=None, tolerance=x),
    "sculpt_relative": lambda x: sculpted(bumps(), relative_tolerance=x),
    "sculpt_pinhole": lambda x: sculpted(Image.pinhole(heights() * x, focal=(9, 9), centre=(6, 6))),
    "quads": lambda x: quads(bumps(x)),
    "quads_pinhole": lambda x: quads(Image.pinhole(heights() * x, focal=(9, 9), centre=(6, 6))),
    "spline": lambda x: spline(bumps(x)),
    "spline_heights": lambda x: spline(Image.orthographic(heights() * x, step=(0.1, 0.1))),
    "camera_orthographic": lambda x: scans_of([Camera.orthographic(9, 9, spacing=x, **VIEW)]),
    "camera_target": lambda x: scans_of([Camera.orthographic(9, 9, spacing=0.2, **{**VIEW, "target": (x, 0, 0)})]),
    "camera_toward": lambda x: scans_of([Camera.orthographic(9, 9, spacing=0.2, **{**VIEW, "toward": (0, 0, -x)})]),
    "camera_up": lambda x: scans_of([Camera.orthographic(9, 9, spacing=0.2, **{**VIEW, "up": (0, x, x)})]),
    "camera_pinhole_angle": lambda x: scans_of([Camera.pinhole(9, 9, height_angle=x, **EYE)]),
    "camera_pinhole_eye": lambda x: scans_of([Camera.pinhole(9, 9, height_angle=1, eye=(0, -x, 0), target=(0, 0, 0))]),
    "camera_pinhole_target": lambda x: scans_of(
        [Camera.pinhole(9, 9, height_angle=1, eye=(0, -6, 0), target=(0, x, 0))]
    ),
    "camera_intrinsic": lambda x: scans_of(
        [Camera.intrinsic(9, 9, focal=(x, x), centre=(4, 4), world_from_sensor=affine(shift=(0, 0, -6)))]
    ),
    "camera_intrinsic_centre": lambda x: scans_of(
        [Camera.intrinsic(9, 9, focal=(9, 9), centre=(x, 4), world_from_sensor=affine(shift=(0, 0, -6)))]
    ),
    "camera_intrinsic_pose": lambda x: scans_of(
        [Camera.intrinsic(9, 9, focal=(9, 9), centre=(4, 4), world_from_sensor=affine(shift=(0, 0, -x)))]
    ),
    "camera_spherical": lambda x: scans_of([Camera.spherical(9, 9, lowest=-x, highest=x, eye=(1, 0, 0))]),
    "camera_spherical_eye": lambda x: scans_of([Camera.spherical(9, 9, lowest=-1, highest=1, eye=(1, x, 0))]),
    "turntable_mesh": lambda x: scans_of(surfrecon.turntable(scaled(SMALL, x), pixels=9), scaled(SMALL, x)),
    "turntable_up": lambda x: scans_of(surfrecon.turntable(SMALL, pixels=9, up=(0, x, x))),
    "turntable_elevation": lambda x: scans_of(surfrecon.turntable(SMALL, pixels=9, elevation=x)),
    "turntable_angle": lambda x: scans_of(surfrecon.turntable(SMALL, pixels=9, height_angle=x)),
    **{
        f"scan_{name}": lambda x, name=name: scans_of(surfrecon.turntable(SMALL, pixels=9, height_angle=1), **{name: x})
        for name in ("noise", "noise_grazing", "quantum", "max_range", "pose_shift", "pose_turn")
    },
    "merge": lambda x: merged([scaled(SMALL, x)]),
    "merge_scan": lambda x: merged([bumps(x)]),
    "merge_placed": lambda x: merged([(SMALL, affine(x))]),
    "merge_moved": lambda x: merged([(SMALL, affine(shift=x))], voxel=0.1),
    "merge_measured": lambda x: merged([scaled(SMALL, x)], measure=True),
    "merge_distance": lambda x: merged([SMALL], voxel=0.2, merge_distance=x),
    "merge_holes": lambda x: merged([SMALL], voxel=0.2, max_hole_length=x),
    "merge_coarse": lambda x: merged([SMALL], voxel=x) if x > 1 else [],
}


def posed(x):
    image = bumps()
    image.world_from_sensor = affine(shift=(x, 0, -x))
    return measured_image(image)


def with_attribute(name, x):
    image = bumps()
    setattr(image, name, np.full((SIDE, SIDE), x))
    return [getattr(image, name), image.triangulate()]


@pytest.mark.parametrize(("name", "number"), list(itertools.product(CALLS, NUMBERS)))
def test_finite_in_finite_out(name, number):
    with warnings.catch_warnings():
        # NumPy's own, where a test makes its input.
        warnings.simplefilter("ignore", RuntimeWarning)
        try:
            answer = CALLS[name](number)
        except (surfrecon.InputError, surfrecon.ParameterError, surfrecon.OutOfMemoryError) as error:
            # A refused number is named as it was given, not as it was converted. A unit too small may have no number.
            assert re.search(r"\d", str(error)) or number in TINY, error
            assert not re.search(r"\b(inf|nan)\b", str(error), re.IGNORECASE), error
            return
    assert np.isfinite(numbers_of(answer)).all()


def refused(call, *words):
    with pytest.raises(surfrecon.SurfreconError) as caught:
        call()
    assert all(word in str(caught.value) for word in words), caught.value


def test_what_is_refused_is_named():
    far = scaled(SMALL, 1e200)
    refused(lambda: surfrecon.surface_distance(far, SMALL), "vertex 0 lies at (", "e200", "at most 1e75")
    refused(lambda: surfrecon.surface_distance(SMALL, far), "vertex 0 lies at (", "e200")
    refused(lambda: SMALL.positions_f32(scale=1e308), "vertex 0 at [", "the scale 1e308")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)
        refused(lambda: surfrecon.reconstruct(POINTS, normals=UNIT * 1e200), "normals: entry 0, ", "e200")
    high = Image.orthographic(heights() * 1e200, step=(0.1, 0.1))
    refused(lambda: spline(high), "ranges from ", "e200")
    refused(lambda: spline(Image.orthographic(heights(), step=(1e200, 1e200))), "from column to column", "1e200")
    refused(high.triangulate, "sample 0 lies at (", "e200")
    refused(lambda: sculpted(bumps(1e100), relative_tolerance=0.01), "from column to column", "e99")
    focal = (1e-320, 9.0)
    refused(lambda: Image.pinhole(heights(), focal=focal, centre=(6, 6)), "focal length fx", "1e-320")
    pose = affine(shift=(0, 0, -6))
    camera = lambda: Camera.intrinsic(9, 9, focal=focal, centre=(4, 4), world_from_sensor=pose)  # noqa: E731
    refused(camera, "focal length fx", "1e-320")
    refused(lambda: Camera.pinhole(9, 9, height_angle=np.pi, **EYE), "< pi", "3.14159265")
    refused(lambda: surfrecon.turntable(SMALL, height_angle=np.pi), "< pi", "3.14159265")
    refused(lambda: Camera.orthographic(9, 9, spacing=1, **{**VIEW, "toward": (1e200, 0, 0)}), "direction", "1e200")
    refused(lambda: surfrecon.turntable(SMALL, up=(0, 1e200, 0)), "vertical", "1e200")
    refused(lambda: scans_of(surfrecon.turntable(SMALL, pixels=9), pose_shift=1e308), "pose_shift must be", "1e308")
    refused(lambda: Image.from_points(grid(), viewing=("parallel", (0, 1e-200, 0))), "viewing direction", "1e-200")
    refused(lambda: merged([(SMALL, affine(1e200))]), "mesh 000000", "1e200")
    refused(lambda: merged([scaled(SMALL, 1e-200)]), "use a smaller unit")
    near = scaled(SMALL, 1e-80)
    refused(lambda: surfrecon.surface_distance(near, SMALL), "no vertex", "e-80", "use a smaller unit")
    refused(lambda: surfrecon.surface_distance(SMALL, near), "no vertex", "e-80", "use a smaller unit")
    refused(lambda: surfrecon.cluster(near, vertices=20), "no vertex", "e-80", "use a smaller unit")
    refused(lambda: surfrecon.cluster(far, vertices=20), "vertex 0 lies at (", "e200")
    refused(lambda: scans_of(surfrecon.turntable(SMALL, pixels=9), scaled(SMALL, 1e-163)), "e-163", "smaller unit")
    refused(lambda: sculpted(bumps(1e-150)), "from column to column", "e-151")
    for spacing in (0, -1, np.nan):
        refused(lambda spacing=spacing: Camera.orthographic(9, 9, spacing=spacing, **VIEW), "spacing must be > 0")


def test_numbers_up_to_the_limit_are_worked_with():
    far = 1e74
    for a, b in [(SMALL, torus(7))]:
        here = surfrecon.surface_distance(a, b)
        there = surfrecon.surface_distance(scaled(a, far), scaled(b, far))
        assert there["max"] == pytest.approx(here["max"] * far) and there["bound"] >= there["reached"]
    assert len(bumps(far).triangulate().triangles) == len(bumps().triangulate().triangles)
