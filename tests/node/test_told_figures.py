"""Figures that a node tells, by closed forms with parts that differ and none of which is zero."""

from __future__ import annotations

import math

import numpy as np
import pytest

from node.firmware.block_trial import model_at, recorrect_ring
from node.firmware.inputs import ImuReading, RigContext
from node.firmware.saved_state import resume_node
from node.firmware.sensor_limits import SensorLimits
from node.firmware.silent_tubes import aiding_across_silent
from node.firmware.tube import Tube
from node.firmware.tube_settings import MakeUpAngle, PassedTube, TubeSettings
from node.kernels.arithmetic.angles import to_binary
from node.kernels.arithmetic.formats import DEG, PERIOD
from node.kernels.record.filter_record import Scheme, default_config
from node.kernels.record.node_record import new_node
from telemetry.messages import Aiding, NodeFlag, NodeState, StaticRecord
from telemetry.parameters import ParameterBlock, SensorParameters

MOUNT, BELOW = 3e-3, 2e-3  # rad
AROUND = RigContext(True, 2, 5000.0, 1e-8, True, epoch=4)
UNDATED = RigContext(True, 2, 5000.0, 1e-8, False, epoch=4)


def tube(scheme: Scheme = Scheme.FORWARD) -> Tube:
    config = default_config()
    settings = TubeSettings(
        3, MakeUpAngle(0.5, 1e-3), MakeUpAngle(-0.2, BELOW), mount_std=MOUNT, scheme=scheme,
        limits=SensorLimits(repeats_together=0, repeats_alone=0),
    )  # fmt: skip
    return Tube(settings, config, new_node(config), iter(range(1, 10**6)).__next__, restored=False)


@pytest.mark.parametrize("times", [1, 2])
def test_a_revised_survey_has_the_yaw_of_then_and_everything_that_is_constant(times: int) -> None:
    one = tube()
    one.state["systematic_var"], one.state["yaw_known"] = 7e-6, 1
    first = one.reporter.survey(1000.0, AROUND)
    assert first.systematic_var == pytest.approx(7e-6 + MOUNT**2, rel=1e-12)
    one.state["now_P"][2, 2], one.state["now_yaw"] = 9e-4, to_binary(2.5)
    for revision in range(1, 1 + times):
        one.state["surveyed_yaw"], one.state["surveyed_var"] = to_binary(0.4 * revision), 2e-7 * revision
        one.node["revision"]["systematic"] = 5e-6 * revision
        revised = one.reporter.revised_survey(1060.0, AROUND)
        assert revised is not None
        assert revised.yaw == pytest.approx(0.4 * revision, abs=1e-9)
        assert revised.yaw_var == pytest.approx(max(2e-7 * revision, (1e-3 * DEG) ** 2), rel=1e-12)
        assert revised.systematic_var == pytest.approx(5e-6 * revision + MOUNT**2, rel=1e-12)
        assert (revised.station_at, revised.imus, revised.samples) == (first.station_at, first.imus, first.samples)
        assert revised.sequence == first.sequence + revision


@pytest.mark.parametrize("then", [AROUND, UNDATED])
@pytest.mark.parametrize("now", [AROUND, UNDATED])
def test_a_revised_survey_is_dated_as_it_was_when_it_was_made(then: RigContext, now: RigContext) -> None:
    one = tube()
    one.reporter.survey(1000.0, then)
    for _ in range(2):
        revised = one.reporter.revised_survey(1060.0, now)
        assert revised is not None
        assert (NodeFlag.CLOCK_UNSYNCHRONISED in revised.flags) == (not then.synchronised)


def test_a_state_tells_the_sum_of_both_parts_of_the_bias_and_all_constant_errors() -> None:
    one = tube()
    one.state["static_bias"], one.state["bias"] = (1e-3, -2e-3, 3e-3), (1e-5, 4e-5, -2e-5)
    one.state["systematic_var"] = 7e-6
    state = one.reporter.report(1000.0, AROUND, (1, bytes(8)))
    assert state.gyro_bias == pytest.approx((1.01e-3, -1.96e-3, 2.98e-3), rel=1e-12)
    assert state.systematic_var == pytest.approx(7e-6 + MOUNT**2, rel=1e-12)


