"""Calling through the C library beside calling the core, files in memory beside files; whole jobs beside peers.

A small Rust program (capi_overhead.rs) loads the built library as a stranger would and links the core besides: it does
the same work both ways in turn. replaced.py has merges of which a scan has changed, jobs.py the jobs.
"""

import json
import subprocess

import jobs
import replaced
import table

COLUMNS = ["case", "tool", "core_s", "c_s", "overhead_pct", "file_s", "memory_s", *replaced.COLUMNS, *jobs.COLUMNS]
TURNS = 5  # runs both ways for each repeat asked for: what is looked for is less than one per cent


def main(wanted, record):
    """Runs the benchmark."""
    turns = 1 if wanted.smallest else TURNS * wanted.repeats
    program = [wanted.programs / "examples" / "capi_overhead", wanted.programs / "libsurfrecon.so", str(turns)]
    with subprocess.Popen(program, stdout=subprocess.PIPE, text=True) as process:
        for line in process.stdout:
            row = json.loads(line) | {"tool": "surfrecon"}
            if wanted.takes(row["case"]):
                first, second = ("core_s", "c_s") if "core_s" in row else ("file_s", "memory_s")
                overhead = 100 * (row[second] / row[first] - 1)
                record.put(dict.fromkeys(COLUMNS) | row | {"overhead_pct": overhead})
    if process.returncode:
        raise subprocess.CalledProcessError(process.returncode, program)
    columns = {
        "core s": "core_s",
        "C s": "c_s",
        "file s": "file_s",
        "memory s": "memory_s",
        "overhead %": "overhead_pct",
    }
    table.show(record.rows, {"case": "case"} | columns)
    before = len(record.rows)
    replaced.main(wanted, record, COLUMNS)
    print("\nA merge run again from what was kept, beside a first one")
    table.show(record.rows[before:], {"case": "case"} | {column: column for column in replaced.COLUMNS})
    before = len(record.rows)
    jobs.main(wanted, record, COLUMNS)
    print("\nWhole jobs as programs: lines without blanks and comments, seconds of the clock, answers as alone")
    table.show(record.rows[before:], {"case": "case", "tool": "tool"} | {column: column for column in jobs.COLUMNS})
