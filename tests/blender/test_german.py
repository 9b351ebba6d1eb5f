"""German is whole: each sentence that operators say has its translation, with the same parts."""

import ast
import re
from pathlib import Path

import blf
import bpy
import messages
import pytest
import surfrecon

# Calls that say something, and which of their arguments.
SAY = {"tell": (2, 3), "told": (0, 1), "Refused": (0, 1), "number": (1, 3), "poll_message_set": (0, 1)}


def pattern(node):
    """A text with braces for what changes, or `None`."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return node.value
    if isinstance(node, ast.JoinedStr):
        text = "".join(part.value if isinstance(part, ast.Constant) else "{}" for part in node.values)
        # A part behind the end of a sentence is a sentence of its own.
        return re.sub(r"(?<=\S)\{\}$", "", text) if re.search(r"[\w}]\{\}$", text) else text
    return None


def said(folder):
    """All texts that are said."""
    for path in folder.glob("**/*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            # There the word is a name of figures.
            if path.name == "reports.py":
                continue
            name = getattr(getattr(node, "func", None), "attr", getattr(getattr(node, "func", None), "id", None))
            for one in node.args[slice(*SAY[name])] if name in SAY else ():
                for text in map(pattern, (one.body, one.orelse) if isinstance(one, ast.IfExp) else (one,)):
                    # Names and numbers alone are the same in all languages.
                    if text is not None and any(c.isalpha() for c in text.replace("{} of {}", "")):
                        yield text


def test_each_sentence_has_its_german(extension):
    telling = extension.telling
    without = set()
    for text in said(Path(extension.__file__).parent):
        parts = [part for joint in ("; ", ". ") for part in text.split(joint)] if ";" in text else [text]
        if all(telling.translated(part, telling.GERMAN) == part for part in parts) and text not in telling.GERMAN:
            without.add(text)
    # Sentences that are put together of parts, which are translated one by one.
    assert without <= {'"{}" has {}', "{} in {}"}


# Packages of the library that no operator calls.
NOT_CALLED = ("allocator", "benches", "examples", "finish", "fuzz", "tests", "texture")

# Files whose messages are about what no operator gives: pairs of points, photos, images of textures, merges in tasks,
# files in memory, checks of the library by itself, provenance.
NOT_GIVEN = {
    "align/src/constraints.rs",
    "align/src/report.rs",
    "base/src/account.rs",
    "geom/src/delaunay3/check.rs",
    "image/src/photo.rs",
    "io/src/export/images.rs",
    "io/src/export/jpeg.rs",
    "io/src/export/mtl.rs",
    "io/src/export/ply/pieces.rs",
    "io/src/export/provenance.rs",
    "io/src/export/tiles.rs",
    "io/src/import/frames/lens.rs",
    "io/src/import/frames/photos.rs",
    "io/src/memory_folder.rs",
    "merge/src/run/out_of_core/stages.rs",
    "mesh/src/images.rs",
    "scan/src/sculpture/mod.rs",
    "sculpt/src/reference/mod.rs",
    "src/merge_tasks.rs",
    "src/merge_to_file.rs",
    "src/reports.rs",
}

# Messages of other files that are about the same, by what they begin with.
NOT_GIVEN_TEXTS = (
    "# quaternions are x y z w",
    "a point grid needs a point a pixel",
    "a turntable needs bounds",
    "each corner of the bounds",
    "no place was found for the {} points picked",
    "points picked in",
    "the hierarchy has",
    "there is no scan {scan}: there are",
    "there is no task",
    "too few points are picked",
    "two scans have the version",
    "{:?} and {:?} are trusted",
    "{:?} and {:?} were said to touch",
    "{} given for {}",
    "{} versions for",
    "do not touch",
    "do not fit exactly",
    "fit badly",
    "fit in several places",
    "may turn or slide on",
)

# Values of the library's messages that are sentences' parts, and with them no dictionary would be asked.
VALUES = ("7", "", "pairs of points", "Crop the scans to where the plane is, or give it by three points")

# Words of English that are none of German.
ENGLISH = re.compile(
    r"\b(the|is|are|it|its|of|to|and|not|with|that|which|has|have|must|than|give|but|only|from|for|be|can|cannot|can't|no"
    r"|by|at|as|or|they|there|were|does|do|takes|need|needs|too|most|least|more|holds|found|given|between)\b"
)


def examples(text):
    """A message of the library as Blender gets it, with some values."""
    text = re.sub(r"\{[^{}]*:\?\}", '"S"', text.replace("{{", "(").replace("}}", ")"))
    for value in VALUES:
        filled = re.sub(r"\{[^{}]*\}", value, text)
        # A part that continues a sentence is looked up with what stands before it.
        yield filled.rstrip(" ,:;") if filled[:1] not in " ,.;:" else filled


def library():
    """Files of the library whose messages come to Blender."""
    for path in messages.sources():
        inside = path.relative_to(messages.ROOT)
        if inside.parts[0] == "rust-core" and inside.parts[1] not in NOT_CALLED:
            yield path, inside.relative_to("rust-core").as_posix()


def test_the_exceptions_are_there():
    names = {name for _, name in library()}
    assert names >= NOT_GIVEN
    texts = [one.text for path, _ in library() for one in messages.messages(path)]
    for begin in NOT_GIVEN_TEXTS:
        assert any(text.startswith(begin) for text in texts), begin


@pytest.mark.one_version
def test_each_message_of_the_library_has_its_german(extension):
    translated, german = extension.telling.translated, extension.telling.GERMAN
    sentence, without = extension.words.sentence, []
    for path, name in library():
        if name in NOT_GIVEN:
            continue
        for one in messages.messages(path):
            if one.text.startswith(NOT_GIVEN_TEXTS):
                continue
            # Parts that continue a sentence, and those that begin one that is advice here, are in the wholes.
            wholes = one.text in PARTS or any(one.text.strip() in key for key in german)
            if not wholes and all(ENGLISH.search(translated(sentence(text), german)) for text in examples(one.text)):
                without.append(f"{name}: {one.text}")
    assert not without, "\n".join(without)


# Parts of sentences whose wholes are below, with what is advised here.
PARTS = {
    "it fits {:?} {there}: check its pose and raise reach, or scan more of what both show",
    "pairs of points",
    "a rough pose, or pairs of points",
    "a rough pose, or ",
    "rough poses, or ",
    "give it a rough pose, or ",
    "align the recording as a sequence, give it a rough pose, or ",
    ", or a smaller min_component_share",
    " and a turn of {:.0} degrees",
    ", and {lost} of {count} frames have no pose and are skipped",
    ". Open3D's and Redwood's usual one is (525, 525, 319.5, 239.5)",
    "it fits {other:?} in {} places, and no other scan decides: give it {}a pair of points that both show",
    "nothing joins {} groups of scans: give {}a pair of points that two of them show",
    "{count} {are} left out, with values up to {}: all others lie within {}, so these stand for no measurement",
    "{count} {line} of control points: order {order} over {vertices} {line} of vertices needs {order} to {vertices}",
}


@pytest.mark.parametrize(
    "english",
    [
        'it fits "a" only where it would lie 0.3 from where it was given, and reach allows 0.1: check its pose and'
        " raise reach, or scan more of what both show",
        "no place was found where it fits another scan: it is of something else, or shares less than a third: give it a"
        " rough pose, or pairs of points",
        'it fits "a" in 3 places, and no other scan decides: give it a rough pose, or a pair of points that both show',
        'it shares hardly more than walls, floor or ceiling with "a", which fit elsewhere as well: align the recording'
        " as a sequence, give it a rough pose, or scan more of what stands in the room",
        'it shares hardly more than walls, floor or ceiling with "a", which fit elsewhere as well: give it a rough'
        " pose, or scan more of what stands in the room",
        "nothing joins 3 groups of scans: give rough poses, or a pair of points that two of them show",
        "nothing joins 3 groups of scans: give a pair of points that two of them show",
        "nothing is left of the surface: choose a voxel smaller than 0.1 (in the unit of the scans), or a smaller"
        " min_component_share",
        "no scan has a pose: all 3 stand at one place. Unless the camera stood still, align them first, or give their"
        " poses",
        "no scan has a pose: all 3 stand at one place, and their surfaces lie on each other nowhere: align them first,"
        " or give their poses",
        "9 images of 16 bits are read as height maps, since no camera is given. If they are depth images, give it as"
        " camera = (fx, fy, cx, cy). Or put a camera.json with fx, fy, cx, cy beside them.",
        "the clocks of depth images and poses differ. Each image takes the pose 0.2 s later. So overlapping frames lie"
        " 0.01 apart, not 0.2, and 3 of 20 frames have no pose and are skipped.",
        'fixed scans contradict each other: "a" and "b" are off by 0.3, "c" and "d" are off by 0.2 and 2 more. Check'
        " their poses, or fix one of them alone.",
        'it fits "a", but fixed scans contradict each other, "a" and "b" are off by 0.3: check their poses, or fix one'
        " of them alone",
        "tolerance, 1e-5, is smaller than the noise: 3 pairs of scans were refused that noise alone puts up to 1 apart."
        " Raise it, or leave it out.",
        '2 groups of scans hold the same samples each, leave all but one of each out: ("a", "b"), ("c") and others',
        '3 scans hold the same samples, leave all but one out: "a", "b", "c"',
        'track was lost between "a" and "b": the pair is rejected, and they are not in one group',
        '2 scans fit the placed ones in 3 places, 0.2 and a turn of 90 degrees apart, and nothing decides: "a", "b"',
        "3 pixels are left out, with values up to 9e9: all others lie within 5, so these stand for no measurement",
        "2 rows of control points: order 4 over 9 rows of vertices needs 4 to 9",
        "this recording of Open3D does not say its camera. Give it as camera = (fx, fy, cx, cy), or put a camera.json"
        " with fx, fy, cx, cy into the folder. Open3D's and Redwood's usual one is (525, 525, 319.5, 239.5).",
        "3 of 20 frames are skipped: 00001.png: the image ends too early, and 2 more",
        "chair: 24 frames of 3D Scanner App, 4 with colour",
        "poses read as y down, looking along z, camera to world (overlapping frames lie 0.01 apart, as world to camera:"
        " 0.3)",
    ],
)
def test_reasons_notes_and_messages_are_german_to_their_ends(extension, english):
    german = extension.telling.translated(extension.words.sentence(english), extension.telling.GERMAN)
    assert not ENGLISH.search(german), german


def test_stages_are_german(extension):
    """The stages of all operations, as progress shows them."""
    translated, german = extension.telling.translated, extension.telling.GERMAN
    stages = set()
    for path, name in library():
        if name not in NOT_GIVEN and not name.startswith("scan/src/sculpture/"):
            code = re.sub(r"^\s*//.*", "", path.read_text(), flags=re.M)
            for block in re.findall(r"stages! \{(.*?)\n\}|: Plan = &\[(.*?)\];", code, re.S):
                stages |= {part for text in re.findall(r'"([^"]+)"', "".join(block)) for part in text.split(", ")}
    assert {"reading scans", "digging", "clustering"} <= stages
    assert not [text for text in sorted(stages) if translated(text, german) == text]


def test_progress_is_german(extension, monkeypatch):
    running, telling = extension.running.Running, extension.telling
    monkeypatch.setattr(telling, "language_of", lambda _: telling.GERMAN)
    for name, value in (("stage", "reading scans, finding intersections"), ("fraction", 0.5), ("stopped", None)):
        monkeypatch.setattr(running, name, value)
    monkeypatch.setattr(running, "seconds_left", lambda: 3)
    assert running.text() == "Scans lesen, Schnittpunkte suchen 50%, noch 3 s"
    assert running.text(30) == "Scans lesen 50%, noch 3 s"
    assert running.text(20) == running.text(0) == "50%, noch 3 s"
    monkeypatch.setattr(running, "waiting", True)
    assert running.text() == "Für das Ergebnis in den Objektmodus wechseln"
    monkeypatch.setattr(running, "stopped", 1.0)
    assert running.text() == "wird angehalten"


def names(extension):
    """Names with their German."""
    module = extension.translations
    return {text: german for (context, text), german in module.LANGUAGES["de_DE"].items() if context == module.NAMES}


def test_german_labels_are_not_cut_off(extension):
    """Panels and dialogs have room for the English ones."""
    german = names(extension)
    kinds = [getattr(bpy.ops.surfrecon, name).get_rna_type() for name in dir(bpy.ops.surfrecon)]
    kinds += [extension.preferences.SurfreconPreferences.bl_rna, extension.properties.SurfreconSettings.bl_rna]
    props = [prop for rna in kinds for prop in rna.properties if prop.name in german]
    blf.size(0, 11)
    values = [item.name for prop in props for item in getattr(prop, "enum_items", ()) if item.name in german]
    for texts in ([prop.name for prop in props], values):
        room = max(blf.dimensions(0, text)[0] for text in texts)
        wider = {german[text] for text in texts if blf.dimensions(0, german[text])[0] > room}
        assert texts and not wider


def test_choices_that_reports_show_are_german(extension):
    shown = (Path(extension.__file__).parent / "reports.py").read_text()
    labels = {
        label
        for figure in surfrecon.figures()
        for _, label, _ in figure.choices or ()
        if f'told("{figure.name}")' in shown
    }
    assert labels and labels <= set(names(extension))


def test_translations_have_the_parts_of_their_sentences(extension):
    for english, german in extension.telling.GERMAN.items():
        places = {int(place) for place in re.findall(r"\{(\d)\}", german)}
        assert german.strip(), english
        assert english.count("{}") == german.count("{}") or max(places, default=0) < english.count("{}"), english
    # A joint of sentences is none.
    assert all("{}{}" not in english for english in extension.telling.GERMAN)


@pytest.mark.parametrize(
    ("english", "german"),
    [
        ("Switch to Object Mode first", "Erst in den Objektmodus wechseln"),
        ('"a: b" is no mesh: deselect it', '"a: b" ist kein Netz: abwählen'),
        (
            "12 scans merged: 1,200 triangles; left out: 2 cameras",
            "12 Scans vereint: 1,200 Dreiecke; weggelassen: 2 Kameras",
        ),
        ("4 scans, 6,714 samples, 2 frames in their files", "4 Scans, 6,714 Messpunkte, 2 Aufnahmen in den Dateien"),
        ("nothing known", "nothing known"),
        ("Scaled by 2; 3 sources went along", "Skaliert mit 2; 3 Quellen gingen mit"),
        (
            "Nothing but 1 camera, 2 lights is selected: select the scans",
            "Nur 1 Kamera, 2 Lichter ausgewählt: die Scans auswählen",
        ),
        ("It has no surface: no sample has neighbours", "Er hat keine Fläche: kein Messpunkt hat Nachbarn"),
        (
            '"ball" is not placed: no place was found where it fits another scan: it is of something else, or shares'
            " less than a third: move it nearer to where it belongs",
            '"ball" hat keinen Platz: kein Ort wurde gefunden, an dem er zu einem anderen Scan passt: er zeigt etwas'
            " anderes, oder hat weniger als ein Drittel gemeinsam: näher dorthin schieben, wo er hingehört",
        ),
    ],
)
def test_sentences_are_said_in_german(extension, english, german):
    assert extension.telling.translated(english, extension.telling.GERMAN) == german


def test_operators_say_them_in_the_language_of_the_interface(extension, monkeypatch):
    telling = extension.telling
    assert telling.told("Switch to Object Mode first") == "Switch to Object Mode first"
    monkeypatch.setattr(telling, "language_of", lambda _: telling.GERMAN)
    with pytest.raises(RuntimeError, match="Zum Ausrichten braucht es wenigstens zwei Scans"):
        bpy.ops.mesh.primitive_uv_sphere_add()
        bpy.ops.surfrecon.align()
