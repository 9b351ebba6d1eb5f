"""Which files a command reads, and their hashes."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterable, Iterator, Sequence

from .. import _native
from .stops import Stops

__all__ = ["hashed", "named", "of_scans"]

# Files beside a scan that place it: NAME.xf, NAME.ENDING.xf and so on.
_POSES = (".xf", ".tf", ".pose.txt")
_CHUNK = 1 << 20


def of_scans(given: Sequence[str], scans: Iterable[_native.Scan]) -> list[str]:
    """The files that scans are read from, each once, ordered.

    Those that were given, all in folders that were given, those that lists among them name, and those that place scans
    beside them.
    """
    found: set[str] = set()
    for path in given:
        found.update(_in_folder(path) if os.path.isdir(path) else [path])
    for scan in scans:
        path = os.fspath(scan.path)
        beside = [os.path.splitext(path)[0] + ending for ending in _POSES] + [path + ending for ending in _POSES]
        found.update(file for file in [path, *beside] if os.path.isfile(file))
    unique = {os.path.abspath(path): path for path in sorted(found, reverse=True)}
    return [unique[whole] for whole in sorted(unique)]


def _in_folder(folder: str) -> Iterator[str]:
    for where, folders, files in os.walk(folder):
        folders.sort()
        yield from (os.path.join(where, file) for file in files if os.path.isfile(os.path.join(where, file)))


def named(path: str) -> dict[str, str]:
    """A file's name as JSON has it: one that is not UTF-8 is no text, and is followed by its bytes in hexadecimal."""
    readable = os.fsencode(path).decode("utf-8", "replace")
    return {"path": readable} if readable == path else {"path": readable, "path_hex": os.fsencode(path).hex()}


def hashed(path: str, stops: Stops | None = None) -> dict[str, str | int]:
    """Name, size and SHA-256 of a file.

    Raises:
        OSError: it can't be read.
        Stopped: that was asked for.
    """
    digest, size = hashlib.sha256(), 0
    with open(path, "rb") as file:
        while chunk := file.read(_CHUNK):
            digest.update(chunk)
            size += len(chunk)
            if stops is not None:
                stops.check()
    return {**named(path), "bytes": size, "sha256": digest.hexdigest()}
