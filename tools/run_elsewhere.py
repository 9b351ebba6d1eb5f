"""Runs the tests on another system, emulated: run_elsewhere.py windows (under Wine) | arm64 (under qemu) [STEP...]

Each test must do what it does here, or be named with a reason in tests/elsewhere.toml, at most 20 of a system. The last
line counts tests over all steps; an excused test counts as skipped. Steps (Rust, C, Python, Blender) can be chosen.
"""

import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
import tomllib
from collections import Counter
from pathlib import Path
from xml.etree import ElementTree

import platforms
from testing.graph import show
from testing.outcome import Tally
from unpack_wheel import unpack

ROOT = platforms.ROOT
# Excused tests of a system.
MOST = 20
# Begins the reason of an excuse that is not needed in each run.
AT_TIMES = "at times: "
# The core. What remains of the workspace are the C library and the wheel, which are tested from outside.
CORE = ["--workspace", "--exclude=surfrecon-tests", "--exclude=surfrecon-capi", "--exclude=surfrecon-python"]
EXAMPLES = ROOT / "c-api" / "examples"


def main():
    """Runs all steps of a system."""
    systems = {"windows": windows, "arm64": arm64}
    if len(sys.argv) < 2 or sys.argv[1] not in systems or not {*sys.argv[2:]} <= {"Rust", "C", "Python", "Blender"}:
        sys.exit(__doc__)
    os.environ.setdefault("CARGO_INCREMENTAL", "0")
    os.environ.setdefault("PROPTEST_RNG_SEED", "1")
    run = Run(sys.argv[1], sys.argv[2:])
    systems[run.system](run)
    return run.ended()


class Run:
    """The steps of a system, compared as they come, and what came of them."""

    def __init__(self, system, chosen):
        self.system, self.chosen = system, chosen
        self.excused = tomllib.loads((ROOT / "tests" / "elsewhere.toml").read_text()).get(system, {})
        self.unused = {one for one in self.excused if self.takes(one.partition(":")[0])}
        self.tally = Tally()
        self.rows = []

    def takes(self, title):
        """Whether a step is run."""
        return not self.chosen or title in self.chosen

    def step(self, title, here, there):
        """Runs a step there and here."""
        if not self.takes(title):
            return
        show(f"\n== {title}, there")
        started = time.process_time() + cpu_of_children()
        found = there()
        minutes = (time.process_time() + cpu_of_children() - started) / 60
        show(f"\n== {title}, here")
        compared = Compared(title, here(), found, self.excused)
        self.unused -= compared.excused
        self.unused -= {one for one in compared.known if self.excused.get(one, "").startswith(AT_TIMES)}
        show(f"\n== {title}: {compared}")
        for line in compared.lines:
            show(line)
        self.tally.add(compared.tally())
        row = {"case": f"tests: {title}", "platform": self.system, "minutes_cpu": minutes, **compared.row()}
        self.rows.append(row)

    def ended(self):
        """Says what came of it, and leaves the rows for the benchmark; the exit status."""
        for name in sorted(self.unused):
            show(f"FAILED: {name} is excused in tests/elsewhere.toml, but does as here, or is gone")
        if len(self.excused) > MOST:
            show(f"FAILED: {len(self.excused)} tests are excused: at most {MOST} may be")
        self.tally.add(Tally(failed=len(self.unused) + int(len(self.excused) > MOST)))
        if not self.chosen:
            out = ROOT / "out" / "elsewhere"
            out.mkdir(parents=True, exist_ok=True)
            left = {"commit": platforms.commit(), "rows": self.rows}
            (out / f"{self.system}.json").write_text(json.dumps(left, indent=1) + "\n")
        show(f"\ntotal: {self.tally}")
        return int(self.tally.failed > 0)


class Compared:
    """The outcomes of tests here and there, each a map from a test's name to passed, failed or skipped."""

    def __init__(self, title, here, there, excused):
        self.counts = Counter()
        self.lines, self.excused, self.known = [], set(), set()
        for name in sorted({**here, **there}):
            self.known |= {f"{title}: {name}", f"{title}: {name}".partition("[")[0]}
            # Tests that a system does not have are not compared: those of its own, and those skipped here as well.
            expected, found = here.get(name), there.get(name, "missing")
            # A module that is skipped as a whole is a name of its own; its tests are missing there.
            if found in ("passed", expected) or (found == "skipped" and expected is None):
                self.counts[found] += 1
                continue
            full = f"{title}: {name}"
            # Named with its parameters, or without for all of them.
            excuse = next((one for one in (full, full.partition("[")[0]) if one in excused), None)
            if excuse:
                self.excused.add(excuse)
                self.counts["excused"] += 1
                self.lines.append(f"EXCUSED {full}: {excused[excuse]}")
            else:
                self.counts["failed"] += 1
                self.lines.append(f"FAILED: {full}: {found} there, {expected or 'missing'} here")
        if not there:
            self.counts["failed"] += 1
            self.lines.append(f"FAILED: {title}: no test ran")

    def __str__(self):
        return ", ".join(f"{number} {what}" for what, number in sorted(self.counts.items()))

    def tally(self):
        """Counts as of any other run."""
        return Tally(self.counts["passed"], self.counts["failed"], self.counts["skipped"] + self.counts["excused"])

    def row(self):
        """Counts for the benchmark's table."""
        failed, excused = self.counts["failed"], self.counts["excused"]
        return {"tests_passed": self.counts["passed"], "tests_failed": failed, "excused": excused, "ok": failed == 0}


