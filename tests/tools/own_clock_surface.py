"""A base station at the upper end of a string whose tubes keep their own clocks: it hears, receipts and orders."""

from __future__ import annotations

import contextlib
import math
import queue
import threading
import time
from collections.abc import Callable, Iterator
from typing import Any

from rigs import PATIENCE

from node.kernels.arithmetic.formats import PERIOD
from telemetry.application.endpoint import Endpoint
from telemetry.application.seals import Seals
from telemetry.media.neighbours import neighbour_ports
from telemetry.media.zenoh_bus import ZenohBus
from telemetry.media.zenoh_port import ZenohMedium
from telemetry.messages import BASE, ENCODER, Command, Event, Reply, Side
from telemetry.runtime import event_loop
from telemetry.runtime.own_clock import OwnClock, OwnClockLoop
from telemetry.runtime.process_interface import Process
from telemetry.runtime.timing import CycleTiming


class Surface(Process):
    """The base station; what it hears goes into a queue, and into ``kept`` once it is taken from there.

    ``receipts`` are the kinds of messages that it acknowledges.
    """

    loop: OwnClockLoop

    def __init__(self, seals: Seals | None = None, receipts: tuple[type, ...] = (Event,)) -> None:
        self.endpoint = Endpoint(BASE, frozenset({Side.LOWER}), boot_count=1, seals=seals)
        self.heard: queue.SimpleQueue[Any] = queue.SimpleQueue()
        self.kept: list[Any] = []
        self._receipts = receipts

    def on_frame(self, side: Side, frame: bytes, now: float, margin: float = math.inf) -> None:
        for received in self.endpoint.receive(side, frame, now, margin):
            if isinstance(received.message, self._receipts):
                self.endpoint.mail.acknowledge(received.message)
            self.heard.put(received.message)

    def first(self, kind: type, fits: Callable[[Any], bool], patience: float = PATIENCE) -> Any:
        """The next message of a kind that fits."""
        deadline = time.monotonic() + patience
        while True:
            message = self.heard.get(timeout=max(deadline - time.monotonic(), 0.0))
            self.kept.append(message)
            if isinstance(message, kind) and fits(message):
                return message

    def order(self, tube: int, number: int, name: str, **arguments: Any) -> Reply:
        """What a tube answers to an order."""
        command = Command(tube, number, name, arguments)
        self.loop.call(lambda process, now: process.endpoint.mail.command(command, now))
        reply: Reply = self.first(Reply, lambda r: r.sequence == number and r.tube == tube)
        return reply


@contextlib.contextmanager
def living(surface: Surface, bus: ZenohBus, rig: str) -> Iterator[Surface]:
    """The base station on a bus, in a thread of its own."""
    running: queue.SimpleQueue[OwnClockLoop] = queue.SimpleQueue()

    async def live() -> None:
        ports = neighbour_ports(ZenohMedium(bus), rig, BASE, {Side.LOWER: ENCODER})
        loop = OwnClockLoop(surface, ports, OwnClock(), CycleTiming(), PERIOD)
        running.put(loop)
        await loop.run()

    thread = threading.Thread(target=lambda: event_loop.run_event_loop(live()))
    thread.start()
    surface.loop = running.get(timeout=PATIENCE)
    yield surface
    surface.loop.stop()
    thread.join()
