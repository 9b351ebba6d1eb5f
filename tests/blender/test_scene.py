"""The extension among Blender's own things: menus, hidden and linked objects, preferences, colours, preview."""

import re
from pathlib import Path
from types import SimpleNamespace

import bpy
import numpy as np
import pytest
import surfrecon
from conftest import MODULE
from files import write_set
from shapes import torus, torus_scans
from test_merge import VOXEL, add_mesh
from test_panels import FakeLayout


def operators():
    return [getattr(bpy.types, name) for name in dir(bpy.types) if name.startswith("SURFRECON_OT_")]


def test_every_operator_is_in_a_menu_and_says_what_it_does(extension):
    texts = []
    menu = SimpleNamespace(layout=FakeLayout(texts))
    bpy.types.SURFRECON_MT_object.draw(menu, bpy.context)
    extension.menus.menu_import(menu, bpy.context)
    extension.menus.menu_export(menu, bpy.context)
    offered = {text for text in texts if text.startswith("surfrecon.")}
    for cls in operators():
        name = "surfrecon." + cls.__name__.removeprefix("SURFRECON_OT_")
        # A former name is for scripts alone.
        if name == "surfrecon.cancel" or "INTERNAL" in getattr(cls, "bl_options", ()):
            continue
        assert name in offered, f"{name} is in no menu"
        rna = getattr(bpy.ops.surfrecon, name.split(".")[1]).get_rna_type()
        assert len(rna.description) > 25 and not rna.description.endswith(".")
        assert re.fullmatch(r"[A-Z]\w*( [A-Z]\w*| and| around| for| from| by| or| to)*", rna.name)
        for prop in rna.properties:
            if prop.identifier in {"rna_type", "bl_idname"} or prop.is_hidden or "filter" in prop.identifier:
                continue
            assert prop.name and prop.name[0].isupper(), (name, prop.identifier)
            assert not prop.description.endswith("."), (name, prop.identifier)
    assert extension.menus.menu_object in bpy.types.VIEW3D_MT_object.draw._draw_funcs


def test_the_preferences_are_used(tmp_path):
    preferences = bpy.context.preferences.addons[MODULE].preferences
    path = str(write_set(tmp_path, torus_scans(pixels=30)[:1]))
    bpy.ops.surfrecon.import_scans(filepath=path)
    metres = bpy.context.object.dimensions.x
    try:
        preferences.unit = "MM"
        bpy.ops.surfrecon.import_scans(filepath=path)
        assert bpy.context.object.dimensions.x == pytest.approx(metres / 1000, rel=1e-4)
        bpy.context.scene.unit_settings.scale_length = 0.001
        bpy.ops.surfrecon.import_scans(filepath=path)
        assert bpy.context.object.dimensions.x == pytest.approx(metres, rel=1e-4)
        bpy.ops.surfrecon.import_scans(filepath=path, unit="M")
        assert bpy.context.object.dimensions.x == pytest.approx(1000 * metres, rel=1e-4)
        bpy.ops.surfrecon.import_scans(filepath=path, unit="SCENE")
        assert bpy.context.object.dimensions.x == pytest.approx(metres, rel=1e-4)
    finally:
        preferences.unit = "M"
        bpy.context.scene.unit_settings.scale_length = 1
    texts = []
    type(preferences).draw(SimpleNamespace(layout=PreferenceLayout(preferences, texts)), bpy.context)
    assert texts == ["threads", "memory", "unit", "hide_sources"]


class PreferenceLayout:
    def __init__(self, preferences, texts):
        self.__dict__.update(preferences=preferences, texts=texts)

    def prop(self, data, name):
        getattr(self.preferences, name)
        self.texts.append(name)

    def __setattr__(self, name, value):
        assert name in bpy.types.UILayout.bl_rna.properties


def test_the_memory_limit_refuses_before_it_begins(tmp_path):
    preferences = bpy.context.preferences.addons[MODULE].preferences
    bpy.ops.surfrecon.import_scans(filepath=str(write_set(tmp_path, torus_scans(pixels=60))))
    names = bpy.data.objects.keys()
    try:
        preferences.memory = 0.001
        with pytest.raises(RuntimeError, match="MB"):
            bpy.ops.surfrecon.merge(voxel=0.002)
        assert bpy.data.objects.keys() == names
    finally:
        preferences.memory = 0
    assert bpy.ops.surfrecon.merge(voxel=VOXEL) == {"FINISHED"}


def test_hidden_scans_are_left_out(tmp_path):
    bpy.ops.surfrecon.import_scans(filepath=str(write_set(tmp_path, torus_scans(pixels=60))))
    scans = bpy.context.selected_objects
    scans[0].hide_set(True)
    bpy.ops.surfrecon.merge(voxel=VOXEL)
    assert bpy.context.object["surfrecon_report"]["scans"] == len(scans) - 1


