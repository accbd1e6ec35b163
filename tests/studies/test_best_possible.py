"""The best possible estimate against closed forms: one look, many looks, redundancy, and the path between stations."""

import math
from dataclasses import replace

import numpy as np
import pytest

from borechain.studies.set_up.best_possible import TrueLooks, TrueSpread, best_direction_cov, path_covariance

G = 9.81
NOISE = 6e-4  # m/s^2
LOOSE = 1e2  # rad, of what is not known before


def looks_at(tangents: np.ndarray, station: list[int], tube: list[int], yaws: np.ndarray) -> TrueLooks:
    count = len(station)
    top, quiet, noise = np.full(count, max(tube)), np.full(count, 1e-12), np.full(count, NOISE**2)
    return TrueLooks(np.array(station), np.array(tube), top, yaws, quiet, noise, tangents)


def spread(stations: int, **values: float) -> TrueSpread:
    names = ("bias_std", "tilt_std", "play_std", "mount_std", "joint_std", "north_std")
    known = dict.fromkeys(names, 1e-9) | values
    return TrueSpread(**known, path_cov=LOOSE**2 * np.eye(2 * stations))


def leaning(*degrees: float) -> np.ndarray:
    lean = np.radians(degrees)
    return np.stack([np.sin(lean), 0.0 * lean, np.cos(lean)], axis=1)


def test_one_look_knows_a_direction_as_well_as_its_force() -> None:
    looks = looks_at(leaning(3.0), [0], [0], np.array([0.7]))
    found = np.sqrt(np.diag(best_direction_cov(looks, spread(1))))
    np.testing.assert_allclose(found, NOISE / G, rtol=5e-3)  # along and across a small lean


@pytest.mark.parametrize("count", [2, 5, 10])
def test_looks_of_other_tubes_count_as_their_number(count: int) -> None:
    looks = looks_at(leaning(3.0), [0] * count, list(range(count)), np.linspace(0.0, 5.0, count))
    found = best_direction_cov(looks, spread(1, play_std=1e-4))
    expected = ((NOISE / G) ** 2 + 1e-8) / count
    np.testing.assert_allclose(np.diag(found), expected, rtol=1e-2)


def test_a_bias_that_is_not_known_is_all_that_one_look_has() -> None:
    looks = looks_at(leaning(2.0), [0], [0], np.array([0.3]))
    found = np.sqrt(np.diag(best_direction_cov(looks, spread(1, bias_std=0.01))))
    np.testing.assert_allclose(found, math.hypot(0.01, NOISE) / G, rtol=5e-3)


def test_half_a_turn_at_one_place_takes_a_bias_out() -> None:
    """Two looks of one tube at one station, half a turn apart: a bias across it cancels in the mean."""
    looks = looks_at(leaning(2.0), [0, 0], [0, 0], np.array([0.3, 0.3 + math.pi]))
    found = np.sqrt(np.diag(best_direction_cov(looks, spread(1, bias_std=0.05))))
    np.testing.assert_allclose(found, NOISE / G / math.sqrt(2.0), rtol=2e-2)


def test_a_yaw_that_errs_turns_the_lean_and_leaves_the_inclination() -> None:
    looks = looks_at(leaning(5.0), [0], [0], np.array([1.1]))
    blurred = replace(looks, yaw_var=np.array([1e-4]))
    cov = best_direction_cov(blurred, spread(1))
    small, large = np.sqrt(np.linalg.eigvalsh(cov))
    assert small == pytest.approx(NOISE / G, rel=5e-3)
    assert large == pytest.approx(math.hypot(NOISE / G, 1e-2 * math.sin(math.radians(5.0))), rel=1e-2)


def test_the_path_is_a_curvature_integrated_twice() -> None:
    """Against paths that are drawn step by step."""
    random, step, length, std = np.random.default_rng(5), 0.05, 7.0, 0.02
    left = math.exp(-step / length)
    curvature = std * random.standard_normal(20_000)
    direction, kept = 0.1 * random.standard_normal(20_000), {}
    for k in range(1, int(12.0 / step) + 1):
        after = left * curvature + std * math.sqrt(1.0 - left**2) * random.standard_normal(20_000)
        direction = direction + 0.5 * step * (curvature + after)
        curvature = after
        if k * step in (4.0, 12.0):
            kept[round(k * step)] = direction
    sampled = np.cov(np.stack([kept[4], kept[12]]))
    found = path_covariance(np.array([4.0, 12.0]), 0.1, std, length)
    np.testing.assert_allclose(found[::2, ::2], sampled, rtol=0.06)
    assert not found[::2, 1::2].any()


def test_marks_add_up_from_the_tube_to_the_head_and_north_is_in_all() -> None:
    """The lean across of one look is off by its yaw times the sine of its inclination."""
    sine, marks = math.sin(math.radians(10.0)), {"mount_std": 1e-3, "joint_std": 2e-3, "north_std": 5e-3}
    for tube, joints in ((0, 4), (2, 2), (3, 1)):
        looks = replace(looks_at(leaning(10.0), [0], [tube], np.array([0.4])), top=np.array([3]))
        found = np.sqrt(np.linalg.eigvalsh(best_direction_cov(looks, spread(1, **marks))))
        expected = math.hypot(NOISE / G, sine * math.sqrt(1e-6 + joints * 4e-6 + 25e-6))
        np.testing.assert_allclose(found, [NOISE / G, expected], rtol=1e-2)
