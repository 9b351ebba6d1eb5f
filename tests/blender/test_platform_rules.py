"""The rules of extensions.blender.org for an extension, as far as the zip and the running extension can show it.

CONTRIBUTING.md, "Blender's extension platform", has the rules with their sources.
"""

import ast
import re
import sys
import tomllib
import zipfile
from pathlib import Path

import bpy
import pytest
from conftest import MODULE, built_zip

# Blender's own modules, what it brings for add-ons, and what our wheel brings.
OTHERS = {
    "bmesh",
    "bpy",
    "bpy_extras",
    "bl_ui",
    "bl_operators",
    "blf",
    "gpu",
    "gpu_extras",
    "mathutils",
    "numpy",
    "surfrecon",
}
# Modules that talk to others, or start programs.
NETWORK = {"asyncio", "ftplib", "http", "requests", "smtplib", "socket", "ssl", "subprocess", "urllib", "webbrowser"}


@pytest.fixture(scope="module")
def built():
    """The zip."""
    with zipfile.ZipFile(built_zip()) as archive:
        yield archive


@pytest.fixture(scope="module")
def manifest(built):
    """The manifest as it is in the zip."""
    return tomllib.loads(built.read("blender_manifest.toml").decode())


@pytest.fixture(scope="module")
def sources(built):
    """Each file of Python in the zip: its name and syntax tree."""
    return {name: ast.parse(built.read(name), name) for name in built.namelist() if name.endswith(".py")}


def terse(text):
    """Whether a text may be a tagline or a permission's reason."""
    return 0 < len(text) <= 64 and text == text.strip() and re.fullmatch(r"[A-Z].*[A-Za-z0-9)]", text)


def calls(tree):
    """The names of what is called, with their dots."""
    return {ast.unparse(node.func) for node in ast.walk(tree) if isinstance(node, ast.Call)}


def imports(tree):
    """Names of modules that are imported absolutely."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            yield node.module


def test_texts_are_terse(manifest):
    assert terse(manifest["tagline"])
    assert all(terse(reason) for reason in manifest["permissions"].values())


def test_tags_are_permitted(manifest):
    # Blender's copy of extensions.blender.org's list.
    from _bpy_internal.extensions import tags

    assert manifest["tags"] and set(manifest["tags"]) <= tags.addons


def test_the_manifest_says_what_it_must(manifest):
    required = {
        "schema_version",
        "id",
        "version",
        "name",
        "tagline",
        "maintainer",
        "type",
        "blender_version_min",
        "license",
    }
    assert required <= set(manifest)
    assert manifest["type"] == "add-on" and re.fullmatch(r"\d+\.\d+\.\d+", manifest["version"])
    assert manifest["license"] == ["SPDX:GPL-3.0-or-later"]
    assert all(re.fullmatch(r"\d{4}(-\d{4})? \S.*", holder) for holder in manifest["copyright"])
    assert manifest["website"].startswith("https://")


def test_the_name_is_not_blenders(manifest):
    assert "blender" not in (manifest["name"] + manifest["id"] + manifest["tagline"]).lower()


def test_files_are_the_only_permission(manifest, sources):
    assert list(manifest["permissions"]) == ["files"]
    for name, tree in sources.items():
        modules = {module.split(".")[0] for module in imports(tree)}
        assert not modules & NETWORK, name
        used = {node.attr for node in ast.walk(tree) if isinstance(node, ast.Attribute)}
        assert not used & {"clipboard", "url_open", "online_access"}, name


def test_nothing_is_needed_that_is_not_in_it(sources, built):
    for name, tree in sources.items():
        modules = {module.split(".")[0] for module in imports(tree)}
        assert modules <= OTHERS | set(sys.stdlib_module_names), name
    for wheel in wheels(built):
        metadata = next(name for name in wheel.namelist() if name.endswith(".dist-info/METADATA"))
        needed = re.findall(r"^Requires-Dist: ([\w-]+)(?!.*extra ==)", wheel.read(metadata).decode(), re.M)
        # Blender brings NumPy.
        assert needed == ["numpy"]


def wheels(built):
    """The wheels in the zip, opened."""
    for name in built.namelist():
        if name.endswith(".whl"):
            with zipfile.ZipFile(built.open(name)) as wheel:
                yield wheel


def test_each_wheel_is_listed_and_of_the_platform(built, manifest):
    inside = [name for name in built.namelist() if name.endswith(".whl")]
    # A zip of one platform out of several says so beside what the source's manifest says.
    said = manifest["build"].get("generated", manifest)
    assert said["wheels"] == [f"./{name}" for name in inside] and len(inside) == 1 and "-abi3-" in inside[0]
    assert len(said["platforms"]) == 1 and Path(built_zip()).stem.endswith(said["platforms"][0])


def test_no_names_of_python_are_taken_but_ours(built):
    for wheel in wheels(built):
        tops = {name.split("/")[0] for name in wheel.namelist()}
        assert all(re.fullmatch(r"surfrecon(-[\d.]+\.(dist-info|data))?", top) for top in tops)
    folder = Path(sys.modules[MODULE].__file__).parent
    ours = [
        name for name, module in sys.modules.items() if str(getattr(module, "__file__", "")).startswith(str(folder))
    ]
    assert ours and all(name == MODULE or name.startswith(f"{MODULE}.") for name in ours)


def test_code_is_as_reviewers_ask(sources):
    for name, tree in sources.items():
        if name.startswith("presets/"):
            continue
        called = calls(tree)
        assert not called & {"print", "eval", "exec", "compile", "open", "__import__"}, name
        # The user's own presets follow an operator to its new name.
        written = {call for call in called if re.match(r"(os\.(make|re|un)|shutil\.|tempfile\.)\w", call)}
        assert written == ({"shutil.copytree"} if name == "presets.py" else set()), name
        text = ast.unparse(tree)
        assert not re.search(r"\bsys\.(path|modules)\b|\bbl_ext\b|\bbl_info\b|\b__name__\b", text), name
        # Its own folder is read from, never written to.
        assert "__file__" not in text or name == "presets.py", name


def test_each_file_says_its_licence(built):
    for name in built.namelist():
        if name.endswith(".py"):
            assert built.read(name).startswith(b"# SPDX-License-Identifier: GPL-3.0-or-later\n"), name
    assert b"Version 3, 29 June 2007" in built.read("LICENSE")


def test_there_is_nothing_but_sources_and_the_wheel(built):
    endings = {Path(name).suffix for name in built.namelist()}
    assert endings == {".py", ".toml", ".whl", ""}
    # Of our own: the rules name no limit.
    assert Path(built_zip()).stat().st_size < 20e6


def test_it_is_installed_and_enabled_without_network():
    assert not bpy.app.online_access
    assert MODULE in bpy.context.preferences.addons
