"""A plan of a hole as it is told: legs or stations, in a file or in the settings of a ground station; degrees."""

from __future__ import annotations

import math
import tomllib
from functools import lru_cache
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from groundstation.entry.entry_warning import EntryWarning
from groundstation.entry.quantity_ranges import RANGES
from groundstation.entry.station_plausibility import design_warnings
from groundstation.errors import SurveyError
from groundstation.survey.files.field_files import read_any
from groundstation.survey.wall.column_deviation import Tolerance, parse_tolerance
from groundstation.survey.well.well_plan import PlanLeg, WellPlan
from telemetry.bounded_bytes import bounded_text
from telemetry.toml_tables import parse_toml_tables

SAME = 1e-6  # m and deg
Finite = Annotated[float, Field(allow_inf_nan=False)]
OneInclination = Annotated[float, Field(ge=0.0, le=180.0)]
OneAzimuth = Annotated[float, Field(ge=RANGES["azimuth_deg"].low, le=RANGES["azimuth_deg"].high)]


class PlanPart(BaseModel):
    """A table of a plan."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class LegSettings(PlanPart):
    """One leg: a length held, built or turned at even rates, or an arc to a direction.

    Rates and a direction to reach give the length; a direction and a length give an arc.
    """

    from_m: Finite | None = Field(None, description="where it begins, if that is to be looked at")
    length_m: Finite | None = None
    build_deg_per_m: Finite = 0.0
    turn_deg_per_m: Finite = 0.0
    to_inclination_deg: OneInclination | None = None
    to_azimuth_deg: OneAzimuth | None = None

    @property
    def has_target(self) -> bool:
        """Whether it says where it leads."""
        return self.to_inclination_deg is not None or self.to_azimuth_deg is not None

    @property
    def has_rates(self) -> bool:
        """Whether it says how fast it bends."""
        return self.build_deg_per_m != 0.0 or self.turn_deg_per_m != 0.0


class PlanSettings(PlanPart):
    """A plan from its head: legs after one another from a direction, or stations with minimum curvature between."""

    north_m: Finite = Field(0.0, description="of the head, from the collar")
    east_m: Finite = 0.0
    down_m: Finite = 0.0
    inclination_deg: OneInclination = Field(0.0, description="in which the first leg begins")
    azimuth_deg: OneAzimuth = 0.0
    tolerance: str = Field("", description="limit along the plan, such as 50 mm + 1:200; that of the hole if absent")
    leg: tuple[LegSettings, ...] = ()
    stations: tuple[tuple[Finite, OneInclination, OneAzimuth], ...] = Field(
        (), description="depth, inclination, azimuth"
    )

    @property
    def head(self) -> tuple[float, float, float]:
        """Head in the frame of the trajectory, m."""
        return self.north_m, self.east_m, self.down_m

    def to_plan(self) -> WellPlan:
        """The plan itself, made once.

        Raises
        ------
        SurveyError
            Names the leg, what was expected and what came.
        """
        return _plan_of(self)

    def to_tolerance(self, otherwise: Tolerance) -> Tolerance:
        """Limit along the plan; errors as ``parse_tolerance``."""
        return parse_tolerance(self.tolerance) if self.tolerance else otherwise


@lru_cache(maxsize=8)
def _plan_of(settings: PlanSettings) -> WellPlan:
    if settings.leg and settings.stations:
        raise SurveyError("plan: expected legs or stations, got both")
    if settings.stations:
        md, inclination, azimuth = np.array(settings.stations).T
        return WellPlan.of_stations(md, np.radians(inclination), np.radians(azimuth))
    legs, now, begin = [], (settings.inclination_deg, settings.azimuth_deg), 0.0
    for number, leg in enumerate(settings.leg, 1):
        if leg.from_m is not None and abs(leg.from_m - begin) > SAME:
            gap = f"a gap of {leg.from_m - begin:g} m" if leg.from_m > begin else "it overlaps the leg above"
            raise SurveyError(f"plan: leg {number}: expected from_m = {begin:g}, got {leg.from_m:g}: {gap}")
        length, end = _end_of(number, leg, now)
        arc = leg.has_target and not leg.has_rates
        to = (math.radians(end[0]), math.radians(end[1])) if arc else None
        legs.append(PlanLeg(length, math.radians(leg.build_deg_per_m), math.radians(leg.turn_deg_per_m), to))
        now, begin = end, begin + length
    return WellPlan.of_legs(math.radians(settings.inclination_deg), math.radians(settings.azimuth_deg), legs)


def _end_of(number: int, leg: LegSettings, now: tuple[float, float]) -> tuple[float, tuple[float, float]]:
    """Length (m) and direction (deg) at the end of a leg that begins in a direction."""
    length = leg.length_m
    if leg.has_target and leg.has_rates:
        if length is not None:
            raise SurveyError(
                f"plan: leg {number}: expected a length, or rates and a direction to reach, got all of them"
            )
        length = _length_to(number, leg, now)
    if length is None:
        raise SurveyError(f"plan: leg {number}: expected length_m, or a rate and a direction to reach")
    if leg.has_target and not leg.has_rates:
        inclination = now[0] if leg.to_inclination_deg is None else leg.to_inclination_deg
        return length, (inclination, now[1] if leg.to_azimuth_deg is None else leg.to_azimuth_deg)
    return length, (now[0] + length * leg.build_deg_per_m, now[1] + length * leg.turn_deg_per_m)


def _length_to(number: int, leg: LegSettings, now: tuple[float, float]) -> float:
    """Length (m) after which the rates of a leg have come to its direction."""
    found = []
    for name, rate, begin, end in (
        ("build_deg_per_m", leg.build_deg_per_m, now[0], leg.to_inclination_deg),
        ("turn_deg_per_m", leg.turn_deg_per_m, now[1], leg.to_azimuth_deg),
    ):
        if end is None:
            continue
        if rate * (end - begin) <= 0.0:
            raise SurveyError(
                f"plan: leg {number}: expected a {name} that leads from {begin:g} to {end:g} deg, got {rate:g}"
            )
        found.append((end - begin) / rate)
    if max(found) - min(found) > SAME:
        both = " and ".join(f"{length:g}" for length in found)
        raise SurveyError(f"plan: leg {number}: its rates come to its inclination and azimuth after {both} m")
    return found[0]


def plan_warnings(settings: PlanSettings | None) -> tuple[EntryWarning, ...]:
    """What of a plan hardly any string follows; errors as ``PlanSettings.to_plan``."""
    if settings is None:
        return ()
    plan = settings.to_plan()
    return design_warnings(plan.md, plan.tangents, "the plan")


def read_plan(path: Path) -> PlanSettings:
    """Plan of a file: legs as TOML (tables ``[[leg]]``), or stations in any format that a survey may have.

    Raises
    ------
    SurveyError
        One line: the file, what was expected and what came.
    """
    found = _read_legs(path) if path.suffix == ".toml" else _read_plan_stations(path)
    try:
        found.to_plan()
        found.to_tolerance(Tolerance("", 0.0, 0.0))
    except SurveyError as error:
        raise SurveyError(f"{path}: {error}") from None
    return found


def _read_plan_stations(path: Path) -> PlanSettings:
    """Stations of a design, of which none may be missing: without one it would be another design."""
    record = read_any(path).record
    if record.of_displacements:
        raise SurveyError(f"{path}: expected stations with inclination and azimuth, got displacements")
    if record.warnings:
        raise SurveyError(f"{path}: a plan has a value at every station; {record.warnings[0].text}")
    columns = (record.md, np.degrees(record.inclination), np.degrees(record.azimuth))
    return PlanSettings(stations=tuple(zip(*(column.tolist() for column in columns), strict=True)))


def _read_legs(path: Path) -> PlanSettings:
    try:
        return PlanSettings(**parse_toml_tables(bounded_text(path)))
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "not a text file"
        raise SurveyError(f"{path}: {reason}; expected a plan") from error
    except tomllib.TOMLDecodeError as error:
        raise SurveyError(f"{path}: not TOML: {error}") from error
    except ValidationError as error:
        first = error.errors()[0]
        name = ".".join(str(part + 1) if isinstance(part, int) else part for part in first["loc"])
        raise SurveyError(f"{path}: {name}: {first['msg']}, got {first['input']!r:.60}") from error
