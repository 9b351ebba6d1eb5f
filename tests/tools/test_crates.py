"""A crate of the core that no list names yet is put on all of them."""

import re
import shutil
import tomllib
from pathlib import Path

import crates
import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def tree(tmp_path):
    """The lists and the manifests alone."""
    for path in [*crates.LISTS, *(str(path.relative_to(ROOT)) for path in ROOT.glob("rust-core/*/Cargo.toml"))]:
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / path, tmp_path / path)
    for path in ROOT.glob("rust-core/*/src/operation.rs"):
        there = tmp_path / path.relative_to(ROOT)
        there.parent.mkdir(exist_ok=True)
        shutil.copy(path, there)
    return tmp_path


def test_lists_have_all_crates(tree):
    assert crates.complete(tree) == []


def test_a_new_operation_comes_on_all_lists(tree):
    folder = tree / "rust-core" / "made_up"
    (folder / "src").mkdir(parents=True)
    dependencies = "base.workspace = true\nmesh.workspace = true\n"
    about = 'description = "A mesh to a smooth one; a part of surfrecon"'
    text = f'[package]\nname = "surfrecon-made_up"\n{about}\n\n[dependencies]\n{dependencies}'
    (folder / "Cargo.toml").write_text(text, "utf-8")
    (folder / "src" / "operation.rs").write_text("pub const OPERATION: Operation = Operation {};\n", "utf-8")
    assert crates.complete(tree) == list(crates.LISTS)
    manifest = tomllib.loads((tree / "Cargo.toml").read_text("utf-8"))["workspace"]
    assert "rust-core/made_up" in manifest["members"]
    assert manifest["dependencies"]["made_up"] == manifest["dependencies"]["mesh"] | {
        "package": "surfrecon-made_up",
        "path": "rust-core/made_up",
    }
    assert "made_up" in tomllib.loads((tree / "rust-core/Cargo.toml").read_text("utf-8"))["dependencies"]
    assert "    made_up::OPERATION,\n];" in (tree / "rust-core/src/operations.rs").read_text("utf-8")
    page = (tree / "ARCHITECTURE.md").read_text("utf-8")
    assert "| `rust-core/made_up/` | a mesh to a smooth one | files |" in page
    assert re.search(r" / (\w+, )*image, (\w+, )*made_up(, \w+)* / ", page)
    assert crates.complete(tree) == []


def test_a_crate_over_all_others_gets_a_floor_of_its_own(tree):
    folder = tree / "rust-core" / "made_up"
    folder.mkdir()
    highest = re.search(r"(\w+) / surfrecon\n", (tree / "ARCHITECTURE.md").read_text("utf-8")).group(1)
    text = f'[package]\ndescription = "Relaxing"\n\n[dependencies]\n{highest}.workspace = true\n'
    (folder / "Cargo.toml").write_text(text, "utf-8")
    crates.complete(tree)
    assert f"{highest} / made_up / surfrecon\n" in (tree / "ARCHITECTURE.md").read_text("utf-8")
