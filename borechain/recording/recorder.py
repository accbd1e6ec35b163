"""Records a rig from its bus until it is told to stop."""

from __future__ import annotations

import contextlib
import json
import queue
import time
from dataclasses import dataclass
from pathlib import Path

from borechain.recording.files import INTAKE, RecordingWriter, Sample
from groundstation.service.intake import BEGIN, IntakeError, unpack_intake
from groundstation.service.paths import schemas
from telemetry import keys
from telemetry.media.zenoh_bus import ZenohBus

WAITING = 100_000  # samples that may wait to be written; more are dropped and counted


@dataclass(slots=True)
class Course:
    """How a recording went: samples, events of the intake that are missing, and samples dropped here."""

    samples: int = 0
    first: int = 0  # number of the first event of the intake
    newest: int = 0
    missing: int = 0
    dropped: int = 0

    @property
    def is_whole(self) -> bool:
        """Whether a replay knows all that the ground station knew."""
        return self.first == 1 and not self.missing


class Recorder:
    """Subscribes to a rig and writes what comes.

    Parameters
    ----------
    bus : open session
    rig : its name
    path : new file; errors as ``RecordingWriter``
    """

    def __init__(self, bus: ZenohBus, rig: str, path: Path) -> None:
        self.course = Course()
        self._arrived: queue.Queue[Sample | None] = queue.Queue(WAITING)
        shown = {pattern: json.dumps(schema).encode() for pattern, schema in schemas().items()}
        self._writer = RecordingWriter(path, rig, shown)
        self._intake = keys.GROUND.format(rig=rig, path=INTAKE)
        for key in (keys.GROUND.format(rig=rig, path="**"), keys.DEPTH.format(rig=rig)):
            bus.subscribe(key, self._arrive)

    def run(self) -> Course:
        """Write until ``stop``; returns how it went."""
        with self._writer as writer:
            while (sample := self._arrived.get()) is not None:
                writer.write(sample)
                self.course.samples += 1
                if sample.key == self._intake:
                    self._count(sample.payload)
        return self.course

    def stop(self) -> None:
        """End the recording with what has arrived; from any thread or a signal handler."""
        with contextlib.suppress(queue.Full):
            self._arrived.put_nowait(None)

    def _arrive(self, key: str, payload: bytes) -> None:
        try:
            self._arrived.put_nowait(Sample(key, time.time_ns(), payload))
        except queue.Full:
            self.course.dropped += 1

    def _count(self, payload: bytes) -> None:
        """Notice events of the intake that did not come; what was told before is told once more to a new listener."""
        try:
            event = unpack_intake(payload)
        except IntakeError:
            return
        if event.kind == BEGIN or event.number <= self.course.newest:
            return
        self.course.first = self.course.first or event.number
        self.course.missing += event.number - self.course.newest - 1 if self.course.newest else 0
        self.course.newest = event.number