def test_an_estimate_has_the_joint_below_and_its_twist_apart() -> None:
    one = tube(Scheme.ESTIMATE)
    one.state["systematic_var"] = 7e-6
    assert one.reporter.estimate(AROUND).systematic_var == pytest.approx(7e-6 + BELOW**2, rel=1e-12)
    twist = one.node["twist"]
    twist["torque"], twist["holding"] = 400.0, 1
    twist["std"], twist["known"] = 1.5e-3, 1
    told = one._of_estimate(one.reporter.estimate(AROUND))
    assert told.systematic_var + told.torsion_var == pytest.approx(7e-6 + BELOW**2, rel=1e-9)
    assert told.torsion_var == pytest.approx(2.25e-6, rel=1e-9)


def test_aiding_over_silent_tubes_adds_each_joint_once_and_the_drives_at_the_top() -> None:
    """By hand: lengths of the tubes' list are from the lowest up, the way of the aiding is from the top down."""
    lower = PassedTube(MakeUpAngle(0.30, 4e-3), MakeUpAngle(0.20, 1e-3))
    upper = PassedTube(MakeUpAngle(0.70, 5e-3), MakeUpAngle(0.11, 2e-3))
    for hops, angle, var in ((0, 0.70 + 0.11 + 0.20, 25e-6 + 4e-6 + 1e-6), (2, 0.11 + 0.20, 4e-6 + 1e-6)):
        aiding = Aiding(1.0, 1e-8, 3e-6, 0.05, 0.0, 1000.0, 5, hops)
        found = aiding_across_silent(aiding, [lower, upper], 2e4)
        assert found.offset == pytest.approx(0.05 + angle, abs=1e-12)
        assert found.systematic_var == pytest.approx(3e-6 + var, rel=1e-9)
        assert found.hops == hops + 2


def test_a_static_record_is_mean_and_sample_covariance_of_what_was_read() -> None:
    one, random = tube(), np.random.default_rng(3)
    sizes = np.array([1e-4, 2e-4, 3e-4, 1e-3, 2e-3, 4e-3])
    mixed = np.eye(6) + 0.3 * np.tri(6, k=-1)
    now, taken, record = 1000.0, [], None
    for k in range(200):
        now += PERIOD
        sample = mixed @ (sizes * random.standard_normal(6)) + np.array([0.0, 0.0, 0.0, 0.1, 0.2, -9.8])
        if k == 120:
            assert one.start_record(12.0, 7) == ""
        around = RigContext(True, 1, now + 77.0, 1e-8, True)
        said = one.on_cycle(ImuReading(now - PERIOD, now, tuple(sample[:3]), tuple(sample[3:])), around)
        if k >= 120 and record is None:
            taken.append(sample)
            record = next((message for message in said if isinstance(message, StaticRecord)), None)
    assert record is not None
    cov = np.cov(np.array(taken), rowvar=False)  # over n - 1
    assert record.samples == len(taken)
    np.testing.assert_allclose((*record.rate, *record.force), np.mean(taken, axis=0), rtol=1e-9)
    np.testing.assert_allclose(record.rate_cov, cov[:3, :3], rtol=1e-6)
    np.testing.assert_allclose(record.force_cov, cov[3:, 3:], rtol=1e-6)
    assert record.ended_at - record.begun_at == pytest.approx(len(taken) * PERIOD)
    assert record.ended_at == pytest.approx(1000.0 + (120 + len(taken)) * PERIOD + 77.0)


def sensor(seed: int) -> SensorParameters:
    """A model none of whose numbers is zero, and none like another."""
    random = np.random.default_rng(seed)

    def rows(scale: float) -> tuple[tuple[float, float, float], ...]:
        return tuple(map(tuple, (scale * random.uniform(0.3, 1.0, (3, 3))).tolist()))

    matrix = tuple(map(tuple, (np.eye(3) + np.array(rows(0.05))).tolist()))
    slopes = (rows(1e-3), rows(1e-5), rows(1e-7))
    bias = tuple((0.01 * random.uniform(0.3, 1.0, 3)).tolist())
    return SensorParameters(matrix, bias, slopes, rows(1e-4), 22.0)  # type: ignore[arg-type]


