"""The Markdown files of the tree, and their blocks of code."""

import re

from conftest import ROOT
from sections import blocks

# A comment of a guide on its examples: `<!-- sh finds surface, makes surface.glb -->`.
FINDS = re.compile(r"^<!-- (\w+) finds (\w+)(?:, makes (.+))? -->$", re.M)


def declared(language):
    """The scenes that guides declare for their examples in a language, and the files that these make, by page."""
    found = {}
    for path in sorted((ROOT / "docs" / "site" / "guide").glob("*.md")):
        for of, scene, made in FINDS.findall(path.read_text("utf-8")):
            if of == language:
                found[str(path.relative_to(ROOT))] = (scene, set(filter(None, made.split(", "))))
    return found


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
