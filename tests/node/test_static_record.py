"""The running sums of a static record against numpy, and what it says of motion."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from node.firmware.inputs import ImuReading, RigContext
from node.firmware.sensor_limits import SensorLimits
from node.firmware.tube import Tube
from node.firmware.tube_settings import TubeSettings
from node.kernels.arithmetic.formats import DEG, PERIOD
from node.kernels.record.filter_record import default_config
from node.kernels.record.node_record import new_node
from node.kernels.record.sensor_record import STATIC
from node.kernels.sensors.static_average import add_static, has_moved
from telemetry.messages import Event, StaticRecord
from telemetry.parameters import ParameterBlock, SensorParameters

NOISELESS = SensorLimits(repeats_together=0, repeats_alone=0)
NOISE = np.array([2e-4, 2e-4, 2e-4, 3e-3, 3e-3, 3e-3])


def summed(samples: np.ndarray) -> np.ndarray:
    record = np.zeros(1, STATIC)
    for sample in samples:
        add_static(record[0], sample[:3].copy(), sample[3:].copy(), 30.0, 1)
    return record[0]


@given(st.integers(2, 300), st.integers(0, 2**32 - 1), st.floats(-10.0, 10.0))
@pytest.mark.slow
def test_the_sums_are_mean_and_covariance(count: int, seed: int, offset: float) -> None:
    samples = offset + np.random.default_rng(seed).standard_normal((count, 6)) * NOISE
    record = summed(samples)
    np.testing.assert_allclose(record["mean"], samples.mean(axis=0), rtol=1e-12, atol=1e-13)
    cov = np.cov(samples, rowvar=False)
    scale = np.sqrt(np.outer(np.diag(cov), np.diag(cov)))
    np.testing.assert_allclose(record["scatter"] / (count - 1) / scale, cov / scale, atol=1e-8)
    assert record["temperature"] == pytest.approx(30.0)


@given(st.integers(0, 2**32 - 1))
def test_noise_and_a_slow_bias_are_no_motion(seed: int) -> None:
    random = np.random.default_rng(seed)
    samples = (
        random.standard_normal((100, 6)) * NOISE + np.cumsum(random.standard_normal((100, 6)), axis=0) * NOISE / 40
    )
    assert has_moved(summed(samples), 3.0) == 0


def test_no_noise_is_no_motion() -> None:
    assert has_moved(summed(np.full((20, 6), 0.1)), 3.0) == 0


@pytest.mark.parametrize("axis", range(6))
def test_a_step_in_any_axis_is_motion(axis: int) -> None:
    samples = np.random.default_rng(1).standard_normal((100, 6)) * NOISE
    samples[50:, axis] += 10.0 * NOISE[axis]
    assert has_moved(summed(samples), 3.0) == 1


def test_a_sample_that_is_no_number_is_left_out() -> None:
    record = np.zeros(1, STATIC)
    assert add_static(record[0], np.array([math.nan, 0.0, 0.0]), np.zeros(3), 30.0, 1) == 0
    assert record[0]["samples"] == 0


class Life:
    """A tube on a bench whose gyroscope and accelerometer are biased."""

    def __init__(self, parameters: ParameterBlock | None = None) -> None:
        config = default_config()
        numbers = iter(range(1, 10**6)).__next__
        self.tube = Tube(
            TubeSettings(3, limits=NOISELESS), config, new_node(config), numbers, restored=False, parameters=parameters
        )
        self.now = 1000.0
        self.force = (0.0, 0.1, -9.81)

    def cycles(self, count: int, rate: float = 0.0, bias: float = 1e-4, temperature: float = 40.0) -> list[object]:
        said: list[object] = []
        for _ in range(count):
            self.now += PERIOD
            around = RigContext(True, 1, self.now + 500.0, 1e-8, True)
            reading = ImuReading(self.now - PERIOD, self.now, (0.0, 0.0, rate + bias), self.force, temperature)
            said.extend(self.tube.on_cycle(reading, around))
        return said


def records(said: list[object]) -> list[StaticRecord]:
    return [message for message in said if isinstance(message, StaticRecord)]


def test_a_record_holds_what_was_read_and_not_what_was_corrected() -> None:
    block = ParameterBlock(3, 1, SensorParameters(bias=(0.0, 0.0, 1e-4)), SensorParameters(bias=(0.0, 0.1, 0.0)))
    life = Life(block)
    life.cycles(110)
    begun = life.now
    assert life.tube.start_record(20.0, 77) == ""
    (record,) = records(life.cycles(60))
    assert (record.tube, record.command, record.moved) == (3, 77, False)
    assert record.rate == pytest.approx((0.0, 0.0, 1e-4))
    assert record.force == pytest.approx((0.0, 0.1, -9.81))
    assert record.temperature == pytest.approx(40.0)
    assert record.begun_at == pytest.approx(begun + 500.0)
    assert record.ended_at - record.begun_at >= 20.0
    assert record.samples == math.ceil(20.0 / PERIOD)
    np.testing.assert_allclose(record.force_cov, np.zeros((3, 3)), atol=1e-20)


def test_a_turning_node_refuses_and_one_that_starts_to_turn_says_so() -> None:
    life = Life()
    life.force = (0.0, 0.0, -9.81)  # the tube is upright: its turning leaves the force as it is
    life.cycles(110)
    life.cycles(5, rate=1.2)
    assert "turning" in life.tube.start_record(20.0, 77)
    life.cycles(1)
    assert "turning" in life.tube.start_record(20.0, 77)
    life.cycles(5)
    assert life.tube.start_record(20.0, 77) == ""
    life.cycles(20)
    (record,) = records(life.cycles(3, rate=0.1 * DEG))  # it is worth nothing any more, so it ends
    assert record.moved
    assert record.ended_at - record.begun_at < 20.0
    assert records(life.cycles(60)) == []
    assert life.tube.start_record(20.0, 78) == ""


def test_a_new_order_takes_the_place_of_the_record_that_is_being_taken() -> None:
    life = Life()
    life.cycles(110)
    assert life.tube.start_record(20.0, 77) == ""
    life.cycles(20)
    begun = life.now
    assert life.tube.start_record(20.0, 78) == ""
    (record,) = records(life.cycles(60))
    assert (record.command, record.moved) == (78, False)
    assert record.begun_at == pytest.approx(begun + 500.0)
    assert record.samples == math.ceil(20.0 / PERIOD)


def test_a_gyroscope_never_calibrated_can_be_recorded_but_not_while_it_turns_slowly() -> None:
    life = Life()
    life.cycles(110, bias=3.8 * DEG)
    assert life.tube.start_record(20.0, 1) == ""
    (record,) = records(life.cycles(60, bias=3.8 * DEG))
    assert not record.moved
    life.cycles(10, rate=7.0 * DEG)
    assert "turning" in life.tube.start_record(20.0, 2)


@pytest.mark.parametrize("seconds", [None, True, "60", 4.9, 3601.0, math.nan, -1.0])
def test_a_length_that_cannot_be_is_refused(seconds: object) -> None:
    assert "seconds" in Life().tube.start_record(seconds, 1)


def test_a_new_accelerometer_model_is_levelled_anew_and_moves_no_bias() -> None:
    life = Life()
    life.cycles(200)
    yaw_var = life.tube.state["P"][2, 2]
    block = ParameterBlock(3, 1, accelerometer=SensorParameters(bias=(0.2, -0.1, 0.0)))
    life.tube.prepare(block)
    life.tube.use(block)
    life.cycles(30)
    assert life.tube.quiet
    assert np.abs(life.tube.state["bias"]).max() < 1e-9
    f = np.array([-0.2, 0.2, -9.81])
    np.testing.assert_allclose(life.tube.state["down"], -f / np.linalg.norm(f), atol=1e-4)
    assert life.tube.state["P"][2, 2] == pytest.approx(yaw_var, rel=0.1)


def test_a_record_without_a_reading_is_an_event_and_the_next_can_begin() -> None:
    life = Life()
    life.cycles(110)
    assert life.tube.start_record(5.0, 1) == ""
    said = life.cycles(12, rate=math.nan)
    assert "static_record_empty" in [m.code for m in said if isinstance(m, Event)]
    life.cycles(10)  # the sensor proves itself, then the node has to stand again
    assert life.tube.start_record(5.0, 2) == ""
