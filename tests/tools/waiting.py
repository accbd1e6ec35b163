"""Waiting for what another thread or process does: looked for again and again, up to a limit."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

PATIENCE = 30.0  # s
LOOK_EVERY = 0.002  # s


def until(holds: Callable[[], object], patience: float = PATIENCE) -> None:
    """Wait until something holds, at most ``patience`` s."""
    deadline, tick = time.monotonic() + patience, threading.Event()
    while not holds():
        assert time.monotonic() < deadline, f"expected it within {patience:g} s"
        tick.wait(LOOK_EVERY)
