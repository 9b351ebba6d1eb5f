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
COLUMNS = ["case", "ms", "blender_minimum_ms", "peak_mb"]
# A row and a column of this many vertices make a million triangles.
SIDE, SMALLEST = 709, 40
CASES = {"plain": "million triangles", "colour and error": "million triangles with colour and error"}
AFTER = "after the operator"


def hand_over(wanted, record):
    """Yields what bench/into_blender.py prints, a dictionary a case. Nothing without Blender's module."""
    made = subprocess.run([ROOT / "tools" / "venv.sh", "blender-4.5"], stdout=subprocess.PIPE, text=True, check=False)
    if made.returncode != 0:
        record.skip("into Blender: its Python environment could not be prepared")
        return
    side, repeats = (SMALLEST, 1) if wanted.smallest else (SIDE, wanted.repeats)
    command = [f"{made.stdout.strip()}/bin/python", PROGRAM, ROOT / "blender-addon", str(repeats), str(side)]
    yield from (json.loads(line) for line in measured.run(command)[1].splitlines() if line.startswith("{"))


def first_progress(record):
    """Milliseconds until the window shows progress; `None` where no window can be had."""
    subprocess.run([sys.executable, ROOT / "tools" / "build_extension.py"], check=True, stdout=subprocess.DEVNULL)
    command = [ROOT / "tools" / "test_gui.sh", "bench/blender_window.py"]
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
    found = [json.loads(line) for line in done.stdout.splitlines() if line.startswith("{")]
    if not found:
        record.skip(f"first progress: there is no window: {' '.join(done.stdout.strip().splitlines()[-1:])}")
        return None
    return found[0]["first_progress_ms"]


def main(wanted, record):
    """Runs the benchmark."""
    if any(wanted.takes(case) for case in [*CASES.values(), AFTER]):
        for found in hand_over(wanted, record):
            if found["case"] == "operator":
                record.put(empty(AFTER) | {"peak_mb": max(found["left_mb"], 0.0)})
                continue
            figures = {"ms": 1e3 * found["ours"][0], "blender_minimum_ms": 1e3 * found["minimum"][0]}
            record.put({"case": CASES[found["case"]]} | figures | {"peak_mb": max(found["peak_mb"], 0.0)})
    if wanted.takes("first progress") and not wanted.smallest:
        milliseconds = first_progress(record)
        if milliseconds is not None:
            record.put(empty("first progress") | {"ms": milliseconds})
    for name, longest in stopping.longest(wanted, record):
        record.put(empty(name) | {"ms": longest})
    table.show(record.rows, {"case": "case", "ms": "ms", "Blender's minimum": "blender_minimum_ms", "MB": "peak_mb"})


def empty(case):
    """A row without figures."""
    return {"case": case, "ms": None, "blender_minimum_ms": None, "peak_mb": None}
