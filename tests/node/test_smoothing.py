"""The yaw of a survey by what comes after it: against a filter with one state more, and over turns and rests."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from string_of_one import Sample, StringOfOne

from node.kernels.arithmetic.angles import from_binary, wrap_angle
from node.kernels.arithmetic.formats import PERIOD
from node.kernels.filter.covariance import set_apart
from node.kernels.filter.float64.propagation import propagate_covariance
from node.kernels.filter.float64.update import correct_states, innovation_var
from node.kernels.filter.revision import follow_revision, open_revision
from node.kernels.filter.smoothing import begin_smoothing, propagate_survey_covariance
from node.kernels.record.filter_record import STATES, CycleStatus, Err, default_config, new_state
from node.kernels.record.node_record import SETTINGS, new_node
from sim.string.result import StringSurvey
from sim.studies.scenarios import on_off

OUTAGES = {"aiding": on_off(20.0, 60.0)}
PSI = int(Err.YAW)


def transition(wz: float, dt: float, config: np.void) -> np.ndarray:
    """F of the error model, written out. Source: thesis eqs. 3.22-3.28."""
    f = np.eye(STATES)
    c, s = math.cos(wz * dt), math.sin(wz * dt)
    f[:2, :2] = [[c, s], [-s, c]]
    f[Err.TILT_X, Err.BIAS_X] = f[Err.TILT_Y, Err.BIAS_Y] = f[PSI, Err.BIAS_Z] = -dt
    f[PSI, Err.SCALE] = -wz * dt
    for axis in range(3):
        f[Err.BIAS_X + axis, Err.BIAS_X + axis] = math.exp(-dt / config["bias_tau"][axis])
    return f


@given(st.integers(0, 10**6))
def test_it_is_a_filter_with_one_state_more(seed: int) -> None:
    random, config = np.random.default_rng(seed), default_config()
    for name in ("gyro_noise", "bias_std", "still_walk", "stamp_walk"):
        config[0][name] = 0.0
    state = new_state(config)[0]
    root = random.normal(0.0, 1.0, (STATES, STATES))
    state["P"], state["yaw_known"] = 1e-4 * (root @ root.T + np.eye(STATES)), 1
    begin_smoothing(state)
    whole = np.zeros((STATES + 1, STATES + 1))
    whole[:STATES, :STATES], whole[STATES, STATES] = state["P"], state["P"][PSI, PSI]
    whole[STATES, :STATES] = whole[:STATES, STATES] = state["P"][PSI]
    moved = 0.0
    for _ in range(6):
        wz, step = float(random.uniform(-1.3, 1.3)), np.eye(STATES + 1)
        step[:STATES, :STATES] = transition(wz, PERIOD, config[0])
        whole = step @ whole @ step.T
        propagate_covariance(state["P"], wz, PERIOD, 1.0, config[0])
        propagate_survey_covariance(state, wz, PERIOD, 1.0, config[0])
        row = np.append(random.normal(0.0, 1.0, STATES), 0.0)
        variance, residual = float(random.uniform(1e-5, 1e-3)), float(random.normal(0.0, 1e-3))
        spread = row @ whole @ row + variance
        gain = whole @ row / spread
        whole -= spread * np.outer(gain, gain)
        moved += gain[STATES] * residual
        state["h"] = row[:STATES]
        correct_states(state, innovation_var(state["P"], state["h"], variance, state["ph"]), residual)
    assert state["surveyed_var"] == pytest.approx(whole[STATES, STATES], rel=1e-6)
    assert state["surveyed_with"] == pytest.approx(whole[STATES, :STATES], rel=1e-6, abs=1e-12)
    assert wrap_angle(from_binary(state["surveyed_yaw"])) == pytest.approx(moved, abs=1e-8)


@pytest.mark.parametrize("error", list(Err))
def test_a_reset_leaves_no_covariance_with_the_survey(error: Err) -> None:
    state = new_state(default_config())[0]
    state["P"], state["yaw_known"] = 1e-4 * (np.ones((STATES, STATES)) + np.eye(STATES)), 1
    begin_smoothing(state)
    set_apart(state, error, 1.0)
    assert state["surveyed_with"][error] == 0.0
    assert np.count_nonzero(state["surveyed_with"]) == STATES - 1


def last_words(string: StringOfOne) -> list[tuple[StringSurvey, StringSurvey]]:
    """Every survey that was said again, as it was said first and last."""
    run = string.string.run
    last = {revision.cycle: revision for revision in run.revisions}
    return [(first, last[first.cycle]) for first in run.surveys if first.cycle in last]


def test_a_survey_without_aiding_is_said_again_when_it_is_known_better() -> None:
    errors = []
    for seed in range(12):
        string = StringOfOne(seed, **OUTAGES).run()
        for first, revised in last_words(string):
            one, again = first.measurement, revised.measurement
            assert (again.tube, again.station_at, again.imus) == (one.tube, one.station_at, one.imus)
            assert again.sequence > one.sequence
            assert again.yaw_var < 0.8 * one.yaw_var
            errors.append((first.error, one.yaw_var, revised.error, again.yaw_var))
    before, var_before, after, var_after = np.array(errors).T
    assert len(errors) >= 20  # two of three surveys have turning after them
    assert np.mean(after**2) < 0.25 * np.mean(before**2)
    for error, var in ((before, var_before), (after, var_after)):
        assert 0.4 < np.mean(error**2 / var) < 1.8
        assert np.max(np.abs(error) / np.sqrt(var)) < 4.0


def test_a_last_survey_has_nothing_after_it() -> None:
    string = StringOfOne(1, blocks=1, aiding=on_off(1.0, 1000.0)).run()
    assert len(string.string.run.surveys) == 1
    assert not string.string.run.revisions


def test_a_gyroscope_that_steps_after_a_survey_says_nothing_of_it() -> None:
    seed = 3
    whole = StringOfOne(seed).run()
    first, *_ = [first.cycle for first, _ in last_words(whole)]
    stepped = whole.turning(1, 0.01)
    assert first < stepped

    def spoil(cycle: int, sample: Sample) -> Sample:
        return [*sample[:2], sample[2] + math.radians(2.0) * (cycle >= stepped), *sample[3:]]

    spoiled = StringOfOne(seed, spoil).run()
    assert "gyro_step" in spoiled.codes()
    assert first not in [revision.cycle for revision in spoiled.string.run.revisions]


def test_integers_say_the_same() -> None:
    floats, integers = (StringOfOne(5, node={"kernel": kernel}, **OUTAGES).run() for kernel in ("float64", "fixed"))
    said = [last_words(string) for string in (floats, integers)]
    assert len(said[0]) == len(said[1]) > 0
    for (_, one), (_, other) in zip(*said, strict=True):
        assert wrap_angle(other.measurement.yaw - one.measurement.yaw) == pytest.approx(0.0, abs=math.radians(1e-3))
        assert other.measurement.yaw_var == pytest.approx(one.measurement.yaw_var, rel=1e-2)


class Surveyed:
    """A node that has just surveyed, with a yaw of the variance 1."""

    def __init__(self) -> None:
        self.settings = np.zeros(1, SETTINGS)
        self.node = new_node(default_config())[0]
        self.state = self.node["filter"]
        self.state["P"][PSI, PSI] = self.state["now_P"][PSI, PSI] = 1.0
        self.state["yaw_known"], self.state["still_cycles"] = 1, 40
        open_revision(self.node, self.settings[0])

    def follows(self, var: float, status: CycleStatus = CycleStatus.NONE) -> bool:
        self.state["surveyed_var"] = var
        return bool(follow_revision(self.node, int(status)))


def test_half_of_the_variance_is_worth_a_message_and_then_half_of_that() -> None:
    surveyed = Surveyed()
    said = [surveyed.follows(var) for var in (1.0, 0.6, 0.49, 0.4, 0.3, 0.24, 0.2)]
    assert said == [False, False, True, False, False, True, False]


@pytest.mark.parametrize("status", [CycleStatus.YAW_RESET, CycleStatus.FILTER_FAULT])
def test_what_contradicts_the_yaw_ends_it(status: CycleStatus) -> None:
    surveyed = Surveyed()
    assert not surveyed.follows(0.1, status)
    assert not surveyed.follows(0.1)


def test_another_reference_is_the_last_word() -> None:
    surveyed = Surveyed()
    assert surveyed.follows(0.7, CycleStatus.REFERENCE_CHANGED)
    assert not surveyed.follows(0.1)


def test_a_ramp_is_to_be_over() -> None:
    surveyed = Surveyed()
    surveyed.node["guard"]["ramp"]["left"], surveyed.state["still_cycles"] = 3, 0
    assert not surveyed.follows(0.1)
    surveyed.node["guard"]["ramp"]["left"] = 0
    assert surveyed.follows(0.1)


def test_a_twist_that_came_since_counts() -> None:
    surveyed = Surveyed()
    surveyed.state["systematic_var"] = 1.0
    assert not surveyed.follows(0.1)
    surveyed.state["systematic_var"] = 0.5
    assert surveyed.follows(0.1)
    assert surveyed.node["revision"]["systematic"] == 0.5


def test_what_the_same_rest_contradicts_is_held_against_neither() -> None:
    surveyed = Surveyed()
    surveyed.state["systematic_var"] = surveyed.node["guard"]["ramp"]["doubt"] = 4.0
    assert surveyed.follows(0.4)
    assert surveyed.node["revision"]["systematic"] == 4.0
    surveyed = Surveyed()
    surveyed.state["still_cycles"] = 0  # the string turns: the doubt may be of what came since
    surveyed.state["systematic_var"] = surveyed.node["guard"]["ramp"]["doubt"] = 4.0
    assert not surveyed.follows(0.4)


def test_only_the_encoders_measurement_is_smoothed() -> None:
    surveyed = Surveyed()
    surveyed.settings["scheme"] = 1
    open_revision(surveyed.node, surveyed.settings[0])
    assert not surveyed.follows(0.1)
