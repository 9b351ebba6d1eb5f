"""Runs a command line. Decides what becomes of errors."""

from __future__ import annotations

import argparse
from collections.abc import Sequence

from .. import _native
from .._errors import ParameterError, SurfreconError
from . import progress, streams
from .advice import advised, advised_all
from .files import is_same, refuse_unwritable
from .parser import BadCommandLine, parser, requested
from .performing import CLOSED_PIPE, DONE, FAILED, WRONG_USE, perform, problem_of, show
from .progress import Shown
from .requests import UsageError
from .stops import Stopped, Stops
from .work import Work

__all__ = ["run"]


def run(arguments: Sequence[str]) -> int:
    """Runs a command line. Returns its exit code."""
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
        given = parser().parse_args(arguments)
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
        streams.tell(_line(command, problem), given.command)
        return WRONG_USE
    except (SurfreconError, OSError, MemoryError) as problem:
        streams.tell(_line(command, problem_of(problem)), given.command)
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


def _dispatch(given: argparse.Namespace, stops: Stops) -> int:
    if given.command == "completion":
        from .completion import script

        streams.say(script(given.shell))
        return DONE
    if given.max_memory is not None:
        _native.set_memory_limit(given.max_memory)
    if given.report is not None:
        if not given.report:
            raise UsageError("the report has an empty name: give one")
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
        # The error may follow from it.
        _tell_notes(given, work)
        raise
    show(given, advised_all(document, request.command))
    _tell_notes(given, work)
    if not given.quiet and not given.json:
        for k, line in enumerate(made.lines):
            line = advised(line, request.command)
            streams.say(f"{request.output}: {line}" if k == 0 and request.output else line)
    return DONE


def _tell_notes(given: argparse.Namespace, work: Work) -> None:
    if not given.quiet:
        for note in work.notes:
            streams.tell(f"surfrecon: {given.command}: {note}", given.command)
