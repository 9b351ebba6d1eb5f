"""Ctrl-C, and other signals that ask a program to end: at any time, leaving nothing behind."""

from __future__ import annotations

import signal
import sys
from types import FrameType
from typing import Any

__all__ = ["Stopped", "Stops"]

_NAMES = ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK")


class Stopped(BaseException):
    """The program was asked to end."""

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.number = number

    @property
    def exit_code(self) -> int:
        """As shells tell it of a program that a signal ended: 130 for Ctrl-C."""
        return 128 + self.number


class Stops:
    """Turns signals into `Stopped` while a command works. It does so once, so nothing interrupts what is done about it.

    While it is deferred a signal only sets `asked`, and progress cancels: once a result is being written either the
    command was stopped and has left nothing, or all that it writes is there, its report too. It begins deferred.
    """

    def __init__(self) -> None:
        self.asked = 0
        self._deferred = True
        self._before: dict[int, Any] = {}

    def __enter__(self) -> Stops:
        """Begins to listen, but not for signals that the caller ignores: those of programs in the background."""
        sys.unraisablehook = self._not_raised
        for number in (getattr(signal, name, None) for name in _NAMES):
            if number is not None and signal.getsignal(number) is not signal.SIG_IGN:
                self._before[number] = signal.signal(number, self._hear)
        return self

    def __exit__(self, *_: object) -> None:
        """Has the program end as it was decided: what was asked for is done, or was stopped, whatever comes now."""
        self._deferred = True
        for number in self._before:
            signal.signal(number, signal.SIG_IGN)

    def _hear(self, number: int, _: FrameType | None) -> None:
        self.asked = number
        if not self._deferred:
            self._deferred = True
            raise Stopped(number)

    def _not_raised(self, problem: Any) -> None:
        """Takes the place of Python's hook for errors that can't be raised: a stop waits until it can be raised."""
        if problem.exc_type is Stopped:
            self._deferred = False
        else:
            sys.__unraisablehook__(problem)

    def defer(self) -> None:
        """From now on only progress stops what runs."""
        self._deferred = True

    def resume(self) -> None:
        """Ends what `defer` began.

        Raises:
            Stopped: that was asked for meanwhile.
        """
        self._deferred = False
        self.check()

    def check(self) -> None:
        """Stops if that was asked for.

        Raises:
            Stopped: it was.
        """
        if self.asked and not self._deferred:
            self._deferred = True
            raise Stopped(self.asked)
