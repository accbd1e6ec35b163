"""Records as kernels see them: fields are attributes, a number is Python's own, and what is written reaches the array.

Numba gives a kernel all three; numpy's records have items alone. Nothing is copied but single numbers.
"""

from __future__ import annotations

from typing import Any

import numpy as np


class RecordView:
    """One record, as a kernel sees it."""

    __slots__ = ("_record",)

    def __init__(self, record: Any) -> None:
        object.__setattr__(self, "_record", record)

    def __getattr__(self, name: str) -> Any:
        """A field: a number, the view of a record or of records, or an array."""
        try:
            return view_of(self._record[name])
        except ValueError:
            raise AttributeError(name) from None

    def __setattr__(self, name: str, value: Any) -> None:
        """Write a number, or all of an array."""
        self._record[name] = value


class RecordsView:
    """An array of records, as a kernel sees it."""

    __slots__ = ("_records",)

    def __init__(self, records: Any) -> None:
        self._records = records

    @property
    def shape(self) -> tuple[int, ...]:
        """As of the array."""
        shape: tuple[int, ...] = self._records.shape
        return shape

    def __len__(self) -> int:
        """Records of it."""
        return len(self._records)

    def __getitem__(self, place: Any) -> Any:
        """One record, some of them, or a field of all."""
        return view_of(self._records[place])

    def view(self, kind: Any) -> Any:
        """The same bytes as another kind."""
        return view_of(self._records.view(kind))


def view_of(value: Any) -> Any:
    """What a kernel sees in the place of ``value``; anything but records and numpy's numbers is itself."""
    if isinstance(value, np.void):
        return RecordView(value)
    if isinstance(value, np.ndarray):
        return value if value.dtype.names is None else RecordsView(value)
    return value.item() if isinstance(value, np.generic) else value
