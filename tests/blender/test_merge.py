"""The merge operator: what it takes, what it makes, undo, cancel, messages."""

import os
from pathlib import Path

import bpy
import numpy as np
import pytest
import surfrecon
from files import write_set
from mathutils import Matrix
from shapes import torus, torus_distance, torus_scans

VOXEL = 0.06


@pytest.fixture(scope="module")
def images():
    return torus_scans(pixels=90, noise=0.001, pose_shift=0.001)


@pytest.fixture
def scans(tmp_path, images):
    bpy.ops.surfrecon.import_scans(filepath=str(write_set(tmp_path, images)))
    return [bpy.data.objects[image.name] for image in images]


@pytest.fixture
def snapshot():
    """Names of everything in the file."""

    def taken():
        kinds = (bpy.data.objects, bpy.data.meshes, bpy.data.collections, bpy.data.materials)
        selected = sorted(obj.name for obj in bpy.context.selected_objects)
        return [sorted(kind.keys()) for kind in kinds], selected, bpy.context.object

    return taken


def add_mesh(name, mesh, matrix=None):
    made = bpy.data.meshes.new(name)
    made.from_pydata(mesh.positions.tolist(), [], mesh.triangles.tolist())
    obj = bpy.data.objects.new(name, made)
    bpy.context.collection.objects.link(obj)
    if matrix is not None:
        obj.matrix_world = matrix
    obj.select_set(True)
    bpy.context.view_layer.objects.active = obj
    bpy.context.view_layer.update()
    return obj


def surface(obj):
    """The library's mesh of a result, in its own frame."""
    mesh = obj.data
    positions = np.array([v.co[:] for v in mesh.vertices])
    return surfrecon.Mesh(positions, np.array([p.vertices[:] for p in mesh.polygons]))


def test_the_surface_is_the_torus(scans):
    assert bpy.ops.surfrecon.merge(voxel=VOXEL) == {"FINISHED"}
    merged = bpy.context.object
    assert merged.name == "torus merged" and bpy.context.selected_objects == [merged]
    check = surface(merged).check()
    assert check["is_manifold"] and check["components"] == 1 and check["genus"] == 1
    distance = np.abs(torus_distance(surface(merged).positions))
    assert np.quantile(distance, 0.99) < 0.01 and distance.max() < VOXEL
    assert not merged.data.validate()
    assert not any(np.isnan(v.co).any() for v in merged.data.vertices)


def test_quadriflow_takes_the_surface(scans):
    # It takes edges for none whose ends differ by less than 0.0001 along each axis.
    assert bpy.ops.surfrecon.merge(voxel=VOXEL) == {"FINISHED"}
    report = bpy.context.object["surfrecon_report"].to_dict()
    assert VOXEL / 100 <= report["shortest_edge"] < VOXEL / 20
    assert bpy.ops.object.quadriflow_remesh(target_faces=500) == {"FINISHED"}
    assert all(len(polygon.vertices) == 4 for polygon in bpy.context.object.data.polygons)


def test_scans_that_do_not_fit_are_told_of():
    row, col = np.mgrid[0:40, 0:50]
    corner = surfrecon.RangeImage.orthographic(0.02 * np.abs(col - 25.0) + 0.01 * row, step=(0.02, 0.02)).triangulate()
    for away, said in ((0, False), (0.2, True)):
        bpy.ops.object.select_all(action="DESELECT")
        add_mesh("first", corner)
        add_mesh("second", corner, Matrix.Translation((0, 0, away)))
        bpy.ops.surfrecon.merge(voxel=0.02)
        assert ("align them first" in bpy.context.object["surfrecon_report"]["warnings"]) == said


def test_the_report_and_the_attributes_are_there(scans):
    bpy.ops.surfrecon.merge(voxel=VOXEL)
    merged = bpy.context.object
    report = merged["surfrecon_report"].to_dict()
    assert report["scans"] == len(scans) and report["voxel"] == pytest.approx(VOXEL)
    assert sum(report["faces"]) == len(merged.data.polygons)
    assert [source.object for source in merged.surfrecon_sources] == scans
    assert merged.data.attributes["confidence"].domain == "POINT"
    assert merged.data.attributes["interpolated"].data_type == "BOOLEAN"
    assert merged.data.attributes["hole_fill"].domain == "FACE"


