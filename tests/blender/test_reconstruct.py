"""The operator that makes a surface through points: its result, the kept tetrahedralization, frames, messages."""

from importlib import import_module

import bpy
import numpy as np
import pytest
import surfrecon
from shapes import noisy_sphere


def sphere(count):
    i = np.arange(count)
    z = 1 - (2 * i + 1) / count
    ring, angle = np.sqrt(1 - z * z), np.pi * (5**0.5 - 1) * i
    return np.stack([ring * np.cos(angle), ring * np.sin(angle), z], 1)


def add_points(name, points, location=(0, 0, 0)):
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(points.tolist(), [], [])
    obj = bpy.data.objects.new(name, mesh)
    obj.location = location
    bpy.context.collection.objects.link(obj)
    obj.select_set(True)
    bpy.context.view_layer.objects.active = obj
    bpy.context.view_layer.update()
    return obj


def select(*objects):
    for obj in bpy.context.selected_objects:
        obj.select_set(False)
    for obj in objects:
        obj.select_set(True)


def places(obj):
    return np.array([v.co[:] for v in obj.data.vertices])


def check(obj):
    return surfrecon.Mesh(places(obj), np.array([p.vertices[:] for p in obj.data.polygons])).check()


@pytest.fixture
def kept(extension):
    found = import_module(f"{extension.__name__}.kept").Kept
    found.forget()
    return found


def test_a_surface_goes_through_all_vertices():
    points = add_points("points", sphere(500), (1, 2, 3))
    assert bpy.ops.surfrecon.reconstruct() == {"FINISHED"}
    made = bpy.context.object
    assert made is not points and bpy.context.selected_objects == [made]
    assert len(made.data.vertices) == 500 and check(made)["is_closed"] and not made.data.validate()
    assert made.matrix_world == points.matrix_world
    figures = made["surfrecon_reconstruct"].to_dict()
    assert figures["used"] == figures["points"] == 500 and figures["outside"] == 0
    assert [v.co[:] for v in made.data.vertices] == [v.co[:] for v in points.data.vertices]
    # Outward.
    assert sum(p.normal.dot(p.center) > 0 for p in made.data.polygons) == len(made.data.polygons)


def test_another_factor_carves_the_same_tetrahedra(kept):
    cut = sphere(2000)
    points = add_points("points", cut[cut[:, 2] < 0.9])
    bpy.ops.surfrecon.reconstruct(closure="open")
    first = kept.value
    assert check(bpy.context.object)["boundary_loops"] == 1
    select(points)
    bpy.ops.surfrecon.reconstruct(closure="closed", factor=1.5)
    assert kept.value is first and check(bpy.context.object)["is_closed"]
    points.data.vertices[5].co.z += 0.01
    select(points)
    bpy.ops.surfrecon.reconstruct()
    assert kept.value is not first


def test_several_objects_meet_in_the_world():
    upper = sphere(600)
    add_points("upper", upper[upper[:, 2] > 0] - (5, 0, 0), (5, 0, 0))
    add_points("lower", upper[upper[:, 2] <= 0])
    bpy.ops.surfrecon.reconstruct()
    made = bpy.context.object
    assert len(made.data.vertices) == 600 and check(made)["is_closed"]
    assert np.allclose(made.matrix_world, np.eye(4))


@pytest.mark.skipif(bpy.app.version < (4, 3), reason="Blender 4.2 makes point clouds only in its nodes")
@pytest.mark.parametrize("kind", ["BYTE_COLOR", "FLOAT_COLOR", None])
def test_a_point_cloud_keeps_its_colours(kind):
    obj = add_points("cloud", sphere(400))
    if kind:
        wanted = np.linspace(0, 1, 1600, dtype=np.float32)
        obj.data.color_attributes.new("paint", kind, "POINT").data.foreach_set("color_srgb", wanted)
    bpy.ops.object.convert(target="POINTCLOUD")
    assert bpy.context.object.type == "POINTCLOUD"
    bpy.ops.surfrecon.reconstruct()
    made = bpy.context.object
    assert len(made.data.vertices) == 400 and check(made)["is_closed"]
    colour = made.data.attributes.get("colour")
    assert (colour is None) == (kind is None)
    if kind:
        values = np.empty(1600, np.float32)
        colour.data.foreach_get("color_srgb", values)
        assert np.abs(values - wanted).max() < 1.01 / 255


