"""Prints what CHANGELOG.md says of a version: python tools/changelog_section.py VERSION [--release]

With --release the version, given as it is or as its tag (v0.2.0), must be the one that this tree has. Links to files
lead to the repository as it was at the version's tag, since a release's page lies elsewhere.
"""

import argparse
import re
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
REPOSITORY = "https://github.com/surfrecon/surfrecon"


def section(changelog, version):
    """The lines below the heading of a version, up to the next one; None without such a heading."""
    heading = rf"^## \[?{re.escape(version)}\]?(?: [^\n]*)?$"
    found = re.search(heading + r"\n(.*?)(?=^## |\Z)", changelog, re.M | re.S)
    return found and found[1].strip()


def led(text, version):
    """A text whose links to files of the tree lead to the repository."""
    return re.sub(r"(\]\()(?![a-z]+:|#)", rf"\1{REPOSITORY}/blob/v{version}/", text)


def main():
    """Prints it, or says why there is none."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("version")
    parser.add_argument("--release", action="store_true")
    options = parser.parse_args()
    version = options.version.removeprefix("v")
    own = tomllib.loads((ROOT / "Cargo.toml").read_text())["workspace"]["package"]["version"]
    if options.release and version != own:
        sys.exit(f"{options.version} is not the version of this tree: Cargo.toml has {own}")
    changelog = (ROOT / "CHANGELOG.md").read_text()
    if options.release and re.search(rf"^## \[?{re.escape(version)}\b.*unreleased", changelog, re.M | re.I):
        sys.exit(f"CHANGELOG.md calls {version} unreleased: take *(unreleased)* out of its heading")
    text = section(changelog, version)
    if not text:
        sys.exit(f"CHANGELOG.md says nothing of {version}: it needs a heading `## {version}` with text below it")
    print(led(text, version))


if __name__ == "__main__":
    main()
