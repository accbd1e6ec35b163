"""Tables of what the simulator offers by name: studies and instruments."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Protocol, TypeVar

from sim.errors import TableError


class Named(Protocol):
    """A line of a table."""

    @property
    def name(self) -> str:
        """What a user calls it."""

    @property
    def module(self) -> str:
        """Where it is written."""


Line = TypeVar("Line", bound=Named)


def by_name(table: str, lines: Iterable[Line]) -> dict[str, Line]:
    """The lines of a ``table`` by their names, in their order.

    Raises
    ------
    TableError
        When two lines have one name.
    """
    found: dict[str, Line] = {}
    for line in lines:
        if line.name in found:
            modules = f"{found[line.name].module} and {line.module}"
            raise TableError(f"table of {table}: expected one line of each name, got {line.name!r} in {modules}")
        found[line.name] = line
    return found