def by_hand(model: SensorParameters, temperature: float) -> tuple[np.ndarray, np.ndarray]:
    """M and b at a temperature, term by term."""
    t = temperature - model.reference
    matrix, bias = np.array(model.matrix), np.array(model.bias)
    for power in (1, 2, 3):
        matrix = matrix + t**power * np.array(model.matrix_slopes[power - 1])
        bias = bias + t**power * np.array(model.bias_slopes[power - 1])
    return matrix, bias


def test_a_model_is_its_polynomials() -> None:
    for temperature in (-5.0, 22.0, 61.0):
        for found, expected in zip(model_at(sensor(1), temperature), by_hand(sensor(1), temperature), strict=True):
            np.testing.assert_allclose(found, expected, rtol=1e-12)


def test_cycles_that_wait_are_read_by_the_new_block_of_models_that_are_not_symmetric() -> None:
    before, after = (ParameterBlock(3, v, sensor(v), sensor(v + 10)) for v in (1, 2))
    config = default_config()
    state, random = new_node(config)[0]["filter"], np.random.default_rng(2)
    true = random.standard_normal((*state["ring_rate"].shape[:-1], 6))
    for name, ring, part in (("gyroscope", "ring_rate", slice(0, 3)), ("accelerometer", "ring_force", slice(3, 6))):
        matrix, bias = by_hand(getattr(before, name), 31.0)
        new_matrix, new_bias = by_hand(getattr(after, name), 31.0)
        state[ring] = true[..., part]
        # what was read: M w + b under the block before; what it is under the block after
        expected = np.array([np.linalg.solve(new_matrix, matrix @ w + bias - new_bias) for w in true[..., part]])
        recorrect_ring(
            state, ParameterBlock(3, 1, **{name: getattr(before, name)}),
            ParameterBlock(3, 2, **{name: getattr(after, name)}), 31.0,
        )  # fmt: skip
        np.testing.assert_allclose(state[ring], expected, atol=1e-12)


def test_parts_of_cycles_are_forgotten_under_another_gyroscope_and_not_under_another_accelerometer() -> None:
    state = new_node(default_config())[0]["filter"]
    for name, expected in (("accelerometer", 1), ("gyroscope", 0)):
        for _ in range(2):
            state["ring_split"] = 1
            recorrect_ring(state, ParameterBlock(3, 1), ParameterBlock(3, 2, **{name: sensor(1)}), 25.0)
            assert np.all(state["ring_split"] == expected)


def test_another_block_forgets_what_was_learnt_under_the_one_before() -> None:
    for name in ("gyroscope", "accelerometer"):
        one = tube()
        now = 1000.0
        for _ in range(120):
            now += PERIOD
            one.on_cycle(
                ImuReading(now - PERIOD, now, (1e-3, 2e-3, -1e-3), (0.1, 0.3, -9.8)),
                RigContext(True, 1, now, 1e-8, True),
            )
        assert np.all(one.state["static_bias"] != 0.0)
        var = one.state["P"].diagonal().copy()
        one.state["smoothing"] = 1
        block = ParameterBlock(3, 1, **{name: sensor(4)})
        one.prepare(block)
        assert np.any(one.state["static_bias"] != 0.0) == (name == "accelerometer")
        tilt_is_lost = bool(np.any(one.state["P"].diagonal()[:2] > 1.5 * var[:2]))
        assert tilt_is_lost == (name == "accelerometer")
        one.use(block)
        assert one.state["smoothing"] == 0


def test_a_node_that_wakes_does_not_take_the_string_for_released() -> None:
    nodes = new_node(default_config())
    for _ in range(2):
        nodes[0]["twist"]["wound"] = 0
        resume_node(nodes, default_config())
        assert nodes[0]["twist"]["wound"] == 1


def test_flags_come_with_the_age_of_the_aiding() -> None:
    one = tube()
    one.state["last_aided"] = 1000.0
    limit = one.settings.aiding_old_after
    for age, is_old in ((limit, False), (limit + 1e-6, True)):
        state = one.reporter.report(1000.0 + age, AROUND, (1, bytes(8)))
        assert isinstance(state, NodeState)
        assert (NodeFlag.AIDING_OLD in state.flags) == is_old
        assert state.aiding_age == pytest.approx(age)
    assert math.isfinite(limit)
