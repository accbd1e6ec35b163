"""Region of uncertainty of a survey: every error source propagated along the hole.

A source with one standard deviation sigma_i acts on station k through its weights dp_k/deps_i in depth, inclination and
azimuth, and these on the two legs that meet there (balanced tangential Jacobians):

    e_ik  = sigma_i (d dr_k/dp_k + d dr_k+1/dp_k) dp_k/deps_i        e*_iK = sigma_i (d dr_K/dp_K) dp_K/deps_i
    random:            C_K = sum_{k<K} e_k e_k^T + e*_K e*_K^T
    systematic in a section of a gyro survey, in a leg of the survey, in the well, in all wells:
                       C_K = (sum_{k<K} e_k + e*_K) (sum_{k<K} e_k + e*_K)^T      over the stations it is shared by

A leg here is a part of the hole that one tool surveyed. Arrays are (..., n): leading axes are wells. Frame: north,
east, down. Source: thesis 2.3 and eqs. I.1-I.12; Definition of the ISCWSA error model, revision 5.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from groundstation.errors import SurveyError, ToolError
from groundstation.survey.tools.formulas import ARRAY, is_zero
from groundstation.survey.tools.instruments import PropagationMode, SurveyTool, Term
from groundstation.survey.well.error_sources import (
    NO_WEIGHT,
    ErrorSource,
    Leg,
    Site,
    SurveyGeometry,
    WellSurvey,
    compile_term_formulas,
    inputs_of,
    merged_sources,
    sources_of,
    station_values,
)
from groundstation.survey.well.gyro_modes import mode_weights, sections_of

Array = npt.NDArray[np.float64]


class Propagation:
    """Effects of sources on the positions of one survey, one source at a time in the same few arrays.

    ``inner`` (3, ..., n - 1) is e_k and ``last`` e*_k of the source asked for last, m, of the stations from the second;
    of a source that acts on two axes the first two rows alone are written. ``turned`` is by how much their downhole
    unit vectors err, rad, where that is asked for.
    """

    def __init__(
        self,
        survey: WellSurvey,
        legs: Sequence[Leg],
        site: Site,
        geometry: SurveyGeometry,
        *,
        with_turns: bool = False,
    ) -> None:
        self._geometry = g = geometry
        self._legs = legs
        self._inclination = survey.inclination
        values = station_values(survey, site)
        self._weights = []
        for leg in legs:
            function = compile_term_formulas(
                tuple(term.formulas for term in leg.tool.terms), tuple(leg.tool.parameters)
            )
            with np.errstate(all="ignore"):
                weights = function(ARRAY, inputs_of(leg.tool, site, values))
            for t, found in mode_weights(leg, survey, site).items():
                weights[9 * t : 9 * t + len(found)] = found
            self._weights.append(weights)
        self.inner = np.empty((3, *g.upper.shape))
        self.last = np.empty((3, *g.upper.shape))
        self.turned = np.zeros((3, *g.upper.shape)) if with_turns else None
        self._work = np.empty(g.upper.shape)

    def evaluate(self, source: ErrorSource) -> None:
        """Write the effects of a source.

        Raises
        ------
        ToolError
            When a weight has no value at a station: the formula divides by zero there and no singular one is given.
        """
        self._axes, self._source = source.axes, source
        if len(self._legs) == 1:
            self._row(*source.rows[0])
            return
        inner, last = np.zeros_like(self.inner), np.zeros_like(self.last)
        turned = None if self.turned is None else np.zeros_like(self.turned)
        for row in source.rows:
            self._row(*row)
            begin = self._legs[row[0]].first - 1
            end = self._legs[row[0] + 1].first - 1 if row[0] + 1 < len(self._legs) else None
            inner[..., begin:end] += self.inner[..., begin:end]
            last[..., begin:end] += self.last[..., begin:end]
            if turned is not None and self.turned is not None:
                turned[..., begin:end] += self.turned[..., begin:end]
        self.inner[...], self.last[...] = inner, last
        if turned is not None and self.turned is not None:
            self.turned[...] = turned

    def sums(self) -> Iterator[Array]:
        """Effects (axes, ..., n - 1) on every position of the source, if it stays the same: one for every section.

        ``inner`` and ``last`` are used up.
        """
        inner, last = self.inner[: self._axes], self.last[: self._axes]
        if self._source.renewed:
            section = sections_of(self._source.rows[0][2], self._inclination)
            for number in range(int(np.max(section)) + 1):
                yield _summed(inner * (section == number), last * (section == number))
        else:
            yield _summed(inner, last)

    def _row(self, number: int, t: int, term: Term) -> None:
        g, flat = self._geometry, self._weights[number][9 * t : 9 * t + 9]
        inner, last = self.inner[: self._axes], self.last[: self._axes]
        sigma = term.sigma
        if is_zero(term.weights[1]) and is_zero(term.weights[2]):
            last[...] = 0.0
        else:
            self._turn(term, flat[1] * sigma, flat[2] * sigma, flat[3:6])
        if self.turned is not None:
            self.turned[...] = 0.0
            self.turned[: self._axes] = last
        np.multiply(last, g.both, out=inner)
        last *= g.upper
        if not is_zero(term.weights[0]):
            depth = flat[0] * sigma
            shift = depth * g.by_depth
            last += shift
            inner += shift
            inner[..., :-1] -= np.broadcast_to(depth, self._work.shape)[..., :-1] * g.by_depth[..., 1:]
        if term.position is not None:
            for c in range(3):
                np.multiply(flat[6 + c], sigma, out=self._work)
                last[c] += self._work
                inner[c] += self._work
        if not abs(float(last.sum())) < NO_WEIGHT or (g.any_vertical and self._lost(term, flat)):
            tool = self._legs[number].tool.name
            raise ToolError(f"{tool}: term {term.name}: its weight has no value at a station; give singular weights")

    def _lost(self, term: Term, flat: list[Any]) -> bool:
        """Whether a weight has no value where the hole is vertical, without a singular form in its place."""
        if term.singular is not None:
            return False
        vertical = self._geometry.vertical
        return any(not np.all(np.abs(np.where(vertical, weight, 0.0)) < NO_WEIGHT) for weight in flat[:3])

    def _turn(self, term: Term, inclination: Any, azimuth: Any, singular: list[Any]) -> None:
        """Change of the tangent, into ``last``."""
        g, out = self._geometry, self.last
        if self._axes == 2:
            np.multiply(g.by_azimuth, azimuth, out=out[:2])
        else:
            np.multiply(g.by_inclination, inclination, out=out)
            if not is_zero(term.weights[2]):
                for c in range(2):
                    np.multiply(g.by_azimuth[c], azimuth, out=self._work)
                    out[c] += self._work
        if g.any_vertical and term.singular is not None:
            for c, weight in enumerate(singular[: self._axes]):
                out[c] = np.where(g.vertical, weight * term.sigma, out[c])


def _summed(inner: Array, last: Array) -> Array:
    """Effect of a constant error: of all earlier stations with both legs, and of the last; overwrites both arrays."""
    np.cumsum(inner, axis=-1, out=inner)
    last[..., 1:] += inner[..., :-1]
    return last


PAIRS = ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2))  # the first three are those of the plane


class CovarianceSums:
    """Running sums of the products of effects: the upper halves of (..., n - 1, 3, 3), one array a pair of axes."""

    def __init__(self, shape: tuple[int, ...]) -> None:
        self._own = np.zeros((6, *shape))  # constant sources, and the last station of random ones
        self._before = np.zeros((6, *shape))  # random ones of the stations that have both legs
        self._work = np.empty(shape)

    def add_source(self, work: Propagation, source: ErrorSource) -> None:
        """Evaluate a source and add it."""
        work.evaluate(source)
        if source.random:
            self._add(self._before, work.inner[: source.axes])
            self._add(self._own, work.last[: source.axes])
        else:
            for effect in work.sums():
                self._add(self._own, effect)

    def add_to(self, out: Array) -> None:
        """Add the covariance of all that was taken to ``out`` (..., n, 3, 3)."""
        before = np.cumsum(self._before, axis=-1)
        for k, (a, b) in enumerate(PAIRS):
            total = self._own[k]
            total[..., 1:] += before[k][..., :-1]
            out[..., 1:, a, b] += total
            if a != b:
                out[..., 1:, b, a] += total

    def _add(self, parts: Array, effect: Array) -> None:
        """Add v v^T of an effect (2 or 3, ..., n - 1)."""
        for part, (a, b) in zip(parts, PAIRS if len(effect) == 3 else PAIRS[:3], strict=False):
            np.multiply(effect[a], effect[b], out=self._work)
            np.add(part, self._work, out=part)


@dataclass(frozen=True, slots=True)
class Uncertainty:
    """Covariance of every position and what it is made of."""

    survey: WellSurvey
    legs: tuple[Leg, ...]
    site: Site
    slot_allowance: bool
    cov: Array  # (..., n, 3, 3) m^2
    quick_parts: Callable[[Uncertainty], dict[str, Array]] | None = None  # a faster way to ``by_source``

    def by_source(self) -> dict[str, Array]:
        """Covariance (..., n, 3, 3) by the name of its source; from the second station on they add up to ``cov``."""
        if self.quick_parts is not None:
            return self.quick_parts(self)
        work = self._propagation()
        found: dict[str, Array] = {}
        for source in sources_of(self.legs):
            out = found.setdefault(source.name, np.zeros_like(self.cov))
            sums = CovarianceSums(work.last.shape[1:])
            sums.add_source(work, source)
            sums.add_to(out)
        return found

    def _propagation(self) -> Propagation:
        geometry = SurveyGeometry(self.survey, slot_allowance=self.slot_allowance)
        return Propagation(self.survey, self.legs, self.site, geometry)


def propagate_errors(
    survey: WellSurvey, legs: Sequence[Leg], site: Site, *, slot_allowance: bool = False
) -> Uncertainty:
    """Covariance of the positions of a survey, or of many with as many stations.

    Raises
    ------
    SurveyError, ToolError
        When legs and survey do not fit, or a tool is used outside the inclinations it is made for.
    """
    check_legs(survey, legs)
    g = SurveyGeometry(survey, slot_allowance=slot_allowance)
    work = Propagation(survey, legs, site, g)
    sums = CovarianceSums(g.upper.shape)
    with np.errstate(invalid="ignore", over="ignore"):  # what has no value is refused by what comes of it
        for source in merged_sources(tuple(legs)):
            sums.add_source(work, source)
    cov = np.zeros((*survey.md.shape, 3, 3))
    sums.add_to(cov)
    cov[..., 0, :, :] = surface_covariance(survey.md, survey.inclination, survey.azimuth, legs[0].tool)
    return Uncertainty(survey, tuple(legs), site, slot_allowance, cov)


def check_legs(survey: WellSurvey, legs: Sequence[Leg]) -> None:
    """Refuse legs that do not fit the survey.

    Raises
    ------
    SurveyError, ToolError
        Names the stations, or the tool and the inclination that it is not made for.
    """
    firsts = [leg.first for leg in legs]
    if not legs or firsts[0] != 1 or sorted(set(firsts)) != firsts or firsts[-1] >= survey.md.shape[-1]:
        raise SurveyError(f"legs: expected to begin at station 1 and at growing stations of the survey, got {firsts}")
    for leg, end in zip(legs, [*firsts[1:], survey.md.shape[-1]], strict=True):
        inclination = survey.inclination[..., leg.first : end]
        check_inclination(leg.tool, float(inclination.min()), float(inclination.max()))


def check_inclination(tool: SurveyTool, least: float, most: float) -> None:
    """Refuse inclinations (rad) that a tool is not made for.

    Raises
    ------
    ToolError
        Names the tool, its range and the inclination.
    """
    low, high = tool.inclination_range
    if least < low - 1e-9 or most > high + 1e-9:
        found = math.degrees(least if least < low - 1e-9 else most)
        raise ToolError(
            f"{tool.name}: made for inclinations of {math.degrees(low):g}..{math.degrees(high):g} deg, "
            f"the survey has {found:.4g} deg; choose another instrument"
        )


def surface_covariance(md: Array, inclination: Array, azimuth: Array, tool: SurveyTool) -> Array:
    """Covariance (..., 3, 3) of the first station of (..., n): its own depth reading, if it is at the datum."""
    variance = depth_variance(tool) * (md[..., 0] == 0.0)
    sine, cosine = np.sin(inclination[..., 0]), np.cos(inclination[..., 0])
    along = np.stack([sine * np.cos(azimuth[..., 0]), sine * np.sin(azimuth[..., 0]), cosine], axis=-1)
    return np.asarray(variance[..., None, None] * along[..., :, None] * along[..., None, :])


def depth_variance(tool: SurveyTool) -> float:
    """Variance (m^2) of one reading of the depth by a tool."""
    return sum(term.sigma**2 for term in tool.terms if term.mode is PropagationMode.RANDOM and term.weights[0] == "1")
