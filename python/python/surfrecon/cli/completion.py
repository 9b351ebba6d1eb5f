"""Scripts that complete commands, options and files, made by shtab of the parser itself."""

from __future__ import annotations

import argparse

from .._errors import InputError
from .parser import parser

__all__ = ["script"]

_FILES = {"inputs", "output", "report", "manifest"}


def script(shell: str) -> str:
    """The script for a shell.

    Raises:
        InputError: shtab is not installed.
    """
    try:
        import shtab
    except ImportError:
        raise InputError("completion needs shtab: pip install 'surfrecon[cli]'") from None
    whole = parser()
    for one in _all(whole):
        for action in one._actions:
            if action.dest in _FILES:
                action.complete = shtab.FILE  # type: ignore[attr-defined]
            elif action.dest == "workspace":
                action.complete = shtab.DIRECTORY  # type: ignore[attr-defined]
    return str(shtab.complete(whole, shell=shell))


def _all(whole: argparse.ArgumentParser) -> list[argparse.ArgumentParser]:
    """A parser and those of its commands."""
    commands = [action for action in whole._actions if isinstance(action, argparse._SubParsersAction)]
    return [whole, *(one for action in commands for one in action.choices.values())]
