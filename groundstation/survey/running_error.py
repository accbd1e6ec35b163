"""Region of uncertainty of a survey that grows: one station appended at the same cost however many there are.

The same sums as in ``error_model``, kept (``running_sums``). When a station is appended, the one before gains its
second leg.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from groundstation.errors import SurveyError, ToolError
from groundstation.survey.error_model import check_inclination
from groundstation.survey.error_sources import (
    NO_WEIGHT,
    RECORD,
    SECONDS_A_METRE,
    TINY,
    VERTICAL,
    Site,
    compiled,
    inputs_of,
)
from groundstation.survey.formulas import SCALAR, VARIABLES
from groundstation.survey.instruments import Mode, Tool
from groundstation.survey.running_sums import RunningSums

Array = npt.NDArray[np.float64]
STATION_VARIABLES = (
    "MD", "MDPrev", "TVD", "Inc", "IncPrev", "Az", "AzPrev", "AzT", "AzTPrev", "AzM", "AzMPrev", "Time", "TimePrev",
    *RECORD,
)  # fmt: skip
PLACES = [VARIABLES.index(name) for name in STATION_VARIABLES]


class RunningUncertainty:
    """Covariance of the last position of one well, surveyed with one tool.

    Parameters
    ----------
    tool, site : instrument and place
    md, inclination, azimuth : first station, m and rad; its direction is known, its depth is read
    slot_allowance : as in ``error_model.Geometry``
    time : of the first station, s; by default as a survey without times has it
    """

    def __init__(
        self,
        tool: Tool,
        site: Site,
        md: float,
        inclination: float,
        azimuth: float,
        *,
        slot_allowance: bool = False,
        time: float | None = None,
    ) -> None:
        modes = [term.name for term in tool.terms if term.by_mode]
        if modes:
            raise ToolError(f"{tool.name}: term {modes[0]} depends on the stations before; expected a whole survey")
        # constant sources first, so that both kinds are slices
        terms = sorted(tool.terms, key=lambda term: term.mode is Mode.RANDOM)
        self._tool = tool.with_terms(tuple(terms))
        self._site = site
        self._constant = sum(term.mode is not Mode.RANDOM for term in terms)
        self._function = compiled(tuple(term.formulas for term in terms), tuple(tool.parameters))
        self._inputs = inputs_of(self._tool, site, dict.fromkeys(STATION_VARIABLES, 0.0))
        self._sigma = np.array([[term.sigma] for term in terms])
        self._singular = np.array([term.singular is not None for term in terms])
        self._allowance = slot_allowance
        self._place = (md, inclination, azimuth)
        self._tangent = _tangent(inclination, azimuth)
        self._time = SECONDS_A_METRE * md if time is None else time
        self._half = 0.0  # of the last leg, as it counts for the last station
        self._last: tuple[Array, Array, Array, Array] | None = None  # of the last station, see _evaluate
        self._sums = RunningSums()

    def append(
        self,
        md: float,
        inclination: float,
        azimuth: float,
        tvd: float,
        record: Mapping[str, float] | None = None,
    ) -> Array:
        """Covariance (3, 3, m^2) of the new last position.

        Raises
        ------
        SurveyError, ToolError
            When the depth does not grow, or a weight has no value here; nothing was appended.
        """
        before_md, before_inclination, before_azimuth = self._place
        length = md - before_md
        if not 0.0 < length < math.inf:
            raise SurveyError(f"uncertainty: expected a depth beyond {before_md:g} m, got {md:g} m")
        check_direction(self._tool, md, inclination, azimuth, tvd)
        record = record or {}
        tangent = _tangent(inclination, azimuth)
        along = 0.5 * (self._tangent + tangent)
        time = record.get("Time", SECONDS_A_METRE * md)
        inc, before_inc = max(inclination, TINY), max(before_inclination, TINY)
        magnetic, before_magnetic = azimuth - self._site.declination, before_azimuth - self._site.declination
        # in the order of STATION_VARIABLES
        station = (
            md, before_md, tvd, inc, before_inc, azimuth, before_azimuth, azimuth, before_azimuth, magnetic,
            before_magnetic, time, self._time, *(record.get(name, default) for name, default in RECORD.items()),
        )  # fmt: skip
        for place, value in zip(PLACES, station, strict=True):
            self._inputs[place] = value
        depth, turn, shift = self._evaluate(md, inc, azimuth)
        half = 0.5 * length
        first = self._last is None
        if self._last is not None:
            old_depth, old_turn, old_shift, old_along = self._last
            effect = (self._half + half) * old_turn + old_depth * (old_along - along) + old_shift
            self._sums.pass_station(*self._parted(effect))
        own = length if first and self._allowance else half
        star = own * turn + depth * along + shift
        self._last, self._half = (depth, turn, shift, along), own
        self._place, self._tangent, self._time = (md, inclination, azimuth), tangent, time
        return self._sums.at_end(*self._parted(star))[0]

    def _parted(self, effect: Array) -> tuple[Array, Array]:
        """Effects (3, s) of the constant sources and covariance (3, 3) of the random ones, of effects (t, 3)."""
        random = effect[self._constant :]
        return effect[: self._constant].T, random.T @ random

    def _lost(self, weights: Array, inclination: float) -> bool:
        """Whether a weight that counts here has no value; where the hole is vertical singular ones may stand for it."""
        weights = weights.copy()
        if min(inclination, math.pi - inclination) < VERTICAL:
            weights[self._singular, :3] = 0.0
        else:
            weights[:, 3:6] = 0.0
        return not bool(np.all(np.abs(weights) < NO_WEIGHT))

    def _evaluate(self, md: float, inclination: float, azimuth: float) -> tuple[Array, Array, Array]:
        """Effect of every source on depth (t, 1), on the tangent (t, 3) and on the position itself (t, 3)."""
        try:
            flat = self._function(SCALAR, self._inputs)
        except (ArithmeticError, ValueError, TypeError) as error:
            raise ToolError(f"{self._tool.name}: a weight has no value at {md:g} m: {error}") from error
        weights = self._sigma * np.array(flat).reshape(-1, 9)
        sine, cosine = math.sin(inclination), math.cos(inclination)
        c, s = math.cos(azimuth), math.sin(azimuth)
        with np.errstate(invalid="ignore"):  # an infinite weight is refused below; some processors warn of it here
            turn = weights[:, 1:3] @ np.array([[cosine * c, cosine * s, -sine], [-sine * s, sine * c, 0.0]])
        if min(inclination, math.pi - inclination) < VERTICAL:
            turn[self._singular] = weights[self._singular, 3:6]
        if not float(np.abs(weights).max(initial=0.0)) < NO_WEIGHT and self._lost(weights, inclination):
            raise ToolError(f"{self._tool.name}: a weight has no value at {md:g} m; give singular weights")
        return weights[:, :1], turn, weights[:, 6:]


def check_direction(tool: Tool, md: float, inclination: float, azimuth: float, tvd: float) -> None:
    """Refuse an invalid station, or one that the tool is not made for.

    Raises
    ------
    SurveyError, ToolError
        Names the depth, what was expected and what came.
    """
    if not (math.isfinite(azimuth) and math.isfinite(tvd) and 0.0 <= inclination <= math.pi):
        got = f"{math.degrees(inclination):g} deg, {azimuth:g} rad and {tvd:g} m"
        raise SurveyError(
            f"uncertainty: at {md:g} m: expected an inclination of 0..180 deg, azimuth and TVD, got {got}"
        )
    check_inclination(tool, inclination, inclination)


def _tangent(inclination: float, azimuth: float) -> Array:
    sine = math.sin(inclination)
    return np.array([sine * math.cos(azimuth), sine * math.sin(azimuth), math.cos(inclination)])
