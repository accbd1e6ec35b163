"""A whole rig in one process makes much garbage and few cycles of it."""

from __future__ import annotations

import contextlib
import gc
from collections.abc import Iterator

COLLECT_EVERY = 50_000  # objects


@contextlib.contextmanager
def rare_collection() -> Iterator[None]:
    """Look for cycles of garbage rarely: by default a third of the time of a seed goes into it, and 7 % of a rig's."""
    usual = gc.get_threshold()
    gc.set_threshold(COLLECT_EVERY, *usual[1:])
    try:
        yield
    finally:
        gc.set_threshold(*usual)
