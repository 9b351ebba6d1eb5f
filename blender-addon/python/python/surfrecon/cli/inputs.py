"""Which files a command reads, and their hashes."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterable, Iterator, Sequence

from .. import _native
from .stops import Stops

__all__ = ["hashed", "in_folders", "named", "of_scans", "ordered"]

# Files beside a scan that place it: NAME.xf, NAME.ENDING.xf and so on.
_POSES = (".xf", ".tf", ".pose.txt")
_CHUNK = 1 << 20


def of_scans(given: Sequence[str], scans: Iterable[_native.Scan]) -> list[str]:
    """The files that were given, those that hold scans, and those beside them that place these."""
    found = {path for path in given if not os.path.isdir(path)}
    for scan in scans:
        path = os.fspath(scan.path)
        beside = [os.path.splitext(path)[0] + ending for ending in _POSES] + [path + ending for ending in _POSES]
        found.update(file for file in [path, *beside] if os.path.isfile(file))
    return ordered(found)


def in_folders(given: Sequence[str]) -> list[str]:
    """All files in the folders that were given: recordings and lists have files of their own there."""
    return ordered(file for path in given if os.path.isdir(path) for file in _in_folder(path))


def ordered(files: Iterable[str]) -> list[str]:
    """Each file once, in the order of their names."""
    unique = {os.path.abspath(path): path for path in sorted(files, reverse=True)}
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
