"""The Blender extension: what it adds to the time and the memory that Blender itself needs.

| case | ms | peak_mb |
|---|---|---|
| million triangles | CPU time of handing a mesh over, and of the fewest calls of Blender | held meanwhile |
| ... with colour and error | the same with two attributes | the same |
| after the operator | | still held when it has ended, by the library's counter and NumPy's |
| first progress | from the button until a real window has drawn the progress | |
| stopping ... | from the request until the call has ended, the longest of 16 moments of its run | |

CPU time counts where it can, so that another load on the machine doesn't; the last two can only be told by the clock.
"""

import json
import subprocess
import sys
from pathlib import Path

import measured
import stopping
import table

ROOT = Path(__file__).resolve().parent.parent
PROGRAM = ROOT / "bench" / "into_blender.py"
CASES = {"plain": "million triangles", "colour and error": "million triangles with colour and error"}


def hand_over(repeats):
    """What bench/into_blender.py prints, a dictionary a case; `None` without Blender's module."""
    made = subprocess.run([ROOT / "tools" / "venv.sh", "blender-4.5"], stdout=subprocess.PIPE, text=True, check=False)
    if made.returncode != 0:
        print("SKIPPED into Blender: its Python environment could not be prepared")
        return None
    command = [f"{made.stdout.strip()}/bin/python", PROGRAM, ROOT / "blender-addon", str(repeats)]
    printed = measured.run(command, timeout=1800)[1]
    return [json.loads(line) for line in printed.splitlines() if line.startswith("{")]


def first_progress():
    """Milliseconds until the window shows progress; `None` where no window can be had."""
    subprocess.run([sys.executable, ROOT / "tools" / "build_extension.py"], check=True, stdout=subprocess.DEVNULL)
    command = [ROOT / "tools" / "test_gui.sh", "bench/blender_window.py"]
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
    found = [json.loads(line) for line in done.stdout.splitlines() if line.startswith("{")]
    if not found:
        print(f"SKIPPED the window: {done.stdout.strip().splitlines()[-1:]}")
        return None
    return found[0]["first_progress_ms"]


def main(only_cases, repeats):
    """Measures; returns the rows."""
    rows = []
    for found in (hand_over(repeats) or []) if only_cases in " ".join([*CASES.values(), "after the operator"]) else []:
        if found["case"] == "operator":
            rows.append(empty("after the operator") | {"peak_mb": max(found["left_mb"], 0.0)})
            continue
        rows.append(
            {
                "case": CASES[found["case"]],
                "ms": 1e3 * found["ours"][0],
                "blender_minimum_ms": 1e3 * found["minimum"][0],
                "peak_mb": max(found["peak_mb"], 0.0),
            }
        )
    if only_cases in "first progress":
        milliseconds = first_progress()
        if milliseconds is not None:
            rows.append(empty("first progress") | {"ms": milliseconds})
    if "stopping" in only_cases or only_cases in "stopping":
        for name, (longest, _) in stopping.main(only_cases).items():
            rows.append(empty(f"stopping {name}") | {"ms": longest})
    table.show(rows, {"case": "case", "ms": "ms", "Blender's minimum": "blender_minimum_ms", "MB": "peak_mb"})
    return {"rows": rows}


def empty(case):
    """A row without figures."""
    return {"case": case, "ms": None, "blender_minimum_ms": None, "peak_mb": None}
