"""The messages of the whole project and their form: messages.py prints them all, messages.py FILE... those of files.

A message says what was wrong with its value, what is allowed and what to do. They are found in the sources of Rust,
Python and C++: each literal that an error is made of, and each piece of prose that may become part of one. So a new
message is found by itself. `make check` holds their form (`message_problems` in `tools/check_tree.py`).
"""

import ast
import re
import sys
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
# Folders that messages come from. Tests, examples and benchmarks refuse nothing.
SOURCES = (
    ("rust-core", ".rs"),
    ("c-api/src", ".rs"),
    ("python/src", ".rs"),
    ("python/python", ".py"),
    ("blender-addon/extension", ".py"),
    ("meshlab-plugin/src", ".cpp"),
    ("meshlab-plugin/src", ".h"),
)
NO_SOURCES = re.compile(r"/(tests|examples|benches|fuzz|build\.rs|target|params|presets)(/|$)|_tests\.rs$")
# Other languages, and what options are called.
NO_MESSAGES = re.compile(r"extension/(german\w*|translations|properties)\.py")


@dataclass(frozen=True)
class Message:
    """A text that people read when something is refused or told.

    `whole` says that nothing of ours stands before it or behind it. `of_file` says that a file and a place in it do.
    """

    file: str
    line: int
    text: str
    whole: bool
    of_file: bool = False


# Rust: tokens, and the groups that brackets make of them.
TOKEN = re.compile(
    r"""(?P<comment>//[^\n]*|/\*.*?\*/)
|(?P<raw>[bc]?r(?P<hashes>\#*)".*?"(?P=hashes))
|(?P<text>[bc]?"(?:\\.|[^"\\])*")
|(?P<char>b?'(?:\\[^\n]+?|[^'\\\n])')
|(?P<life>'[A-Za-z_]\w*)
|(?P<name>[A-Za-z_]\w*(?:\s*::\s*[A-Za-z_]\w*)*!?)
|(?P<number>\d[\w.]*)
|(?P<mark>=>|->|[^\s\w])""",
    re.S | re.X,
)
# Texts in them say something to programmers alone, or are declared for pages and windows.
OTHER_TEXTS = re.compile(
    r"(params|report|choices|alternatives|stages|whole|own|panic|unreachable|todo|\w*assert\w*|matches|println|write|writeln)!$"
    r"|^\.(expect|expect_err|contains|starts_with|ends_with|strip_prefix|strip_suffix|split|replace|find|trim\w*|lap|plan)$"
    r"|^(Operation|Operator|Filter|Command|Layout|Format::of|doc|deprecated|allow|pyo3|error|cfg|feature|expect|stages|Choice)$"
)
# A call with such a name is an error made of its last argument.
ERRORS = re.compile(
    r"(^|::)(Error|Failure|PyErr|Problem)::(input|Input|format|OutOfMemory|new|other)$|(^|::)(Err|input_error)$|::new_err$"
    r"|^\.(ok_or|ok_or_else|map_err|fail)$"
)
OF_FILES = re.compile(r"(^|::)Error::(format|Format)$|^\.?fail$")
# A function that makes an error of a text, and a closure that does.
MAKER = re.compile(
    r"\bfn (\w+)(?:<[^>]*>)?\([^)]*\b(?:problem|text|message|reason): (?:&str|String|impl [^)]*)\)"
    r" -> (?:Error|Failure|PyErr|Problem|Result<[^{]*, String>)(?=[\s{])"
)
CLOSURE = re.compile(
    r"\blet (\w+) = (?:move )?\|[^|]*\b(?:problem|text|message|reason)\b[^|]*\|"
    r" (?:\{\s*)?(?:Err\()?(?:\w+::)*(Error|Failure)::(\w+)"
)


class Group:
    """Content of brackets, with the name before them: a call, a macro, a struct."""

    def __init__(self, name, opened):
        self.name, self.opened, self.items = name, opened, []

    def arguments(self):
        """The items between commas, in a block those between semicolons."""
        found, between = [[]], ";" if self.opened == "{" and ("mark", ";") in self.items else ","
        for item in self.items:
            if item == ("mark", between):
                found.append([])
            else:
                found[-1].append(item)
        return [items for items in found if items]


