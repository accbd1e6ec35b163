"""Scenarios of studies: tables as a scenario file has them, built from each other."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

Tables = Mapping[str, Mapping[str, Any]]
CALIBRATED = {"bias_std_deg": 0.002}  # of accelerometers, as a tilt


def change_sections(tables: Tables, **sections: Mapping[str, Any]) -> Tables:
    """Return the scenario with other values of some keys of some ``sections``."""
    return {**tables, **{name: {**tables.get(name, {}), **values} for name, values in sections.items()}}


def complete_string(tubes: int) -> dict[str, Any]:
    """Section of a string that is whole from the start."""
    return {"tubes": tubes, "tubes_at_start": tubes, "tube_length_m": 1.0}


def on_off(on: float, off: float) -> dict[str, Any]:
    """Section of an aiding for ``on`` s, then none for ``off`` s."""
    return {"on_s": on, "off_s": off}
