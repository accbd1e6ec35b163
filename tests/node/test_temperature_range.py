"""A temperature beyond the polynomial of a correction: the node says so, its sigma holds what the bias does there."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from node.errors import NodeConfigurationError
from node.firmware.imu_settings import ANYWHERE, ImuSettings
from node.firmware.tube_settings import TubeSettings
from node.kernels.arithmetic.formats import PERIOD
from node.process.cluster_options import ClusterRequest
from node.process.temperature_range import unmeasured_bias
from node.process.tube_process import TubeProcess
from telemetry.application.clock import ClockFilter
from telemetry.calibration import Calibration, Provenance, from_json, read_calibration, to_json, write_calibration
from telemetry.errors import CalibrationError
from telemetry.messages import Aiding, Scalar, Severity
from telemetry.parameters import SensorParameters

pytestmark = pytest.mark.slow
SLOPE = math.radians(0.02)  # rad/s/K of every axis, within the oven's 0..40 C
OVEN = (0.0, 40.0)
REFERENCE = 20.0
BEGIN = 1000.0


def calibration(valid: tuple[float, float] | None = OVEN, sensor: str = "gyroscope") -> Calibration:
    none = np.zeros((0, 3, 3))
    slopes = np.full((1, 3), SLOPE if sensor == "gyroscope" else 0.0)
    origin = Provenance("0" * 64, "2026-01-31", "oven", 0.0, np.zeros((3, 3)), np.zeros(3), none, np.zeros((1, 3)))
    return Calibration(sensor, np.eye(3), np.zeros(3), none, slopes, REFERENCE, origin, valid)


class Told(TubeProcess):
    """A node that keeps what it tells."""

    def _send_event(self, severity: Severity, code: str, arguments: dict[str, Scalar]) -> None:
        self.told = [*getattr(self, "told", []), (code, arguments)]
        super()._send_event(severity, code, arguments)


class Warmed:
    """A node whose gyroscope has the bias of its polynomial in the oven, and beyond it keeps that of the oven's end."""

    def __init__(self, folder: Path, within: tuple[float, float], kernel: str) -> None:
        gyroscope = SensorParameters(bias_slopes=((SLOPE, SLOPE, SLOPE), (0.0,) * 3, (0.0,) * 3), reference=REFERENCE)
        imu = ImuSettings(gyroscope=gyroscope, corrected_within=within)
        self.process = Told(TubeSettings(1, kernel=kernel, imus=(imu,)), folder)  # type: ignore[arg-type]
        corrections = self.process.tube._corrections
        assert corrections[1]["gyroscope"]["bias"][1][2] == pytest.approx(SLOPE)
        self.process.endpoint.clock = ClockFilter(is_root=True)
        self.random, self.now, self.turned, self.number = np.random.default_rng(1), BEGIN, 0.0, 0

    def run(self, seconds: float, warmth: tuple[float, float], *, rate: float = 0.0, aided: bool = False) -> None:
        """Cycles at temperatures from one to another (C), turning by ``rate`` (rad/s)."""
        count = round(seconds / PERIOD)
        for temperature in np.linspace(*warmth, count).tolist():
            self.now, self.turned = self.now + PERIOD, self.turned + rate * PERIOD
            bias = SLOPE * (min(max(temperature, OVEN[0]), OVEN[1]) - REFERENCE)
            rates = np.array([bias, bias, bias + rate]) + 1e-4 * self.random.standard_normal(3)
            force = np.array([0.3, 0.0, -9.8]) + 2e-3 * self.random.standard_normal(3)
            if aided:
                self.number += 1
                told = Aiding(1.0 + self.turned, 1e-8, 0.0, 0.0, rate, self.now, self.number, 0)
                self.process._on_aiding(told, self.now)
            self.process.on_cycle([self.now - PERIOD, *rates.tolist(), *force.tolist(), temperature], self.now)
            self.process.take_frames(self.now)

    def off(self) -> tuple[float, float]:
        """Error of the yaw and its sigma, deg."""
        tube = self.process.tube
        error = math.remainder(tube.yaw - 1.0 - self.turned, 2.0 * math.pi)
        return abs(math.degrees(error)), math.degrees(math.sqrt(tube.yaw_var))

    def codes(self) -> list[str]:
        return [code for code, _ in getattr(self.process, "told", []) if code.startswith("temperature")]


