"""Checks of arguments: an error names the argument, what it must be and what was given."""

from __future__ import annotations

import contextlib
import inspect
import operator
from collections.abc import Iterable
from typing import Any

from . import _native

__all__ = ["flag", "function", "is_url", "meant", "of_table", "unexpected", "whole", "wrong_kind"]


def is_url(path: str) -> bool:
    """Whether fsspec is asked for it."""
    return "://" in path


def flag(name: str, value: object) -> None:
    """Checks what is on or off.

    Raises:
        TypeError: it is neither.
    """
    # NumPy's own are taken as well.
    if not isinstance(value, bool) and str(getattr(value, "dtype", "")) != "bool":
        raise wrong_kind(name, "True or False", value)


def function(name: str, value: Any) -> None:
    """Checks what is called, if it is given.

    Raises:
        TypeError: it can't be called.
    """
    if value is not None and not callable(value):
        raise wrong_kind(name, "a function or None", value)


def whole(name: str, value: Any, unit: str = "") -> int:
    """A whole number, of Python or NumPy.

    Raises:
        TypeError: it is none.
    """
    try:
        return operator.index(value)
    except TypeError:
        raise wrong_kind(name, f"a whole number{unit}", value) from None


def of_table(name: str, value: object, *operations: str, others: Iterable[str] = ()) -> None:
    """Checks a parameter of the core. ``others`` are keywords that the function has besides.

    Raises:
        TypeError: there is no such parameter of these operations, or it is of another kind.
        ParameterError: it is out of its range.
    """
    for row in _native.parameters():
        if row.name == name and row.operation in operations:
            if value is not None:
                row.check(value)
            return
    known = [row.name for row in _native.parameters() if row.operation in operations]
    raise unexpected(operations[0], name, [*known, *others])


def meant(given: str, known: Iterable[str]) -> str:
    """The end of an error of an unknown name: the question whether the nearest known one was meant, or nothing."""
    near = _native._nearest(given, [*known])
    return f" Did you mean {near!r}?" if near else ""


def unexpected(function: str, name: str, known: Iterable[str]) -> TypeError:
    """The error of a keyword that a function does not take, with the one that was probably meant.

    Args:
        function: its name in the compiled module, of a method behind that of its class.
        name: what was given.
        known: parameters that it takes. Those that its signature shows by name come on top.
    """
    names = {*known}
    # A name that the module does not have is a function of Python's, whose caller says all it takes.
    with contextlib.suppress(AttributeError, ValueError):
        shown = inspect.signature(operator.attrgetter(function)(_native)).parameters.values()
        names |= {one.name for one in shown if one.kind in (one.KEYWORD_ONLY, one.POSITIONAL_OR_KEYWORD)}
        names.discard("self")
    means = meant(name, sorted(names)) or f" It takes {', '.join(sorted(names))}."
    return TypeError(f"{function}() got an unexpected keyword argument {name!r}.{means}")


def wrong_kind(name: str, allowed: str, value: object) -> TypeError:
    """The error for a value of another kind."""
    return TypeError(f"{name} must be {allowed}, got {value!r}")
