"""From the threads of a bus into an asyncio loop: a bounded queue whose drops are counted."""

from __future__ import annotations

import asyncio
import contextlib
import math
import threading
from collections import deque
from typing import Generic, TypeVar

INBOX_LIMIT = 1024
T = TypeVar("T")


class Inbox(Generic[T]):
    """Belongs to the running loop; anything may be put in from any thread, and is taken out on the loop.

    Parameters
    ----------
    limit : items that may wait; one that finds the inbox full is dropped
    """

    def __init__(self, limit: int = INBOX_LIMIT) -> None:
        self.dropped = 0
        self._limit = limit
        self._loop = asyncio.get_running_loop()
        self._lock = threading.Lock()
        self._items: deque[T] = deque()
        self._arrived = asyncio.Event()
        self._wake_is_due = False
        self._closed = False

    def __len__(self) -> int:
        return len(self._items)

    @property
    def is_closed(self) -> bool:
        """Whether ``close`` was called."""
        return self._closed

    def put(self, item: T) -> bool:
        """Put an item in, from any thread; never waits, and returns False for one that finds the inbox full."""
        with self._lock:
            if len(self._items) >= self._limit:
                self.dropped += 1
                return False
            self._items.append(item)
        self._wake()
        return True

    def close(self) -> None:
        """Forget what waits and take nothing more, from any thread or signal handler of the loop."""
        self._closed = True
        self._wake()

    def take(self) -> T | None:
        """The oldest item, or None where there is none."""
        return self._items.popleft() if self._items and not self._closed else None

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
        self._arrived.clear()
        timer = self._loop.call_later(timeout, self._arrived.set) if math.isfinite(timeout) else None
        try:
            await self._arrived.wait()
        finally:
            if timer is not None:
                timer.cancel()

    def _wake(self) -> None:
        if self._wake_is_due:
            return
        self._wake_is_due = True
        with contextlib.suppress(RuntimeError):  # the loop has ended, and with it all interest
            self._loop.call_soon_threadsafe(self._set_arrived)

    def _set_arrived(self) -> None:
        self._wake_is_due = False
        self._arrived.set()
