"""Faults inside the product's own seams: timeouts that come early, queues with hardly any room, frames of one payload.

Each seam is a number of the product that its code looks up when it uses it. A seed opens some of them, for as long as
its faults last, and the oracles stay what they are: no such number may decide whether what is shown is true. The
product knows nothing of it.
"""

from __future__ import annotations

import contextlib
import importlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from sim.world.random_streams import RandomStream, random_stream

OPENED = 4.0  # seams in a seed, on the average


@dataclass(frozen=True, slots=True)
class Seam:
    """A number of a module, and the values that it is given instead."""

    module: str
    name: str
    values: tuple[float, ...]
    meaning: str

    @property
    def key(self) -> str:
        """Name of the seam among all: the last part of its module, and its own."""
        return f"{self.module.rpartition('.')[2]}.{self.name}"


SEAMS: tuple[Seam, ...] = (
    Seam("telemetry.transport.hop", "WINDOW", (1, 2, 7), "numbered payloads on their way over a joint"),
    Seam("telemetry.transport.hop", "QUEUE_LIMIT", (4, 16, 64), "payloads that wait for a joint"),
    Seam("telemetry.transport.hop", "BEST_EFFORT_LIMIT", (3, 8), "payloads that may be lost, waiting for a joint"),
    Seam("telemetry.transport.hop", "BUNDLE_LIMIT", (1, 300), "bytes of payloads that share a frame"),
    Seam("telemetry.transport.hop", "LAST_TIMEOUT", (0.06, 0.5, 8.0), "s, between two repetitions over a joint"),
    Seam("telemetry.transport.hop", "ACK_DELAY", (0.0, 0.3), "s, that an acknowledgement waits"),
    Seam("telemetry.application.outbox", "LAST_RETRY", (0.5, 5.0), "s, between two repetitions from end to end"),
    Seam("telemetry.application.end_to_end", "KEPT_WAIT", (0.0, 8.0), "s, that a message waits for a state"),
    Seam("telemetry.application.endpoint", "HELLO_WAIT", (0.0, 0.9), "s, that a hello waits for others"),
    Seam("telemetry.application.endpoint", "STATE_WAIT", (0.0, 3.0), "s, that a state waits for those below"),
    Seam("telemetry.application.endpoint", "SYNC_BURST", (1, 5), "comparisons of clocks at the quick pace"),
    Seam("telemetry.application.endpoint", "SYNC_SLOW", (1.0, 30.0), "s, between two comparisons of clocks"),
    Seam("node.process.tube_process", "RESENT_TOGETHER", (1, 2), "surveys sent again at one order"),
    Seam("node.process.saver", "AT_ONCE", (1, 3), "saves of a node that may follow each other"),
    Seam("groundstation.service.alarms.watch", "GAP_AFTER", (1.0, 10.0), "s, that a number may be on its way"),
    Seam("groundstation.service.alarms.watch", "ASK_EVERY", (3.0, 20.0), "s, between two orders to send again"),
    Seam("groundstation.service.alarms.watch", "LOOK_EVERY", (0.0, 3.0), "s, between two looks at what is wrong"),
    Seam("groundstation.service.process.ground_process", "EARLY", (1, 4), "depths that wait for rig time"),
    Seam("sim.gauntlet.faulty_stepper", "WAITING", (2, 16), "frames that wait for a process that stands still"),
)


def drawn_seams(seed: int) -> dict[str, float]:
    """Values of the seams that a seed opens, by their keys; at least one."""
    draws = random_stream(seed, RandomStream.GAUNTLET, 6)
    switches = draws.random(len(SEAMS))
    chosen = {seam.key: float(draws.choice(seam.values)) for seam in SEAMS}
    on = {seam.key for seam, drawn in zip(SEAMS, switches, strict=True) if drawn < OPENED / len(SEAMS)}
    return {key: value for key, value in chosen.items() if key in (on or {SEAMS[int(switches.argmin())].key})}


@contextlib.contextmanager
def opened_seams(values: Mapping[str, float]) -> Iterator[None]:
    """Open seams by their keys, until the end of the block."""
    opened = [seam for seam in SEAMS if seam.key in values]
    before = [getattr(importlib.import_module(seam.module), seam.name) for seam in opened]
    try:
        for seam, usual in zip(opened, before, strict=True):
            setattr(importlib.import_module(seam.module), seam.name, type(usual)(values[seam.key]))
        yield
    finally:
        for seam, usual in zip(opened, before, strict=True):
            setattr(importlib.import_module(seam.module), seam.name, usual)