def cpu_of_children():
    """Seconds of computing of the programs that were called."""
    used = os.times()
    return used.children_user + used.children_system


class RustOutcomes:
    """The outcomes of tests as `cargo test` says them, or the tests of `cargo test -- --list`."""

    def __init__(self):
        self.binary, self.found, self.test = "", {}, ""

    def line(self, line):
        """Takes the next line."""
        running = re.search(r"Running .*\((?:.*[/\\])?([\w-]+)-[0-9a-f]{16}(?:\.exe)?\)", line)
        if running:
            self.binary = running[1]
        outcome = re.match(r"test (.*?)(?: - should panic)? \.\.\. (ok|FAILED|ignored)", line)
        listed = re.fullmatch(r"(.*): test", line)
        words = {"ok": "passed", "FAILED": "failed", "ignored": "skipped"}
        if outcome:
            self.found[f"{self.binary} {outcome[1]}"] = words[outcome[2]]
        elif listed:
            self.found[f"{self.binary} {listed[1]}"] = "passed"
        elif line.startswith("---- "):
            self.test = f"{self.binary} {line.split()[1]}"
        elif line.startswith("SKIPPED") and self.found.get(self.test) == "passed":
            self.found[self.test] = "skipped"
        if not outcome and not listed and not line.startswith("successes:"):
            return
        if outcome and outcome[2] == "FAILED":
            show(line)


def log_file():
    """The file for a step's whole output."""
    folder = ROOT / "target"
    folder.mkdir(exist_ok=True)
    return folder / f"elsewhere-{sys.argv[1]}.log"


def rust(env, options):
    """Outcomes of the core's tests."""
    outcomes = RustOutcomes()
    command = ["cargo", "test", *CORE, "--lib", "--tests", "--no-fail-fast", *options]
    log = log_file()
    process = subprocess.Popen(
        command, cwd=ROOT, env=env, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace"
    )
    with log.open("w") as file:
        for line in process.stdout:
            file.write(line)
            outcomes.line(line.rstrip("\n"))
    process.wait()
    if not outcomes.found:
        show(log.read_text()[-4000:])
    return outcomes.found


def pytest(command, env, folder):
    """Outcomes of a folder of Python tests by a Python's command."""
    with tempfile.NamedTemporaryFile(suffix=".xml", delete=False, dir=ROOT / "target") as report:
        pass
    try:
        options = ["-q", "-p", "no:cacheprovider", f"--junitxml={Path(report.name).relative_to(ROOT).as_posix()}"]
        log = log_file()
        with log.open("w") as file:
            process = subprocess.run(
                [*command, "-m", "pytest", *options, folder],
                cwd=ROOT,
                env=env,
                stdout=file,
                stderr=subprocess.STDOUT,
                stdin=subprocess.DEVNULL,
                check=False,
            )
        text = Path(report.name).read_text()
    finally:
        Path(report.name).unlink()
    if process.returncode != 0:
        show("\n".join(log.read_text(errors="replace").splitlines()[-60:]))
    if not text:
        return {}
    outcomes = {}
    for case in ElementTree.fromstring(text).iter("testcase"):
        words = {child.tag for child in case}
        outcome = "failed" if words & {"failure", "error"} else "skipped" if "skipped" in words else "passed"
        file = case.get("classname", "").split(".")[-1]
        outcomes[f"{file}::{case.get('name')}"] = outcome
    return outcomes


def environment(triple):
    """The environment while something is built for a system."""
    script = 'environment=$(tools/cross.sh "$1") && eval "$environment" && env -0'
    printed = prepared("bash", "-c", script, "bash", triple)
    return dict(line.split("=", 1) for line in printed.split("\0") if "=" in line)


def prepared(*command):
    """The path that a script prepares and prints. It says itself what is missing."""
    made = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, text=True, check=False)
    return made.stdout.strip() if made.returncode == 0 else sys.exit(1)


def wheel_files(platform):
    """The files of a platform's wheel, built if there is none of today's sources."""
    subprocess.run(["tools/build_wheel.sh", platform], cwd=ROOT, check=True, stdout=subprocess.DEVNULL)
    return unpack(platform, ROOT / "target" / f"wheel-files-{platform}")


def wheel_files_here():
    """The files of this system's wheel, built likewise."""
    subprocess.run(["tools/build_wheel.sh"], cwd=ROOT, check=True, stdout=subprocess.DEVNULL)
    return unpack()


def python_here(folder, name, env):
    """Outcomes of Python tests on this system."""
    return pytest([f"{prepared('tools/venv.sh', name)}/bin/python"], {**os.environ, **env}, folder)


