"""What the ground station's keys hold, as plain objects: degrees, metres and seconds, the unit in every name."""

from __future__ import annotations

import datetime
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from groundstation.errors import SelectorError, SurveyError
from groundstation.service.answers.model import RigModel
from groundstation.service.answers.streamed_rows import STREAMED, window
from groundstation.service.hole.station import SurveyStation
from groundstation.service.hole.surveyed_hole import Hole
from groundstation.survey.fusion.resolve import angle_stds_of_all, direction_angles
from groundstation.survey.well.trajectory import TrajectoryPoint, interpolate_point
from telemetry.messages import Event, NodeFlag, NodeState, StaticRecord

View = dict[str, Any]
Array = npt.NDArray[np.float64]
POSITION = ("north_m", "east_m", "tvd_m", "sigma_north_m", "sigma_east_m", "sigma_tvd_m")
Parameters = dict[str, str]


@dataclass(frozen=True, slots=True)
class Range:
    """Closed interval of a selector's parameter: ``4..12``, ``4..``, ``..12`` or a single value."""

    low: float
    high: float
    single: bool

    @classmethod
    def parse(cls, name: str, text: str) -> Range:
        """Range of a parameter.

        Raises
        ------
        SelectorError
            When it is neither a number nor a range.
        """
        first, dots, last = text.partition("..")
        try:
            low = float(first) if first or not dots else -math.inf
            high = (float(last) if last else math.inf) if dots else low
        except ValueError:
            low = high = math.nan
        if not low <= high:
            raise SelectorError(f"parameter {name}: expected a number or a range such as {name}=4..12, got {text!r}")
        return cls(low, high, not dots)

    def holds(self, value: float) -> bool:
        """Whether ``value`` lies inside, to the last millimetre."""
        return self.low - 1e-3 <= value <= self.high + 1e-3


def status(k: RigModel, _p: Parameters) -> View:
    """Rig time, depth, counts, health."""
    stale = [tube for tube in k.tally.tubes if k.is_stale(tube)]
    return {
        "rig": k.config.rig,
        "bit_md_m": k.depths.latest,
        "tubes": len(k.tally.tubes),
        "stale_tubes": stale,
        "stations": len(k.stations),
        "measurements": sum(s.count for s in k.stations),
        "unplaced_measurements": k.unplaced,
        "refused_measurements": k.refused,
        "set_aside_measurements": len(k.set_aside),
        "untrusted_measurements": sum(s.untrusted for s in k.stations),
        "health": k.health.name.lower(),
        "epoch": k.epoch,
        "alarms": sorted({alarm.kind.code for alarm in k.rig_alarms}),
    }


def changes(k: RigModel, _p: Parameters) -> View:
    """Revision at which each path changed last: a client with an older answer has missed a change."""
    return {"changes": [{"path": path, "changed_at": at} for path, at in sorted(k.changed_at.items())]}


def string(k: RigModel, _p: Parameters) -> View:
    """Tubes from top to bottom."""
    bit = k.depths.latest
    rows = []
    for tube in k.tally.tubes:
        below = k.tally.length_below(tube)
        md = None if bit is None or below is None else round(bit - below, 6)
        rows.append({"tube": tube, "md_m": md, "age_s": finite(k.age(tube)), "stale": k.is_stale(tube)})
    return {"tubes": rows}


def node(k: RigModel, tube: int) -> View:
    """Last state of one node."""
    s = k.nodes[tube]
    return {
        "tube": tube,
        "at_s": s.at,
        "age_s": finite(k.age(tube)),
        "stale": k.is_stale(tube),
        "hops": s.hops,
        "mode": s.mode.name.lower(),
        "yaw_deg": math.degrees(s.yaw),
        "sigma_yaw_deg": math.degrees(math.sqrt(s.yaw_var)),
        "sigma_systematic_deg": math.degrees(math.sqrt(s.systematic_var)),
        "gyro_bias_dps": [math.degrees(b) for b in s.gyro_bias],
        "scale_factor": s.scale_factor,
        "innovation_deg": math.degrees(s.innovation),
        "sigma_innovation_deg": math.degrees(math.sqrt(s.innovation_var)),
        "aiding_age_s": finite(s.aiding_age),
        "sigma_clock_s": math.sqrt(s.clock_var),
        "flags": flag_names(s.flags),
        "cycles": s.cycles,
        "overruns": s.overruns,
        "upper_margin_db": finite(s.upper_margin),
        "lower_margin_db": finite(s.lower_margin),
        "parameters_version": s.parameters_version,
        "parameters_hash": s.parameters_hash.hex(),
        "alignment": alignment(s),
    }


