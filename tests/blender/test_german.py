"""German is whole: each sentence that operators say has its translation, with the same parts."""

import ast
import re
from pathlib import Path

import bpy
import pytest

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


def test_translations_have_the_parts_of_their_sentences(extension):
    for english, german in extension.telling.GERMAN.items():
        assert german.strip() and english.count("{}") == german.count("{}"), english


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
