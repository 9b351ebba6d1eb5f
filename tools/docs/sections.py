"""Puts sections of the tree's Markdown files into pages of the site, so that each fact stands in one place.

In a page of `docs/site` a line `<!-- from FILE: HEADING -->` stands for what FILE has below that heading, and
`<!-- from FILE: HEADING, alone -->` for that without its own sections; `<!-- from FILE -->` for the whole file without
its title. Links to what another page shows lead there, pictures are taken along, other files are links to the
repository. Pages link files of the tree likewise, by their paths, so that they can be read in the repository too.
"""

import re
import shutil
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
REPOSITORY = "https://github.com/surfrecon/surfrecon"
MARK = re.compile(r"^<!-- from ([^:>]+?)(?:: ([^>]+?))?(, alone)? -->$")
HEADING = re.compile(r"^(#{1,6}) (.+)$")
FENCE = re.compile(r"^\s*(```+)(.*)$")
PICTURES = (".webp", ".jpg", ".png")
LINK = re.compile(r"(\]\()([^)\s]+)(\))")
# Pages that are made out of files: where these are shown.
MADE = {ROOT / "PARAMETERS.md": "/reference/parameters.rst"}
MADE |= {path: f"/guide/{path.stem}.md" for path in (ROOT / "notebooks").glob("*.ipynb")}


class SiteError(Exception):
    """Something of the site names what is not there."""


@dataclass
class Line:
    """A line of Markdown; `level` is that of its heading, 0 for other lines; `code` lies in a fence or is one."""

    text: str
    level: int = 0
    code: bool = False


@dataclass
class Block:
    """A block of code: its language, its lines and the number of the first one, from 1; the heading above it."""

    path: Path
    language: str
    text: str
    number: int
    heading: str


def slug(heading):
    """The anchor of a heading, as GitHub and MyST have it."""
    return re.sub(r"[^\w\- ]", "", heading.replace("`", "").lower()).replace(" ", "-")


def lines(path):
    """The lines of a file."""
    found, fence = [], None
    for text in path.read_text("utf-8").splitlines():
        mark = FENCE.match(text)
        heading = HEADING.match(text)
        if fence is not None:
            found.append(Line(text, code=True))
            if mark and mark[1].startswith(fence) and not mark[2].strip():
                fence = None
        elif mark:
            fence = mark[1]
            found.append(Line(text, code=True))
        else:
            found.append(Line(text, len(heading[1]) if heading else 0))
    return found


def blocks(path):
    """The blocks of code of a file, those of MyST's directives left out."""
    found, heading, open_block = [], "", None
    for number, line in enumerate(lines(path), 1):
        if line.level:
            heading = line.text.lstrip("# ")
        mark = FENCE.match(line.text) if line.code else None
        if mark and open_block is None:
            open_block = Block(path, mark[2].strip(), "", number + 1, heading)
        elif mark and open_block is not None and not mark[2].strip():
            if not open_block.language.startswith("{"):
                found.append(open_block)
            open_block = None
        elif line.code:
            open_block.text += line.text + "\n"
    return found


def section(path, heading=None, alone=False):
    """The lines below a heading and the heading's level; without one those below the file's title."""
    every = lines(path)
    found = [k for k, line in enumerate(every) if line.level and heading in (None, line.text.lstrip("# "))]
    if not found:
        raise SiteError(f"{path.relative_to(ROOT)} has no heading {heading!r}")
    start = found[0]
    level, end = every[start].level, start + 1
    while end < len(every) and not 0 < every[end].level <= (9 if alone else level):
        end += 1
    return every[start + 1 : end], level


