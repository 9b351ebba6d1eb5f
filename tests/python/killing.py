"""Merges in processes of their own that are killed: where they had come to, nothing is cleaned up."""

import json
import os
import signal
import subprocess
import sys

import pytest

# No process is killed on Windows so that it can't clean up.
killable = pytest.mark.skipif(sys.platform == "win32", reason="no process is killed so that it can't clean up")

PROGRAM = """
import json, os, signal, sys, surfrecon
from surfrecon import distributed

plan, call, at = json.loads(sys.argv[1])
told = 0


def progress(*_):
    global told
    if told == at:
        os.kill(os.getpid(), signal.SIGKILL)
    told += 1


if plan is not None:
    distributed.Plan.read(plan).run(call, progress=progress)
else:
    scans = surfrecon.open(call.pop("scans"))
    surfrecon.merge_to_file(scans, call.pop("path"), progress=progress, **call)
"""


def _killed(plan, call, at):
    given = json.dumps([plan, call, at], default=os.fspath)
    done = subprocess.run([sys.executable, "-c", PROGRAM, given], capture_output=True, text=True)
    assert done.returncode in (0, -signal.SIGKILL), done.stderr
    return done.returncode != 0


def task_killed(plan, number, at):
    """Does a task until it tells of its progress for this time, counted from 0; whether it was killed then."""
    return _killed(plan.path, number, at)


def merge_killed(scans, path, at, **given):
    """Merges a list of scans into a file until it tells of its progress for this time; whether it was killed then."""
    return _killed(None, {"scans": scans, "path": path, **given}, at)
