"""The reference of the C++ header: its classes and functions, each with the comment above it and what of C it calls."""

import re

from words import indented, linked, title

_COMMENT = re.compile(r"[ ]*//[^\n]*\n")
_ACCESS = re.compile(r"\s*(public|private|protected):")
_CLASS = re.compile(r"(?:template <[^\n]*>\s*)?(class|struct) ([\w:]+)(?: : ([^{]+))? $")


def _closed(text, at):
    """The place behind the brace that closes the one at a place."""
    depth = 0
    for place in range(at, len(text)):
        depth += {"{": 1, "}": -1}.get(text[place], 0)
        if depth == 0:
            return place + 1
    raise ValueError("a brace is not closed")


def _declaration(text, at):
    """The declaration from a place on, its body, and the place behind both."""
    depth, called, start = 0, False, at
    while True:
        mark = text[at]
        depth += {"(": 1, ")": -1}.get(mark, 0)
        called = called or mark == "("
        if mark == ";" and depth == 0:
            return text[start:at], "", at + 1
        if mark == ":" and called and depth == 0 and text[at - 1] == " ":
            # A constructor's list; its body is the brace behind a space and a closed initializer.
            body = at + re.search(r"[)}]\s+\{", text[at:]).end() - 1
            return text[start:at], text[at : _closed(text, body)], _closed(text, body)
        if mark == "{" and depth == 0:
            end = _closed(text, at)
            if text[start:at].lstrip().startswith(("class", "struct", "template", "namespace")) or called:
                return text[start:at], text[at + 1 : end - 1], end
            # The value of a member.
            at = end - 1
        at += 1


def _items(text, hidden=False):
    """The items of a namespace or a class: comment, declaration, body."""
    at, comment = 0, []
    while at < len(text):
        if found := _COMMENT.match(text, at):
            comment.append(found[0].strip()[2:].strip())
            at = found.end()
        elif found := _ACCESS.match(text, at):
            hidden = found[1] != "public"
            comment, at = [], found.end()
        elif text[at] == "\n" and text[at + 1 : at + 2] == "\n":
            comment, at = [], at + 1
        elif text[at].isspace() or text[at] == ";":
            at += 1
        elif text[at] == "#":
            at = text.index("\n", at)
        else:
            declared, body, at = _declaration(text, at)
            # A comment behind it is its own.
            if not comment and (behind := re.match(r"  //([^\n]*)", text[at:])):
                comment.append(behind[1].strip())
                at += behind.end()
            if not hidden:
                yield comment, " ".join(declared.split()), body
            comment = []


def _calls(body, known):
    names = dict.fromkeys(re.findall(r"\b(srf_\w+)\(", body))
    return [name for name in names if known.get(name) == "func"]


def _said(comment, body, known):
    text = " ".join(comment)
    calls = _calls(body, known)
    if calls and not any(f"{name}()" in text for name in calls):
        text += f"{' ' if text else ''}C: {', '.join(f'{name}()' for name in calls)}."
    return linked(text, known)


def _entry(comment, declared, body, known):
    """A directive."""
    declared = re.sub(r"^inline ", "", declared)
    found = _CLASS.match(declared + " ")
    if found is None or not body:
        kind = "type" if declared.startswith("using ") else "function" if "(" in declared else "member"
        declared = declared.removeprefix("using ")
        # Several members in one line.
        several = re.fullmatch(r"([^=(]*[>\w]) (\w+(?: = [\w.]+)?(?:, \w+(?: = [\w.]+)?)+)", declared)
        each = [f"{several[1]} {name}" for name in several[2].split(", ")] if several else [declared]
        rest = "".join(f"\n   {' ' * (len(kind) + 8)}{one}" for one in each[1:])
        return f".. cpp:{kind}:: {each[0]}{rest}\n\n{indented(_said(comment, body, known))}\n"
    # That a class owns a handle the page's beginning says.
    bases = [found[3].strip()] if found[3] and "detail::" not in found[3] else []
    template = re.match(r"template <.*> (?=class|struct)", declared)
    of_c = [base for base in bases if known.get(base) == "struct"]
    named = f"{template[0] if template else ''}{found[2]}{' : ' + ', '.join(bases) if bases and not of_c else ''}"
    said = _said([*comment, *(f"C: {base}." for base in of_c)], "", known)
    inside = [
        _entry(own, what, how, known)
        for own, what, how in _items(body, found[1] == "class")
        if not what.startswith(("using ", "friend ", "class "))
        and not re.fullmatch(r"struct \w+", what)
        and not re.match(rf"{found[2]}\(\)$", what)
    ]
    return f".. cpp:{found[1]}:: {named}\n\n{indented(said)}\n\n" + indented("\n".join(inside)) + "\n"


def write(header, target, known):
    """Writes the page; `known` are the roles of the names of C. Returns the names of its classes and functions."""
    text = header.read_text("utf-8")
    preface = " ".join(line[3:] for line in re.match(r"(//.*\n)+", text)[0].splitlines())
    _, _, rest = text.partition("\nnamespace surfrecon {\n")
    body = rest[: rest.rindex("}  // namespace surfrecon")]
    items = [item for item in _items(body) if not item[1].startswith("namespace detail")]
    # Declared first, defined later: the definition has no comment.
    items = [item for item in items if not re.match(r"inline [\w:]+ \w+::\w+\(", item[1])]
    classes = [item for item in items if _CLASS.match(item[1] + " ") and item[2]]
    made = [title("C++ reference", "="), linked(preface, known), ""]
    groups = {
        "Classes": [item for item in classes if item[1].startswith(("class", "template"))],
        "Structs": [item for item in classes if item[1].startswith("struct")],
        "Functions and types": [item for item in items if not _CLASS.match(item[1] + " ")],
    }
    for name, some in groups.items():
        made += [title(name, "-"), ".. cpp:namespace:: surfrecon\n", *(_entry(*item, known) for item in some)]
    target.write_text("\n".join(made), "utf-8")
    return sorted(_CLASS.match(item[1] + " ")[2] for item in classes)