def test_objects_of_linked_libraries_are_read_and_never_written(tmp_path):
    bpy.ops.surfrecon.import_scans(filepath=str(write_set(tmp_path, torus_scans(pixels=60))))
    names = [obj.name for obj in bpy.context.selected_objects]
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "library.blend"))
    bpy.ops.wm.read_homefile(use_empty=True)
    with bpy.data.libraries.load(str(tmp_path / "library.blend"), link=True) as (_, wanted):
        wanted.objects = names
    for obj in wanted.objects:
        bpy.context.collection.objects.link(obj)
        obj.select_set(True)
    bpy.context.view_layer.objects.active = wanted.objects[0]
    with pytest.raises(RuntimeError, match="is linked from another file, which is left as it is"):
        bpy.ops.surfrecon.clean()
    with pytest.raises(RuntimeError, match="is linked from another file, which is left as it is"):
        bpy.ops.surfrecon.align()
    with pytest.raises(RuntimeError, match="is linked from another file, which is left as it is"):
        bpy.ops.surfrecon.error_map()
    assert bpy.ops.surfrecon.merge(voxel=VOXEL) == {"FINISHED"}
    assert bpy.context.object.library is None


def test_results_keep_materials_and_show_colours(tmp_path):
    images = torus_scans(pixels=60)[:1]
    bpy.ops.surfrecon.import_scans(filepath=str(write_set(tmp_path, images)))
    scan = bpy.context.object
    material = bpy.data.materials.new("clay")
    scan.data.materials.append(material)
    bpy.ops.surfrecon.sculpt(relative_tolerance=0.01)
    assert list(bpy.context.object.data.materials) == [material]


def test_scans_are_told_apart_by_colour(tmp_path):
    bpy.ops.surfrecon.import_scans(filepath=str(write_set(tmp_path, torus_scans(pixels=40)[:5])))
    scans = bpy.context.selected_objects
    for obj in scans:
        obj.color = (1, 1, 1, 1)
    assert bpy.ops.surfrecon.tint_scans() == {"FINISHED"}
    assert len({tuple(obj.color) for obj in scans}) == 5


def test_the_origin_of_an_import(tmp_path):
    images = torus_scans(pixels=40)[:2]
    for image in images:
        pose = np.array(image.world_from_sensor)
        pose[:3, 3] += (5, 6, 7)
        image.world_from_sensor = pose
    path = str(write_set(tmp_path, images))
    middle = {}
    for origin in ("KEEP", "CENTRE"):
        bpy.ops.surfrecon.import_scans(filepath=path, origin=origin)
        bpy.context.view_layer.update()
        boxes = [obj.matrix_world @ obj.data.vertices[0].co for obj in bpy.context.selected_objects]
        middle[origin] = np.mean(boxes, axis=0)
    assert np.allclose(middle["KEEP"], (5, 6, 7), atol=1.5) and np.allclose(middle["CENTRE"], 0, atol=1.5)


def test_a_preview_is_shaded_triangles(extension):
    mesh = torus(10)
    corners, colours = extension.preview.shaded(mesh.positions, mesh.triangles)
    assert corners.shape == (3 * len(mesh.triangles), 3) and colours.shape == (3 * len(mesh.triangles), 4)
    assert np.isfinite(colours).all() and colours.min() > 0 and colours.max() <= 1
    extension.preview.end()


def test_times_are_told_as_people_do(extension):
    duration = extension.words.duration
    assert [duration(x) for x in (0.2, 59.6, 99, 150, 7300)] == ["1 s", "60 s", "99 s", "3 min", "2 h 2 min"]


def test_several_surfaces_and_none(extension):
    from pytest import raises

    surfaces = extension.surfaces
    depsgraph = bpy.context.evaluated_depsgraph_get()
    with raises(extension.running.Refused, match="has no faces"):
        surfaces.surface_of([], depsgraph)
    add_mesh("a", torus(10))
    add_mesh("b", torus(12))
    depsgraph = bpy.context.evaluated_depsgraph_get()
    made = surfaces.surface_of(bpy.context.selected_objects, depsgraph)
    assert len(made.triangles) == len(torus(10).triangles) + len(torus(12).triangles)
    assert made.check()["components"] == 2 and made.check()["is_closed"]


