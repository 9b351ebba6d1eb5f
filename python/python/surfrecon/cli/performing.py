"""One command from reading to writing, its report, and exit codes."""

from __future__ import annotations

import argparse
import os
import time
from typing import Any

from .._errors import Cancelled, SurfreconError
from . import inputs, record, streams
from .commands import COMMANDS
from .files import refuse_unwritable, write_text
from .work import Made, Work

__all__ = ["perform", "problem_of", "show"]

DONE, FAILED, WRONG_USE, CLOSED_PIPE = 0, 1, 2, 141


def problem_of(problem: BaseException) -> str:
    """The text of an error, with the file's name if the text does not have it."""
    if isinstance(problem, OSError) and not isinstance(problem, SurfreconError):
        return f"{os.fsdecode(problem.filename or '')}: {problem.strerror}".removeprefix(": ")
    return str(problem) or "out of memory"


def show(given: argparse.Namespace, document: dict[str, Any]) -> None:
    """Hands out a report, where that was asked for."""
    if given.report is not None:
        write_text(given.report, record.text(document) + "\n")
    if given.json:
        streams.say(record.text(document))


def perform(work: Work) -> tuple[dict[str, Any], Made]:
    """Runs what is asked, from reading to writing. Returns the report.

    From when its result is written on, signals are deferred: a command that was stopped has left nothing.

    Raises:
        UsageError, ParameterError: it can't be asked.
        SurfreconError, OSError: a file, or what it holds, can't be used.
        Stopped: that was asked for.
    """
    try:
        with work.listening():
            return _performed(work)
    except Cancelled:
        # By progress, which knows that a signal came.
        work.stops.resume()
        raise


def _performed(work: Work) -> tuple[dict[str, Any], Made]:
    request, began = work.request, time.monotonic()
    command = COMMANDS[request.command]
    command.check(request)
    is_file = request.output is not None and command.is_file(request.output)
    if request.output is not None and is_file:
        refuse_unwritable(request.output)
    made = command.run(work)
    written: list[str] = []
    if request.output is not None and made.write is not None:
        written = [request.output, *made.beside(request.output)]
        work.refuse(written)
        work.refuse_beside(written[1:])
    work.stops.check()
    work.stops.defer()
    if request.output is not None and made.write is not None:
        with work.showing() as shown:
            made.write(request.output, shown, record.provenance(work))
    hashes = work.hashes and is_file
    outputs = [inputs.hashed(path) if hashes else inputs.named(path) for path in written]
    return record.finished(work, made, outputs, time.monotonic() - began), made
