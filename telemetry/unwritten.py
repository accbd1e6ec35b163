"""Payloads and frames that become bytes only where these are needed: never on the native profile of CAN."""

from __future__ import annotations

from abc import ABC, abstractmethod


class Unwritten(ABC):
    """A payload or frame that knows its parts; its bytes are made once, on demand."""

    __slots__ = ("_written",)
    _written: bytes | None  # None at first

    @property
    @abstractmethod
    def most(self) -> int:
        """Largest size (bytes), for a queue to know whether it has room without the bytes."""

    def __bytes__(self) -> bytes:
        """Return the bytes."""
        if self._written is None:
            self._written = self._write()
        return self._written

    def __len__(self) -> int:
        """Number of bytes."""
        return len(bytes(self))

    @abstractmethod
    def _write(self) -> bytes:
        """Make its bytes."""


Content = bytes | Unwritten
