"""The recipe for an operation in CONTRIBUTING.md names the files that operations have by hand, and few of them."""

import re
import subprocess
from pathlib import Path

import crates
import pytest

ROOT = Path(__file__).resolve().parents[2]
OPERATIONS = ("align", "merge", "sculpt", "quads", "reconstruct", "cluster")

# Code that lists operations. Tests, benchmarks and demos try what they choose, and lists of symbols are generated.
CODE = ("blender-addon", "c-api", "meshlab-plugin", "python", "rust-core", "tests/rust", "tools", "Cargo.toml")
ENDINGS = {".rs", ".py", ".pyi", ".toml", ".c", ".cpp", ".h", ".hpp", ".sh", ".txt"}
OTHERS = ("c-api/abi/", "rust-core/benches/", "rust-core/examples/", "rust-core/tests/", "tests/rust/c/calls/")
# A file with so many of the operations has a list of them. One may be left out of a list for a reason.
LISTED = 5

# Parts that `make generate` writes, between marks.
PARTS = re.compile(
    r"^ *(//|#) (modules|exports|operations|structs|reports|types|options: .*)\n[\s\S]*?^ *\1 end\b", re.M
)
LISTS = re.compile(r"^(__all__ = \[|from \._(native|reports) import \()\n[\s\S]*?^[\])]", re.M)
# Files that it writes, wholly or but for a head that names no operation.
GENERATED = {
    "c-api/include/surfrecon.h",
    "tests/rust/c/generated.rs",
    "tests/rust/c/library.rs",
    "tests/rust/c/structs.rs",
}

# Files that name operations and need no line for a new one.
COMPLETE = {
    "blender-addon/extension/menus.py": "the order of the menu: others come last",
    "blender-addon/extension/panels.py": "the order of the sidebar: others come last",
    "blender-addon/extension/reports.py": "lines that are not just the figures: others show all figures",
    "python/python/surfrecon/_native.pyi": "types of older functions: newer ones are declared in python/src",
    "python/python/surfrecon/cli/commands.py": "options that commands have besides those that are declared",
    "tests/rust/generated/chapters.rs": "chapters of several files: others are declared in c-api/src",
    "tests/rust/generated/python_reports.rs": "examples that tell most: others are made",
    "tools/docs/python_reference.py": "pages of several functions: others are made",
    "tools/result_hashes.py": "results that are compared by hand",
}


def recipe():
    """The files of the recipe."""
    text = (ROOT / "CONTRIBUTING.md").read_text("utf-8")
    table = text.split("**An operation.**")[1].split("**A figure of a report.**")[0]
    cells = re.findall(r"^\| (`[^|]+) \|", table, re.M)
    return [path for cell in cells for path in re.findall(r"`([^`]+)`", cell)]


def code(text, is_python):
    """Code without comments, docstrings and generated parts."""
    text = LISTS.sub("", PARTS.sub("", text))
    if is_python:
        text = re.sub(r'"""[\s\S]*?"""', "", text)
    return re.sub(r"(^|\s)(//|# ).*$", "", text, flags=re.M)


def named(text):
    """The operations that code names, also as a part of a longer name."""
    return {name for name in OPERATIONS if re.search(rf"(?<![A-Za-z]){name}(?![A-Za-z])", text)}


def lists(root, names):
    """Files by hand that list operations."""
    for name in names:
        path = root / name
        is_code = name.startswith(CODE) and path.suffix in ENDINGS and not name.startswith(OTHERS)
        if not is_code or name in GENERATED or any(name.startswith(f"rust-core/{own}/") for own in OPERATIONS):
            continue
        text = path.read_text("utf-8")
        if "Written by `make generate`" not in text[:600] and len(named(code(text, ".py" in name))) >= LISTED:
            yield name


def test_an_operation_takes_few_files_by_hand():
    assert 5 < len(recipe()) <= 10
    assert len(set(recipe())) == len(recipe())


def test_each_list_of_operations_is_in_the_recipe_or_complete_by_itself():
    """A further file by hand would have a list that is neither generated, nor found, nor in the recipe."""
    names = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True).stdout.split("\n")
    found = set(lists(ROOT, filter(None, names)))
    assert found - {*recipe(), *crates.LISTS, *COMPLETE} == set()
    # A reason that is no longer needed is gone.
    assert set(COMPLETE) - found == set()


def test_a_forgotten_list_is_found(tmp_path):
    folder = tmp_path / "blender-addon"
    folder.mkdir()
    (folder / "a.py").write_text(f"TABLES = {OPERATIONS[1:]}\n", "utf-8")
    (folder / "b.py").write_text(f'"""{OPERATIONS}"""\n# {OPERATIONS}\nTABLES = {OPERATIONS[:3]}\n', "utf-8")
    (folder / "c.rs").write_text("// modules\nmod align;\nmod merge;\nmod sculpt;\nmod quads;\nmod cluster;\n// end\n")
    names = [f"blender-addon/{name}" for name in ("a.py", "b.py", "c.rs")]
    assert list(lists(tmp_path, names)) == ["blender-addon/a.py"]


@pytest.mark.parametrize("operation", OPERATIONS)
def test_each_operation_has_the_files_of_the_recipe(operation):
    for path in recipe():
        # Tests and pages of these came before the recipe, under names of their own.
        assert (ROOT / path.replace("NAME", operation)).is_file() or path.startswith(("tests/", "docs/")), path


def algorithms():
    """Crates of the floors on which algorithms stand: those above images, but for files and the crate that has all."""
    page = (ROOT / "ARCHITECTURE.md").read_text("utf-8")
    floors = re.search(r"floors, from the ground: (.*)", page).group(1).split(" / ")
    above = [name for floor in floors[floors.index("image") + 1 :] for name in floor.split(", ")]
    return [name for name in above if name not in ("io", "surfrecon")]


def test_all_operations_are_algorithms():
    assert set(OPERATIONS) < set(algorithms())


@pytest.mark.parametrize("algorithm", algorithms())
def test_each_crate_has_the_usual_skeleton(algorithm):
    source = ROOT / "rust-core" / algorithm / "src"
    skeleton = {"lib.rs", "params.rs", "driver.rs"}
    if algorithm in OPERATIONS:
        skeleton.add("operation.rs")
    # A scan gives an image and no figures.
    if algorithm != "scan":
        skeleton.add("report.rs")
    assert skeleton - {path.name for path in source.iterdir()} == set()


@pytest.mark.parametrize("algorithm", algorithms())
def test_the_root_of_a_crate_only_lists_its_modules(algorithm):
    """The steps are in the driver and its stages. Former names may stay at the root."""
    text = (ROOT / "rust-core" / algorithm / "src" / "lib.rs").read_text("utf-8")
    former = re.sub(r"#\[deprecated.*?(\n}\n|;\n)", "", text, flags=re.S)
    items = r"^(pub(\(\w+\))? )?((fn|struct|enum|const|static|type|trait|impl)\b|mod \w+ \{|\w+::\w+! \{)"
    assert not re.search(items, former, re.M)
