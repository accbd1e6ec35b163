"""Ports of a tube that stands on no bench: each end hears the neighbour's port itself, as if through a wire."""

from __future__ import annotations

from collections.abc import Mapping

from telemetry.media.medium import Port
from telemetry.media.stepped import port_key
from telemetry.media.zenoh_bus import ZenohBus, ZenohPort
from telemetry.messages import Side


def neighbour_ports(bus: ZenohBus, rig: str, address: int, neighbours: Mapping[Side, int]) -> dict[Side, Port]:
    """Ends of the process ``address`` that have a neighbour; what leaves its lower end arrives here at the upper."""
    facing = {Side.UPPER: Side.LOWER, Side.LOWER: Side.UPPER}
    return {
        side: ZenohPort(bus, port_key(rig, address, side, "tx"), port_key(rig, neighbour, facing[side], "tx"))
        for side, neighbour in neighbours.items()
    }
