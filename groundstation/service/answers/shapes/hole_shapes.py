"""Answers about the surveys of the hole: stations, measurements, trajectory, region of uncertainty."""

from __future__ import annotations

from typing import Annotated

from groundstation.service.answers.shapes.answer_fields import OneOf, answer_class
from groundstation.service.answers.shapes.string_shapes import (
    Flags,
    Newest,
    Seq,
    Sequence,
    SystematicSigma,
    Tube,
    Yaw,
    YawSigma,
)
from groundstation.survey.fusion.trust_level import Trust

MeasuredDepth = Annotated[float, "measured depth"]
StationNumber = Annotated[int, "number, from the collar down"]
Inclination = Annotated[float, "from the vertical"]
Azimuth = Annotated[float, "from north, clockwise"]
Sigma = Annotated[float, "standard deviation"]
FromCollar = Annotated[float, "from the collar"]
TrueVerticalDepth = Annotated[float, "true vertical depth"]
PositionCovariance = Annotated[list[list[float]], "of north, east, down"]
RmsOfStation = Annotated[float, "root mean square of those that count"]
SemiAxisLength = Annotated[float, "semi-axis"]


@answer_class
class Station:
    """One station of the hole, fused."""

    station: StationNumber
    md_m: MeasuredDepth
    inclination_deg: Inclination
    azimuth_deg: Azimuth
    sigma_inclination_deg: Sigma
    sigma_azimuth_deg: Sigma
    transport_deg: Annotated[
        float, "by which the string turns in the bent hole above: in the azimuth, not in measurements"
    ]
    sigma_transport_deg: Annotated[float, "standard deviation of that"]
    measurements: Annotated[int, "clusters measured here"]
    dropped_measurements: Annotated[int, "of them from before the hole moved"]
    untrusted_measurements: Annotated[int, "of them with a yaw that is taken for unknown"]
    sigma_yaw_deg: RmsOfStation
    sigma_systematic_deg: RmsOfStation
    sigma_force_mps2: Annotated[float, "root mean square of those that count, one axis"]
    north_m: FromCollar
    east_m: FromCollar
    tvd_m: TrueVerticalDepth
    sigma_north_m: Sigma
    sigma_east_m: Sigma
    sigma_tvd_m: Sigma


@answer_class
class StationsAnswer:
    """All stations, fused."""

    stations: list[Station]


@answer_class
class MeasurementRow:
    """One survey of one node."""

    seq: Seq
    station: StationNumber
    md_m: MeasuredDepth
    tube: Tube
    sequence: Sequence
    replaces: Annotated[int | None, "the tube's number of the same survey before its yaw was known better"]
    station_at_s: Annotated[float, "rig time, end of the average"]
    hops: Annotated[int, "distance from the encoder in tubes"]
    inclination_deg: Inclination
    azimuth_deg: Azimuth
    sigma_inclination_deg: Sigma
    sigma_azimuth_deg: Sigma
    yaw_deg: Yaw
    sigma_yaw_deg: YawSigma
    sigma_systematic_deg: SystematicSigma
    forces_mps2: Annotated[list[list[float]], "mean specific force of each IMU"]
    samples: Annotated[int, "in the mean"]
    settle_s: Annotated[float, "between the stop and the end of the average"]
    flags: Flags
    trust: Annotated[
        str,
        "what the flags make of it",
        OneOf(*(trust.name.lower() for trust in (Trust.FULL, Trust.UNKNOWN_YAW))),
    ]
    quality: Annotated[list[str], "checks that it failed"]


@answer_class
class MeasurementsAnswer:
    """Every survey that belongs to a station."""

    newest: Newest
    measurements: list[MeasurementRow]


@answer_class
class StationMeasurementsAnswer:
    """Every survey of one station."""

    station: Annotated[int, "number"]
    measurements: list[MeasurementRow]


@answer_class
class TrajectoryRow:
    """One point of the trajectory."""

    md_m: MeasuredDepth
    inclination_deg: Inclination
    azimuth_deg: Azimuth
    north_m: FromCollar
    east_m: FromCollar
    tvd_m: TrueVerticalDepth
    sigma_north_m: Sigma
    sigma_east_m: Sigma
    sigma_tvd_m: Sigma
    covariance_m2: PositionCovariance


@answer_class
class TrajectoryAnswer:
    """Positions with covariance."""

    method: Annotated[str, "how the stations are joined", OneOf("minimum-curvature")]
    points: list[TrajectoryRow]


@answer_class
class PlanEllipse:
    """Ellipse of a region of uncertainty, seen from above."""

    major_m: SemiAxisLength
    minor_m: SemiAxisLength
    azimuth_deg: Annotated[float, "of the major one"]


@answer_class
class SemiAxis:
    """One of three of the ellipsoid of a region of uncertainty."""

    semi_axis_m: Annotated[float, "its length"]
    direction: Annotated[list[float], "unit vector: north, east, down"]


@answer_class
class PositionSigmas:
    """What one source of errors makes of the uncertainty of a position."""

    sigma_north_m: Sigma
    sigma_east_m: Sigma
    sigma_tvd_m: Sigma


@answer_class
class StationRegion:
    """Region of uncertainty of one station."""

    md_m: MeasuredDepth
    covariance_m2: PositionCovariance
    plan_ellipse: PlanEllipse
    ellipsoid: list[SemiAxis]
    sources: dict[str, PositionSigmas]


@answer_class
class UncertaintyAnswer:
    """Regions of uncertainty and what they are made of."""

    confidence: Annotated[float, "share of true positions inside"]
    sigma_plane: Annotated[float, "standard deviations to the ellipse"]
    sigma_space: Annotated[float, "standard deviations to the ellipsoid"]
    stations: list[StationRegion]
