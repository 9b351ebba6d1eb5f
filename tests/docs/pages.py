"""The Markdown files of the tree, and their blocks of code."""

from conftest import ROOT
from sections import blocks


def every_block():
    """All blocks of code of all files."""
    for path in sorted(ROOT.rglob("*.md")):
        if path.relative_to(ROOT).parts[0] not in ("target", "out", "vendor"):
            yield from blocks(path)


def blocks_of(name, language, heading):
    """The text of all blocks of a language below a heading, one after the other."""
    return "".join(
        block.text for block in blocks(ROOT / name) if (block.language, block.heading) == (language, heading)
    )
