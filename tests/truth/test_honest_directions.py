"""The adjustment's own standard deviations against worlds whose errors are drawn from what it is told."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest
from drawn_worlds import DEG, Case, Worlds, draw_worlds
from hole_world import direction
from scipy.stats import binom, chi2

from groundstation.survey.adjustment.adjust import adjust_hole
from groundstation.survey.adjustment.adjusted import Adjusted
from groundstation.survey.adjustment.looks import FurtherEffects

pytestmark = pytest.mark.slow

Array = npt.NDArray[np.float64]
WORLDS = 60
FAR = 10.0  # standard deviations of a lean, from which on an azimuth is an angle


def polar_square(found: Adjusted, station: int, true: Array) -> float:
    """Square of an error of inclination and azimuth in standard deviations; of the direction where there is no lean."""
    here, basis, cov = found.now.tangents[station], found.bases[station], found.covs[station, :2, :2]
    lean, azimuth = np.hypot(here[0], here[1]), np.arctan2(here[1], here[0])
    inward = np.array([here[2] * np.cos(azimuth), here[2] * np.sin(azimuth), -lean])
    axes = np.stack([inward, [-np.sin(azimuth), np.cos(azimuth), 0.0]])
    turned = axes @ basis.T
    spread = turned @ cov @ turned.T
    if lean < FAR * np.sqrt(spread[0, 0]):
        off = axes @ (true - here)
    else:
        tilted = np.arctan2(np.hypot(true[0], true[1]), true[2]) - np.arctan2(lean, here[2])
        turn = np.angle(np.exp(1j * (np.arctan2(true[1], true[0]) - azimuth)))
        off = np.array([tilted, turn * lean])
    return float(off @ np.linalg.solve(spread, off))


def squares_of(worlds: Worlds) -> Array:
    """Squares (w, s) at the stations of several worlds."""
    found = []
    for world in range(worlds.case.worlds):
        one = adjust_hole(worlds.looks(world), worlds.string, worlds.path)
        stations = range(1, len(worlds.path.md))
        found.append([polar_square(one, k, worlds.holes.tangents[world, k]) for k in stations])
    return np.array(found)


@pytest.mark.parametrize(
    ("inclination", "yaw"), [(0.0, 0.05), (1.0, 0.3), (30.0, 1.0), (60.0, 0.3), (90.0, 1.0), (150.0, 0.3)]
)
def test_what_is_said_of_directions_is_true(inclination: float, yaw: float) -> None:
    """Coverage of 95 % at every station and mean square, by bounds that an honest adjustment leaves in 1 of 1e4."""
    case = Case(
        seed=7, worlds=WORLDS, tubes=4, stations=4, make_ups=4, inclination=inclination, yaw=yaw, tilt=0.05,
        bias=0.001, play=0.01, joint=0.05,
    )  # fmt: skip
    squares = squares_of(draw_worlds(case))
    inside = (squares < chi2.ppf(0.95, 2)).sum(axis=0)
    least, most = binom.ppf([1e-4, 1.0 - 1e-4], WORLDS, [0.93, 0.97])
    assert (inside >= least).all()
    assert (inside <= most).all()
    low, high = chi2.ppf([1e-4, 1.0 - 1e-4], 2 * WORLDS) / (2 * WORLDS)
    assert (squares.mean(axis=0) / 2.0 > 0.9 * low).all()
    assert (squares.mean(axis=0) / 2.0 < 1.1 * high).all()


def test_mounts_as_they_are_mounted_leave_as_much_unknown_as_they_do() -> None:
    """At one tool face, with biases known: a tilt of half a degree is not small against what a bias may be."""
    case = Case(
        seed=5, worlds=WORLDS, tubes=6, stations=6, inclination=2.0, yaw=0.01, tilt=0.5, bias=3e-4, collar=0.15,
        same_tool_face=True,
    )  # fmt: skip
    squares = squares_of(draw_worlds(case))
    low, high = chi2.ppf([1e-4, 1.0 - 1e-4], 2 * WORLDS) / (2 * WORLDS)
    assert (squares.mean(axis=0) / 2.0 > 0.9 * low).all()
    assert (squares.mean(axis=0) / 2.0 < 1.1 * high).all()


def test_one_reading_of_four_that_is_far_off_is_left_out_as_an_effect_of_its_own() -> None:
    """Sixty standard deviations off: found by its residual, and with three unknowns of its own it changes nothing."""
    case = Case(seed=3, worlds=10, tubes=4, stations=4, inclination=30.0, tilt=0.02, bias=0.0003)
    worlds = draw_worlds(case)
    wrong = int(np.flatnonzero(worlds.plan.station == 1)[2])
    worlds.forces[:, wrong] += 60.0 * 2e-3 * direction(60.0 * DEG, 1.0)
    for world in range(case.worlds):
        looks = worlds.looks(world)
        found = adjust_hole(looks, worlds.string, worlds.path)
        pulled = np.einsum("kab,kb->ka", found.linear.weights, found.left)
        free = found.free_parts(np.arange(len(pulled)))
        contradicts = np.einsum("ka,ka->k", pulled, np.linalg.solve(free, pulled[:, :, None])[:, :, 0])
        assert int(np.argmax(contradicts)) == wrong
        columns = np.zeros((len(looks), 3, 3))
        columns[wrong] = np.eye(3)
        without = adjust_hole(looks, worlds.string, worlds.path, FurtherEffects(columns, np.full(3, 100.0)), found.now)
        assert polar_square(without, 1, worlds.holes.tangents[world, 1]) < chi2.ppf(1.0 - 1e-4, 2)
