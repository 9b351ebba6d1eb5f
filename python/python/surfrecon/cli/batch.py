"""Many jobs: those that are done are left as they are, each of the others leaves a report."""

from __future__ import annotations

import argparse
import functools
import json
import os
import time
from collections import Counter
from typing import Any

from .. import _native
from .._arguments import meant
from .._errors import SurfreconError
from . import inputs, record, streams
from .conflicts import of_others, refuse_conflicts
from .files import refuse_unwritable, write_text
from .manifest import Job, read_jobs
from .performing import DONE, FAILED, perform, problem_of, show
from .progress import Shown
from .requests import UsageError
from .stops import Stops
from .work import Work

__all__ = ["run_batch"]


def run_batch(given: argparse.Namespace, shown: Shown, stops: Stops) -> int:
    """Runs the jobs of a manifest. Returns the exit code.

    Raises:
        UsageError: the manifest is wrong. Nothing has run then.
        Stopped: that was asked for. Jobs before are done.
    """
    began, found, changed = time.monotonic(), [], set[str]()
    every = read_jobs(given.manifest)
    for job in _chosen(every, given):
        entry: dict[str, Any] = {"name": job.name, "report": job.report}
        reason = "asked for" if given.force else _reason(job, given, shown, stops, changed)
        if reason is None:
            entry["state"] = "up to date"
        elif given.dry_run:
            entry |= {"state": "to do", "reason": reason}
        else:
            kept = functools.partial(of_others, every, job, given.manifest, given.report)
            entry |= _ran(Work(job.request, shown, stops, not given.no_provenance, [job.report], kept), job)
        if reason is not None:
            changed.update(map(os.path.abspath, filter(None, [job.request.output])))
        found.append(entry)
        if not given.quiet:
            rest = entry.get("error") or entry.get("reason")
            streams.tell(f"surfrecon: batch: {job.name}: {entry['state']}{f': {rest}' if rest else ''}", "batch")
        elif "error" in entry:
            streams.tell(f"surfrecon: batch: {job.name}: {entry['error']}", "batch")
        if given.stop and entry["state"] == "failed":
            break
    counts = Counter(entry["state"] for entry in found)
    seconds = round(time.monotonic() - began, 3)
    show(given, {"program": "surfrecon", "version": _native.__version__, "jobs": found, "seconds": seconds})
    if not given.quiet and not given.json:
        jobs = "1 job" if len(found) == 1 else f"{len(found)} jobs"
        streams.say(f"{jobs}: {', '.join(f'{count} {state}' for state, count in counts.items())}")
    return FAILED if counts["failed"] else DONE


def _chosen(jobs: list[Job], given: argparse.Namespace) -> list[Job]:
    """The jobs that were asked for. All jobs of a manifest must be right, whichever run."""
    try:
        refuse_conflicts(jobs, given.manifest, given.report)
    except UsageError as problem:
        raise UsageError(f"{given.manifest}: {problem}") from None
    for name in given.only or ():
        if not any(job.name == name for job in jobs):
            near = meant(name, [job.name for job in jobs]) or " --dry-run lists the jobs."
            raise UsageError(f"{given.manifest}: there is no job {name!r}.{near}")
    return [job for job in jobs if not given.only or job.name in given.only]


def _ran(work: Work, job: Job) -> dict[str, Any]:
    """Runs a job and writes its report."""
    stops = work.stops
    try:
        refuse_unwritable(job.report, devices=True)
        document, _ = perform(work)
        entry = {"state": "done", "seconds": document["seconds"]}
    except (SurfreconError, UsageError, OSError, MemoryError) as problem:
        document = record.failed(job.request, problem_of(problem))
        entry = {"state": "failed", "error": document["error"]}
    except Exception as problem:
        # One that fails stops no other, even if it is our mistake. Of a stop Python may have made this.
        if stops.asked:
            raise
        document = record.failed(job.request, f"{type(problem).__name__}: {problem}")
        entry = {"state": "failed", "error": document["error"]}
    stops.defer()
    # Without its report a job is not done: it will run again.
    try:
        work.refuse([job.report])
        write_text(job.report, record.text(document) + "\n")
    except SurfreconError as problem:
        entry = {"state": "failed", "error": problem_of(problem)}
    stops.resume()
    return entry


def _reason(job: Job, given: argparse.Namespace, shown: Shown, stops: Stops, changed: set[str]) -> str | None:
    """The reason to run a job. It is ``None`` where its report says that the job would make again what is there."""
    # A pipe would be waited for.
    if not os.path.isfile(job.report):
        return "there is no report of it"
    try:
        with open(job.report, encoding="utf-8") as file:
            report = json.load(file)
    except (OSError, ValueError, RecursionError):
        return "there is no report of it"
    if not isinstance(report, dict) or not isinstance(report.get("parameters"), dict):
        return "there is no report of it"
    if report.get("state") != "done":
        return "it failed"
    if given.dry_run and any(_is_within(path, changed) for path in job.request.inputs):
        return "what it reads is made by a job before"
    if report.get("version") != _native.__version__:
        return f"it was made by version {report.get('version')}"
    if report.get("command") != job.request.command or _settings(report) != _settings(_as_written(job)):
        return "its parameters have changed"
    try:
        return _changed_files(job, report, Work(job.request, shown, stops, True, [job.report]))
    except (SurfreconError, OSError, AttributeError, KeyError, TypeError, ValueError):
        return "its files can't be compared"


def _changed_files(job: Job, report: dict[str, Any], work: Work) -> str | None:
    """The files that are no more as a report says. The places of their folders do not matter."""
    given = job.request.inputs
    for paths in [given[:1], given[1:]] if job.request.command == "measure" else [given]:
        work.open(paths)
    if not report["inputs"]:
        return "its report has no hashes"
    if _contents(report["inputs"]) != _contents(work.known) or report["given"] != record.given(work):
        return "its inputs have changed"
    output = job.request.output
    if output is None:
        return None
    if not report["outputs"]:
        return "its output is missing"
    if _base(report["outputs"][0]) != os.path.basename(output):
        return "its output has another name now"
    for known in report["outputs"]:
        path = os.path.join(os.path.dirname(output), _base(known))
        if not os.path.exists(path):
            return "its output is missing"
        if _contents([inputs.hashed(path, work.stops)]) != _contents([known]):
            return "its output has changed"
    return None


def _contents(files: list[dict[str, Any]]) -> list[tuple[str, str]]:
    return [(_base(file), file["sha256"]) for file in files]


def _base(file: dict[str, Any]) -> str:
    return os.path.basename(inputs.path_of(file))


def _is_within(path: str, changed: set[str]) -> bool:
    whole = os.path.abspath(path)
    return any(one == whole or one.startswith(whole + os.sep) for one in changed)


def _as_written(job: Job) -> dict[str, Any]:
    """The report that the job would have now, as it is read back."""
    written: dict[str, Any] = json.loads(record.text({"parameters": job.request.parameters}))
    return written


def _settings(report: dict[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in report["parameters"].items() if name not in record.INDIFFERENT}
