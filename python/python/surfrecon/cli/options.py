"""Options of commands: those of the core's table of parameters, and the few that a command has besides."""

from __future__ import annotations

import argparse
import math
from dataclasses import dataclass, field
from typing import Any, Protocol

from .. import _native
from .._errors import ParameterError

__all__ = ["Own", "Row", "add", "parsed", "read", "rows"]


class Row(Protocol):
    """The facts that the command line needs of an option. `surfrecon.Parameter` has them."""

    @property
    def name(self) -> str: ...  # noqa: D102
    @property
    def kind(self) -> str: ...  # noqa: D102
    @property
    def text(self) -> str: ...  # noqa: D102
    @property
    def choices(self) -> list[tuple[str, str, str]]: ...  # noqa: D102
    def check(self, value: object) -> None: ...  # noqa: D102


@dataclass(frozen=True)
class Own:
    """An option that is no parameter of the core.

    A ``flag``, ``text``, a ``file`` or ``folder``, a ``count``, ``counts`` or ``numbers``.
    ``length`` is how many values the last two have, or 0 for any number. Numbers that are ``angles`` may be degrees.
    """

    name: str
    kind: str
    text: str
    metavar: str = ""
    length: int = 0
    angles: bool = False
    choices: list[tuple[str, str, str]] = field(default_factory=list)

    def check(self, value: object) -> None:
        """Checks a value.

        Raises:
            ParameterError: it is none of this kind.
        """
        is_text = isinstance(value, str)
        known = {
            "flag": isinstance(value, bool),
            "text": is_text,
            "file": is_text and value != "" and "\0" not in str(value),
            "folder": is_text and value != "" and "\0" not in str(value),
            "count": self._is_number(value),
        }
        if not known.get(self.kind, isinstance(value, list) and all(map(self._is_number, value))):
            raise ParameterError(f"{self.name} must be {self.allowed}, got {_shown(value)}")
        if isinstance(value, list) and len(value) != (self.length or len(value)) or value == []:
            raise ParameterError(f"{self.name} must be {self.allowed}, got {len(value)}")

    def _is_number(self, value: object) -> bool:
        if isinstance(value, bool):
            return False
        if self.kind in ("count", "counts"):
            return isinstance(value, int) and 0 <= value <= _MOST
        return isinstance(value, int | float) and _is_finite(value)

    @property
    def allowed(self) -> str:
        """The values that it may have, in words."""
        many = f"{self.length} " if self.length else ""
        words = {
            "flag": "on or off",
            "text": "text",
            "file": "the name of a file",
            "folder": "the name of a folder",
            "count": f"a whole number >= 0 and <= {_MOST}",
            "counts": f"{many}whole numbers >= 0 and <= {_MOST}",
            "numbers": f"{many}numbers",
        }
        return words[self.kind]


# Nothing has more scans or vertices.
_MOST = 2**32 - 1


def _is_finite(value: float) -> bool:
    try:
        return math.isfinite(value)
    except OverflowError:
        return False


def _shown(value: object) -> str:
    """A value in an error: not all of its digits."""
    try:
        text = repr(value)
    except ValueError:
        return "a number of thousands of digits"
    return text if len(text) <= _LONGEST_SHOWN else f"{text[:_LONGEST_SHOWN]}..."


_LONGEST_SHOWN = 200


def rows(*operations: str) -> list[_native.Parameter]:
    """The parameters of operations."""
    return [row for operation in operations for row in _native.parameters(operation)]


def read(row: Row, text: str) -> Any:
    """The value of an option as the command line has it.

    Raises:
        ParameterError: it lies outside of the range, or is none of this kind. The text names option and range.
    """
    if row.kind in ("choice", "text", "file", "folder"):
        value: Any = text
    elif row.kind in ("counts", "numbers"):
        value = [_number(row, part) for part in text.split(",")]
    else:
        value = _number(row, text)
    try:
        row.check(value)
    except ParameterError:
        if _is_angle(row) and isinstance(value, float):
            raise _refused(row, value) from None
        raise
    return value


