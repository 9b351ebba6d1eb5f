"""Calling through the C library beside calling the core: the same work both ways in turn, in one process.

A small Rust program (capi_overhead.rs) loads the built library as a stranger would and links the core besides.
"""

import json
import subprocess
from pathlib import Path

import table

ROOT = Path(__file__).resolve().parent.parent
TURNS = 5  # runs both ways for each repeat asked for: what is looked for is less than one per cent


def main(only_cases, repeats):
    """Runs the benchmark and returns what goes into the JSON file."""
    for package in (["surfrecon-capi"], ["surfrecon-tests", "--example", "capi_overhead"]):
        subprocess.run(["cargo", "build", "--release", "--quiet", "--package", *package], cwd=ROOT, check=True)
    target = ROOT / "target" / "release"
    program = [target / "examples" / "capi_overhead", target / "libsurfrecon.so", str(TURNS * repeats)]
    printed = subprocess.run(program, check=True, stdout=subprocess.PIPE, text=True).stdout
    rows = [json.loads(line) for line in printed.splitlines()]
    rows = [row | {"tool": "surfrecon"} for row in rows if only_cases in row["case"]]
    for row in rows:
        row["overhead_pct"] = 100 * (row["c_s"] / row["core_s"] - 1)
    table.show(rows, {"case": "case", "core s": "core_s", "C s": "c_s", "overhead %": "overhead_pct"})
    return {"rows": rows}
