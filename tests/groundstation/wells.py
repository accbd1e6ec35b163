"""Wells and tools that the tests of the error model share."""

import math
import warnings
from typing import Any

import numpy as np

from groundstation.survey.tools.instruments import PropagationMode, SurveyTool, Term, load_tool
from groundstation.survey.well.error_sources import Site, WellSurvey
from groundstation.survey.well.methods import Method, station_positions

DEG = math.pi / 180.0
SITE = Site(9.80665, 50_000.0, 72.0 * DEG, 3.0 * DEG, 60.0 * DEG)
WELLS = 200  # against the independent library
MWD = load_tool("mwd-rev5.1")
Angles = tuple[np.ndarray, np.ndarray, np.ndarray]


def import_welleng() -> Any:
    """The library ``welleng``; it takes half a second, which only the tests pay that compare with it."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import welleng.survey
    return welleng


def tool_of(*terms: Term, **more: object) -> SurveyTool:
    return SurveyTool("mine", "My tool", terms, **more)  # type: ignore[arg-type]


def angle_term(name: str, sigma: float, mode: PropagationMode, inclination: str = "0", azimuth: str = "0") -> Term:
    return Term(name, sigma, "rad", mode, ("0", inclination, azimuth))


def survey_of(md: np.ndarray, inclination: np.ndarray, azimuth: np.ndarray) -> WellSurvey:
    return WellSurvey(
        md, inclination, azimuth, station_positions(Method.MINIMUM_CURVATURE, md, inclination, azimuth)[..., 2]
    )


def well_of(seed: int, count: int, steepest: float = 80.0 * DEG, first: float = 0.0) -> WellSurvey:
    rng = np.random.default_rng(seed)
    md = np.concatenate([[0.0], np.cumsum(rng.uniform(1.0, 30.0, count - 1))])
    inclination = np.linspace(first, steepest, count)
    azimuth = np.cumsum(rng.normal(0.0, 0.1, count)) + rng.uniform(0.0, math.tau)
    return survey_of(md, inclination, azimuth)


def random_well(rng: np.random.Generator) -> Angles:
    """From vertical to horizontal with 3 to 500 stations, degrees.

    Where the first stations are exactly vertical their azimuth is 0: the library's slot allowance doubles one component
    of a singular weight alone.
    """
    count = int(np.exp(rng.uniform(math.log(3), math.log(501))))
    md = np.concatenate([[0.0], np.cumsum(rng.uniform(0.2, 30.0, count - 1))])
    steepest = rng.uniform(0.0, 95.0)
    inclination = np.clip(np.linspace(0.0, steepest, count) + rng.normal(0.0, 0.3, count), 0.0, 95.0)
    azimuth = np.mod(rng.uniform(0.0, 360.0) + np.cumsum(rng.normal(0.0, 3.0, count)), 360.0)
    kind = rng.integers(3)
    if kind == 0:
        inclination[: max(1, count // 4)] = 0.0
    if kind == 1:
        inclination[:] = np.maximum(inclination, 0.01)
    azimuth[:2] *= inclination[:2] > 0.0
    return md, inclination, azimuth


def largest_difference(cov: np.ndarray, expected: np.ndarray) -> float:
    """Of the stations from the second on, against the trace of what is expected."""
    scale = np.trace(expected, axis1=-2, axis2=-1)[..., 1:, None, None]
    return float(np.max(np.abs(cov - expected)[..., 1:, :, :] / np.where(scale > 0.0, scale, 1.0)))


def hand_well(count: int = 3) -> WellSurvey:
    """Vertical, stations every 10 m; an inclination error of sigma moves the second station 5 sigma north."""
    md = 10.0 * np.arange(count)
    return WellSurvey(md, np.zeros(count), np.zeros(count), md)
