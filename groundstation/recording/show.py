"""A recording shown on the page: a ground station takes it in again, at the pace at which it came or faster."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Iterator
from pathlib import Path

from groundstation.gateway.page.page_settings import PageSettings
from groundstation.ground_host import page_of
from groundstation.recording.ground_replay import Replayed, open_replay
from groundstation.recording.recording_file import Recording
from groundstation.service.process.intake_tape import Intake
from telemetry.runtime.event_loop import run_event_loop, stop_on_signals

TOGETHER = 64  # events after which browsers are served, however late the replay is


def show_recording(recording: Recording, folder: Path, page: PageSettings, speed: float) -> None:
    """Serve the page of a recording, ``speed`` times as fast as it came, and then what it ends with, until a signal.

    Raises
    ------
    RecordingError
        When the recording has no intake, or is of another version.
    PageError
        When the page's port is taken.
    """
    replayed, events = open_replay(recording, folder)
    with contextlib.closing(replayed.ground):
        run_event_loop(serve_recording(replayed, events, page, speed))


async def serve_recording(replayed: Replayed, events: Iterator[Intake], page: PageSettings, speed: float) -> None:
    """Serve the page while the events are given to the ground station."""
    ended = asyncio.Event()
    stop_on_signals(ended.set)
    with page_of(page) as serve_page:
        async with serve_page(replayed.ground):
            giving = asyncio.create_task(give_all(replayed, events, speed))
            waiting = asyncio.create_task(ended.wait())
            await asyncio.wait([waiting])
            giving.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await giving


async def give_all(replayed: Replayed, events: Iterator[Intake], speed: float) -> None:
    """Apply every event at its time."""
    loop = asyncio.get_running_loop()
    begun_at, first = loop.time(), None
    for number, event in enumerate(events):
        first = event.now if first is None else first
        due = begun_at + (event.now - first) / speed
        if due > loop.time() or number % TOGETHER == 0:
            await asyncio.sleep(max(due - loop.time(), 0.0))
        replayed.give(event)
