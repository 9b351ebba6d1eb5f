"""Checks the files of the tree: no paths of somebody's machine, no large files, citations with a reference,
dependencies and long files with a reason, licences where they belong, workflows that call what there is, pages,
comments and messages that are easy to read, guides that promise nothing that is not published, changes with a link.
"""

import re
import subprocess
import sys
import tomllib
from pathlib import Path

import message_form
import messages
import plain_words
import platforms

ROOT = Path(__file__).resolve().parent.parent
MACHINE_PATH = re.compile(rb"(?<![\w.$}\])-])/(?:work|root|home|Users|tmp|mnt)/[\w.]")
LARGEST = 1 << 20
# A citation such as [MI04] or [MI04, sec. 3]; alone in a doc comment rustdoc would take it for a link.
CITATION = re.compile(r"\[([A-Z][A-Za-z]{0,5}[0-9]{2})\b")
BARE_CITATION = re.compile(r"^\s*//[/!].*(?<!\\)\[[A-Z][A-Za-z]{0,5}[0-9]{2}\]")
# Lines of a file of code, unless ARCHITECTURE.md says why it has more.
MOST_LINES = 1_000
CODE = {".rs", ".py", ".c", ".cpp", ".h", ".hpp", ".sh"}
# The first screen and more; the rest belongs into guides.
README_BYTES = 8_000
# Python that users or the next developer read: docstrings are held to the limits of doc comments.
DOCUMENTED = ("python/python/surfrecon", "blender-addon/extension")
# Commands and addresses that lead somewhere from the first release on, before to nothing or to a taker of the name.
PUBLISHED = re.compile(
    r"pip install (?:--?\S+ )*['\"]?surfrecon\b|cargo (?:add|install) surfrecon|/surfrecon/releases\b"
)
LICENCES = [
    "LICENSE-MIT",
    "LICENSE-APACHE",
    "blender-addon/extension/LICENSE",
    "meshlab-plugin/LICENSE",
]


def files():
    """Every file that is or would be committed."""
    command = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    listed = subprocess.run(command, cwd=ROOT, capture_output=True, check=True)
    paths = [ROOT / name.decode() for name in listed.stdout.split(b"\0") if name]
    return [path for path in paths if path.is_file()]


def dependencies():
    """Of each crate: its manifest, the names of its dependencies, and whether they are used by its library."""
    for manifest in files():
        if manifest.name == "Cargo.toml":
            tables = tomllib.loads(manifest.read_text())
            for section in ("dependencies", "dev-dependencies", "build-dependencies"):
                for name in tables.get(section, {}):
                    yield manifest, name, section == "dependencies"


def dependency_problems():
    """Yields dependencies without a reason and dependencies that nothing uses."""
    reasons = (ROOT / "CONTRIBUTING.md").read_text()
    shared = tomllib.loads((ROOT / "Cargo.toml").read_text())["workspace"]["dependencies"]
    own = {name for name, entry in shared.items() if "path" in entry}
    for manifest, name, of_library in dependencies():
        where = manifest.relative_to(ROOT)
        if (
            name not in own
            and not name.startswith("surfrecon")
            and not re.search(rf"^\|[^|]*\b{re.escape(name)}\b[^|]*\|", reasons, re.M)
        ):
            yield f"{where}: CONTRIBUTING.md has no line that says why {name} is needed"
        sources = manifest.parent.rglob("*.rs")
        if of_library and not any(re.search(rf"\b{name.replace('-', '_')}\b", path.read_text()) for path in sources):
            yield f"{where}: nothing uses {name}"


