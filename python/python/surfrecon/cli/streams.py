"""Standard output and error: closed pipes, full disks, names that the encoding does not have."""

from __future__ import annotations

import codecs
import contextlib
import io
import os
import sys
from collections.abc import Iterator

from .advice import advised

__all__ = ["ClosedPipe", "OutputError", "drop", "finish", "prepare", "say", "tell"]


class ClosedPipe(Exception):
    """Nobody reads what the program says any more."""


class OutputError(Exception):
    """Standard output can't be written."""


def _as_bytes_or_escaped(problem: UnicodeError) -> tuple[str | bytes, int]:
    """Bytes of a file's name that are not UTF-8 as they are, what the encoding lacks as an escape."""
    try:
        return codecs.lookup_error("surrogateescape")(problem)
    except UnicodeError:
        return codecs.backslashreplace_errors(problem)


def prepare() -> None:
    """Makes standard streams safe to use. This is the first thing to do."""
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            # Or a result would be opened under the number of a stream that something prints to.
            with contextlib.suppress(OSError):
                os.open(os.devnull, os.O_RDWR)
    codecs.register_error("surfrecon", _as_bytes_or_escaped)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="surfrecon")


def say(text: str) -> None:
    """A line on standard output.

    Raises:
        ClosedPipe: nobody reads it.
        OutputError: it is closed, or its disk is full.
    """
    if sys.stdout is None:
        raise OutputError("the standard output is closed: give --report or --quiet")
    with _named():
        sys.stdout.write(text + "\n")


def tell(text: str, command: str = "") -> None:
    """A line on standard error, where that can be written: there is nowhere to say that it can't."""
    with contextlib.suppress(OSError, ValueError, AttributeError):
        sys.stderr.write(advised(text, command) + "\n")
        sys.stderr.flush()


def finish() -> None:
    """Writes what is left of standard output.

    Raises:
        ClosedPipe, OutputError: as `say`.
    """
    if sys.stdout is not None:
        with _named():
            sys.stdout.flush()


def drop() -> None:
    """Forgets what is left of standard output, or Python would try to write it once more when it ends, and complain."""
    for stream, name in ((sys.stdout, "stdout"), (sys.stderr, "stderr")):
        if stream is not None:
            with contextlib.suppress(OSError, ValueError):
                stream.flush()
                continue
            setattr(sys, name, None)
            # Its destructor flushes, too: to where everything goes.
            with contextlib.suppress(OSError, ValueError):
                os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


@contextlib.contextmanager
def _named() -> Iterator[None]:
    try:
        yield
    except BrokenPipeError:
        raise ClosedPipe from None
    except OSError as problem:
        raise OutputError(f"standard output: {problem.strerror}") from None
