"""Gyros that initialise, then run: weights that depend on the stations before.

A stationary gyro measures azimuth against the Earth's rotation up to some inclination. Beyond it a continuous survey
begins with the azimuth that was found there, so the stationary errors are kept as they were at that inclination, while
drift and random walk grow from station to station:

    drift        h_k = h_k-1 + dD_k / (c sin(I))          random walk  h_k = sqrt(h_k-1^2 + dD_k / (c sin(I)^2))

A hole that comes back below that inclination initialises anew: what is random in an initialisation is another error in
every such section. Arrays are (..., n), leading axes are wells; rad and m.
Source: SPE 90408, tables 3 to 8 and appendix C; Definition of the ISCWSA error model, revision 5.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from groundstation.survey.tools.formulas import ARRAY
from groundstation.survey.tools.instruments import PREVIOUS, Term
from groundstation.survey.well.error_sources import (
    TINY,
    Leg,
    Site,
    WellSurvey,
    compile_term_formulas,
    inputs_of,
    leaning_azimuth,
    station_values,
)

Array = npt.NDArray[np.float64]
TURNS = 6  # weights of depth, inclination and azimuth, and the singular ones


def mode_weights(leg: Leg, survey: WellSurvey, site: Site) -> dict[int, list[Array]]:
    """Weights (..., n - 1), ``TURNS`` of them, of the terms of a leg that depend on the stations before, by place."""
    places = [t for t, term in enumerate(leg.tool.terms) if term.by_mode]
    if not places:
        return {}
    values = station_values(survey, site)
    shape = survey.inclination[..., 1:].shape
    found = {}
    for t in places:
        term = leg.tool.terms[t]
        if any(PREVIOUS in weight.lower() for weight in term.weights):
            found[t] = _grown(leg, term, survey, site, values)
            continue
        live = [np.broadcast_to(weight, shape) for weight in _weights(leg, term, site, values)]
        inside, beyond = _inside(term, survey)
        out = [np.where(inside, weight, 0.0) for weight in live]
        if term.kept and bool(np.any(beyond)):
            held = _held(leg, term, survey, site, values)
            out = [np.where(beyond, kept, weight) for kept, weight in zip(held, out, strict=True)]
        found[t] = out
    return found


def sections_of(term: Term, inclination: Array) -> npt.NDArray[np.int64]:
    """Number (..., n - 1) of the section of every station from the second on: how often a gyro initialised so far."""
    gate = term.window[0]
    above = inclination > gate
    return np.cumsum(above[..., 1:] & ~above[..., :-1], axis=-1)


def _inside(term: Term, survey: WellSurvey) -> tuple[npt.NDArray[np.bool_], npt.NDArray[np.bool_]]:
    """Whether a station (..., n - 1) lies in the range of a term, and whether beyond it."""
    low, high = term.window
    inclination = survey.inclination[..., 1:]
    return (inclination > low) & (inclination <= high), inclination > high


def _weights(leg: Leg, term: Term, site: Site, values: Mapping[str, Any]) -> list[Any]:
    function = compile_term_formulas((term.formulas[:TURNS],), tuple(leg.tool.parameters))
    with np.errstate(all="ignore"):
        return function(ARRAY, inputs_of(leg.tool, site, values))


def _grown(leg: Leg, term: Term, survey: WellSurvey, site: Site, values: Mapping[str, Array]) -> list[Array]:
    """Weights of a drift or a random walk: from nothing where its range begins, kept beyond it or gone."""
    inside, beyond = _inside(term, survey)
    shape = inside.shape
    state, out = np.zeros(shape[:-1]), np.zeros(shape)
    for k in range(leg.first - 1, shape[-1]):
        here = {name: value[..., k] if np.ndim(value) else value for name, value in values.items()}
        grown = np.asarray(_weights(leg, term, site, {**here, "Previous": state})[2])
        kept = np.where(beyond[..., k] & term.kept, state, 0.0)
        state = np.where(inside[..., k], grown, kept)
        out[..., k] = state
    zero = np.zeros(shape)
    return [zero, zero, out, zero, zero, zero]


def _held(leg: Leg, term: Term, survey: WellSurvey, site: Site, values: Mapping[str, Array]) -> list[Array]:
    """Weights with which the hole last passed the end of the term's range, or with which the leg began beyond it."""
    gate = term.window[1]
    inclination, azimuth = survey.inclination, leaning_azimuth(survey)
    passed = (inclination[..., 1:] > gate) & (inclination[..., :-1] <= gate)
    azimuths = _azimuth_at(gate, inclination, azimuth)
    inclinations = np.full(azimuths.shape, max(gate, TINY))
    start = leg.first - 1  # a leg that begins beyond its range initialises where it begins
    first = inclination[..., start] > gate
    inclinations[..., start] = np.where(first, np.maximum(inclination[..., start], TINY), inclinations[..., start])
    azimuths[..., start] = np.where(first, azimuth[..., start], azimuths[..., start])
    passed[..., start] |= first
    there = dict.fromkeys(("Inc", "IncPrev"), inclinations)
    there |= dict.fromkeys(("Az", "AzPrev", "AzT", "AzTPrev"), azimuths)
    there |= dict.fromkeys(("AzM", "AzMPrev"), azimuths - site.declination)
    last = np.maximum.accumulate(np.where(passed, np.arange(passed.shape[-1]), 0), axis=-1)
    found = _weights(leg, term, site, {**values, **there})
    return [np.take_along_axis(np.broadcast_to(weight, last.shape), last, axis=-1) for weight in found]


def _azimuth_at(gate: float, inclination: Array, azimuth: Array) -> Array:
    """Azimuth (..., n - 1) at which the arc between two stations first has an inclination, where it has it."""
    upper, lower = (_tangents(inclination[..., k], azimuth[..., k]) for k in (slice(-1), slice(1, None)))
    angle = np.arctan2(np.linalg.norm(np.cross(upper, lower), axis=-1), np.sum(upper * lower, axis=-1))
    sine = np.where(angle > 1e-9, np.sin(angle), 1.0)
    # along the arc u(d) = a cos d + q sin d, q across a: a_z cos d + q_z sin d = cos(gate)
    across = (lower - upper * np.cos(angle)[..., None]) / sine[..., None]
    size, phase = np.hypot(upper[..., 2], across[..., 2]), np.arctan2(across[..., 2], upper[..., 2])
    turn = np.arccos(np.clip(math.cos(gate) / np.maximum(size, 1e-12), -1.0, 1.0))
    roots = np.mod(np.stack([phase - turn, phase + turn]) + 1e-12, math.tau) - 1e-12
    along = np.clip(np.min(roots, axis=0), 0.0, angle)[..., None]
    found = upper * np.cos(along) + across * np.sin(along)
    return np.asarray(np.arctan2(found[..., 1], found[..., 0]))


def _tangents(inclination: Array, azimuth: Array) -> Array:
    sine = np.sin(inclination)
    return np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), np.cos(inclination)], axis=-1)
