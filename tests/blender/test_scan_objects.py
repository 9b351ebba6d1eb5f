"""Range images as objects and back: each projection, whatever is done to an object or to all its vertices."""

import bmesh
import bpy
import numpy as np
import pytest
import surfrecon
from mathutils import Matrix
from shapes import torus
from test_panels import draw

# The error of coordinates after a few operations in single precision, as a share of the largest.
SINGLE = 2e-6

# A ray may be so many pixels off.
RAY = 1e-6

UP, EYE = (0, 0, 1), (1, -5, 2)


def placed_like(image, seen):
    """A range image with the pose and the attributes of another."""
    image.world_from_sensor = seen.world_from_sensor
    image.confidence = np.where(seen.valid, 0.5, 0)
    image.intensity = np.where(seen.valid, 0.25, 0)
    image.colour = np.where(seen.valid[..., None], np.uint8((10, 200, 30, 255)), np.uint8(0))
    image.name = "scan"
    return image


def image_of(kind):
    """The torus in one of the projections."""
    parallel = kind in ("orthographic", "parallel")
    if kind == "spherical":
        camera = surfrecon.Camera.spherical(60, 360, lowest=-0.6, highest=0.2, eye=EYE, up=UP)
    elif parallel:
        camera = surfrecon.Camera.orthographic(60, 80, spacing=0.04, target=(0, 0, 0), toward=EYE, up=UP)
    else:
        camera = surfrecon.Camera.pinhole(60, 80, height_angle=0.6, eye=EYE, target=(0, 0, 0), up=UP)
    seen = surfrecon.virtual_scan(torus(), camera)
    points = np.asarray(seen.points, np.float64)
    if kind == "ray":
        lens = {name: seen.projection[name] for name in ("focal", "centre")}
        made = surfrecon.RangeImage.pinhole(np.linalg.norm(points, axis=-1), **lens, depth="ray")
    elif kind == "from":
        made = surfrecon.RangeImage.from_points(points, viewing=("from", (0.3, -0.2, 0.1)))
    elif kind == "parallel":
        made = surfrecon.RangeImage.from_points(points, viewing=("parallel", (0.1, 0.0, -1.0)))
    else:
        made = seen
    return placed_like(made, seen)


KINDS = ("orthographic", "planar", "ray", "spherical", "parallel", "from")
IMAGES = {}


@pytest.fixture(params=KINDS)
def image(request):
    """The same range image for all tests that ask for its kind; nobody changes it."""
    if request.param not in IMAGES:
        IMAGES[request.param] = image_of(request.param)
    return IMAGES[request.param]


# A rotation of no entry that single precision holds.
TURNED = Matrix.Translation((3, -2, 1)) @ Matrix.Rotation(1, 4, (1, 2, -3))
CHANGES = {
    "nothing": Matrix(),
    "moved and turned": TURNED,
    "larger": TURNED @ Matrix.Scale(2.3, 4),
    "far smaller": Matrix.Scale(1e-3, 4),
    "mirrored": Matrix.Scale(-1, 4, (1, 0, 0)),
    "mirrored in a tilted plane, turned and larger": TURNED @ Matrix.Scale(1.7, 4) @ Matrix.Scale(-1, 4, (0.6, 0, 0.8)),
    "inverted": Matrix.Scale(-1, 4) @ Matrix.Translation((0, 0.5, 0)),
}


@pytest.fixture(params=CHANGES)
def change(request):
    """A similarity of the world."""
    return CHANGES[request.param]


def put(extension, image, scale=1.0):
    """The object of a range image, where it was taken, selected and active."""
    obj = extension.scan_objects.object_from_range_image(image.name, image, scale, faces=True)
    bpy.context.collection.objects.link(obj)
    pose = np.array(image.world_from_sensor)
    pose[:3, 3] *= scale
    obj.matrix_world = Matrix(pose.tolist())
    bpy.context.view_layer.update()
    obj.select_set(True)
    bpy.context.view_layer.objects.active = obj
    return obj


def read(extension, obj):
    bpy.context.view_layer.update()
    found = extension.scan_objects.scan_of_object(obj, bpy.context.evaluated_depsgraph_get())
    assert isinstance(found, surfrecon.RangeImage)
    return found


