"""Manifests: many jobs in a file in TOML."""

from __future__ import annotations

import os
import tomllib
from collections import Counter
from dataclasses import dataclass
from typing import Any

from .._arguments import meant
from .._errors import ParameterError
from .commands import COMMANDS, Command
from .options import parsed
from .requests import Request, UsageError

__all__ = ["Job", "read_jobs"]

_KEYS = ("name", "command", "inputs", "output", "report", "parameters")


@dataclass(frozen=True)
class Job:
    """A job: what is asked of a command, and where its report lies."""

    name: str
    request: Request
    report: str


def read_jobs(path: str) -> list[Job]:
    """The jobs of a manifest in its order. Its files are named from its own folder.

    Raises:
        UsageError: it is no manifest. The text names job and key.
        OSError: it can't be read.
    """
    with open(path, "rb") as file:
        try:
            whole = tomllib.load(file)
        except ValueError as problem:
            # Also of numbers with thousands of digits, which Python does not read.
            raise UsageError(f"{path}: {problem}") from None
        except RecursionError:
            raise UsageError(
                f"{path}: lists or tables are nested too deeply: write it with fewer in each other"
            ) from None
    try:
        return _jobs(whole, path)
    except (UsageError, ParameterError) as problem:
        raise UsageError(f"{path}: {problem}") from None


def _jobs(whole: dict[str, Any], manifest: str) -> list[Job]:
    unknown = set(whole) - {"defaults", "job"}
    if unknown:
        raise UsageError(f"there is no key {min(unknown)!r}: a manifest may have [defaults] and [[job]] alone")
    defaults, tables = whole.get("defaults", {}), whole.get("job", [])
    if not isinstance(defaults, dict) or not isinstance(tables, list) or not tables:
        raise UsageError("a manifest has a table [[job]] for each job, and a table [defaults] at most")
    for name, value in defaults.items():
        if name not in COMMANDS and not any(name in command.options() for command in COMMANDS.values()):
            known = [*COMMANDS, *{option for command in COMMANDS.values() for option in command.options()}]
            near = meant(name, sorted(known)) or " surfrecon COMMAND --help lists them."
            raise UsageError(f"defaults: there is no command and no parameter {name!r}.{near}")
        if isinstance(value, dict) != (name in COMMANDS):
            raise UsageError(f"defaults: {name!r} must be a {'table' if name in COMMANDS else 'value'}")
        _check_default(name, value)
    jobs = [_job(table, k, defaults, os.path.dirname(manifest)) for k, table in enumerate(tables)]
    names = Counter(job.name for job in jobs)
    for name, count in names.items():
        if count > 1:
            raise UsageError(f"job {name!r}: another has the same name: give each its own")
    return jobs


def _check_default(name: str, value: Any) -> None:
    """Checks a default of all commands or those of one, be there a job that has them or not."""
    if name in COMMANDS:
        try:
            _parameters(COMMANDS[name], value, {})
        except (UsageError, ParameterError) as problem:
            raise UsageError(f"defaults.{name}: {problem}") from None
        return
    problems = []
    for row in (command.options()[name] for command in COMMANDS.values() if name in command.options()):
        try:
            parsed(row, value)
        except ParameterError as problem:
            problems.append(problem)
        else:
            # Commands may allow different values; jobs of theirs are checked with it.
            return
    raise UsageError(f"defaults: {problems[0]}")


def _job(table: Any, number: int, defaults: dict[str, Any], folder: str) -> Job:
    if not isinstance(table, dict):
        raise UsageError(f"job {number} must be a table")
    name = table.get("name") or table.get("output") or table.get("report") or f"number {number}"
    try:
        return _checked(str(name), table, defaults, folder)
    except (UsageError, ParameterError) as problem:
        raise UsageError(f"job {name!r}: {problem}") from None


def _checked(name: str, table: dict[str, Any], defaults: dict[str, Any], folder: str) -> Job:
    for key in table:
        if key not in _KEYS:
            near = meant(key, _KEYS)
            raise UsageError(f"there is no key {key!r}: a job may have {', '.join(_KEYS)}{near and '.'}{near}")
    command = COMMANDS.get(str(table.get("command")))
    if command is None:
        near = meant(str(table.get("command")), COMMANDS)
        known = ", ".join(COMMANDS)
        raise UsageError(f"command must be one of {known}, got {table.get('command')!r}{near and '.'}{near}")
    inputs, output, report = table.get("inputs"), table.get("output"), table.get("report")
    if not isinstance(inputs, list) or not inputs or not all(isinstance(path, str) for path in inputs):
        raise UsageError("inputs must be a list of files and folders")
    for key, value in (("name", table.get("name")), ("output", output), ("report", report)):
        if value is not None and not isinstance(value, str):
            raise UsageError(f"{key} must be text, got {value!r}")
    for path in filter(lambda path: path is not None, (*inputs, output, report)):
        if not path or "\0" in path:
            raise UsageError(f"{path!r} is no name of a file: give one")
    if output is not None and not command.endings:
        raise UsageError(f"{command.name} writes nothing: give report instead of output")
    if output is None and command.endings and not command.output_is_optional:
        raise UsageError(f"{command.name} needs an output")
    if output is None and report is None:
        raise UsageError(f"{command.name} needs a report, the file that is to have what it finds")
    request = Request(
        command.name,
        [os.path.join(folder, path) for path in inputs],
        None if output is None else os.path.join(folder, output),
        _placed(command, _parameters(command, table.get("parameters", {}), defaults), folder),
    )
    command.check(request)
    return Job(name, request, os.path.join(folder, report or f"{output}.json"))


def _parameters(command: Command, own: Any, defaults: dict[str, Any]) -> dict[str, Any]:
    """Those of the job, else of its command's defaults, else the defaults of all that the command has."""
    if not isinstance(own, dict):
        raise UsageError(f"parameters must be a table, got {own!r}")
    options, for_command = command.options(), defaults.get(command.name, {})
    for name in [*own, *for_command]:
        if name not in options:
            near = meant(name, options) or f" surfrecon {command.name} --help lists them."
            raise UsageError(f"{command.name} has no parameter {name!r}.{near}")
    shared = {name: value for name, value in defaults.items() if name in options}
    return {name: parsed(options[name], value) for name, value in {**shared, **for_command, **own}.items()}


def _placed(command: Command, parameters: dict[str, Any], folder: str) -> dict[str, Any]:
    """The parameters, with files and folders as all of a manifest: beside it."""
    options = command.options()
    is_path = {name: options[name].kind in ("file", "folder") for name in parameters}
    return {name: os.path.join(folder, value) if is_path[name] else value for name, value in parameters.items()}
