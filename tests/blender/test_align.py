"""The align operator: where scans go, what stays, what is refused and what is said."""

import bpy
import numpy as np
import pytest
import surfrecon
from files import write_set
from mathutils import Euler, Matrix, Vector
from shapes import torus
from test_merge import add_mesh
from test_panels import draw

REPORT = "surfrecon_align"
TRANSFORM = ("location", "rotation_euler", "rotation_quaternion", "scale")


@pytest.fixture(scope="module")
def images():
    """Six views around the sculpture, where they were taken."""
    mesh = surfrecon.sculpture(cell=2.0)
    return surfrecon.virtual_scan(mesh, surfrecon.turntable(mesh, around=6, above=0, below=0, pixels=130))


@pytest.fixture
def scans(tmp_path, images):
    """The same as objects, thrown about; and where they belong."""
    return imported(tmp_path, images)


def imported(tmp_path, images):
    """Range images as objects, thrown about."""
    for k, image in enumerate(images):
        image.name = f"view{k}"
    bpy.ops.surfrecon.import_scans(filepath=str(write_set(tmp_path, images)), unit="SCENE")
    objects = [bpy.data.objects[image.name] for image in images]
    for obj in objects:
        obj["truth"] = [x for row in obj.matrix_world for x in row]
    throw(objects)
    return objects


def throw(objects, seed=5):
    generator = np.random.default_rng(seed)
    for obj in objects:
        obj.matrix_world = Matrix.LocRotScale(
            Vector(generator.normal(size=3) * 100), Euler(generator.uniform(-3, 3, size=3)), None
        )
    bpy.context.view_layer.update()


def truth(obj):
    return np.array(obj["truth"]).reshape(4, 4)


def world(obj):
    return np.array(obj.matrix_world, np.float64)


def errors(objects):
    """Largest distance of a vertex of each object from where it belongs beside the first."""
    back = truth(objects[0]) @ np.linalg.inv(world(objects[0]))
    found = []
    for obj in objects:
        points = np.array([(*v.co, 1) for v in obj.data.vertices])
        found.append(np.linalg.norm(points @ (back @ world(obj) - truth(obj)).T, axis=1).max())
    return np.array(found)


def figures(obj):
    return obj[REPORT].to_dict()


def lies(objects):
    """The places of objects, to the bit."""
    return [[tuple(getattr(obj, name)) for name in TRANSFORM] for obj in objects]


def select(objects):
    for obj in bpy.data.objects:
        obj.select_set(obj in objects)
    bpy.context.view_layer.objects.active = objects[0]


def spacing(images):
    valid = images[0].valid
    return np.nanmedian(np.linalg.norm(np.diff(np.where(valid[..., None], images[0].points, np.nan), axis=1), axis=2))


def test_scans_come_to_where_they_belong(scans, images):
    assert errors(scans).max() > 10
    before = lies(scans)
    meshes = [[v.co[:] for v in obj.data.vertices[:50]] for obj in scans]
    assert bpy.ops.surfrecon.align() == {"FINISHED"}
    assert errors(scans).max() < spacing(images)
    # The largest stays, to the bit.
    report = figures(scans[0])
    states = report["states"].split("\n")
    assert sorted(states) == ["kept"] + 5 * ["placed"] and report["placed"] == 6
    kept = states.index("kept")
    assert lies(scans)[kept] == before[kept]
    assert [[v.co[:] for v in obj.data.vertices[:50]] for obj in scans] == meshes
    assert set(bpy.context.selected_objects) == set(scans) and all(REPORT in obj for obj in scans)


def test_scans_come_to_where_they_belong_wherever_their_vertices_are(scans, images):
    """Vertices that Apply Transform and edit mode moved, as a pose only the vertices know."""
    select(scans)
    bpy.ops.object.transform_apply(location=True, rotation=True, scale=True)
    throw(scans, seed=8)
    # The place of an object follows from where its vertices were.
    for obj, image in zip(scans, images, strict=True):
        before = np.asarray(image.points, float)[image.valid]
        after = np.array([v.co[:] for v in obj.data.vertices])
        rows = np.linalg.lstsq(np.c_[after, np.ones(len(after))], np.c_[before, np.ones(len(before))], rcond=None)[0]
        obj["truth"] = (truth(obj) @ rows.T).ravel().tolist()
    assert errors(scans).max() > 10
    assert bpy.ops.surfrecon.align(show_misfit=True) == {"FINISHED"}
    assert errors(scans).max() < spacing(images) and figures(scans[0])["placed"] == 6
    for obj in scans:
        misfit = np.empty(len(obj.data.vertices), np.float32)
        obj.data.attributes["error"].data.foreach_get("value", misfit)
        assert 0 < np.median(misfit) < spacing(images)


