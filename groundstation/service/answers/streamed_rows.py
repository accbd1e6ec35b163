"""Answers that are streams: rows in the order in which they came, numbered, asked for from a number on."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Protocol, TypeVar

from groundstation.errors import SelectorError

Parameters = dict[str, str]
STREAMED = ("since", "limit")  # parameters of every stream
MOST = 10_000  # rows of one answer


class NumberedRow(Protocol):
    """A row of a stream."""

    @property
    def seq(self) -> int:
        """Its place in the stream."""


Row = TypeVar("Row", bound=NumberedRow)


def select_rows(rows: Iterable[Row], newest: int, p: Parameters) -> list[Row]:
    """Rows after the number ``since``, at most ``limit`` of them, by their ``seq``.

    Raises
    ------
    SelectorError
        When a parameter is not a number of this stream: after a restart the numbers begin anew.
    """
    since, limit = window_limits(newest, p)
    after = sorted((row for row in rows if row.seq > since), key=lambda row: row.seq)
    return after[:limit]


def window_limits(newest: int, p: Parameters) -> tuple[int, int]:
    """The number ``since``, and the ``limit`` of the rows after it; errors as ``select_rows``."""
    return _whole("since", p, 0, newest), _whole("limit", p, MOST, MOST)


def is_streamed(p: Parameters) -> bool:
    """Whether rows are asked for in the order of their coming."""
    return any(name in p for name in STREAMED)


def _whole(name: str, p: Parameters, default: int, most: int) -> int:
    text = p.get(name)
    if text is None:
        return default
    if not text.isdecimal() or len(text) > 18 or int(text) > most:
        why = "; numbers begin anew when the ground station starts" if name == "since" else ""
        raise SelectorError(f"parameter {name}: expected a whole number up to {most}{why}, got {text!r:.40}")
    return int(text)
