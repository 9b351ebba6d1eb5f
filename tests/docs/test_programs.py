"""The examples of the command line, of C and of C++ in the guides run. No example is there that no test runs.

SURFRECON_LIBRARY names the built library.
"""

import os
import re
import shlex
import subprocess
import tomllib
from pathlib import Path

import pytest
from command_line import run
from conftest import ROOT
from pages import blocks_of, declared, every_block
from sections import blocks

LIBRARY = os.environ.get("SURFRECON_LIBRARY")
INCLUDE = ROOT / "c-api" / "include"

# The files that run the blocks of a language, besides this file and the one for Python.
RUN_BY = {
    "rust": "rust-core/src/lib.rs",
    "": "rust-core/src/lib.rs",
    "cmake": "tests/c/installed.sh",
    "toml": "tests/docs/test_programs.py",
    "bash": "tests/distributed/test_guide.py",
    "yaml": "tests/distributed/test_guide.py",
}
# Programs of lines that no test calls as they stand there: they take minutes, or what a user has.
CALLED = {"cargo", "cmake", "perf", "pip"}

# Names that the lines of the guide use and do not make.
CPP = r"""
#include <surfrecon.hpp>
#include <cstdio>
#include <fstream>
#include <iterator>

static const std::size_t ROWS = 40, COLS = 50;
static bool show(std::string_view message) { return std::printf("%.*s\n", int(message.size()), message.data()) >= 0; }
// A bent wall, a metre away.
static std::vector<float> wall;
static std::vector<std::uint8_t> paint(3 * ROWS * COLS, 200);
static surfrecon::View<float> depths(int) { return {wall.data(), wall.size()}; }
static surfrecon::View<std::uint8_t, 3> colours(int) { return {paint.data(), ROWS * COLS}; }

int main()
{
    for (std::size_t i = 0; i < ROWS * COLS; ++i) wall.push_back(1 + 0.002f * float(i % COLS));
    std::ifstream file("scan.ply", std::ios::binary);
    const std::vector<char> bytes{std::istreambuf_iterator<char>(file), {}};
    const surfrecon::Pose world_from_sensor;
    const int k = 17;
SHOWN
    camera.rows = ROWS;
    camera.cols = COLS;
    camera.intrinsics[0] = camera.intrinsics[1] = 60;
    camera.intrinsics[2] = 25;
    camera.intrinsics[3] = 20;
    return merger.run().report.scans == 8 && !folder.bytes("mesh.glb").empty() ? 0 : 1;
}
"""

AGAIN = r"""
#include <surfrecon.hpp>

int main()
{
    const auto scans = surfrecon::Scans::open({"bun.conf"});
SHOWN
    return merger.renewed().of > 0 && preview.triangles().size() > 0 && mesh.triangles().size() > 0 ? 0 : 1;
}
"""


# Files that commands of a page find, and the files that they make. A guide may declare them itself.
SHELL = {
    "README.md": ("heap", {"surface.glb"}),
    "docs/site/guide/heaps.md": ("made", {"aligned.conf", "surface.ply"}),
    "docs/site/guide/large.md": ("made", {"surface.ply"}),
    "docs/site/guide/merging.md": ("made", {"surface.ply"}),
    "docs/site/guide/points.md": ("made", {"surface.ply"}),
    "docs/site/guide/recordings.md": ("recording", {"model.glb", "poses.tum", "surface.ply", "table.tum", "table.ply"}),
    "docs/site/guide/surveys.md": ("made", {"survey.ply"}),
    "docs/site/guide/terrain.md": ("heights", {"terrain.glb"}),
    "docs/site/guide/turntable.md": ("made", {"turned.conf", "surface.glb"}),
    "docs/site/guide/command_line.md": (
        "jobs",
        {"placed.conf", "surface.ply", "surface.glb", "light.stl", "merged.ply", "merged.ply.json", "distance.json"},
    ),
} | declared("sh")


def commands_of(name):
    """The calls of `surfrecon` of a page, in their order."""
    text = "".join(
        block.text for block in every_block() if (str(block.path.relative_to(ROOT)), block.language) == (name, "sh")
    )
    parts = [part for line in text.splitlines() for part in line.split(" && ")]
    return [shlex.split(part, comments=True) for part in parts if part.startswith("surfrecon ")]


@pytest.mark.parametrize("name", sorted(SHELL))
def test_commands_do_what_the_page_says(name, scenes, tmp_path):
    found, made = SHELL[name]
    getattr(scenes, found)(tmp_path)
    if found == "jobs":
        (tmp_path / "jobs.toml").write_text(blocks_of(name, "toml", "Many jobs: a manifest"), "utf-8")
        shown = {line[1] for line in commands_of(name)}
        assert shown >= {"info", "align", "merge", "cluster", "sculpt", "measure", "batch"}
    for _, *arguments in commands_of(name):
        done = run(*arguments, cwd=tmp_path)
        assert done.returncode == 0, (arguments, done.stderr)
    assert made <= {path.name for path in tmp_path.iterdir()}


