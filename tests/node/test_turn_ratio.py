"""An encoder of another number of lines, and drives, gyroscopes and ramps that only look like one for a while."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from node.kernels.arithmetic.formats import DEG, PERIOD
from node.kernels.filter.modes import STATIC_BIAS, TRACKING
from node.kernels.record.events import Code
from node.kernels.record.filter_record import default_config
from node.kernels.record.node_record import new_node
from node.kernels.turns.turn_ratio import ratio_var, watch_ratio
from node.kernels.turns.yaw_doubts import unexplained_var

LINES = 4096  # counts a turn, as a node takes them
UNKNOWN = math.pi / math.sqrt(3.0)  # rad, standard deviation of any yaw
SPEED = 71.0 * DEG


class Turning:
    """A node that is told nothing but rates: the encoder's, and its own."""

    def __init__(self, scale_std: float = 1e-3) -> None:
        config = default_config()
        config["scale_std"] = scale_std
        self.node: Any = new_node(config)[0]
        self.node["filter"]["mode"] = TRACKING
        self.at = 0.0

    def cycle(self, told: float, shown: float, age: float = 0.2) -> None:
        """One cycle in which the encoder tells of one rate and the gyroscope shows another (rad/s)."""
        self.at += PERIOD
        self.node["guard"]["rate"], self.node["guard"]["rate_at"] = told, self.at - age
        watch_ratio(self.node, shown, self.at)

    def cycles(self, count: int, told: float, shown: float, **more: float) -> Turning:
        """So many alike."""
        for _ in range(count):
            self.cycle(told, shown, **more)
        return self

    @property
    def std(self) -> float:
        """Standard deviation of the yaw by it, rad."""
        assert unexplained_var(self.node) == pytest.approx(ratio_var(self.node))
        return math.sqrt(ratio_var(self.node))

    @property
    def ratios(self) -> list[float]:
        """Ratios that were told."""
        events = self.node["events"]
        told = events["ring"][: int(events["told"])]
        return [float(one["numbers"][0]) for one in told if one["code"] == Code.ENCODER_RATIO]


@pytest.mark.parametrize("counts", [512, 1024, 2048, 2500, 3600, 4000, 5000, 8192, 10000])
@pytest.mark.parametrize("seed", [1, 2])
def test_another_number_of_lines_is_told_once_and_leaves_no_yaw(counts: int, seed: int) -> None:
    random, turning = np.random.default_rng(seed), Turning()
    for k in range(40):
        told, shown = SPEED * np.array([counts / LINES, 1.0]) + random.normal(0.0, 0.02 * DEG, 2)
        turning.cycle(told, shown)
        if k < 4:
            assert turning.std == 0.0, "a few cycles are a swing as well"
        if k >= 8:
            assert turning.std == pytest.approx(UNKNOWN), "while it is open, and once it is told"
    assert turning.ratios == pytest.approx([counts / LINES], rel=2e-3)
    assert turning.cycles(200, SPEED, SPEED).std == pytest.approx(UNKNOWN), "how far it turned meanwhile is not known"


def test_it_turns_either_way() -> None:
    assert Turning().cycles(20, -0.5 * SPEED, -SPEED).ratios == pytest.approx([0.5])


@pytest.mark.parametrize("sigmas", [-4.5, 4.5])
@pytest.mark.parametrize("scale_std", [1e-3, 1.5e-2])
def test_a_gyroscope_of_its_stated_scale_is_none(sigmas: float, scale_std: float) -> None:
    turning = Turning(scale_std).cycles(60, SPEED, SPEED * (1.0 + sigmas * scale_std))
    assert (turning.std, turning.ratios) == (0.0, [])


def test_a_gyroscope_out_of_the_box_leaves_room_for_its_scale_alone() -> None:
    assert not Turning(1.5e-2).cycles(30, SPEED * 4000 / LINES, SPEED).ratios
    assert Turning(1.5e-2).cycles(30, SPEED * 5000 / LINES, SPEED).ratios


def test_a_gyroscope_that_agreed_before_is_the_one_that_changed() -> None:
    turning = Turning().cycles(30, SPEED, SPEED).cycles(60, SPEED, 1.1 * SPEED)
    assert (turning.std, turning.ratios) == (0.0, [])


@pytest.mark.parametrize(
    "spoil",
    [
        pytest.param(lambda turning: turning.node["filter"].__setitem__("mode", STATIC_BIAS), id="no bias yet"),
        pytest.param(lambda turning: None, id="slow"),
    ],
)
def test_what_tells_no_ratio_is_not_looked_at(spoil: Callable[[Turning], None]) -> None:
    turning = Turning()
    spoil(turning)
    speed = SPEED if turning.node["filter"]["mode"] == STATIC_BIAS else 15.0 * DEG
    assert not turning.cycles(60, 0.5 * speed, speed).ratios


def test_an_encoder_that_is_not_heard_any_more_tells_none() -> None:
    assert not Turning().cycles(60, 0.5 * SPEED, SPEED, age=3.0 * PERIOD).ratios


def mean_rates(angle: Callable[[float], float], phase: float, count: int) -> list[tuple[float, float]]:
    """Mean rates (rad/s) over cycles, and over as long a time that ended ``phase`` cycles before."""

    def mean(end: float) -> float:
        return (angle(end) - angle(end - PERIOD)) / PERIOD

    return [(mean((k - phase) * PERIOD), mean(k * PERIOD)) for k in range(2, count)]


@given(st.floats(0.05, 1.0), st.floats(0.4, 12.0), st.floats(0.0, 1.0), st.floats(0.0, math.tau))
def test_a_drive_that_swings_is_none(share: float, period: float, phase: float, start: float) -> None:
    """Rate SPEED (1 - share cos): the two see it at different times, and near the cycle's own period as a slow beat."""
    turning, w = Turning(), math.tau / period

    def angle(t: float) -> float:
        return SPEED * (t - share / w * (math.sin(w * t + start) - math.sin(start)))

    for told, shown in mean_rates(angle, phase, 150):
        turning.cycle(told, shown)
    assert not turning.ratios


@given(st.floats(10.0, 80.0), st.floats(0.0, 1.0))
def test_a_ramp_is_none(dps2: float, phase: float) -> None:
    turning = Turning()

    def angle(t: float) -> float:
        top = SPEED / (dps2 * DEG)
        return 0.5 * dps2 * DEG * min(t, top) ** 2 + SPEED * max(t - top, 0.0)

    for told, shown in mean_rates(angle, phase, 20):
        turning.cycle(told, shown)
    assert not turning.ratios
