"""Progress on standard error, where that is a terminal and tqdm is installed."""

from __future__ import annotations

import contextlib
import sys
from types import TracebackType
from typing import Any

from .stops import Stops

__all__ = ["Shown", "load"]


def load() -> None:
    """Loads what bars need, where there will be any."""
    if is_terminal():
        with contextlib.suppress(ImportError):
            import tqdm.auto  # noqa: F401


class Shown:
    """The ``progress`` of the calls of a command, one after the other: each shows a bar that is gone when it ends."""

    def __init__(self, stops: Stops, quiet: bool) -> None:
        self._stops = stops
        self._wanted = not quiet and is_terminal()
        self._bar: Any = None

    def __call__(self, stage: str, fraction: float) -> bool:
        """Shows a stage. Returns ``False`` once the program was asked to end."""
        if self._bar is not None:
            # A terminal that is gone is no reason to stop.
            with contextlib.suppress(OSError, ValueError):
                self._bar(stage, fraction)
        return not self._stops.asked

    def __enter__(self) -> Shown:
        """Begins a call."""
        if self._wanted:
            with contextlib.suppress(ImportError, OSError, ValueError):
                from ..bar import Bar

                self._bar = Bar(file=sys.stderr, leave=False)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, problem: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Ends it."""
        bar, self._bar = self._bar, None
        if bar is not None:
            with contextlib.suppress(OSError, ValueError):
                bar.__exit__(kind, problem, trace)


def is_terminal() -> bool:
    """Whether standard error is one."""
    try:
        return sys.stderr.isatty()
    except (AttributeError, ValueError):
        return False