@pytest.mark.parametrize("mode", ["QUATERNION", "AXIS_ANGLE", "ZYX"])
def test_a_locked_scan_stays_to_the_bit(scans, images, mode):
    scans[2].rotation_mode = scans[3].rotation_mode = mode
    scans[2].lock_location = scans[2].lock_rotation = (True, True, True)
    # Locked in part is not locked.
    scans[3].lock_location = (True, True, False)
    scans[3].lock_rotation = (True, True, True)
    bpy.context.view_layer.update()
    before = lies(scans)
    assert bpy.ops.surfrecon.align() == {"FINISHED"}
    assert lies(scans)[2] == before[2] and errors(scans).max() < spacing(images)
    assert [
        state
        for state, here, there in zip(figures(scans[0])["states"].split("\n"), lies(scans), before, strict=True)
        if here == there
    ] == ["kept"]


def test_where_all_are_locked_nothing_moves(scans):
    for obj in scans:
        obj.lock_location = obj.lock_rotation = (True, True, True)
    before = lies(scans)
    assert bpy.ops.surfrecon.align() == {"FINISHED"}
    assert lies(scans) == before and set(figures(scans[0])["states"].split("\n")) == {"kept"}


def test_scans_keep_their_parents(scans, images):
    above = bpy.data.objects.new("above", None)
    bpy.context.collection.objects.link(above)
    above.location, above.rotation_euler = (10, 20, 30), (1, 2, 3)
    scans[1].parent = scans[4].parent = above
    # A scan that hangs on one, which hangs on another; and something else that goes along.
    scans[2].parent, scans[3].parent = scans[3], scans[0]
    lamp = bpy.data.objects.new("lamp", bpy.data.lights.new("lamp", "SUN"))
    bpy.context.collection.objects.link(lamp)
    lamp.parent = scans[5]
    throw(scans, seed=7)
    parents = [obj.parent for obj in scans]
    pose, hanging = world(above), lies([lamp])
    assert bpy.ops.surfrecon.align() == {"FINISHED"}
    assert errors(scans).max() < spacing(images)
    assert [obj.parent for obj in scans] == parents
    assert np.array_equal(world(above), pose) and lies([lamp]) == hanging


def test_undo_is_one_step(scans):
    bpy.ops.ed.undo_push(message="before")
    names, before = [obj.name for obj in scans], lies(scans)
    bpy.ops.surfrecon.align()
    bpy.ops.ed.undo_push(message="after")
    after = lies(bpy.data.objects[name] for name in names)
    assert after != before and "UNDO" in bpy.types.SURFRECON_OT_align.bl_options
    bpy.ops.ed.undo()
    assert lies(bpy.data.objects[name] for name in names) == before
    assert not any(REPORT in bpy.data.objects[name] for name in names)
    bpy.ops.ed.redo()
    assert lies(bpy.data.objects[name] for name in names) == after


def test_adjusting_begins_where_the_scans_were(scans, extension):
    """As Blender does: another result takes the place of the first, and what isn't placed any more goes back."""
    before = lies(scans)
    there = extension.adjusting.Before(bpy.context).replaced_by()
    bpy.ops.surfrecon.align()
    first = lies(scans)
    there.select(bpy.context)
    assert lies(scans) == before
    # None has that much in common.
    assert bpy.ops.surfrecon.align(min_overlap=1.0) == {"FINISHED"}
    assert lies(scans) == before and figures(scans[0])["placed"] == 0
    texts = draw(extension.panels.SURFRECON_PT_report)
    assert texts.count("not placed") == 5 and any(text.endswith("asks for 100 %: lower it") for text in texts)
    there.select(bpy.context)
    bpy.ops.surfrecon.align()
    assert lies(scans) == first


