"""Sources of results: known by pointers, hidden from views, renders and exports, named where they are gone."""

import bpy
import numpy as np
import pytest
from files import write_set
from recordings import write_transforms
from shapes import torus, torus_scans
from test_error_map import errors
from test_false_colours import exported
from test_measure import quad
from test_merge import VOXEL, add_mesh
from test_panels import draw
from test_recording import load
from test_regions import standing_torus

COUNT = 6


@pytest.fixture
def scans(tmp_path):
    bpy.ops.surfrecon.import_scans(filepath=str(write_set(tmp_path, torus_scans(pixels=60, noise=0.001)[:COUNT])))
    return bpy.context.selected_objects


@pytest.fixture
def wished(extension, monkeypatch):
    """Sources are hidden as in a window."""
    monkeypatch.setattr(extension.hiding, "is_wished", lambda: True)


def only(obj):
    for other in list(bpy.context.view_layer.objects.selected):
        other.select_set(False)
    obj.select_set(True)
    bpy.context.view_layer.objects.active = obj


def delete(obj):
    """As the key X does."""
    with bpy.context.temp_override(selected_objects=[obj], active_object=obj, object=obj):
        bpy.ops.object.delete()


# By pointers


def test_renamed_sources_are_still_the_sources(scans):
    bpy.ops.surfrecon.merge(voxel=VOXEL)
    merged = bpy.context.object
    before = errors(merged)
    for k, obj in enumerate(scans[1:]):
        obj.name = f"other {k}"
    only(merged)
    assert bpy.ops.surfrecon.error_map() == {"FINISHED"}
    assert np.allclose(errors(merged), before, atol=1e-6)


def test_a_scan_that_is_renamed_while_it_is_merged_is_a_source(scans, extension, monkeypatch):
    running = extension.job.Running

    def ended(original=running.ended):
        scans[0].name = "renamed"
        return original()

    monkeypatch.setattr(running, "ended", ended)
    bpy.ops.surfrecon.merge(voxel=VOXEL)
    assert scans[0] in extension.sources.sources_of(bpy.context.object)


@pytest.mark.parametrize("operator", ["error_map", "measure"])
def test_what_is_gone_is_said_by_name(scans, operator, capfd, extension):
    bpy.ops.surfrecon.merge(voxel=VOXEL)
    merged = bpy.context.object
    names = [obj.name for obj in scans]
    scans[1].name = "renamed"
    delete(scans[0])
    bpy.data.objects.remove(scans[1])
    only(merged)
    capfd.readouterr()
    assert getattr(bpy.ops.surfrecon, operator)() == {"FINISHED"}
    said = capfd.readouterr().out
    assert f'"{names[0]}", "{names[1]}", of which "{merged.name}" was made, are gone: it is measured' in said
    for obj in scans[2:]:
        delete(obj)
    only(merged)
    told = " ".join(draw(extension.panels.SURFRECON_PT_report))
    assert f'"{names[0]}", "{names[1]}", "{names[2]}" and 3 more, of which' in told
    with pytest.raises(RuntimeError, match=f'"{names[0]}", .* and 3 more, of which .*: select what'):
        bpy.ops.surfrecon.error_map()


def test_what_was_deleted_is_not_in_the_file_that_is_saved(scans, tmp_path):
    bpy.ops.surfrecon.merge(voxel=VOXEL)
    names = [obj.name for obj in scans]
    for obj in scans[:2]:
        delete(obj)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "saved.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "saved.blend"))
    assert not set(names[:2]) & set(bpy.data.objects.keys()) and set(names[2:]) <= set(bpy.data.objects.keys())


def test_names_in_files_of_before_become_pointers(tmp_path):
    source, result = quad("source", 0), quad("result", 0.25)
    result["surfrecon_scans"] = "source\nremoved meanwhile"
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "old.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "old.blend"))
    source, result = bpy.data.objects["source"], bpy.data.objects["result"]
    source.name = "renamed"
    assert "surfrecon_scans" not in result
    only(result)
    bpy.ops.surfrecon.measure()
    assert result["surfrecon_measure"]["against"] == "renamed"


def test_a_copy_and_undo_keep_the_sources(scans, extension):
    bpy.ops.surfrecon.merge(voxel=VOXEL)
    merged = bpy.context.object
    copy = merged.copy()
    bpy.context.collection.objects.link(copy)
    assert extension.sources.sources_of(copy) == extension.sources.sources_of(merged) == scans
    name, names = merged.name, [obj.name for obj in scans]
    bpy.ops.ed.undo_push(message="merged")
    bpy.data.objects[names[0]].name = "renamed"
    bpy.ops.ed.undo_push(message="renamed")
    bpy.ops.ed.undo()
    assert [obj.name for obj in extension.sources.sources_of(bpy.data.objects[name])] == names


