"""Ports of a process, one for each of its ends."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from telemetry.media.port import Medium, Port, TubeEnd
from telemetry.messages import Side


def neighbour_ports(medium: Medium, rig: str, address: int, neighbours: Mapping[Side, int]) -> dict[Side, Port]:
    """Ends of the process ``address`` that have a neighbour; what leaves its lower end arrives there at the upper."""
    return {side: medium.open_port(TubeEnd(rig, address, side, other)) for side, other in neighbours.items()}


def stepped_ports(medium: Medium, rig: str, address: int, sides: Iterable[Side]) -> dict[Side, Port]:
    """Ends of the process ``address`` that a stepper joins with others as the schedule wants."""
    return {side: medium.open_port(TubeEnd(rig, address, side)) for side in sides}
