"""The content of an installed wheel."""

import importlib.metadata
import json
import re
from pathlib import Path

import pytest
import surfrecon

# The folder that tools/testing/plan.py packs the wheel of the development profile into.
DEVELOPMENT = Path(__file__).resolve().parents[2] / "out" / "tests" / "development"


def test_what_is_linked_is_there_with_its_licence():
    files = importlib.metadata.files("surfrecon") or []
    endings = ("/licenses/LICENSES-THIRD-PARTY.txt", ".cyclonedx.json")
    found = [file for ending in endings for file in files if file.as_posix().endswith(ending)]
    if DEVELOPMENT in Path(surfrecon.__file__).parents:
        pytest.skip("the wheel of the development profile has no bill of materials; the wheel as released has")
    assert len(found) == len(endings)
    licences, bill = (file.read_text(encoding="utf-8") for file in found)
    names = re.findall(r"^- (.+?) \d\S*: ", licences, re.MULTILINE)
    crates = {name for name in names if "standard library" not in name}
    assert {"pyo3", "rayon", "png", "flate2"} <= crates
    assert "Rust's standard library" in names
    assert "Permission is hereby granted, free of charge" in licences
    # The folder of the build is nobody's business, and differs from build to build.
    assert set(re.findall(r"file:///[^/#\"]*", bill)) == {"file:///surfrecon"}
    # The bill also has what only runs in the compiler.
    assert crates <= {component["name"] for component in json.loads(bill)["components"]}
