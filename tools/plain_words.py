"""How hard a text is to read: plain_words.py FILE... prints the figures of files and their limits.

Of a Markdown file code, tables, headings and pictures do not count, but cells of tables have no semicolons. Of a Rust
file the doc comments count.
CONTRIBUTING.md has the rules. `make check` holds the pages and the comments of the tree to the limits (`plain_pages`
and `comment_problems` in `tools/check_tree.py`).
"""

import ast
import inspect
import io
import re
import sys
import tokenize
from dataclasses import dataclass
from pathlib import Path

LONG = 25
# The most of each figure; CONTRIBUTING.md says them too.
LIMITS = {
    "commas per 1,000 words": 55,
    "semicolons per 1,000 words": 3,
    f"% of sentences over {LONG} words": 10,
    "% of sentences that are inverted": 1,
    "words per sentence": 15,
}
# Those that doc comments are held to.
COMMENT_LIMITS = ("semicolons per 1,000 words", "% of sentences that are inverted")
WORD = re.compile(r"[\w`'/.-]+")
# "What lies outside, is removed": the reader waits for the subject's verb.
INVERTED = re.compile(r"(What|Who|Whoever|Whatever|Which|Where|That)\b[^.?!]*,")

# A comment begins with what the item is: "The points outside", not "What lies outside".
QUESTION = re.compile(r"(What|Who|Which|Where)\b")
COMMENT = re.compile(r"\s*(//!|///?)(?!/) ?(.*)")
BEHIND_CODE = re.compile(r"\S\s+// (.*)")


@dataclass
class Text:
    """The sentences of a text, and all of it."""

    whole: str
    sentences: list

    def figures(self):
        """The figures by name, as LIMITS has them."""
        words = max(1, len(WORD.findall(self.whole)))
        many = max(1, len(self.sentences))
        lengths = [len(WORD.findall(sentence)) for sentence in self.sentences]
        values = (
            1000 * self.whole.count(",") / words,
            1000 * self.whole.count(";") / words,
            100 * sum(length > LONG for length in lengths) / many,
            100 * len(self.inverted()) / many,
            sum(lengths) / many,
        )
        return dict(zip(LIMITS, values, strict=True))

    def inverted(self):
        """The sentences that begin with what they do not speak of."""
        return [sentence for sentence in self.sentences if INVERTED.match(sentence)]

    def problems(self, names=tuple(LIMITS)):
        """Yields a sentence for each figure of these names beyond its limit, with what to mend first."""
        for name, value in self.figures().items():
            if name in names and value > LIMITS[name]:
                worst = self.inverted() if "inverted" in name else sorted(self.sentences, key=len, reverse=True)
                if "semicolons" in name:
                    worst = [sentence for sentence in worst if ";" in sentence] or worst
                yield f"{value:.1f} {name}, at most {LIMITS[name]}: begin with {worst[0][:80]!r}"


def markdown(text):
    """The prose of a Markdown text."""
    text = re.sub(r"^( *)(```+).*?^ *\2`*$", "", text, flags=re.S | re.M)
    text = re.sub(r"<[^>]+>|!\[[^\]]*\]\([^)]*\)", "", text)
    text = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", text)
    lines = [line for line in text.splitlines() if not line.lstrip().startswith(("|", "#"))]
    # Each item of a list is a paragraph of its own.
    paragraphs = re.split(r"\n\s*\n|\n(?=\s*(?:[-*]|\d+\.)\s)", "\n".join(lines))
    paragraphs = [" ".join(paragraph.split()) for paragraph in paragraphs]
    sentences = [
        sentence
        for paragraph in paragraphs
        for sentence in re.split(r"(?<=[.!?])\s+(?=[A-Z`*\[])", paragraph)
        if len(WORD.findall(sentence)) > 2
    ]
    return Text("\n".join(paragraphs), sentences)


def rows_with_semicolons(text):
    """The rows of tables of a Markdown text that have a semicolon outside of code, with their numbers."""
    # Code keeps its lines, so that numbers stay those of the text.
    blank = re.sub(r"^( *)(```+).*?^ *\2`*$", lambda code: "\n" * code[0].count("\n"), text, flags=re.S | re.M)
    for number, line in enumerate(blank.splitlines(), 1):
        if line.lstrip().startswith("|") and ";" in re.sub(r"`[^`]*`|&\w+;", "", line):
            yield number, line.strip()


def comments(code):
    """Of each comment of a Rust file: the number of its first line, its mark and the text of that line."""
    before = None
    for number, line in enumerate(code.splitlines(), 1):
        found = COMMENT.match(line)
        if found and found[1] != before:
            yield number, found[1], found[2]
        before = found and found[1]
        behind = None if found else BEHIND_CODE.search(line)
        if behind:
            yield number, "//", behind[1]


def python_comments(code):
    """Of each comment and docstring of a Python file: the number of its first line and the text of that line."""
    for node in ast.walk(ast.parse(code)):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str):
            yield node.lineno, inspect.cleandoc(node.value.value).partition("\n")[0]
    before = None
    for token in tokenize.generate_tokens(io.StringIO(code).readline):
        if token.type == tokenize.COMMENT:
            number, at = token.start
            alone = not token.line[:at].strip()
            if not alone or before != number - 1:
                yield number, token.string.lstrip("# ")
            before = number if alone else None


def doc_comments(code):
    """The prose of the doc comments of a Rust file."""
    lines = []
    for line in code.splitlines():
        found = COMMENT.match(line)
        lines.append(found[2] if found and found[1] != "//" else "")
    return markdown("\n".join(lines))


def docstrings(code):
    """The prose of the docstrings of a Python file, without examples."""
    found = []
    for node in ast.walk(ast.parse(code)):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str):
            lines = inspect.cleandoc(node.value.value).splitlines()
            found.append("\n".join(line for line in lines if not line.lstrip().startswith((">>>", "..."))))
    return markdown("\n\n".join(found))


def main():
    """Prints the figures; ends with status 1 if one is beyond its limit."""
    found = False
    for name in sys.argv[1:]:
        is_code, content = name.endswith(".rs"), Path(name).read_text("utf-8")
        text = (doc_comments if is_code else markdown)(content)
        figures = ", ".join(f"{value:.1f} {figure}" for figure, value in text.figures().items())
        print(f"{name}: {figures}")
        for problem in text.problems(COMMENT_LIMITS if is_code else tuple(LIMITS)):
            found = True
            print(f"  {problem}")
        for number, line in () if is_code else rows_with_semicolons(content):
            found = True
            print(f"  line {number} is a row with a semicolon: {line[:80]}")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
