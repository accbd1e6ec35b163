"""The main loop of a process that owns its clock: a board in its tube, where no stepper hands out the time.

Cycles are due at ``begin + k period`` of the monotonic clock, so that no delay of one moves the next. A cycle that has
not ended when the next is due is an overrun: the deadlines that have passed are left out and the next reading covers
them all. Clocks are synchronised halfway between two cycles, when both ends of a joint wait and a time request and its
reply are equally long on their way. The process is the very object that a stepper drives.
"""

from __future__ import annotations

import math
import queue
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

from telemetry.media.port import Port
from telemetry.messages import Side
from telemetry.runtime.process import Process
from telemetry.runtime.timing import CycleTiming, Stage

FRAMES_TOGETHER = 16  # taken before what they made is sent, while more wait


@dataclass(frozen=True, slots=True)
class OwnClock:
    """The machine's monotonic clock, moved by ``offset`` (s): two boards agree on no time."""

    offset: float = 0.0

    def now(self) -> float:
        """Own time, s; never near zero but after a start of the machine."""
        return time.monotonic() + self.offset


class Schedule:
    """Deadlines ``begin + k period`` (s), k from 1."""

    def __init__(self, begin: float, period: float) -> None:
        self._begin = begin
        self._period = period
        self._number = 1

    @property
    def due(self) -> float:
        """The next deadline."""
        return self._begin + self._number * self._period

    @property
    def halfway(self) -> float:
        """The middle of the time before it."""
        return self.due - 0.5 * self._period

    def finish(self, now: float) -> int:
        """Go on to the first deadline after ``now``; returns how many have passed that are left out."""
        following = max(self._number + 1, math.floor((now - self._begin) / self._period) + 1)
        missed = following - self._number - 1
        self._number = following
        return missed


class Inbox:
    """What comes from the ports' threads, in one queue; its ``stop`` may be called from a signal handler."""

    def __init__(self) -> None:
        self._arrived: queue.SimpleQueue[Callable[[Process, float], None] | None] = queue.SimpleQueue()

    def listen(self, ports: Mapping[Side, Port]) -> None:
        """Take the frames of every port."""
        for side, port in ports.items():
            port.listen(partial(self._frame, side))

    def put(self, act: Callable[[Process, float], None]) -> None:
        """Have ``act(process, now)`` called by the loop."""
        self._arrived.put(act)

    def stop(self) -> None:
        """End the loop."""
        self._arrived.put(None)

    def next_arrival(self, timeout: float) -> Callable[[Process, float], None] | None:
        """What came next, or None after ``stop``.

        Raises
        ------
        queue.Empty
            When nothing came for ``timeout`` s.
        """
        return self._arrived.get(timeout=timeout) if timeout > 0.0 else self._arrived.get_nowait()

    @property
    def empty(self) -> bool:
        """Whether nothing waits."""
        return self._arrived.empty()

    def _frame(self, side: Side, frame: bytes) -> None:
        self._arrived.put(lambda process, now: process.on_frame(side, frame, now))


def serve_by_own_clock(
    process: Process, ports: Mapping[Side, Port], inbox: Inbox, clock: OwnClock, timing: CycleTiming, period: float
) -> None:
    """Run ``process`` from now on until ``inbox.stop``, a cycle every ``period`` (s).

    Raises
    ------
    MediumError
        When the bus is lost.
    """
    inbox.listen(ports)
    read_until = clock.now()
    schedule = Schedule(read_until, period)
    synchronised = -math.inf  # deadline before which the clocks were synchronised
    unsent = 0
    while True:
        halfway = schedule.halfway if synchronised < schedule.due else math.inf
        now = clock.now()
        try:
            act = inbox.next_arrival(min(schedule.due, halfway, process.next_wake(now)) - now)
        except queue.Empty:
            now = clock.now()
            if now < min(schedule.due, halfway):
                process.on_timer(now)
        else:
            if act is None:
                return
            timing.begin()
            act(process, clock.now())
            timing.lap(Stage.FRAME)
            unsent += 1
        now = clock.now()
        if now >= schedule.due:
            read_until = run_cycle(process, ports, schedule, read_until, clock, timing)
            unsent = 0
        elif now >= halfway:
            timing.begin()
            process.on_timer(now)
            send(process, ports, now)
            timing.lap(Stage.SYNCHRONISE)
            synchronised = schedule.due
            unsent = 0
        elif inbox.empty or unsent >= FRAMES_TOGETHER:
            send(process, ports, now)
            unsent = 0


def run_cycle(
    process: Process,
    ports: Mapping[Side, Port],
    schedule: Schedule,
    begin: float,
    clock: OwnClock,
    timing: CycleTiming,
) -> float:
    """The cycle that is due, over the readings since ``begin`` (s); returns their end, where the next one begins."""
    end = clock.now()
    timing.add_duration(Stage.START, end - schedule.due)
    timing.begin()
    process.on_cycle([begin], end)
    timing.begin()
    send(process, ports, end)
    timing.lap(Stage.SEND)
    now = clock.now()
    missed = schedule.finish(now)
    timing.end_cycle(now - end, missed, now)
    if missed:
        process.on_overrun(missed, now)
    return end


def send(process: Process, ports: Mapping[Side, Port], now: float) -> None:
    """Put on the wire what is due; an end without a neighbour says nothing to nobody."""
    for side, frame in process.take_frames(now):
        if side in ports:
            ports[side].send(frame)
