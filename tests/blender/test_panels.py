"""The sidebar draws in every state, and names only what exists."""

import math
import re
from types import SimpleNamespace

import bpy
import numpy as np
import pytest
import surfrecon
from files import write_set
from recordings import write_transforms
from shapes import torus_scans


class FakeLayout:
    """Takes what a layout takes, checks names, and notes every text."""

    def __init__(self, texts):
        self.__dict__["texts"] = texts

    def prop(self, data, name, **_):
        getattr(data, name)
        self.texts.append(data.bl_rna.properties[name].name)

    def operator(self, name, **_):
        category, operator = name.split(".")
        getattr(getattr(bpy.ops, category), operator).get_rna_type()
        self.texts.append(name)
        return SimpleNamespace()

    def label(self, text="", **_):
        self.texts.append(text)

    def progress(self, factor, text, **_):
        assert 0 <= factor <= 1
        self.texts.append(text)

    def separator(self, **_):
        pass

    def menu(self, name, **_):
        assert hasattr(bpy.types, name)
        self.texts.append(name)

    def template_color_ramp(self, data, name, **_):
        getattr(data, name)

    def _part(self, **_):
        return FakeLayout(self.texts)

    def panel(self, name, default_closed=False):
        """A panel in a panel, with what is folded."""
        self.texts.append(f"> {name}" if default_closed else name)
        return self._part(), self._part()

    row = column = split = box = _part

    def __setattr__(self, name, value):
        assert name in bpy.types.UILayout.bl_rna.properties


def draw(panel):
    """Texts of a panel, or None where it hides."""
    if hasattr(panel, "poll") and not panel.poll(bpy.context):
        return None
    texts = []
    panel.draw(SimpleNamespace(layout=FakeLayout(texts), operators=getattr(panel, "operators", ())), bpy.context)
    return texts


@pytest.fixture
def panels(extension):
    return {cls.__name__.rpartition("_")[2]: cls for cls in extension.panels.CLASSES}


def test_an_empty_scene(panels):
    assert "surfrecon.merge" in draw(panels["merge"])
    assert draw(panels["report"]) is None


def test_every_parameter_has_its_row(panels):
    texts = draw(panels["options"])
    for parameter in surfrecon.parameters("merge") + surfrecon.parameters("triangulate"):
        assert parameter.label in texts


def test_options_have_the_library_s_defaults_ranges_and_texts(extension):
    options = bpy.types.Scene.bl_rna.properties["surfrecon"].fixed_type.properties
    operator = bpy.ops.surfrecon.merge.get_rna_type().properties
    for parameter in surfrecon.parameters("merge") + surfrecon.parameters("triangulate"):
        for prop in (options[parameter.name], operator[parameter.name]):
            assert prop.default == pytest.approx(parameter.default or 0)
            assert prop.description == extension.properties.description(parameter)
            assert (prop.type == "BOOLEAN") == (parameter.kind == "flag")
            if parameter.kind in {"flag", "choice"}:
                continue
            # Sliders have no open ends.
            open_end = math.radians(0.1) if parameter.kind == "angle" else 1e-6 * (parameter.default or 0)
            least = parameter.minimum + (open_end if parameter.minimum_excluded else 0)
            assert prop.hard_min == pytest.approx(least)
            assert prop.hard_max == pytest.approx(min(parameter.maximum, 1e9))
            kind = {"length": "LENGTH", "angle": "ROTATION"}.get(parameter.kind, "NONE")
            assert getattr(prop, "unit", "NONE") == kind


def test_texts_say_what_the_buttons_do(extension):
    for parameter in surfrecon.parameters():
        text = extension.properties.description(parameter)
        if parameter.name == "threads":
            continue
        assert text.startswith(parameter.text[:-1])
        assert "_" not in text and not text.endswith(".") and text[0].isupper(), text
        # 0 means one thing only.
        assert len(re.findall(r"(?<![\w.,] )\b0(?=:| [a-z])", text)) <= 1, text
        if parameter.kind == "flag":
            assert " Off: " in text, text


def test_a_running_job_shows_progress_and_cancel(panels, extension):
    running = extension.job.Running
    running.begin(surfrecon.Job.merge(torus_scans(pixels=30)), "Merge Scans")
    try:
        for name in ("running", "merge"):
            texts = draw(panels[name])
            assert "surfrecon.cancel" in texts
            assert any("%" in text for text in texts)
        # The button that was pressed has become the progress, and all others are there.
        assert "surfrecon.merge" not in texts and {"surfrecon.align", "surfrecon.merge_to_file"} <= set(texts)
        assert not any("%" in text for text in draw(panels["place"]))
    finally:
        running.cancel()


