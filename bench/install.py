"""How this library gets to its users: building from source, the files of a release, the tests on other systems.

A row is a file, or a run of tests: `minutes_cpu` is what making it or running it took, `mb` its size. Building the C
library from nothing is measured here. The others take an hour: rows of `make release`, `make test-windows` and
`make test-arm64` are taken as these commands left them for this commit; with --all they are run first.
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

import measured
import table
from wanted import ALL

ROOT = Path(__file__).resolve().parent.parent
COLUMNS = ["case", "platform", "minutes_cpu", "mb", "tests_passed", "tests_failed", "excused", "ok"]
SHOWN = {name.replace("_", " "): name for name in COLUMNS}
# The most that the installed C library may take.
MINUTES_CPU, MB = 8.0, 8.0
# By file below out/: what makes it, and its platform where the rows don't say.
MADE = {
    "release.json": ("release.py", []),
    "elsewhere/windows.json": ("run_elsewhere.py", ["windows"]),
    "elsewhere/arm64.json": ("run_elsewhere.py", ["arm64"]),
}
NO_TESTS = {"tests_passed": None, "tests_failed": None, "excused": None}


def library(wanted):
    """Installs the C library from source with nothing built; in the smallest case from what is built."""
    with tempfile.TemporaryDirectory() as folder:
        # The program that measures starts commands elsewhere.
        settings = [f"DESTDIR={folder}", f"CARGO_TARGET_DIR={folder}/target"]
        if wanted.smallest:
            settings.append(f"SURFRECON_BUILT={wanted.programs}")
        figures, _ = measured.run(["env", *settings, ROOT / "tools" / "install_c.sh", "/usr"], timeout=5400)
        found = [path for path in Path(folder).glob("usr/lib/libsurfrecon*") if not path.is_symlink()]
        shared = [path for path in found if path.suffix != ".a"]
        return {"minutes_cpu": figures["cpu_s"] / 60, "mb": shared[0].stat().st_size / 1e6}


def head():
    """The commit that is checked out."""
    return subprocess.run(["git", "rev-parse", "HEAD"], cwd=ROOT, stdout=subprocess.PIPE, text=True).stdout.strip()


def rows_of(file, wanted):
    """Rows that another command left for this commit, after running it if all is asked for; else None."""
    path = ROOT / "out" / file
    if wanted.extent == ALL:
        script, arguments = MADE[file]
        subprocess.run([sys.executable, ROOT / "tools" / script, *arguments], cwd=ROOT, check=False)
    if not path.is_file():
        return None
    left = json.loads(path.read_text())
    return left["rows"] if left["commit"] == head() else None


def main(wanted, record):
    """Everything that is there, and what building takes."""
    case = "C library from source"
    if wanted.takes(case):
        row = {"case": case, "platform": "here", **NO_TESTS}
        try:
            row |= library(wanted)
            row["ok"] = wanted.smallest or (row["minutes_cpu"] <= MINUTES_CPU and row["mb"] <= MB)
        except measured.Failed as failed:
            row["failed"] = str(failed)
        record.put(row)
    if not wanted.smallest:
        for file, (script, arguments) in MADE.items():
            rows = rows_of(file, wanted)
            if rows is None:
                record.skip(f"{' '.join([script, *arguments])}: not run for this commit; --all runs it")
            for row in rows or []:
                if wanted.takes(row["case"]):
                    record.put({"mb": None, "ok": True, **NO_TESTS, **row})
    table.show([row for row in record.rows if "failed" not in row], SHOWN)