def test_blender_and_the_wheel_make_the_same_surface(scans, extension):
    depsgraph = bpy.context.evaluated_depsgraph_get()
    images = [extension.scan_objects.scan_of_object(obj, depsgraph) for obj in scans]
    bpy.ops.surfrecon.merge(voxel=VOXEL)
    merged = bpy.context.object
    # Options of operators are in single precision.
    here = surfrecon.merge(images, voxel=float(np.float32(VOXEL))).mesh
    assert np.array_equal(merged.matrix_world, np.eye(4))
    there = np.empty((len(merged.data.vertices), 3), np.float32)
    merged.data.vertices.foreach_get("co", there.reshape(-1))
    corners = np.empty((len(merged.data.polygons), 3), np.int32)
    merged.data.polygons.foreach_get("vertices", corners.reshape(-1))
    assert np.array_equal(there, here.positions.astype(np.float32))
    assert np.array_equal(corners, here.triangles)


def test_the_sidebar_s_options_are_used_unless_given(scans):
    settings = bpy.context.scene.surfrecon
    settings.voxel = 2 * VOXEL
    bpy.ops.surfrecon.merge()
    assert bpy.context.object["surfrecon_report"]["voxel"] == pytest.approx(2 * VOXEL)
    for obj in scans:
        obj.select_set(True)
    bpy.ops.surfrecon.merge(voxel=VOXEL)
    assert bpy.context.object["surfrecon_report"]["voxel"] == pytest.approx(VOXEL)


def test_zero_means_measured(scans):
    bpy.ops.surfrecon.merge()
    report = bpy.context.object["surfrecon_report"].to_dict()
    assert report["voxel"] > 0 and report["merge_distance"] > 0


def test_open_holes_stay_open_on_request(scans, images):
    holes = {}
    for close in ("none", "holes"):
        for obj in bpy.data.objects:
            obj.select_set(obj in scans[:8])
        bpy.ops.surfrecon.merge(voxel=VOXEL, close=close, max_hole_length=100)
        holes[close] = bpy.context.object["surfrecon_report"].to_dict()["holes"]
    assert holes["none"][0] == 0
    assert holes["holes"][0] > 0


def test_a_merge_closes_what_nobody_saw(tmp_path):
    shape = surfrecon.sculpture(cell=8)
    images = surfrecon.virtual_scan(shape, surfrecon.turntable(shape, pixels=100, height_angle=0.6))
    # Range-grid PLY does not say from where a scan was seen.
    surfrecon.write_scans(tmp_path / "set.e57", images)
    bpy.ops.surfrecon.import_scans(filepath=str(tmp_path / "set.e57"))
    assert bpy.ops.surfrecon.merge(close="all", flat_base=True, measure=False) == {"FINISHED"}
    merged = bpy.context.object
    report = merged["surfrecon_report"].to_dict()
    assert report["filled_area"] > 0 and report["holes"][0] > 0
    fills = np.array([face.value for face in merged.data.attributes["hole_fill"].data], bool)
    corners = {v for face in np.flatnonzero(fills) for v in merged.data.polygons[face].vertices}
    group = merged.vertex_groups["Filled"].index
    grouped = {v.index for v in merged.data.vertices if any(one.group == group for one in v.groups)}
    assert grouped == corners and len(corners) > 100


def test_operators_ask_for_an_undo_step():
    # The bpy module crashes when any operator pushes its own step without a window, so the tests below push for them.
    for name in ("merge", "import_scans", "error_map"):
        assert "UNDO" in getattr(bpy.types, f"SURFRECON_OT_{name}").bl_options


def test_undo_is_one_step(scans):
    bpy.ops.ed.undo_push(message="before")
    count = len(bpy.data.objects)
    bpy.ops.surfrecon.merge(voxel=VOXEL)
    bpy.ops.ed.undo_push(message="after")
    assert len(bpy.data.objects) == count + 1
    bpy.ops.ed.undo()
    assert len(bpy.data.objects) == count and "torus merged" not in bpy.data.objects
    bpy.ops.ed.redo()
    assert "surfrecon_report" in bpy.data.objects["torus merged"]


