"""Runs every check and test of the project and adds up their results; `make test` calls it.

Each step is a program whose own output is shown as it comes. The last line counts tests over all steps; a step that
fails without having counted a failed test counts as one. A Rust test that lacks its data prints a line starting with
`SKIPPED` and is counted as skipped, not as passed.
"""

import contextlib
import os
import re
import subprocess
import sys
import threading
import time
from pathlib import Path

from unpack_wheel import unpack

ROOT = Path(__file__).resolve().parent.parent
# The bpy module is known to hang at exit; no step may hang the whole run.
STEP_LIMIT = 30 * 60
# Versions of MeshLab whose pymeshlab is on the package index; the first must be tested.
MESHLAB = ["2022.02", "2023.12", "2025.07"]
# Versions of Blender as a Python module. That of 5.2 needs Python 3.13.
BLENDER = ["4.5", "4.2", "5.0", "5.2"]


class Tally:
    """Numbers of tests passed, failed and skipped."""

    def __init__(self, passed=0, failed=0, skipped=0):
        self.passed, self.failed, self.skipped = passed, failed, skipped

    def add(self, other):
        """Adds another tally to this one."""
        self.passed += other.passed
        self.failed += other.failed
        self.skipped += other.skipped

    def __str__(self):
        return f"{self.passed} passed, {self.failed} failed, {self.skipped} skipped"


def show(line):
    """Prints at once, so that output of steps and our own stay in order."""
    print(line, flush=True)


class RustOutput:
    """Counts what `cargo test -- --show-output` prints; of the output of passing tests it shows only skips."""

    def __init__(self):
        self.tally = Tally()
        self.among_successes = False
        self.test = ""
        self.skip_counted = False

    def line(self, line):
        """Takes the next line."""
        if line == "successes:":
            self.among_successes = True
        elif line == "failures:" or line.startswith("test result:"):
            self.among_successes = False
        if line.startswith("---- "):
            self.test = line.split()[1]
            self.skip_counted = False
        skips = line.startswith("SKIPPED")
        if skips and not self.skip_counted:
            self.tally.add(Tally(passed=-1, skipped=1))
            self.skip_counted = True
        result = re.match(r"test result: \w+\. (\d+) passed; (\d+) failed; (\d+) ignored", line)
        if result:
            self.tally.add(Tally(*map(int, result.groups())))
        if skips:
            show(f"{line} ({self.test})")
        elif not self.among_successes:
            show(line)


class PytestOutput:
    """Counts what pytest's closing line says."""

    WORDS = {"passed": "passed", "failed": "failed", "error": "failed", "errors": "failed", "skipped": "skipped"}

    def __init__(self):
        self.tally = Tally()

    def line(self, line):
        """Takes the next line."""
        show(line)
        if re.search(r" in [\d.]+s\b", line):
            for number, word in re.findall(r"(\d+) (\w+)", line):
                if word in self.WORDS:
                    self.tally.add(Tally(**{self.WORDS[word]: int(number)}))


class CheckOutput:
    """Counts the `ok: ...` and `FAILED: ...` lines of our scripts."""

    def __init__(self):
        self.tally = Tally()

    def line(self, line):
        """Takes the next line."""
        show(line)
        self.tally.add(Tally(passed=int(line.startswith("ok: ")), failed=int(line.startswith("FAILED: "))))


class PlainOutput:
    """For steps that prepare something: there is nothing to count unless they fail."""

    def __init__(self):
        self.tally = Tally()

    def line(self, line):
        """Takes the next line."""
        show(line)


def run(title, command, output, env=None, unavailable=None):
    """Runs one step and returns its tally. Ending with status `unavailable` it counts as skipped."""
    show(f"\n== {title}")
    started = time.monotonic()
    process = subprocess.Popen(
        command,
        cwd=ROOT,
        env={**os.environ, **(env or {})},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        errors="replace",
        start_new_session=True,
    )
    killer = threading.Timer(STEP_LIMIT, lambda: os.killpg(process.pid, 9))
    killer.start()
    for line in process.stdout:
        output.line(line.rstrip("\n"))
    code = process.wait()
    killer.cancel()
    if code != 0 and code == unavailable:
        show(f"SKIPPED {title}: see above")
        output.tally.add(Tally(skipped=1))
    elif code != 0 and output.tally.failed == 0:
        show(f"{title}: ended with status {code}")
        output.tally.add(Tally(failed=1))
    show(f"== {title}: {output.tally} ({time.monotonic() - started:.0f} s)")
    return output.tally


class NoPython(Exception):
    """The version of Python that an environment needs is not at hand."""


def environment(name):
    """The Python of a prepared environment, see tools/venv.sh."""
    made = subprocess.run([ROOT / "tools" / "venv.sh", name], stdout=subprocess.PIPE, text=True, check=False)
    if made.returncode == 3:
        raise NoPython(name)
    return f"{made.stdout.strip()}/bin/python" if made.returncode == 0 else None


def prepare(names):
    """Makes the environments ahead of their use."""
    for name in names:
        with contextlib.suppress(NoPython):
            environment(name)


