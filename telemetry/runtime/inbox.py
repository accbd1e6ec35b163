"""From the threads of a bus into an asyncio loop: a bounded queue whose drops are counted."""

from __future__ import annotations

import asyncio
import contextlib
import math
import threading
from collections import deque
from collections.abc import Callable
from typing import Generic, TypeVar

INBOX_LIMIT = 1024
T = TypeVar("T")


class Mailbox(Generic[T]):
    """Belongs to the running loop; anything may be put in from any thread, and is taken out on the loop.

    Parameters
    ----------
    arrived : called on the loop, once for all that was put in since it was called last, and after ``close``
    limit : items that may wait; one that finds the box full is dropped
    """

    def __init__(self, arrived: Callable[[], None], limit: int = INBOX_LIMIT) -> None:
        self.dropped = 0
        self._arrived = arrived
        self._limit = limit
        self._loop = asyncio.get_running_loop()
        self._lock = threading.Lock()
        self._items: deque[T] = deque()
        self._wake_is_due = False
        self._closed = False

    def __len__(self) -> int:
        return len(self._items)

    @property
    def is_closed(self) -> bool:
        """Whether ``close`` was called."""
        return self._closed

    def put(self, item: T) -> bool:
        """Put an item in, from any thread, without waiting; returns False if the box is full."""
        with self._lock:
            if len(self._items) >= self._limit:
                self.dropped += 1
                return False
            self._items.append(item)
        self.wake()
        return True

    def close(self) -> None:
        """Drop what waits and take nothing more, from any thread or signal handler of the loop."""
        self._closed = True
        self.wake()

    def take(self) -> T | None:
        """The oldest item, or None where there is none."""
        return self._items.popleft() if self._items and not self._closed else None

    def wake(self) -> None:
        """Make the loop call ``arrived``, from any thread."""
        if self._wake_is_due:
            return
        self._wake_is_due = True
        with contextlib.suppress(RuntimeError):  # the loop has ended, and with it all interest
            self._loop.call_soon_threadsafe(self._tell)

    def _tell(self) -> None:
        self._wake_is_due = False
        self._arrived()


class Inbox(Mailbox[T]):
    """A mailbox that a task waits at."""

    def __init__(self, limit: int = INBOX_LIMIT) -> None:
        self._anything = asyncio.Event()
        super().__init__(self._anything.set, limit)

    async def get(self) -> T | None:
        """The oldest item as soon as there is one, or None after ``close``."""
        while not self._items and not self._closed:
            await self.wait()
        return self.take()

    async def wait(self, timeout: float = math.inf) -> None:
        """Wait (s) until there is an item or the inbox is closed; others on the loop get their turn in any case."""
        if self._items or self._closed or timeout <= 0.0:
            await asyncio.sleep(0)
            return
        self._anything.clear()
        timer = self._loop.call_later(timeout, self._anything.set) if math.isfinite(timeout) else None
        try:
            await self._anything.wait()
        finally:
            if timer is not None:
                timer.cancel()
