"""The recipe for an operation in CONTRIBUTING.md names the files that operations have, and few of them."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
OPERATIONS = ("align", "merge", "sculpt", "quads", "reconstruct", "cluster")


def recipe():
    """The files of the recipe."""
    text = (ROOT / "CONTRIBUTING.md").read_text("utf-8")
    table = text.split("**An operation.**")[1].split("**A figure of a report.**")[0]
    return re.findall(r"^\| `([^`]+)` \|", table, re.M)


def test_an_operation_takes_few_files_by_hand():
    assert 5 < len(recipe()) <= 10


@pytest.mark.parametrize("operation", OPERATIONS)
def test_each_operation_has_the_files_of_the_recipe(operation):
    for path in recipe():
        assert (ROOT / path.replace("NAME", operation)).is_file(), path


@pytest.mark.parametrize("operation", OPERATIONS)
def test_each_crate_has_the_usual_skeleton(operation):
    source = ROOT / "rust-core" / operation / "src"
    assert {"lib.rs", "operation.rs", "params.rs", "report.rs"} <= {path.name for path in source.iterdir()}


@pytest.mark.parametrize("operation", OPERATIONS)
def test_the_root_of_a_crate_only_lists_its_modules(operation):
    """The steps are in the driver and its stages. Former names of functions may stay at the root."""
    text = (ROOT / "rust-core" / operation / "src" / "lib.rs").read_text("utf-8")
    former = re.sub(r"#\[deprecated.*?\n}\n", "", text, flags=re.S)
    assert not re.search(r"^(pub )?(fn|struct|enum|const) ", former, re.M)


@pytest.mark.parametrize("operation", OPERATIONS)
def test_lists_that_are_found_name_no_operation(operation):
    """A list that has the operation, and is neither generated nor in the recipe, would be a further file by hand."""
    for path in (
        "blender-addon/extension/operators/__init__.py",
        "meshlab-plugin/src/plugin.cpp",
        "c-api/src/params.rs",
    ):
        text = (ROOT / path).read_text("utf-8")
        by_hand = re.sub(r"// modules\n.*?// end\n", "", text, flags=re.S)
        assert not re.search(rf"\b{operation}(_filter)?\b", by_hand), path