def by_object(obj, change):
    """Changes the object's matrix."""
    obj.matrix_world = change @ obj.matrix_world


def by_vertices(obj, change):
    """Moves all vertices of the mesh; the object stays."""
    obj.data.transform(obj.matrix_world.inverted() @ change @ obj.matrix_world)


def by_applying(obj, change):
    """Changes the object's matrix and has Blender bake it into the vertices."""
    by_object(obj, change)
    bpy.context.view_layer.update()
    bpy.ops.object.transform_apply(location=True, rotation=True, scale=True)
    assert np.array_equal(obj.matrix_world, np.eye(4))


def by_both(obj, change):
    """Bakes, and takes part of the change back by the object's matrix."""
    other = Matrix.Translation((0, 2, 0)) @ Matrix.Rotation(2, 4, "Y") @ Matrix.Scale(0.6, 4)
    by_applying(obj, other @ change)
    obj.matrix_world = other.inverted()


WAYS = (by_object, by_vertices, by_applying, by_both)


def in_world(points, matrix):
    matrix = np.array(matrix, np.float64)
    return np.asarray(points, np.float64) @ matrix[:3, :3].T + matrix[:3, 3]


def lies(extension, obj, image, change, gone=None):
    """Asserts that an object is a range image of the same kind whose samples and rays the change took along."""
    found = read(extension, obj)
    change = np.array(change, np.float64)
    valid = image.valid.copy()
    if gone is not None:
        valid[gone] = False
    assert np.array_equal(found.valid, valid)
    was = in_world(image.world_points()[valid], change)
    room = SINGLE * max(np.abs(was).max(), np.abs(convert_positions(obj)).max(), np.abs(change[:3, 3]).max())
    assert np.abs(found.world_points()[valid] - was).max() <= room
    turn = np.array(found.world_from_sensor)[:3, :3]
    assert np.abs(turn @ turn.T - np.eye(3)).max() < 1e-12 and np.linalg.det(turn) > 0
    assert found.projection["kind"] == image.projection["kind"]
    assert found.projection.get("depth") == image.projection.get("depth")
    size = np.cbrt(abs(np.linalg.det(change[:3, :3])))
    same_rays(found, image, valid, size, convert_positions(obj))
    same_side(found, image, change, room)
    for name in ("confidence", "intensity", "colour"):
        assert np.array_equal(getattr(found, name)[valid], getattr(image, name)[valid])
    return found


def convert_positions(obj):
    return np.array([vertex.co[:] for vertex in obj.data.vertices])


def convert_values(obj, name):
    return [item.value for item in obj.data.attributes[name].data]


