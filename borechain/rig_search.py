"""Which rigs have a ground station on a bus now."""

from __future__ import annotations

from telemetry import keys
from telemetry.media.zenoh_bus import ZenohBus


def live_rigs(bus: ZenohBus, timeout: float = 1.0) -> list[str]:
    """Names of the rigs that have a ground station now."""
    tokens = bus.tokens(keys.LEASE.format(rig="*", holder="*"), timeout)
    return sorted({token.split("/")[1] for token in tokens})


def who_is_there(bus: ZenohBus) -> str:
    """Line that lists the rigs with a ground station, for the error on an unknown rig."""
    rigs = live_rigs(bus)
    return f"rigs with a ground station: {', '.join(rigs)}" if rigs else "no rig has a ground station here"
