"""The packages we use: licences, registries and versions as deny.toml allows them. Runs in the environment `lint`.

The file is cargo-deny's, which can be run on it by hand: it also looks for advisories, and takes minutes to compile.
"""

import json
import subprocess
import sys
import tomllib
from pathlib import Path

from license_expression import get_spdx_licensing

ROOT = Path(__file__).resolve().parent.parent
CRATES_IO = "registry+https://github.com/rust-lang/crates.io-index"
LICENSING = get_spdx_licensing()


def allows(expression, allowed):
    """Whether the allowed licences are enough for an expression of SPDX."""
    if expression.isliteral:
        return expression.render() in allowed
    enough = any if isinstance(expression, LICENSING.OR) else all
    return enough(allows(part, allowed) for part in expression.args)


def problems(package, rules):
    """The faults of a package, in words."""
    named = f"{package['name']} {package['version']}"
    licence = package["license"]
    exceptions = {rule["crate"]: rule["allow"] for rule in rules["licenses"].get("exceptions", ())}
    allowed = {*rules["licenses"]["allow"], *exceptions.get(package["name"], ())}
    if licence is None:
        yield f"{named} names no licence"
    elif not allows(LICENSING.parse(licence.replace("/", " OR "), validate=True), allowed):
        yield f"{named} has the licence {licence}, which deny.toml does not allow"
    if package["source"] not in {None, CRATES_IO}:
        yield f"{named} comes from {package['source']}, not from crates.io"
    if package["source"] is None:
        for dependency in package["dependencies"]:
            if dependency["req"] == "*" and dependency["path"] is None:
                yield f"{named} takes any version of {dependency['name']}"


def main():
    """Prints all problems; returns how many there are, at most 1."""
    rules = tomllib.loads((ROOT / "deny.toml").read_text())
    unknown = {"graph", "licenses", "bans", "sources"} ^ set(rules)
    command = ["cargo", "metadata", "--format-version=1", "--locked", "--all-features"]
    described = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    if described.returncode != 0:
        print(described.stderr)
        return 1
    packages = json.loads(described.stdout)["packages"]
    found = [problem for package in packages for problem in problems(package, rules)]
    found += [f"deny.toml: nobody here looks at {name}" for name in unknown]
    print("\n".join(found) or f"{len(packages)} packages")
    return int(bool(found))


if __name__ == "__main__":
    sys.exit(main())
