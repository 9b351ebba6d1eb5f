"""Refuses options that no merge by tasks has, before anything is planned, and plans that were changed by hand."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterable, Mapping
from typing import Any

from .. import _native
from .._arguments import flag, is_url, of_table, whole
from .._errors import InputError
from .._report import jsonable

__all__ = ["MOST_TASKS", "check", "check_made", "check_names", "name_of"]

# Of a stage.
MOST_TASKS = 100_000

# The content of plans, and its kinds.
_KINDS: dict[str, type | tuple[type, ...]] = {
    "surfrecon": str,
    "paths": list,
    "reading": dict,
    "scans": list,
    "options": dict,
    "workspace": str,
    "name": str,
    "output": str,
    "written": dict,
    "tasks": int,
    "keep": bool,
    "max_memory": (int, type(None)),
}
_WRITTEN = {"encoding", "part_triangles", "provenance"}
# Keywords of `Plan.make` and `merge` that are no options.
_KEYWORDS = {"workspace", "tasks", "keep", "max_memory", "reading", "retries", "progress", *_WRITTEN}


def check(
    *,
    tasks: Any,
    keep: Any,
    max_memory: Any,
    encoding: Any,
    part_triangles: Any,
    provenance: Any,
    options: Mapping[str, Any],
) -> None:
    """Refuses arguments that no merge has, as ``surfrecon.merge_to_file`` does.

    Raises:
        TypeError: one of another kind, or an option that there is not.
        ParameterError, InputError: one out of its range.
    """
    if not 1 <= whole("tasks", tasks) <= MOST_TASKS:
        raise InputError(f"tasks must lie between 1 and {MOST_TASKS}, got {tasks}")
    flag("keep", keep)
    if max_memory is not None and whole("max_memory", max_memory, " of bytes") <= 0:
        raise InputError(f"max_memory must be bytes > 0, got {max_memory}")
    if encoding not in (None, "binary", "binary_double"):
        raise InputError(f"the surface is written piece by piece, so its encoding must be binary, got {encoding!r}")
    whole("part_triangles", part_triangles)
    of_table("part_triangles", part_triangles, "write")
    if provenance is not None:
        if not isinstance(provenance, Mapping):
            raise InputError(f"provenance must be a JSON object, got {provenance!r}")
        json.dumps(jsonable(dict(provenance)))
    for name, value in options.items():
        of_table(name, value, "merge", "triangulate", others=_KEYWORDS)


def check_names(paths: Iterable[str], output: str) -> None:
    """Refuses what only the last task would otherwise.

    Raises:
        InputError: a URL where a file is meant, or a surface that can't be written.
    """
    for path in paths:
        if is_url(path):
            raise InputError(f"{path}: scans must be files: only the workspace and the plan may be URLs")
    if is_url(output):
        raise InputError(f"{output}: the surface must be a file: only the workspace and the plan may be URLs")
    _native._check_file_in_pieces(output)
    folder = os.path.dirname(output)
    if folder and not os.path.isdir(folder):
        raise InputError(f"{output}: there is no folder {folder}: make it first")


def name_of(content: Mapping[str, Any]) -> str:
    """The name of a plan's merge, by all that decides what its tasks leave. If it keeps, for any scans."""
    same = {name: content[name] for name in ("reading", "tasks", "keep")}
    if not content["keep"]:
        # Of another version's merge nothing is of use; what it keeps its folder tells.
        same["surfrecon"] = content["surfrecon"]
    decisive = {name: value for name, value in content["options"].items() if name != "threads"}
    scans = None if content["keep"] else content["scans"]
    text = json.dumps(jsonable([same, scans, decisive]), sort_keys=True)
    return f"surfrecon-merge-{hashlib.sha256(text.encode()).hexdigest()[:16]}"


def check_made(content: Any) -> str | None:
    """The fault of a plan's content, in words.

    What its tasks would find is decided when it is made: they took what others had left for their own if that were
    changed afterwards.
    """
    if not isinstance(content, dict) or any(name not in content for name in _KINDS):
        return "this is no plan of a merge"
    if content["surfrecon"] != _native.__version__:
        made, here = content["surfrecon"], _native.__version__
        return f"planned by surfrecon {made}, which {here} does not go on with: plan it anew"
    changed = "this plan was changed after it was made: make it anew with surfrecon plan"
    is_plan = all(isinstance(content[name], kind) for name, kind in _KINDS.items())
    is_plan = is_plan and all(isinstance(path, str) for path in content["paths"])
    is_plan = is_plan and all(isinstance(stamp, list) for stamp in content["scans"])
    if not is_plan or content["written"].keys() != _WRITTEN or content["name"] != name_of(content):
        return changed
    given = {name: content[name] for name in ("tasks", "keep", "max_memory", "options")}
    try:
        check(**given, **content["written"])
    except (TypeError, ValueError) as problem:
        return f"{changed}: {problem}"
    return None