# Names


def test_a_result_is_named_after_what_it_was_made_of(scans):
    bpy.ops.surfrecon.merge(voxel=VOXEL)
    assert bpy.context.object.name == bpy.context.object.data.name == "torus merged"
    only(scans[3])
    bpy.ops.surfrecon.merge(voxel=VOXEL)
    assert bpy.context.object.name == f"{scans[3].name} merged"
    only(add_mesh("left", torus()))
    add_mesh("right", torus())
    bpy.ops.surfrecon.merge(voxel=VOXEL)
    assert bpy.context.object.name == "left merged"


# Hiding


def test_hidden_sources_are_hidden_from_renders_and_one_switch_shows_them(scans, wished):
    scans[0].hide_render = True
    bpy.ops.surfrecon.merge(voxel=VOXEL)
    merged = bpy.context.object
    assert not any(obj.visible_get() for obj in scans) and all(obj.hide_render for obj in scans)
    assert merged.visible_get() and not merged.hide_render
    bpy.ops.surfrecon.show_sources()
    assert all(obj.visible_get() for obj in scans)
    assert [obj.hide_render for obj in scans] == [True] + (COUNT - 1) * [False]
    bpy.ops.surfrecon.show_sources()
    assert not any(obj.visible_get() for obj in scans) and all(obj.hide_render for obj in scans)
    # Alt+H shows them in views only; the switch does the rest.
    bpy.ops.object.hide_view_clear()
    only(merged)
    bpy.ops.surfrecon.show_sources()
    assert all(obj.visible_get() for obj in scans) and not scans[1].hide_render
    only(scans[0])
    assert not bpy.ops.surfrecon.show_sources.poll()
    # Sources whose result was deleted.
    only(merged)
    bpy.ops.surfrecon.show_sources()
    delete(merged)
    bpy.ops.object.hide_view_clear()
    assert scans[1].hide_render and scans[1].visible_get()
    bpy.context.view_layer.objects.active = scans[1]
    bpy.ops.surfrecon.show_sources()
    assert not scans[1].hide_render


def covered(folder):
    """The share of a rendered picture that shows something, seen from above."""
    scene = bpy.context.scene
    if scene.camera is None:
        scene.camera = bpy.data.objects.new("above", bpy.data.cameras.new("above"))
        scene.collection.objects.link(scene.camera)
        scene.camera.location.z = 6
    scene.render.engine, scene.cycles.samples, scene.render.film_transparent = "CYCLES", 1, True
    scene.render.resolution_x = scene.render.resolution_y = 24
    scene.render.image_settings.file_format, scene.render.image_settings.color_mode = "PNG", "RGBA"
    scene.render.filepath = str(folder / "picture.png")
    bpy.ops.render.render(write_still=True)
    picture = bpy.data.images.load(scene.render.filepath)
    pixels = np.empty(4 * 24 * 24, np.float32)
    picture.pixels.foreach_get(pixels)
    bpy.data.images.remove(picture)
    return float(np.mean(pixels[3::4] > 0.5))


def test_a_rendered_picture_has_no_hidden_source(scans, wished, tmp_path):
    before = covered(tmp_path)
    bpy.ops.surfrecon.merge(voxel=VOXEL)
    merged = bpy.context.object
    merged.hide_render = True
    assert before > 0.1 and covered(tmp_path) == 0
    # One switch shows them again.
    assert bpy.ops.surfrecon.show_sources() == {"FINISHED"}
    assert covered(tmp_path) == before
    bpy.ops.surfrecon.show_sources()
    merged.hide_render = False
    assert covered(tmp_path) > 0.1


def test_cameras_of_frames_are_hidden_with_them_but_for_that_of_the_scene(tmp_path, wished):
    load(write_transforms(tmp_path / "ring", 4), frames=4)
    bpy.ops.surfrecon.merge(voxel=VOXEL)
    views = [obj for obj in bpy.data.objects if obj.type == "CAMERA"]
    assert len(views) == 4 and [obj for obj in views if obj.visible_get()] == [bpy.context.scene.camera]
    bpy.ops.surfrecon.show_sources()
    assert all(obj.visible_get() for obj in views)


