"""What is kept of a run: its report, and what its result says of where it is from."""

from __future__ import annotations

import json
from typing import Any

from .. import _native
from .._report import jsonable
from .requests import Request
from .work import Made, Work

__all__ = ["failed", "finished", "provenance", "text"]


def provenance(work: Work) -> dict[str, Any] | None:
    """What makes a result again: program, command, parameters that were given, hashes of all files that were read."""
    if not work.hashes:
        return None
    return {**_asked(work.request), "inputs": work.known}


def finished(work: Work, made: Made, outputs: list[dict[str, Any]], seconds: float) -> dict[str, Any]:
    """The report of a run that went well."""
    found = {"inputs": work.known, "outputs": outputs, "notes": work.notes, "report": made.report}
    return {"state": "done", **_asked(work.request), **found, "seconds": round(seconds, 3)}


def failed(request: Request, problem: str) -> dict[str, Any]:
    """The report of a run that failed."""
    return {"state": "failed", **_asked(request), "error": problem}


def _asked(request: Request) -> dict[str, Any]:
    version = {"program": "surfrecon", "version": _native.__version__}
    return {**version, "command": request.command, "parameters": dict(sorted(request.parameters.items()))}


def text(document: Any) -> str:
    """A document as JSON, in ASCII: numbers that aren't finite are ``null``, bytes that aren't UTF-8 question marks."""
    return json.dumps(_readable(jsonable(document)), indent=2, allow_nan=False)


def _readable(value: Any) -> Any:
    if isinstance(value, dict):
        return {_readable(name): _readable(entry) for name, entry in value.items()}
    if isinstance(value, list):
        return [_readable(entry) for entry in value]
    # Halves of surrogate pairs, which Python has for such bytes, are no text in JSON.
    return value.encode("utf-8", "replace").decode("utf-8") if isinstance(value, str) else value