def test_a_panel_has_as_many_rows_while_something_runs(panels, extension):
    quiet = {name: draw(panel) for name, panel in panels.items()}
    running = extension.job.Running
    running.begin(surfrecon.Job.merge(torus_scans(pixels=30)), "Merge Scans")
    try:
        for name, texts in quiet.items():
            now = draw(panels[name])
            # A bar and its button to cancel stand in one row.
            assert texts is None or len(now) - now.count("surfrecon.cancel") == len(texts), name
    finally:
        running.cancel()


def test_the_report_of_a_result(panels, tmp_path):
    bpy.ops.surfrecon.import_scans(filepath=str(write_set(tmp_path, torus_scans(pixels=60))))
    assert "Selection: 12 scans, 0 meshes" in draw(panels["running"])
    bpy.ops.surfrecon.merge()
    bpy.context.scene.unit_settings.system = "METRIC"
    texts = draw(panels["report"])
    assert "Voxel" in texts and f"{len(bpy.context.object.data.polygons):,}" in texts
    bpy.context.scene.unit_settings.system = "NONE"
    assert draw(panels["report"])


def first_lines(texts):
    """Those that are not folded."""
    ends = [k for k, text in enumerate(texts) if text.startswith("> ")]
    return texts[: ends[0]] if ends else texts


def test_a_report_begins_with_the_object_and_five_lines_for_people(panels, tmp_path):
    bpy.ops.surfrecon.import_scans(filepath=str(write_set(tmp_path, torus_scans(pixels=60))))
    bpy.ops.surfrecon.merge()
    units = bpy.context.scene.unit_settings
    units.system, units.length_unit = "METRIC", "MILLIMETERS"
    obj = bpy.context.object
    texts = draw(panels["report"])
    first = first_lines(texts)
    assert first[0] == obj.name
    assert first[1::2] == ["Triangles", "Size", "Holes", "Error", "With colours"]
    triangles, size, holes, error, colours = first[2::2]
    assert triangles == f"{len(obj.data.polygons):,}" and holes == "none, it is closed" and colours == "0 of 12"
    sides = (f"{1000 * side:,.0f}" if side > 1 else f"{1000 * side:.4g}" for side in obj.dimensions)
    assert size == f"{' x '.join(sides)} mm"
    assert "RMS, at most " in error and error.count(" mm") == 2
    assert "Voxel" in texts[len(first) :] and "All figures" in texts


def test_lengths_are_in_the_unit_that_the_scene_was_set_to(extension):
    units, length = bpy.context.scene.unit_settings, extension.words.length
    units.system = "METRIC"
    told = {}
    for unit in ("METERS", "MILLIMETERS", "CENTIMETERS", "MICROMETERS"):
        units.length_unit = unit
        told[unit] = length(bpy.context, 0.02)
    assert told == {"METERS": "2 cm", "MILLIMETERS": "20 mm", "CENTIMETERS": "2 cm", "MICROMETERS": "20,000 µm"}
    units.system, units.length_unit = "IMPERIAL", "INCHES"
    assert length(bpy.context, 0.254) == "10 in"
    units.scale_length = 0.001
    assert length(bpy.context, 254) == "10 in"


@pytest.mark.parametrize("unit", ["FEET", "ADAPTIVE"])
def test_imperial_lengths_are_feet_and_inches_below_a_foot(extension, unit):
    units = bpy.context.scene.unit_settings
    units.system, units.length_unit = "IMPERIAL", unit
    told = [extension.words.length(bpy.context, value) for value in (0, 0.0015, 0.2, 0.3048, -1.5, 300, 2000, 1e-6)]
    assert told == ["0 ft", "0.05906 in", "7.874 in", "1 ft", "-4.921 ft", "984.3 ft", "1.243 mi", "0.03937 thou"]
    units.scale_length = 0.001
    assert extension.words.length(bpy.context, 1.5) == "0.05906 in"


def test_how_much_was_seen_in_colour_is_said(panels, tmp_path):
    folder = tmp_path / "ring"
    path = write_transforms(folder, 6)
    for k in (1, 3, 5):
        (folder / "images" / f"{k:05}.png").unlink()
    bpy.ops.surfrecon.import_scans(filepath=str(path))
    assert len(bpy.context.selected_objects) == 6
    bpy.ops.surfrecon.merge()
    colours = np.empty(4 * len(bpy.context.object.data.vertices), np.float32)
    bpy.context.object.data.attributes["colour"].data.foreach_get("color", colours)
    share = np.mean(colours[3::4] > 0)
    texts = draw(panels["report"])
    assert 0.3 < share < 1
    assert texts[texts.index("With colours") + 1] == f"{100 * share:.3g} %, 3 of 6"


