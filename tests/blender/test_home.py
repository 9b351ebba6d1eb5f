"""Results go into the scene and the collection where their operation was begun, whatever is shown meanwhile."""

import bpy
import pytest
from files import write_set
from shapes import torus, torus_scans
from test_cancelling import floor
from test_merge import VOXEL, add_mesh


@pytest.fixture
def scans(tmp_path):
    bpy.ops.surfrecon.import_scans(filepath=str(write_set(tmp_path, torus_scans(pixels=60)[:4])))
    return bpy.context.selected_objects


@pytest.fixture
def meanwhile(extension, monkeypatch):
    """Does something while the next operation runs, once."""

    def when(act):
        running, left = extension.job.Running, [act]

        def ended(original=running.ended):
            if left:
                left.pop()()
            return original()

        monkeypatch.setattr(running, "ended", ended)

    return when


def switch():
    """Another scene is shown, with something selected in it."""
    other = bpy.data.scenes.new("Other")
    cube = bpy.data.objects.new("Cube", bpy.data.meshes.new("Cube"))
    other.collection.objects.link(cube)
    cube.select_set(True, view_layer=other.view_layers[0])
    other.view_layers[0].objects.active = cube
    bpy.context.window.scene = other


def test_a_merge_lands_in_the_scene_where_it_was_begun(scans, meanwhile, extension, monkeypatch, capfd):
    monkeypatch.setattr(extension.hiding, "is_wished", lambda: True)
    scene = bpy.context.scene
    meanwhile(switch)
    assert bpy.ops.surfrecon.merge(voxel=VOXEL) == {"FINISHED"}
    merged = bpy.data.objects["torus merged"]
    assert merged.users_scene == (scene,)
    layer = scene.view_layers[0]
    assert layer.objects.active == merged and list(layer.objects.selected) == [merged]
    assert all(obj.hide_get(view_layer=layer) and obj.hide_render for obj in scans)
    # The scene that is shown stays as it is.
    assert bpy.context.scene.name == "Other" and [obj.name for obj in bpy.context.selected_objects] == ["Cube"]
    assert f'The result is in the scene "{scene.name}", where it was begun' in capfd.readouterr().out


def test_it_lands_in_the_collection_where_it_was_begun(scans, meanwhile):
    here, there = (bpy.data.collections.new(name) for name in ("here", "there"))
    layer = bpy.context.view_layer
    for collection in (here, there):
        bpy.context.scene.collection.children.link(collection)
    layer.active_layer_collection = layer.layer_collection.children["here"]

    def click():
        layer.active_layer_collection = layer.layer_collection.children["there"]
        here.name = "renamed"

    meanwhile(click)
    bpy.ops.surfrecon.merge(voxel=VOXEL)
    assert list(bpy.context.object.users_collection) == [here]


def test_scans_are_aligned_and_grounded_where_they_are(scans, meanwhile):
    scene, layer = bpy.context.scene, bpy.context.view_layer
    meanwhile(switch)
    assert bpy.ops.surfrecon.align() == {"FINISHED"}
    assert scans[0]["surfrecon_align"]["of"] == len(scans)
    bpy.context.window.scene = scene
    add_mesh("plane", torus())
    plane = bpy.context.object
    plane.data.clear_geometry()
    plane.data.from_pydata([(0, 0, 3), (1, 0, 3), (0, 1, 3)], [], [])
    plane.data.vertices.foreach_set("select", [True] * 3)
    heights = [obj.location.z for obj in scans]

    def deselect():
        for obj in list(layer.objects.selected):
            obj.select_set(False)

    meanwhile(deselect)
    assert bpy.ops.surfrecon.ground(by="PICKED") == {"FINISHED"}
    assert [obj.location.z for obj in scans] == pytest.approx([abs(height - 3) for height in heights], abs=1e-4)


def test_imports_and_chains_go_there_too(scans, meanwhile, tmp_path):
    scene = bpy.context.scene
    (tmp_path / "more").mkdir()
    path = write_set(tmp_path / "more", torus_scans(pixels=40)[:2], name="two")
    meanwhile(switch)
    assert bpy.ops.surfrecon.import_scans(filepath=str(path)) == {"FINISHED"}
    assert bpy.data.collections["two"] in list(scene.collection.children)


def test_a_scene_that_is_removed_meanwhile_is_named(scans, meanwhile):
    scene = bpy.context.scene

    def remove():
        switch()
        bpy.data.scenes.remove(scene)

    meanwhile(remove)
    with pytest.raises(RuntimeError, match="The scene in which this was begun was removed meanwhile"):
        bpy.ops.surfrecon.merge(voxel=VOXEL)


