"""Where inside a count the head stopped: truth is known, the edges have the disc's own errors."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from node.firmware.edge_interpolation import EDGES, FEWEST, UNKNOWN, stopped_at
from node.firmware.encoder_node import STOP_STD, EncoderNode, EncoderSample
from node.kernels.string.encoder_step import EDGE_STD, QUANTUM
from sim.world.disc import Disc
from sim.world.motion import Motion, Trapezoid

BRAKE = 0.5 * math.radians(35.0) / QUANTUM  # counts/s^2
LINE = EDGE_STD / QUANTUM
SEEDS = 300


def power(p: float, counts: np.ndarray) -> np.ndarray:
    """Seconds to go, ``counts`` before a stop by a power of time."""
    return np.asarray((np.maximum(counts, 0.0) / BRAKE) ** (1.0 / p))


def viscous(tau: float, counts: np.ndarray) -> np.ndarray:
    """The same of a brake beside friction that grows with the rate: v' = -f - v / tau."""
    t = np.linspace(0.0, 3.0, 20001)
    gone = 2.0 * BRAKE * tau * (tau * np.expm1(t / tau) - t)
    return np.interp(counts, gone, t)


def dead_stop(rate: float, counts: np.ndarray) -> np.ndarray:
    """The same of a head that hits a wall."""
    return np.asarray(counts / rate)


def cut(rate: float, counts: np.ndarray) -> np.ndarray:
    """The same of a head that is braked and stops dead at ``rate`` counts/s."""
    return np.asarray((np.sqrt(rate**2 + 4.0 * BRAKE * np.maximum(counts, 0.0)) - rate) / (2.0 * BRAKE))


def errors(to_go, parameter: float) -> tuple[np.ndarray, np.ndarray]:  # type: ignore[no-untyped-def]
    """Error (counts) and what it is by its own variance, over the seeds."""
    random = np.random.default_rng(7)
    rows = []
    for _ in range(SEEDS):
        beyond = random.uniform()
        times = -to_go(parameter, np.arange(EDGES) + beyond + LINE * random.standard_normal(EDGES))
        mean, var = stopped_at(tuple(1e6 + times), STOP_STD)
        rows.append((mean - beyond, (mean - beyond) ** 2 / var))
    error, normalised = np.array(rows).T
    return error, normalised


@pytest.mark.slow
@pytest.mark.parametrize(
    ("to_go", "parameter", "better"),
    [(power, 2.0, 1.6), (power, 2.3, 1.8), (power, 3.0, 2.2), (power, 3.5, 2.2), (viscous, 0.05, 2.2),
     (viscous, 0.2, 1.4)],
)  # fmt: skip
def test_the_place_is_better_known_than_the_middle_of_the_count(to_go, parameter: float, better: float) -> None:  # type: ignore[no-untyped-def]
    error, normalised = errors(to_go, parameter)
    assert np.sqrt(np.mean(error**2)) * better < math.sqrt(1.0 / 12.0)
    # mean of a chi-squared over the seeds; beyond 1 by what the form of the stop may add
    assert 0.3 < np.mean(normalised) < 1.0 + 4.0 * math.sqrt(2.0 / SEEDS)


@pytest.mark.parametrize(("to_go", "parameter"), [(dead_stop, 800.0), (power, 1.25), (power, 1.5)])
def test_a_hard_stop_is_not_believed_far(to_go, parameter: float) -> None:  # type: ignore[no-untyped-def]
    error, normalised = errors(to_go, parameter)
    assert np.mean(normalised) < 2.5
    assert np.sqrt(np.mean(error**2)) < 1.2 * math.sqrt(1.0 / 12.0)


def test_a_head_that_stops_dead_leaves_the_place_unknown() -> None:
    error, normalised = errors(cut, math.radians(10.0) / QUANTUM)
    assert np.mean(normalised) == pytest.approx(1.0, abs=4.0 * math.sqrt(0.8 / SEEDS))
    assert np.sqrt(np.mean(error**2)) == pytest.approx(math.sqrt(1.0 / 12.0), rel=0.1)


RAGGED = st.lists(st.floats(1e-9, 1e9) | st.floats(0.01, 1.0), min_size=FEWEST, max_size=EDGES)


@given(st.lists(st.floats(), max_size=2 * EDGES) | RAGGED.map(lambda gaps: (1e9 - np.cumsum(gaps)).tolist()))
def test_whatever_the_times_are_the_place_is_inside_the_count(times: list[float]) -> None:
    mean, var = stopped_at(tuple(times), STOP_STD)
    assert 0.0 < mean < 1.0
    assert 0.0 < var <= 0.25


def test_few_edges_or_irregular_ones_leave_the_place_unknown() -> None:
    good = tuple(-power(2.0, np.arange(EDGES) + 0.3))
    assert stopped_at((), STOP_STD) == UNKNOWN
    assert stopped_at(good[: FEWEST - 1], STOP_STD) == UNKNOWN
    assert stopped_at((*good[: FEWEST - 1], *good[:2]), STOP_STD) == UNKNOWN
    assert stopped_at((*good[:3], math.nan, *good[4:]), STOP_STD) == UNKNOWN
    assert stopped_at(good, STOP_STD) != UNKNOWN
    stutter = tuple(t - 0.1 * (k % 2) for k, t in enumerate(np.cumsum(np.full(EDGES, -0.15))))
    assert stopped_at(stutter, STOP_STD) == UNKNOWN


@pytest.mark.parametrize("rising", [True, False])
def test_the_encoder_places_its_rest_by_the_edges_and_keeps_to_it(rising: bool) -> None:
    times = tuple(1001.0 - power(2.0, np.arange(EDGES) + 0.8))
    encoder, count = EncoderNode(), 430
    sample = EncoderSample(count, times[0], rising, earlier=times[1:])
    encoder.on_cycle(EncoderSample(0, 1000.0, rising), 1000.0)
    turning = encoder.on_cycle(sample, 1001.1)
    rests = [encoder.on_cycle(sample, 1001.6 + k) for k in range(3)]
    assert len({(rest.yaw, rest.yaw_var, rest.sequence) for rest in rests}) == 1
    truth = (count + (0.8 if rising else 0.2)) * QUANTUM
    assert turning.valid_at == times[0]
    assert abs(rests[0].yaw - truth) < 2.0 * math.sqrt(rests[0].yaw_var)
    assert rests[0].yaw_var < 0.5 * QUANTUM**2 / 12.0


def test_the_disc_tells_its_last_edges_and_the_stop_follows_from_them() -> None:
    normalised = []
    for seed in range(40):
        random = np.random.default_rng(seed)
        turn = Trapezoid(4.0 * math.pi, math.radians(71.0), math.radians(35.0))
        motion = Motion(1000.0, 10.0, 1.0, 20.0, 1.0, turn, 1, 1.0, float(random.uniform(0.0, math.tau)))
        disc, encoder = Disc(motion, 4096, EDGE_STD, random), EncoderNode()
        for t in np.arange(1000.5, 1030.0, 0.5):
            count, edge, earlier = disc.sample(float(t))
            rest = encoder.on_cycle(EncoderSample(count, edge, True, earlier=earlier), float(t))
        assert list(earlier) == sorted(earlier, reverse=True)
        assert rest.rate == 0.0
        off = math.remainder(rest.yaw - float(motion.drive(np.array([1030.0]))[0][0]), math.tau)
        normalised.append(off**2 / rest.yaw_var)
    assert 0.3 < np.mean(normalised) < 1.0 + 4.0 * math.sqrt(2.0 / 40)