class Composer:
    """Makes pages out of those in a folder."""

    def __init__(self, base, folder):
        """`base` has the sources; the results go to `folder`."""
        self.base, self.folder = base, folder
        self.pages = sorted(base.rglob("*.md"))
        # The pages that show files and their headings, by (file, anchor). The anchor is empty for the file.
        self.places = {}
        # Files of which a page shows all headings.
        self.whole = set()
        for page in self.pages:
            for line in page.read_text("utf-8").splitlines():
                if mark := MARK.match(line):
                    self._place(page, mark)

    def _place(self, page, mark):
        path = ROOT / mark[1]
        if not path.is_file():
            raise SiteError(f"{page.name}: there is no {mark[1]}")
        shown, _ = section(path, mark[2], bool(mark[3]))
        if mark[2] is None:
            self.places[path, ""] = page, ""
            if not mark[3]:
                self.whole.add(path)
        else:
            # The page stands for the heading itself, which it does not repeat.
            self.places.setdefault((path, slug(mark[2])), (page, ""))
        for line in shown:
            if line.level:
                anchor = slug(line.text.lstrip("# "))
                self.places.setdefault((path, anchor), (page, anchor))

    def compose(self):
        """Writes all pages."""
        for page in self.pages:
            self._compose(page)

    def _compose(self, page):
        made, level = [], 1
        for line in lines(page):
            mark = None if line.code else MARK.match(line.text)
            if mark is None:
                level = line.level or level
                made.append(line.text if line.code else self._own(line.text, page))
                continue
            path = ROOT / mark[1]
            shown, of = section(path, mark[2], bool(mark[3]))
            made += self._shown(shown, level - of, path, page)
        target = self.folder / page.relative_to(self.base)
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_text("\n".join(made) + "\n", "utf-8")

    def _shown(self, shown, deeper, path, page):
        # Untagged blocks of Rust's documentation are Rust.
        rust, inside = path.suffix == ".md" and "rust-core" in path.parts, False
        for line in shown:
            if line.level:
                yield "#" * (line.level + deeper) + self._linked(line.text.lstrip("#"), path, page)
            elif not line.code:
                yield self._linked(line.text, path, page)
            elif FENCE.match(line.text):
                inside = not inside
                yield line.text + ("rust" if rust and inside and line.text == "```" else "")
            elif not (rust and re.match(r"#( |$)", line.text)):
                # Lines with a mark are compiled by rustdoc, and not shown.
                yield line.text

    def _linked(self, text, path, page):
        return LINK.sub(lambda found: found[1] + self._target(found[2], path, page) + found[3], text)

    def _own(self, text, page):
        # Sphinx looks at links between pages, some of which are not made yet.
        def led(found):
            file = (page.parent / found[2].partition("#")[0]).resolve()
            inside = not file.is_file() or file.is_relative_to(self.base)
            return found[0] if inside else found[1] + self._target(found[2], page, page) + found[3]

        return LINK.sub(led, text)

    def _target(self, target, path, page):
        if re.match(r"[a-z]+:", target):
            return target
        name, _, anchor = target.partition("#")
        file = (path.parent / name).resolve() if name else path
        if not file.exists():
            raise SiteError(f"{path.relative_to(ROOT)}: there is no {target}")
        if file.suffix in PICTURES:
            return self._picture(file)
        if file in MADE and not anchor:
            return MADE[file]
        if anchor and anchor not in {slug(line.text.lstrip("# ")) for line in lines(file) if line.level}:
            raise SiteError(f"{path.relative_to(ROOT)}: {name or path.name} has no heading for #{anchor}")
        if (file, anchor) in self.places:
            shown, below = self.places[file, anchor]
        elif file in self.whole:
            shown, below = self.places[file, ""][0], anchor
        elif file in self.pages:
            shown, below = file, anchor
        else:
            kind = "tree" if file.is_dir() else "blob"
            return f"{REPOSITORY}/{kind}/main/{file.relative_to(ROOT)}{'#' + anchor if anchor else ''}"
        below = f"#{below}" if below else ""
        return below if shown == page and below else "/" + str(shown.relative_to(self.base)) + below

    def _picture(self, file):
        kept = self.folder / "pictures" / "_".join(file.relative_to(ROOT).parts)
        kept.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(file, kept)
        return f"/pictures/{kept.name}"
