"""Tasks of a merge that was planned."""

from __future__ import annotations

import argparse
import time
from typing import Any

from .. import _native
from ..distributed import Plan
from . import streams
from .performing import DONE, show
from .progress import Shown
from .requests import UsageError
from .stops import Stops

__all__ = ["run_task"]


def run_task(given: argparse.Namespace, shown: Shown, stops: Stops) -> int:
    """Does the tasks that are named, or all. Returns the exit code.

    Raises:
        UsageError: there is no such task.
        Stopped: that was asked for. Tasks before are done.
    """
    began, plan = time.monotonic(), Plan.read(given.plan)
    last = plan.stages[-1].tasks[-1]
    for number in given.numbers:
        if number > last:
            raise UsageError(f"{given.plan}: there is no task {number}: they are numbered from 0 to {last}")
    found: list[dict[str, Any]] = []
    for number in given.numbers or range(last + 1):
        stops.check()
        with shown:
            entry = plan.run(
                number, threads=given.threads, max_memory=given.max_memory, scratch=given.scratch, progress=shown
            )
        found.append(entry)
        if number == last and not (given.keep or plan.keep):
            plan.clear()
        if not given.quiet and not given.json:
            made = f", {entry['output']} is written" if "output" in entry else ""
            streams.say(f"{entry['stage']} {number}: done in {entry['seconds']} s{made}")
    seconds = round(time.monotonic() - began, 3)
    show(given, {"program": "surfrecon", "version": _native.__version__, "tasks": found, "seconds": seconds})
    return DONE
