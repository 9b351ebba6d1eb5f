"""Tiers of the tests in Python, and a record of what each test came to and cost.

`SURFRECON_TIER=first` leaves out the tests that are marked `thorough`, `SURFRECON_OTHER_VERSION` those that are marked
`one_version`; without them all run. `SURFRECON_TEST_RECORD` names a file for the record, a line of JSON each: what
tools/testing reads. Several processes may write into one.
"""

import json
import os
import time

import pytest

RECORD = os.environ.get("SURFRECON_TEST_RECORD")
THOROUGH = "thorough"
# Of tests whose subject is the library, not the host that calls it, one version of the host is enough.
ONE_VERSION = "one_version"


def used():
    """Seconds of computing so far: of this process and of the programs that it waited for."""
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


def note(**row):
    """Appends a row to the record."""
    if RECORD:
        with open(RECORD, "a", encoding="utf-8") as file:
            file.write(json.dumps(row) + "\n")


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(config, items):
    markers = {THOROUGH} if os.environ.get("SURFRECON_TIER") == "first" else set()
    if os.environ.get("SURFRECON_OTHER_VERSION"):
        markers.add(ONE_VERSION)
    left_out = [item for item in items if any(item.get_closest_marker(marker) for marker in markers)]
    if left_out:
        config.hook.pytest_deselected(items=left_out)
        items[:] = [item for item in items if item not in left_out]


def pytest_collectreport(report):
    # A module that is skipped as a whole, or does not even load, has no tests that could say so.
    if report.failed:
        note(error=report.nodeid)
    elif report.skipped:
        note(name=report.nodeid, outcome="skipped", seconds=0.0, cpu=0.0)


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_protocol(item):
    item.outcomes = set()
    wall, cpu = time.monotonic(), used()
    done = yield
    outcome = next((one for one in ("failed", "skipped") if one in item.outcomes), "passed")
    note(name=item.nodeid, outcome=outcome, seconds=time.monotonic() - wall, cpu=used() - cpu)
    return done


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item):
    report = yield
    item.outcomes.add(report.outcome)
    return report
