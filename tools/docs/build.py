"""Builds the documentation site: `make docs` calls it. Usage: build.py [--rust DOCS] FOLDER

Composes the pages of `docs/site` and those made out of the code, lets Sphinx make HTML of them, and checks that links
lead somewhere. DOCS is the folder that `cargo doc` has filled; without it the pages of Rust are left out, and links to
them are not looked at. The package must be importable. Ends with status 1 if anything is missing or named wrongly.
"""

import argparse
import importlib
import os
import shutil
import subprocess
import sys
from pathlib import Path

import c_header
import cli_reference
import cpp_header
import links
import notebook
import parameters
import python_reference
from sections import ROOT, Composer, SiteError

SOURCES = ROOT / "docs" / "site"


def compose(folder):
    """Writes all sources for Sphinx into a folder that is made anew."""
    found = list(python_reference.problems())
    if found:
        raise SiteError("; ".join(found))
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    shutil.copy(SOURCES / "conf.py", folder)
    shutil.copytree(SOURCES / "static", folder / "static")
    Composer(SOURCES, folder).compose()
    pictures = folder / "pictures"
    for path in sorted((ROOT / "notebooks").glob("*.ipynb")):
        notebook.page(path, folder / "guide" / f"{path.stem}.md", pictures)
    notebook.run_marked(folder / "index.md", pictures)
    reference = folder / "reference"
    python_reference.write(reference / "python")
    cli_reference.write(reference / "command_line.rst")
    parameters.write(ROOT / "PARAMETERS.md", reference / "parameters.rst")
    known = c_header.write(ROOT, reference / "c")
    cpp_header.write(ROOT / "c-api" / "include" / "surfrecon.hpp", reference / "cpp.rst", known)


def build(sources, target, rust=None):
    """Makes the site; returns what is wrong with it."""
    shutil.rmtree(target, ignore_errors=True)
    environment = os.environ | {"SURFRECON_VERSION": importlib.import_module("surfrecon").__version__}
    # Warnings are errors: of a name, a link or a picture that is not there.
    command = [sys.executable, "-m", "sphinx", "--quiet", "--fail-on-warning", "--fresh-env", "--jobs", "auto"]
    doctrees = sources.parent / f"{sources.name}-doctrees"
    command += ["--builder", "html", "--doctree-dir", doctrees, sources, target]
    done = subprocess.run(command, env=environment, check=False)
    shutil.rmtree(doctrees, ignore_errors=True)
    if done.returncode != 0:
        return ["Sphinx could not make the site, see above"]
    if rust is not None:
        shutil.copytree(rust, target / "rust")
    return list(links.problems(target, without=() if rust else ("rust",)))


def main():
    """Composes and builds."""
    options = argparse.ArgumentParser()
    options.add_argument("--rust", type=Path)
    options.add_argument("folder", type=Path)
    given = options.parse_args()
    sources = given.folder.parent / f"{given.folder.name}-sources"
    try:
        compose(sources)
        found = build(sources, given.folder, given.rust)
    except SiteError as problem:
        found = [str(problem)]
    for problem in found:
        print(f"docs: {problem}", file=sys.stderr)
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