def test_rough_poses_within_a_reach(scans, images):
    for obj in scans:
        obj.matrix_world = Matrix(truth(obj)) @ Matrix.Rotation(0.02, 4, "Y") @ Matrix.Translation((1, 2, -1))
    bpy.context.view_layer.update()
    assert bpy.ops.surfrecon.align(start="rough", reach=20) == {"FINISHED"}
    assert errors(scans).max() < spacing(images)


def test_cancelling_changes_nothing(scans, extension, monkeypatch):
    before, running = lies(scans), extension.job.Running

    def ended(original=running.ended):
        running.job.cancel()
        return original()

    monkeypatch.setattr(running, "ended", ended)
    assert bpy.ops.surfrecon.align() == {"CANCELLED"}
    assert lies(scans) == before and running.job is None and not any(REPORT in obj for obj in scans)


@pytest.mark.parametrize("scale", [(2, 2, 2), (1, 1.2, 1), (-1, 1, 1)])
@pytest.mark.parametrize("kind", ["image", "mesh"])
def test_a_scaled_scan_is_refused_by_name(scans, scale, kind):
    scaled = scans[3] if kind == "image" else add_mesh("part", torus())
    scaled.scale = scale
    bpy.context.view_layer.update()
    before = lies(scans)
    with pytest.raises(RuntimeError, match=f'"{scaled.name}" is scaled.* Object > Apply > Scale'):
        bpy.ops.surfrecon.align()
    assert lies(scans) == before and not any(REPORT in obj for obj in scans)
    select([scaled])
    bpy.ops.object.transform_apply(location=False, rotation=False, scale=True)
    select([*scans, scaled])
    assert bpy.ops.surfrecon.align() == {"FINISHED"}


def test_what_cannot_be_placed_is_named_and_stays(scans, images, extension, capfd):
    bpy.ops.mesh.primitive_uv_sphere_add(segments=64, ring_count=32, radius=60, location=(500, 0, 0))
    ball = bpy.context.object
    ball.name = "ball"
    select([ball, *scans])
    before = lies([ball])
    assert bpy.ops.surfrecon.align() == {"FINISHED"}
    assert lies([ball]) == before and errors(scans).max() < spacing(images)
    said = capfd.readouterr().out
    assert '"ball" is not placed: ' in said and "6 of 7 scans placed" in said
    # The first is the name of the object.
    texts = draw(extension.panels.SURFRECON_PT_report)[1:]
    assert "6 of 7" in texts and texts[texts.index("ball") + 1] == "not placed"
    reason = dict(zip(*(figures(ball)[each].split("\n") for each in ("names", "reasons")), strict=True))["ball"]
    # A sentence, over several lines where the sidebar is narrow.
    assert len(reason) > 20 and reason[1:] in " ".join(texts)
    assert sum(text.startswith("± ") for text in texts) == 5 and texts.count("stays") == 1
    assert set(bpy.context.selected_objects) == {ball, *scans}


def test_different_things_stay_apart():
    statue = add_mesh("statue", surfrecon.sculpture(cell=4.0))
    ring = surfrecon.Mesh(torus().positions * 100, torus().triangles)
    other = add_mesh("ring", ring, Matrix.Translation((400, 0, 0)))
    select([statue, other])
    before = lies([statue, other])
    assert bpy.ops.surfrecon.align() == {"FINISHED"}
    assert lies([statue, other]) == before
    assert figures(other)["placed"] == 0 and sorted(figures(other)["states"].split("\n")) == ["kept", "unplaced"]


def test_meshes_are_aligned_too(tmp_path):
    mesh = surfrecon.sculpture(cell=2.0)
    images = surfrecon.virtual_scan(mesh, surfrecon.turntable(mesh, around=9, above=0, below=0, pixels=180))
    objects = imported(tmp_path, images)
    for obj in objects:
        for name in ("range_rows", "range_columns"):
            del obj[name]
    assert bpy.ops.surfrecon.align() == {"FINISHED"}
    assert errors(objects).max() < spacing(images)


def test_one_scan_is_too_few(scans):
    select(scans[:1])
    before = lies(scans)
    with pytest.raises(RuntimeError, match="Aligning takes at least two scans: select the others as well"):
        bpy.ops.surfrecon.align()
    assert lies(scans) == before
    for obj in scans:
        obj.select_set(False)
    assert not bpy.ops.surfrecon.align.poll()


