"""The reference of the C library out of its header.

The header is generated, so its form is fixed: a comment of `//` lines, then what it tells of. Lines of a function's
comment that begin with the name of an argument, or `returns`, and two spaces are the rows of a table.
"""

import re
from dataclasses import dataclass, field

from words import indented, linked, title

_ROW = re.compile(r"^([a-z_]\w*(?:, \w+)*)  +(\S.*)$")


@dataclass
class Entry:
    """An item that a comment of the header tells of. `members` of an enum or a struct: declaration and comment."""

    kind: str
    name: str
    code: str
    comment: list
    members: list = field(default_factory=list)


def entries(text):
    """All of the header, in its order; of its beginning the comment for people."""
    preface = re.match(r"/\*\n(.*?)\n \*/", text, re.S)[1]
    found, comment, inside = [], [], None
    code = ""
    for line in text[text.index("#define SURFRECON_H") :].splitlines()[1:]:
        bare = line.strip()
        if bare.startswith("//") and not code:
            comment.append(bare[2:].removeprefix(" "))
        elif not bare or bare.startswith(("#if", "#end", "#include", 'extern "C"')) or bare == "}":
            comment = []
        elif bare.startswith("#define"):
            name = bare.split()[1]
            if "(" in name:
                # A macro that is called: it stands behind the function that it calls.
                found[-1].members.append((bare, []))
            else:
                found.append(Entry("macro", name, name, comment))
            comment = []
        elif re.match(r"typedef (enum|struct) \{$", bare):
            inside, comment = Entry(bare.split()[1], "", "", comment), []
        elif inside and bare.startswith("}"):
            inside.name = inside.code = bare.strip("} ;")
            found.append(inside)
            inside, comment = None, []
        elif inside:
            code += bare
            if bare.endswith((";", ",")):
                inside.members.append((code.rstrip(";,"), comment))
                code, comment = "", []
        else:
            code = f"{code} {bare}".strip()
            if bare.endswith(";"):
                found.append(_declared(code.rstrip(";"), comment))
                code, comment = "", []
    return preface, found


def _declared(code, comment):
    if handle := re.fullmatch(r"typedef struct (\w+) \1", code):
        return Entry("handle", handle[1], handle[1], comment)
    if called := re.fullmatch(r"typedef (.+?)\(\*(\w+)\)(\(.*\))", code):
        return Entry("callback", called[2], f"{called[1]}(*{called[2]}){called[3]}", comment)
    name = re.search(r"(srf_\w+)\(", code)
    if not name:
        raise ValueError(f"the header has what this script does not know: {code}")
    return Entry("function", name[1], code, comment)


def chapters(root):
    """The chapters of the header, by the name of the library's file, in their order: what the file says it is."""
    text = (root / "tests/rust/generated/chapters.rs").read_text("utf-8")
    listed = " ".join(re.findall(r"files: &\[(.*?)\]", text, re.S))
    found, parameters = {}, []
    for name in re.findall(r'"([\w/]+)"', listed):
        # Structs of parameters stand before the operation that takes them.
        if name.startswith("params/"):
            parameters.append(name)
            continue
        files = [root / "c-api" / "src" / f"{part}.rs" for part in (*parameters, name)]
        text = files[-1].read_text("utf-8")
        says = " ".join(line[4:] for line in re.match(r"(//! .*\n)+", text)[0].splitlines())
        found[name] = says, "\n".join(file.read_text("utf-8") for file in files)
        parameters = []
    return found


def examples(root):
    """The functions that the chapters of the header have as examples: the text of each, and what it calls."""
    for file in sorted((root / "tests/rust/generated/chapters").glob("*.c")):
        for text in re.split(r"\n\n(?=/\*)", file.read_text("utf-8").strip()):
            yield text, set(re.findall(r"\bsrf_\w+(?=\()", text))


def _chapter(name, known):
    for chapter, (_, text) in known.items():
        if re.search(rf"\b(?:fn|struct|enum|type|const) {name}\b", text):
            return chapter
    # A line of the header's own frame.
    return None


_KINDS = {"Functions": ("function",), "Types": ("handle", "struct", "callback"), "Constants": ("enum", "macro")}
_ROLES = {
    "function": "func",
    "callback": "type",
    "handle": "type",
    "struct": "struct",
    "enum": "enum",
    "macro": "macro",
}


def roles(found):
    """The role by which each name is linked."""
    made = {}
    for entry in found:
        made[entry.name] = _ROLES[entry.kind]
        for code, _ in entry.members:
            if entry.kind == "enum":
                made[code.split()[0]] = "enumerator"
            elif code.startswith("#define"):
                made[re.match(r"#define (\w+)", code)[1]] = "macro"
    return made


