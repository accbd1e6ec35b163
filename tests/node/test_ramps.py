"""What a ramp may leave unexplained: told from noise, kept in doubt, and halved by every ramp that fits."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from node.kernels.arithmetic.formats import PERIOD
from node.kernels.record.filter_record import RING, Err, default_config
from node.kernels.record.node_record import AIDINGS, MISMATCH, new_node
from node.kernels.turns.aiding_watch import AT_ONCE, AT_REST, STARTING, find_mismatch, reset_aiding_watch
from node.kernels.turns.ramps import LONGEST, REACH, follow_fit, follow_ramp, is_starting
from node.kernels.turns.ramps import STARTING as LONGEST_START

FASTEST = math.radians(71.0)
SIGMA = math.radians(0.02)


class Turning:
    """A node that is told nothing but rates and innovations."""

    def __init__(self) -> None:
        self.node: Any = new_node(default_config())[0]
        self.state, self.ramp = self.node["filter"], self.node["guard"]["ramp"]

    def cycle(self, rate: float, still: int = 0) -> None:
        k = int(self.state["cycles"])
        self.state["ring_rate"][k % RING, 2] = self.state["now_rate"] = rate
        self.state["ring_start"][k % RING], self.state["ring_end"][k % RING] = k * PERIOD, (k + 1) * PERIOD
        self.state["cycles"], self.state["still_cycles"] = k + 1, still
        follow_ramp(self.node)

    def aid(self, sigmas: float) -> None:
        self.state["innovation"], self.state["innovation_var"] = sigmas * SIGMA, SIGMA**2
        follow_fit(self.node, 0)

    def ramp_up(self, sigmas: list[float]) -> None:
        for k in range(3):
            self.cycle(0.0, still=k + 1)
        for k, of_sigma in enumerate(sigmas):
            self.cycle(FASTEST * min(k + 1, 4) / 4.0)
            self.aid(of_sigma)


@given(st.integers(0, 10**6))
def test_a_ramp_in_honest_noise_leaves_no_doubt(seed: int) -> None:
    turning = Turning()
    for _ in range(4):
        turning.ramp_up(np.clip(0.85 * np.random.default_rng(seed).standard_normal(14), -3.5, 3.5).tolist())
    assert turning.ramp["doubt"] == 0.0 or turning.ramp["misfit"] > 36.0


def test_a_ramp_that_does_not_fit_is_in_doubt_and_every_one_that_does_halves_it() -> None:
    turning = Turning()
    turning.state["scale"] = 1e-4
    turning.cycle(0.0, still=1)
    known = float(turning.state["P"][Err.SCALE, Err.SCALE])
    turning.ramp_up([0.5, 3.0, 3.5, 3.0, 3.0, 0.2])
    assert turning.ramp["doubt"] == pytest.approx((3.5 * SIGMA) ** 2)
    assert turning.state["P"][Err.SCALE, Err.SCALE] == pytest.approx(known)
    doubts = []
    for _ in range(3):
        for _ in range(LONGEST + REACH):
            turning.cycle(FASTEST)
        turning.ramp_up([0.5, -1.0, 1.0, 0.3])
        doubts.append(float(turning.ramp["doubt"]))
    # a ramp is judged as the next begins, so the first of these ends the one that did not fit
    assert doubts == pytest.approx([(3.5 * SIGMA) ** 2 / 2**k for k in (0, 1, 2)])


@pytest.mark.parametrize(
    ("sigmas", "rate", "still", "sequence", "doubted"),
    [
        (1.9, 0.0, 3, 7, False),
        (-2.5, 0.0, 3, 7, True),
        (2.5, 0.1, 3, 7, False),  # the head turns
        (2.5, 0.0, 0, 7, False),  # the node does not stand yet
        (2.5, 0.0, 3, -1, False),  # the ramp has made its time worth little, it will be said again
    ],
)
def test_what_the_head_at_rest_contradicts_is_in_doubt(
    sigmas: float, rate: float, still: int, sequence: int, doubted: bool
) -> None:
    turning = Turning()
    turning.ramp_up([0.0] * 6)
    turning.cycle(0.0, still=still)
    turning.node["guard"]["rate"], turning.state["last_sequence"] = rate, sequence
    turning.state["systematic_var"] = 1e-6
    turning.aid(sigmas)
    wanted = (sigmas**2 - 1.0) * SIGMA**2 if doubted else 0.0
    assert turning.ramp["doubt"] == pytest.approx(wanted)
    assert turning.state["systematic_var"] == pytest.approx(1e-6 + wanted)
    turning.node["twist"]["known"], turning.node["twist"]["std"] = 1, 0.1
    turning.aid(9.0)  # a twist that is told has opened the yaw
    turning.node["twist"]["known"] = 0
    turning.aid(0.9 * sigmas)  # a smaller one is no further doubt
    assert turning.ramp["doubt"] == pytest.approx(wanted)
    assert turning.state["systematic_var"] == pytest.approx(1e-6 + wanted)


@pytest.mark.parametrize(("sigmas", "doubted"), [(1.9, False), (2.5, True), (-4.6, True)])
def test_a_turn_that_is_too_slow_for_a_ramp_is_judged_by_the_head_at_rest_too(sigmas: float, doubted: bool) -> None:
    """A head that is turned back by hand, minutes after its ramp: what slipped meanwhile shows in that one aiding."""
    turning = Turning()
    turning.ramp_up([0.0] * 6)
    for _ in range(LONGEST + REACH):
        turning.cycle(0.0, still=1)
    for _ in range(6):
        turning.cycle(math.radians(-2.0))
    turning.cycle(0.0, still=3)
    turning.node["guard"]["rate"], turning.state["last_sequence"] = 0.0, 7
    turning.aid(sigmas)
    wanted = (sigmas**2 - 1.0) * SIGMA**2 if doubted else 0.0
    assert turning.ramp["doubt"] == pytest.approx(wanted)
    assert turning.state["systematic_var"] == pytest.approx(wanted)


def test_what_the_ramp_taught_of_the_scale_is_forgotten() -> None:
    turning = Turning()
    for k in range(3):
        turning.cycle(0.0, still=k + 1)
    turning.state["scale"], turning.state["P"][Err.SCALE, Err.SCALE] = 5e-3, 1e-12
    for k in range(4):
        turning.cycle(FASTEST * (k + 1) / 4.0)
        turning.aid(4.0)
    assert turning.state["scale"] == 0.0
    assert turning.state["P"][Err.SCALE, Err.SCALE] == pytest.approx(1e-6)
    turning.node["guard"]["rate"] = FASTEST
    assert turning.ramp["cycles"] == 1  # of the four: a step is looked at as long as one of a string that starts
    for _ in range(LONGEST_START - 1):
        turning.cycle(FASTEST)
        assert is_starting(turning.node)
    turning.cycle(FASTEST)
    assert not is_starting(turning.node)


@pytest.mark.parametrize("back_deg", [5.0, 30.0])
def test_an_angle_turned_back_opens_the_yaw_by_the_asymmetry(back_deg: float) -> None:
    turning = Turning()
    turning.cycle(0.0, still=1)
    for _ in range(8):
        turning.cycle(FASTEST)
    before = float(turning.state["P"][Err.YAW, Err.YAW])
    for _ in range(8):
        turning.cycle(-math.radians(back_deg) / 8.0 / PERIOD)
    opened = math.sqrt(float(turning.state["P"][Err.YAW, Err.YAW]) - before)
    assert math.degrees(opened) == pytest.approx(2e-3 * back_deg, rel=1e-6)


@pytest.mark.parametrize(("patience", "size_dps", "wanted"), [
    (AT_ONCE, 1.0, 3), (STARTING, 1.0, 6), (AT_REST, 1.0, 7), (AT_REST, 0.4, 3), (STARTING, 6.0, 3),
])  # fmt: skip
def test_what_may_be_a_winding_string_is_looked_at_for_longer(patience: int, size_dps: float, wanted: int) -> None:
    watch, found = np.zeros(1, AIDINGS)[0], np.zeros(1, MISMATCH)[0]
    reset_aiding_watch(watch)
    innovation = 0.0
    seen = []
    for k in range(8):
        innovation += math.radians(size_dps) * PERIOD if k else 0.0
        find_mismatch(watch, found, innovation, 1e-4, 0.0, k * PERIOD, 1 if k else 0, 0, patience)
        seen.append(int(found["fault"]))
    assert next(k for k, fault in enumerate(seen) if fault) == wanted