def test_presets_come_with_the_extension():
    for operator, names in {
        "import_scans": {"Stanford_Models.py", "Millimetres.py", "Aerial_Survey.py", "Phone_Recording.py"},
        "virtual_scan": {"Depth_Camera.py", "Exact.py"},
    }.items():
        paths = bpy.utils.preset_paths(f"operator/surfrecon.{operator}")
        found = {file.name for path in paths for file in Path(path).glob("*.py")}
        assert names <= found
        properties = getattr(bpy.ops.surfrecon, operator).get_rna_type().properties
        for path in paths:
            for file in Path(path).glob("*.py"):
                for name in re.findall(r"^op\.(\w+) =", file.read_text(), re.M):
                    assert name in properties


def test_presets_are_written_as_in_the_guide():
    guide = (Path(__file__).parents[2] / "blender-addon" / "README.md").read_text()
    for path in (Path(__file__).parents[2] / "blender-addon").glob("extension/presets/operator/*import_scans/*.py"):
        # As Blender's list of presets shows a file.
        assert f"*{bpy.path.display_name(path.name, title_case=False)}*" in guide


# Words that Blender itself has in all its languages.
BLENDER_S_OWN = {
    "File Path",
    "Forward",
    "Up",
    *(f"{s}{a} {w}" for s in ("", "-") for a in "XYZ" for w in ("Forward", "Up")),
}


def names_and_tooltips(extension):
    """Texts of operators, and all other texts, that the interface shows."""
    operators_, texts = set(), {cls.bl_label for cls in extension.panels.CLASSES}
    kinds = [extension.preferences.SurfreconPreferences.bl_rna, extension.properties.SurfreconSettings.bl_rna]
    for name in dir(bpy.ops.surfrecon):
        rna = getattr(bpy.ops.surfrecon, name).get_rna_type()
        operators_.add(rna.name)
        texts.add(rna.description)
        kinds.append(rna)
    for prop in (prop for rna in kinds for prop in rna.properties):
        if prop.is_hidden or prop.identifier in {"rna_type", "bl_idname", "module", "name"}:
            continue
        texts.add(prop.name)
        texts |= {item.name for item in getattr(prop, "enum_items", ())}
        assert prop.name in BLENDER_S_OWN or prop.translation_context == extension.translations.NAMES, prop.identifier
    texts.add(bpy.types.Object.bl_rna.properties["surfrecon_level"].name)
    folder = Path(extension.__file__).parent
    for path, pattern in (
        (folder / "panels.py", r'text="([^"]+)"'),
        *((folder / name, r'yield "([^"]+)", ') for name in ("reports.py", "summary.py", "imported.py")),
        *((path, r"""word\(["']([^"']+)["']""") for path in folder.glob("**/*.py")),
        (folder / "operators" / "import_scans.py", r'header.label\(text="([^"]+)"'),
    ):
        texts |= set(re.findall(pattern, path.read_text()))
    texts |= {*extension.reports.UNMOVED.values(), extension.reports.MOVE}
    told = (folder / "reports.py").read_text()
    shown = " ".join(re.findall(r"told(?:\.label)?\((.*?)\)(?:,|$)", told, re.M))
    declared = [figure for name in extension.reports.DECLARED.values() for figure in surfrecon.figures(name)]
    figures = [figure for figure in declared if f'"{figure.name}"' in shown]
    texts |= {figure.label for figure in figures} | {label for one in figures for _, label, _ in one.choices or ()}
    # Operators without lines of their own show all figures.
    operators = {operation.name for operation in surfrecon.operations() if operation.operator is not None}
    for name in operators & set(extension.reports.OTHERS.values()):
        told = extension.reports.Told(name, None, {figure.name: 0 for figure in surfrecon.figures(name)})
        texts |= {figure.label for figure in told.shown()}
    return operators_, texts - BLENDER_S_OWN


def fresh_texts(extension, parameter):
    """Texts of a parameter in the window."""
    choices = ((label, text.removesuffix(".")) for _, label, text in parameter.choices)
    return {parameter.label, extension.properties.description(parameter), *(text for pair in choices for text in pair)}


# Tooltips that are the same in all languages, or that Blender has.
SAME_TIPS = {
    "Filepath used for exporting the file",
    "Mapbox: -10000 + (65536 R + 256 G + B) / 10",
    "Mapzen: 256 R + G + B / 256 - 32768",
}


def tips(extension):
    """Texts that explain options and their choices."""
    kinds = [extension.preferences.SurfreconPreferences.bl_rna, extension.properties.SurfreconSettings.bl_rna]
    kinds += [getattr(bpy.ops.surfrecon, name).get_rna_type() for name in dir(bpy.ops.surfrecon)]
    for prop in (prop for rna in kinds for prop in rna.properties):
        own = {"rna_type", "bl_idname", "module", "name", "axis_forward", "axis_up"}
        if not prop.is_hidden and prop.identifier not in own:
            yield from filter(None, [prop.description, *(item.description for item in getattr(prop, "enum_items", ()))])


