"""Regions of uncertainty at stations and between them, and of many wells, against surveys that are drawn and moved."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from wells import (
    DEG,
    MWD,
    SITE,
    angle_term,
    hand_well,
    tool_of,
    well_of,
)

from groundstation.survey.tools.instruments import PropagationMode, Term, load_tool, shipped_tool_names
from groundstation.survey.well.error_propagation import propagate_errors
from groundstation.survey.well.error_sources import Leg, WellSurvey
from groundstation.survey.well.leg_errors import covariance_at
from groundstation.survey.well.methods import Method, station_positions


def moved_positions(
    survey: WellSurvey, depth: np.ndarray, inclination: np.ndarray, azimuth: np.ndarray, end: int
) -> np.ndarray:
    """Position of station ``end`` by balanced tangential where the readings from the second on are moved."""
    zero = np.zeros((len(depth), 1))
    md = (survey.md + np.hstack([zero, depth]))[:, : end + 1]
    i = (survey.inclination + np.hstack([zero, inclination]))[:, : end + 1]
    a = (survey.azimuth + np.hstack([zero, azimuth]))[:, : end + 1]
    return station_positions(Method.BALANCED_TANGENTIAL, md, i, a)[:, -1]


@pytest.mark.parametrize("end", [1, 4, 9])
def test_the_covariance_is_that_of_the_positions_of_drawn_surveys(end: int) -> None:
    draws = 2000
    rng = np.random.default_rng(15 + end)
    survey = well_of(16, 10, steepest=70.0 * DEG, first=10.0 * DEG)
    i, a, md = survey.inclination[1:], survey.azimuth[1:], survey.md[1:]
    tool = tool_of(
        Term("D-R", 0.05, "m", PropagationMode.RANDOM, ("1", "0", "0")),
        Term("D-S", 3e-4, "-", PropagationMode.SYSTEMATIC, ("MD", "0", "0")),
        angle_term("I-R", 1e-3, PropagationMode.RANDOM, "1"),
        angle_term("I-S", 1e-3, PropagationMode.SYSTEMATIC, "Sin(Inc)"),
        angle_term("A-R", 2e-3, PropagationMode.RANDOM, "0", "1"),
        angle_term("IA-W", 1e-3, PropagationMode.WELL, "Cos(AzT)", "-Sin(AzT)"),
        angle_term("A-G", 1e-3, PropagationMode.GLOBAL, "0", "1 / Sin(Inc)"),
    )
    each, one = (draws, 9), (draws, 1)
    common = 1e-3 * rng.standard_normal(one)
    depth = 0.05 * rng.standard_normal(each) + 3e-4 * rng.standard_normal(one) * md
    inclination = 1e-3 * rng.standard_normal(each) + 1e-3 * rng.standard_normal(one) * np.sin(i) + common * np.cos(a)
    azimuth = 2e-3 * rng.standard_normal(each) + 1e-3 * rng.standard_normal(one) / np.sin(i) - common * np.sin(a)
    sampled = np.cov(moved_positions(survey, depth, inclination, azimuth, end).T)
    cov = propagate_errors(survey, [Leg(tool)], SITE).cov[end]
    half = np.linalg.cholesky(cov)
    white = np.linalg.solve(half, np.linalg.solve(half, sampled).T)
    # entries of a sampled unit covariance scatter by sqrt(2 / draws) on the diagonal and sqrt(1 / draws) beside it
    np.testing.assert_allclose(white, np.eye(3), atol=4.5 * math.sqrt(2.0 / draws))


def test_the_covariance_at_a_station_is_the_stations() -> None:
    found = propagate_errors(well_of(17, 25), [Leg(MWD)], SITE, slot_allowance=True)
    for md, cov in zip(found.survey.md.tolist(), found.cov, strict=True):
        np.testing.assert_allclose(covariance_at(found, md), cov, rtol=1e-10, atol=1e-18)


@given(st.floats(0.0, 1.0), st.integers(0, 3))
def test_between_stations_the_covariance_is_one_and_goes_on(f: float, seed: int) -> None:
    found = propagate_errors(well_of(18 + seed, 12), [Leg(MWD)], SITE)
    end = float(found.survey.md[-1])
    cov = covariance_at(found, f * end)
    np.testing.assert_allclose(cov, cov.T, atol=1e-15)
    assert float(np.linalg.eigvalsh(cov)[0]) >= -1e-12 * float(np.trace(cov))
    step = 1e-7 * end
    near = covariance_at(found, min(f * end + step, end))
    # nothing grows by more than its own size within a metre
    assert float(np.max(np.abs(near - cov))) <= 3.0 * step * float(np.trace(found.cov[-1]))


def test_between_stations_the_covariance_is_that_of_the_arc() -> None:
    tool = tool_of(
        angle_term("R", 0.01, PropagationMode.RANDOM, "1"), angle_term("S", 0.02, PropagationMode.SYSTEMATIC, "1")
    )
    found = propagate_errors(hand_well(4), [Leg(tool)], SITE)
    # r_2 = 10 e_1 + 5 e_2; on from there the direction errs by e_2 (1 - s / 10) + e_3 s / 10, to s = 5 m in sum
    # 3.75 e_2 + 1.25 e_3
    random = 1e-4 * (10.0**2 + 8.75**2 + 1.25**2)
    systematic = 4e-4 * 20.0**2
    assert covariance_at(found, 25.0)[0, 0] == pytest.approx(random + systematic)


def on_arc(survey: WellSurvey, moves: np.ndarray, leg: int, f: float) -> np.ndarray:
    """Point at a part of a leg by minimum curvature of inclinations and azimuths (2, n) moved by ``moves``."""
    i, a = survey.inclination + moves[0], survey.azimuth + moves[1]
    t = np.stack([np.sin(i) * np.cos(a), np.sin(i) * np.sin(a), np.cos(i)], axis=-1)
    place = np.zeros(3)
    for k in range(leg + 1):
        angle = math.acos(min(float(t[k] @ t[k + 1]), 1.0))
        part, length = (f if k == leg else 1.0), float(survey.md[k + 1] - survey.md[k])
        if angle > 1e-9:  # integral of the evenly turning direction
            place = place + length / (angle * math.sin(angle)) * (
                (math.cos((1.0 - part) * angle) - math.cos(angle)) * t[k] + (1.0 - math.cos(part * angle)) * t[k + 1]
            )
        else:
            place = place + length * part * t[k]
    return place


@pytest.mark.parametrize("f", [0.1, 0.5, 0.8])
def test_between_stations_it_is_that_of_the_readings_moved_one_by_one(f: float) -> None:
    survey = well_of(21, 8, steepest=70.0 * DEG, first=20.0 * DEG)
    tool = tool_of(
        angle_term("I-R", 1e-3, PropagationMode.RANDOM, "1"),
        angle_term("A-R", 2e-3, PropagationMode.RANDOM, "0", "1"),
        angle_term("I-S", 1e-3, PropagationMode.SYSTEMATIC, "1"),
        angle_term("A-G", 1e-3, PropagationMode.GLOBAL, "0", "1"),
    )
    leg, n, h = 5, len(survey.md), 1e-5
    effects = np.zeros((2, n, 3))  # of inclination and azimuth of every station
    for kind in range(2):
        for k in range(1, leg + 2):
            move = np.zeros((2, n))
            move[kind, k] = h
            effects[kind, k] = (on_arc(survey, move, leg, f) - on_arc(survey, -move, leg, f)) / (2.0 * h)
    sizes = np.array([1e-3, 2e-3])[:, None, None]
    expected = np.einsum("kni,knj->ij", sizes * effects, sizes * effects)
    whole = 1e-3 * effects.sum(axis=1)
    expected += whole.T @ whole
    md = float(survey.md[leg] + f * (survey.md[leg + 1] - survey.md[leg]))
    found = covariance_at(propagate_errors(survey, [Leg(tool)], SITE), md)
    # the industry's errors of stations are those of straight halves, which differ by the square of the bend
    np.testing.assert_allclose(found, expected, rtol=0.03, atol=0.03 * float(np.trace(expected)) / 3.0)


def test_between_stations_of_several_legs_it_goes_on_too() -> None:
    survey = well_of(19, 12, steepest=29.0 * DEG)
    legs = [Leg(MWD), Leg(load_tool("rst-inclinometer"), 4), Leg(MWD, 8)]
    found = propagate_errors(survey, legs, SITE)
    for k, md in enumerate(survey.md.tolist()):
        np.testing.assert_allclose(covariance_at(found, md), found.cov[k], rtol=1e-9, atol=1e-18)
        for near in (md - 1e-7, md + 1e-7):
            if survey.md[0] <= near <= survey.md[-1]:
                np.testing.assert_allclose(covariance_at(found, near), found.cov[k], rtol=1e-5, atol=1e-9)


@pytest.mark.parametrize("name", shipped_tool_names())
def test_many_wells_at_once_give_what_each_gives(name: str) -> None:
    rng = np.random.default_rng(20)
    md = np.cumsum(rng.uniform(0.5, 30.0, (2, 3, 15)), axis=-1)
    inclination, azimuth = rng.uniform(0.0, 0.5, (2, 3, 15)), rng.uniform(0.0, math.tau, (2, 3, 15))
    inclination[0, :, :3] = 0.0
    yaw = rng.uniform(0.0, 0.01, (2, 3, 15))
    tvd = station_positions(Method.MINIMUM_CURVATURE, md, inclination, azimuth)[..., 2]
    legs = [Leg(load_tool(name)), Leg(load_tool(name), 6)]
    together = propagate_errors(WellSurvey(md, inclination, azimuth, tvd, {"SigmaYaw": yaw}), legs, SITE)
    sources = together.by_source()
    for at in np.ndindex(2, 3):
        survey = WellSurvey(md[at], inclination[at], azimuth[at], tvd[at], {"SigmaYaw": yaw[at]})
        alone = propagate_errors(survey, legs, SITE)
        np.testing.assert_allclose(together.cov[at], alone.cov, rtol=1e-10, atol=1e-15)
        for source, cov in alone.by_source().items():
            np.testing.assert_allclose(sources[source][at], cov, rtol=1e-10, atol=1e-15)


@pytest.mark.parametrize("mode", [PropagationMode.RANDOM, PropagationMode.SYSTEMATIC])
@pytest.mark.parametrize("f", [0.2, 0.5, 0.9])
def test_where_the_surface_errs_as_the_first_reading_the_first_leg_does_not_bow(
    mode: PropagationMode, f: float
) -> None:
    """Both ends of the leg turn alike, so it moves as a stick does; without that allowance it bows."""
    tool = tool_of(angle_term("E", 0.01, mode, "1"))
    survey = hand_well(4)
    stick, bowed = (propagate_errors(survey, [Leg(tool)], SITE, slot_allowance=slot) for slot in (True, False))
    md = f * float(survey.md[1])
    np.testing.assert_allclose(covariance_at(stick, md), f**2 * stick.cov[1], rtol=1e-9, atol=1e-18)
    # by minimum curvature the direction errs by e s / L, so the place by e s^2 / 2 L and the station by e L / 2
    np.testing.assert_allclose(covariance_at(bowed, md), f**4 * bowed.cov[1], rtol=1e-9, atol=1e-18)
