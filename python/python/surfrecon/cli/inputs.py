"""The files that a command reads, and their hashes."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

from .. import _native
from .._errors import InputError
from .members import with_members
from .stops import Stops

__all__ = ["hashed", "in_folders", "named", "of_names", "of_scans", "ordered", "path_of", "readable", "system"]

# Files beside a scan that place it: NAME.xf, NAME.ENDING.xf and so on.
_POSES = (".xf", ".tf", ".pose.txt")
# Files beside a scan that name its coordinate reference system: NAME.prj.
_SYSTEM = ".prj"
# Endings of files that name others.
_NAMING = (".gltf", ".glb", ".json", ".conf", ".mlp", ".aln")
_CHUNK = 1 << 20


def of_scans(given: Sequence[str], scans: Iterable[_native.Scan]) -> list[str]:
    """The files that were given, those that hold scans or that files name, and those beside them that place these."""
    found = {path for path in given if not os.path.isdir(path)}
    for scan in scans:
        path = os.fspath(scan.path)
        beside = _beside(path)
        found.update(file for file in [path, *beside] if os.path.isfile(file))
    return ordered(with_members(found))


def of_names(given: Sequence[str]) -> list[str]:
    """As `of_scans`, as far as it is known before anything is opened. Files in folders are left out."""
    found = with_members(path for path in given if not os.path.isdir(path))
    return found + [beside for path in found for beside in _beside(path) if os.path.isfile(beside)]


def _beside(path: str) -> list[str]:
    """The names of files beside one that say more of it."""
    stem = os.path.splitext(path)[0]
    return [name + ending for name in (path, stem) for ending in _POSES] + [stem + _SYSTEM]


def in_folders(given: Sequence[str]) -> list[str]:
    """All files in the folders that were given: recordings and lists have files of their own there."""
    found = [file for path in given if os.path.isdir(path) for file in _in_folder(path)]
    # Not each image of thousands is opened for what it may name.
    return ordered([*found, *with_members(file for file in found if file.lower().endswith(_NAMING))])


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
    text = readable(path)
    return {"path": text} if text == path else {"path": text, "path_hex": os.fsencode(path).hex()}


def path_of(file: dict[str, Any]) -> str:
    """The name that `named` had made an entry of."""
    return os.fsdecode(bytes.fromhex(file["path_hex"])) if "path_hex" in file else file["path"]


def readable(text: str) -> str:
    """Text as JSON can have it: U+FFFD for each byte of a name that is not UTF-8."""
    try:
        return os.fsencode(text).decode("utf-8", "replace")
    except UnicodeError:
        return text.encode("utf-8", "replace").decode("utf-8")


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


def system(text: str) -> str:
    """A coordinate reference system as it was given: its text, or a file (.prj, .wkt) that holds it.

    Raises:
        InputError: there is no such file, or it holds no text, or it is empty.
    """
    found = text
    if text.lower().endswith((".prj", ".wkt")):
        try:
            found = Path(text).read_text("utf-8")
        except (OSError, UnicodeDecodeError) as error:
            raise InputError(f"{text}: no coordinate reference system can be read from it: {error}") from None
    if not found.strip():
        problem = "names no coordinate reference system: give well-known text, or a code as EPSG:25832"
        raise InputError(f'"{text}" {problem}')
    return found