def test_a_crate_names_the_library_as_rust_md_says():
    (text,) = (block.text for block in blocks(ROOT / "docs/site/guide/rust.md") if block.language == "toml")
    ((name, where),) = tomllib.loads(text)["dependencies"].items()
    manifest = ROOT / Path(where["path"]).relative_to("../surfrecon") / "Cargo.toml"
    assert tomllib.loads(manifest.read_text("utf-8"))["package"]["name"] == name


def test_completion_is_a_script_of_the_shell():
    assert (
        subprocess.run(["bash", "-n"], input=run("completion", "bash").stdout, text=True, check=False).returncode == 0
    )


def built(compiler, standard, source, folder):
    """Compiles a program against the built library; returns it."""
    assert LIBRARY, "SURFRECON_LIBRARY is not set"
    library = Path(LIBRARY)
    command = [compiler, f"-std={standard}", "-Wall", "-Werror", "-I", INCLUDE, source, "-o", folder / "program"]
    command += ["-L", library.parent, f"-Wl,-rpath,{library.parent}", "-lsurfrecon"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return folder / "program"


def started(*command, folder):
    """Runs a program in a folder to its end."""
    done = subprocess.run([*map(str, command)], cwd=folder, capture_output=True, text=True, check=False, timeout=300)
    assert done.returncode == 0, done.stdout + done.stderr


def test_the_program_of_the_header_runs(scenes, tmp_path):
    scenes.listed(tmp_path)
    preface = (INCLUDE / "surfrecon.h").read_text("utf-8").partition("*/")[0]
    text = "\n".join(re.findall(r"^ \*     (.*)$", preface, re.M))
    (tmp_path / "program.c").write_text(text, "utf-8")
    program = built("cc", "c99", tmp_path / "program.c", tmp_path)
    started(program, "bun.conf", "out.ply", folder=tmp_path)
    assert (tmp_path / "out.ply").stat().st_size > 10_000


def cpp_of(name):
    """All lines of C++ of a page."""
    return "".join(block.text for block in blocks(ROOT / name) if block.language == "cpp")


def test_the_lines_of_cpp_run(scenes, tmp_path):
    scenes.large(tmp_path)
    (tmp_path / "scan.ply").write_bytes((tmp_path / "view0.ply").read_bytes())
    (tmp_path / "program.cpp").write_text(CPP.replace("SHOWN", cpp_of("docs/site/guide/c.md")), "utf-8")
    started(built("c++", "c++17", tmp_path / "program.cpp", tmp_path), folder=tmp_path)
    assert (tmp_path / "surface.glb").stat().st_size > 10_000


def test_the_lines_of_a_merge_that_is_run_again_do(scenes, tmp_path):
    scenes.listed(tmp_path)
    text = AGAIN.replace("SHOWN", cpp_of("docs/site/guide/merged_again.md"))
    (tmp_path / "program.cpp").write_text(text, "utf-8")
    started(built("c++", "c++17", tmp_path / "program.cpp", tmp_path), folder=tmp_path)


@pytest.mark.parametrize("block", list(every_block()), ids=lambda block: f"{block.path.name}:{block.number}")
def test_every_block_is_run_by_a_test(block):
    name = str(block.path.relative_to(ROOT))
    if block.language in ("python", "text"):
        # Those of Python test_python_examples.py finds by itself.
        return
    if block.language == "cpp":
        assert name in ("docs/site/guide/c.md", "docs/site/guide/merged_again.md")
    elif block.language == "sh":
        for line in re.sub(r"\\\n", " ", block.text).splitlines():
            assert is_known(line, name), f"no test runs: {line}"
    elif block.language == "":
        assert name == "rust-core/src/tour.md" or block.text.isascii() is False or name == "ARCHITECTURE.md"
    else:
        assert block.path.name in (ROOT / RUN_BY[block.language]).read_text("utf-8")


def is_known(line, name):
    """Whether a line of a shell is run, or calls what is there."""
    words = shlex.split(line, comments=True)
    if not words:
        return True
    if words[0] == "make":
        return re.search(rf"^{words[1]}:", (ROOT / "Makefile").read_text("utf-8"), re.M) is not None
    if words[0] == "cc":
        return name == "docs/site/guide/c.md" and words[0] in (ROOT / "tests/c/installed.sh").read_text("utf-8")
    if words[0] == "eval":
        return words[1] == "$(surfrecon completion bash)"
    if words[0] == "surfrecon":
        by_tasks = name == "docs/site/guide/cluster.md" and words[1] in ("plan", "task")
        return name in SHELL or by_tasks
    return words[0] in CALLED or words[0].startswith("target/")
