"""A ground station that is given what another one took in, event by event."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from borechain.recording.files import Recording, RecordingError
from groundstation.config import checked_config
from groundstation.errors import GroundError
from groundstation.service.intake import BEGIN, DEPTH, MESSAGE, ORDER, Intake, IntakeError, unpack_intake
from groundstation.service.process import GroundProcess
from telemetry import keys
from telemetry.errors import BorechainError

REPEATED_ORDERS = ("accept_depth", "accept_joints", "alarm")  # of the ground station, which need no key of the rig


@dataclass(slots=True)
class TapeClock:
    """Rig time as it was when the event of now was taken in."""

    rig_now: float = math.nan
    epoch: int = 0

    @property
    def synchronised(self) -> bool:
        """Whether rig time was known."""
        return math.isfinite(self.rig_now)

    def rig_from_local(self, local: float) -> float:
        """Rig time, s."""
        del local
        return self.rig_now


@dataclass(slots=True)
class Replayed:
    """A ground station after a replay, how many events it was given, and how many of them were missing."""

    ground: GroundProcess
    events: int = 0
    missing: int = 0


def replay_file(recording: Recording, folder: Path) -> Replayed:
    """Give a new ground station in ``folder`` the intake of a recording; close it after use.

    Raises
    ------
    RecordingError
        When the recording has no intake, or is of another version.
    """
    samples = recording.samples()
    events = (unpack_intake(one.payload) for one in samples if one.key == keys.INTAKE.format(rig=recording.rig))
    try:
        first = next(events, None)
        if first is None or first.kind != BEGIN:
            raise RecordingError(f"{recording.path}: expected what a ground station took in, the recording has none")
        return replay(first, events, folder, recording.rig)
    except IntakeError as error:
        raise RecordingError(f"{recording.path}: {error}") from error


def replay(begin: Intake, events: Iterable[Intake], folder: Path, rig: str) -> Replayed:
    """Give a new ground station of the same settings every event; one told twice counts once."""
    settings = {name: value for name, value in begin.content["settings"].items() if name != "rig"}
    config = checked_config(rig=rig, folder=folder, **settings)
    replayed = Replayed(GroundProcess(config, lambda _below: int(begin.content["start"]) - 1))
    ground, clock, last = replayed.ground, TapeClock(), 0
    ground.clock = clock
    for event in events:
        if event.kind == BEGIN or event.number <= last:
            continue
        replayed.missing += event.number - last - 1
        replayed.events, last = replayed.events + 1, event.number
        clock.rig_now, clock.epoch = event.rig_now, event.epoch
        take(ground, event)
        ground.take_frames(event.now)  # to nobody
    return replayed


def take(ground: GroundProcess, event: Intake) -> None:
    """Have one event happen."""
    if event.kind == MESSAGE:
        ground.on_message(event.content, event.now)
    elif event.kind == DEPTH:
        ground.on_depth(event.content, event.now)
    elif event.kind == ORDER:
        order(ground, event)
    else:
        ground.on_timer(event.now)


def order(ground: GroundProcess, event: Intake) -> None:
    """Repeat what an operator had the ground station do; what it refuses now it refused then or does not matter."""
    try:
        name, parameters, by = event.content
        if name in REPEATED_ORDERS:
            ground.operator.order(name, parameters, by)
    except (GroundError, BorechainError):
        return