@pytest.mark.parametrize("kernel", ["float64", "fixed"])
def test_a_bias_that_leaves_its_polynomial_beyond_the_oven_is_in_the_sigma(tmp_path: Path, kernel: str) -> None:
    """A minute without aiding at 70 C: without a range the error is many of the sigmas that are stated."""
    found = {}
    for name, within in (("told", OVEN), ("untold", ANYWHERE)):
        node = Warmed(tmp_path / name, within, kernel)
        node.run(70.0, (20.0, 35.0), aided=True)
        node.run(40.0, (35.0, 35.0), rate=0.2, aided=True)
        node.run(60.0, (35.0, 70.0), rate=0.2)
        found[name] = node.off()
        assert node.codes() == (["temperature_beyond"] if name == "told" else [])
        assert np.all(np.isfinite(node.process.state[0]["P"]))
    error, sigma = found["told"]
    assert error < 3.0 * sigma
    assert found["untold"][0] > 5.0 * found["untold"][1]


def test_each_way_out_is_told_once_and_the_bias_is_calm_within(tmp_path: Path) -> None:
    node = Warmed(tmp_path, OVEN, "float64")
    node.run(70.0, (20.0, 35.0), aided=True)
    calm = float(node.process.nodes[0]["config"]["bias_std"][2])
    node.run(20.0, (39.0, 60.0), aided=True)
    assert float(node.process.nodes[0]["config"]["bias_std"][2]) == pytest.approx(20.0 * SLOPE, rel=0.1)
    node.run(20.0, (60.0, 39.9), aided=True)
    assert node.codes() == ["temperature_beyond"]  # within by less than half a kelvin is no return
    node.run(90.0, (39.0, 30.0), aided=True)
    node.run(20.0, (30.0, -9.0), aided=True)
    assert node.codes() == ["temperature_beyond", "temperature_within", "temperature_beyond"]
    node.run(5.0, (5.0, 5.0), aided=True)
    assert float(node.process.nodes[0]["config"]["bias_std"][2]) == pytest.approx(calm, rel=1e-6)
    first, _, second, last = [arguments for code, arguments in node.process.told if code.startswith("temperature")]
    assert (first["low_c"], first["high_c"], second["low_c"]) == (0.0, 40.0, 0.0)
    assert first["temperature_c"] > 40.0 > 0.0 > second["temperature_c"]
    assert last == {}  # within again


@pytest.mark.parametrize(("off", "added"), [(10.0, 10.0 * 0.02 + 500.0 * 1e-3), (-30.0, -30.0 * 0.02 + 2100.0 * 1e-3)])
def test_what_a_polynomial_adds_is_counted_from_the_nearer_end_of_its_range(off: float, added: float) -> None:
    """By hand, of 0.02 d + 0.001 d^2 about 20 C: 30^2 - 20^2 from 40 to 50 C, 50^2 - 20^2 from 0 to -30 C."""
    sensor = SensorParameters(bias_slopes=((0.02, 0.0, 0.0), (1e-3, 0.0, 0.0), (0.0,) * 3), reference=REFERENCE)
    found = unmeasured_bias(ImuSettings(gyroscope=sensor, corrected_within=OVEN), off)
    assert found.tolist() == pytest.approx([added, 0.0, 0.0])


def test_a_calibration_keeps_its_range_and_one_of_before_keeps_its_hash(tmp_path: Path) -> None:
    ranged, plain = calibration(), calibration(None)
    assert from_json(to_json(ranged)).valid == OVEN
    assert "valid" not in to_json(plain)
    assert from_json(to_json(plain)).sha256() == plain.sha256() != ranged.sha256()
    for wrong in ((40.0, 0.0), (1.0, 1.0), (0.0, math.nan), (1.0,), "hot"):
        with pytest.raises(CalibrationError, match=r"^valid: expected"):
            calibration(wrong)  # type: ignore[arg-type]
    write_calibration(tmp_path / "one.json", ranged)
    assert read_calibration(tmp_path / "one.json").valid == OVEN


def test_a_node_takes_what_both_of_its_files_have_in_common(tmp_path: Path) -> None:
    write_calibration(tmp_path / "gyroscope.json", calibration((-10.0, 40.0)))
    write_calibration(tmp_path / "accelerometer.json", calibration((5.0, 60.0), "accelerometer"))
    write_calibration(tmp_path / "cold.json", calibration((-30.0, -20.0), "accelerometer"))
    write_calibration(tmp_path / "plain.json", calibration(None, "accelerometer"))

    def settings(other: str) -> ImuSettings:
        (one,) = ClusterRequest(("x",), (), (), (tmp_path / "gyroscope.json",), (tmp_path / other,)).to_settings()
        return one

    assert settings("accelerometer.json").corrected_within == (5.0, 40.0)
    assert settings("plain.json").corrected_within == (-10.0, 40.0)
    with pytest.raises(NodeConfigurationError, match="got -10 and -20 C: the calibrations of its sensors have none"):
        settings("cold.json")