def alignment(s: NodeState) -> View | None:
    """Offset of an IMU's mount that a node corrects; None for one never aligned."""
    pitch, roll, std = map(math.degrees, s.alignment)
    return None if std == 0.0 else {"pitch_deg": pitch, "roll_deg": roll, "sigma_deg": std}


def stations(k: RigModel, p: Parameters) -> View:
    """All stations, fused; ``md`` selects."""
    wanted = Range.parse("md", p["md"]) if "md" in p else None
    numbers = [n for n, s in enumerate(k.stations, 1) if wanted is None or wanted.holds(s.md)]
    return {"stations": station_rows(k, numbers)}


def station(k: RigModel, n: int) -> View:
    """One station, fused; ``n`` from 1."""
    return station_rows(k, [n])[0]


def station_rows(k: RigModel, numbers: Sequence[int]) -> list[View]:
    """Stations of these numbers, fused; those to which nothing has come since they were shown last are as they were.

    What a string turns by in a bent hole changes with the stations around.
    """
    known, drawn = k.stations, k.hole.trajectory
    chosen = [known[n - 1] for n in numbers]
    changed = chosen if k.hole.has_transport else [s for s in chosen if s.shown is None]
    for s, view in zip(changed, direction_views(k.hole, changed), strict=True):
        s.show(view)
    places = [k.hole.place_of(s) for s in chosen]
    positions = position_views(drawn.positions[places], drawn.covs[places])
    rows = zip(numbers, chosen, positions, strict=True)
    return [{"station": n, "md_m": round(s.md, 6)} | (s.shown or {}) | position for n, s, position in rows]


def direction_views(hole: Hole, chosen: Sequence[SurveyStation]) -> list[View]:
    """Directions of stations and what each is made of."""
    if not chosen:
        return []
    found = [hole.direction_of(s) for s in chosen]
    downs, covs = [one.down for one in found], np.array([one.total_cov for one in found])
    stds = angle_stds_of_all(np.array([one.lean for one in found]), downs, covs)
    return [
        direction_view(s, direction_angles(one.lean, one.down), own, hole.transport_of(s))
        for s, one, own in zip(chosen, found, stds, strict=True)
    ]


def direction_view(
    s: SurveyStation, pointing: tuple[float, float], stds: tuple[float, float], transport: tuple[float, float]
) -> View:
    """Direction of a station and what it is made of; angles, their standard deviations and the transport in rad."""
    inclination, azimuth = pointing
    return {
        "inclination_deg": math.degrees(inclination),
        "azimuth_deg": math.degrees(azimuth),
        "sigma_inclination_deg": math.degrees(stds[0]),
        "sigma_azimuth_deg": math.degrees(stds[1]),
        "transport_deg": math.degrees(transport[0]),
        "sigma_transport_deg": math.degrees(transport[1]),
        "measurements": s.count,
        "dropped_measurements": s.first,
        "untrusted_measurements": s.untrusted,
    } | typical_reading(s)


def typical_reading(s: SurveyStation) -> View:
    """Root mean squares over the readings of a station; columns that ``borechain survey --instrument relay`` takes."""
    yaw, systematic, force = s.mean_variances()
    return {
        "sigma_yaw_deg": math.degrees(math.sqrt(yaw)),
        "sigma_systematic_deg": math.degrees(math.sqrt(systematic)),
        "sigma_force_mps2": math.sqrt(force),
    }