def same_rays(found, image, valid, size, vertices):
    """Asserts that rays of pixels lie to each other as they did; mirrored and turned alike they do."""
    kind = image.projection["kind"]
    if kind == "points":
        return
    chosen = np.flatnonzero(valid)[:: max(valid.sum() // 50, 1)]

    def apart(image, size):
        points = np.asarray(image.points, np.float64).reshape(-1, 3)[chosen]
        rays = points[:, :2] / size if kind == "orthographic" else points / np.linalg.norm(points, axis=1)[:, None]
        return np.linalg.norm(rays[:, None] - rays, axis=-1)

    if kind == "orthographic":
        # Nothing but the matrix and the vertices tells the scale, in single precision.
        pixel, room = abs(image.projection["step"][0]), RAY + SINGLE * max(image.rows, image.cols)
    else:
        pixel, room = 1 / abs(image.projection["focal"][0]) if kind == "pinhole" else image.projection["step"][0], RAY
    room *= abs(pixel)
    if kind == "orthographic":
        # Vertices far from the origin are rounded by more of their extent; the mean of 256 of them tells the scale.
        rounding = SINGLE / 32 * np.abs(vertices).max() / np.ptp(vertices, axis=0).max()
        room += 4 * rounding / 16 * apart(image, 1).max()
    assert np.abs(apart(found, size) - apart(image, 1)).max() <= room


def same_side(found, image, change, room):
    """Asserts that pixels are seen from where they were."""
    kind = image.projection["kind"]
    poses = change @ np.array(image.world_from_sensor), np.array(found.world_from_sensor)
    if kind in ("pinhole", "spherical"):
        eyes = [pose[:3, 3] for pose in poses]
    elif kind == "points":
        both = [each.projection["viewing"] for each in (image, found)]
        assert both[0][0] == both[1][0]
        eyes = [in_world(vector, pose) for (_, vector), pose in zip(both, poses, strict=True)]
        if both[0][0] == "parallel":
            along = [pose[:3, :3] @ vector for (_, vector), pose in zip(both, poses, strict=True)]
            eyes, room = [each / np.linalg.norm(each) for each in along], SINGLE
    else:
        # Height above the plane of the sensor is along its z axis.
        eyes, room = [pose[:3, 2] / np.linalg.norm(pose[:3, 2]) for pose in poses], SINGLE
    assert np.abs(eyes[0] - eyes[1]).max() <= 10 * room


@pytest.mark.parametrize("way", WAYS, ids=lambda way: way.__name__)
def test_what_is_done_to_all_vertices_leaves_the_camera(image, change, way, extension):
    obj = put(extension, image)
    way(obj, change)
    lies(extension, obj, image, change)


def test_samples_that_nobody_moved_are_the_vertices_to_the_bit(extension):
    for kind in ("parallel", "from"):
        obj = put(extension, image_of(kind))
        by_object(obj, TURNED)
        found = read(extension, obj)
        assert found.points.dtype == np.float32
        assert np.array_equal(found.points[found.valid], convert_positions(obj).astype(np.float32))


@pytest.mark.parametrize("way", (by_object, by_applying), ids=lambda way: way.__name__)
def test_surfaces_face_who_sees_them(image, change, way, extension):
    obj = put(extension, image)
    way(obj, change)
    found = read(extension, obj)
    surface = found.triangulate()
    a, b, c = (surface.positions[surface.triangles[:, k]].astype(np.float64) for k in range(3))
    normals = np.cross(b - a, c - a)
    how, vector = found.projection.get("viewing", (seen_how(image), (0, 0, -1 if seen_how(image) == "parallel" else 0)))
    toward = -np.array(vector) if how == "parallel" else np.array(vector) - a
    assert len(normals) > 800 and ((normals * toward).sum(axis=1) > 0).all()


@pytest.mark.parametrize("way", WAYS, ids=lambda way: way.__name__)
def test_deleted_vertices_are_missing_pixels(image, way, extension):
    change = CHANGES["mirrored in a tilted plane, turned and larger"]
    obj = put(extension, image)
    way(obj, change)
    row, col = np.nonzero(image.valid)
    # All but the last third of the rows, and every seventh of those.
    gone = (row < np.quantile(row, 0.66)) | (np.arange(len(row)) % 7 == 0)
    edited = bmesh.new()
    edited.from_mesh(obj.data)
    chosen = [vertex for vertex, goes in zip(edited.verts, gone.tolist(), strict=True) if goes]
    bmesh.ops.delete(edited, geom=chosen, context="VERTS")
    edited.to_mesh(obj.data)
    edited.free()
    lies(extension, obj, image, change, (row[gone], col[gone]))


@pytest.mark.parametrize("way", (by_object, by_applying), ids=lambda way: way.__name__)
def test_saving_keeps_every_bit(image, way, extension, tmp_path):
    change = CHANGES["mirrored in a tilted plane, turned and larger"]
    way(put(extension, image), change)
    before = read(extension, bpy.data.objects["scan"])
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scan.blend"))
    bpy.ops.wm.read_homefile(use_empty=True)
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "scan.blend"))
    after = lies(extension, bpy.data.objects["scan"], image, change)
    assert np.array_equal(after.points, before.points, equal_nan=True)
    assert after.projection == before.projection
    assert np.array_equal(after.world_from_sensor, before.world_from_sensor)


@pytest.mark.parametrize("scale", [0.001, 1000.0])
@pytest.mark.parametrize("way", (by_object, by_applying), ids=lambda way: way.__name__)
def test_a_unit_scales_samples_and_camera(image, way, scale, extension):
    obj = put(extension, image, scale)
    # Anchors are where their vertices are.
    row, col, *places = extension.scan_objects.camera_of(obj).anchors.T
    number = np.cumsum(image.valid).reshape(image.valid.shape)[row.astype(int), col.astype(int)] - 1
    assert len(number) == min(256, image.valid.sum())
    assert np.abs(convert_positions(obj)[number] - np.transpose(places)).max() <= SINGLE * np.abs(places).max()
    way(obj, TURNED)
    lies(extension, obj, image, TURNED @ Matrix.Scale(scale, 4))