def test_toward_the_camera():
    add_points("points", sphere(500))
    with pytest.raises(RuntimeError, match="no camera"):
        bpy.ops.surfrecon.reconstruct(toward_camera=True)
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    bpy.context.collection.objects.link(camera)
    bpy.context.scene.camera = camera
    bpy.context.view_layer.update()
    bpy.ops.surfrecon.reconstruct(toward_camera=True)
    made = bpy.context.object
    assert sum(p.normal.dot(p.center) < 0 for p in made.data.polygons) == len(made.data.polygons)


def test_what_cannot_be_done_is_named():
    add_points("few", sphere(2))
    with pytest.raises(RuntimeError, match="at least 3 different points"):
        bpy.ops.surfrecon.reconstruct()
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    bpy.context.collection.objects.link(camera)
    select(camera)
    with pytest.raises(RuntimeError, match="Nothing but 1 camera is selected"):
        bpy.ops.surfrecon.reconstruct()
    select()
    with pytest.raises(RuntimeError, match="Select point clouds"):
        bpy.ops.surfrecon.reconstruct()
    assert len(bpy.data.objects) == 2


BAD = {
    "two": sphere(2),
    "collinear": np.arange(20.0)[:, None] * (1.0, 2.0, 3.0),
    "all equal": np.ones((100, 3)),
    "nothing finite": np.full((50, 3), np.nan),
}


@pytest.mark.parametrize("name", BAD)
def test_points_without_a_surface_leave_the_scene_as_it_was(name):
    points = add_points(name, BAD[name])
    meshes = len(bpy.data.meshes)
    with pytest.raises(RuntimeError, match="at least 3 different points|one line"):
        bpy.ops.surfrecon.reconstruct()
    assert list(bpy.data.objects) == [points] and len(bpy.data.meshes) == meshes
    assert points.select_get() and bpy.context.object is points


def test_an_object_without_vertices_is_named():
    add_points("nothing", np.zeros((0, 3)))
    with pytest.raises(RuntimeError, match='"nothing" has no vertices'):
        bpy.ops.surfrecon.reconstruct()


def test_points_that_are_no_numbers_are_counted():
    points = np.concatenate([sphere(300), [[np.nan, 0, 0], [np.inf, 0, 0], [3e38, 3e38, 3e38]], sphere(300)[:7]])
    add_points("points", points)
    bpy.ops.surfrecon.reconstruct()
    figures = bpy.context.object["surfrecon_reconstruct"].to_dict()
    assert (figures["not_finite"], figures["duplicates"], figures["used"], figures["outside"]) == (2, 7, 300, 1)
    assert check(bpy.context.object)["is_closed"]


def test_the_operator_can_be_adjusted_and_undone(extension):
    operator = import_module(f"{extension.__name__}.operators.reconstruct").SURFRECON_OT_reconstruct
    assert operator.bl_options == {"REGISTER", "UNDO", "PRESET"}
    names = {p.name for p in surfrecon.parameters("reconstruct")} | {"threshold", "topology", "closure"}
    assert names <= set(bpy.ops.surfrecon.reconstruct.get_rna_type().properties.keys())


def add_scan(extension, name, points, viewing):
    image = surfrecon.RangeImage.from_points(points.astype(np.float32), viewing=viewing)
    obj = extension.scan_objects.object_from_range_image(name, image, 1.0, False)
    bpy.context.collection.objects.link(obj)
    obj.select_set(True)
    bpy.context.view_layer.objects.active = obj
    bpy.context.view_layer.update()
    return obj


