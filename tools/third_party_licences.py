"""Writes the licences of all that is linked into what we ship.

Usage: third_party_licences.py OUTFILE [--package NAME] [--target TRIPLE]

Crates that are linked, by cargo's own account: normal dependencies for that system, without what only runs in the
compiler. Rust's standard library is linked, too. Fails for a crate whose licence's text is nowhere to be found.
"""

import argparse
import html
import json
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
NAMED = re.compile(r"(un)?licen[cs]e|copying|copyright|notice", re.IGNORECASE)
# A licence whose text names nobody serves for every crate that has it.
WITHOUT_NAMES = {"Apache-2.0": "TERMS AND CONDITIONS FOR USE, REPRODUCTION, AND DISTRIBUTION"}
# A licence whose copies differ in the owner alone. A crate that forgot it names its authors, who are listed.
MIT = "Permission is hereby granted, free of charge, to any person obtaining a copy"
# Of the crates in the standard library those that are in it on Linux, Windows and macOS.
OF_RUST = ["addr2line", "adler2", "cfg-if", "foldhash", "gimli", "hashbrown", "libc", "memchr"]
OF_RUST += ["miniz_oxide", "object", "rustc-demangle"]


def output(*command):
    """The output of a program. Its complaints are for the user to see."""
    ran = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, text=True, check=False)
    if ran.returncode != 0:
        sys.exit(f"{' '.join(command)} failed")
    return ran.stdout


class Linked:
    """One thing that is linked: its name, version, licence, authors and texts."""

    def __init__(self, name, version, licence, authors, texts):
        self.name, self.version, self.licence = name, version, licence
        self.authors, self.texts = ", ".join(authors), texts

    def __str__(self):
        return f"{self.name} {self.version}"


def texts_in(folder):
    """The licence texts at the top of a crate."""
    files = sorted(file for file in folder.iterdir() if file.is_file() and NAMED.match(file.name))
    return [file.read_text(errors="replace") for file in files]


def crates(package, target, packages):
    """The crates that cargo links into a package of ours for a system, without our own."""
    tree = ["cargo", "tree", "--locked", "--edges=normal,no-proc-macro", "--prefix=none", "--format={p}"]
    named = output(*tree, "--package", package, "--target", target).splitlines()
    linked = {tuple(line.split()[:2]) for line in named}
    for found in packages:
        if found["source"] is not None and (found["name"], f"v{found['version']}") in linked:
            texts = texts_in(Path(found["manifest_path"]).parent)
            licence = (found["license"] or "").replace("/", " OR ")
            yield Linked(found["name"], found["version"], licence, found["authors"], texts)


def standard_library(packages):
    """Rust's standard library and the crates inside it, as its own account of them says where the toolchain has one."""
    release = re.search(r"^release: (.*)$", output("rustc", "-vV"), re.MULTILINE)[1]
    documents = Path(output("rustc", "--print", "sysroot").strip()) / "share" / "doc" / "rust"
    # That of its tables of characters; it is also with the crate that every procedural macro needs.
    unicode = sorted((documents / "licenses").glob("Unicode-*.txt")) or [
        Path(found["manifest_path"]).parent / "LICENSE-UNICODE"
        for found in packages
        if found["name"] == "unicode-ident"
    ]
    texts = [text.read_text() for text in unicode]
    owners = ["The Rust Project Developers"]
    yield Linked("Rust's standard library", release, "(MIT OR Apache-2.0) AND Unicode-3.0", owners, texts)
    account = documents / "COPYRIGHT-library.html"
    if not account.is_file():
        return
    for part in account.read_text().split("<h3>")[1:]:
        name, version = re.match(r"\W*(.*)-(\d+\.\d+\.[^<]*)</h3>", part).groups()
        if name in OF_RUST:
            licence = re.search(r"License:</b> (.*?)</p>", part)[1].replace("/", " OR ")
            authors = html.unescape(re.search(r"Authors:</b> (.*?)</p>", part)[1])
            texts = [html.unescape(text) for text in re.findall(r"<pre>(.*?)</pre>", part, re.DOTALL)]
            yield Linked(f"{name} (in Rust's standard library)", version, licence, [authors], texts)


def main():
    """Writes the file; its name is the first argument."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("outfile", type=Path)
    parser.add_argument("--package", default="surfrecon-capi", help="the package of ours that is linked")
    parser.add_argument("--target", help="the system it is linked for; else this one")
    options = parser.parse_args()
    target = options.target or re.search(r"^host: (.*)$", output("rustc", "-vV"), re.MULTILINE)[1]

    # Of the whole workspace, whose crates take more features of each other's dependencies than one of them alone.
    described = json.loads(output("cargo", "metadata", "--format-version=1", "--locked", "--filter-platform", target))
    packages = described["packages"]

    linked = [*crates(options.package, target, packages), *standard_library(packages)]
    linked.sort(key=lambda one: one.name.lower())
    unique = {}
    for one in linked:
        for text in one.texts:
            unique.setdefault(" ".join(text.split()), (text, []))[1].append(str(one))
    whole = {licence for licence, words in WITHOUT_NAMES.items() if any(words in text for text in unique)}
    if any(MIT in text for text in unique):
        whole.add("MIT")
    without = [one for one in linked if not one.texts and not whole & set(re.findall(r"[\w.-]+", one.licence))]
    if without:
        sys.exit("no licence text for " + ", ".join(f"{one} ({one.licence or 'no licence'})" for one in without))

    lines = [f"{options.package} for {target} contains what follows, each under its licence. The texts are below.", ""]
    for one in linked:
        by = f", by {one.authors}" if one.authors and not one.texts else ""
        lines.append(f"- {one}: {one.licence}{by}")
    for text, users in unique.values():
        lines += ["", "=" * 80, *sorted(set(users)), "-" * 80, text.strip("\r\n")]
    options.outfile.write_text("\n".join(lines) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