def test_true_size_of_moved_vertices_leaves_the_camera(image, extension):
    obj = put(extension, image)
    by_applying(obj, TURNED)
    by_object(obj, Matrix.Translation((0, 1, 0)))
    bpy.context.view_layer.update()
    extension.scaling.grow(obj, 3.0)
    lies(extension, obj, image, Matrix.Scale(3, 4) @ Matrix.Translation((0, 1, 0)) @ TURNED)


def test_edit_mode_leaves_the_camera(image, extension):
    obj = put(extension, image)
    before = convert_positions(obj)
    bpy.ops.object.mode_set(mode="EDIT")
    edited = bmesh.from_edit_mesh(obj.data)
    # The calls of its operators, one after the other. Without a window Blender 4.2 can't run these.
    bmesh.ops.translate(edited, verts=edited.verts, vec=(0.3, -0.7, 2))
    bmesh.ops.rotate(edited, verts=edited.verts, cent=(1, 2, 3), matrix=Matrix.Rotation(0.7, 3, "Y"))
    bmesh.ops.scale(edited, verts=edited.verts, vec=(1.5, 1.5, 1.5))
    bmesh.ops.scale(edited, verts=edited.verts, vec=(-1, 1, 1))
    bmesh.update_edit_mesh(obj.data)
    bpy.ops.object.mode_set(mode="OBJECT")
    after = convert_positions(obj)
    assert np.abs(after - before).max() > 0.5
    found = read(extension, obj)
    assert found.projection["kind"] == image.projection["kind"]
    assert np.array_equal(found.valid, image.valid)
    seen = in_world(after, obj.matrix_world)
    assert np.abs(found.world_points()[image.valid] - seen).max() <= SINGLE * np.abs(seen).max()
    same_rays(found, image, image.valid, 1.5, after)


def seen_how(image):
    """Whether a grid of points is seen along parallels or from a point, if it has those of an image."""
    how = {"points": image.projection.get("viewing", ("",))[0], "orthographic": "parallel"}
    return how.get(image.projection["kind"], "from")


def uneven(obj):
    """Stretches the object."""
    obj.matrix_world = obj.matrix_world @ Matrix.Diagonal((1, 1.5, 0.7, 1))


def uneven_vertices(obj):
    """Stretches the vertices."""
    obj.data.transform(Matrix.Diagonal((1, 1.5, 0.7, 1)))


def one_by_one(obj):
    """Moves each vertex its own way, by about a pixel."""
    moves = np.random.default_rng(3).normal(size=(len(obj.data.vertices), 3)) * 0.02
    for vertex, move in zip(obj.data.vertices, moves.tolist(), strict=True):
        vertex.co = [x + m for x, m in zip(vertex.co, move, strict=True)]


@pytest.mark.parametrize("edit", [uneven, uneven_vertices, one_by_one], ids=lambda edit: edit.__name__)
def test_what_no_camera_sees_is_a_grid_of_points_where_they_are(image, edit, extension):
    obj = put(extension, image)
    edit(obj)
    found = read(extension, obj)
    assert found.projection["kind"] == "points" and np.array_equal(found.valid, image.valid)
    assert found.projection["viewing"][0] == seen_how(image)
    seen = in_world(convert_positions(obj), obj.matrix_world)
    assert np.abs(found.world_points()[image.valid] - seen).max() <= SINGLE * np.abs(seen).max()


def without_anchors(obj):
    """An object as version 0.1 saved it."""
    del obj["range_anchors"]
    assert sorted(obj.keys()) == ["range_columns", "range_parameters", "range_projection", "range_rows"]
    return obj


