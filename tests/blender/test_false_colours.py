"""Colours of error are put on for looking: nothing reads them as colours of a surface, and nothing of them stays."""

import json
import struct

import bpy
import numpy as np
import pytest
from files import write_set
from shapes import torus, torus_scans
from test_merge import VOXEL, add_mesh

RED = (1.0, 0.0, 0.2, 1.0)


@pytest.fixture
def merged(tmp_path):
    bpy.ops.surfrecon.import_scans(filepath=str(write_set(tmp_path, torus_scans(pixels=60, noise=0.001))))
    bpy.ops.surfrecon.merge(voxel=VOXEL)
    return bpy.context.object


def coloured(name="colour", **options):
    """A torus in one colour."""
    obj = add_mesh("torus", torus(60), **options)
    layer = obj.data.attributes.new(name, "FLOAT_COLOR", "POINT")
    layer.data.foreach_set("color_srgb", np.tile(np.float32(RED), len(obj.data.vertices)))
    return obj


def is_red(obj):
    return np.allclose([value.color_srgb[:] for value in obj.data.attributes["colour"].data], RED, atol=0.01)


def looks(obj):
    """All that may be seen of an object, and that its file holds of it."""
    mesh = obj.data
    colours = mesh.color_attributes
    active = mesh.attributes.active
    rendered = colours[colours.render_color_index].name if colours.render_color_index >= 0 else ""
    return (
        sorted(mesh.attributes.keys()),
        None if active is None else active.name,
        colours.active_color_name,
        rendered if rendered != "error_colour" else "",
        [(slot.link, slot.material) for slot in obj.material_slots],
        sorted(obj.keys()),
        sorted(mesh.keys()),
        sorted(bpy.data.materials.keys()),
    )


def document(path, **options):
    """The JSON of a GLB that Blender writes of the scene."""
    bpy.ops.export_scene.gltf(filepath=str(path), **options)
    content = path.read_bytes()
    (length,) = struct.unpack("<I", content[12:16])
    return json.loads(content[20 : 20 + length])


def exported(path, **options):
    """The meshes of a GLB that Blender writes of the scene."""
    return document(path, **options)["meshes"]


def colours_in(mesh):
    return [name for name in mesh["primitives"][0]["attributes"] if name.startswith("COLOR")]


@pytest.mark.parametrize("hidden", [False, True])
def test_a_surface_made_of_one_with_an_error_map_has_no_colours(merged, hidden):
    bpy.ops.surfrecon.error_map()
    if hidden:
        bpy.ops.surfrecon.error_hide()
    bpy.ops.surfrecon.remesh(vertices=200)
    made = bpy.context.object
    assert made is not merged and "colour" not in made.data.attributes and not made.data.materials
    bpy.ops.object.select_all(action="DESELECT")
    merged.select_set(True)
    bpy.ops.surfrecon.reconstruct()
    assert "colour" not in bpy.context.object.data.attributes


def test_misfit_is_no_colour_of_the_scans(tmp_path):
    bpy.ops.surfrecon.import_scans(filepath=str(write_set(tmp_path, torus_scans(pixels=60)[:4])))
    scans = bpy.context.selected_objects
    bpy.ops.surfrecon.align(show_misfit=True)
    assert "error_colour" in scans[0].data.attributes
    bpy.ops.surfrecon.merge(voxel=VOXEL)
    assert "colour" not in bpy.context.object.data.attributes and not bpy.context.object.data.materials


def test_real_colours_are_taken_whatever_is_active():
    add_mesh("truth", torus(60))
    measured = coloured()
    bpy.ops.surfrecon.error_map()
    assert measured.data.color_attributes.active_color_name == "error_colour"
    bpy.ops.surfrecon.remesh(vertices=200)
    assert is_red(bpy.context.object)


@pytest.mark.parametrize("active", ["paint", "error_colour", "other"])
def test_the_user_s_own_colours_count_whatever_their_name(active):
    obj = coloured("paint")
    for name in ("error_colour", "other"):
        obj.data.color_attributes.new(name, "FLOAT_COLOR", "POINT")
    obj.data.color_attributes.active_color = obj.data.color_attributes[active]
    bpy.ops.surfrecon.merge(voxel=VOXEL)
    assert is_red(bpy.context.object)