def swap_names(one, other):
    """Two objects get each other's name."""
    first, second = one.name, other.name
    one.name = "for a moment"
    other.name, one.name = first, second
    assert (one.name, other.name) == (second, first)


def selected_only(*objects):
    for obj in bpy.context.selected_objects:
        obj.select_set(False)
    for obj in objects:
        obj.select_set(True)
    bpy.context.view_layer.objects.active = objects[0]


@pytest.mark.parametrize("measure", [False, True])
def test_an_error_map_goes_to_the_object_whatever_it_is_called_then(scans, meanwhile, measure):
    bpy.ops.surfrecon.merge(voxel=VOXEL, measure=measure)
    merged, other = bpy.context.object, scans[0]
    selected_only(merged)
    meanwhile(lambda: swap_names(merged, other))
    assert bpy.ops.surfrecon.error_map() == {"FINISHED"}
    assert "surfrecon_error" in merged and "surfrecon_error" not in other


def test_a_measurement_goes_to_the_object_whatever_it_is_called_then(scans, meanwhile):
    bpy.ops.surfrecon.merge(voxel=VOXEL)
    merged, other = bpy.context.object, scans[0]
    selected_only(merged)
    meanwhile(lambda: swap_names(merged, other))
    assert bpy.ops.surfrecon.measure() == {"FINISHED"}
    assert "surfrecon_measure" in merged and "surfrecon_measure" not in other


def test_scans_are_cleaned_whatever_they_are_called_then(scans, meanwhile):
    for obj, count in zip(scans, (10, 20, 30, 40), strict=True):
        attribute = obj.data.attributes.new("confidence", "FLOAT", "POINT")
        attribute.data.foreach_set("value", [float(k >= count) for k in range(len(obj.data.vertices))])
    before = [len(obj.data.vertices) for obj in scans]
    selected_only(*scans)
    meanwhile(lambda: (swap_names(*scans[:2]), setattr(scans[2], "name", "renamed")))
    assert bpy.ops.surfrecon.clean(smallest=1, confidence=0.5) == {"FINISHED"}
    assert [count - len(obj.data.vertices) for count, obj in zip(before, scans, strict=True)] == [10, 20, 30, 40]


def test_the_background_of_renamed_scans_is_removed(scans, meanwhile, extension):
    below = floor(extension)
    selected_only(*scans, below)
    meanwhile(lambda: setattr(below, "name", "renamed"))
    assert bpy.ops.surfrecon.remove_background() == {"FINISHED"}
    # Nothing of it is left, so it is hidden.
    assert below.hide_render and not any(obj.hide_render for obj in scans)


@pytest.mark.parametrize("operator", ["align", "align_merge"])
def test_scans_are_aligned_whatever_they_are_called_then(scans, meanwhile, operator):
    bpy.context.view_layer.update()
    places = [obj.matrix_world.copy() for obj in scans]
    for obj in scans[1:]:
        obj.location.x += 0.01
    bpy.context.view_layer.update()
    meanwhile(lambda: (swap_names(*scans[:2]), setattr(scans[2], "name", "renamed")))
    assert getattr(bpy.ops.surfrecon, operator)(show_misfit=True) == {"FINISHED"}
    for place, obj in zip(places, scans, strict=True):
        assert (obj.matrix_world.translation - place.translation).length < 0.05, obj.name
        assert "surfrecon_align" in obj
    names = scans[0]["surfrecon_align"]["names"].split("\n")
    assert sorted(names) == sorted(obj.name for obj in scans)


@pytest.mark.parametrize("operator", ["align", "clean", "remove_background", "error_map", "measure"])
def test_a_scan_that_is_deleted_meanwhile_is_named(scans, meanwhile, extension, operator):
    """One that a result points to stays in the file, and no scene has it."""
    bpy.ops.surfrecon.merge(voxel=VOXEL)
    merged = bpy.context.object
    kept = bpy.data.objects.new("kept", None)
    kept.surfrecon_sources.add().object = merged
    bpy.context.scene.collection.objects.link(kept)
    gone = merged if operator in {"error_map", "measure"} else scans[1]
    selected_only(*([merged] if gone is merged else [*scans, floor(extension)]))

    def delete():
        for collection in gone.users_collection:
            collection.objects.unlink(gone)

    meanwhile(delete)
    with pytest.raises(RuntimeError, match=f'"{gone.name}" was removed meanwhile: try again'):
        getattr(bpy.ops.surfrecon, operator)()
