"""The files of the command line import each other in no circle, whenever they do."""

import re
from graphlib import TopologicalSorter
from pathlib import Path

import surfrecon.cli

FOLDER = Path(surfrecon.cli.__file__).parent


def imported(text):
    """Names of files beside one that it imports, at its top or later."""
    for names in re.findall(r"^\s*from \. import ([\w, ]+)", text, re.M):
        yield from re.findall(r"\w+", names)
    yield from re.findall(r"^\s*from \.(\w+) import", text, re.M)


def test_no_files_import_each_other_in_a_circle():
    files = {path.stem: path.read_text("utf-8") for path in FOLDER.glob("*.py")}
    imports = {name: {other for other in imported(text) if other in files} for name, text in files.items()}
    assert sum(map(len, imports.values())) > 40
    assert len(list(TopologicalSorter(imports).static_order())) == len(files)
