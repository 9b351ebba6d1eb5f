"""A report: figures by name and by key. ``report.voxel`` is ``report["voxel"]``."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from typing import Any

from ._arguments import meant

__all__ = ["Report", "jsonable"]


def _turns_and_slides(freedoms: list[Report]) -> list[tuple[str, Any, Any]]:
    return [("turn" if one.turns else "slide", one.direction, one.point) for one in freedoms]


# Former names of figures: today's name, and the former value out of today's. They stay for one minor version.
_FORMER: dict[str, tuple[str, Callable[[Any], Any]]] = {"free": ("freedoms", _turns_and_slides)}


class Report(dict[str, Any]):
    """Figures of a call: a dictionary whose keys are attributes as well.

    >>> report = surfrecon.merge(scans).report
    >>> report.scans, report["scans"]
    (6, 6)
    >>> text = report.json(indent=2)
    """

    # Without a dictionary of its own an attribute can't be set to anything that the key is not.
    __slots__ = ()

    def __getattr__(self, name: str) -> Any:
        """The figure of that name."""
        if self._has_former(name):
            return self._former(name)
        try:
            return self[name]
        except KeyError as error:
            raise AttributeError(error.args[0], name=name, obj=self) from None

    def __missing__(self, name: Any) -> Any:
        """The figure that is called so no longer. Of any other name it says which was probably meant."""
        if self._has_former(name):
            return self._former(name)
        instead = meant(name, self) if isinstance(name, str) else ""
        raise KeyError(f"{type(self).__name__} has no {name!r}.{instead or ' There are ' + ', '.join(self) + '.'}")

    def _has_former(self, name: Any) -> bool:
        return name in _FORMER and name not in self and _FORMER[name][0] in self

    def _former(self, name: str) -> Any:
        today, value = _FORMER[name]
        text = f"{name} of {type(self).__name__} is called {today} now"
        warnings.warn(text, DeprecationWarning, stacklevel=3)
        return value(self[today])

    def __dir__(self) -> list[str]:
        """Names of figures and methods."""
        return sorted({*super().__dir__(), *self})

    def __repr__(self) -> str:
        """The figures in one line. Arrays and lists of reports are shown by how many there are."""
        return f"{type(self).__name__}({', '.join(f'{name}={_short(value)}' for name, value in self.items())})"

    def __str__(self) -> str:
        """A figure a line."""
        return "\n".join(f"{name}: {_short(value)}" for name, value in self.items())

    def as_dict(self) -> dict[str, Any]:
        """Plain dictionaries all the way down."""
        plain = _plain(self)
        assert isinstance(plain, dict)
        return plain

    def json(self, *, indent: int | None = None) -> str:
        """As JSON: arrays are lists, numbers that aren't finite ``null``."""
        import json

        return json.dumps(jsonable(self), indent=indent, allow_nan=False)


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {name: _plain(entry) for name, entry in value.items()}
    if isinstance(value, list):
        return [_plain(entry) for entry in value]
    return value


def _short(value: Any) -> str:
    if hasattr(value, "shape"):
        return f"<array {' x '.join(map(str, value.shape))}>"
    if isinstance(value, list) and value and isinstance(value[0], Report):
        return f"<{len(value)} {type(value[0]).__name__}>"
    return repr(value)


def jsonable(value: Any) -> Any:
    """A value as JSON can hold it: arrays as lists, numbers that aren't finite as ``None``."""
    if isinstance(value, dict):
        return {str(name): jsonable(entry) for name, entry in value.items()}
    # Arrays of NumPy and their numbers; NumPy is not loaded before it is needed.
    if hasattr(value, "tolist"):
        return jsonable(value.tolist())
    if isinstance(value, list | tuple):
        return [jsonable(entry) for entry in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
