"""Errors of a surveyed hole between its stations, along the arcs that join them.

A leg of length L from station k to the next begins in error by e_k and ends in error by e_k+1; its directions there err
by d_k and d_k+1 (rad). Curvature is even along an arc, so the direction errs evenly from the one to the other, and at
the fraction f of the leg the place errs by

    e(f) = (1 - f) e_k + f e_k+1 + f (1 - f) L / 2 (d_k - d_k+1)

What depth errs, or a position directly, is blended. The point is not measured itself: it errs by what its two stations
do. An error that does not change along the hole moves it as the straight blend does; errors of single stations
bow it. Frame: north, east, down; m and rad. Source: minimum curvature, linearised; stations as ``error_propagation``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from groundstation.errors import SurveyError
from groundstation.survey.tools.instruments import PropagationMode
from groundstation.survey.well.error_propagation import Propagation, Uncertainty
from groundstation.survey.well.error_sources import Leg, Site, SurveyGeometry, WellSurvey, sources_of
from groundstation.survey.well.gyro_modes import sections_of

Array = npt.NDArray[np.float64]
Indices = npt.NDArray[np.intp]
SourceKey = tuple[str, PropagationMode]
BEGIN, END, BOW = range(3)


@dataclass(frozen=True, slots=True)
class LegErrors:
    """Errors of a hole of n stations along its legs.

    Attributes
    ----------
    cov : (n - 1, 3, 3, 3, 3) m^2, of begin, end and bow of every leg with each other: (leg, which, which, axis, axis)
    constant : by source, (n - 1, 3, 3) m: what one standard deviation of an error that the whole hole has alike moves
        begin, end and bow of every leg by: (leg, which, axis)
    """

    cov: Array
    constant: dict[SourceKey, Array]

    def covariance(self, leg: Indices, fraction: Array) -> Array:
        """Covariance (k, 3, 3) at fractions (k,) of legs."""
        w = _weights(fraction)
        return np.asarray(np.einsum("ka,kb,kabij->kij", w, w, self.cov[leg]))

    def effect(self, source: SourceKey, leg: Indices, fraction: Array) -> Array:
        """Effect (k, 3) of one standard deviation of a constant source at fractions (k,) of legs."""
        return np.asarray(np.einsum("ka,kai->ki", _weights(fraction), self.constant[source][leg]))


def _weights(fraction: Array) -> Array:
    """Shares (k, 3) of begin, end and bow."""
    return np.stack([1.0 - fraction, fraction, fraction * (1.0 - fraction)], axis=-1)


def leg_errors(
    survey: WellSurvey, legs: tuple[Leg, ...], site: Site, *, slot_allowance: bool | None = None
) -> LegErrors:
    """Errors of one hole along its legs; its first station errs in nothing.

    Parameters
    ----------
    slot_allowance : whether the direction at the surface errs like that of the first station; as the tool has it
        where it is None

    Raises
    ------
    ToolError
        When a weight has no value at a station.
    """
    slot = legs[0].tool.slot_allowance if slot_allowance is None else slot_allowance
    work = Propagation(survey, legs, site, SurveyGeometry(survey, slot_allowance=slot), with_turns=True)
    assert work.turned is not None
    half = 0.5 * np.diff(survey.md)
    cov = np.zeros((len(half), 3, 3, 3, 3))
    constant: dict[SourceKey, Array] = {}
    for source in sources_of(legs):
        work.evaluate(source)
        if source.random:
            _add_random(cov, work, half, source.axes, slot=slot)
            continue
        masks: list[Array | float] = [1.0]
        if source.renewed:
            section = sections_of(source.rows[0][2], survey.inclination)
            masks = [np.asarray(section == k, float) for k in range(int(np.max(section)) + 1)]
        for mask, sums in zip(masks, work.sums(), strict=True):
            found = _parts(sums, work.turned * mask, half, source.axes, slot=slot)
            cov += np.einsum("sai,sbj->sabij", found, found)
        if not source.renewed:
            constant[source.name, source.rows[0][2].mode] = found
    return LegErrors(cov, constant)


def _parts(sums: Array, turned: Array, half: Array, axes: int, *, slot: bool) -> Array:
    """Begin, end and bow (n - 1, 3, 3) of an error that the stations have alike."""
    out = np.zeros((len(half), 3, 3))
    out[1:, BEGIN, :axes] = sums[:, :-1].T
    out[:, END, :axes] = sums.T
    above = np.concatenate([turned[:, :1] if slot else np.zeros((3, 1)), turned[:, :-1]], axis=1)
    out[:, BOW] = (half * (above - turned)).T
    return out


def _add_random(cov: Array, work: Propagation, half: Array, axes: int, *, slot: bool) -> None:
    """Add errors that every station has anew: those above both ends move both alike, the two ends' own bow the leg."""
    inner, last = np.zeros((2, len(half), 3))
    inner[:, :axes], last[:, :axes] = work.inner[:axes].T, work.last[:axes].T
    assert work.turned is not None
    turn = half[:, None] * work.turned.T
    squares = np.einsum("si,sj->sij", inner, inner)
    above = np.concatenate([np.zeros((1, 3, 3)), np.cumsum(squares, axis=0)[:-1]])  # through the station before the end
    cov[:, END, END] += above + np.einsum("si,sj->sij", last, last)
    below = np.einsum("si,sj->sij", last, turn)
    _add_pair(cov, END, BOW, -below)
    cov[:, BOW, BOW] += np.einsum("si,sj->sij", turn, turn)
    # what the station at the begin of a leg errs of its own; the first one errs in nothing
    own = np.einsum("si,sj->sij", last, last)[:-1]
    cov[1:, BEGIN, BEGIN] += above[:-1] + own
    _add_pair(cov[1:], BEGIN, END, above[:-1] + np.einsum("si,sj->sij", last[:-1], inner[:-1]))
    upper = half[1:, None] * work.turned.T[:-1]
    _add_pair(cov[1:], BEGIN, BOW, np.einsum("si,sj->sij", last[:-1], upper))
    _add_pair(cov[1:], END, BOW, np.einsum("si,sj->sij", inner[:-1], upper))
    cov[1:, BOW, BOW] += np.einsum("si,sj->sij", upper, upper)
    if slot:  # the direction at the surface errs as the first reading does: the first leg does not bow
        cov[0, BOW] = cov[0, :, BOW] = 0.0


def _add_pair(cov: Array, first: int, second: int, value: Array) -> None:
    """Add a product (s, 3, 3) of two parts, and its transpose where the two stand the other way round."""
    cov[:, first, second] += value
    cov[:, second, first] += np.swapaxes(value, -1, -2)


def covariance_at(found: Uncertainty, md: float) -> Array:
    """Covariance (3, 3) at any depth of one well, on the arc between the two stations around it.

    Raises
    ------
    SurveyError
        When ``md`` is outside the survey.
    """
    mds = found.survey.md
    if not mds[0] <= md <= mds[-1]:
        raise SurveyError(f"uncertainty: expected a depth of {mds[0]:g}..{mds[-1]:g} m, got {md:g} m")
    k = min(int(np.searchsorted(mds, md, side="right")) - 1, len(mds) - 2)
    f = float((md - mds[k]) / (mds[k + 1] - mds[k]))
    errors = leg_errors(found.survey, found.legs, found.site, slot_allowance=found.slot_allowance)
    inside = errors.covariance(np.array([k], np.intp), np.array([f]))[0]
    return np.asarray(inside + (1.0 - f) ** 2 * found.cov[0] if k == 0 else inside)
