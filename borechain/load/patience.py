"""Looking again and again at what another process does, which says no word when it has done it."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TypeVar

from sim.errors import RigError

Found = TypeVar("Found")


def wait_for(look: Callable[[], Found | None], failing: str, seconds: float, every: float) -> Found:
    """Return the first result of ``look``, called every ``every`` s (wall time) for ``seconds``; None: nothing yet.

    Raises
    ------
    RigError
        After them, with what is ``failing``.
    """
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline:
        if (found := look()) is not None:
            return found
        time.sleep(every)
    raise RigError(f"{failing} within {seconds:.0f} s")
