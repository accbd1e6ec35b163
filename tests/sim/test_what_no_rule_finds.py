"""How well anything finds a string that winds slowly below one node: the matched filter, which no rule outdoes.

It knows when the string winds and is let go, and how fast, as no rule does, and has a whole run of the readings: the
turning that a gyroscope shows beyond that of the encoder, and at rest the tool face by gravity. With noise of
covariance C a record of the shape p is told to the standard deviation (p^T C^-1 p)^-1/2. Source: Kay, Fundamentals of
Statistical Signal Processing II, 1998, 4.4. The figures stand in ``docs/field.md``.
"""

import math

import numpy as np
import numpy.typing as npt
import pytest

from sim.studies.field.cases import BASE
from sim.studies.field.drawn_constants import draw_constants
from sim.studies.field.third_world import UNSEEN
from sim.studies.limits.bound import model_of
from sim.world.disturbance.slow_twist import SlowTwistSection, wound_share
from sim.world.scenario import scenario_of
from sim.world.world import World

Array = npt.NDArray[np.float64]
DRAWS = 200
HEALTHY_DEG = 0.0065  # what a rest states after a clean turning
TOOL_FACE_DEG = 0.57  # of one reading at 2 deg of lean
ANY_BIAS = math.radians(1.0)  # rad/s, its constant part
ONE_IN_THOUSAND = 3.29  # sigmas, either way


@pytest.fixture(scope="module")
def world() -> World:
    return World(scenario_of(dict(BASE)), 1)


@pytest.fixture(scope="module")
def information(world: World) -> Array:
    """That of a whole run."""
    return information_until(world, math.inf)


def information_until(world: World, until: float) -> Array:
    """Inverse covariance (n, n), s^2/rad^2, of the mean rates of a gyroscope less those of the head, up to a time."""
    model, ends = model_of(world, 1), world.ends[world.ends <= until]
    edges = np.append(world.begin, ends)
    spin = np.diff(world.motion.drive(edges)[0]) / np.diff(edges)
    wanders = model.bias_std**2 * np.exp(-np.abs(ends[:, None] - ends) / model.bias_tau)
    white = np.diag(model.noise**2 / np.diff(edges))
    return np.asarray(np.linalg.inv(wanders + white + model.scale_std**2 * np.outer(spin, spin) + ANY_BIAS**2))


def told_to_deg(world: World, information: Array, section: SlowTwistSection) -> float:
    """Standard deviation (deg) to which the size of a twist is known whose course is, by so many first cycles."""
    ends = world.ends[: len(information)]
    edges = np.append(world.begin, ends)
    drives, stops = ([phase for phase in world.phases if phase.kind == kind] for kind in ("drill", "stop"))
    lag, faces = np.zeros(len(edges)), 0.0
    for drive, stop in zip(drives, stops, strict=True):
        lag += wound_share(section, edges - drive.start, edges - stop.start, stop.start - drive.start)
    for stop in stops:
        seen = lag[1:][(ends > stop.start) & (ends <= stop.end)]
        faces += float(np.sum((seen - seen.mean()) ** 2)) / math.radians(TOOL_FACE_DEG) ** 2 if len(seen) else 0.0
    rates = np.diff(lag) / np.diff(edges)
    return math.degrees((rates @ information @ rates + faces) ** -0.5)


def test_half_of_the_slow_twists_of_bad_days_are_found_by_nothing(world: World, information: Array) -> None:
    sections = [
        SlowTwistSection(**draw_constants(UNSEEN[0], seed)["disturbance"]["slow-twist"]) for seed in range(1, DRAWS + 1)
    ]
    twists = np.array([one.twist_deg for one in sections])
    told = np.array([told_to_deg(world, information, one) for one in sections])
    assert np.median(told) == pytest.approx(0.037, abs=0.001)
    # each is beyond three sigmas of what a healthy rest states, so who states that is wrong by all of them
    assert np.all(twists > 3.0 * HEALTHY_DEG)
    assert np.mean(twists < ONE_IN_THOUSAND * told) == pytest.approx(0.5, abs=0.1)


@pytest.mark.parametrize(
    ("stop", "is_over", "told_deg", "found"), [(0, False, 0.090, 0.13), (0, True, 0.052, 0.37), (1, False, 0.045, 0.44)]
)
def test_before_the_first_stop_an_eighth_of_them_is_found_and_a_third_after_it(
    world: World, stop: int, is_over: bool, told_deg: float, found: float
) -> None:
    """What is not told while the string turns for the first time is a quarter of the time that the study judges."""
    phase = [phase for phase in world.phases if phase.kind == "stop"][stop]
    known = information_until(world, phase.end if is_over else phase.start)
    sections = [
        SlowTwistSection(**draw_constants(UNSEEN[0], seed)["disturbance"]["slow-twist"]) for seed in range(1, DRAWS + 1)
    ]
    told = np.array([told_to_deg(world, known, one) for one in sections])
    assert np.median(told) == pytest.approx(told_deg, abs=0.001)
    beyond = np.array([one.twist_deg for one in sections]) > ONE_IN_THOUSAND * told
    assert np.mean(beyond) == pytest.approx(found, abs=0.01)


def test_of_white_noise_alone_it_is_the_formula_for_two_even_rates(world: World) -> None:
    """A twist of one unit is a rate of 1 / wind and one of 1 / unwind, in each of two blocks."""
    white = np.diag(np.diff(np.append(world.begin, world.ends))) / model_of(world, 1).noise ** 2
    told = told_to_deg(world, white, SlowTwistSection(twist_deg=0.12, wind_s=22.0, unwind_s=20.0))
    by_hand = 0.007313 * (2.0 / 22.0 + 2.0 / 20.0) ** -0.5
    assert told == pytest.approx(by_hand, rel=0.03)
