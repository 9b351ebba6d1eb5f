"""The cost of each step and each test: out/tests/times.json and a table of the dearest.

A step's CPU is that of its program and of all that it called. A test in Python measures its own; tests in Rust share
that of their program by their time, since the runner knows no more. This is a report, never a red test: clocks lie.
"""

import json
import os

# Tests of the first tier that take longer are named, in seconds of CPU.
MUCH = 10.0
ROWS = 20


def written(ended, seconds, tier, load, file):
    """Writes times.json."""
    steps = [
        {
            "name": one.step.name,
            "how": one.how,
            "began": round(one.began, 1),
            "seconds": round(one.seconds, 1),
            "cpu": round(one.cpu, 1),
            "passed": one.tally.passed,
            "failed": one.tally.failed,
            "skipped": one.tally.skipped,
        }
        for one in ended
    ]
    tests = [test.row() for one in ended for test in one.step.output.tests]
    found = {
        "tier": tier,
        "cores": os.cpu_count(),
        "load_before": round(load, 2),
        "load_after": round(os.getloadavg()[0], 2),
        "seconds": round(seconds, 1),
        "cpu": round(sum(one.cpu for one in ended), 1),
        "steps": steps,
        "tests": sorted(tests, key=lambda row: -(row["cpu"] or 0.0)),
    }
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(json.dumps(found, indent=1) + "\n")
    return found


def table(found):
    """Lines: the dearest steps and tests, and the tests of the first tier that take much."""
    rows = [(row["cpu"], row["seconds"], f"step: {row['name']}") for row in found["steps"]]
    rows += [(row["cpu"] or 0.0, row["seconds"], row["name"]) for row in found["tests"]]
    yield f"\nthe {ROWS} dearest: CPU s, wall s"
    for cpu, seconds, name in sorted(rows, reverse=True)[:ROWS]:
        yield f"{cpu:8.1f} {seconds:8.1f}  {name}"
    much = [row for row in found["tests"] if (row["cpu"] or 0.0) > MUCH]
    if found["tier"] == "first" and much:
        yield f"tests of the first tier that took more than {MUCH:.0f} s of CPU:"
        for row in much:
            yield f"{row['cpu']:8.1f} {row['seconds']:8.1f}  {row['name']}"
    yield (
        f"{found['seconds'] / 60:.1f} minutes, {found['cpu'] / 60:.1f} of CPU on {found['cores']} cores; "
        f"load {found['load_before']} before, {found['load_after']} after"
    )
