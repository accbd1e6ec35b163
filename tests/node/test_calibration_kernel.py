"""The correction of raw readings against numpy, the published calibrations and the ground station's mathematics."""

import math
import struct
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from groundstation.calibration.block import Calibration, Provenance, model_of
from groundstation.service.orders.blocks import block_of
from node.firmware.block_trial import record_of
from node.kernels.arithmetic.formats import DEG
from node.kernels.sensors.correction import COLDEST, HOTTEST, USUAL, correct_cycle, identity_parameters
from telemetry.messages import Matrix3
from telemetry.parameters import ParameterBlock, SensorParameters

ENTRY = st.floats(-0.05, 0.05)
ROW = st.tuples(ENTRY, ENTRY, ENTRY)
SLOPES = st.tuples(*[st.tuples(ROW, ROW, ROW)] * 3)
READING = st.tuples(*[st.floats(-20.0, 20.0)] * 3)


@st.composite
def sensors(draw: st.DrawFn) -> SensorParameters:
    matrix = np.eye(3) + np.array([draw(ROW) for _ in range(3)])
    scales = (1e-3, 1e-5, 1e-7)
    slopes = [np.array(s) * k for s, k in zip(draw(SLOPES), scales, strict=True)]
    bias_slopes = [np.array(draw(ROW)) * k for k in scales]
    rows = [tuple(map(tuple, m.tolist())) for m in (matrix, *slopes)]
    return SensorParameters(
        rows[0], draw(ROW), tuple(rows[1:]), tuple(tuple(b.tolist()) for b in bias_slopes), draw(st.floats(0.0, 40.0))
    )  # type: ignore[arg-type]


def corrected(block: ParameterBlock, rate: tuple, force: tuple, temperature: float) -> tuple[np.ndarray, np.ndarray]:
    w, f = np.array(rate), np.array(force)
    correct_cycle(record_of(block)[0], temperature, w, f)
    return w, f


def by_numpy(sensor: SensorParameters, reading: tuple, temperature: float) -> np.ndarray:
    powers = (temperature - sensor.reference) ** np.arange(4)
    matrix = np.tensordot(powers, np.array([sensor.matrix, *sensor.matrix_slopes]), axes=1)
    return np.linalg.solve(matrix, np.array(reading) - powers @ np.array([sensor.bias, *sensor.bias_slopes]))


@given(sensors(), sensors(), READING, READING, st.floats(COLDEST, HOTTEST))
@pytest.mark.slow
def test_each_sensor_is_corrected_by_its_own_model(
    gyroscope: SensorParameters, accelerometer: SensorParameters, rate: tuple, force: tuple, temperature: float
) -> None:
    w, f = corrected(ParameterBlock(1, 1, gyroscope, accelerometer), rate, force, temperature)
    np.testing.assert_allclose(w, by_numpy(gyroscope, rate, temperature), rtol=0, atol=1e-12)
    np.testing.assert_allclose(f, by_numpy(accelerometer, force, temperature), rtol=0, atol=1e-12)


ANY = st.floats(allow_nan=True, allow_infinity=True)


@given(st.tuples(ANY, ANY, ANY), st.tuples(ANY, ANY, ANY), ANY)
def test_the_identity_touches_no_bit(rate: tuple, force: tuple, temperature: float) -> None:
    w, f = np.array(rate), np.array(force)
    correct_cycle(identity_parameters()[0], temperature, w, f)
    assert w.tobytes() + f.tobytes() == struct.pack("6d", *rate, *force)


def test_a_table_turned_at_720_deg_per_s_is_read_right() -> None:
    bias = (0.167255742 * DEG, 3.803049838 * DEG, 1.007222273 * DEG)
    matrix: Matrix3 = (
        (0.9945843, -0.017076546, -0.003499657),
        (0.014795547, 0.996093741, -0.004001168),
        (-0.001135443, -0.007539215, 0.996815294),
    )
    block = ParameterBlock(1, 1, SensorParameters(matrix, bias))
    for axis in range(3):
        truth = np.zeros(3)
        truth[axis] = 720.0 * DEG
        raw = np.array(matrix) @ truth + bias
        rate, force = corrected(block, tuple(raw), (0.0, 0.0, -9.81), USUAL)
        np.testing.assert_allclose(rate, truth, atol=1e-14)
        assert force.tolist() == [0.0, 0.0, -9.81]


@pytest.mark.parametrize(
    ("given_c", "used"), [(math.nan, USUAL), (math.inf, USUAL), (-100.0, COLDEST), (300.0, HOTTEST)]
)
def test_a_temperature_that_cannot_be_is_not_followed(given_c: float, used: float) -> None:
    block = ParameterBlock(1, 1, SensorParameters(bias_slopes=((1e-3, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))))
    rate, _ = corrected(block, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), given_c)
    assert rate[0] == pytest.approx(-1e-3 * (used - 25.0))


def calibration(sensor: str, powers: int) -> Calibration:
    matrix = np.eye(3) + 0.02 * np.arange(9).reshape(3, 3) / 9.0
    slopes = np.array([1e-4 * 10.0**-q * np.ones((3, 3)) for q in range(powers)]).reshape(-1, 3, 3)
    bias_slopes = np.array([1e-3 * 10.0**-q * np.arange(3.0) for q in range(powers)]).reshape(-1, 3)
    zeros = [np.zeros(shape) for shape in ((3, 3), (3,), slopes.shape, bias_slopes.shape)]
    provenance = Provenance("0" * 64, "2024-05-31", "synthetic", 0.0, *zeros)
    return Calibration(sensor, matrix, np.array([0.01, -0.02, 0.03]), slopes, bias_slopes, 20.0, provenance)


@pytest.mark.parametrize("powers", [0, 1, 3])
def test_the_node_corrects_as_the_ground_station_solved(powers: int, tmp_path: Path) -> None:
    gyroscope, accelerometer = calibration("gyroscope", powers), calibration("accelerometer", powers)
    block = block_of(1, 1, gyroscope, accelerometer)
    rate, force = corrected(block, (0.3, -0.2, 1.2), (0.1, 0.2, -9.7), 41.0)
    for got, solved, raw in ((rate, gyroscope, (0.3, -0.2, 1.2)), (force, accelerometer, (0.1, 0.2, -9.7))):
        np.testing.assert_allclose(got, model_of(solved).correct(np.array(raw), np.array(41.0)), atol=1e-13)
