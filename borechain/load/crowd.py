"""A whole string as one process above a real link: states, surveys and events of every tube, told by the encoder.

A ground station cannot tell it from a string of real tubes, and fifty of those would need the cores that are measured.
"""

from __future__ import annotations

import contextlib
import math
import random
import threading
from collections.abc import Iterator

from node.kernels.arithmetic.formats import PERIOD
from telemetry import keys
from telemetry.application.depth_source import DepthSource
from telemetry.application.endpoint import Endpoint
from telemetry.application.seals import Seals
from telemetry.media.neighbours import neighbour_ports
from telemetry.media.zenoh_bus import ZenohBus
from telemetry.media.zenoh_port import ZenohMedium
from telemetry.messages import (
    BASE,
    ENCODER,
    Event,
    ImuMean,
    NodeFlag,
    NodeMode,
    NodeState,
    Severity,
    Side,
    SurveyMeasurement,
)
from telemetry.presentation.msgpack_codec import encode_message
from telemetry.runtime.event_loop import run_event_loop
from telemetry.runtime.own_clock import OwnClock, OwnClockLoop
from telemetry.runtime.process_interface import Process
from telemetry.runtime.timing import CycleTiming

TUBE_LENGTH = 2.0  # m
ABOVE = 10.0  # m, of the bit at the start above the depth that all tubes reach, as far as there is a hole
ROUND_S = 120.0  # of drilling and standing, about that of a published bore
DRILLING_S = 80.0  # of a round
SURVEYED_AFTER_S = 22.0  # of standing
SURVEY_VAR = (0.0034**2) / 32.0  # (m/s^2)^2, of a mean over 32 cycles
LEAN = math.radians(0.3)


class Crowd(Process):
    """A string of ``tubes`` that drills and stands in turn, in real time; a cycle is the turn of one tube.

    Parameters
    ----------
    tubes : in the hole
    bus, rig : where the depth of the bit is told
    speed : m/s, of the bit while it drills; 0 tells no depth and surveys nothing
    seals : of the encoder, where the rig has keys
    """

    def __init__(self, tubes: int, bus: ZenohBus, rig: str, speed: float = 0.0, seals: Seals | None = None) -> None:
        self.endpoint = Endpoint(ENCODER, frozenset({Side.UPPER}), boot_count=1, is_clock_root=True, seals=seals)
        self.tubes, self.speed = tubes, speed
        self.surveys = self.events = 0  # handed over so far
        self._depth = bus.publisher(keys.DEPTH.format(rig=rig))
        self._source = DepthSource()
        self._begun_at: float | None = None  # s
        self._turn = 0
        self._surveyed_round = 0

    def on_cycle(self, data: object, now: float) -> None:
        """One tube tells its state; once a second the depth of the bit is read."""
        del data
        self._begun_at = now if self._begun_at is None else self._begun_at
        tube = self.tubes - self._turn % self.tubes
        self._turn += 1
        self.endpoint.send_state(state_of(tube, self.tubes - tube + 1, now), now)
        if self.speed > 0.0:
            self._drill(now, now - self._begun_at)

    def happen(self, now: float) -> None:
        """Raise an event that the ground station must never lose."""
        number = self.endpoint.mail.series.take()
        self.endpoint.mail.submit(Event(ENCODER, number, now, Severity.INFO, "stopped"), now)
        self.events += 1

    @property
    def receipted(self) -> int:
        """Number of events that the ground station has receipted; read on another thread too few, never too many."""
        events = self.events
        return events - self.endpoint.mail.outbox_size

    def _drill(self, now: float, elapsed: float) -> None:
        number, into = divmod(elapsed, ROUND_S)
        if self._turn % max(self.tubes // 2, 1) == 0:
            depth = max(TUBE_LENGTH * self.tubes - ABOVE, 0.0)
            depth += self.speed * (number * DRILLING_S + min(into, DRILLING_S))
            self._depth.put(encode_message(self._source.measure(now, depth)))
        if into >= DRILLING_S + SURVEYED_AFTER_S and self._surveyed_round <= number:
            self._surveyed_round = int(number) + 1
            for tube in range(1, self.tubes + 1):
                self.surveys += 1
                self.endpoint.mail.submit(survey_of(tube, self._surveyed_round, now, self.tubes - tube + 1), now)


def state_of(tube: int, hops: int, now: float) -> NodeState:
    """State of a tube that tracks."""
    return NodeState(
        tube,
        now,
        hops,
        NodeMode.TRACKING,
        1.0,
        1e-6,
        1e-6,
        (0.0, 0.0, 0.0),
        0.0,
        0.0,
        1e-6,
        0.1,
        1e-8,
        NodeFlag.NONE,
        5,
        0,
    )


def survey_of(tube: int, number: int, now: float, hops: int) -> SurveyMeasurement:
    """Survey of a tube in a hole that leans a little to the north, with a noise that its tube and number draw.

    It is half of what is stated of it: so nothing is ever looked for that might be wrong.
    """
    noise = ((SURVEY_VAR, 0.0, 0.0), (0.0, SURVEY_VAR, 0.0), (0.0, 0.0, SURVEY_VAR))
    draw = random.Random(tube << 32 | number)
    north, east, along = (0.5 * math.sqrt(SURVEY_VAR) * draw.gauss(0.0, 1.0) for _ in range(3))
    imus = (ImuMean((9.81 * math.sin(LEAN) + north, east, along - 9.81 * math.cos(LEAN)), noise),)
    return SurveyMeasurement(tube, number, now, hops, imus, 0.0, 1e-8, 1e-8, 32, 5.0, NodeFlag.NONE)


@contextlib.contextmanager
def crowd_in_thread(crowd: Crowd, bus: ZenohBus, rig: str) -> Iterator[OwnClockLoop]:
    """A string that lives on a thread of its own while the context lasts."""
    loops: list[OwnClockLoop] = []
    there = threading.Event()

    async def live() -> None:
        ports = neighbour_ports(ZenohMedium(bus), rig, ENCODER, {Side.UPPER: BASE})
        loops.append(OwnClockLoop(crowd, ports, OwnClock(), CycleTiming(), PERIOD / crowd.tubes))
        there.set()
        await loops[0].run()

    thread = threading.Thread(target=lambda: run_event_loop(live()))
    thread.start()
    there.wait()
    try:
        yield loops[0]
    finally:
        loops[0].stop()
        thread.join()
