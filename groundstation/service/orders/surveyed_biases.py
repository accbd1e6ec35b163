"""Biases of the accelerometers of a string from the surveys of its hole, and of which tubes there is none. No I/O."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from groundstation.service.hole.surveyed_hole import SurveyedHole
from groundstation.survey.adjustment.tube_biases import SurveyedBiases, bias_of_tube
from telemetry.messages import NodeState


def surveyed_biases(hole: SurveyedHole, states: Mapping[int, NodeState], mixed: Collection[int]) -> SurveyedBiases:
    """What all surveys tell; those of tubes that get no block help to know the stations.

    Parameters
    ----------
    states : newest of each tube
    mixed : tubes whose block was replaced after a survey of the hole
    """
    examined = hole.examined
    places = {} if examined is None else {int(tube): place for place, tube in enumerate(examined.tubes)}
    refused = {tube: reason for tube in places if (reason := _why_not(hole, tube, states.get(tube), mixed))}
    if examined is None:
        return SurveyedBiases({}, refused)
    found = {t: bias_of_tube(examined.adjusted, place) for t, place in sorted(places.items()) if t not in refused}
    return SurveyedBiases(found, refused)


def _why_not(hole: SurveyedHole, tube: int, state: NodeState | None, mixed: Collection[int]) -> str:
    """Why the bias of a tube makes no block; empty where it does."""
    if state is not None and state.alignment[2] > 0.0:
        return "it is aligned, and another block would drop that"
    if tube in mixed:
        return "its block was replaced after its first survey of this hole"
    if any(len(stop.forces) > 1 for station in hole.stations for stop in station.stops if stop.tube == tube):
        return "it has several IMUs, of which a survey has one mean"
    return ""