@pytest.mark.parametrize(
    ("system", "unit", "sides", "text"),
    [
        ("METRIC", "METERS", (2.15, 0.5312, 0.0015), "2.15 x 0.5312 x 0.0015 m"),
        ("METRIC", "ADAPTIVE", (0.1557, 0.0042, 0.12), "15.57 x 0.42 x 12 cm"),
        ("METRIC", "MILLIMETERS", (2.15, 0.5312, 0.0015), "2,150 x 531.2 x 1.5 mm"),
        ("METRIC", "METERS", (0, 0, 0), "0 x 0 x 0 m"),
        ("NONE", "ADAPTIVE", (2.15, 0.5312, 0.0015), "2.15 x 0.5312 x 0.0015"),
        ("IMPERIAL", "FEET", (2.15, 0.5312, 0.0015), "7.054 x 1.743 x 0.004921 ft"),
        ("IMPERIAL", "ADAPTIVE", (0.1557, 0.0042, 0.12), "6.13 x 0.1654 x 4.724 in"),
    ],
)
def test_sizes_are_in_one_unit(extension, system, unit, sides, text):
    units = bpy.context.scene.unit_settings
    units.system, units.length_unit = system, unit
    assert extension.words.size(bpy.context, sides) == text


def test_labels_that_are_too_long_for_their_column_have_a_line_of_their_own(extension):
    texts = []

    class Layout(FakeLayout):
        def split(self, factor):
            self.texts.append("split")
            return self._part()

    context = SimpleNamespace(region=SimpleNamespace(width=250), preferences=bpy.context.preferences)
    extension.panels.rows(context, Layout(texts), [("Size", "1 m"), ("Stray parts dropped, triangles", "3, 200")])
    assert texts == ["split", "Size", "1 m", "Stray parts dropped, triangles", "3, 200"]


def test_an_operator_that_no_panel_names_has_a_button(panels, extension, monkeypatch):
    assert extension.panels.others() == []
    reduce = panels["reduce"]
    *others, (name, _) = reduce.operators
    monkeypatch.setattr(extension.panels.SURFRECON_PT_reduce, "operators", others)
    assert extension.panels.others() == [(name, "MESH_DATA")]
    assert name in draw(reduce)


def test_what_an_import_said_stands_in_the_report(panels, tmp_path, capfd):
    assert bpy.ops.surfrecon.import_scans(filepath=str(write_transforms(tmp_path / "ring", 6)), frames=4) == {
        "FINISHED"
    }
    texts = draw(panels["report"])
    assert "ring" in texts or "transforms" in texts
    assert texts[texts.index("With colours") + 1] == "4 of 4"
    assert texts[texts.index("Frames in their files") + 1] == "2"
    said = next(line for line in capfd.readouterr().out.splitlines() if line.startswith("Info: 4 scans"))
    assert len(said) < 120, said
    notes = bpy.data.collections["transforms"]["surfrecon_import"]["notes"].splitlines()
    assert notes and all(word in " ".join(texts) for note in notes for word in note.split())


def test_the_steps_are_in_the_order_of_the_work(extension):
    labels = [cls.bl_label for cls in extension.panels.CLASSES if not getattr(cls, "bl_parent_id", "")]
    assert labels == [
        "Range Scans",
        "Bring In",
        "Look",
        "Size and Ground",
        "Clean",
        "Merge",
        "Measure",
        "Reduce",
        "Report",
    ]


def test_the_legend_is_in_the_scene_s_unit(panels, tmp_path):
    bpy.ops.surfrecon.import_scans(filepath=str(write_set(tmp_path, torus_scans(pixels=60))))
    bpy.ops.surfrecon.merge()
    assert draw(panels["error"]) is None
    bpy.ops.surfrecon.error_map(limit=0.02)
    bpy.context.scene.unit_settings.system = "METRIC"
    texts = draw(panels["error"])
    assert "2 cm" in texts and "1 cm" in texts and "surfrecon.error_hide" in texts
    bpy.context.scene.unit_settings.length_unit = "MILLIMETERS"
    bpy.ops.surfrecon.error_hide()
    assert draw(panels["error"]) is None


def test_the_menus_have_the_importer_and_the_exporter(extension):
    texts = []
    menu = SimpleNamespace(layout=FakeLayout(texts))
    extension.menus.menu_import(menu, bpy.context)
    extension.menus.menu_export(menu, bpy.context)
    extension.menus.menu_object(menu, bpy.context)
    assert texts == ["surfrecon.import_scans", "surfrecon.export_scans", "SURFRECON_MT_object"]