def test_objects_of_the_version_before_are_range_images(image, change, extension, tmp_path):
    obj = without_anchors(put(extension, image))
    by_object(obj, change)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scan.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "scan.blend"))
    obj = bpy.data.objects["scan"]
    lies(extension, obj, image, change)
    extension.scaling.grow(obj, 2.0)
    lies(extension, obj, image, Matrix.Scale(2, 4) @ change)
    # Nobody knows where their vertices were: moved ones are points.
    obj.data.transform(TURNED)
    found = read(extension, obj)
    seen = in_world(convert_positions(obj), obj.matrix_world)
    assert found.projection["kind"] == "points"
    assert np.abs(found.world_points()[image.valid] - seen).max() <= SINGLE * np.abs(seen).max()


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("range_anchors", [1.0, 2.0]),
        ("range_anchors", [1e9, 0.0, 0.0, 0.0, 0.0]),
        ("range_anchors", "here"),
        ("range_projection", "fisheye"),
        ("range_projection", 3),
        ("range_parameters", "none"),
        ("range_parameters", {"focal": [0.0, 100.0], "centre": [0.0, 0.0], "depth": "planar"}),
        ("range_parameters", {"viewing": 3, "vector": "x"}),
    ],
)
def test_an_impossible_camera_is_refused_by_its_properties(name, value, extension):
    obj = put(extension, image_of("planar"))
    obj[name] = value
    said = '"scan" has an impossible camera: correct .*range_anchors'
    for ask in (lambda: read(extension, obj), lambda: extension.scaling.refuse_shared([obj])):
        with pytest.raises(extension.running.Refused, match=said):
            ask()


@pytest.mark.parametrize("name", ["range_projection", "range_parameters"])
def test_an_object_without_its_projection_is_no_scan_seen_from_anywhere(name, extension):
    obj = put(extension, image_of("planar"))
    del obj[name]
    with pytest.raises(extension.running.Refused, match='"scan" has an impossible camera: correct .*range_projection'):
        read(extension, obj)


def test_a_patch_whose_vertices_were_turned_is_refused(extension):
    obj = put(extension, image_of("planar"))
    few = extension.scan_objects.camera_of(obj).anchors[:2, :2].tolist()
    row, col = (convert_values(obj, name) for name in ("range_row", "range_col"))
    edited = bmesh.new()
    edited.from_mesh(obj.data)
    gone = [v for v, r, c in zip(edited.verts, row, col, strict=True) if [r, c] not in few]
    bmesh.ops.delete(edited, geom=gone, context="VERTS")
    edited.to_mesh(obj.data)
    assert len(obj.data.vertices) == 2
    read(extension, obj)
    by_applying(obj, TURNED)
    with pytest.raises(extension.running.Refused, match='"scan": .*nothing tells from where they were seen'):
        read(extension, obj)


@pytest.mark.parametrize("value", [3, [1.0], {"a": 1}])
def test_foreign_figures_are_left_out(value, extension):
    obj = put(extension, image_of("planar"))
    for name in (*extension.panels.LINES, extension.sources.SCANS):
        obj[name] = value
    assert bpy.ops.surfrecon.sculpt.poll()
    assert extension.sources.scan_behind(bpy.data.objects.new("result", None)) is None
    del obj["range_rows"]
    assert extension.sources.scan_behind(obj) is None
    draw(extension.panels.SURFRECON_PT_report)


def test_previews_take_every_projection(image, extension):
    thinned = extension.preview.thinned(image)
    assert thinned.projection["viewing"][0] == seen_how(image) and thinned.valid.sum() > 100


@pytest.mark.parametrize("ending", ["conf", "ptx", "e57"])
def test_scaled_scans_are_exported_in_every_projection(image, ending, extension, tmp_path):
    by_applying(put(extension, image), TURNED)
    path, options = tmp_path / f"out.{ending}", {"file_format": ending.upper(), "scale": 1000}
    if ending != "conf" and seen_how(image) == "parallel":
        with pytest.raises(RuntimeError, match="its rays are parallel"):
            bpy.ops.surfrecon.export_scans(filepath=str(path), **options)
        return
    assert bpy.ops.surfrecon.export_scans(filepath=str(path), **options) == {"FINISHED"}
    (again,) = (scan.read() for scan in surfrecon.open(path))
    # The formats have their own order of columns.
    was = 1000 * in_world(image.world_points()[image.valid], TURNED)
    found = again.world_points()[again.valid]
    nearest = np.linalg.norm(found[:, None] - was, axis=-1).min(axis=1)
    assert len(found) == len(was) and nearest.max() <= 5 * SINGLE * np.abs(was).max()
