"""The merges of the compiled module, with arguments that are looked at first."""

from __future__ import annotations

import functools
import os
from collections.abc import Callable
from typing import Any, ParamSpec, TypeVar

from . import _native
from ._arguments import flag, function, is_url, of_table, whole, wrong_kind
from ._errors import InputError

__all__ = ["merge", "merge_to_file"]

_Given = ParamSpec("_Given")
_Made = TypeVar("_Made")


def _checked(call: Callable[_Given, _Made]) -> Callable[_Given, _Made]:
    @functools.wraps(call)
    def merged(*given: _Given.args, **named: _Given.kwargs) -> _Made:
        _check(merged.__name__, given, named)
        return call(*given, **named)

    # Found there again when it is unpickled.
    merged.__module__ = "surfrecon"
    return merged


def _check(call: str, given: tuple[Any, ...], named: dict[str, Any]) -> None:
    scans = given[0] if given else named.get("scans")
    if isinstance(scans, str | bytes | os.PathLike):
        problem = wrong_kind("scans", "a ScanSet or a list of scans", os.fspath(scans))
        raise TypeError(f"{problem}: open files with surfrecon.open({os.fspath(scans)!r})")
    path = given[1] if len(given) > 1 else named.get("path")
    if call == "merge_to_file" and isinstance(path, str | bytes | os.PathLike):
        _native._check_file_in_pieces(os.fsdecode(path))
    workspace = named.get("workspace")
    if isinstance(workspace, str) and is_url(workspace) and not os.path.isdir(workspace):
        raise InputError(f"{workspace}: the workspace must be a folder: URLs are for surfrecon.distributed.merge")
    if named.get("max_memory") is not None:
        whole("max_memory", named["max_memory"], " of bytes")
    for name in ("keep", "measure"):
        if name in named:
            flag(name, named[name])
    if named.get("part_triangles") is not None:
        whole("part_triangles", named["part_triangles"])
        of_table("part_triangles", named["part_triangles"], "write")
    function("progress", named.get("progress"))


merge = _checked(_native.merge)
merge_to_file = _checked(_native.merge_to_file)
