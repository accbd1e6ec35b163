"""What is asked of a radio link between tubes: through soil, or inside the pipe."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class SoilRequest:
    """A soil by mass fractions of its solids, and a radio; a link for every content of water and distance."""

    sand: float = 0.3
    clay: float = 0.3
    density: float = 1.5  # g/cm^3, of the dry soil
    waters: tuple[float, ...] = (0.01, 0.25, 0.40)  # volume over volume of soil
    temperature_c: float = 10.0
    frequency_mhz: float = 868.0
    distances: tuple[float, ...] = (0.1, 0.2, 0.3)  # m, between the tube ends
    transmit_dbm: float = 2.0
    gain_dbi: float = 0.0  # of each antenna
    threshold_dbm: float = -103.0  # where half the packets are lost


@dataclass(frozen=True, slots=True)
class PipeRequest:
    """A steel pipe and a radio; either a grade of API 5L or the carbon of the steel."""

    radius_cm: float = 3.0
    frequency_ghz: float = 5.0
    grade: str | None = None
    carbon_percent: float | None = None  # by weight; 0.26 where neither is given
    temperature_c: float = 20.0
    budget_db: float = 110.0
