"""Surveys of a string that is drilled down tube by tube, as a ground station without any bus takes them."""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from hand_fed import TOLD

from groundstation.config import GroundConfig
from groundstation.service.answers.model import RigModel
from groundstation.survey.fusion.resolve import direction_angles
from telemetry.messages import ImuMean, NodeFlag, SurveyMeasurement

G = 9.81
DEG = math.pi / 180.0
VAR = (0.0034**2) / 32
COV = ((VAR, 0.0, 0.0), (0.0, VAR, 0.0), (0.0, 0.0, VAR))
BETWEEN_STOPS = 600.0  # s
Placed = tuple[SurveyMeasurement, float]


def survey(
    tube: int, stop: int, hops: int, inclination_deg: float, azimuth_deg: float = 0.0, apart: float = 0.5
) -> SurveyMeasurement:
    """One IMU of a tube at a stop; the tubes answer one after the other."""
    inclination, azimuth, yaw = inclination_deg * DEG, azimuth_deg * DEG, 0.3 * tube
    s = math.sin(inclination)
    force = (G * s * math.cos(azimuth - yaw), G * s * math.sin(azimuth - yaw), -G * math.cos(inclination))
    return SurveyMeasurement(
        tube, stop, BETWEEN_STOPS * stop + apart * tube, hops, (ImuMean(force, COV),), yaw, (0.01 * DEG) ** 2,
        (0.1 * DEG) ** 2, 32, 20.0, NodeFlag.NONE,
    )  # fmt: skip


def passes(stops: int, inclination_deg: Callable[[int, int], float], apart: float = 0.5) -> list[Placed]:
    """Tube 1 is at the bit and one tube is added on top a stop: at stop t tube k is at station t - k + 1."""
    return [
        (
            survey(tube, stop, stop - tube + 1, inclination_deg(stop, stop - tube + 1), apart=apart),
            2.0 * (stop - tube + 1),
        )
        for stop in range(1, stops + 1)
        for tube in range(1, stop + 1)
    ]


def knowing(tmp_path: Path, measurements: list[Placed], tubes: int = 0, **settings: Any) -> RigModel:
    """RigModel of surveys in the order in which they come; the string's order is known beforehand."""
    model = RigModel.begin(GroundConfig(folder=tmp_path, **TOLD | settings))
    model.string.tally.restore(list(range(tubes, 0, -1)))
    for measurement, md in measurements:
        assert model.placement.place_one(measurement, md) == ""
    return model


def inclination_deg(model: RigModel, station: int) -> float:
    fused = model.hole.direction_of(model.hole.stations[station])
    return direction_angles(fused.lean, fused.down)[0] / DEG


def result(model: RigModel) -> dict[str, Any]:
    """All that follows from the surveys."""
    stations = [(s.md, s.first, [(c.tube, c.sequence) for c in s.stops]) for s in model.hole.stations]
    fused = [model.hole.direction_of(s) for s in model.hole.stations]
    directions = [np.concatenate([f.lean, [f.down], f.cov.ravel(), f.total_cov.ravel()]) for f in fused]
    points = [np.concatenate([[p.md], p.position, p.cov.ravel()]) for p in model.hole.trajectory]
    assert model.hole.projection is not None
    end = model.hole.projection
    projection = [np.concatenate([end.ends.offset, end.ends.cov.ravel(), [end.within, end.half_width]])]
    moved = sorted((m.md, m.at, m.dropped) for m in model.hole.moved)
    return {
        "stations": stations, "directions": directions, "points": points, "projection": projection, "moved": moved,
    }  # fmt: skip


def differing(one: dict[str, Any], other: dict[str, Any]) -> list[str]:
    """What differs by more than the order in which shared errors were met, and so are summed, explains."""
    return [name for name, value in one.items() if not same(value, other[name])]


def same(one: Any, other: Any) -> bool:
    if one and isinstance(one[0], np.ndarray):
        return all(np.allclose(a, b, rtol=1e-10, atol=1e-18) for a, b in zip(one, other, strict=True))
    return bool(one == other)
