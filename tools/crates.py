#!/usr/bin/env python3
"""Puts each crate of the core on the lists that cargo and the core have of them: `make generate` begins with it.

What a list has already stays as it is and where it is. So the order of the work, and better words, are written by hand.
"""

import re
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
# Crates below `rust-core` that are no part of the workspace.
ALONE = {"fuzz"}


def crates(root):
    """The crates of the core, by their folders."""
    found = sorted(path.parent.name for path in (root / "rust-core").glob("*/Cargo.toml"))
    return [name for name in found if name not in ALONE]


def is_operation(root, name):
    """Whether a crate declares an operation by its own name."""
    path = root / "rust-core" / name / "src" / "operation.rs"
    return path.is_file() and "pub const OPERATION:" in path.read_text("utf-8")


def before(text, mark, line):
    """The text with a line before the first line that begins with `mark`."""
    place = re.search(rf"^{re.escape(mark)}", text, re.M)
    assert place, f"there is no line {mark}"
    return text[: place.start()] + line + text[place.start() :]


def workspace(root, text):
    """Cargo's list of crates, with their names and versions."""
    version = tomllib.loads(text)["workspace"]["package"]["version"]
    for name in crates(root):
        if f'"rust-core/{name}",' not in text:
            text = before(text, '    "c-api"', f'    "rust-core/{name}",\n')
        if f'path = "rust-core/{name}"' not in text:
            row = f'{name} = {{ package = "surfrecon-{name}", path = "rust-core/{name}", version = "{version}" }}\n'
            text = before(text, "surfrecon-allocator = ", row)
    return text


def roof(root, text):
    """The dependencies of the crate that users name."""
    for name in filter(lambda name: is_operation(root, name), crates(root)):
        if f"\n{name}.workspace = true" not in text:
            place = text.index("\n[dev-dependencies]")
            text = text[:place] + f"{name}.workspace = true\n" + text[place:]
    return text


def operations(root, text):
    """The table of operations. A new one comes last."""
    for name in filter(lambda name: is_operation(root, name), crates(root)):
        if f" {name}::OPERATION," not in text:
            text = before(text, "];", f"    {name}::OPERATION,\n")
    return text


def page(root, text):
    """The floors that crates stand on, and the map. A new crate stands as low as what it needs lets it."""
    lead, floors = re.search(r"^( floors, from the ground: )(.*)$", text, re.M).groups()
    rows = [floor.split(", ") for floor in floors.split(" / ")]
    for name in crates(root):
        manifest = tomllib.loads((root / "rust-core" / name / "Cargo.toml").read_text("utf-8"))
        if not any(name in row for row in rows):
            needs = manifest.get("dependencies", {})
            floor = 1 + max((k for k, row in enumerate(rows) if set(row) & set(needs)), default=0)
            if floor == len(rows) - 1:
                rows.insert(floor, [])
            rows[floor] = sorted([*rows[floor], name])
        if f"`rust-core/{name}/`" not in text:
            about = manifest["package"]["description"].removesuffix("; a part of surfrecon")
            about = about[:1].lower() + about[1:]
            text = before(text, "| `rust-core/` |", f"| `rust-core/{name}/` | {about} | files |\n")
    return text.replace(lead + floors, lead + " / ".join(", ".join(row) for row in rows))


LISTS = {
    "Cargo.toml": workspace,
    "rust-core/Cargo.toml": roof,
    "rust-core/src/operations.rs": operations,
    "ARCHITECTURE.md": page,
}


def complete(root):
    """Writes the lists that lack a crate, and gives their names."""
    written = []
    for name, with_all in LISTS.items():
        path = root / name
        text = path.read_text("utf-8")
        if (whole := with_all(root, text)) != text:
            path.write_text(whole, "utf-8")
            written.append(name)
    return written


if __name__ == "__main__":
    for name in complete(ROOT):
        print(name)