def workflow_problems():
    """Yields what a workflow calls and is not there, actions of no fixed version, and systems that none builds for."""
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), re.M))
    built = set(re.findall(r"name: ([\w-]+), runner:", (ROOT / ".github" / "workflows" / "test.yml").read_text()))
    for name in built ^ {one.name for one in platforms.PLATFORMS}:
        yield f"{name} is either built by test.yml or in tools/platforms.py, but not both"
    for path in sorted((ROOT / ".github" / "workflows").glob("*.yml")):
        for number, line in enumerate(path.read_text().splitlines(), 1):
            where, code = f"{path.relative_to(ROOT)}:{number}", line.split("#")[0]
            for script in re.findall(r"(?<![\w/])(?:tools|tests|\.ci)/[\w./-]+", code):
                if not (ROOT / script).exists():
                    yield f"{where}: there is no {script}"
            for target in re.findall(r"\bmake ([a-z-]+)$", code):
                if target not in targets and "name:" not in code:
                    yield f"{where}: the Makefile has no target {target}"
            used = re.search(r"uses: ([^.\s]\S*)", code)
            # The one action that names its versions by branches.
            if used and not re.fullmatch(r"\S+@(v\d+|[0-9a-f]{40})|pypa/\S+@release/v\d+", used[1]):
                yield f"{where}: name a major version or a commit of {used[1].split('@')[0]}"


def long_files():
    """Yields files of code that are too long without a reason, and reasons for files that are not."""
    reasons = set(re.findall(r"^\| `([^`]+)` \|", architecture_section(f"Files over {MOST_LINES:,} lines"), re.M))
    long = set()
    for path in files():
        if path.suffix in CODE and len(path.read_text().splitlines()) > MOST_LINES:
            long.add(str(path.relative_to(ROOT)))
    for name in sorted(long - reasons):
        yield f"{name}: more than {MOST_LINES} lines: cut it, or say in ARCHITECTURE.md why it is one file"
    for name in sorted(reasons - long):
        yield f"ARCHITECTURE.md: {name} does not have more than {MOST_LINES} lines"


def architecture_section(title):
    """The text of a section of ARCHITECTURE.md."""
    _, _, rest = (ROOT / "ARCHITECTURE.md").read_text().partition(f"\n## {title}\n")
    return rest.partition("\n## ")[0]


def guides():
    """README.md and the guides."""
    return [ROOT / "README.md", *sorted((ROOT / "docs" / "site" / "guide").glob("*.md"))]


def plain_pages():
    """The pages that are to be easy to read: all of them."""
    return [path for path in files() if path.suffix == ".md"]


def word_problems():
    """Yields what makes a guide hard to read, and what README.md has that belongs elsewhere."""
    size = (ROOT / "README.md").stat().st_size
    if size > README_BYTES:
        yield f"README.md: {size} bytes, at most {README_BYTES}: move text into a guide"
    for path in plain_pages():
        text = path.read_text("utf-8")
        for problem in plain_words.markdown(text).problems():
            yield f"{path.relative_to(ROOT)}: {problem}"
        for number, line in plain_words.rows_with_semicolons(text):
            yield f"{path.relative_to(ROOT)}:{number}: make sentences of what a semicolon joins: {line[:80]}"


def comment_problems():
    """Yields comments that begin with a question, and crates of Rust whose doc comments are hard to read."""
    for path in files():
        if path.suffix in {".py", ".pyi"}:
            for number, text in plain_words.python_comments(path.read_text("utf-8")):
                yield from begins_with_a_question(path.relative_to(ROOT), number, text)
    for folder in DOCUMENTED:
        python = [path for path in files() if path.suffix == ".py" and path.is_relative_to(ROOT / folder)]
        text = plain_words.docstrings("\n".join(path.read_text("utf-8") for path in python))
        for problem in text.problems(plain_words.COMMENT_LIMITS):
            yield f"{folder}: {problem}"
    codes = {str(path.relative_to(ROOT)): path.read_text("utf-8") for path in files() if path.suffix == ".rs"}
    folders = {str(path.parent.relative_to(ROOT)) + "/" for path in files() if path.name == "Cargo.toml"}
    crates = {}
    for name, code in codes.items():
        crate = max((folder for folder in folders if name.startswith(folder)), key=len, default="./")
        crates.setdefault(crate, {})[name] = code
    for crate, found in sorted(crates.items()):
        yield from unplain_comments(crate, found)


