"""A node that was never started before, without a process around it."""

from __future__ import annotations

from collections.abc import Iterable

from node.firmware.settings import TubeSettings
from node.firmware.tube import Tube
from node.kernels.layout import Array, default_config, new_state


def fresh_tube(settings: TubeSettings, config: Iterable[tuple[str, float]] = (), mount: Array | None = None) -> Tube:
    """Firmware with its own numbers; ``config`` overrides fields of the usual configuration."""
    record = default_config()
    for name, value in config:
        record[0][name] = value
    return Tube(settings, record, new_state(record), iter(range(10**9)).__next__, restored=False, mount=mount)
