"""Every example in Python of the guides and of the docstrings runs, in the order in which it stands."""

import contextlib
import doctest
import importlib
import inspect
from pathlib import Path

import matplotlib
import numpy as np
import pytest
import surfrecon
from conftest import ROOT
from pages import declared, every_block
from python_reference import named, public_names
from surfrecon import bar, distributed

matplotlib.use("Agg")

# Scenes of the examples below a heading. Without a heading, of those of the whole page, one after the other.
FOUND = {
    ("README.md", "From a folder to a surface"): "heap",
    ("python/README.md", "surfrecon"): "listed",
    ("docs/site/index.md", "A first result"): "nothing",
    ("docs/site/guide/heaps.md", None): "made",
    ("docs/site/guide/hosts.md", None): "made",
    ("docs/site/guide/large.md", None): "made",
    ("docs/site/guide/library.md", None): "made",
    ("docs/site/guide/memory.md", None): "made",
    ("docs/site/guide/merged_again.md", None): "made",
    ("docs/site/guide/merging.md", None): "made",
    ("docs/site/guide/points.md", None): "made",
    ("docs/site/guide/python.md", None): "nothing",
    ("docs/site/guide/recordings.md", None): "recording",
    ("docs/site/guide/selecting.md", None): "made",
    ("docs/site/guide/surveys.md", None): "made",
    ("docs/site/guide/terrain.md", None): "nothing",
    ("docs/site/guide/turntable.md", None): "made",
} | {(name, None): scene for name, (scene, _) in declared("python").items()}
# Scenes of docstrings' examples, unless it is a list of scans.
DOCSTRINGS_FOUND = {
    "Frame": "table",
    "LeftOutReport": "table",
    "Photo": "table",
    "Pick": "points_picked",
    "TextureReport": "photographed",
    "TextureTile": "photographed",
    "Textured": "photographed",
    "TexturedPhoto": "photographed",
    "distributed.Plan": "planned",
    "distributed.Plan.make": "planned",
    "distributed.Plan.read": "planned",
    "distributed.Stage": "planned",
    "dominant_plane": "table",
    "recording_of": "recording",
    "remove": "table",
    "texture": "photographed",
}
# Those that need MeshLab or a cluster, whose tests run them.
ELSEWHERE = {
    ("meshlab-plugin/README.md", "Align Scans"): "tests/meshlab/test_readme.py",
    ("docs/site/guide/cluster.md", "On a cluster"): "tests/distributed/test_guide.py",
    ("docs/site/guide/cluster.md", "SLURM with Dask"): "tests/distributed/test_guide.py",
    ("docs/site/guide/cluster.md", "Kubernetes with Dask"): "tests/distributed/test_guide.py",
    ("docs/site/guide/cluster.md", "Object stores"): "tests/distributed/test_guide.py",
}
DOCSTRINGS_ELSEWHERE = {
    "distributed": "tests/distributed/test_guide.py",
    "distributed.merge": "tests/distributed/test_guide.py",
}


def examples():
    """The examples of each heading of each page, of some pages all together."""
    made = {}
    for block in every_block():
        if block.language == "python":
            name = str(block.path.relative_to(ROOT))
            made.setdefault((name, None if (name, None) in FOUND else block.heading), []).append(block)
    return made


EXAMPLES = examples()


@pytest.mark.parametrize("where", sorted(EXAMPLES), ids=lambda where: ": ".join(filter(None, where)))
def test_an_example_runs(where, scenes, tmp_path):
    if where in ELSEWHERE:
        name, heading = where
        text = (ROOT / ELSEWHERE[where]).read_text("utf-8")
        # Of a page with examples below one heading the test takes all.
        alone = [page for page, _ in EXAMPLES].count(name) == 1
        assert Path(name).name in text and (alone or f'"{heading}"' in text)
        return
    assert where in FOUND, "say above what it finds"
    names = {"surfrecon": surfrecon} | getattr(scenes, FOUND[where])(tmp_path)
    with contextlib.chdir(tmp_path):
        for block in EXAMPLES[where]:
            # Lines of errors are those of the page.
            source = "\n" * (block.number - 1) + block.text
            exec(compile(source, str(block.path), "exec"), names)


def test_what_examples_find_is_for_examples_that_are_there():
    assert set(FOUND) | set(ELSEWHERE) == set(EXAMPLES)


MODULES = ("", "plot", "bar", "distributed")


def docstrings():
    """Every docstring of the package that has an example."""
    modules = {name: importlib.import_module(f"surfrecon.{name}".rstrip(".")) for name in MODULES}
    for full, of in (modules | {name: named(name) for name in public_names()}).items():
        found = [(full, of)]
        if inspect.isclass(of):
            found += [(f"{full}.{member}", getattr(of, member)) for member in dir(of) if not member.startswith("_")]
        for title, one in found:
            text = inspect.getdoc(one) if not isinstance(one, str) else ""
            if text and ">>>" in text:
                yield title, text


DOCSTRINGS = dict(docstrings())


@pytest.mark.parametrize("title", sorted(DOCSTRINGS), ids=lambda title: title or "surfrecon")
def test_an_example_of_a_docstring_runs(title, scenes, tmp_path):
    if title in DOCSTRINGS_ELSEWHERE:
        assert f'"{title}"' in (ROOT / DOCSTRINGS_ELSEWHERE[title]).read_text("utf-8")
        return
    names = {"surfrecon": surfrecon, "np": np, "Bar": bar.Bar, "Plan": distributed.Plan}
    names |= getattr(scenes, DOCSTRINGS_FOUND.get(title, "listed"))(tmp_path)
    example = doctest.DocTestParser().get_doctest(DOCSTRINGS[title], names, title, None, 0)
    with contextlib.chdir(tmp_path):
        runner = doctest.DocTestRunner(verbose=False)
        assert runner.run(example).failed == 0 and example.examples


def wanted():
    """The docstrings that must have an example: those of the package, of functions and classes, of methods that make an
    object or write it, and of all that a merger does."""
    yield ""
    for full in public_names():
        of = named(full)
        if not isinstance(of, str):
            yield full
        if inspect.isclass(of) and of is not surfrecon.Job:
            for name, member in vars(of).items():
                makes = isinstance(member, staticmethod | classmethod)
                works = callable(member) and (name == "write" or of is surfrecon.Merger)
                if not name.startswith("_") and (makes or works):
                    yield f"{full}.{name}"


def test_every_function_and_class_has_an_example():
    assert sorted(set(wanted()) - set(DOCSTRINGS)) == []


def test_what_docstrings_find_is_for_examples_that_are_there():
    assert set(DOCSTRINGS_FOUND) | set(DOCSTRINGS_ELSEWHERE) <= set(DOCSTRINGS)