@pytest.mark.parametrize("own", [None, "mesh", "object"])
@pytest.mark.parametrize("measure", ["error_map", "measure"])
def test_hiding_the_error_map_leaves_nothing_behind(own, measure):
    truth = add_mesh("truth", torus(60))
    obj = coloured("paint")
    obj.data.color_attributes.new("other", "BYTE_COLOR", "CORNER")
    obj.data.color_attributes.active_color = obj.data.color_attributes["other"]
    obj.data.color_attributes.render_color_index = 1
    if own is not None:
        material = bpy.data.materials.new("own")
        obj.data.materials.append(material if own == "mesh" else None)
    if own == "object":
        obj.material_slots[0].link, obj.material_slots[0].material = "OBJECT", material
    before = looks(obj)
    for _ in range(2):
        truth.select_set(True)
        bpy.context.view_layer.objects.active = obj
        getattr(bpy.ops.surfrecon, measure)()
    assert obj.data.color_attributes.active_color_name == "error_colour" and looks(obj) != before
    bpy.ops.surfrecon.error_hide()
    if measure == "measure":
        # Its figures are a report, which stays.
        del obj["surfrecon_measure"]
    assert looks(obj) == before


def test_hiding_misfit_leaves_nothing_behind(tmp_path):
    bpy.ops.surfrecon.import_scans(filepath=str(write_set(tmp_path, torus_scans(pixels=60)[:3])))
    scans = bpy.context.selected_objects
    before = [looks(obj) for obj in scans]
    bpy.ops.surfrecon.align(show_misfit=True)
    # Objects that show none may be selected as well.
    for data in (None, bpy.data.cameras.new("Camera")):
        bpy.context.scene.collection.objects.link(bpy.data.objects.new("other", data))
    bpy.ops.object.select_all(action="SELECT")
    bpy.ops.surfrecon.error_hide()
    for obj in scans:
        del obj["surfrecon_align"]
    assert [looks(obj) for obj in scans] == before


def test_what_measured_itself_keeps_its_distances(merged):
    before = looks(merged)
    assert "error" in merged.data.attributes
    bpy.ops.surfrecon.error_map()
    bpy.ops.surfrecon.error_hide()
    assert looks(merged) == before


def test_a_mesh_of_two_objects_shows_them_until_both_are_hidden():
    add_mesh("truth", torus(60))
    obj = add_mesh("torus", torus(60))
    twin = obj.copy()
    bpy.context.collection.objects.link(twin)
    for measured in (obj, twin):
        bpy.context.view_layer.objects.active = measured
        bpy.ops.surfrecon.error_map()
    for measured, left in ((obj, True), (twin, False)):
        bpy.ops.object.select_all(action="DESELECT")
        measured.select_set(True)
        bpy.ops.surfrecon.error_hide()
        assert ("error_colour" in obj.data.attributes) == left
    assert not bpy.data.materials and not obj.data.materials


@pytest.mark.parametrize("hidden", [False, True])
def test_no_false_colours_go_into_a_glb(merged, hidden, tmp_path):
    for obj in bpy.data.objects:
        obj.hide_render = obj is not merged
    bpy.ops.surfrecon.error_map()
    if hidden:
        bpy.ops.surfrecon.error_hide()
    before = looks(merged)
    (mesh,) = exported(tmp_path / "merged.glb", use_renderable=True)
    assert not colours_in(mesh) and "material" not in mesh["primitives"][0]
    assert looks(merged) == before


@pytest.mark.parametrize("link", ["DATA", "OBJECT"])
def test_own_materials_go_into_a_glb(merged, link, tmp_path):
    for obj in bpy.data.objects:
        obj.hide_render = obj is not merged
    merged.data.materials.append(None)
    merged.material_slots[0].link = link
    merged.material_slots[0].material = bpy.data.materials.new("own")
    bpy.ops.surfrecon.error_map()
    before = looks(merged)
    written = document(tmp_path / "merged.glb", use_renderable=True)
    assert [material["name"] for material in written["materials"]] == ["own"]
    assert looks(merged) == before


@pytest.mark.parametrize("shown", [False, True])
def test_real_colours_go_into_a_glb(shown, tmp_path):
    coloured()
    bpy.ops.surfrecon.merge(voxel=VOXEL)
    merged = bpy.context.object
    if shown:
        bpy.ops.surfrecon.error_map()
    bpy.data.objects["torus"].hide_render = True
    (mesh,) = exported(tmp_path / "merged.glb", use_renderable=True)
    assert colours_in(mesh) == ["COLOR_0"]
    assert is_red(merged)