def python_there(wine, python, folder, env):
    """Outcomes of Python tests under Wine."""
    return pytest([wine, f"{python}/python.exe"], {**os.environ, **env}, folder)


def windows(run):
    """Under Wine: the core, programs in C, Python, Blender."""
    wine = str(ROOT / "tools" / "wine.sh")
    prepared(wine, "--prepare")
    cross = environment("x86_64-pc-windows-gnu")
    cross |= {
        "CARGO_UNSTABLE_BUILD_STD": "std,panic_unwind,test",
        "CARGO_TARGET_X86_64_PC_WINDOWS_GNU_RUNNER": wine,
    }
    target = ["--target", "x86_64-pc-windows-gnu"]
    run.step(
        "Rust",
        lambda: rust(os.environ, ["--", "--list"]),
        lambda: rust(cross, [*target, "--", "--show-output"]),
    )
    run.step("C", lambda: dict.fromkeys(c_programs(), "passed"), lambda: c_examples(wine))

    python = prepared("tools/windows_python.sh", "python")
    files = wheel_files("windows-x64")
    here = wheel_files_here()
    run.step(
        "Python",
        lambda: python_here("tests/python", "python", {"PYTHONPATH": str(here)}),
        lambda: pytest(
            [wine, f"{python}/python.exe"], {**os.environ, "PYTHONPATH": windows_path(files)}, "tests/python"
        ),
    )

    blender = prepared("tools/windows_python.sh", "blender-4.5")
    build = [sys.executable, "tools/build_extension.py", platforms.here().name, "windows-x64"]
    subprocess.run(build, cwd=ROOT, check=True, stdout=subprocess.DEVNULL)
    zipped = next((ROOT / "out" / "extension").glob("surfrecon-*-windows-x64.zip"))
    run.step(
        "Blender",
        lambda: python_here("tests/blender", "blender-4.5", {}),
        lambda: python_there(wine, blender, "tests/blender", {"EXTENSION_ZIP": windows_path(zipped)}),
    )


def windows_path(path):
    """A path of this system as Windows' programs see it."""
    return "Z:" + str(path).replace("/", "\\")


def c_programs():
    """The examples in C and C++."""
    return sorted(path.stem for path in EXAMPLES.glob("*/*.c*") if path.suffix in (".c", ".cpp"))


def c_examples(wine):
    """Outcomes of the examples in C and C++: compiled against the installed library, and run."""
    folder = ROOT / "target" / "c-windows"
    shutil.rmtree(folder, ignore_errors=True)
    env = {**environment("x86_64-pc-windows-gnu"), "SURFRECON_TARGET": "x86_64-pc-windows-gnu", "DESTDIR": str(folder)}
    subprocess.run(["tools/install_c.sh", "/usr"], cwd=ROOT, env=env, check=True)
    outcomes = {}
    for source in sorted(EXAMPLES.glob("*/*.c*")):
        if source.suffix not in (".c", ".cpp"):
            continue
        # Debian's other compiler of C++ for Windows has no threads.
        compiler = "x86_64-w64-mingw32-gcc" if source.suffix == ".c" else "x86_64-w64-mingw32-g++-posix"
        standard = "-std=c99" if source.suffix == ".c" else "-std=c++17"
        program = folder / "usr" / "bin" / f"{source.stem}.exe"
        flags = [
            f"-I{folder}/usr/include",
            str(source),
            f"-L{folder}/usr/lib",
            "-lsurfrecon",
            "-static-libgcc",
            "-static-libstdc++",
            "-lws2_32",
            *("-Wl,-Bstatic", "-lwinpthread", "-Wl,-Bdynamic"),
        ]
        made = subprocess.run([compiler, standard, "-o", str(program), *flags], cwd=ROOT, check=False)
        ran = made.returncode == 0 and example_runs(wine, program)
        outcomes[source.stem] = "passed" if ran else "failed"
    return outcomes


def example_runs(wine, program):
    """Whether an example does its work on a scan of ours: it reads one, or says how to use it."""
    arguments = {"list_scans": ["rust-core/fuzz/seeds/import_scan/points.laz"]}.get(program.stem, [])
    done = subprocess.run(
        [wine, windows_path(program), *arguments],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        check=False,
    )
    text = done.stdout.decode(errors="replace")
    said = {"list_scans": "points: 8 points, at ", "live_tolerance": ""}.get(program.stem, "usage: ")
    if said not in text or (program.stem in ("list_scans", "live_tolerance") and done.returncode != 0):
        show(f"{program.name} printed: {text}")
        return False
    return True


def arm64(run):
    """Under qemu: Python."""
    python = prepared("tools/arm64_python.sh", "python")
    files = wheel_files("linux-arm64")
    here = wheel_files_here()
    run.step(
        "Python",
        lambda: python_here("tests/python", "python", {"PYTHONPATH": str(here)}),
        lambda: pytest([python], {**os.environ, "PYTHONPATH": str(files)}, "tests/python"),
    )


if __name__ == "__main__":
    sys.exit(main())
