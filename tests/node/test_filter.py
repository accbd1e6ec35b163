"""The whole cycle on motion whose truth is known."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from node.kernels.arithmetic.angles import from_binary, wrap_angle
from node.kernels.arithmetic.formats import DEG, PERIOD
from node.kernels.filter.float64.cycle import run_cycle
from node.kernels.filter.float64.fixed_lag import mean_spin
from node.kernels.record.filter_record import CycleStatus, Err, default_config, new_state
from node.kernels.record.ring import push_increments
from node.kernels.string.relay import offer_aiding
from telemetry.messages import NodeMode

START = 1000.0
TILT = math.radians(2.0)
SPIN = math.radians(71.0)


class Bench:
    """One node on a turning table without sensor noise; truth is ``yaw``."""

    def __init__(self, bias_z: float = 0.0, scale: float = 0.0) -> None:
        self.config = default_config()
        self.state = new_state(self.config)
        self.now = START
        self.yaw = 1.0
        self.bias_z, self.scale = bias_z, scale
        self.sequence = 0

    @property
    def record(self) -> np.void:
        return self.state[0]

    def cycle(self, rate: float = 0.0, joined: int = 1) -> CycleStatus:
        end = self.now + PERIOD
        middle = self.yaw + 0.5 * rate * PERIOD
        force = 9.81 * np.array(
            [math.sin(TILT) * math.cos(-middle), math.sin(TILT) * math.sin(-middle), -math.cos(TILT)]
        )
        measured = np.array([0.0, 0.0, rate * (1.0 + self.scale) + self.bias_z])
        status = run_cycle(self.record, self.config[0], measured, force, self.now, end, joined)
        self.now = end
        self.yaw += rate * PERIOD
        return CycleStatus(status)

    def aid(
        self, rate: float = 0.0, age: float = 0.0, *, stamp_error: float = 0.0, fresh: bool = True, offset: float = 0.0
    ) -> None:
        self.sequence += fresh
        offer_aiding(
            self.record,
            self.config[0],
            self.yaw - offset - rate * age,
            (0.003 * DEG) ** 2,
            0.0,
            offset,
            self.now - age + stamp_error,
            self.sequence,
            0,
        )

    def error_deg(self) -> float:
        return wrap_angle(from_binary(self.record["now_yaw"]) - self.yaw) / DEG

    def stand(self, cycles: int, *, aided: bool = True) -> None:
        for _ in range(cycles):
            self.cycle()
            if aided:
                self.aid(fresh=self.sequence == 0)

    def spin(self, cycles: int, **aiding: float) -> None:
        for _ in range(cycles):
            self.cycle(SPIN)
            self.aid(SPIN, **aiding)


def test_static_bias_is_learned_in_fifty_seconds_and_then_yaw_stands() -> None:
    bench = Bench(bias_z=-0.02 * DEG)
    statuses = []
    for _ in range(96):
        statuses.append(bench.cycle())
    assert CycleStatus.BIAS_KNOWN in statuses[94]
    assert bench.record["static_bias"][2] == pytest.approx(-0.02 * DEG)
    assert bench.record["mode"] in (NodeMode.TRACKING, NodeMode.STILL)
    assert bench.record["static_bias_var"][2] > 0.0


def test_first_aiding_sets_the_yaw() -> None:
    bench = Bench()
    bench.stand(4)
    assert bench.error_deg() == pytest.approx(0.0, abs=1e-3)


@pytest.mark.parametrize("delay", [0.0, 0.01, 0.1, 0.4, 0.9])
def test_delayed_aiding_counts_at_its_time_of_validity(delay: float) -> None:
    bench = Bench()
    bench.stand(110)
    bench.spin(60, age=delay)
    assert abs(bench.error_deg()) < 0.04
    assert bench.record["last_aided"] == pytest.approx(bench.now - PERIOD - delay, abs=PERIOD + 1e-6)


def test_taking_a_delayed_aiding_at_its_arrival_costs_the_turn_of_the_delay() -> None:
    bench = Bench()
    bench.config[0]["stamp_std"] = 0.0
    bench.stand(110)
    bench.spin(60, age=0.1, stamp_error=0.1)
    assert abs(bench.error_deg()) == pytest.approx(7.1, abs=0.5)


def test_scale_factor_and_bias_are_found() -> None:
    bench = Bench(bias_z=0.01 * DEG, scale=1e-3)
    bench.stand(110)
    for _ in range(3):
        bench.spin(190)
        bench.stand(60)
    assert bench.record["scale"] == pytest.approx(1e-3, abs=2e-4)
    assert abs(bench.error_deg()) < 0.02


def test_a_constant_stamp_error_is_found_while_the_string_starts_and_stops() -> None:
    bench = Bench()
    bench.stand(110)
    for _ in range(3):
        bench.spin(190, stamp_error=0.002)
        bench.stand(60)
    assert abs(bench.error_deg()) < 0.02


def test_an_outage_is_bridged_and_its_age_known() -> None:
    bench = Bench(scale=5e-4)
    bench.stand(110)
    bench.spin(190)
    for _ in range(57):
        bench.cycle(SPIN)
    sigma = math.sqrt(bench.record["now_P"][Err.YAW, Err.YAW]) / DEG
    assert abs(bench.error_deg()) < 3.0 * sigma < 3.0
    assert bench.now - bench.record["last_aided"] > 29.0


def test_a_wrong_aiding_is_refused_and_a_lasting_one_believed() -> None:
    bench = Bench()
    bench.stand(110)
    bench.spin(60)
    bench.yaw += 0.5
    bench.aid(SPIN)
    bench.yaw -= 0.5
    assert CycleStatus.REJECTED in bench.cycle(SPIN) | bench.cycle(SPIN)
    assert abs(bench.error_deg()) < 0.1
    bench.yaw += 0.5
    seen = CycleStatus.NONE
    for _ in range(8):
        seen |= bench.cycle(SPIN)
        bench.aid(SPIN)
    assert CycleStatus.YAW_RESET in seen
    bench.spin(10)
    assert abs(bench.error_deg()) < 0.2


def test_a_repeated_measurement_at_rest_is_used_once() -> None:
    bench = Bench()
    bench.stand(110)
    before = bench.record["P"][Err.YAW, Err.YAW]
    bench.stand(200)
    assert bench.record["P"][Err.YAW, Err.YAW] >= before
    assert bench.now - bench.record["last_aided"] < 1.1


def test_a_measurement_that_waits_twice_is_used_once() -> None:
    """Until one at rest has been used in full its repetitions are let in, and several may wait together."""
    left = []
    for copies in (1, 3):
        bench = Bench()
        bench.stand(110)
        for matrix in ("P", "now_P"):
            bench.record[matrix][Err.YAW, Err.YAW] += (0.02 * DEG) ** 2
        for _ in range(copies):
            bench.record["last_sequence"] = -1
            bench.aid(fresh=False, age=0.1)
        assert bench.record["pending"] == copies
        bench.stand(4, aided=False)
        assert bench.record["pending"] == 0
        left.append(bench.record["P"].copy())
    assert np.array_equal(*left)


def test_a_new_joint_above_reopens_the_yaw_without_a_false_alarm() -> None:
    bench = Bench()
    bench.stand(110)
    joint_std = 0.05 * DEG
    offer_aiding(
        bench.record, bench.config[0], bench.yaw - 0.3 + 0.1 * DEG, 1e-9, 2 * joint_std**2, 0.3, bench.now, 99, 1
    )
    seen = bench.cycle() | bench.cycle() | bench.cycle()
    assert CycleStatus.REJECTED not in seen
    assert bench.error_deg() == pytest.approx(0.1, abs=0.02)


def test_too_fast_a_string_is_flagged_and_never_aliased() -> None:
    bench = Bench()
    bench.stand(110)
    assert CycleStatus.RATE_EXCEEDED in bench.cycle(2.0 * math.pi * 0.96)
    assert bench.record["yaw_known"] == 0
    bench.cycle(SPIN)
    bench.spin(4)
    assert bench.record["yaw_known"] == 1
    assert abs(bench.error_deg()) < 0.5


def test_a_stop_gives_one_survey_after_the_moving_average_has_settled() -> None:
    bench = Bench()
    bench.stand(110)
    bench.spin(30)
    ready = []
    for k in range(80):
        if CycleStatus.SURVEY_READY in bench.cycle():
            ready.append(k)
        bench.aid(fresh=k == 0)
    assert ready == [int(bench.config[0]["settle_cycles"]) - 1]
    expected = 9.81 * np.array(
        [math.sin(TILT) * math.cos(bench.yaw), -math.sin(TILT) * math.sin(bench.yaw), -math.cos(TILT)]
    )
    np.testing.assert_allclose(bench.record["survey_force"], expected, atol=1e-9)


def test_while_the_joint_is_open_the_node_holds_its_yaw() -> None:
    bench = Bench(bias_z=0.01 * DEG)
    bench.stand(110)
    held = [bench.cycle(joined=0) for _ in range(200)]
    assert [CycleStatus.JOINT_OPENED in status for status in held] == [True] + [False] * 199
    assert bench.record["mode"] == NodeMode.HELD
    assert abs(bench.error_deg()) < 0.01
    assert CycleStatus.JOINT_CLOSED in bench.cycle()
    assert bench.record["mode"] == NodeMode.STILL


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_a_sample_that_is_no_number_changes_nothing(bad: float) -> None:
    bench = Bench()
    bench.stand(10)
    before = bench.state.tobytes()
    status = run_cycle(
        bench.record, bench.config[0], np.array([0, 0, bad]), np.zeros(3), bench.now, bench.now + PERIOD, 1
    )
    assert CycleStatus(status) == CycleStatus.BAD_SAMPLE
    assert bench.state.tobytes() == before


def ramp(rates: list[float]) -> np.void:
    """State of a node that read the mean spins ``rates`` (rad/s)."""
    state = new_state(default_config())[0]
    for k, rate in enumerate(rates):
        push_increments(state, START + k * PERIOD, START + (k + 1) * PERIOD, np.array([0.0, 0.0, rate]), np.zeros(3), 0)
    return state


@given(st.floats(-2.0, 2.0), st.floats(-1.0, 1.0), st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_inside_a_cycle_the_spin_is_that_of_a_ramp(begin_rate: float, slope: float, a: float, b: float) -> None:
    state = ramp([begin_rate + slope * (k + 0.5) * PERIOD for k in range(3)])
    begin, end = START + (1.0 + min(a, b)) * PERIOD, START + (1.0 + max(a, b)) * PERIOD
    expected = begin_rate + slope * (0.5 * (begin + end) - START)
    assert mean_spin(state, 1, begin, end) == pytest.approx(expected, abs=1e-9)


@given(st.lists(st.floats(-2.0, 2.0), min_size=3, max_size=3), st.floats(0.0, 1.0))
def test_the_parts_of_a_cycle_turn_as_far_as_the_whole(rates: list[float], part: float) -> None:
    state = ramp(rates)
    begin, end = START + PERIOD, START + 2.0 * PERIOD
    middle = begin + part * PERIOD
    parts = mean_spin(state, 1, begin, middle) * (middle - begin) + mean_spin(state, 1, middle, end) * (end - middle)
    assert parts == pytest.approx(rates[1] * PERIOD, abs=1e-9)


def test_a_clock_error_is_found_and_taken_off_where_it_acts() -> None:
    for error in (-0.03, 0.004, 0.03):
        bench = Bench()
        bench.config[0]["stamp_std"] = 0.02
        bench.state["P"][0, Err.STAMP, Err.STAMP] = 0.02**2
        bench.stand(110)
        for k in range(6):
            bench.cycle(SPIN * (k + 0.5) / 6.0)  # a ramp: the spin at the time of validity is not the cycle's mean
            bench.aid(SPIN * (k + 1.0) / 6.0, stamp_error=error)
        bench.spin(60, stamp_error=error)
        assert bench.record["stamp"] == pytest.approx(-error, abs=2e-4)
        assert abs(bench.error_deg()) < 0.02


def test_an_aiding_that_came_too_late_is_judged_when_it_is_repeated() -> None:
    """A clock that was put wrong for a moment dates it before all that is known; the encoder at rest says it again."""
    bench = Bench()
    bench.stand(40)
    bench.yaw += 10.0 * DEG  # the encoder slips
    bench.aid(age=60.0)
    dropped = CycleStatus.NONE
    for _ in range(3):
        dropped |= bench.cycle()
    assert dropped & CycleStatus.LATE_DROPPED
    assert bench.error_deg() == pytest.approx(-10.0, abs=0.1)
    for _ in range(12):
        bench.aid(fresh=False)
        bench.cycle()
    assert bench.error_deg() == pytest.approx(0.0, abs=0.05)
