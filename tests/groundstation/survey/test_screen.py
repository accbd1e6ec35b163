"""The quick look at a small hole asks what the full scores answer: the same squares, and the least of their chances."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
import pytest
from drawn_strings import DrawnString, draw_string

from groundstation.survey.adjustment.adjust import adjust_hole
from groundstation.survey.adjustment.adjusted import Adjusted
from groundstation.survey.adjustment.blunder_kind import BlunderKind
from groundstation.survey.adjustment.collar import collar_departure
from groundstation.survey.adjustment.hypotheses import Hypothesis
from groundstation.survey.adjustment.run_of_stops import JOINT
from groundstation.survey.adjustment.scores import best_sizes, free_information, log_chances, score_hypotheses
from groundstation.survey.adjustment.screen import against_prior, least_chance, whole_tests

Array = npt.NDArray[np.float64]
K = BlunderKind


@pytest.fixture(scope="module")
def honest() -> DrawnString:
    return draw_string(7)


@pytest.fixture(scope="module")
def found(honest: DrawnString) -> Adjusted:
    return adjust_hole(honest.looks, honest.string, honest.path)


def scored(found: Adjusted, honest: DrawnString, hypotheses: list[Hypothesis]) -> tuple[list[float], list[int]]:
    score = score_hypotheses(found, honest.run, hypotheses)[0]
    assert list(score.hypotheses) == hypotheses
    return score.squares.tolist(), score.told.tolist()


def assert_same(screened: tuple[Array, npt.NDArray[np.intp]], expected: tuple[list[float], list[int]]) -> None:
    assert screened[0] == pytest.approx(np.array(expected[0]), rel=1e-6, abs=1e-6)
    assert screened[1].tolist() == expected[1]


def test_looks_and_tubes_are_screened_as_they_are_scored(found: Adjusted, honest: DrawnString) -> None:
    looks, (squares, told) = honest.looks, whole_tests(found, honest.run)[0]
    count, order = len(looks), np.lexsort((-honest.looks.stop, honest.looks.tube))
    pairs = [*zip(looks.tube.tolist(), looks.stop.tolist(), strict=True)]
    each = [Hypothesis(K.LOOK_WRONG, (tube,), stop) for tube, stop in pairs]
    since = [Hypothesis(K.BIAS_STEPPED, one.subject, one.stop) for one in map(each.__getitem__, order)]
    assert_same((squares[:count], told[:count]), scored(found, honest, each))
    assert_same((squares[count:], told[count:]), scored(found, honest, since))


def test_turns_and_depths_are_screened_as_they_are_scored(found: Adjusted, honest: DrawnString) -> None:
    _, turns, depths, _ = whole_tests(found, honest.run)
    stops = np.unique(honest.looks.stop).tolist()
    names = [*honest.run.causes.names, ("encoder", -1)]
    asked = [(name, stop) for name in names for stop in stops]
    joints = [place for place, ((kind, _), _) in enumerate(asked) if kind == JOINT]
    slipped = [Hypothesis(K.JOINT_SLIPPED, (asked[place][0][1],), asked[place][1]) for place in joints]
    assert_same((turns[0][joints], turns[1][joints]), scored(found, honest, slipped))
    last = slice(-1 - len(stops), None)
    of_encoder = [Hypothesis(K.ENCODER_SLIPPED, (), stop) for stop in stops] + [Hypothesis(K.ENCODER_DRIFTS, ())]
    assert_same((turns[0][last], turns[1][last]), scored(found, honest, of_encoder))
    of_depth = [Hypothesis(kind, (), stop) for kind in (K.DEPTH_WRONG_FROM, K.DEPTH_WRONG_ONCE) for stop in stops]
    assert_same(depths, scored(found, honest, of_depth))


def test_two_stations_that_moved_are_screened_as_their_columns_tell(found: Adjusted, honest: DrawnString) -> None:
    looks, (squares, told) = honest.looks, whole_tests(found, honest.run)[3]
    stops, pairs = np.unique(looks.stop), np.arange(1, len(found.path.md) - 1)
    stop, first = stops[len(stops) // 2], pairs[1]
    moved = (looks.stop >= stop) & ((looks.station == first) | (looks.station == first + 1))
    columns = (found.linear.jacobians[:, :, :2] * moved[:, None, None])[:, :, None]
    pulled = np.einsum("kab,kb->ka", found.linear.weights, found.left)
    score = np.einsum("kahq,ka->hq", columns, pulled)
    _, _, its_told, its_squares = best_sizes(score, *free_information(found, np.arange(len(looks)), columns))
    place = len(stops) // 2 * len(pairs) + 1
    assert squares[place] == pytest.approx(its_squares[0], rel=1e-6)
    assert told[place] == its_told[0] == 2


def test_the_least_chance_is_that_of_all_tests_one_by_one(found: Adjusted, honest: DrawnString) -> None:
    tests = [against_prior(found), *whole_tests(found, honest.run)]
    chances = np.concatenate([log_chances(*one, found.squares, found.redundancy) for one in tests])
    least = min(float(chances.min()), collar_departure(found).log_chance())
    assert least_chance(found, honest.run) == pytest.approx(least + math.log(1 + len(chances)), rel=1e-9)
