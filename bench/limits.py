"""The memory that each call foresees and takes, whether a limit holds it, and how soon it stops.

A row is a call on an input, in a fresh process, where four things are done with it:
1. It runs: `peak_mb` is the most that the library held beyond what it held before, `estimate_mb` what it foresaw.
2. It runs with half of that peak allowed: it has to raise MemoryError and take no more than it may. Then with what it
   foresaw: it has to come to its end. `limit_kept` says whether it did both.
3. It is interrupted as Ctrl-C does, at `cancels` moments spread evenly over its run: `stop_ms` is the longest that the
   call went on after that. There are 50 of them with --all, else as many as a few seconds hold, 10 at least.
`kind` is `ordinary`, or `worst` for an input that takes more than its size lets expect.
"""

import json
import sys
import tempfile
from pathlib import Path

import measured
import table
from wanted import ALL

COLUMNS = [
    "case",
    "operation",
    "input",
    "kind",
    "threads",
    "estimate_mb",
    "peak_mb",
    "limit_kept",
    "stop_ms",
    "cancels",
]
CANCELS, FEWEST_CANCELS, SMALLEST_CANCELS = 50, 10, 3
# Seconds that the cancels of a row may take altogether, unless all are asked for.
CANCELS_S = 4.0
# The foreseen memory may be so many times the memory that was taken.
ALLOWED = {"ordinary": 1.5, "worst": 3.0}
STOP_MS = 100
# Calls that take less are not worth an estimate: nothing is asked of the system for them.
SMALL_MB = 16.0
CALL = Path(__file__).with_name("limits_call.py")
SHOWN = {
    "case": "case",
    "kind": "kind",
    "estimate MB": "estimate_mb",
    "peak MB": "peak_mb",
    "limit kept": "limit_kept",
    "stops, ms": "stop_ms",
    "cancels": "cancels",
    "seconds": "seconds",
}


def run(case, cancels, seconds, folder, small):
    """Runs limits_call.py and returns what it prints."""
    _, printed = measured.run([sys.executable, CALL, json.dumps([case, cancels, seconds, folder, small])], timeout=1200)
    return json.loads(printed)


def problems(row):
    """The promises that a row breaks."""
    most = ALLOWED[row["kind"]] * row["peak_mb"]
    if row["peak_mb"] > SMALL_MB and not row["peak_mb"] <= row["estimate_mb"] <= most:
        yield f"estimate {row['estimate_mb'] / row['peak_mb']:.2f} of the peak"
    if not row["limit_kept"]:
        yield "limit not kept"
    if row["stop_ms"] > STOP_MS:
        yield f"stops after {row['stop_ms']:.0f} ms"


def main(wanted, record):
    """Every call on every input that is wanted."""
    # The most and the fewest.
    cancels = (
        [SMALLEST_CANCELS] * 2 if wanted.smallest else [CANCELS, CANCELS if wanted.extent == ALL else FEWEST_CANCELS]
    )
    with tempfile.TemporaryDirectory() as folder:
        kinds = run("cases: list", cancels, CANCELS_S, folder, wanted.smallest)
        for case, kind in kinds.items():
            if not wanted.takes(case) or not record.has_time_for(case):
                continue
            operation, what = case.split(": ")
            if wanted.smallest and any(row["operation"] == operation for row in record.rows):
                continue
            row = {"case": case, "operation": operation, "input": what, "kind": kind, "threads": 0}
            try:
                row |= run(case, cancels, CANCELS_S, folder, wanted.smallest)
                row["misses"] = list(problems(row)) if not wanted.smallest else []
            except measured.Failed as failed:
                row["failed"] = str(failed)
            record.put(row)
            said = row.get("failed") or ", ".join(row["misses"]) or "ok"
            print(f"    {case}: {said}", flush=True)
    table.show([row for row in record.rows if "failed" not in row], SHOWN)