def test_hidden_sources_stay_out_of_a_glb(scans, wished, tmp_path):
    bpy.ops.surfrecon.merge(voxel=VOXEL)
    merged = bpy.context.object
    assert [mesh["name"] for mesh in exported(tmp_path / "alone.glb")] == [merged.name]
    bpy.ops.wm.obj_export(filepath=str(tmp_path / "alone.obj"))
    lines = (tmp_path / "alone.obj").read_text().splitlines()
    assert [line for line in lines if line.startswith("o ")] == [f"o {merged.name.replace(' ', '_')}"]
    only(merged)
    bpy.ops.surfrecon.show_sources()
    assert len(exported(tmp_path / "all.glb")) == 1 + COUNT
    # Eyes that are opened by hand are meant.
    bpy.ops.surfrecon.show_sources()
    bpy.ops.object.hide_view_clear()
    assert len(exported(tmp_path / "all.glb")) == 1 + COUNT


def test_a_scan_of_which_nothing_is_left_is_not_rendered(scans):
    bpy.ops.mesh.primitive_cube_add(size=10, location=(0, 0, 50))
    away = scans[0]
    away.location.z += 50
    bpy.context.view_layer.update()
    for obj in scans:
        obj.select_set(True)
    bpy.ops.surfrecon.select_region(action="REMOVE")
    assert not away.visible_get() and away.hide_render
    assert all(obj.visible_get() and not obj.hide_render for obj in scans[1:])


def test_aligning_the_scans_of_a_result_shows_them_again(scans, wished):
    bpy.ops.surfrecon.merge(voxel=VOXEL)
    merged = bpy.context.object
    bpy.ops.surfrecon.align()
    assert all(obj.visible_get() and not obj.hide_render for obj in scans)
    assert not merged.visible_get() and merged.hide_render


# One thing with its sources


def test_true_size_and_ground_take_the_sources_along(scans, wished, capfd, extension):
    bpy.ops.surfrecon.merge(voxel=VOXEL)
    merged = bpy.context.object
    bpy.ops.surfrecon.remesh(vertices=400)
    made = bpy.context.object
    bpy.ops.surfrecon.error_map()
    before = made["surfrecon_error"]["rms"]
    figures, limit = merged["surfrecon_report"].to_dict(), made["surfrecon_error"]["limit"]
    worst = errors(made).max()
    picked = np.zeros(len(made.data.vertices), bool)
    picked[:2] = True
    made.data.vertices.foreach_set("select", picked)
    a, b = (np.array(made.data.vertices[k].co) for k in range(2))
    capfd.readouterr()
    assert bpy.ops.surfrecon.true_size(distance=3 * float(np.linalg.norm(b - a))) == {"FINISHED"}
    assert f"; {COUNT + 1} sources went along" in capfd.readouterr().out
    bpy.context.view_layer.update()
    # Figures and legends are as much larger.
    for name in ("voxel", "rms_error", "max_error", "merge_distance"):
        assert merged["surfrecon_report"][name] == pytest.approx(3 * figures[name])
    assert merged["surfrecon_report"]["scans"] == figures["scans"]
    assert made["surfrecon_error"]["rms"] == pytest.approx(3 * before)
    assert errors(made).max() == pytest.approx(3 * worst)
    assert extension.false_colours.limit_of(made) == pytest.approx(3 * limit)
    bpy.ops.surfrecon.error_map()
    assert made["surfrecon_error"]["rms"] == pytest.approx(3 * before, rel=1e-3, abs=1e-6)
    # Its scans tell where the ground is.
    picked[2] = True
    made.data.vertices.foreach_set("select", picked)
    only(made)
    assert bpy.ops.surfrecon.ground(by="PICKED") == {"FINISHED"}
    assert f"; {COUNT + 1} sources went along" in capfd.readouterr().out
    bpy.context.view_layer.update()
    bpy.ops.surfrecon.error_map()
    assert made["surfrecon_error"]["rms"] == pytest.approx(3 * before, rel=1e-3, abs=1e-6)
    merged.hide_set(False)
    only(merged)
    bpy.ops.surfrecon.error_map()
    assert merged["surfrecon_error"]["rms"] == pytest.approx(merged["surfrecon_report"]["rms_error"], rel=1e-2)


def test_the_ground_of_a_result_is_found_in_its_hidden_scans(tmp_path, wished):
    subject, low = standing_torus()
    load(write_transforms(tmp_path / "ring", 4, colour=None, subject=subject), frames=4)
    scans = bpy.context.selected_objects
    bpy.ops.surfrecon.merge(voxel=VOXEL)
    merged = bpy.context.object
    heights = [obj.location.z for obj in scans]
    assert bpy.ops.surfrecon.ground(by="FOUND") == {"FINISHED"}
    assert np.allclose([obj.location.z for obj in scans], np.array(heights) - low, atol=0.02)
    only(merged)
    bpy.ops.surfrecon.error_map()
    assert merged["surfrecon_error"]["rms"] < 0.01