def rust_groups(code):
    """The whole of a file as one group; literals are triples with their line."""
    top = Group("", "")
    stack, before = [top], []
    for found in TOKEN.finditer(code):
        kind, text = found.lastgroup, found.group()
        if kind == "comment":
            continue
        if kind == "mark" and text in "([{":
            name = before[-1][1] if before and before[-1][0] == "name" else ""
            name = re.sub(r"\s", "", name)
            if name and before[-2:-1] == [("mark", ".")]:
                name = f".{name}"
            # A generic call: `Err::<(), _>(...)` is as rare as it is fine.
            group = Group(name, text)
            stack[-1].items.append(group)
            stack.append(group)
        elif kind == "mark" and text in ")]}":
            if len(stack) > 1:
                stack.pop()
        elif kind in ("text", "hashes", "raw") and not text.startswith("b"):
            stack[-1].items.append(("literal", rust_text(text), code.count("\n", 0, found.start()) + 1))
        else:
            stack[-1].items.append((kind, text))
        before = [*before[-2:], (kind, text)]
    return top


def rust_text(literal):
    """The value of a literal."""
    inside = literal[literal.index('"') + 1 : literal.rindex('"')]
    if literal.lstrip("c").startswith("r"):
        return inside
    inside = re.sub(r"\\\n\s*", "", inside)
    return inside.replace('\\"', '"').replace("\\n", "\n").replace("\\\\", "\\")


def without_tests(code):
    """The code of a file without the tests at its end."""
    return re.split(r"\n#\[cfg\(test\)\]\n(?:#\[[^\n]*\]\n)*mod tests \{", code)[0]


def rust_messages(name, code):
    """Yields the messages of a file of Rust."""
    code = without_tests(code)
    makers = set(MAKER.findall(code))
    of_files = set()
    for closure, _, kind in CLOSURE.findall(code):
        makers.add(closure)
        if kind == "format":
            of_files.add(closure)

    def is_error(group):
        return bool(ERRORS.search(group.name)) or group.name.lstrip(".").split("::")[-1] in makers

    def visit(group, whole, of_file):
        if OTHER_TEXTS.search(group.name):
            return
        arguments = group.arguments()
        for place, items in enumerate(arguments):
            last = place == len(arguments) - 1
            if is_error(group):
                inside, file = last, of_file or bool(OF_FILES.search(group.name)) or group.name in of_files
            elif group.name == "format!":
                inside, file = whole and place == 0, of_file
            elif group.opened == "{" or not group.name or group.opened == "[":
                # A block's bindings are parts of its value, unless a name says that it is all.
                is_bound, is_problem = items[0] == ("name", "let"), items[1:2] == [("name", "problem")]
                inside, file = is_problem if is_bound else whole, of_file
            else:
                inside, file = False, of_file
            for item in items:
                if isinstance(item, Group):
                    yield from visit(item, inside, file)
                elif item[0] == "literal":
                    # A reader of a file names the file and the place in it.
                    file = file or name.startswith("rust-core/io/src/import/") and group.name != "Error::input"
                    yield Message(name, item[2], item[1], inside, file)

    yield from visit(rust_groups(code), False, False)


# Python: calls that make an error of a text or say it, and those whose texts explain options.
PYTHON_ERRORS = re.compile(r"(Error|Refused|Cancelled|BadCommandLine)$|^ArgumentTypeError$")
# Calls that make an error of a text. A poll refuses as well: it says why a button is grey.
REFUSING = {"poll_message_set": 0}
PYTHON_OTHERS = re.compile(
    r"Property$|^(Own|Command|add_parser|add_argument|_add_common|compile|label|operator|menu|prop|_Parser|report_lines|Task"
    r"|column_header|colorbar|set|set_\w+|tqdm|fullmatch|match|sub|search|split|removeprefix|partition|get|getattr|text|lines)$"
)


def python_text(node):
    """A text with braces for what changes, or `None`."""
    if isinstance(node, ast.Constant):
        return node.value if isinstance(node.value, str) else None
    if isinstance(node, ast.JoinedStr):
        return "".join(part.value if isinstance(part, ast.Constant) else "{}" for part in node.values)
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add):
        both = python_text(node.left), python_text(node.right)
        return None if both == (None, None) else "".join("{}" if text is None else text for text in both)
    return None


def called(node):
    """The last name of what a call calls."""
    return getattr(node.func, "attr", getattr(node.func, "id", ""))


