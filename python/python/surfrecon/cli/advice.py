"""Advice in terms of the command line: the library says it in those of Python.

Names of parameters become options, by the tables that the options are made of. A table here has what else the library
says and what is said instead. The longer ones come first: others are parts of them.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

__all__ = ["TABLE", "advised", "advised_all", "know"]

# Points are picked where scans are shown: the command line has none.
_PICKED = "(picked in Python, by surfrecon.Pick)"

TABLE = (
    (
        'start = "rough" looks near poses alone. Say "unknown" instead, or "sequence" for frames in their order',
        'start = "rough" looks near poses alone. Say start = "unknown" instead, or start = "sequence" for frames in'
        " their order",
    ),
    ('poses = "camera_to_world" or "world_to_camera"', "--poses camera_to_world or world_to_camera"),
    ('axes = "y_down" or "y_up"', "--axes y_down or y_up"),
    ("pixels = terrain_rgb or terrarium", "--pixels terrain_rgb or terrarium"),
    ("a pair of points", f"a pair of points {_PICKED}"),
    ("pairs of points", f"pairs of points {_PICKED}"),
    ("with surfrecon.write()", "with surfrecon convert"),
)

# Parts of a report that are sentences: names of scans and files are not touched.
_SENTENCES = ("error", "messages", "notes", "open", "reason", "summary", "warnings")

# Names of one word are words of English as well: they are names after what is done with a parameter, or before what it
# does.
_DONE = r"(?<=\braise )|(?<=\blower )|(?<=\bsmaller )|(?<=\blarger )|(?<= as )|(?<=\bchange )"
_DOES = r"(?= allows\b)|(?= asks\b)|(?=, [^\s,]+, is\b)"
# Neither parts of a path or of a longer name, nor quoted.
_BEGIN, _END = r"(?<![\w/.\"'-])", r"(?!\w|[/\"']|\.\w|-\w)"
_VALUE = r"\"(?P<quoted>\w+)\"|\((?P<several>[^()]*)\)|(?P<number>[\w+-][\w.+-]*\w|\w)"


def advised(text: str, command: str = "") -> str:
    """A text of the library with advice that can be followed here: by a command, or by another one, which is said."""
    for theirs, ours in TABLE:
        text = text.replace(theirs, ours)
    # Manifests have parameters by their names.
    if not _HAVING or command in ("batch", "task"):
        return text
    given, alone = _patterns()
    text = given.sub(lambda found: _option(found["name"], command, _value(found)), text)

    def named(found: re.Match[str]) -> str:
        # A word of English may be an option of another command by chance.
        is_other = command and found[0] in _NUMBERS and command not in _HAVING[found[0]]
        return found[0] if is_other else _option(found[0], command)

    return alone.sub(named, text)


def advised_all(report: Any, command: str = "", *, is_said: bool = False) -> Any:
    """A report with its sentences as they are said here."""
    if isinstance(report, str):
        return advised(report, command) if is_said else report
    if isinstance(report, dict):
        return {name: advised_all(part, command, is_said=name in _SENTENCES) for name, part in report.items()}
    if isinstance(report, list | tuple):
        return [advised_all(part, command, is_said=is_said) for part in report]
    return report


# The commands that have each option.
_HAVING: dict[str, list[str]] = {}


# Options of one word that are numbers: no sentence asks for more or less of others.
_NUMBERS: set[str] = set()


def know(command: str, options: Mapping[str, str]) -> None:
    """Takes the options of a command, with their kinds, for what advice may name."""
    for name, kind in options.items():
        _HAVING.setdefault(name, []).append(command)
        if "_" not in name and kind in ("angle", "count", "length", "number", "ratio"):
            _NUMBERS.add(name)
    _PATTERNS.clear()


# Made when they are first needed.
_PATTERNS: list[tuple[re.Pattern[str], re.Pattern[str]]] = []


def _patterns() -> tuple[re.Pattern[str], re.Pattern[str]]:
    """Parameters that are given a value, and those that are named alone."""
    if _PATTERNS:
        return _PATTERNS[0]
    names = sorted(_HAVING, key=len, reverse=True)
    any_of = "|".join(names)
    long = "|".join(name for name in names if "_" in name)
    short = "|".join(sorted(_NUMBERS, key=len, reverse=True))
    given = re.compile(rf"{_BEGIN}(?P<name>{any_of}) = (?:{_VALUE})")
    alone = rf"{_BEGIN}(?:{long}){_END}|(?:{_DONE})(?:{short}){_END}|{_BEGIN}(?:{short})(?:{_DOES})"
    _PATTERNS.append((given, re.compile(alone)))
    return _PATTERNS[0]


def _value(found: re.Match[str]) -> str:
    if found["several"] is not None:
        return " " + found["several"].replace(" ", "")
    return " " + (found["quoted"] or found["number"])


def _option(name: str, command: str, value: str = "") -> str:
    """An option, and whose it is if not of the command."""
    option, having = f"--{name.replace('_', '-')}{value}", _HAVING[name]
    return option if not command or command in having else f"{option} (of surfrecon {having[0]})"
