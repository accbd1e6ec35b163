"""Messages of one kind in the order of their coming, numbered from 1; the newest are kept. No I/O."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from typing import Generic, TypeVar

Row = TypeVar("Row")


class NumberedRows(Generic[Row]):
    """The newest rows.

    Parameters
    ----------
    kept : rows

    Attributes
    ----------
    newest : number of the row that came last; 0 before any
    """

    def __init__(self, kept: int) -> None:
        self.newest = 0
        self._rows: deque[Row] = deque(maxlen=kept)

    def __iter__(self) -> Iterator[Row]:
        return iter(self._rows)

    def __len__(self) -> int:
        return len(self._rows)

    def __getitem__(self, place: int) -> Row:
        return self._rows[place]

    def append_row(self, row: Row) -> None:
        """Add a row."""
        self.newest += 1
        self._rows.append(row)

    def numbered(self) -> Iterator[tuple[int, Row]]:
        """Rows with their numbers."""
        return enumerate(self._rows, self.newest - len(self._rows) + 1)
