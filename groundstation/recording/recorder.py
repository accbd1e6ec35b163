"""Records a rig from its bus until it is told to stop."""

from __future__ import annotations

import contextlib
import json
import queue
import time
from dataclasses import dataclass
from pathlib import Path

import msgpack

from groundstation.recording.recording_file import RecordedSample, RecordingWriter
from groundstation.service.answers.answer_table import schemas_by_path
from groundstation.service.process.intake_tape import BEGIN, IntakeError, unpack_intake
from telemetry import keys
from telemetry.media.zenoh_bus import ZenohBus

ANSWERED_WITHIN = 5.0  # wall s
WAITING = 100_000  # samples that may wait to be written; more are dropped and counted


@dataclass(slots=True)
class RecordingSummary:
    """Counts of a recording: samples, events of the intake that are missing, and samples dropped here."""

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
        self.course = RecordingSummary()
        self._bus = bus
        self._arrived: queue.Queue[RecordedSample | None] = queue.Queue(WAITING)
        shown = {pattern: json.dumps(schema).encode() for pattern, schema in schemas_by_path().items()}
        self._writer = RecordingWriter(path, rig, shown)
        self._intake = keys.INTAKE.format(rig=rig)
        for key in (keys.GROUND.format(rig=rig, path="**"), keys.DEPTH.format(rig=rig), self._intake):
            bus.subscribe(key, self._arrive)

    def run(self) -> RecordingSummary:
        """Write until ``stop``; returns how it went."""
        with self._writer:
            while (sample := self._arrived.get()) is not None:
                if sample.key == self._intake:
                    self._take_intake(sample)
                else:
                    self._write(sample)
            if self.course.newest:
                self._ask_for_more()
        return self.course

    def stop(self) -> None:
        """End the recording with what has arrived; from any thread or a signal handler."""
        with contextlib.suppress(queue.Full):
            self._arrived.put_nowait(None)

    def _arrive(self, key: str, payload: bytes) -> None:
        try:
            self._arrived.put_nowait(RecordedSample(key, time.time_ns(), payload))
        except queue.Full:
            self.course.dropped += 1

    def _write(self, sample: RecordedSample) -> None:
        self._writer.write(sample)
        self.course.samples += 1

    def _take_intake(self, sample: RecordedSample) -> None:
        """Write an event once, in its order; missing earlier ones are asked for."""
        number = number_of(sample.payload)
        if number > self.course.newest + 1:
            self._ask_for_more()
        self._keep(number, sample)

    def _keep(self, number: int, sample: RecordedSample) -> None:
        """Write an event that is new, and count what is missing before it; 0 are the settings."""
        course = self.course
        if number and number <= course.newest:
            return
        if number:
            course.missing += number - course.newest - 1 if course.newest else 0
            course.first, course.newest = course.first or number, number
        self._write(sample)

    def _ask_for_more(self) -> None:
        """Write what the ground station keeps of the events after the newest one, for as long as there are any."""
        before = -1
        while self.course.newest > before and (rows := self._events_after(self.course.newest)):
            before = self.course.newest
            for payload in rows:
                self._keep(number_of(payload), RecordedSample(self._intake, time.time_ns(), payload))

    def _events_after(self, number: int) -> list[bytes]:
        for reply in self._bus.get(f"{self._intake}?since={number}", ANSWERED_WITHIN):
            if reply.error is None:
                rows = msgpack.unpackb(reply.payload)
                return [row for row in rows if isinstance(row, bytes)] if isinstance(rows, list) else []
        return []


def number_of(payload: bytes) -> int:
    """Number of an event; 0 of the settings and of anything else."""
    try:
        event = unpack_intake(payload)
    except IntakeError:
        return 0
    return 0 if event.kind == BEGIN else event.number
