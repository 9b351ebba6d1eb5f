"""Runs every check and test of a tier and adds up their results; `make test` and `make test ALL=1` call it.

The last line counts tests over all steps; a step that fails without having counted a failed test counts as one. A
Rust test that lacks its data prints a line starting with `SKIPPED` and is counted as skipped, not as passed.
tools/testing has the parts.
"""

import argparse
import contextlib
import os
import shutil
import signal
import sys
import tempfile
import time
from pathlib import Path

from testing import catalogue, costs
from testing.graph import Graph, chosen, show
from testing.outcome import Tally
from testing.plan import ALL, FIRST, ROOT, Plan

# The most that the files of all tests at once take, and as much again.
MEMORY_FOR_FILES = 8 << 30


def main():
    """Runs the steps of a tier."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--all", action="store_true", help="both tiers")
    parser.add_argument(
        "--only", metavar="STEP", action="append", default=[], help="this step and what it needs; may be repeated"
    )
    # A shell that runs this in the background has it ignore Ctrl-C, and what it starts would, too.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    options = parser.parse_args()
    tier = ALL if options.all else FIRST
    os.environ["SURFRECON_TIER"] = tier
    # Nothing is compiled twice here: bookkeeping for that would cost a third of the time and most of the disk.
    os.environ.setdefault("CARGO_INCREMENTAL", "0")
    # Test programs are compiled once and run once: finer units and line tables, which pay where somebody works on
    # the code, take a fifth of the compiler's time.
    os.environ.setdefault("CARGO_PROFILE_DEV_CODEGEN_UNITS", "4")
    os.environ.setdefault("CARGO_PROFILE_DEV_DEBUG", "none")
    # The same random inputs each time: new ones are for `make explore`, where what is found is kept.
    os.environ.setdefault("PROPTEST_RNG_SEED", "1")

    with quick_folder():
        return run(tier, options.only)


@contextlib.contextmanager
def quick_folder():
    """Has temporary files in memory, where there is much: tests make hundreds of thousands, which wait for each other
    on a disk.
    """
    memory = Path("/dev/shm")
    if "TMPDIR" in os.environ or not os.access(memory, os.W_OK) or shutil.disk_usage(memory).free < MEMORY_FOR_FILES:
        yield
        return
    with tempfile.TemporaryDirectory(prefix="surfrecon-tests-", dir=memory, ignore_cleanup_errors=True) as folder:
        os.environ["TMPDIR"] = folder
        yield


def run(tier, only):
    """Runs the steps of a tier, or these alone; the status to end with."""
    out = ROOT / "out" / "tests"
    out.mkdir(parents=True, exist_ok=True)
    started, load = time.monotonic(), os.getloadavg()[0]
    plan = Plan(tier, out)
    ended = Graph(chosen(plan.steps, only), out / "logs", ROOT).run()

    total = Tally()
    for one in ended:
        total.add(one.tally)
    tests = [test for one in ended for test in one.step.output.tests]
    if not only:
        rows = catalogue.listed(plan.built.programs, plan.folders)
        catalogue.write(rows, out / "tiers.json")
    # If a step failed, that alone is told. Some steps alone run some tests alone.
    if total.failed == 0 and not only:
        absent = {plan.folder_of.get(one.step.name) for one in ended if one.how == "unavailable"} - {None}
        for problem in catalogue.problems(rows, tests, tier, absent):
            show(f"FAILED: {problem}")
            total.failed += 1
    found = costs.written(ended, time.monotonic() - started, tier, load, out / "times.json")
    for line in costs.table(found):
        show(line)
    if "SURFRECON_DATA" not in os.environ:
        show("\nSURFRECON_DATA is not set: the tests on real scans were skipped, see CONTRIBUTING.md.")
    show(f"\ntotal: {total}")
    return 0 if total.failed == 0 else 1


if __name__ == "__main__":
    sys.exit(main())
