"""Ports of a tube that no stepper drives: each end hears the neighbour's port itself, as if through a wire."""

from __future__ import annotations

from collections.abc import Mapping

from telemetry import keys
from telemetry.media.port import Port
from telemetry.media.zenoh_bus import ZenohBus, ZenohPort
from telemetry.messages import Side


def neighbour_ports(bus: ZenohBus, rig: str, address: int, neighbours: Mapping[Side, int]) -> dict[Side, Port]:
    """Ends of the process ``address`` that have a neighbour; what leaves its lower end arrives here at the upper."""
    facing = {Side.UPPER: Side.LOWER, Side.LOWER: Side.UPPER}
    return {
        side: ZenohPort(bus, keys.port_key(rig, address, side, "tx"), keys.port_key(rig, neighbour, facing[side], "tx"))
        for side, neighbour in neighbours.items()
    }
