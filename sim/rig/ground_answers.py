"""What the ground station of a rig answers at the end of a run, asked over the bus as any operator would."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from sim.errors import RigError

if TYPE_CHECKING:
    from telemetry.media.zenoh_bus import ZenohBus

ASKED = ("stations", "measurements", "column", "alarms", "recalibration", "wall", "trajectory")


def ask_surveys(bus: ZenohBus, rig_name: str) -> dict[str, Any]:
    """Stations, trajectory and measurements as any operator would get them."""
    return {path: get_json(bus, selector_of(rig_name, path)) for path in ASKED}


def selector_of(rig_name: str, path: str, parameters: Mapping[str, str] | None = None) -> str:
    """Selector of an answer of the ground station."""
    asked = ";".join(f"{name}={value}" for name, value in (parameters or {}).items())
    return f"borechain/{rig_name}/ground/{path}" + (f"?{asked}" if asked else "")


def get_json(bus: ZenohBus, selector: str) -> Any:
    """One reply of the ground station."""
    replies = bus.get(selector, timeout=10.0)
    if len(replies) != 1 or replies[0].error is not None:
        raise RigError(f"{selector}: expected one answer of the ground station, got {len(replies)}")
    return json.loads(replies[0].payload)