def test_every_text_has_its_translation_and_every_translation_its_text(extension):
    operators_, texts = names_and_tooltips(extension)
    module = extension.translations
    # Pairs that the sidebar shows beside those it yields.
    pairs = {"95 % below", "Largest found", "Max", "Mean", "Of the uniform grid", "RMS", "Relative error"}
    pairs |= {"Selection", "scan", "scans", "mesh", "meshes", "frame in its file", "frames in their files"}
    pairs |= {"other", "others", "Left open as seen through"}
    texts = {(context, text) for context in (module.TEXTS, module.NAMES) for text in texts | pairs}
    wanted = {(module.OPERATORS, text) for text in operators_} | texts
    wanted |= {(module.TEXTS, text) for text in set(tips(extension)) - SAME_TIPS}
    for language, found in module.LANGUAGES.items():
        assert re.fullmatch(r"[a-z]{2}_[A-Z]{2}", language)
        assert set(found) <= wanted, sorted(set(found) - wanted)
        # A parameter that no release has yet may be without.
        fresh = {text for p in surfrecon.parameters() if p.since != "0.1" for text in fresh_texts(extension, p)}
        assert all(text in fresh for _, text in wanted - set(found)), sorted(wanted - set(found))
        assert all(translated.strip() for translated in found.values())


@pytest.fixture
def users_presets(extension, tmp_path, monkeypatch):
    """The folder of the user's presets of operators, with one of a former name."""
    monkeypatch.setattr(bpy.utils, "user_resource", lambda kind, path="": str(tmp_path / path))
    folder = tmp_path / "presets" / "operator"
    (folder / "surfrecon.cluster").mkdir(parents=True)
    (folder / "surfrecon.cluster" / "Mine.py").write_text(
        "import bpy\nop = bpy.context.active_operator\n\nop.vertices = 123\n"
    )
    yield folder
    extension.presets.news.clear()


def register_again(extension):
    extension.presets.unregister()
    extension.presets.register()


def test_presets_of_a_former_name_are_taken_over_and_said_once(users_presets, extension, capfd):
    register_again(extension)
    old, new = users_presets / "surfrecon.cluster" / "Mine.py", users_presets / "surfrecon.remesh" / "Mine.py"
    assert new.read_text() == old.read_text()
    add_mesh("torus", torus(20))
    said = []
    for _ in range(2):
        bpy.context.view_layer.objects.active = bpy.data.objects["torus"]
        assert bpy.ops.surfrecon.remesh(vertices=60) == {"FINISHED"}
        said.append("1 preset of surfrecon.cluster taken over" in capfd.readouterr().out)
    assert said == [True, False]
    # One that was deleted does not come back.
    new.unlink()
    register_again(extension)
    assert old.exists() and not new.exists() and not extension.presets.news


def test_presets_of_the_new_name_stay_as_they_are(users_presets, extension):
    mine = users_presets / "surfrecon.remesh" / "Mine.py"
    mine.parent.mkdir()
    mine.write_text("op.vertices = 5\n")
    register_again(extension)
    assert mine.read_text() == "op.vertices = 5\n" and not extension.presets.news


def test_scripts_with_the_former_name_of_remesh_are_told_the_new_one(capfd):
    add_mesh("torus", torus(20))
    assert bpy.ops.surfrecon.cluster(resolution="VERTICES", vertices=77) == {"FINISHED"}
    assert len(bpy.context.object.data.vertices) == 77
    assert "Warning: surfrecon.cluster is called surfrecon.remesh now" in capfd.readouterr().out


@pytest.mark.parametrize("action", ["KEEP", "REMOVE"])
def test_scripts_with_the_former_name_of_regions_are_told_the_new_ones(tmp_path, action, capfd):
    bpy.ops.surfrecon.import_scans(filepath=str(write_set(tmp_path, torus_scans(pixels=40)[:2])))
    scans = bpy.context.selected_objects
    before = sum(len(obj.data.vertices) for obj in scans)
    for obj in scans:
        obj.data.vertices.foreach_set("select", [k < 10 for k in range(len(obj.data.vertices))])
    assert bpy.ops.surfrecon.select_region(action=action, by="SELECTED") == {"FINISHED"}
    after = sum(len(obj.data.vertices) for obj in scans)
    assert after == (20 if action == "KEEP" else before - 20)
    text = "Warning: surfrecon.select_region is called surfrecon.keep_inside and surfrecon.remove_inside now"
    assert text in capfd.readouterr().out
