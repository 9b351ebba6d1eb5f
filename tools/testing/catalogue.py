"""The tier of each test. A test that is in neither is an error, and so is one that should have run and did not.

The list is out/tests/tiers.json. Tests in Rust are those that the programs list; tests in Python those that the
source files declare, so that one is found even where no step looks.
"""

import ast
import json
import subprocess
from pathlib import Path

from testing import rust

ROOT = Path(__file__).resolve().parents[2]


def declared(file):
    """The tests that a file in Python declares: names of functions, with that of their class; and whether each is
    thorough.
    """
    tree = ast.parse(file.read_text())
    whole = any("thorough" in ast.unparse(node) for node in tree.body if assigns_marks(node))

    def functions(body, prefix, thorough):
        for node in body:
            marked = thorough or any("mark.thorough" in ast.unparse(one) for one in getattr(node, "decorator_list", []))
            if isinstance(node, ast.ClassDef) and node.name.startswith("Test"):
                yield from functions(node.body, f"{node.name}::", marked)
            elif isinstance(node, ast.FunctionDef) and node.name.startswith("test"):
                yield f"{prefix}{node.name}", marked

    return dict(functions(tree.body, "", whole))


def assigns_marks(node):
    """Whether a statement gives marks to a whole file."""
    return isinstance(node, ast.Assign) and any(getattr(one, "id", "") == "pytestmark" for one in node.targets)


def python_files():
    """The files of tests in Python, as git knows them."""
    command = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard", "tests"]
    listed = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, check=True).stdout.decode().split("\0")
    return sorted(ROOT / name for name in listed if Path(name).name.startswith("test_") and name.endswith(".py"))


def of_file(file, folders):
    """The tiers of a file: those of the steps that name it, or else its folder. `folders` has what each step
    names, with its tiers.
    """
    relative = file.relative_to(ROOT).as_posix()
    found = [(folder, tiers) for folder, tiers in folders if f"{relative}/".startswith(f"{folder}/")]
    closest = max((len(folder) for folder, _ in found), default=0)
    return {tier for folder, tiers in found if len(folder) == closest for tier in tiers}


def listed(programs, folders):
    """Rows (test, tiers): `programs` are Rust's, with None for one that was not built."""
    rows = []
    for program in programs.values():
        for name in sorted(rust.tests(program)) if program.file else []:
            rows.append((f"{program.name} {name}", {"all"} if rust.THOROUGH in name else {"first", "all"}))
    for file in python_files():
        tiers = of_file(file, folders)
        inner = file.relative_to(ROOT / "tests").as_posix()
        for name, thorough in declared(file).items():
            rows.append((f"{inner}::{name}", tiers - {"first"} if thorough else tiers))
    return rows


def problems(rows, tests, tier, absent=()):
    """Yields one sentence for each test of neither tier, and for each that belongs to this one and did not run.

    `absent` are folders of tests whose program can't be had on this machine: a step says so, and counts as skipped.
    """
    ran = {plain(test.name) for test in tests}
    # A module that is skipped as a whole says so under its own name.
    modules = {name for name in ran if "::" not in name and name.endswith(".py")}
    for name, tiers in rows:
        if not tiers:
            yield f"{name} runs in neither tier: no step of tools/testing/plan.py names its folder"
        elif any(f"tests/{name}".startswith(f"{folder}/") for folder in absent):
            continue
        elif tier in tiers and name not in ran and name.partition("::")[0] not in modules:
            yield f"{name} belongs to the tier {tier!r} and did not run"


def plain(name):
    """The name of a test without its step and its parameters."""
    name = name.partition(": ")[2] if ".py" in name else name
    return name.partition("[")[0] if ".py" in name else name


def write(rows, file):
    """Writes the list."""
    tiers = {name: sorted(tiers, reverse=True) for name, tiers in rows}
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(json.dumps(tiers, indent=0) + "\n")