def python_messages(name, code):
    """Yields the messages of a file of Python."""

    def visit(node, whole):
        text = python_text(node)
        if text is not None:
            yield Message(name, node.lineno, text, whole)
            parts = [part for part in ast.walk(node) if isinstance(part, ast.FormattedValue)]
            for part in parts:
                yield from visit(part.value, False)
        elif isinstance(node, ast.Call):
            if PYTHON_OTHERS.search(called(node)):
                return
            first = REFUSING.get(called(node), 0 if PYTHON_ERRORS.search(called(node)) else None)
            for place, argument in enumerate(node.args):
                # `told` gives the same text in the language of the interface.
                yield from visit(argument, place == first or whole and called(node) == "told")
            for keyword in node.keywords:
                yield from visit(keyword.value, False)
        elif isinstance(node, ast.IfExp):
            for branch in (node.body, node.orelse):
                yield from visit(branch, whole)
        elif isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            return
        else:
            # Class attributes are names and tooltips.
            skipped = isinstance(node, ast.ClassDef)
            for child in ast.iter_child_nodes(node):
                if not (skipped and isinstance(child, ast.Assign | ast.AnnAssign)):
                    yield from visit(child, False)

    yield from visit(ast.parse(code), False)


# C++: a call of `refuse` or `log`, whose literals and values are joined by plus signs.
CPP_CALL = re.compile(r"\b(refuse|log)\(")
CPP_PART = re.compile(r'"((?:\\.|[^"\\])*)"')


def cpp_messages(name, code):
    """Yields the messages of a file of C++."""
    for call in CPP_CALL.finditer(code):
        depth, end, in_text = 1, call.end(), False
        while depth and end < len(code):
            letter = code[end]
            if letter == '"' and code[end - 1] != "\\":
                in_text = not in_text
            depth += 0 if in_text else {"(": 1, ")": -1}.get(letter, 0)
            end += 1
        inside = code[call.end() : end - 1]
        # Calls inside have texts of their own, such as formats.
        text, at = "", 0
        for part in CPP_PART.finditer(inside):
            value = inside[at : part.start()].strip(" +\n")
            text += ("{}" if value else "") + part[1].replace('\\"', '"')
            at = part.end()
        if text:
            text += "{}" if inside[at:].strip(" +\n)") else ""
            yield Message(name, code.count("\n", 0, call.start()) + 1, text, call[1] == "refuse")


READERS = {".rs": rust_messages, ".py": python_messages, ".cpp": cpp_messages, ".h": cpp_messages}


TEST_MODULE = re.compile(
    r'#\[cfg\((?:any\()?test\b[^\]]*\]\n(?:#\[path = "([^"]+)"\]\n)?(?:pub(?:\([a-z]+\))? )?mod (\w+);'
)


def test_modules(path, code):
    """Files that a file of Rust names as modules for tests alone."""
    for found in TEST_MODULE.finditer(code):
        yield path.parent / (found[1] or f"{found[2]}.rs")
        yield path.parent / path.stem / f"{found[2]}.rs"


def sources(root=ROOT):
    """Files that messages come from."""
    found = []
    for folder, ending in SOURCES:
        paths = (root / folder).rglob(f"*{ending}")
        found += [
            path
            for path in sorted(paths)
            if not NO_SOURCES.search("/" + path.relative_to(root).as_posix())
            and not NO_MESSAGES.search(path.relative_to(root).as_posix())
        ]
    tests = {test for path in found if path.suffix == ".rs" for test in test_modules(path, path.read_text("utf-8"))}
    return [path for path in found if path not in tests]


def messages(path, root=ROOT):
    """The messages of one file."""
    name = path.relative_to(root).as_posix()
    return [one for one in READERS[path.suffix](name, path.read_text("utf-8")) if one.whole or is_prose(one.text)]


VALUE = re.compile(r"\{[^{}]*\}")


def is_prose(text):
    """Whether a text that is no whole message has a thought: three words in a row."""
    plain = VALUE.sub("0", text.replace("{{", "").replace("}}", ""))
    return bool(re.search(r"[a-z]+'?[a-z]*,? [a-z]+,? [a-z]+|\w; [a-z]{2,} ", plain)) and not re.search(
        r"[<>{}\\_]{2}|\n", plain
    )


if __name__ == "__main__":
    for path in [Path(name).resolve() for name in sys.argv[1:]] or sources():
        for one in messages(path):
            kind = "a part" if not one.whole else "of a file" if one.of_file else "a message"
            print(f"{one.file}:{one.line}: {kind}: {one.text}")
