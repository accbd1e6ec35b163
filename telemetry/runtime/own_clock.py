"""The loop of a process with a clock of its own: a board in its tube, without a stepper.

Cycles are due at ``begin + k period`` of the monotonic clock, so that no delay of one moves the next. A cycle that has
not ended when the next is due is an overrun: the deadlines that have passed are left out and the next reading covers
them all. Clocks are synchronised halfway between two cycles, when both ends of a joint wait and a time request and its
reply are equally long on their way. The process is the very object that a stepper drives.
"""

from __future__ import annotations

import asyncio
import math
import threading
import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

from telemetry.media.port import Port
from telemetry.messages import Side
from telemetry.runtime.inbox import Mailbox
from telemetry.runtime.joint_watch import JointWatch
from telemetry.runtime.process_interface import Process
from telemetry.runtime.timing import CycleStage, CycleTiming
from telemetry.unwritten import Content

FRAMES_TOGETHER = 16  # taken before what they made is sent, while more wait
ABSENT_LIMIT = 60.0  # s without a neighbour until that is reported
Act = Callable[[Process, float], None]


@dataclass(frozen=True, slots=True)
class OwnClock:
    """The machine's monotonic clock plus ``offset`` (s); clocks of two boards are unrelated."""

    offset: float = 0.0

    def now(self) -> float:
        """Own time, s."""
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
        """Middle of the period before the deadline."""
        return self.due - 0.5 * self._period

    def finish(self, now: float) -> int:
        """Move on to the first deadline after ``now``; returns how many deadlines were skipped."""
        following = max(self._number + 1, math.floor((now - self._begin) / self._period) + 1)
        missed = following - self._number - 1
        self._number = following
        return missed


class AbsenceWatch:
    """Finds the ends without a neighbour heard for ``limit`` s, and names each once until one is heard."""

    def __init__(self, sides: Iterable[Side], begin: float, limit: float = ABSENT_LIMIT) -> None:
        self._limit = limit
        self._heard_at = dict.fromkeys(sides, begin)
        self._reported: set[Side] = set()

    def find(self, neighbours: Mapping[Side, object], now: float) -> list[Side]:
        """Ends that are newly found silent; ``neighbours`` holds None where none is heard."""
        found = []
        for side, heard_at in self._heard_at.items():
            if neighbours.get(side) is not None:
                self._heard_at[side] = now
                self._reported.discard(side)
            elif now - heard_at >= self._limit and side not in self._reported:
                self._reported.add(side)
                found.append(side)
        return found


