"""What is written as bytes only where somebody needs them: on the native profile of CAN nobody does."""

from __future__ import annotations

from abc import ABC, abstractmethod


class Unwritten(ABC):
    """Something to say that knows its parts; its bytes are made once, when they are asked for."""

    __slots__ = ("_written",)
    _written: bytes | None  # None at first

    @property
    @abstractmethod
    def most(self) -> int:
        """Bytes that it takes at most, so that a queue need not have it written to know that it has room."""

    def __bytes__(self) -> bytes:
        """Its bytes."""
        if self._written is None:
            self._written = self._write()
        return self._written

    def __len__(self) -> int:
        """How many bytes."""
        return len(bytes(self))

    @abstractmethod
    def _write(self) -> bytes:
        """Make its bytes."""


Content = bytes | Unwritten
