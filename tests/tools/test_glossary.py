"""The glossary has the words that code uses in a sense of its own, and those of the papers that it follows."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "glossary.md"

# Words of the papers that names in code use, and words of the project's own.
PAPERS = """
artificial intersection, basin, carve, case a, curvature space, digging, domain, fan, fuse, intersection,
lattice, node, patch, pole, spring, step discontinuity, subcluster, valid cell
"""
OWN = """
block, brick, bundle, confidence, crossing, envelope, fill, gain, grid line, handle, hinge, incremental, jump,
lid, member, noise, number, opening, out of core, pixel, pose, ray, recording, region, retry of a hole, sample,
scan, scan order, seen space, sums of an edge, tile, tolerance, visibility, vote
"""


def rows():
    """The words of each row, its meaning and its paper."""
    found = re.findall(r"^\| (.+?) \| (.+?) \| ?(.*?) ?\|$", PAGE.read_text("utf-8"), re.M)
    return [(words.split(", "), meaning, paper) for words, meaning, paper in found if words != "word"]


def words_of(text):
    return text.strip().replace("\n", " ").split(", ")


@pytest.mark.parametrize("word", [*words_of(PAPERS), *words_of(OWN)])
def test_the_glossary_has_each_word(word):
    assert word in [one for words, _, _ in rows() for one in words]


def test_rows_are_in_order_and_no_row_comes_twice():
    words = [", ".join(words) for words, _, _ in rows()]
    assert words == sorted(set(words), key=str.lower)


def test_papers_are_in_the_references():
    references = (ROOT / "REFERENCES.md").read_text("utf-8")
    papers = {paper.partition(":")[0] for _, _, paper in rows() if paper}
    assert papers and all(f"| {paper} |" in references for paper in papers), papers


def test_the_architecture_leads_to_it():
    assert "(docs/glossary.md)" in (ROOT / "ARCHITECTURE.md").read_text("utf-8")