def message_problems():
    """Yields messages of errors whose form is wrong, and exceptions that no message needs."""
    found = [one for path in messages.sources(ROOT) for one in messages.messages(path, ROOT)]
    for one in found:
        for fault in message_form.faults(one):
            yield f"{one.file}:{one.line}: the message {one.text[:80]!r} {fault}"
    for text in message_form.EXCEPTIONS:
        if not any(one.text.startswith(text) for one in found):
            yield f"tools/message_form.py: no message begins with {text!r}: take it out of EXCEPTIONS"
    for name in message_form.INTERNAL:
        if not any(one.file == name for one in found):
            yield f"tools/message_form.py: {name} has no message: take it out of INTERNAL"


def unplain_comments(crate, codes):
    """Yields what makes the comments of some files hard to read, by their names."""
    for name, code in codes.items():
        for number, _, text in plain_words.comments(code):
            yield from begins_with_a_question(name, number, text)
    text = plain_words.doc_comments("\n\n".join(codes.values()))
    for problem in text.problems(plain_words.COMMENT_LIMITS):
        yield f"{crate.rstrip('/')}: {problem}"


def begins_with_a_question(name, number, text):
    """Yields the place of a comment, if it begins with a question."""
    if plain_words.QUESTION.match(text):
        yield f"{name}:{number}: a comment begins with what the item is, not with {text[:40]!r}"


def unpublished(changelog, text):
    """Lines that lead somewhere only once there is a release, with their numbers; none once there is one."""
    heading = re.search(r"^## (.+)$", changelog, re.M)
    if heading is None or "unreleased" not in heading[1] or re.search(r"^## (?!.*unreleased)", changelog, re.M):
        return []
    return [(number, line) for number, line in enumerate(text.splitlines(), 1) if PUBLISHED.search(line)]


def publishing_problems():
    """Yields lines of pages for users that name what is not published yet."""
    changelog = (ROOT / "CHANGELOG.md").read_text("utf-8")
    pages = [*guides(), *sorted((ROOT / "docs" / "site").glob("*.md"))]
    pages += [ROOT / folder / "README.md" for folder in ("blender-addon", "meshlab-plugin", "python")]
    for path in pages:
        for number, line in unpublished(changelog, path.read_text("utf-8")):
            yield f"{path.relative_to(ROOT)}:{number}: nothing is published yet: {line.strip()[:80]}"


def without_link(changelog):
    """The changes that name no page that explains them, by the numbers of their lines."""
    items = re.finditer(r"^- .*(?:\n(?!- |#).*)*", changelog, re.M)
    return [(changelog.count("\n", 0, item.start()) + 1, item[0]) for item in items if "](" not in item[0]]


def changelog_problems():
    """Yields changes without a link."""
    for number, item in without_link((ROOT / "CHANGELOG.md").read_text("utf-8")):
        yield f"CHANGELOG.md:{number}: link the page that explains the change: {item[:80]}"


def problems():
    """Yields one sentence for each thing wrong."""
    yield from word_problems()
    yield from comment_problems()
    yield from message_problems()
    yield from publishing_problems()
    yield from changelog_problems()
    yield from dependency_problems()
    yield from workflow_problems()
    yield from long_files()
    for path in files():
        name = path.relative_to(ROOT)
        content = path.read_bytes()
        if len(content) > LARGEST:
            yield f"{name}: {len(content)} bytes; data belongs outside the tree (the limit is {LARGEST})"
        for number, line in enumerate(content.splitlines(), 1):
            if b"\0" not in line and MACHINE_PATH.search(line):
                yield f"{name}:{number}: a path of one machine: {line.strip().decode(errors='replace')[:80]}"
    references = (ROOT / "REFERENCES.md").read_text()
    for path in files():
        if path.suffix != ".rs":
            continue
        for number, line in enumerate(path.read_text().splitlines(), 1):
            where = f"{path.relative_to(ROOT)}:{number}"
            if BARE_CITATION.search(line):
                yield f"{where}: escape the brackets of the citation, or rustdoc takes it for a link"
            if "//" in line:
                for key in CITATION.findall(line):
                    if f"| {key} |" not in references:
                        yield f"{where}: {key} is not in REFERENCES.md"
    for name in LICENCES:
        if not (ROOT / name).is_file():
            yield f"{name} is missing"


def main():
    """Prints the problems."""
    found = list(problems())
    for problem in found:
        print(problem)
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
