"""Which parameter blocks a node takes, which it tries at rest and which it never uses."""

import math
from dataclasses import replace

import numpy as np
import pytest

from node.firmware.block_trial import (
    DIFFER_CYCLES,
    STILL_CYCLES,
    Trial,
    TrialVerdict,
    record_of,
    recorrect_ring,
    refusal_reason,
    unfit_reason,
)
from node.kernels.arithmetic.formats import DEG
from node.kernels.filter.resets import forget_bias
from node.kernels.record.filter_record import Err, default_config, new_state
from node.kernels.sensors.correction import correct_cycle
from telemetry.messages import Matrix3
from telemetry.parameters import UNIT, ZERO, ParameterBlock, SensorParameters

IDENTITY = ParameterBlock(3, 0)
REST = ((0.0, 0.0, 0.0), (0.0, 0.3, -9.8), 25.0)
SLOPE: Matrix3 = ((0.0, 0.0, 0.01), ZERO, ZERO)


def diagonal(value: float) -> Matrix3:
    return ((value, 0.0, 0.0), (0.0, value, 0.0), (0.0, 0.0, value))


def with_gyroscope(**change: object) -> ParameterBlock:
    return ParameterBlock(3, 1, replace(SensorParameters(), **change))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("block", "reason"),
    [
        (ParameterBlock(4, 1), "tube"),
        (ParameterBlock(3, 0), "version"),
        (with_gyroscope(bias=(0.0, math.nan, 0.0)), "finite"),
        (with_gyroscope(matrix=(UNIT[0], UNIT[1], (0.0, 0.0, math.inf))), "finite"),
        (with_gyroscope(reference=math.nan), "finite"),
        (with_gyroscope(reference=300.0), "reference"),
        (with_gyroscope(matrix=(UNIT[0], UNIT[0], UNIT[2])), "condition"),
        (with_gyroscope(matrix=(UNIT[1], UNIT[0], UNIT[2])), "right-handed"),
        (with_gyroscope(matrix=diagonal(0.0)), "condition"),
        (with_gyroscope(matrix=diagonal(1.21)), "within 0.2"),
        (with_gyroscope(matrix=diagonal(9.81)), "within 0.2"),
        (with_gyroscope(bias=(0.0, 0.0, 21.0 * DEG)), "bias"),
        (with_gyroscope(bias_slopes=SLOPE), "bias"),
        (with_gyroscope(matrix_slopes=(diagonal(3e-3), diagonal(0.0), diagonal(0.0))), "drifts"),
        (ParameterBlock(3, 1, accelerometer=SensorParameters(bias=(2.1, 0.0, 0.0))), "accelerometer: expected a bias"),
    ],
)
def test_a_block_that_cannot_be_is_refused_by_name(block: ParameterBlock, reason: str) -> None:
    assert reason in refusal_reason(block, 3, IDENTITY)


def test_a_usual_block_is_tried() -> None:
    block = with_gyroscope(
        matrix=diagonal(0.99), bias=(0.0, 3.8 * DEG, 0.0), matrix_slopes=(diagonal(2e-4),) * 1 + (diagonal(0.0),) * 2
    )
    assert refusal_reason(block, 3, IDENTITY) == ""


def test_a_matrix_near_the_last_is_taken_and_read_again_after_a_restart() -> None:
    last = ParameterBlock(3, 4, SensorParameters(diagonal(1.15)))
    block = ParameterBlock(3, 5, SensorParameters(diagonal(1.3)))
    assert "within" in refusal_reason(replace(block), 3, IDENTITY)
    assert refusal_reason(block, 3, last) == ""
    assert unfit_reason(block, 3) == ""


@pytest.mark.parametrize("version", [0, 4, 5])
def test_only_a_newer_version_is_taken(version: int) -> None:
    assert "version" in refusal_reason(ParameterBlock(3, version), 3, ParameterBlock(3, 5))


def test_the_record_of_no_correction_is_the_identity() -> None:
    assert record_of(ParameterBlock(3, 7))[0]["identity"] == 1
    assert record_of(with_gyroscope(bias=(1e-9, 0.0, 0.0)))[0]["identity"] == 0


def test_a_trial_waits_for_rest_and_counts_anew_after_motion() -> None:
    trial = Trial(with_gyroscope(bias=(1e-4, 0.0, 0.0)), 9.81)
    for standing in (False, True, True, True, False, True, True, True):
        assert trial.judge_reading(*REST, standing=standing, quiet=standing) is TrialVerdict.WAIT
    assert trial.judge_reading(*REST, standing=True, quiet=True) is TrialVerdict.APPLY


