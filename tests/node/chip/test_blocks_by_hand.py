"""A parameter block on a chip over plain records: each bound at its value and a hair beyond, each change and its like.

Polynomials, corrections and resets of kernels stand as what they are in plain integers; their own tests hold them.
"""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from node.kernels.record.events import Code
from node.translation import chip_blocks as blocks

ONE, KELVIN = 1 << 30, 1 << 23  # of a factor; a temperature of 128 K is one
COLD, HOT, USUAL = -20 * KELVIN, 85 * KELVIN, 25 * KELVIN
DEG = math.pi / 180.0
MOST_RATE, MOST_FORCE = round(20.0 * DEG * 2**46), 13686399  # 2 m/s^2 in g of 9.80665 m/s^2, Q26


def times(a: int, f: int) -> int:
    return (a * f) >> 30


def polynomial(c0: int, c1: int, c2: int, c3: int, x: int) -> int:
    return c0 + times(c1, x) + times(times(c2, x), x) + times(times(times(c3, x), x), x)


@pytest.fixture(autouse=True)
def _plain(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(blocks, "cubic_polynomial", polynomial)
    monkeypatch.setattr(blocks, "times_factor", times)
    monkeypatch.setattr(blocks, "are_numbers", lambda *readings: all(abs(x) < 1 << 60 for one in readings for x in one))


def sensor(matrix: Any = None, bias: Any = (0, 0, 0), reference: int = USUAL) -> Any:
    whole = np.zeros((4, 3, 3), object)
    whole[0] = np.diag([ONE] * 3) if matrix is None else matrix
    biases = np.zeros((4, 3), object)
    biases[0] = bias
    return SimpleNamespace(matrix=whole, bias=biases, reference=reference, m=np.zeros((3, 3), object))


def block(gyroscope: Any = None, accelerometer: Any = None) -> Any:
    return [SimpleNamespace(gyroscope=gyroscope or sensor(), accelerometer=accelerometer or sensor())]


def entry(i: int, j: int, by: int) -> Any:
    matrix = np.diag([ONE] * 3).astype(object)
    matrix[i, j] += by
    return matrix


@pytest.mark.parametrize(("i", "j"), [(0, 0), (0, 2), (1, 0), (2, 1), (2, 2)])
@pytest.mark.parametrize("sign", [1, -1])
def test_a_matrix_is_near_the_unit_or_the_one_before(i: int, j: int, sign: int) -> None:
    """An entry may be a fifth off: 214748365 of 2^30."""
    before = block(sensor(entry(i, j, sign * 500)))
    for by, far in ((214748365, False), (214748366 + 500, True), (214748365 + 500, False)):
        other = block(sensor(entry(i, j, sign * by)))
        assert blocks.judge_block(before, other) == (blocks.FAR if far else 0)
    other = block(accelerometer=sensor(entry(i, j, sign * 214748366)))
    assert blocks.judge_block(block(), other) == 13
    assert blocks.judge_block(block(accelerometer=sensor(entry(i, j, sign))), other) == 0


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("sign", [1, -1])
def test_a_bias_of_a_block_has_its_bound_and_each_sensor_its_own(axis: int, sign: int) -> None:
    for most, of, added in ((MOST_RATE, "gyroscope", 0), (MOST_FORCE, "accelerometer", 8)):
        for over, found in ((0, 0), (1, 4 + added)):
            bias = [0, 0, 0]
            bias[axis] = sign * (most + over)
            assert blocks.judge_block(block(), block(**{of: sensor(bias=bias)})) == found


@pytest.mark.parametrize(("reference", "found"), [(COLD, 0), (COLD - 1, 1), (HOT, 0), (HOT + 1, 1)])
def test_a_reference_is_within_what_is_followed(reference: int, found: int) -> None:
    assert blocks.judge_sensor(sensor(reference=reference), MOST_RATE) == found
    assert blocks.judge_block(block(), block(accelerometer=sensor(reference=reference))) == (found + 8 if found else 0)


@pytest.mark.parametrize(("reference", "farthest"), [(COLD, 105), (HOT, -105), (USUAL, 60), (60 * KELVIN, -80)])
@pytest.mark.parametrize("sign", [1, -1])
def test_a_slope_drifts_over_the_whole_of_the_temperatures(reference: int, farthest: int, sign: int) -> None:
    """A tenth of drift, 107374182 of 2^30, where the reading is farthest from its reference: at -20 or at 85 C."""
    for over, found in ((0.999, 0), (1.001, 3)):
        one = sensor(reference=reference)
        one.matrix[1, 0, 1] = sign * round(0.1 * ONE * 128 / abs(farthest) * over)
        assert blocks.judge_sensor(one, MOST_RATE) == found
        other = sensor(reference=reference)
        other.bias[1, 2] = sign * round(MOST_RATE * 128 / abs(farthest) * over)
        assert blocks.judge_sensor(other, MOST_RATE) == (4 if over > 1.0 else 0)


def test_a_matrix_is_judged_before_a_drift_and_a_drift_before_a_bias() -> None:
    one = sensor(bias=(MOST_RATE + 1, 0, 0))
    one.matrix[1, 0, 1] = ONE
    assert blocks.judge_sensor(one, MOST_RATE) == 3
    one.matrix[0, 0, 0] = -ONE
    assert blocks.judge_sensor(one, MOST_RATE) == 2
    one.reference = HOT + 1
    assert blocks.judge_sensor(one, MOST_RATE) == 1


def test_terms_that_no_sum_holds_are_refused_before_they_are_summed() -> None:
    for p in range(4):
        one = sensor()
        one.matrix[p, 2, 1] = (1 << 31) + 1
        assert blocks.judge_sensor(one, MOST_RATE) == 2
        other = sensor()
        other.bias[p, 1] = -(1 << 54) - 1
        assert blocks.judge_sensor(other, MOST_RATE) == 4


def scaled(*numbers: float) -> Any:
    return np.array([round(x * ONE) for x in numbers], object).reshape(3, 3)


@pytest.mark.parametrize(
    ("numbers", "is_well"),
    [
        ((1.99, 0, 0, 0, 1, 0, 0, 0, 0.5), True),  # stretches by 1.99 : 0.5 = 3.98
        ((1.99, 0, 0, 0, 1, 0, 0, 0, 0.495), False),  # 4.02
        ((0.5, 0, 0, 0, 1.99, 0, 0, 0, 1), True),
        ((1, 0, 0, 0, 0.495, 0, 0, 0, 1.99), False),
        ((-1, 0, 0, 0, 1, 0, 0, 0, 1), False),  # left-handed
        ((-1, 0, 0, 0, -1, 0, 0, 0, 1), True),  # half a turn
        ((0, 1, 0, 1, 0, 0, 0, 0, 1), False),
        ((0, 1, 0, 0, 0, 1, 1, 0, 0), True),  # axes in turn
        ((1, 0, 0, 1, 0, 0, 0, 0, 1), False),  # of no volume
        ((0.6, -0.8, 0, 0.8, 0.6, 0, 0, 0, 1), True),  # a turn
        ((1, 1.49, 0, 0, 1, 0, 0, 0, 1), True),  # sheared: ((s^2+2) + s sqrt(s^2+4)) / 2 = 3.97^2 at 1.49 -> 3.96
        ((1, 1.51, 0, 0, 1, 0, 0, 0, 1), False),
        ((1, 0, 0, 0, 1, 1.51, 0, 0, 1), False),
        ((1, 0, 1.51, 0, 1, 0, 0, 0, 1), False),
        ((2.01, 0, 0, 0, 2, 0, 0, 0, 2), False),  # beyond an entry's range
        ((2, 0, 0, 0, 2, 0, 0, 0, 2), True),
    ],
)  # fmt: skip
def test_a_matrix_is_right_handed_and_stretches_fourfold_at_most(numbers: Any, is_well: bool) -> None:
    """The ratio of singular values by numpy, which shares nothing with the roots of the characteristic polynomial."""
    matrix = np.array(numbers, float).reshape(3, 3)
    stretches = np.linalg.svd(matrix, compute_uv=False)
    within = np.linalg.det(matrix) > 0.0 and stretches[0] <= 4.0 * stretches[-1] and np.abs(matrix).max() <= 2.0
    assert bool(within) is is_well
    assert blocks.is_well_conditioned(scaled(*numbers)) is is_well


def test_ratios_of_drawn_matrices_are_those_of_their_singular_values() -> None:
    random = np.random.default_rng(5)
    told = 0
    for _ in range(200):
        matrix = np.eye(3) + random.uniform(-0.9, 0.9, (3, 3))
        stretches = np.linalg.svd(matrix, compute_uv=False)
        ratio = stretches[0] / stretches[-1] if np.linalg.det(matrix) > 0.0 else math.inf
        if abs(ratio - 4.0) > 0.01:
            assert blocks.is_well_conditioned(scaled(*matrix.ravel())) is bool(ratio < 4.0)
            told += ratio < 4.0
    assert 30 < told < 170


def node(**change: Any) -> Any:
    nan = 1 << 60
    state = SimpleNamespace(
        still_cycles=0, mode=1, ring_split=np.array([5, 6]), smoothing=1,
        ring_rate=np.array([[1, 2, 3], [nan, 0, 0], [4, 5, 6]]),
        ring_force=np.array([[7, 8, 9], [1, 1, 1], [2, 2, 2]]),
    )  # fmt: skip
    made = {
        "filter": state, "aligner": SimpleNamespace(method=0), "temperature": 30 * KELVIN, "slow_cycles": 0,
        "config": "the filter's", "mount": SimpleNamespace(method=2, axis=np.full((2, 3), 9), std=np.full((2, 2), 9)),
    }  # fmt: skip
    return SimpleNamespace(**made | change)


GRAVITY = 1 << 26
G95, G105 = math.ceil(0.95 * GRAVITY), math.floor(1.05 * GRAVITY)


@pytest.mark.parametrize(
    ("rate", "force", "still", "found"),
    [
        ((0, 0, 0), (0, 0, G95), 9, 1), ((0, 0, 0), (0, 0, G95 - 1), 9, 2), ((0, 0, 0), (0, 0, -G105), 9, 1),
        ((0, 0, 0), (G105 + 1, 0, 0), 9, 2), ((0, blocks.FASTEST - 1, 0), (0, GRAVITY, 0), 9, 1),
        ((0, 0, blocks.FASTEST), (0, GRAVITY, 0), 9, 2), ((-blocks.FASTEST, 0, 0), (0, GRAVITY, 0), 9, 2),
        ((0, 0, 0), (0, 0, G95 - 1), 3, 3), ((0, 0, 0), (0, 0, G95 - 1), 4, 2), ((0, 0, 0), (0, 0, 3 << 26), 9, 2),
        ((0, 0, 0), (0, 0, 1 << 60), 9, 0), ((0, 0, 0), (1 << 25, 1 << 25, 46 << 20), 9, 1),
        ((0, 0, 0), (0, 0, 0), 9, 2),
    ],
)  # fmt: skip
def test_a_cycle_at_rest_reads_gravity_within_five_percent_and_hardly_turns(
    monkeypatch: pytest.MonkeyPatch, rate: Any, force: Any, still: int, found: int
) -> None:
    """0.0087 rad/s, and 0.95 to 1.05 g: (0.5, 0.5, 0.71875) g is 1.0076 g long."""
    monkeypatch.setattr(blocks, "is_at_rest", lambda _node: True)
    monkeypatch.setattr(blocks, "correct_cycle", lambda *_: None)
    assert round(0.0087 * 2**46) == blocks.FASTEST
    one = node()
    one.filter.still_cycles = still
    assert blocks.try_block([one], ["block"], list(rate), list(force)) == found
    monkeypatch.setattr(blocks, "is_at_rest", lambda _node: False)
    assert blocks.try_block([one], ["block"], list(rate), list(force)) == 0


def test_a_cycle_is_tried_as_the_other_block_corrects_it(monkeypatch: pytest.MonkeyPatch) -> None:
    given: list[Any] = []

    def correct(other: Any, temperature: int, rate: Any, force: Any) -> None:
        given.append((other, temperature))
        rate[1], force[2] = 0, GRAVITY

    monkeypatch.setattr(blocks, "is_at_rest", lambda _node: True)
    monkeypatch.setattr(blocks, "correct_cycle", correct)
    assert blocks.try_block([node()], ["block"], [0, 1 << 45, 0], [0, 0, 5]) == 1
    assert given == [("block", 30 * KELVIN)]


@pytest.mark.parametrize("changed", [1, 2, 3])
@pytest.mark.parametrize("method", [0, 1])
@pytest.mark.parametrize(("warmth", "held"), [(30, 30), (-30, -20), (100, 85)])
def test_what_a_block_changes_is_forgotten_and_read_anew_and_nothing_else(
    monkeypatch: pytest.MonkeyPatch, changed: int, method: int, warmth: int, held: int
) -> None:
    told: list[Any] = []
    for name in ("refuse_alignment", "forget_bias", "lose_tilt", "forget_mount"):
        monkeypatch.setattr(blocks, name, lambda *given, name=name: told.append((name, *given[1:3])))
    for name in ("restore_raw", "correct_sensor"):
        monkeypatch.setattr(
            blocks, name, lambda one, at, reading, name=name: told.append((name, one, at, list(reading)))
        )  # fmt: skip
    one = node(aligner=SimpleNamespace(method=method), temperature=warmth * KELVIN)
    old, new = block("old gyroscope", "old accelerometer"), block("new gyroscope", "new accelerometer")
    assert blocks.take_block([one], ["settings"], old, new, changed) == 0
    at = held * KELVIN
    expected: list[Any] = []
    if changed & 2:
        expected.append(("forget_mount", "settings"))
    if changed & 1:
        expected += [("refuse_alignment", 15, 0)] if method else []
        expected.append(("forget_bias", "the filter's"))
    if changed & 2:
        expected.append(("lose_tilt",))
    for rate, force in (([1, 2, 3], [7, 8, 9]), ([4, 5, 6], [2, 2, 2])):
        for bit, of, reading in ((1, "gyroscope", rate), (2, "accelerometer", force)):
            if changed & bit:
                expected += [("restore_raw", f"old {of}", at, reading), ("correct_sensor", f"new {of}", at, reading)]
    assert told == expected
    assert one.filter.ring_split.tolist() == ([0, 0] if changed & 1 else [5, 6])
    assert one.filter.smoothing == 0


@pytest.mark.parametrize("method", [0, 1])
@pytest.mark.parametrize("mounted", [0, 2])
def test_mounts_in_use_are_forgotten_and_told_and_those_that_are_not_are_left(
    monkeypatch: pytest.MonkeyPatch, method: int, mounted: int
) -> None:
    told: list[Any] = []
    for name in ("refuse_alignment", "add_axes", "queue_event", "realign_filter"):
        monkeypatch.setattr(blocks, name, lambda *given, name=name: told.append((name, *given[1:])))
    one = node(aligner=SimpleNamespace(method=method))
    one.mount.method = mounted
    settings = SimpleNamespace(imus=2)
    blocks.forget_mount(one, settings)
    expected: list[Any] = [("refuse_alignment", 14, 0, blocks.NONE, blocks.NONE)] if method else []
    if mounted:
        event = ("queue_event", int(Code.ALIGNMENT_DROPPED), 14 << 24, *[blocks.NONE] * 3)
        expected += [("add_axes", settings, 0), event, ("realign_filter", settings)]
        assert one.mount.method == 0
        assert one.mount.axis.tolist() == [[0, 0, ONE]] * 2
        assert not one.mount.std.any()
    else:
        assert (one.mount.axis == 9).all()
    assert told == expected


def test_a_raw_reading_is_the_matrix_times_the_corrected_one_and_the_bias() -> None:
    """M = [[1, 1/2, 0], [0, 1, 1/4], [1/8, 0, 1]] at 25 C, of which the first grows by 1/8 to 89 C: half of a slope."""
    one = sensor(scaled(1, 0.5, 0, 0, 1, 0.25, 0.125, 0, 1), (16, 32, 64))
    one.matrix[1, 0, 0] = ONE >> 2
    one.bias[1, 2] = 8
    reading = [1 << 20, 1 << 21, 1 << 22]
    blocks.restore_raw(one, USUAL + 64 * KELVIN, reading)
    assert reading == [
        (1 << 20) + (1 << 17) + (1 << 20) + 16, (1 << 21) + (1 << 20) + 32, (1 << 17) + (1 << 22) + 64 + 4,
    ]  # fmt: skip
