"""Clearance between stations: holes that cross, meet and pass there, and what moves them; by hand and by sampling."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree
from straight_holes import straight_hole

from groundstation.survey.tools.instruments import PropagationMode, SurveyTool, Term, load_tool
from groundstation.survey.well.clearance import ClearanceHole, HolePair, Rule, clearance_between
from groundstation.survey.well.error_sources import Leg, Site, WellSurvey
from groundstation.survey.well.leg_errors import leg_errors
from groundstation.survey.well.methods import Method, station_positions

DEG = math.pi / 180.0
SITE = Site(9.80665, 50_000.0, 70.0 * DEG, 0.0, 60.0 * DEG)


@pytest.mark.parametrize("course", [30.0, 100.0])
@pytest.mark.parametrize("at", [0.31, 0.5])
def test_holes_that_cross_between_stations_are_not_clear(course: float, at: float) -> None:
    """The first falls straight; the second leans by 40 deg and meets it ``at`` a part of its fourth course."""
    md = course * np.arange(8)
    lean, azimuth, meets = 40.0 * DEG, 75.0 * DEG, (3.0 + at) * course
    axis = np.array([math.sin(lean) * math.cos(azimuth), math.sin(lean) * math.sin(azimuth), math.cos(lean)])
    one = np.array([0.0, 0.0, 1.0])
    holes = []
    for along, inclination, head in ((one, 0.0, np.zeros(3)), (axis, lean, 0.7 * meets * one - meets * axis)):
        places = head + md[:, None] * along
        survey = WellSurvey(md, np.full(8, inclination), np.full(8, azimuth), places[:, 2])
        holes.append(ClearanceHole(survey, places, (Leg(load_tool("relay")),), 0.05))
    found = clearance_between(holes[0], holes[1], SITE)
    assert not found.clear
    assert float(found.stations.least_factor.min()) > 1.0  # at the stations alone they look clear
    for place in (found.least, found.nearest):
        assert float(place.distance[0]) == pytest.approx(0.0, abs=1e-6)
        assert (float(place.md[0]), float(place.offset_md[0])) == pytest.approx((0.7 * meets, meets), abs=1e-6)


def walked(md: np.ndarray, inclination: np.ndarray, azimuth: np.ndarray, step: float) -> np.ndarray:
    """Points of a hole at most ``step`` apart, by adding up directions that turn evenly from station to station."""
    points = [np.zeros(3)]
    for k in range(len(md) - 1):
        t0, t1 = (
            np.array([math.sin(i) * math.cos(a), math.sin(i) * math.sin(a), math.cos(i)])
            for i, a in ((inclination[k], azimuth[k]), (inclination[k + 1], azimuth[k + 1]))
        )
        length = md[k + 1] - md[k]
        pieces = math.ceil(length / step)
        angle = math.acos(min(float(t0 @ t1), 1.0))
        f = (np.arange(pieces) + 0.5)[:, None] / pieces
        spread = (
            (np.sin((1 - f) * angle) * t0 + np.sin(f * angle) * t1) / math.sin(angle) if angle > 1e-7 else t0 + 0 * f
        )
        points.extend(points[-1] + np.cumsum(spread * length / pieces, axis=0))
    return np.array(points)


@settings(max_examples=25)
@given(st.integers(0, 10_000))
def test_the_least_distance_is_that_of_points_along_both_arcs(seed: int) -> None:
    rng, step = np.random.default_rng(seed), 0.05
    holes, points = [], []
    for head in (np.zeros(3), np.array([rng.uniform(-8, 8), rng.uniform(-8, 8), rng.uniform(-3, 3)])):
        md = np.concatenate([[0.0], np.cumsum(rng.uniform(2.0, 40.0, 4))])
        inclination, azimuth = rng.uniform(0.0, 1.6, 5), np.cumsum(rng.uniform(-0.8, 0.8, 5))
        places = head + station_positions(Method.MINIMUM_CURVATURE, md, inclination, azimuth)
        holes.append(
            ClearanceHole(WellSurvey(md, inclination, azimuth, places[:, 2]), places, (Leg(load_tool("relay")),), 0.1)
        )
        points.append(head + walked(md, inclination, azimuth, step))
    found = clearance_between(holes[0], holes[1], SITE)
    brute = float(cKDTree(points[1]).query(points[0])[0].min())
    nearest = float(found.nearest.distance[0])
    assert nearest <= brute + 1e-3
    assert brute <= nearest + step  # between two of its points the sampled path is half a step away at the most
    # nor is the factor anywhere lower than where it is told to be least
    dense = HolePair(holes[0], holes[1], SITE, Rule()).separations(np.linspace(0.0, 4.0, 4001))
    assert float(found.least.least_factor[0]) <= float(dense.least_factor.min()) + 1e-9


def test_holes_that_meet_err_across_both_of_them() -> None:
    """Both lean by 30 deg, to the north and to the east; an azimuth moves each level, across its own way.

    Where they meet nothing tells a direction but their common normal.
    """
    lean, meets = 30.0 * DEG, 50.0
    one, two = straight_hole(0.0, steep=lean), straight_hole(0.0, azimuth=0.5 * math.pi, steep=lean)
    ways = [np.array([0.5, 0.0, math.cos(lean)]), np.array([0.0, 0.5, math.cos(lean)])]
    two = replace(two, positions=two.positions + meets * (ways[0] - ways[1]))
    found = clearance_between(one, two, SITE).nearest
    assert float(found.distance[0]) < 1e-9
    normal = np.cross(*ways)
    normal /= np.linalg.norm(normal)
    moved = 1.0 * DEG * math.sin(lean) * (meets - 5.0)  # the first direction is known, half a leg of 10 m
    assert float(found.sigma[0]) == pytest.approx(moved * math.hypot(normal[0], normal[1]), rel=1e-3)


HAIR = 5e-4  # m, by which one pass is nearer than the other


def hairpin(asides: tuple[float, float], east_m: float, wide: float = 8.0) -> ClearanceHole:
    """A hole that falls past a level leg at one distance aside, and 8 m further east rises past it at another."""
    turn = np.linspace(0.0, math.pi, 25)
    down, up = np.arange(-20.0, 10.0, 0.5), np.arange(9.5, -20.0, -0.5)
    east = np.concatenate([np.zeros(len(down)), 0.5 * wide * (1.0 - np.cos(turn)), np.full(len(up), wide)])
    depth = np.concatenate([down, 10.0 + 0.5 * wide * np.sin(turn), up])
    places = np.stack([asides[0] + (asides[1] - asides[0]) * east / wide, east_m + east, depth], axis=1)
    ways = np.gradient(places, axis=0)
    ways /= np.linalg.norm(ways, axis=1)[:, None]
    lengths = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(places, axis=0), axis=1))])
    survey = WellSurvey(lengths, np.arccos(ways[:, 2]), np.arctan2(ways[:, 1], ways[:, 0]), depth)
    return ClearanceHole(survey, places, (Leg(load_tool("relay")),), 0.01)


def level_leg() -> ClearanceHole:
    """A leg of 100 m to the east."""
    survey = WellSurvey(np.array([0.0, 100.0]), np.full(2, 0.5 * math.pi), np.full(2, 0.5 * math.pi), np.zeros(2))
    return ClearanceHole(survey, np.array([[0.0, 0.0, 0.0], [0.0, 100.0, 0.0]]), (Leg(load_tool("relay")),), 0.01)


@pytest.mark.parametrize("nearer", [0, 1])
def test_the_nearer_of_two_passes_by_one_long_leg_is_found(nearer: int) -> None:
    """A hairpin crosses a level leg of 100 m twice, 8 m apart; samples an eighth of the leg apart see one pass."""
    found = clearance_between(level_leg(), hairpin((0.5, 0.8) if nearer == 0 else (0.8, 0.5), 45.5), SITE)
    assert float(found.nearest.distance[0]) == pytest.approx(0.5, abs=1e-3)
    assert float(found.nearest.md[0]) == pytest.approx((45.5, 53.5)[nearer], abs=0.05)


@pytest.mark.parametrize("nearer", [0, 1])
@pytest.mark.parametrize("east_m", [45.50, 45.53, 45.56, 45.59])
def test_of_two_passes_all_but_as_near_the_nearer_is_found(nearer: int, east_m: float) -> None:
    """Samples lie a tenth of a metre apart there, and the lowest of them may be beside the other pass."""
    asides = (0.5, 0.5 + HAIR) if nearer == 0 else (0.5 + HAIR, 0.5)
    found = clearance_between(level_leg(), hairpin(asides, east_m, 8.05), SITE)
    assert float(found.nearest.md[0]) == pytest.approx(east_m + 8.05 * nearer, abs=0.05)
    assert float(found.nearest.distance[0]) == pytest.approx(0.5, abs=1e-4)


@pytest.mark.parametrize("share", [0.2, 0.5, 0.8])
def test_what_errs_alike_along_a_bent_hole_bows_its_legs_as_it_turns_them(share: float) -> None:
    """An azimuth that is off all along turns the whole hole about the vertical, and so every point of its arcs.

    Against the line between the two ends of a leg, which the stations below the first tell.
    """
    tool = SurveyTool("t", "t", (Term("A", 1.0, "deg", PropagationMode.SYSTEMATIC, ("0", "0", "1")),))
    md, inclination = 10.0 * np.arange(6), 0.2 * np.arange(6)
    places = station_positions(Method.MINIMUM_CURVATURE, md, inclination, np.full(6, 0.7))
    survey = WellSurvey(md, inclination, np.full(6, 0.7), places[:, 2])
    hole = ClearanceHole(survey, places, (Leg(tool),), 0.1)
    pair, errors, legs = HolePair(hole, hole, SITE, Rule()), leg_errors(survey, hole.legs, SITE), np.arange(1, 5)
    ends = errors.effect(("A", PropagationMode.SYSTEMATIC), legs, np.zeros(4)) * (1.0 - share)
    ends += errors.effect(("A", PropagationMode.SYSTEMATIC), legs, np.ones(4)) * share
    bowed = errors.effect(("A", PropagationMode.SYSTEMATIC), legs, np.full(4, share)) - ends
    arc = pair.mine.places(legs, np.full(4, share)) - (1.0 - share) * places[1:-1] - share * places[2:]
    turned = 1.0 * DEG * np.cross([0.0, 0.0, 1.0], arc)
    np.testing.assert_allclose(bowed, turned, rtol=0.03, atol=1e-6)


def test_the_nearest_point_lies_between_stations() -> None:
    crossing = straight_hole(3.0, steep=math.pi / 2, length=100.0, azimuth=math.pi)  # horizontal, towards the south
    found = clearance_between(straight_hole(0.0), crossing, SITE)
    np.testing.assert_allclose(found.stations.distance, np.linspace(0.0, 100.0, 11), atol=1e-6)
    np.testing.assert_allclose(found.stations.offset_md, 3.0, atol=1e-6)
