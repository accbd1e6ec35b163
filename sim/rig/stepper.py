"""Interface through which a rig's scheduler hands out steps: to processes on a bus, or to objects in this process."""

from __future__ import annotations

import enum
from collections.abc import Mapping
from typing import NamedTuple, Protocol

from telemetry.runtime.stepped import DueEvent, Sent
from telemetry.unwritten import Content

FrameEvent = tuple[DueEvent, Content]  # an event and its frame, empty where it has none


class Acted(enum.StrEnum):
    """What came of a cue to the operator."""

    DONE = "done"
    LATER = "later"  # the ground station does not know the time of the rig yet, which has to go on until it does
    NO_ANSWER = "no answer"  # of the ground station or the operator: to be asked again


class Answer(NamedTuple):
    """What one process did in a step: frames it sent, in order, and its next timer (s, its clock)."""

    frames: list[tuple[Sent, Content]]
    wake_at: float


class Stepper(Protocol):
    """Hands out the steps of a rig and collects what the processes answer."""

    def alive(self) -> list[int]:
        """Addresses that answer, in ascending order."""

    def wait_for(self, address: int, *, alive: bool, timeout: float) -> bool:
        """Wait (wall seconds) until a process has come or gone; returns whether it did."""

    def wait_for_cue(self, name: str, timeout: float) -> Acted:
        """Wait (wall seconds) until the operator has done what cue ``name`` asks, or says that it is too early."""

    def drain_hung(self) -> list[int]:
        """Addresses that did not answer a step and were dropped for it since the last call."""

    def drop(self, address: int) -> None:
        """Step a process no more."""

    def round(self, steps: Mapping[int, list[FrameEvent]]) -> dict[int, Answer]:
        """Give each process its events and wait until all have answered; those that died are missing."""
