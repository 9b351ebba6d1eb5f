"""Jobs of a batch that would write over what another reads or writes."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence

from . import inputs
from .files import identity, is_report
from .manifest import Job
from .requests import UsageError

__all__ = ["of_others", "refuse_conflicts"]


def refuse_conflicts(jobs: Sequence[Job], manifest: str, summary: str | None) -> None:
    """Refuses, before any job runs, files with two purposes, whether they are there yet or not.

    A job may read what one before it writes. What folders hold is not known before they are read: of these, reports
    replace reports alone.

    Raises:
        UsageError: there is one. The text names it and both jobs.
    """
    taken = {identity(manifest): "the manifest"}
    for job in jobs:
        _take(taken, job.request.output, f"the output of job {job.name!r}", job)
    for job in jobs:
        _take(taken, job.report, f"the report of job {job.name!r}", job)
    if summary is not None:
        _take(taken, summary, "the summary", None)
    reads = [{identity(path) for path in inputs.of_names(job.request.inputs)} for job in jobs]
    for k, job in enumerate(jobs):
        path = job.request.output
        for reader, read in zip(jobs[: k + 1], reads, strict=False):
            if path is not None and identity(path) in read:
                who = "" if reader is job else f" by job {reader.name!r}, which runs before"
                raise UsageError(f"job {job.name!r}: {path} is read{who}: give the output another name")
    for path, whose in [*((job.report, f"job {job.name!r}: ") for job in jobs), *([(summary, "")] if summary else [])]:
        for reader, read in zip(jobs, reads, strict=True):
            folders = [folder for folder in reader.request.inputs if os.path.isdir(folder)]
            inside = any(_is_inside(path, folder) for folder in folders)
            if identity(path) in read or inside and os.path.isfile(path) and not is_report(path):
                raise UsageError(f"{whose}{path} is read by job {reader.name!r}: give the report another name")


def of_others(jobs: Sequence[Job], one: Job, manifest: str, summary: str | None) -> list[str]:
    """The files that a job may not write beside its output: those of another, and those that jobs before it read."""
    found = [manifest, *filter(None, [summary])]
    before = True
    for job in jobs:
        if job is one:
            before = False
            continue
        found += [*filter(None, [job.request.output]), job.report, *_made(job)]
        if before:
            found += inputs.of_names(job.request.inputs)
    return found


def _made(job: Job) -> list[str]:
    """The files that a job wrote, by its report, wherever its folder lies now."""
    # A pipe would be waited for.
    if not os.path.isfile(job.report):
        return []
    try:
        with open(job.report, encoding="utf-8") as file:
            names = [os.path.basename(inputs.path_of(known)) for known in json.load(file)["outputs"]]
    except (OSError, ValueError, RecursionError, TypeError, KeyError, AttributeError):
        return []
    return [os.path.join(os.path.dirname(job.request.output or ""), name) for name in names]


def _take(taken: dict[tuple[int, int] | str, str], path: str | None, what: str, job: Job | None) -> None:
    if path is None:
        return
    one, whose = identity(path), "" if job is None else f"job {job.name!r}: "
    if one not in taken:
        taken[one] = what
    elif what.startswith("the output") and taken[one].startswith("the output"):
        raise UsageError(f"{whose}another has the same output: {taken[one].removeprefix('the output of ')}")
    else:
        problem = f"{path} is {taken[one]} already: the {'output' if what.startswith('the output') else 'report'}"
        raise UsageError(f"{whose}{problem} needs a name of its own")


def _is_inside(path: str, folder: str) -> bool:
    return os.path.realpath(path).startswith(os.path.join(os.path.realpath(folder), ""))
