"""Directions rolled out: great circles, turns of the whole hole, and the integral of a curvature."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from groundstation.errors import SurveyError
from groundstation.survey.path.developed_directions import develop_directions

turns = st.tuples(*[st.floats(-3.0, 3.0)] * 3).map(Rotation.from_rotvec)


def tangents_of(inclination: np.ndarray, azimuth: np.ndarray) -> np.ndarray:
    sin = np.sin(inclination)
    return np.stack([sin * np.cos(azimuth), sin * np.sin(azimuth), np.cos(inclination)], axis=1)


def random_tangents(seed: int, count: int = 8, spread: float = 0.4) -> np.ndarray:
    drawn = np.random.default_rng(seed).normal([0.0, 0.0, 2.0], spread, (count, 3))
    return np.asarray(drawn / np.linalg.norm(drawn, axis=1, keepdims=True))


def no_covs(tangents: np.ndarray) -> np.ndarray:
    return np.zeros((len(tangents), 3, 3))


@given(st.floats(0.0, 6.28), st.floats(0.01, 0.4))
def test_a_hole_that_builds_in_one_plane_is_a_straight_line(azimuth: float, step: float) -> None:
    inclination = step * np.arange(7.0)
    tangents = tangents_of(inclination, np.full(7, azimuth))
    rolled = develop_directions(tangents, no_covs(tangents))
    expected = inclination[:, None] * np.array([np.cos(azimuth), np.sin(azimuth)])
    assert rolled.angles == pytest.approx(expected, abs=1e-9)


@given(st.integers(0, 10_000), turns)
def test_the_whole_hole_may_be_turned(seed: int, turn: Rotation) -> None:
    """At any inclination the same: what is rolled out is turned as a whole, distances and areas stay."""
    tangents = random_tangents(seed)
    here = develop_directions(tangents, no_covs(tangents)).angles
    there = develop_directions(turn.apply(tangents), no_covs(tangents)).angles
    assert there @ there.T == pytest.approx(here @ here.T, abs=1e-9)
    areas = [np.linalg.det(np.stack([a[1:-1], a[2:]], axis=1)) for a in (here, there)]
    assert areas[1] == pytest.approx(areas[0], abs=1e-9)


@given(st.integers(0, 10_000))
def test_axes_stay_across_and_each_step_is_the_dogleg(seed: int) -> None:
    tangents = random_tangents(seed)
    rolled = develop_directions(tangents, no_covs(tangents))
    frame = np.stack([*rolled.axes, tangents[-1]])
    assert frame @ frame.T == pytest.approx(np.eye(3), abs=1e-9)
    assert np.linalg.det(frame) == pytest.approx(1.0)
    doglegs = np.arccos(np.clip((tangents[:-1] * tangents[1:]).sum(axis=1), -1.0, 1.0))
    assert np.linalg.norm(np.diff(rolled.angles, axis=0), axis=1) == pytest.approx(doglegs, abs=1e-6)


def test_what_is_rolled_out_is_the_integral_of_the_curvature() -> None:
    """Bishop's equations T' = k1 M1 + k2 M2, M' = -k T by an integrator of its own, at stations close together."""

    def curvature(s: float) -> np.ndarray:
        return np.array([0.02 + 0.01 * np.sin(0.3 * s), 0.015 * np.cos(0.2 * s)])

    def slope(s: float, state: np.ndarray) -> np.ndarray:
        tangent, first, second, _ = state.reshape(4, 3)
        k = curvature(s)
        return np.concatenate([k[0] * first + k[1] * second, -k[0] * tangent, -k[1] * tangent, [*k, 0.0]])

    start = np.concatenate([np.eye(3)[2], np.eye(3)[0], np.eye(3)[1], np.zeros(3)])
    places = np.linspace(0.0, 40.0, 801)
    states = solve_ivp(slope, (0.0, 40.0), start, t_eval=places, rtol=1e-10, atol=1e-12).y.T.reshape(-1, 4, 3)
    rolled = develop_directions(states[:, 0], no_covs(states[:, 0]))
    assert rolled.angles == pytest.approx(states[:, 3, :2], abs=2e-5)
    assert rolled.axes == pytest.approx(states[-1, 1:3], abs=2e-4)


@given(st.integers(0, 10_000))
def test_a_covariance_is_seen_on_the_axes_across(seed: int) -> None:
    """The spread of angles measured twice: once with an error of a station, once without."""
    tangents, random = random_tangents(seed, 3, 0.02), np.random.default_rng(seed)
    root = 1e-4 * random.normal(size=(3, 3))
    across = np.eye(3) - np.outer(tangents[-1], tangents[-1])
    covs = np.concatenate([np.zeros((2, 3, 3)), (across @ root @ root.T @ across)[None]])
    found = develop_directions(tangents, covs).covs[-1]
    spread = np.zeros((2, 2))
    for column in (across @ root).T:
        moved = tangents[-1] + column
        again = develop_directions(np.stack([*tangents[:2], moved / np.linalg.norm(moved)]), no_covs(tangents))
        change = again.angles[-1] - develop_directions(tangents, no_covs(tangents)).angles[-1]
        spread += np.outer(change, change)
    # angles are those of the tangent but for a part of the dogleg squared
    assert found == pytest.approx(spread, rel=0.01, abs=1e-11)


def test_a_hole_that_turns_back_is_refused() -> None:
    tangents = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]])
    with pytest.raises(SurveyError, match="path: expected directions that do not turn back"):
        develop_directions(tangents, no_covs(tangents))


def test_a_hole_straight_up_has_axes() -> None:
    tangents = np.array([[0.0, 0.0, -1.0], [0.01, 0.0, -np.sqrt(1.0 - 1e-4)]])
    rolled = develop_directions(tangents, no_covs(tangents))
    assert np.linalg.norm(rolled.angles[-1]) == pytest.approx(np.arcsin(0.01))
