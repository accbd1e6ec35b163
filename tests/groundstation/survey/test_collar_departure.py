"""A collar that was told wrong: its score by another way, its name, and holes that are left in peace."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from blame_table import examined
from drawn_strings import DEG, DrawnString, draw_string

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


def test_honest_collars_are_left_in_peace() -> None:
    found = [one.best.hypothesis.kind for seed in range(20, 40) for one in examined(draw_string(seed)).blunders]
    assert BlunderKind.COLLAR_WRONG not in found
