"""The site is built without a warning and has every name of every interface; what leads nowhere is said."""

import inspect
import re
import shutil
import zlib

import build
import links
import pytest
import python_reference
import sections
import surfrecon
from conftest import ROOT
from surfrecon.cli.commands import COMMANDS


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The built site without the pages that rustdoc makes."""
    folder = tmp_path_factory.mktemp("site")
    build.compose(folder / "sources")
    assert build.build(folder / "sources", folder / "docs") == []
    return folder / "docs"


@pytest.fixture(scope="module")
def names(site):
    """The names that can be linked to, by domain and kind."""
    _, _, rest = (site / "objects.inv").read_bytes().partition(b"zlib.\n")
    made = {}
    for line in zlib.decompress(rest).decode().splitlines():
        name, kind, *_ = line.rsplit(" ", 4)
        made.setdefault(kind, set()).add(name)
    return made


def test_every_public_name_of_python_is_there_with_its_members(names):
    there = {name for kind, some in names.items() if kind.startswith("py:") for name in some}
    for full in python_reference.public_names():
        assert f"surfrecon.{full}" in there
        of = python_reference.named(full)
        if inspect.isclass(of) and not issubclass(of, BaseException):
            assert {f"surfrecon.{full}.{name}" for name in vars(of) if not name.startswith("_")} <= there


def test_every_function_of_c_is_there(names):
    symbols = (ROOT / "c-api" / "abi" / "symbols.txt").read_text("utf-8").split()
    assert set(symbols) <= names["c:function"] and len(symbols) > 100
    assert {"srf_merge_params", "srf_frame"} <= names["c:struct"] and "srf_merger_run" in names["c:function"]
    assert "surfrecon::Merger" in names["cpp:class"]


def test_examples_of_c_stand_where_the_functions_are_that_they_call(site):
    for page, example in (("merger", "exchange"), ("region", "keep_marked"), ("files", "read_image")):
        text = (site / "reference" / "c" / f"{page}.html").read_text("utf-8")
        assert re.search(rf">{example}</span>", text), f"{page} does not show {example}"


def test_every_command_and_parameter_is_there(names):
    for name, command in COMMANDS.items():
        assert {f"surfrecon-{name}.--{row.replace('_', '-')}" for row in command.options()} <= names["std:cmdoption"]
    for parameter in surfrecon.parameters():
        assert f"{parameter.operation}.{parameter.name}" in names["std:parameter"]


def test_a_name_without_a_page_is_told(monkeypatch, tmp_path):
    monkeypatch.setitem(python_reference.PAGES, "Merging", ["merge", "MergeReport", "unmerge"])
    with pytest.raises(sections.SiteError) as told:
        build.compose(tmp_path)
    assert "MergeResult is in no page of the reference" in str(told.value)
    assert "the reference has unmerge, which is no public name" in str(told.value)


def test_a_link_to_nothing_is_told(site, tmp_path):
    shutil.copytree(site, tmp_path / "site")
    page = tmp_path / "site" / "install.html"
    text = page.read_text("utf-8").replace('href="index.html"', 'href="index.html#nowhere"')
    page.write_text(text.replace("</body>", MORE), "utf-8")
    found = list(links.problems(tmp_path / "site", without=("rust",)))
    assert {
        "install.html: index.html#nowhere leads to no place of that page",
        "install.html: gone.html leads nowhere",
        "install.html fetches https://example.org/a.js",
    } == set(found)


MORE = '<a href="gone.html">gone</a><script src="https://example.org/a.js"></script></body>'


@pytest.mark.parametrize(
    "page, said",
    [
        ("<!-- from README.md: In Pascal -->", "README.md has no heading 'In Pascal'"),
        ("<!-- from READ.md -->", "there is no READ.md"),
    ],
)
def test_a_section_that_is_not_there_is_told(page, said, tmp_path):
    (tmp_path / "pages").mkdir()
    (tmp_path / "pages" / "a.md").write_text(f"# A\n\n{page}\n", "utf-8")
    with pytest.raises(sections.SiteError, match=said):
        sections.Composer(tmp_path / "pages", tmp_path / "made").compose()


def test_sections_take_their_links_and_pictures_along(tmp_path):
    (tmp_path / "pages" / "deep").mkdir(parents=True)
    pages = {
        "deep/a.md": "# A\n\n## B\n\n<!-- from README.md: surfrecon, alone -->\n",
        "b.md": "# Blender\n\n<!-- from blender-addon/README.md -->\n",
        "c.md": "# Tour\n\n<!-- from rust-core/src/tour.md -->\n",
    }
    for name, text in pages.items():
        (tmp_path / "pages" / name).write_text(text, "utf-8")
    sections.Composer(tmp_path / "pages", tmp_path / "made").compose()
    made = (tmp_path / "made" / "deep" / "a.md").read_text("utf-8")
    assert "](/pictures/docs_pictures_heap.jpg)" in made and "[In Blender](/b.md)" in made
    assert (tmp_path / "made" / "pictures" / "docs_pictures_heap.jpg").is_file()
    # README.md says where the guides are; the pages that are made here are others.
    assert "](https://github.com/surfrecon/surfrecon/blob/main/docs/site/guide/c.md)" in made
    tour = (tmp_path / "made" / "c.md").read_text("utf-8")
    assert (
        "```rust\nuse surfrecon" in tour
        and "\n# Ok::" not in tour
        and "```rust" not in tour.replace("```rust\nuse", "")
    )


def test_a_heading_that_no_page_shows_is_in_the_repository(tmp_path):
    (tmp_path / "pages").mkdir()
    (tmp_path / "pages" / "a.md").write_text("# A\n\n<!-- from README.md, alone -->\n", "utf-8")
    named = f"[a]({ROOT}/README.md) [l]({ROOT}/README.md#limits)"
    (tmp_path / "pages" / "b.md").write_text(f"# B\n\n{named}\n", "utf-8")
    sections.Composer(tmp_path / "pages", tmp_path / "made").compose()
    made = (tmp_path / "made" / "b.md").read_text("utf-8")
    assert "[a](/a.md) [l](https://github.com/surfrecon/surfrecon/blob/main/README.md#limits)" in made


def test_pages_link_files_of_the_tree_by_their_paths(tmp_path):
    (tmp_path / "pages").mkdir()
    named = f"![p]({ROOT}/docs/pictures/room.jpg) [q]({ROOT}/PARAMETERS.md) [n](later.md) [c]({ROOT}/Cargo.toml)"
    (tmp_path / "pages" / "a.md").write_text(f"# A\n\n{named}\n", "utf-8")
    sections.Composer(tmp_path / "pages", tmp_path / "made").compose()
    made = (tmp_path / "made" / "a.md").read_text("utf-8")
    assert "(/pictures/docs_pictures_room.jpg) [q](/reference/parameters.rst) [n](later.md)" in made
    assert "[c](https://github.com/surfrecon/surfrecon/blob/main/Cargo.toml)" in made