def test_undo_keeps_the_range_images(scans):
    bpy.ops.ed.undo_push(message="before")
    names = [obj.name for obj in scans]
    bpy.ops.surfrecon.merge(voxel=VOXEL)
    first = len(bpy.context.object.data.polygons)
    bpy.ops.ed.undo_push(message="after")
    bpy.ops.ed.undo()
    for name in names:
        bpy.data.objects[name].select_set(True)
    bpy.ops.surfrecon.merge(voxel=VOXEL)
    assert len(bpy.context.object.data.polygons) == first


def test_saving_and_reloading_keeps_the_range_images(scans, tmp_path, extension):
    bpy.ops.surfrecon.merge(voxel=VOXEL)
    before = surface(bpy.context.object).positions.copy()
    names = [obj.name for obj in scans]
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scans.blend"))
    bpy.ops.wm.read_homefile(use_empty=True)
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "scans.blend"))
    assert bpy.data.objects["torus merged"]["surfrecon_report"].to_dict()["scans"] == len(names)
    bpy.data.objects.remove(bpy.data.objects["torus merged"])
    depsgraph = bpy.context.evaluated_depsgraph_get()
    for name in names:
        obj = bpy.data.objects[name]
        assert isinstance(extension.scan_objects.scan_of_object(obj, depsgraph), surfrecon.RangeImage)
        obj.select_set(True)
    bpy.ops.surfrecon.merge(voxel=VOXEL)
    assert np.array_equal(surface(bpy.context.object).positions, before)


def test_deleted_vertices_are_invalid_pixels(scans, images, extension):
    import bmesh

    obj = scans[0]
    edited = bmesh.new()
    edited.from_mesh(obj.data)
    edited.verts.ensure_lookup_table()
    bmesh.ops.delete(edited, geom=edited.verts[:100], context="VERTS")
    edited.to_mesh(obj.data)
    edited.free()
    image = extension.scan_objects.scan_of_object(obj, bpy.context.evaluated_depsgraph_get())
    assert image.valid.sum() == images[0].valid.sum() - 100
    assert bpy.ops.surfrecon.merge(voxel=VOXEL) == {"FINISHED"}


@pytest.mark.parametrize("kind", ["orthographic", "pinhole", "spherical"])
def test_vertices_on_their_rays_are_an_image_of_the_camera(kind, extension):
    eye, up, middle = (0, -5, 1), (0, 0, 1), (0, 0, 0)
    camera = {
        "orthographic": lambda: surfrecon.Camera.orthographic(60, 80, spacing=0.04, target=middle, toward=eye, up=up),
        "pinhole": lambda: surfrecon.Camera.pinhole(60, 80, height_angle=0.6, eye=eye, target=middle, up=up),
        "spherical": lambda: surfrecon.Camera.spherical(60, 360, lowest=-0.5, highest=0.2, eye=eye, up=up),
    }[kind]()
    seen = surfrecon.virtual_scan(torus(), camera)
    obj = extension.scan_objects.object_from_range_image("frame", seen, 1.0, faces=True)
    bpy.context.collection.objects.link(obj)
    obj.matrix_world = np.asarray(seen.world_from_sensor).T
    bpy.context.view_layer.update()

    def image():
        return extension.scan_objects.scan_of_object(obj, bpy.context.evaluated_depsgraph_get())

    back = image()
    assert back.projection["kind"] == kind and back.name == "frame"
    for name, value in seen.projection.items():
        assert back.projection[name] == (value if isinstance(value, str) else pytest.approx(value))
    assert np.array_equal(back.valid, seen.valid)
    assert np.abs(back.values - seen.values)[seen.valid].max() < 1e-5
    # Off its ray by a tenth of a pixel, and stretched: as the vertices are.
    obj.data.vertices[7].co.y += 0.005
    assert image().projection["kind"] == "points"
    obj.data.vertices[7].co.y -= 0.005
    assert image().projection["kind"] == kind
    obj.scale = (2, 1, 2)
    bpy.context.view_layer.update()
    assert image().projection["kind"] == "points"
    obj.scale = (2, -2, 2)
    bpy.context.view_layer.update()
    assert image().projection["kind"] == kind


