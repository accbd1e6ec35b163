"""A ground station that is given what another one took in, event by event."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from groundstation.config import checked_config
from groundstation.errors import GroundError
from groundstation.recording.recording_file import Recording, RecordingError
from groundstation.service.process.ground_process import GroundProcess
from groundstation.service.process.intake_tape import BEGIN, DEPTH, MESSAGE, ORDER, Intake, IntakeError, unpack_intake
from groundstation.service.process.operator_access import SETUP_COMMANDS
from telemetry import keys
from telemetry.errors import BorechainError

# of the ground station, which need no key of the rig
REPEATED_ORDERS = ("accept_depth", "accept_joints", "alarm", *SETUP_COMMANDS)


OF_THE_COLLAR = ("collar_inclination_deg", "collar_azimuth_deg", "collar_std_deg")


@dataclass(slots=True)
class TapeClock:
    """Rig time as it was when the current event was taken in."""

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


class Replayed:
    """A ground station of the same settings that is given the intake of another one; close it after use.

    Parameters
    ----------
    begin : first event of an intake
    folder : new, of its database
    rig : name of the rig

    Attributes
    ----------
    events, missing : that it was given, and that were lost before they were recorded
    """

    def __init__(self, begin: Intake, folder: Path, rig: str) -> None:
        settings = settings_of(begin)
        config = checked_config(rig=rig, folder=folder, **settings)
        self.ground = GroundProcess(config, lambda _below: int(begin.content["start"]) - 1)
        self.events = self.missing = 0
        self._clock = TapeClock()
        self._last = 0
        self.ground.clock = self._clock

    def give(self, event: Intake) -> None:
        """Apply an event; one given twice counts once."""
        if event.kind == BEGIN or event.number <= self._last:
            return
        self.missing += event.number - self._last - 1
        self.events, self._last = self.events + 1, event.number
        self._clock.rig_now, self._clock.epoch = event.rig_now, event.epoch
        apply_event(self.ground, event)
        self.ground.take_frames(event.now)  # discarded


def settings_of(begin: Intake) -> dict[str, Any]:
    """Settings of the ground station that recorded; one of an earlier version may say what is no longer a setting.

    A collar whose direction had no error was one of which nothing was told, and now is one that is not stated.
    """
    settings = {name: value for name, value in begin.content["settings"].items() if name != "rig"}
    if settings.get("collar_std_deg") == 0.0:
        settings = {name: value for name, value in settings.items() if name not in OF_THE_COLLAR}
    return settings


def open_replay(recording: Recording, folder: Path) -> tuple[Replayed, Iterator[Intake]]:
    """A ground station for the intake of a recording, and the events that it is to be given.

    Raises
    ------
    RecordingError
        When the recording has no intake, or is of another version; what is wrong with an event is told at it.
    """
    events = intake_of(recording)
    first = next(events, None)
    if first is None or first.kind != BEGIN:
        raise RecordingError(f"{recording.path}: expected what a ground station took in, the recording has none")
    return Replayed(first, folder, recording.rig), events


def intake_of(recording: Recording) -> Iterator[Intake]:
    """Events of a recording; errors as ``open_replay``."""
    try:
        for sample in recording.samples():
            if sample.key == keys.INTAKE.format(rig=recording.rig):
                yield unpack_intake(sample.payload)
    except IntakeError as error:
        raise RecordingError(f"{recording.path}: {error}") from error


def replay_file(recording: Recording, folder: Path) -> Replayed:
    """Replay the whole intake of a recording to a new ground station in ``folder``; errors as ``open_replay``."""
    replayed, events = open_replay(recording, folder)
    for event in events:
        replayed.give(event)
    return replayed


def apply_event(ground: GroundProcess, event: Intake) -> None:
    """Apply one event."""
    if event.kind == MESSAGE:
        ground.on_message(event.content, event.now)
    elif event.kind == DEPTH:
        ground.on_depth(event.content, event.now)
    elif event.kind == ORDER:
        repeat_order(ground, event)
    else:
        ground.on_timer(event.now)


def repeat_order(ground: GroundProcess, event: Intake) -> None:
    """Repeat what an operator had the ground station do; what it refuses now it refused then or does not matter."""
    try:
        name, parameters, by = event.content
        if name in REPEATED_ORDERS:
            ground.operator.order(name, parameters, by)
    except (GroundError, BorechainError):
        return


def replay_summary(recording: Recording, folder: Path) -> dict[str, Any]:
    """What a new ground station in ``folder`` knows after a recording; errors as ``open_replay``."""
    done = replay_file(recording, folder)
    ask = done.ground.operator.ask
    try:
        return {
            "rig": recording.rig,
            "whole": recording.whole,
            "damage": [one.line for one in recording.damage],
            "events": done.events,
            "missing": done.missing,
            "stations": ask("stations")["stations"],
            "verdict": ask("verdict"),
            "alarms": ask("alarms")["open"],
        }
    finally:
        done.ground.close()
