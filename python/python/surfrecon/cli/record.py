"""The records of a run: its report, and the provenance in its result."""

from __future__ import annotations

import hashlib
import json
import os
from typing import Any

from .. import _native
from .._report import jsonable
from . import inputs
from .requests import Request
from .work import Made, Work

__all__ = ["INDIFFERENT", "failed", "finished", "given", "provenance", "text"]

# Options that have no say in a result.
INDIFFERENT = {"keep", "threads", "workspace"}

# More are not named in a result one by one, as the frames of a recording.
_MOST_FILES = 100


def provenance(work: Work) -> dict[str, Any] | None:
    """The provenance of a result: program, command, parameters that were given, hashes of all files that were read.

    It is the same wherever the files lie, for any number of threads and any workspace, as results are. Of many files
    it has one hash.
    """
    if not work.hashes:
        return None
    asked = _asked(work.request)
    for name in INDIFFERENT:
        asked["parameters"].pop(name, None)
    files = [{"name": os.path.basename(file["path"]), "sha256": file["sha256"]} for file in work.known]
    if len(files) > _MOST_FILES:
        lines = "".join(f"{file['sha256']}  {file['name']}\n" for file in files)
        return asked | {"inputs": len(files), "sha256_of_inputs": hashlib.sha256(lines.encode()).hexdigest()}
    return asked | {"inputs": files}


def given(work: Work) -> list[str]:
    """A hash of each file or folder in the order in which they were given, which results may depend on.

    A folder's is of the names and hashes of its files. The names of folders don't count.
    """
    hashes = {os.path.abspath(inputs.path_of(file)): file["sha256"] for file in work.known}
    found = []
    for path in work.request.inputs if work.hashes else []:
        whole = os.path.abspath(path)
        inside = os.path.join(whole, "")
        lines = [f"{hashes[file]}  {file[len(inside) :]}" for file in sorted(hashes) if file.startswith(inside)]
        digest = hashlib.sha256("\n".join(lines).encode("utf-8", "surrogateescape")).hexdigest()
        found.append(hashes.get(whole, digest))
    return found


def finished(work: Work, made: Made, outputs: list[dict[str, Any]], seconds: float) -> dict[str, Any]:
    """The report of a run that went well."""
    found = {"given": given(work), "inputs": work.known, "outputs": outputs, "notes": work.notes, "report": made.report}
    return {"state": "done", **_asked(work.request), **found, "seconds": round(seconds, 3)}


def failed(request: Request, problem: str) -> dict[str, Any]:
    """The report of a run that failed."""
    return {"state": "failed", **_asked(request), "error": problem}


def _asked(request: Request) -> dict[str, Any]:
    version = {"program": "surfrecon", "version": _native.__version__}
    return {**version, "command": request.command, "parameters": dict(sorted(request.parameters.items()))}


def text(document: Any) -> str:
    """A document as JSON, in ASCII: numbers that aren't finite are ``null``, bytes that aren't UTF-8 are U+FFFD."""
    return json.dumps(_readable(jsonable(document)), indent=2, allow_nan=False)


def _readable(value: Any) -> Any:
    if isinstance(value, dict):
        return {_readable(name): _readable(entry) for name, entry in value.items()}
    if isinstance(value, list):
        return [_readable(entry) for entry in value]
    # Halves of surrogate pairs, which Python has for such bytes, are no text in JSON.
    return inputs.readable(value) if isinstance(value, str) else value
