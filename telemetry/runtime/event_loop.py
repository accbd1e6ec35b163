"""The asyncio loop of a process that lives by a real clock: fine timers, and signals that end it."""

from __future__ import annotations

import asyncio
import multiprocessing
import selectors
import signal
from collections.abc import Callable, Coroutine
from typing import Any, TypeVar

T = TypeVar("T")


def run_event_loop(main: Coroutine[Any, Any, T]) -> T:
    """Run ``main`` to its end on a loop of its own."""
    with asyncio.Runner(loop_factory=precise_loop) as runner:
        return runner.run(main)


def precise_loop() -> asyncio.AbstractEventLoop:
    """Loop whose timers are exact to microseconds; the usual one rounds up to the next millisecond."""
    return asyncio.SelectorEventLoop(selectors.SelectSelector())


def stop_on_signals(stop: Callable[[], None]) -> None:
    """Make the running loop call ``stop`` on SIGTERM, and on Ctrl-C without a launcher that handles it."""
    loop = asyncio.get_running_loop()
    loop.add_signal_handler(signal.SIGTERM, stop)
    if multiprocessing.parent_process() is None:
        loop.add_signal_handler(signal.SIGINT, stop)