@pytest.mark.parametrize("scale", [(2, 2, 2), (1, 1.5, 0.7), (-1, 1, 1), (-1, -1, -0.5)])
def test_moved_turned_scaled_and_mirrored_scans_go_where_they_are_seen(scans, scale):
    from mathutils import Matrix

    change = Matrix.Translation((3, 2, 1)) @ Matrix.Rotation(1, 4, "X") @ Matrix.Diagonal((*scale, 1))
    # An object itself can't be sheared, its parent's scale can do that to it.
    parent = bpy.data.objects.new("Parent", None)
    bpy.context.collection.objects.link(parent)
    parent.matrix_world = change
    for obj in scans:
        obj.parent = parent
    bpy.context.view_layer.update()
    assert bpy.ops.surfrecon.merge(voxel=VOXEL * min(map(abs, scale))) == {"FINISHED"}
    made = surface(bpy.context.object)
    check = made.check()
    assert check["is_manifold"] and check["components"] == 1 and check["genus"] == 1
    back = np.array(change.inverted())
    points = made.positions @ back[:3, :3].T + back[:3, 3]
    assert np.quantile(np.abs(torus_distance(points)), 0.99) < 0.01
    assert volume(made) > 0


def volume(mesh):
    a, b, c = (mesh.positions[mesh.triangles[:, i]] for i in range(3))
    return np.einsum("ij,ij->", a, np.cross(b, c)) / 6


@pytest.mark.parametrize("scale", [(1, 1, 1), (2, 1, 0.5), (-1, 1, 1)])
def test_any_oriented_mesh_can_be_merged(scale):
    from mathutils import Matrix

    matrix = Matrix.Rotation(0.5, 4, "Y") @ Matrix.Diagonal((*scale, 1))
    add_mesh("torus", torus(), matrix)
    assert bpy.ops.surfrecon.merge(voxel=0.05) == {"FINISHED"}
    made = surface(bpy.context.object)
    assert made.check()["is_closed"] and made.check()["genus"] == 1
    expected = volume(torus()) * abs(np.prod(scale))
    assert volume(made) == pytest.approx(expected, rel=0.01)


def test_modifiers_count():
    obj = add_mesh("torus", torus())
    modifier = obj.modifiers.new("Displace", "DISPLACE")
    modifier.strength, modifier.mid_level = 0.1, 0
    bpy.ops.surfrecon.merge(voxel=0.05)
    assert np.median(torus_distance(surface(bpy.context.object).positions)) == pytest.approx(0.1, abs=0.005)


def test_larger_polygons_are_cut():
    bpy.ops.mesh.primitive_cube_add(size=2)
    bpy.ops.surfrecon.merge(voxel=0.11)
    made = surface(bpy.context.object)
    assert made.check()["is_closed"] and volume(made) == pytest.approx(8, rel=0.05)


def test_colours_are_carried():
    obj = add_mesh("torus", torus())
    layer = obj.data.attributes.new("colour", "BYTE_COLOR", "POINT")
    layer.data.foreach_set("color_srgb", np.tile(np.float32([1, 0, 0.2, 1]), len(obj.data.vertices)))
    bpy.ops.surfrecon.merge(voxel=0.05)
    merged = bpy.context.object.data.attributes["colour"]
    assert merged.data_type == "FLOAT_COLOR"
    assert np.allclose([c.color_srgb for c in merged.data], [1, 0, 0.2, 1], atol=0.005)


def test_cancelling_leaves_the_scene_as_it_was(scans, snapshot, extension, monkeypatch):
    before = snapshot()
    running = extension.job.Running
    looks = []

    def ended(original=running.ended):
        looks.append(running.job.progress())
        running.job.cancel()
        return original()

    monkeypatch.setattr(running, "ended", ended)
    assert bpy.ops.surfrecon.merge(voxel=0.004) == {"CANCELLED"}
    assert looks and running.job is None
    assert snapshot() == before