class OwnClockLoop:
    """Runs a process by its own clock on the running asyncio loop.

    What arrives is handled in the callback that announces it, without a task in between: fifty processes on two cores
    spend more on turns of their loops than on frames. Where that may be, a frame is even handled on the thread that
    hears it: one that finds the process idle, with nothing due and nothing before it, does not wake the loop.

    Parameters
    ----------
    process : what is run; one call at a time
    ports : its ends that have a neighbour
    clock, timing : its clock, and where the durations are kept
    period : s, of a cycle
    report : takes a line about an end at which no neighbour is heard
    at_once : frames may be handled on the threads that hear them: nothing but this loop calls the process
    """

    def __init__(
        self,
        process: Process,
        ports: Mapping[Side, Port],
        clock: OwnClock,
        timing: CycleTiming,
        period: float,
        report: Callable[[str], None] = lambda line: None,
        *,
        at_once: bool = False,
    ) -> None:
        self._at_once, self._thread = at_once, threading.get_ident()
        self._calling = threading.Lock()  # held during a call of the process
        self._process, self._ports, self._clock, self._timing = process, ports, clock, timing
        self._report = report
        self._asyncio = asyncio.get_running_loop()
        self._inbox: Mailbox[Act] = Mailbox(self._on_arrival)
        self._ended: asyncio.Future[None] | None = None
        self._timer: asyncio.TimerHandle | None = None
        self._timer_due = math.inf  # s, own clock
        self._read_until = clock.now()
        self._schedule = Schedule(self._read_until, period)
        self._absence = AbsenceWatch(ports, self._read_until)
        self._joints = JointWatch()
        self._synchronised = -math.inf  # deadline before which the clocks were synchronised
        self._unsent = 0
        for side, port in ports.items():
            process.endpoint.limit_bundles(side, port.bundle_limit)
            port.listen(partial(self._on_frame, side))

    def call(self, act: Act) -> None:
        """Call ``act(process, now)`` on the loop; from any thread."""
        self._inbox.put(act)

    def stop(self) -> None:
        """End ``run``; from any thread or signal handler of the loop."""
        self._inbox.close()

    async def run(self) -> None:
        """Run until ``stop``.

        Raises
        ------
        MediumError
            When the bus is lost.
        """
        self._ended = self._asyncio.create_future()
        self._on_arrival()
        try:
            await self._ended
        finally:
            with self._calling:
                self._ended = None
            self._set_timer(math.inf)

    def losses(self) -> dict[str, Any]:
        """Frames that never arrived at the process or never left it, for a report."""
        ports = {
            side.name.lower(): {"is_up": port.is_up, "not_sent": dict(port.counters)}
            for side, port in self._ports.items()
        }
        return {"inbox_dropped": self._inbox.dropped, "ports": ports}

    def _on_arrival(self) -> None:
        """Handle an arrival or a due timer."""
        if self._ended is None or self._ended.done():
            return
        try:
            if self._inbox.is_closed:
                self._ended.set_result(None)
            else:
                with self._calling:
                    self._turn()
        except Exception as error:
            self._fail(error)

    def _fail(self, error: Exception) -> None:
        """End ``run`` by an error."""
        if self._ended is not None and not self._ended.done():
            self._ended.set_exception(error)

    def _on_timer(self) -> None:
        self._timer, self._timer_due = None, math.inf
        self._on_arrival()

    def _turn(self) -> None:
        """Handle what waits and what is due; run again at once for the rest, else when more is due."""
        self._take_waiting()
        self._do_due()
        if len(self._inbox):
            self._asyncio.call_soon(self._on_arrival)
            return
        wake_at = min(self._next_moment(), self._process.next_wake(self._clock.now()))
        if wake_at < self._timer_due:
            self._set_timer(wake_at)

    def _set_timer(self, due: float) -> None:
        """Set the one timer of ``_on_timer`` to ``due`` (s, own clock); infinite: none."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        self._timer_due = due
        if math.isfinite(due):
            self._timer = self._asyncio.call_later(max(due - self._clock.now(), 0.0), self._on_timer)

    def _next_moment(self) -> float:
        """Next deadline, or the middle of the time before it."""
        schedule = self._schedule
        return schedule.due if self._synchronised >= schedule.due else schedule.halfway

    def _take_waiting(self) -> None:
        """Handle waiting frames and calls until something else is due; without any, the timer that is due."""
        act = self._inbox.take()
        now = self._clock.now()
        if act is None and now < self._next_moment():
            self._process.on_timer(now)
        while act is not None:
            self._timing.begin()
            act(self._process, now)
            self._timing.lap(CycleStage.FRAME)
            self._unsent += 1
            now = self._clock.now()
            if self._unsent >= FRAMES_TOGETHER or now >= self._next_moment():
                break
            act = self._inbox.take()

    def _do_due(self) -> None:
        """Run the cycle or the synchronisation that is due; else send what the frames so far have made."""
        now = self._clock.now()
        if now >= self._schedule.due:
            self._read_until = run_cycle(
                self._process, self._ports, self._schedule, self._read_until, self._clock, self._timing
            )
        elif now >= self._next_moment():
            self._synchronise(now)
        else:
            send_due_frames(self._process, self._ports, now)
        self._unsent = 0

    def _synchronise(self, now: float) -> None:
        self._timing.begin()
        self._process.on_timer(now)
        for port in self._ports.values():
            port.flush()
        for fault in self._joints.find(self._ports, now):
            self._report(fault.line)
            self._process.on_joint_fault(fault, now)
        send_due_frames(self._process, self._ports, now)
        self._timing.lap(CycleStage.SYNCHRONISE)
        self._synchronised = self._schedule.due
        for side in self._absence.find(self._process.endpoint.place.neighbours, now):
            state = "up" if self._ports[side].is_up else "down"
            self._report(
                f"{side.name.lower()} end: no neighbour heard for {ABSENT_LIMIT:.0f} s, the port is {state}; "
                "does the neighbour run, and is it the right one?"
            )

    def _on_frame(self, side: Side, frame: Content) -> None:
        if not (self._at_once and self._handle_at_once(side, frame)):
            self._inbox.put(lambda process, now: process.on_frame(side, frame, now))

    def _handle_at_once(self, side: Side, frame: Content) -> bool:
        """Handle a frame on the foreign thread that heard it; False where the loop has to.

        That thread never waits for the loop: its medium may need it for what the loop is sending.
        """
        if threading.get_ident() == self._thread or not self._calling.acquire(blocking=False):
            return False
        try:
            now = self._clock.now()
            if not self._is_idle(now):
                return False
            self._timing.begin()
            self._process.on_frame(side, frame, now)
            self._timing.lap(CycleStage.FRAME)
            now = self._clock.now()
            send_due_frames(self._process, self._ports, now)
            if self._process.next_wake(now) < self._timer_due:
                self._inbox.wake()
        except Exception as error:
            self._asyncio.call_soon_threadsafe(self._fail, error)
        finally:
            self._calling.release()
        return True

    def _is_idle(self, now: float) -> bool:
        """Whether the process runs, nothing is due and nothing waits."""
        runs = self._ended is not None and not self._ended.done() and not self._inbox.is_closed
        return runs and not len(self._inbox) and now < self._next_moment()


def run_cycle(
    process: Process,
    ports: Mapping[Side, Port],
    schedule: Schedule,
    begin: float,
    clock: OwnClock,
    timing: CycleTiming,
) -> float:
    """Run the due cycle over the readings since ``begin`` (s); returns their end (s), the next one's begin."""
    end = clock.now()
    timing.add_duration(CycleStage.START, end - schedule.due)
    timing.begin()
    process.on_cycle([begin], end)
    timing.begin()
    send_due_frames(process, ports, end)
    timing.lap(CycleStage.SEND)
    now = clock.now()
    missed = schedule.finish(now)
    timing.end_cycle(now - end, missed, now)
    if missed:
        process.on_overrun(missed, now)
    return end


def send_due_frames(process: Process, ports: Mapping[Side, Port], now: float) -> None:
    """Send the frames that are due; an end without a neighbour sends nothing."""
    for side, frame in process.take_frames(now):
        if side in ports:
            ports[side].send(frame)
