"""Compiles the workspace once, and lists its test programs.

One call of cargo builds all libraries, programs, tests and examples, so that each crate is compiled once, with one
set of features. The libraries for C, Python and MeshLab are those of that call.
"""

import json
import os
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path

from testing.outputs import Output

ROOT = Path(__file__).resolve().parents[2]
BUILD = ["cargo", "build", "--workspace", "--lib", "--bins", "--tests", "--examples"]
# Tests whose path has this word belong to the second tier.
THOROUGH = "thorough"
# The programs whose tests take longest begin first.
LONGEST = [
    "surfrecon_merge",
    "surfrecon_reconstruct",
    "c_library",
    "surfrecon_io",
    "surfrecon_align",
    "surfrecon_sculpt",
]


def target():
    """The folder that cargo builds into."""
    return Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")).resolve()


def libraries():
    """The folder of the built libraries."""
    return target() / "debug"


@dataclass
class Program:
    """A test program: its name, and the folder of its crate, in which it runs."""

    name: str
    folder: Path
    file: Path | None = None


@dataclass
class Built(Output):
    """Reads what cargo builds; knows each test program and its file afterwards."""

    programs: dict = field(default_factory=dict)

    def __post_init__(self):
        super().__init__()

    def line(self, line):
        """Takes the next line."""
        if not line.startswith("{"):
            super().line(line)
            return
        message = json.loads(line)
        if message.get("executable") and message.get("profile", {}).get("test"):
            self.programs[message["target"]["name"]].file = Path(message["executable"])


def programs():
    """The test programs of the workspace, those that take longest first."""
    command = ["cargo", "metadata", "--format-version=1", "--no-deps", "--offline"]
    listed = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, text=True, check=False)
    if listed.returncode != 0:
        # Without a registry at hand yet: the list needs none, but cargo looks for one.
        listed = subprocess.run(command[:-1], cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True)
    found = {}
    for package in json.loads(listed.stdout)["packages"]:
        for one in package["targets"]:
            if one["test"] and not {"example", "bench"} & set(one["kind"]):
                if one["name"] in found:
                    sys.exit(f"two test programs are called {one['name']}")
                found[one["name"]] = Program(one["name"], Path(package["manifest_path"]).parent)
    longest = [name for name in LONGEST if name in found]
    return {name: found[name] for name in [*longest, *sorted(set(found) - set(longest))]}


def command(program, thorough):
    """The call that runs the tests of a program that are due: as JSON, with the time of each."""
    if program.file is None:
        raise RuntimeError(f"cargo built no test program {program.name}")
    # The runner's JSON and times are unstable: the variable in `environment` allows them.
    options = ["-Z", "unstable-options", "--format", "json", "--report-time", "--show-output"]
    return [program.file, *options, *([] if thorough else ["--skip", THOROUGH])]


def environment(program):
    """The environment that cargo sets for a test program."""
    sysroot = subprocess.run(
        ["rustc", "--print", "sysroot"], stdout=subprocess.PIPE, text=True, check=True
    ).stdout.strip()
    return {
        "RUSTC_BOOTSTRAP": "1",
        "CARGO_MANIFEST_DIR": str(program.folder),
        "SURFRECON_BUILT": str(libraries()),
        "LD_LIBRARY_PATH": f"{libraries() / 'deps'}:{sysroot}/lib",
    }


def tests(program):
    """The names of all tests of a program. Those that are ignored are no tests: others run them in processes of
    their own.
    """
    command = [program.file, "--list", "--format", "terse"]

    def listed(*options):
        printed = subprocess.run(
            [*command, *options], cwd=program.folder, stdout=subprocess.PIPE, text=True, check=True
        )
        return {line.removesuffix(": test") for line in printed.stdout.splitlines() if line.endswith(": test")}

    return listed() - listed("--ignored")
