"""Biases of the accelerometers of a string from the surveys of its hole, and of which tubes there is none. No I/O."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from groundstation.config import SENSOR_BIAS_DEG
from groundstation.service.answers.model import RigModel
from groundstation.survey.fusion.force_biases import Look, SurveyedBiases, look_of, solve_biases
from groundstation.survey.fusion.survey_trust import Trust

GRAVITY_STD = 2e-3  # m/s^2, of what is entered for the site


def surveyed_biases(k: RigModel) -> SurveyedBiases:
    """What all surveys that count tell; those of tubes that get no block help to know the stations."""
    config = k.config
    bias_std = math.radians(max(config.accelerometer_bias_std_deg, SENSOR_BIAS_DEG)) * config.gravity
    looks = list(_looks(k))
    found = solve_biases(looks, bias_std, GRAVITY_STD)
    refused = {tube: reason for tube in found if (reason := _why_not(k, tube))}
    return SurveyedBiases({tube: one for tube, one in found.items() if tube not in refused}, refused)


def _looks(k: RigModel) -> Iterator[Look]:
    for station in k.stations:
        if station.md <= 0.0:
            continue  # at the collar tubes may be anywhere
        for place, cluster in enumerate(station.clusters):
            if cluster.trust is not Trust.FULL:
                continue
            hole = station.md, station.first_before(place + 1)  # before and after it moved these are two
            force = np.mean(np.array(cluster.forces), axis=0)
            var, yaw = cluster.force_var, cluster.yaw
            yield look_of(hole, cluster.tube, cluster.direction, force, var, yaw, k.config.gravity)


def _why_not(k: RigModel, tube: int) -> str:
    """Why the bias of a tube makes no block; empty where it does."""
    state = k.nodes.get(tube)
    if state is not None and state.alignment[2] > 0.0:
        return "it is aligned, and another block would drop that"
    if tube in k.recalibration.progress.mixed:
        return "its block was replaced after its first survey of this hole"
    if any(len(cluster.forces) > 1 for station in k.stations for cluster in station.clusters if cluster.tube == tube):
        return "it has several IMUs, of which a survey has one mean"
    return ""
