"""A collar that was told wrong: its score by another way, its name, and holes that are left in peace."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from blame_table import examined
from drawn_strings import DEG, DrawnString, draw_string
from drawn_worlds import Case, draw_worlds

from groundstation.survey.adjustment.adjust import adjust_hole
from groundstation.survey.adjustment.blunder_kind import BlunderKind
from groundstation.survey.adjustment.blunder_words import say_blunder
from groundstation.survey.adjustment.collar import collar_departure
from groundstation.survey.adjustment.looks import PathPrior

NAMES = [str(tube + 1) for tube in range(10)]


def told_off(drawn: DrawnString, north_deg: float) -> PathPrior:
    """The path with its collar told to lean so much more to the north."""
    north, east, down = drawn.path.collar
    turn = north_deg * DEG
    told = np.array([np.cos(turn) * north + np.sin(turn) * down, east, np.cos(turn) * down - np.sin(turn) * north])
    return replace(drawn.path, collar=told)


@pytest.mark.parametrize("off_deg", [0.0, 0.3, 1.0])
def test_the_score_is_that_of_what_the_stations_say_without_it(off_deg: float) -> None:
    drawn = draw_string(7)
    path = told_off(drawn, off_deg)
    departure = collar_departure(adjust_hole(drawn.looks, drawn.string, path))
    free = replace(path, collar_cov=path.collar_cov + 100.0 * (np.eye(3) - np.outer(path.collar, path.collar)))
    found = adjust_hole(drawn.looks, drawn.string, free)
    bases = found.bases[0]
    off = bases @ (path.collar - found.now.tangents[0])
    cov = found.covs[0, :2, :2] + bases @ path.collar_cov @ bases.T
    assert departure.told == 2
    # the two have learnt how much the hole bends from legs that differ by the first
    assert departure.squares == pytest.approx(off @ np.linalg.solve(cov, off), rel=0.1, abs=0.05)


def test_a_collar_that_was_told_wrong_is_named_and_counts_no_more() -> None:
    drawn = draw_string(11)
    curved = drawn.path.curvature_std * drawn.path.md[1]
    off_deg = 12.0 * float(np.hypot(curved, np.sqrt(np.trace(drawn.path.collar_cov) / 2.0))) / DEG
    found = examined(replace(drawn, path=told_off(drawn, off_deg)))
    assert [one.best.hypothesis.kind for one in found.blunders] == [BlunderKind.COLLAR_WRONG]
    assert "collar" in say_blunder(found.blunders[0], drawn.run, NAMES)
    size = np.linalg.norm(found.blunders[0].best.size) / DEG
    assert size == pytest.approx(off_deg, rel=0.3)


def two_looks(drawn: DrawnString) -> DrawnString:
    """Only what two tubes saw at two stations and one stop: no look contradicts another."""
    looks, md = drawn.looks.part(np.flatnonzero(drawn.looks.stop == 1)), drawn.path.md[:3]
    return replace(drawn, looks=looks, path=replace(drawn.path, md=md), run=replace(drawn.run, station_md=md))


@pytest.mark.parametrize("seed", range(6))
def test_two_looks_that_leave_nothing_contradict_a_collar(seed: int) -> None:
    """As seed 700362 of the gauntlet: a mount half a degree askew passed for a collar that was six degrees off."""
    drawn = two_looks(draw_string(seed, tilt_deg=0.5))
    found = examined(replace(drawn, path=told_off(drawn, 6.0)))
    named = [one.best.hypothesis.kind for one in (*found.blunders, found.suspicion) if one is not None]
    assert named == [BlunderKind.COLLAR_WRONG]
    adjusted = found.adjusted
    for place in (1, 2):
        off = adjusted.bases[place] @ drawn.tangents[place]
        moved = found.suspected[place]
        assert off @ np.linalg.solve(adjusted.covs[place, :2, :2] + np.outer(moved, moved), off) < 18.4  # 1 in 1e4


@pytest.mark.parametrize("seed", range(6))
def test_two_honest_looks_leave_the_collar_in_peace(seed: int) -> None:
    found = examined(two_looks(draw_string(seed, tilt_deg=0.5)))
    assert (found.blunders, found.suspicion) == ((), None)


@pytest.mark.parametrize("size_deg", [0.15, 0.6])
def test_a_ground_that_bends_holes_four_times_as_sharply_is_no_collar_told_wrong(size_deg: float) -> None:
    """The legs below the first tell how sharply: not one of sixty is believed at one in a thousand."""
    case = Case(seed=31, worlds=60, tubes=4, stations=6, make_ups=4, tilt=0.2, collar=0.15, curvature=size_deg)
    worlds = draw_worlds(case)
    path = replace(worlds.path, curvature_std=0.15 * DEG)
    found = [collar_departure(adjust_hole(worlds.looks(w), worlds.string, path)) for w in range(case.worlds)]
    chances = np.array([one.log_chance() for one in found])
    assert np.mean(chances < math.log(1e-4)) <= 1.0 / case.worlds
    assert np.mean(chances < math.log(0.05)) < 0.5


def test_honest_collars_are_left_in_peace() -> None:
    found = [one.best.hypothesis.kind for seed in range(20, 40) for one in examined(draw_string(seed)).blunders]
    assert BlunderKind.COLLAR_WRONG not in found