def test_a_block_that_gives_a_node_at_rest_a_rate_is_refused() -> None:
    trial = Trial(with_gyroscope(bias=(3.0 * DEG, 0.0, 0.0)), 9.81)
    verdicts = [trial.judge_reading(*REST, standing=True, quiet=True) for _ in range(DIFFER_CYCLES)]
    assert verdicts == [TrialVerdict.WAIT] * (DIFFER_CYCLES - 1) + [TrialVerdict.REFUSE]
    assert "3 deg/s" in trial.reason


def test_a_block_that_makes_gravity_another_is_refused() -> None:
    trial = Trial(ParameterBlock(3, 1, accelerometer=SensorParameters(diagonal(1.1))), 9.81)
    verdicts = [trial.judge_reading(*REST, standing=True, quiet=True) for _ in range(DIFFER_CYCLES)]
    assert verdicts[-1] is TrialVerdict.REFUSE


def test_the_first_block_of_a_node_that_reads_a_rate_at_rest_is_applied() -> None:
    trial = Trial(with_gyroscope(bias=(0.0, 3.8 * DEG, 0.0)), 9.81)
    reading = ((0.0, 3.8 * DEG, 0.0), REST[1], 25.0)
    verdicts = [trial.judge_reading(*reading, standing=True, quiet=False) for _ in range(STILL_CYCLES)]
    assert verdicts[-1] is TrialVerdict.APPLY


def test_a_block_that_does_not_fit_a_node_of_unknown_bias_waits_for_ever() -> None:
    trial = Trial(with_gyroscope(bias=(0.0, -3.8 * DEG, 0.0)), 9.81)
    reading = ((0.0, 3.8 * DEG, 0.0), REST[1], 25.0)
    assert {trial.judge_reading(*reading, standing=True, quiet=False) for _ in range(100)} == {TrialVerdict.WAIT}


def test_a_reading_that_is_no_number_decides_nothing() -> None:
    trial = Trial(with_gyroscope(bias=(1e-4, 0.0, 0.0)), 9.81)
    reading = ((math.nan, 0.0, 0.0), REST[1], 25.0)
    assert {trial.judge_reading(*reading, standing=True, quiet=True) for _ in range(100)} == {TrialVerdict.WAIT}


def test_forgetting_the_bias_leaves_the_yaw() -> None:
    config = default_config()
    state = new_state(config)
    state[0]["static_bias"], state[0]["bias"], state[0]["scale"], state[0]["mode"] = 1e-3, 1e-4, 1e-3, 4
    state[0]["P"][Err.YAW, Err.YAW] = 1e-8
    state[0]["P"][Err.YAW, Err.BIAS_Z] = state[0]["P"][Err.BIAS_Z, Err.YAW] = 1e-9
    forget_bias(state[0], config[0])
    assert not np.any(state[0]["static_bias"])
    assert not np.any(state[0]["bias"])
    assert state[0]["mode"] == 1
    assert state[0]["P"][Err.YAW, Err.YAW] == 1e-8
    assert state[0]["P"][Err.YAW, Err.BIAS_Z] == 0.0
    assert state[0]["P"][Err.BIAS_Z, Err.BIAS_Z] == pytest.approx((0.05 * DEG) ** 2)


def test_what_waits_in_the_ring_is_read_by_the_new_block() -> None:
    before = with_gyroscope(matrix=diagonal(0.97), bias=(0.01, 0.0, 0.02), bias_slopes=((1e-3, 0.0, 0.0), ZERO, ZERO))
    after = replace(
        before,
        gyroscope=SensorParameters(((1.02, 0.01, 0.0), UNIT[1], UNIT[2]), (0.03, 0.0, 0.0)),
        accelerometer=SensorParameters(diagonal(1.01), (0.1, 0.0, 0.0)),
    )
    state = new_state(default_config())
    raw = np.random.default_rng(1).standard_normal((64, 6))
    expected = raw.copy()
    for k in range(64):
        correct_cycle(record_of(before)[0], 31.0, raw[k, :3], raw[k, 3:])
        correct_cycle(record_of(after)[0], 31.0, expected[k, :3], expected[k, 3:])
    state[0]["ring_rate"], state[0]["ring_force"] = raw[:, :3], raw[:, 3:]
    recorrect_ring(state[0], before, after, 31.0)
    np.testing.assert_allclose(state[0]["ring_rate"], expected[:, :3], atol=1e-12)
    np.testing.assert_allclose(state[0]["ring_force"], expected[:, 3:], atol=1e-12)