def test_a_result_is_left_out_where_its_scans_are_aligned(scans):
    select(scans)
    bpy.ops.surfrecon.align()
    bpy.ops.surfrecon.merge(voxel=5)
    merged = bpy.context.object
    select([merged, *scans])
    before = lies([merged])
    assert bpy.ops.surfrecon.align() == {"FINISHED"}
    assert REPORT not in merged and lies([merged]) == before
    assert bpy.context.object in scans


def test_a_merge_of_what_does_not_fit_offers_to_align(scans, images, extension):
    for k, obj in enumerate(scans):
        obj.matrix_world = Matrix.Translation((k, 2 * k, -k)) @ Matrix(truth(obj))
    bpy.ops.surfrecon.merge(voxel=1)
    merged = bpy.context.object
    texts = draw(extension.panels.SURFRECON_PT_report)
    assert "align them first" in " ".join(texts) and "surfrecon.align" in texts
    for obj in scans:
        obj.hide_set(True)
    # The button works on the result, which stands for its scans.
    assert bpy.context.selected_objects == [merged]
    assert bpy.ops.surfrecon.align() == {"FINISHED"}
    assert errors(scans).max() < spacing(images)
    assert set(bpy.context.selected_objects) == set(scans)
    bpy.ops.surfrecon.merge(voxel=2)
    texts = draw(extension.panels.SURFRECON_PT_report)
    assert "Voxel" in texts and "surfrecon.align" not in texts


def test_who_does_not_stay_where_it_is_put_is_named(scans):
    anchor = bpy.data.objects.new("anchor", None)
    bpy.context.collection.objects.link(anchor)
    for obj in scans[:2]:
        obj.constraints.new("COPY_LOCATION").target = anchor
    bpy.context.view_layer.update()
    before, seen = lies(scans), [world(obj) for obj in scans]
    with pytest.raises(RuntimeError, match='"view[01]" does not stay where it is put: turn off constraints'):
        bpy.ops.surfrecon.align()
    bpy.context.view_layer.update()
    assert lies(scans) == before and np.array_equal([world(obj) for obj in scans], seen)
    scans[1].constraints.clear()
    scans[0].lock_location = scans[0].lock_rotation = (True, True, True)
    assert bpy.ops.surfrecon.align() == {"FINISHED"}
    assert lies(scans)[0] == before[0]


def test_misfit_is_shown_as_colours(scans, images):
    bent = scans[2].data
    positions = np.array([v.co for v in bent.vertices])
    # The upper part leans.
    positions[:, 0] += np.where(positions[:, 1] > np.quantile(positions[:, 1], 0.8), 3 * spacing(images), 0)
    bent.vertices.foreach_set("co", positions.astype(np.float32).ravel())
    assert bpy.ops.surfrecon.align(show_misfit=True) == {"FINISHED"}
    placed = [obj for obj in scans if "error" in obj.data.attributes]
    assert len(placed) >= 5 and all("error" in obj.material_slots[0].material.name for obj in placed)
    assert len({obj["surfrecon_error"]["limit"] for obj in placed}) == 1
    far = [obj["surfrecon_error"]["p95"] for obj in placed]
    assert scans[2] not in placed or scans[2]["surfrecon_error"]["p95"] > np.median(far)


def test_scans_that_are_aligned_are_merged_in_one_go(scans, capfd):
    assert bpy.ops.surfrecon.align_merge() == {"FINISHED"}
    assert errors(scans).max() < 2
    merged = bpy.context.object
    assert merged.name.endswith(" merged") and list(bpy.context.selected_objects) == [merged]
    assert "6 scans merged" in capfd.readouterr().out


def test_nothing_is_merged_unless_all_scans_have_a_place(scans, capfd):
    before = set(bpy.data.objects)
    stranger = add_mesh("stranger", torus())
    stranger.select_set(True)
    assert bpy.ops.surfrecon.align_merge() == {"FINISHED"}
    assert set(bpy.data.objects) == before | {stranger}
    said = capfd.readouterr().out
    assert "6 of 7 scans placed" in said
    assert "Nothing is merged, since not all scans are placed: Merge Scans takes them as they lie" in said
