"""Requests to a command, on the command line or by a manifest."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

__all__ = ["Request", "UsageError"]


class UsageError(Exception):
    """A request of the command line, or of a manifest, that can't be met."""


@dataclass(frozen=True)
class Request:
    """A command with its files and the parameters that were given."""

    command: str
    inputs: list[str]
    output: str | None = None
    parameters: dict[str, Any] = field(default_factory=dict)

    def of(self, *names: str) -> dict[str, Any]:
        """The parameters among these that were given: keyword arguments of a function that takes them."""
        return {name: self.parameters[name] for name in names if name in self.parameters}
