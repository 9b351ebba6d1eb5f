"""Runs a command; what becomes of errors, and exit codes."""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Sequence
from typing import Any

from .. import _native
from .._errors import Cancelled, ParameterError, SurfreconError
from . import inputs, progress, record, streams
from .commands import COMMANDS
from .files import is_same, refuse_unwritable, write_text
from .parser import BadCommandLine, parser, requested
from .progress import Shown
from .requests import UsageError
from .stops import Stopped, Stops
from .work import Made, Work

__all__ = ["perform", "problem_of", "run"]

DONE, FAILED, WRONG_USE, CLOSED_PIPE = 0, 1, 2, 141


def run(arguments: Sequence[str]) -> int:
    """Runs a command line; returns its exit code."""
    streams.prepare()
    try:
        code = _run(arguments)
        streams.finish()
    except streams.ClosedPipe:
        code = CLOSED_PIPE
    except streams.OutputError as problem:
        streams.tell(f"surfrecon: {problem}")
        code = FAILED
    streams.drop()
    return code


def _run(arguments: Sequence[str]) -> int:
    try:
        given, unknown = parser().parse_known_args(arguments)
        if unknown:
            raise BadCommandLine(f"surfrecon {given.command}", f"unrecognized arguments: {' '.join(unknown)}")
    except BadCommandLine as problem:
        streams.tell(_line(problem.command, problem))
        return WRONG_USE
    except SystemExit as done:
        # Of --help and --version.
        return int(done.code or 0)
    _load_all(given)
    try:
        with Stops() as stops:
            return _guarded(given, stops)
    except Stopped as stopped:
        streams.tell(_line(f"surfrecon {given.command}", "stopped"))
        return stopped.exit_code


def _guarded(given: argparse.Namespace, stops: Stops) -> int:
    command = f"surfrecon {given.command}"
    try:
        stops.resume()
        return _dispatch(given, stops)
    except (UsageError, ParameterError) as problem:
        streams.tell(_line(command, problem))
        return WRONG_USE
    except (SurfreconError, OSError, MemoryError) as problem:
        streams.tell(_line(command, problem_of(problem)))
        return FAILED
    except Exception:
        # Python makes errors of its own of what is raised while it makes a class of a module that is loaded late.
        if stops.asked:
            raise Stopped(stops.asked) from None
        raise


def _load_all(given: argparse.Namespace) -> None:
    """Loads what is else loaded when it is first needed: some modules do not bear to be interrupted meanwhile."""
    import pathlib  # noqa: F401

    import numpy as np

    # The compiled module gets NumPy's functions when it makes an array.
    _native.linear_colours(np.zeros((1, 4), np.uint8))
    if given.command == "batch":
        from . import batch  # noqa: F401
    if given.command == "task":
        from . import task  # noqa: F401
    if not getattr(given, "quiet", True):
        progress.load()


def _line(command: str, problem: object) -> str:
    """An error as one line: ``surfrecon: merge: ...``."""
    return f"{': '.join(command.split())}: {' '.join(str(problem).split(chr(10)))}"


def problem_of(problem: BaseException) -> str:
    """What an error says, with the file's name where that is not in its text."""
    if isinstance(problem, OSError) and not isinstance(problem, SurfreconError):
        return f"{os.fsdecode(problem.filename or '')}: {problem.strerror}".removeprefix(": ")
    return str(problem) or "out of memory"


def _dispatch(given: argparse.Namespace, stops: Stops) -> int:
    if given.command == "completion":
        from .completion import script

        streams.say(script(given.shell))
        return DONE
    if given.max_memory is not None:
        _native.set_memory_limit(given.max_memory)
    if given.report is not None:
        if not given.report:
            raise UsageError("the report has an empty name")
        for other in (getattr(given, name, None) for name in ("output", "manifest", "plan", "surface")):
            if other is not None and is_same(other, given.report):
                raise UsageError(f"{given.report}: the report needs a name of its own")
        refuse_unwritable(given.report, devices=True)
    shown = Shown(stops, given.quiet)
    if given.command == "batch":
        from .batch import run_batch

        return run_batch(given, shown, stops)
    if given.command == "task":
        from .task import run_task

        return run_task(given, shown, stops)
    also = [given.report] if given.report is not None else []
    request = requested(given)
    hashes = not given.no_provenance and (given.json or bool(also) or request.output is not None)
    work = Work(request, shown, stops, hashes, also)
    try:
        document, made = perform(work)
    except SurfreconError:
        # What went wrong may follow from it.
        _tell_notes(given, work)
        raise
    show(given, document)
    _tell_notes(given, work)
    if not given.quiet and not given.json:
        for k, line in enumerate(made.lines):
            streams.say(f"{request.output}: {line}" if k == 0 and request.output else line)
    return DONE


def _tell_notes(given: argparse.Namespace, work: Work) -> None:
    if not given.quiet:
        for note in work.notes:
            streams.tell(f"surfrecon: {given.command}: {note}")


def show(given: argparse.Namespace, document: dict[str, Any]) -> None:
    """Hands out a report, where that was asked for."""
    if given.report is not None:
        write_text(given.report, record.text(document) + "\n")
    if given.json:
        streams.say(record.text(document))


def perform(work: Work) -> tuple[dict[str, Any], Made]:
    """Runs what is asked, from reading to writing; returns the report.

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
