"""Text files that appear whole or not at all."""

from __future__ import annotations

import contextlib
import os
import secrets
import stat
from typing import TextIO

from .._errors import FileError, InputError

__all__ = ["identity", "is_report", "is_same", "refuse_unwritable", "write_text"]

_OPEN_FILES = "/proc/self/fd"


def is_report(path: str) -> bool:
    """Whether a file is a report of this program, by how it begins."""
    try:
        # A pipe would be waited for.
        if not os.path.isfile(path):
            return False
        with open(path, "rb") as file:
            start = file.read(100)
            return start.startswith(b"{") and b'"program": "surfrecon"' in start
    except OSError:
        return False


def write_text(path: str, text: str) -> None:
    """Writes a text file. A file that was there is replaced at once. It stays untouched if writing fails.

    Its permissions stay.

    Raises:
        FileError: writing failed. Nothing is left.
        InputError: as `refuse_unwritable`.
    """
    refuse_unwritable(path, devices=True)
    try:
        # A device or a pipe stays what it is.
        if os.path.exists(path) and not os.path.isfile(path):
            with open(path, "w", encoding="utf-8") as file:
                file.write(text)
        else:
            # So does a link.
            _replace(os.path.realpath(path), text)
    except OSError as problem:
        failed = FileError(f"{path}: {problem.strerror}")
        failed.errno, failed.filename = problem.errno, path
        raise failed from None


def _replace(path: str, text: str) -> None:
    folder = os.path.dirname(path)
    named = os.path.join(folder, f".surfrecon-{secrets.token_hex(6)}.part")
    try:
        name = _named_when_whole(folder, (path, named), text)
        if name is None:
            with open(named, "x", encoding="utf-8") as file:
                _keep_permissions(file, path)
                _write(file, text)
        if name != path:
            os.replace(named, path)
    except BaseException:
        with contextlib.suppress(OSError):
            os.remove(named)
        raise


def _named_when_whole(folder: str, names: tuple[str, ...], text: str) -> str | None:
    """Writes a file that gets the first free name when it is whole, so that a killed program leaves nothing.

    ``None`` where the system has no such files.
    """
    nameless = getattr(os, "O_TMPFILE", 0)
    if not nameless or not os.path.isdir(_OPEN_FILES):
        return None
    try:
        number = os.open(folder, nameless | os.O_WRONLY, 0o666)
    except OSError:
        return None
    with os.fdopen(number, "w", encoding="utf-8") as file:
        _keep_permissions(file, names[0])
        _write(file, text)
        for name in names:
            try:
                # Only with a folder, which an absolute name has no use for, Python follows the link.
                os.link(f"{_OPEN_FILES}/{number}", name, src_dir_fd=number, follow_symlinks=True)
            except FileExistsError:
                continue
            except OSError:
                return None
            return name
    return None


def _keep_permissions(file: TextIO, path: str) -> None:
    """Those of the file that is replaced, if there is one."""
    # Some systems can't, as Windows before Python 3.13. They have only the mark of being read-only, which was refused.
    if hasattr(os, "fchmod"):
        with contextlib.suppress(FileNotFoundError):
            os.fchmod(file.fileno(), stat.S_IMODE(os.stat(path).st_mode))


def _write(file: TextIO, text: str) -> None:
    file.write(text)
    file.flush()
    os.fsync(file.fileno())


def is_same(path: str, other: str) -> bool:
    """Whether two names are of one file, be it there or not."""
    return identity(path) == identity(other)


def identity(path: str) -> tuple[int, int] | str:
    """The identity that all names of a file share, hard links too. Of a file that is not there yet, its place."""
    try:
        known = os.stat(path)
    except OSError:
        return os.path.normcase(os.path.realpath(path))
    return (known.st_dev, known.st_ino)


def refuse_unwritable(path: str, devices: bool = False) -> None:
    """Refuses before hours of work what could not be written after them, by the rules of the core's writers.

    Args:
        path: the file.
        devices: whether it may be a device or a pipe.

    Raises:
        InputError: it is a folder, a device or one of several names of a file, or its folder is missing.
        FileError: it or its folder is read-only.
    """
    if os.path.isdir(path) or not os.path.basename(path):
        raise InputError(f"{path}: this is a folder: give the name of a file in it")
    folder = os.path.dirname(os.path.realpath(path) if os.path.islink(path) else path) or "."
    if not os.path.isdir(folder):
        raise InputError(f"{path}: there is no folder {folder}: make it first")
    try:
        known = os.stat(path)
    except OSError:
        known = None
    if (known is None or stat.S_ISREG(known.st_mode)) and not os.access(folder, os.W_OK | os.X_OK):
        raise FileError(f"{path}: no file can be made in the folder {folder}: choose another one")
    if known is None:
        return
    if not stat.S_ISREG(known.st_mode):
        if devices:
            return
        raise InputError(f"{path}: this is no file but a device, a pipe or the like, and is left alone")
    if not known.st_mode & (stat.S_IWUSR | stat.S_IWGRP | stat.S_IWOTH):
        raise FileError(f"{path}: the file is read-only")
    if known.st_nlink > 1:
        raise InputError(
            f"{path}: this file has {known.st_nlink} names (hard links), which writing would part: remove this name "
            "first, or write to another"
        )
