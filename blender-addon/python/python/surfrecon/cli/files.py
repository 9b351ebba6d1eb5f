"""Text files that appear whole or not at all."""

from __future__ import annotations

import contextlib
import os
import secrets
from typing import TextIO

from .._errors import FileError

__all__ = ["is_same", "write_text"]

_OPEN_FILES = "/proc/self/fd"


def write_text(path: str, text: str) -> None:
    """Writes a text file; one that was there is replaced at once, or untouched if writing fails.

    Raises:
        FileError: writing failed; nothing is left.
    """
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


def _write(file: TextIO, text: str) -> None:
    file.write(text)
    file.flush()
    os.fsync(file.fileno())


def is_same(path: str, other: str) -> bool:
    """Whether two names are of one file."""
    try:
        return os.path.samefile(path, other)
    except OSError:
        return False
