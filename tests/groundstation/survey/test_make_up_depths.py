"""Depths at make-ups: steps that no other is like, drifts, zeros, and crews that survey elsewhere."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st

from groundstation.survey.well.depth_errors import DepthErrors
from groundstation.survey.well.make_up_depths import (
    MakeUpDepths,
    learnt_reading_std,
    make_up_depths,
    misfit_of_depths,
    usual_reading_std,
)

LENGTH = 2.0
ERRORS = DepthErrors(scale_std=5.6e-4, offset_std=0.01, tube_std=1e-3, reading_std=2e-3)
Array = npt.NDArray[np.float64]


def depths(rest: Array) -> MakeUpDepths:
    """Of tubes of one length, whose bit is deeper than they are long by ``rest`` (m)."""
    tubes = np.arange(1, len(rest) + 1)
    return make_up_depths(tubes, LENGTH * tubes + rest, np.full(len(rest), LENGTH))


def misfit(rest: Array) -> str:
    return misfit_of_depths(depths(rest), ERRORS, LENGTH)


def test_the_deepest_survey_with_so_many_tubes_counts() -> None:
    found = make_up_depths(np.array([1, 2, 2, 1]), np.array([2.0, 3.1, 4.0, 1.2]), np.array([2.0, 2.01]))
    assert found.tubes.tolist() == [1, 2]
    assert found.bit.tolist() == [2.0, 4.0]
    np.testing.assert_allclose(found.rest, [0.0, -0.01])


@given(seed=st.integers(0, 2**32 - 1), count=st.integers(1, 40), height=st.floats(0.0, 1.5))
def test_honest_make_ups_are_left_in_peace(seed: int, count: int, height: float) -> None:
    random = np.random.default_rng(seed)
    scale = random.normal(0.0, ERRORS.scale_std) * LENGTH * np.arange(1, count + 1)
    tubes = np.cumsum(random.normal(0.0, ERRORS.tube_std, count))
    readings = random.normal(0.0, ERRORS.reading_std, count) + random.normal(0.0, ERRORS.offset_std)
    assert misfit(scale + tubes + readings - height) == ""


@pytest.mark.parametrize("stop", [2, 5, 9])
@pytest.mark.parametrize("missed", [0.1, 2.0])
def test_a_depth_that_stood_still_for_a_while_is_told(stop: int, missed: float) -> None:
    rest = np.where(np.arange(10) >= stop, -missed, 0.0) + 1e-3 * np.sin(np.arange(10.0))
    assert "stood still or jumped" in misfit(rest)


@pytest.mark.parametrize(("scale", "word"), [(0.02, "more"), (-0.02, "less"), (0.1, "more")])
def test_a_scale_is_told_by_its_drift(scale: float, word: str) -> None:
    said = misfit(scale * LENGTH * np.arange(1, 11) - 0.8 * (scale > 0.05))
    assert f"{100.0 * abs(scale):.1f} % {word}" in said


def test_a_bit_deeper_than_its_tubes_is_told_and_one_that_hangs_higher_is_not() -> None:
    assert "2.30 m with 1 tube of 2.00 m" in misfit(np.full(10, 0.3))
    assert misfit(np.full(10, -0.3)) == ""


def test_a_crew_that_surveys_anywhere_has_no_habit() -> None:
    rest = -LENGTH * np.random.default_rng(3).random(20)
    assert misfit(rest) == ""
    assert learnt_reading_std(depths(rest), ERRORS, LENGTH) == ERRORS.reading_std


@given(seed=st.integers(0, 2**32 - 1), std=st.sampled_from([0.02, 0.05, 0.1]))
def test_readings_that_scatter_are_known_less_well(seed: int, std: float) -> None:
    rest = np.random.default_rng(seed).normal(0.0, std, 30)
    assert learnt_reading_std(depths(rest), ERRORS, LENGTH) == pytest.approx(std, rel=0.7)


@given(seed=st.integers(0, 2**32 - 1), std=st.sampled_from([0.02, 0.05, 0.1]))
def test_most_readings_tell_how_far_they_scatter(seed: int, std: float) -> None:
    rest = np.random.default_rng(seed).normal(0.0, std, 200)
    assert usual_reading_std(depths(rest), ERRORS, LENGTH) == pytest.approx(std, rel=0.35)


def test_a_depth_that_jumped_once_is_no_scatter() -> None:
    """Nine steps of 6 mm by their size, beside the 2 mm that are stated and count for four."""
    rest = 0.006 * np.array([0, 1, 0, 1, 0, 1, 0, 1, 0, 1.0])
    expected = math.sqrt((4.0 * 0.002**2 + 9.0 * (1.4826 * 0.006) ** 2 / 2.0) / 13.0)
    for jump in (0.0, 0.15, 2.0):
        assert usual_reading_std(depths(rest + np.repeat([0.0, jump], 5)), ERRORS, LENGTH) == pytest.approx(expected)
    assert learnt_reading_std(depths(rest + np.repeat([0.0, 2.0], 5)), ERRORS, LENGTH) > 0.3
    assert usual_reading_std(depths(np.zeros(6)), ERRORS, LENGTH) == ERRORS.reading_std
    anywhere = -LENGTH * np.random.default_rng(3).random(20)
    assert usual_reading_std(depths(anywhere), ERRORS, LENGTH) == ERRORS.reading_std


def test_nothing_is_said_of_nothing() -> None:
    nothing = MakeUpDepths(np.zeros(0, np.intp), np.zeros(0), np.zeros(0))
    assert misfit_of_depths(nothing, ERRORS, LENGTH) == ""
    assert learnt_reading_std(nothing, ERRORS, LENGTH) == ERRORS.reading_std
    assert usual_reading_std(nothing, ERRORS, LENGTH) == ERRORS.reading_std