def _text(comment, known):
    """A comment: paragraphs and, of functions, the table of arguments."""
    paragraphs, rows = [[]], []
    for line in comment:
        row = _ROW.match(line)
        if row and (rows or row[1] == "returns" or not paragraphs[-1] or _is_table(comment)):
            rows.append([row[1], row[2]])
        elif rows and line.startswith("  "):
            rows[-1][1] += " " + line.strip()
        elif not line:
            paragraphs.append([])
        else:
            paragraphs[-1].append(line)
    made = [linked(" ".join(lines), known) for lines in paragraphs if lines]
    for name, text in rows:
        # A space would make a type of the first of several names.
        label = "returns" if name == "returns" else f"param {name.replace(' ', '')}"
        made.append(f":{label}: {linked(text, known)}")
    fields = len(rows)
    return "\n\n".join(made[: len(made) - fields]) + ("\n\n" if fields else "") + "\n".join(made[len(made) - fields :])


def _is_table(comment):
    return any(line.startswith("returns  ") for line in comment)


def _entry(entry, known):
    directive = {"handle": "type", "callback": "type"}.get(entry.kind, entry.kind)
    body = _text(entry.comment, known)
    if entry.kind == "function":
        for macro, _ in entry.members:
            call = re.match(r"#define (\w+\(\w+\)) (.+)$", macro)
            body += f"\n\n.. c:macro:: {call[1]}\n\n   ``{call[2]}``"
    elif entry.kind in ("enum", "struct"):
        kind = "enumerator" if entry.kind == "enum" else "member"
        for code, comment in entry.members:
            body += f"\n\n.. c:{kind}:: {code}\n\n{indented(_text(comment, known))}"
    return f".. c:{directive}:: {entry.code}\n\n{indented(body)}\n"


def _preface(text, known):
    """The comment at the header's beginning: its program, its order, its conventions."""
    made = []
    plain = [line.removeprefix(" *").removeprefix(" ") for line in text.splitlines()]
    about, _, conventions = "\n".join(plain).partition("\nConventions\n")
    for paragraph in re.split(r"\n\n", about):
        if paragraph.startswith("    "):
            made.append(".. code-block:: c\n\n" + indented(re.sub(r"^    ", "", paragraph, flags=re.M)))
        elif chapters := re.findall(r"^ +\d+\. (.+?)  +(srf_\w+\(\))$", paragraph, re.M):
            about = re.split(r"^ +\d+\. ", paragraph, maxsplit=1, flags=re.M)[0]
            made.append(linked(" ".join(about.split()), known))
            made.append("\n".join(f"#. {linked(f'{name}: from {first} on.', known)}" for name, first in chapters))
        else:
            made.append(linked(" ".join(paragraph.split()), known))
    made.append(title("Conventions", "-"))
    # A convention begins in a line of its own, and its last line ends with a sentence.
    for convention in re.findall(r".+?\.(?:\n|$)", conventions.partition("\n\n")[0], re.S):
        made.append(f"* {linked(' '.join(convention.split()), known)}")
    return "\n\n".join(made) + "\n"


def write(root, folder):
    """Writes the pages; returns the role of each name that they document."""
    preface, found = entries((root / "c-api" / "include" / "surfrecon.h").read_text("utf-8"))
    known, parts, shown = roles(found), chapters(root), list(examples(root))
    folder.mkdir(parents=True, exist_ok=True)
    pages = {name: [] for name in [None, *parts]}
    for entry in found:
        pages[_chapter(entry.name, parts)].append(entry)
    frame = "\n".join(_entry(entry, known) for entry in pages[None])
    toc = "\n".join([".. toctree::", "   :maxdepth: 1", "", *(f"   {name}" for name in parts)])
    text = [
        title("C reference", "="),
        _preface(preface, known),
        title("Chapters", "-"),
        toc,
        "",
        title("Constants", "-"),
        frame,
    ]
    (folder / "index.rst").write_text("\n".join(text), "utf-8")
    for name, (says, _) in parts.items():
        page = folder / f"{name}.rst"
        # A chapter of a file in a folder has its page in one.
        page.parent.mkdir(exist_ok=True)
        page.write_text(_page(says, pages[name], known, shown), "utf-8")
    return known


def _page(says, here, known, shown):
    heading = re.split(r"[:.;]", says)[0]
    text = [title(heading, "=")]
    if says.rstrip(".") != heading:
        text.append(linked(says, known) + "\n")
    functions = {entry.name.removesuffix("_sized") for entry in here if entry.kind == "function"}
    if some := [example for example, calls in shown if calls & functions]:
        text.append(title("Examples", "-"))
        text += [".. code-block:: c\n\n" + indented(example) + "\n" for example in some]
    for name, kinds in _KINDS.items():
        some = [entry for entry in here if entry.kind in kinds]
        if some:
            text += [title(name, "-"), *(_entry(entry, known) for entry in some)]
    return "\n".join(text)
