"""One run of a command: what it was asked, the files that it reads, and how it is stopped."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

from .. import _native
from .._errors import FileError
from .._report import Report
from . import inputs
from .files import identity, is_report, is_same, refuse_unwritable
from .options import rows
from .progress import Shown
from .requests import Request, UsageError
from .stops import Stops

__all__ = ["Made", "Work"]

# Writes a result into a file: its name, progress, and what is to be said in it of where it is from.
Write = Callable[[str, Shown, dict[str, Any] | None], None]


@dataclass(frozen=True)
class Made:
    """The result of a command, before it is written."""

    report: Report
    # For people, a line each.
    lines: list[str]
    write: Write | None = None
    # The files that `write` writes besides the one it is told.
    beside: Callable[[str], list[str]] = lambda path: []


@dataclass
class Work:
    """A run of a command."""

    request: Request
    shown: Shown
    stops: Stops
    # Whether files are hashed, for provenance and report.
    hashes: bool
    # Other files that the run will write, besides its output.
    also: Sequence[str] = ()
    # Files of others, which the run may not write besides its output.
    kept: Callable[[], Sequence[str]] = lambda: ()
    # Notes for people, each once.
    notes: list[str] = field(default_factory=list)
    # The files that are read, and what is known of each.
    files: list[str] = field(default_factory=list)
    known: list[dict[str, Any]] = field(default_factory=list)

    def open(self, paths: Sequence[str] | None = None, *, unplaced: bool = False) -> _native.ScanSet:
        """The scans of files, not read yet: of all that were given, or of some.

        Args:
            paths: the files and folders. Default: all that were given.
            unplaced: the scans are to be aligned, so that lists of poses in folders keep none of them out.

        Raises:
            UsageError: a file would be read and written.
            SurfreconError: they can't be opened.
        """
        paths = list(self.request.inputs if paths is None else paths)
        given = self.request.of("camera", "crs")
        if "crs" in given:
            given["crs"] = inputs.system(given["crs"])
        scans = _native._open_many(paths, unplaced=unplaced, **self.given("open"), **given)
        self.note(*scans.notes)
        read, written = inputs.of_scans(paths, scans), [*filter(None, [self.request.output]), *self.also]
        self.refuse(written, read)
        held = inputs.in_folders(paths)
        # Of a recording that is read more than its scans is, so that there reports replace reports alone.
        self.refuse([path for path in self.also if not is_report(path)], held)
        # A file that this run writes into a folder is no scan of it, or it would have been refused.
        own = {identity(path) for path in written}
        found = [path for path in held if identity(path) not in own]
        files = [path for path in inputs.ordered([*read, *found]) if path not in self.files]
        self.files += files
        if self.hashes:
            with self.showing():
                for k, path in enumerate(files):
                    self.shown("hashing", k / len(files))
                    self.known.append(_hashed(path, self.stops))
        return scans

    def note(self, *texts: str) -> None:
        """Notes what people should know. The log may have told it before, after the name of what it is about."""
        for text in texts:
            if not any(note == text or note.endswith(f": {text}") for note in self.notes):
                self.notes.append(text)

    @contextmanager
    def listening(self) -> Iterator[None]:
        """Calls whose warnings become notes."""
        logger, listener = logging.getLogger("surfrecon"), _Listener(self)
        logger.addHandler(listener)
        try:
            yield
        finally:
            logger.removeHandler(listener)

    def refuse(self, written: Sequence[str], files: Sequence[str] | None = None) -> None:
        """Refuses to write over what is read.

        Raises:
            UsageError: a file is among both.
        """
        read = {identity(file) for file in (self.files if files is None else files)}
        for path in written:
            if identity(path) in read:
                raise UsageError(f"{path} is read: give the output another name")

    def refuse_beside(self, beside: Sequence[str]) -> None:
        """Refuses to write, besides the output, what is not to be replaced.

        Raises:
            UsageError: one is the report, or another job's.
            FileError: one is read-only.
        """
        kept = {identity(path) for path in self.kept()} if beside else set()
        for path in beside:
            if any(is_same(path, other) for other in self.also):
                raise UsageError(f"{path}: the report needs a name of its own")
            if identity(path) in kept:
                raise UsageError(
                    f"{path}, which is written beside the output, is another job's: write to another folder"
                )
            refuse_unwritable(path)

    def given(self, *operations: str) -> dict[str, Any]:
        """The parameters of operations that were given."""
        return self.request.of(*(row.name for row in rows(*operations)))

    @contextmanager
    def showing(self) -> Iterator[Shown]:
        """A call whose progress is shown."""
        with self.shown as shown:
            yield shown


class _Listener(logging.Handler):
    """Notes what the library warns of."""

    def __init__(self, work: Work) -> None:
        super().__init__(logging.WARNING)
        self._work = work

    def emit(self, record: logging.LogRecord) -> None:
        self._work.note(record.getMessage())


def _hashed(path: str, stops: Stops) -> dict[str, Any]:
    try:
        return inputs.hashed(path, stops)
    except OSError as problem:
        raise FileError(f"{path}: {problem.strerror}") from None