def test_a_second_job_is_refused(scans, extension, images):
    job = surfrecon.Job.merge(images, voxel=0.004)
    extension.job.Running.begin(job, "Merge Scans")
    try:
        assert not bpy.ops.surfrecon.merge.poll()
        assert bpy.ops.surfrecon.cancel() == {"FINISHED"}
    finally:
        extension.job.Running.take()
    with pytest.raises(surfrecon.Cancelled):
        job.result()
    assert bpy.ops.surfrecon.merge.poll()


def test_nothing_selected():
    assert not bpy.ops.surfrecon.merge.poll()


def test_edit_mode(scans):
    bpy.ops.object.mode_set(mode="EDIT")
    assert not bpy.ops.surfrecon.merge.poll()
    bpy.ops.object.mode_set(mode="OBJECT")


def bad_points():
    mesh = bpy.data.meshes.new("points")
    mesh.vertices.add(5)
    obj = bpy.data.objects.new("points", mesh)
    bpy.context.collection.objects.link(obj)
    obj.select_set(True)


def bad_flat():
    obj = add_mesh("flat", torus())
    obj.scale = (1, 1, 0)
    bpy.context.view_layer.update()


def bad_transform():
    obj = add_mesh("lost", torus())
    obj.location.x = float("nan")
    bpy.context.view_layer.update()


def bad_vertex():
    mesh = torus()
    obj = add_mesh("broken", mesh)
    obj.data.vertices[5].co.x = float("nan")


def bad_empty():
    add_mesh("empty", surfrecon.Mesh(np.zeros((0, 3)), np.zeros((0, 3), int)))


@pytest.mark.parametrize(
    ("select", "text"),
    [
        (bad_points, '"points" has neither faces nor the attributes of a range image'),
        (bad_flat, '"flat" is flattened by a scale of 0'),
        (bad_transform, '"lost" has a location, rotation or scale that is no number'),
        (bad_vertex, '"broken" has a vertex whose coordinates are no numbers: .*vertices.5'),
        (bad_empty, '"empty" has no vertices'),
    ],
)
def test_bad_selections_get_one_sentence_and_change_nothing(select, text, snapshot):
    add_mesh("torus", torus())
    select()
    before = snapshot()
    with pytest.raises(RuntimeError, match=text):
        bpy.ops.surfrecon.merge()
    assert snapshot() == before


def test_a_voxel_larger_than_everything_is_no_crash(scans, snapshot):
    before = snapshot()
    try:
        bpy.ops.surfrecon.merge(voxel=100)
    except RuntimeError as problem:
        assert "voxel" in str(problem)
        assert snapshot() == before


@pytest.mark.skipif("SURFRECON_DATA" not in os.environ, reason="SURFRECON_DATA is not set")
def test_the_bunny():
    conf = Path(os.environ["SURFRECON_DATA"]) / "stanford_bunny" / "bun.conf"
    bpy.ops.surfrecon.import_scans(filepath=str(conf), axis_forward="-Z", axis_up="Y")
    assert len(bpy.data.collections["bun"].objects) == 10
    bpy.ops.surfrecon.merge(voxel=0.001436)
    merged = bpy.context.object
    check = surface(merged).check()
    assert check["is_manifold"] and check["components"] == 1
    report = merged["surfrecon_report"].to_dict()
    assert report["input_triangles"] == pytest.approx(690_821, rel=1e-3)
    # Upright: the bunny is about as high as it is wide, and it stands on its feet.
    assert 0.14 < merged.dimensions.z < 0.17


@pytest.mark.skipif("SURFRECON_DATA" not in os.environ, reason="SURFRECON_DATA is not set")
def test_quadriflow_takes_the_closed_bunny_in_centimetres():
    scans = surfrecon.open(Path(os.environ["SURFRECON_DATA"]) / "stanford_bunny" / "bun.conf")
    merged = surfrecon.merge(scans, max_hole_length=1.0).mesh
    assert merged.check()["boundary_edges"] == 0
    add_mesh("bunny", surfrecon.Mesh(100 * merged.positions, merged.triangles))
    assert bpy.ops.object.quadriflow_remesh(target_faces=2000) == {"FINISHED"}
