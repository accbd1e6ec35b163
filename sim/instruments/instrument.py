"""What a synthetic instrument is: a name, and a module whose ``simulate_records(seed)`` makes its files."""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from sim.errors import SimError

MODULES = "sim.instruments"


class InstrumentError(SimError, ValueError):
    """An instrument was asked for a record that cannot be."""


@dataclass(frozen=True, slots=True)
class Records:
    """Files of one instrument by name, and the parameters that their calibration must find, by name."""

    files: Mapping[str, bytes]
    truth: Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Instrument:
    """One line of the table of instruments; ``module`` has ``simulate_records(seed) -> Records``."""

    name: str
    help: str
    module: str

    def records(self, seed: int) -> Records:
        """Its files for one seed."""
        found: Records = importlib.import_module(self.module).simulate_records(seed)
        return found