def test_range_images_know_their_sensors(extension):
    x, y = np.meshgrid(np.arange(40.0), np.arange(40.0)) + 0.2 * np.random.default_rng(1).random((2, 40, 40))
    points = np.stack([x, y, 100 + np.where(x < 20, 0, 20.0) + y**2 / 64], 2)
    scan = add_scan(extension, "scan", points, ("from", (20, 20, -1000)))
    # Its place changes nothing of what is made in its own frame.
    scan.location = (5, 6, 7)
    bpy.context.view_layer.update()
    vertices = np.array([v.co[:] for v in scan.data.vertices])
    bpy.ops.surfrecon.reconstruct()

    def triangles():
        return np.array([p.vertices[:] for p in bpy.context.object.data.polygons])

    expected = surfrecon.reconstruct(vertices, sensors=(20, 20, -1000)).mesh
    assert np.array_equal(triangles(), expected.triangles)
    # Of parallel rays nothing is known; of several objects each point has its own.
    select(scan)
    add_scan(extension, "parallel", points + (100, 0, 0), ("parallel", (0, 0, 1)))
    bpy.ops.surfrecon.reconstruct()
    sensors = np.concatenate([np.full((1600, 3), (25.0, 26, -993)), np.full((1600, 3), np.nan)])
    both = np.concatenate([vertices + (5, 6, 7), vertices + (100, 0, 0)])
    assert len(bpy.context.object.data.vertices) == 3200
    known = surfrecon.reconstruct(both, sensors=sensors).mesh
    assert np.array_equal(triangles(), known.triangles)


def test_noisy_points_are_smoothed_unless_the_surface_is_to_go_through_them():
    points = add_points("points", noisy_sphere())
    given = places(points)
    radius = np.float32(0.3)
    put_back = {"noisy_points": "put_back"}
    for options in ({}, {"smooth": radius}, put_back, {"noisy_points": "as_clean"}):
        select(points)
        bpy.ops.surfrecon.reconstruct(**options)
        made, expected = bpy.context.object, surfrecon.reconstruct(given, **options)
        figures = made["surfrecon_reconstruct"].to_dict()
        for name in ("noise", "spacing", "smoothing", "moved"):
            assert figures[name] == expected.report[name], name
        assert min(figures["noise"], figures["spacing"]) > 0
        assert (figures["smoothing"] > 0) == (figures["moved"] > 0) == ("noisy_points" not in options)
        assert (figures["smoothing"] == radius) == ("smooth" in options)
        assert figures["outliers"] == len(expected.dropped["outlier"])
        assert (figures["outliers"] > 100) == (options != {"noisy_points": "as_clean"})
        assert np.array_equal(places(made), expected.mesh.positions.astype(np.float32))


def test_figures_that_no_line_names_are_told_if_they_are_newer(extension):
    add_points("points", noisy_sphere())
    bpy.ops.surfrecon.reconstruct()
    figures = bpy.context.object["surfrecon_reconstruct"]
    shown = [label for label, _ in extension.reports.LINES["surfrecon_reconstruct"](bpy.context, figures)]
    assert len(shown) == len(set(shown)) and shown[-1] == "Points moved by"
    # Of an operation without lines of its own all are told.
    declared = {row.label for row in surfrecon.figures("reconstruct")}
    told = dict(extension.reports.lines_of_all("reconstruct")(bpy.context, figures))
    assert set(told) <= declared and {"Points given", "Closed", "Seconds"} & declared <= set(told)
    assert told["Points moved by"] == dict(extension.reports.reconstruct_lines(bpy.context, figures))["Points moved by"]


@pytest.mark.parametrize(
    "options",
    [{"smooth": np.float32(0.3)}, {"noisy_points": "put_back"}, {"topology": "free", "factor": 2.0}],
    ids=["smooth", "put back", "free"],
)
def test_the_preview_follows_the_options(previewed, options):
    add_points("points", noisy_sphere())
    shown, _ = previewed("reconstruct", **options)
    # So few points are all in the preview.
    made = bpy.context.object.data
    assert np.array_equal(shown.positions.astype(np.float32), [v.co[:] for v in made.vertices])
    assert np.array_equal(shown.triangles, [p.vertices[:] for p in made.polygons])
