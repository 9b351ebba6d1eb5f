"""Runs the benchmarks: run.py [NAME] [OPTION...]. Called by run.sh, which builds and installs first.

A benchmark is a module beside this one with `COLUMNS`, which all its rows have, and `main(wanted, record)`, which
prints its tables and puts its rows into the record: out/bench/NAME.json.
"""

import argparse
import importlib
import math
import os
import platform
import sys
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from record import BUDGET_CPU_S, ONCE_CPU_S, Record
from wanted import ALL, HEAVY, SMALLEST, USUAL, Wanted

BENCHMARKS = [
    "align",
    "merge",
    "scale",
    "noise",
    "colour",
    "delaunay",
    "scattered",
    "sculpt",
    "quads",
    "cluster",
    "close",
    "capi",
    "io",
    "blender",
    "meshlab",
    "limits",
    "install",
]
# A module named io would be Python's own.
MODULES = {"io": "files"}
ROOT = Path(__file__).resolve().parent.parent
PEERS = [
    "pymeshlab",
    "pymeshfix",
    "open3d",
    "trimesh",
    "meshio",
    "laspy",
    "pye57",
    "gmsh",
    "kiss-matcher",
    "kiss-icp",
    "small_gicp",
    "pydelatin",
    "pymartini",
    "numpy",
    "scipy",
]
# As other programs here say that what they need is not at hand.
UNAVAILABLE = 3


def installed(name):
    """The version of a package; None without it: benchmarks say which peers they lack."""
    try:
        return version(name)
    except PackageNotFoundError:
        return None


def machine():
    """The machine that the figures were taken on."""
    cpu = platform.processor()
    if Path("/proc/cpuinfo").is_file():
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        cpu = next((line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")), cpu)
    return {
        "cpu": cpu,
        "cores": os.cpu_count(),
        "load_at_start": os.getloadavg()[0],
        "system": platform.platform(),
        "versions": {name: installed(name) for name in PEERS} | {"python": platform.python_version()},
    }


def options():
    """The options of the command line."""
    left_out = "\n".join(f"  {name + ':':11}{', '.join(patterns)}" for name, patterns in HEAVY.items())
    parser = argparse.ArgumentParser(
        description="This library beside its peers on the same data; at most ten minutes of CPU time each.",
        formatter_class=argparse.RawDescriptionHelpFormatter,
        epilog=f"A tool whose run takes more than {ONCE_CPU_S} s of CPU time is run once.\n"
        f"Without --all nothing is begun after {BUDGET_CPU_S} s of CPU time (twice that of align), and left out are,\n"
        "as case and tool:\n" + left_out,
    )
    parser.add_argument("name", nargs="?", choices=BENCHMARKS, help="one benchmark; all without it")
    parser.add_argument("--cases", default="", help="only cases whose name contains this text")
    parser.add_argument("--repeats", type=int, help="runs a tool, of which the median counts: 3, of the smallest 1")
    extent = parser.add_mutually_exclusive_group()
    extent.add_argument(
        "--all", dest="extent", action="store_const", const=ALL, default=USUAL, help="the heavy cases too, see below"
    )
    extent.add_argument(
        "--smallest", dest="extent", action="store_const", const=SMALLEST, help="whether it works, in seconds"
    )
    parser.add_argument("--out", type=Path, default=ROOT / "out" / "bench", help="folder for all that is written")
    target = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
    parser.add_argument("--programs", type=Path, default=target / "release", help="folder with our own programs")
    asked = parser.parse_args()
    asked.repeats = asked.repeats or (1 if asked.extent == SMALLEST else 3)
    return asked


def run(name, asked, where):
    """Runs one benchmark; says how it went: its rows, failed rows of ours, what was skipped."""
    print(f"== {name}", flush=True)
    module = importlib.import_module(MODULES.get(name, name))
    out = asked.out.resolve()
    head = {"benchmark": name, "extent": asked.extent, "machine": where}
    budget = math.inf if asked.extent == ALL else getattr(module, "BUDGET_CPU_S", BUDGET_CPU_S)
    record = Record(out / f"{name}.json", head, module.COLUMNS, budget)
    module.main(Wanted(name, out, asked.programs.resolve(), asked.repeats, asked.extent, asked.cases), record)
    record.finish()
    failed = [row for row in record.rows if "failed" in row]
    for row in failed:
        print(f"FAILED {row.get('case')}, {row.get('tool', 'surfrecon')}: {row['failed']}")
    ours = sum(row.get("tool", "surfrecon").startswith("surfrecon") for row in failed)
    print(
        f"\n{record.file}: {len(record.rows)} rows, {ours} of ours and {len(failed) - ours} of peers failed, "
        f"{len(record.skipped)} skipped, {record.kept['cpu_s']:.0f} s of CPU time",
        flush=True,
    )
    return len(record.rows), ours, len(record.skipped)


def main():
    """Runs the named benchmark or all. Status 1: something of ours failed; UNAVAILABLE: nothing could be run."""
    asked = options()
    where = machine()
    rows, failed, skipped = zip(
        *(run(name, asked, where) for name in ([asked.name] if asked.name else BENCHMARKS)), strict=True
    )
    if sum(failed):
        return 1
    if sum(rows) == 0:
        print("nothing was run: " + ("see above" if sum(skipped) else f"no case is named {asked.cases!r}"))
        return UNAVAILABLE
    return 0


if __name__ == "__main__":
    sys.exit(main())