def pytest(title, environment_name, folder, env=None, options=()):
    """Runs a folder of Python tests in an environment."""
    try:
        python = environment(environment_name)
    except NoPython:
        show(f"\nSKIPPED {title}: the Python they need is not at hand, see above")
        return Tally(skipped=1)
    if python is None:
        show(f"\n== {title}: its Python environment could not be prepared")
        return Tally(failed=1)
    command = [python, "-m", "pytest", "-rs", "-p", "no:cacheprovider", *options, folder]
    return run(title, command, PytestOutput(), env)


def meshlab_plugin(build):
    """Builds the MeshLab plugin for a version and precision; returns the tally and the folder, if it could be built."""
    # Tests take the library that the Rust tests built.
    env = {"SURFRECON_PROFILE": "dev"}
    tally = run(f"MeshLab plugin {build}", ["tools/build_meshlab_plugin.sh", build], PlainOutput(), env, unavailable=3)
    return tally, None if tally.failed or tally.skipped else str(ROOT / "out" / "meshlab-plugin" / build)


def meshlab_tests(wheel_files):
    """Tests the MeshLab plugin in each version."""
    library = str(ROOT / "target" / "debug" / "libsurfrecon.so")
    total, desktop = meshlab_plugin("2020.09-float")
    for version in MESHLAB:
        tally, plugins = meshlab_plugin(f"{version}-double")
        total.add(tally)
        if plugins:
            env = {"PYTHONPATH": wheel_files, "SURFRECON_PLUGINS": plugins, "SURFRECON_LIBRARY": library}
            # The programs of the system are the same whatever pymeshlab drives the tests: once is enough.
            if desktop and version == MESHLAB[0]:
                env["SURFRECON_PLUGINS_DESKTOP"] = desktop
            ignored = (
                []
                if version == MESHLAB[0]
                else ["--ignore=tests/meshlab/test_server.py", "--ignore=tests/meshlab/test_gui.py"]
            )
            total.add(pytest(f"MeshLab {version} tests", f"meshlab-{version}", "tests/meshlab", env, ignored))
        elif version == MESHLAB[0]:
            show(f"FAILED: the plugin must be tested in MeshLab {version}")
            total.add(Tally(failed=1))
    return total


def validator():
    """Where the Khronos validator of glTF is, for the test that asks it; nowhere without node."""
    made = subprocess.run([ROOT / "tools" / "gltf_validator.sh"], stdout=subprocess.PIPE, text=True, check=False)
    folder = made.stdout.strip()
    return {"SURFRECON_GLTF_VALIDATOR": folder} if folder else {}


def main():
    """Runs all steps."""
    # Nothing is compiled twice here: bookkeeping for that would cost a third of the time and most of the disk.
    os.environ.setdefault("CARGO_INCREMENTAL", "0")
    # The same random inputs each time: new ones are for `make explore`, where what is found is kept.
    os.environ.setdefault("PROPTEST_RNG_SEED", "1")

    # Downloads and compiling don't compete: the environments are made while the compiler runs.
    names = [
        "lint",
        "build",
        "python",
        "distributed",
        "docs",
        "bench",
        *(f"blender-{v}" for v in BLENDER),
        *(f"meshlab-{v}" for v in MESHLAB),
    ]
    threading.Thread(target=prepare, args=(names,), daemon=True).start()

    total = Tally()
    total.add(run("checks", ["tools/check.sh"], CheckOutput()))
    rust = ["cargo", "test", "--workspace", "--no-fail-fast", "--", "--show-output"]
    total.add(run("Rust tests", rust, RustOutput(), validator()))

    bare = ["cargo", "test", "--package", "surfrecon-io", "--no-default-features", "--test", "without_las"]
    total.add(run("Rust tests without features", bare, RustOutput()))

    total.add(run("C library installed", ["tests/c/installed.sh"], CheckOutput()))

    wheel = run("wheel", ["tools/build_wheel.sh"], PlainOutput())
    total.add(wheel)
    if wheel.failed == 0:
        files = str(unpack())
        library = {"SURFRECON_LIBRARY": str(ROOT / "target" / "debug" / "libsurfrecon.so")}
        # Programs of others that read what we write are those of the benchmarks.
        python = environment("bench")
        peers = {"SURFRECON_PEERS": python} if python else {}
        total.add(pytest("Python tests", "python", "tests/python", {"PYTHONPATH": files} | library | peers))
        total.add(pytest("merges on a cluster", "distributed", "tests/distributed", {"PYTHONPATH": files}))
        total.add(pytest("site and examples", "docs", "tests/docs", {"PYTHONPATH": files} | library))
        extension = run("Blender extension", [sys.executable, "tools/build_extension.py"], PlainOutput())
        total.add(extension)
        if extension.failed == 0:
            for version in BLENDER:
                total.add(pytest(f"Blender {version} tests", f"blender-{version}", "tests/blender"))

        total.add(meshlab_tests(files))
        # Last: what they measure is what the steps before have built.
        programs = {"PYTHONPATH": files, "SURFRECON_PROGRAMS": str(ROOT / "target" / "debug")}
        total.add(pytest("benchmarks on their smallest cases", "python", "tests/bench", programs | peers))

    if "SURFRECON_DATA" not in os.environ:
        show("\nSURFRECON_DATA is not set: the tests on real scans were skipped, see CONTRIBUTING.md.")
    show(f"\ntotal: {total}")
    return 0 if total.failed == 0 else 1


if __name__ == "__main__":
    sys.exit(main())