def trajectory(k: RigModel, p: Parameters) -> View:
    """Positions with covariance: at the stations, in a range of depth, or interpolated at one depth."""
    points = k.hole.trajectory.points
    if "md" in p:
        wanted = Range.parse("md", p["md"])
        if wanted.single:
            try:
                points = [interpolate_point(points, wanted.low)]
            except SurveyError as error:
                raise SelectorError(f"parameter md: {error}") from error
        else:
            points = [point for point in points if wanted.holds(point.md)]
    return {"method": "balanced-tangential", "points": point_views(points)}


def events(k: RigModel, p: Parameters) -> View:
    """What happened; ``tube`` selects."""
    wanted = Range.parse("tube", p["tube"]) if "tube" in p else None
    newest = k.seen["events"]
    first = newest - len(k.events) + 1
    rows = [event(e, n) for n, e in enumerate(k.events, first) if wanted is None or wanted.holds(e.tube)]
    return {"newest": newest, "events": window(rows, newest, p)}


def event(e: Event, seq: int) -> View:
    """One event."""
    return {
        "seq": seq,
        "tube": e.tube,
        "sequence": e.sequence,
        "at_s": e.at,
        "severity": e.severity.name.lower(),
        "code": e.code,
        "arguments": e.arguments,
    }


def static_records(k: RigModel, p: Parameters) -> View:
    """Raw readings averaged at rest; ``tube`` selects."""
    wanted = Range.parse("tube", p["tube"]) if "tube" in p else None
    newest = k.seen["static_records"]
    first = newest - len(k.static_records) + 1
    rows = [
        static_record(r, n) for n, r in enumerate(k.static_records, first) if wanted is None or wanted.holds(r.tube)
    ]
    return {"newest": newest, "static_records": window(rows, newest, p)}


def recalibration(k: RigModel, _p: Parameters) -> View:
    """Calibration in the field: how far, and what it found."""
    return k.recalibration.view()


def static_record(r: StaticRecord, seq: int) -> View:
    """One static record; the covariances are those of one sample."""
    return {
        "seq": seq,
        "tube": r.tube,
        "sequence": r.sequence,
        "order": r.command,
        "begun_at_s": r.begun_at,
        "ended_at_s": r.ended_at,
        "samples": r.samples,
        "rate_rad_s": list(r.rate),
        "rate_cov_rad2_s2": [list(row) for row in r.rate_cov],
        "force_m_s2": list(r.force),
        "force_cov_m2_s4": [list(row) for row in r.force_cov],
        "temperature_c": r.temperature,
        "moved": r.moved,
    }


def point_views(points: Sequence[TrajectoryPoint]) -> list[View]:
    """Points of the trajectory."""
    if not points:
        return []
    positions = position_views(np.array([q.position for q in points]), np.array([q.cov for q in points]))
    return [point_view(*row) for row in zip(points, positions, strict=True)]


def point_view(point: TrajectoryPoint, position: View) -> View:
    """One point of the trajectory."""
    inclination, azimuth = direction_angles(point.tangent[:2], float(point.tangent[2]))
    row: View = {
        "md_m": round(point.md, 6),
        "inclination_deg": math.degrees(inclination),
        "azimuth_deg": math.degrees(azimuth),
    }
    return row | position | {"covariance_m2": point.cov.tolist()}


def position_views(positions: Array, covs: Array) -> list[View]:
    """Positions (n, 3), m, and their standard deviations from covariances (n, 3, 3)."""
    stds = np.sqrt(np.maximum(covs.diagonal(axis1=1, axis2=2), 0.0))
    rows = np.concatenate([positions, stds], axis=1).tolist()
    return [dict(zip(POSITION, row, strict=True)) for row in rows]


def flag_names(flags: NodeFlag) -> list[str]:
    """Names of the flags that are set."""
    return [flag.name.lower() for flag in NodeFlag if flag and flag in flags and flag.name]


def streamed(p: Parameters) -> bool:
    """Whether rows are asked for in the order of their coming."""
    return any(name in p for name in STREAMED)


def finite(value: float) -> float | None:
    """JSON has no infinity and no nan."""
    return value if math.isfinite(value) else None


def utc_text(utc: float) -> str | None:
    """A time of people (s since 1970) as ISO 8601; None for none."""
    if not math.isfinite(utc):
        return None
    return datetime.datetime.fromtimestamp(utc, datetime.UTC).isoformat(timespec="milliseconds")