def _number(row: Row, text: str) -> Any:
    try:
        if row.kind in ("count", "counts"):
            return int(text)
        if _is_angle(row) and text.endswith("deg"):
            return math.radians(float(text.removesuffix("deg")))
        return float(text)
    except ValueError:
        raise _refused(row, text) from None


def _is_angle(row: Row) -> bool:
    return row.kind == "angle" or getattr(row, "angles", False)


def _refused(row: Row, value: object) -> ParameterError:
    allowed = getattr(row, "allowed", "a number")
    whole = "a whole number " if row.kind == "count" and not isinstance(row, Own) else ""
    unit = ", in radians or in degrees as 80deg" if _is_angle(row) else ""
    return ParameterError(f"{row.name} must be {whole}{allowed}{unit}, got {_shown(value)}")


def parsed(row: Row, value: Any) -> Any:
    """The value of an option as a manifest has it: as in TOML, or, for angles in degrees, as on the command line.

    Raises:
        ParameterError: it lies outside of the range, or is none of this kind.
    """
    if _is_angle(row):
        if isinstance(value, str):
            return read(row, value)
        if isinstance(value, list):
            value = [_number(row, part) if isinstance(part, str) else part for part in value]
    # The core takes true for 1 where a number is asked for.
    if isinstance(value, bool) and row.kind != "flag":
        raise _refused(row, value)
    try:
        row.check(value)
    except (TypeError, OverflowError):
        raise _refused(row, value) from None
    if row.kind == "numbers":
        return [float(number) for number in value]
    return value


def add(group: argparse._ArgumentGroup, row: Row) -> None:
    """Adds an option. One that is not given leaves nothing behind, so that the core's own default holds."""
    flag = f"--{row.name.replace('_', '-')}"
    given: dict[str, Any] = {"dest": row.name, "default": argparse.SUPPRESS, "help": _help(row)}
    if row.kind == "flag":
        # A flag of ours is off unless it is given, one of the core may be on.
        action = "store_true" if isinstance(row, Own) else argparse.BooleanOptionalAction
        group.add_argument(flag, action=action, **given)
        return

    def value(text: str) -> Any:
        try:
            return read(row, text)
        except ParameterError as problem:
            raise argparse.ArgumentTypeError(str(problem)) from None

    if row.kind == "choice":
        given["choices"] = [name for name, _, _ in row.choices]
    group.add_argument(flag, type=value, metavar=_metavar(row), **given)


_METAVARS = {
    "length": "LENGTH",
    "angle": "ANGLE",
    "ratio": "NUMBER",
    "count": "N",
    "counts": "N,N,...",
    "text": "TEXT",
    "file": "FILE",
    "folder": "DIR",
}


def _metavar(row: Row) -> str:
    if row.kind == "choice":
        return "{" + ",".join(name for name, _, _ in row.choices) + "}"
    return getattr(row, "metavar", "") or _METAVARS[row.kind]


def _help(row: Row) -> str:
    """The text, what each choice means, the range and the default, all as the core has them."""
    parts = [row.text]
    if isinstance(row, _native.Parameter):
        if row.off:
            parts.append(f"{'Off' if row.kind == 'flag' else '0'}: {row.off}.")
        parts += [f"{name}: {text}" for name, _, text in row.choices]
        if row.kind in ("length", "angle", "ratio", "count") and math.isfinite(row.minimum):
            parts.append(f"Allowed: {row.allowed.removeprefix('a finite number ')}{_UNITS.get(row.kind, '')}.")
        parts.append(f"Default: {_default(row)}.")
    # argparse takes a percent sign for a mark of its own.
    return " ".join(parts).replace("%", "%%")


_UNITS = {"length": ", in the unit of the scans", "angle": ", in radians, or in degrees as 80deg"}


def _default(row: _native.Parameter) -> str:
    if row.default is None:
        return str(row.default_from)
    if isinstance(row.default, bool):
        return "on" if row.default else "off"
    if not isinstance(row.default, float):
        return str(row.default)
    # A rounded number may be more than is allowed, as that of a right angle is.
    short = f"{row.default:.10g}"
    return short if float(short) == row.default else repr(row.default)
