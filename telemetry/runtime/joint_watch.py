"""What goes wrong at a joint and matters to the crew: found in the ports' counts, told at most once a minute."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from telemetry.media.port import Port
from telemetry.messages import Scalar, Side

TELL_EVERY = 60.0  # s
FAULTS = {
    "bus_off": "the controller left the bus after too many errors and joins again",
    "bus_lost": "the bus went away and is opened again",
    "same_address": "another node has the number of this one; the younger is mute",
    "third_talker": "more than one other node is on the joint; only the first is heard",
    "babbling": "the other end sends more than it may; the rest is dropped",
    "receive_overruns": "frames found no room in the controller",
}  # count of a port -> what it means


class JointFault(NamedTuple):
    """Something that went wrong at an end since it was told last."""

    side: Side
    fault: str
    times: int  # since the start

    @property
    def arguments(self) -> dict[str, Scalar]:
        """Arguments of the event ``joint_fault``."""
        return {"side": self.side.name.lower(), "fault": self.fault, "count": self.times}

    @property
    def line(self) -> str:
        """Line for people."""
        return f"{self.side.name.lower()} end: {self.fault} ({self.times}): {FAULTS[self.fault]}"


class JointWatch:
    """Compares the counts of ports with those last reported."""

    def __init__(self) -> None:
        self._told: dict[tuple[Side, str], tuple[int, float]] = {}  # count and time

    def find(self, ports: Mapping[Side, Port], now: float) -> list[JointFault]:
        """Faults that are new, or have grown and were reported longer than a minute ago."""
        found = []
        for side, port in ports.items():
            for fault in FAULTS:
                count = port.counters[fault]
                told, at = self._told.get((side, fault), (0, -TELL_EVERY))
                if count > told and now - at >= TELL_EVERY:
                    self._told[side, fault] = count, now
                    found.append(JointFault(side, fault, count))
        return found
