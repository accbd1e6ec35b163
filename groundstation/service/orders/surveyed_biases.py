"""Biases of the accelerometers of a string from the surveys of its hole, and of which tubes there is none. No I/O."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping

import numpy as np

from groundstation.config import SENSOR_BIAS_DEG, GroundConfig
from groundstation.service.hole.surveyed_hole import SurveyedHole
from groundstation.survey.fusion.force_biases import Look, SurveyedBiases, look_of, solve_biases
from groundstation.survey.fusion.trust_level import Trust
from telemetry.messages import NodeState

GRAVITY_STD = 2e-3  # m/s^2, of what is entered for the site


def surveyed_biases(
    config: GroundConfig, hole: SurveyedHole, states: Mapping[int, NodeState], mixed: Collection[int]
) -> SurveyedBiases:
    """What all surveys that count tell; those of tubes that get no block help to know the stations.

    Parameters
    ----------
    states : newest of each tube
    mixed : tubes whose block was replaced after a survey of the hole
    """
    bias_std = math.radians(max(config.accelerometer_bias_std_deg, SENSOR_BIAS_DEG)) * config.gravity
    looks = list(_looks_of_hole(hole, config.gravity))
    found = solve_biases(looks, bias_std, GRAVITY_STD)
    refused = {tube: reason for tube in found if (reason := _why_not(hole, tube, states.get(tube), mixed))}
    return SurveyedBiases({tube: one for tube, one in found.items() if tube not in refused}, refused)


def _looks_of_hole(hole: SurveyedHole, gravity: float) -> Iterator[Look]:
    for station in hole.stations:
        if station.md <= 0.0:
            continue  # at the collar tubes may be anywhere
        for place, stop in enumerate(station.stops):
            if stop.trust is not Trust.FULL:
                continue
            where = station.md, station.first_before(place + 1)  # before and after it moved these are two
            force = np.mean(np.array(stop.forces), axis=0)
            var, yaw = stop.force_var, stop.yaw
            yield look_of(where, stop.tube, stop, (stop.causes, stop.places), force, var, yaw, gravity)


def _why_not(hole: SurveyedHole, tube: int, state: NodeState | None, mixed: Collection[int]) -> str:
    """Why the bias of a tube makes no block; empty where it does."""
    if state is not None and state.alignment[2] > 0.0:
        return "it is aligned, and another block would drop that"
    if tube in mixed:
        return "its block was replaced after its first survey of this hole"
    if any(len(stop.forces) > 1 for station in hole.stations for stop in station.stops if stop.tube == tube):
        return "it has several IMUs, of which a survey has one mean"
    return ""
