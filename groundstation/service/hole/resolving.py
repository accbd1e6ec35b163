"""From surveys as they were sent to directions of their tubes, many at a time. No I/O.

What a survey comes to by itself depends on nothing but itself, so a ground station that starts upon ten thousand of
them works them out by the hundred: in small matrices one by one most of the time goes to calls.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from groundstation.errors import SurveyError
from groundstation.survey.fusion.resolve import Quality, Resolved, check_all, combine_imus, resolve_all
from telemetry.messages import SurveyMeasurement

ACCELEROMETER_NOISE_DEG = 0.02  # one sample, for the check of motion


@dataclass(frozen=True, slots=True)
class ResolvedSurvey:
    """What a survey comes to: its direction, and what is wrong with the stop."""

    resolved: Resolved
    quality: Quality


def resolve_survey(measurement: SurveyMeasurement, gravity: float) -> ResolvedSurvey:
    """Direction of one survey under a gravity (m/s^2).

    Raises
    ------
    SurveyError
        When it has none.
    numpy.linalg.LinAlgError
        When its IMUs cannot be weighed.
    """
    return _resolve_alike([measurement], gravity)[0]


def resolve_surveys(measurements: Sequence[SurveyMeasurement], gravity: float) -> list[ResolvedSurvey | None]:
    """The same of many, bit for bit; None for those that are to be looked at one by one."""
    alike: dict[int, list[int]] = defaultdict(list)
    for place, measurement in enumerate(measurements):
        alike[len(measurement.imus)].append(place)
    found: list[ResolvedSurvey | None] = [None] * len(measurements)
    for places in alike.values():
        try:
            together = _resolve_alike([measurements[place] for place in places], gravity)
        except (SurveyError, np.linalg.LinAlgError):
            continue  # of one; who it is comes out where each is resolved by itself
        for place, one in zip(places, together, strict=True):
            found[place] = one
    return found


def _resolve_alike(measurements: Sequence[SurveyMeasurement], gravity: float) -> list[ResolvedSurvey]:
    """Of surveys with the same number of IMUs."""
    forces = np.array([[imu.force for imu in one.imus] for one in measurements])
    covs = np.array([[imu.force_cov for imu in one.imus] for one in measurements])
    combined = combine_imus(forces, covs)
    yaws, yaw_vars = [one.yaw for one in measurements], [one.yaw_var for one in measurements]
    resolved = resolve_all(*combined, yaws, yaw_vars)
    samples, settle_times = [one.samples for one in measurements], [one.settle_time for one in measurements]
    noise = math.radians(ACCELEROMETER_NOISE_DEG) * gravity
    quality = check_all(forces, covs, combined, gravity, samples, settle_times, noise)
    return [ResolvedSurvey(*row) for row in zip(resolved, quality, strict=True)]
