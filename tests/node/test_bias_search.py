"""A node that goes on searching for its bias says so by name, with what it needs, and says when it has it."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from node.firmware.tube_settings import TubeSettings
from node.kernels.arithmetic.formats import PERIOD
from node.process.bias_search import LONGEST
from node.process.tube_process import TubeProcess
from telemetry.messages import Aiding, Scalar, Severity

pytestmark = pytest.mark.slow
NAMES = ("bias_never_learnt", "bias_learnt")


class Told(TubeProcess):
    """A node that keeps what it tells."""

    def _send_event(self, severity: Severity, code: str, arguments: dict[str, Scalar]) -> None:
        self.told = [*getattr(self, "told", []), (severity, code, arguments)]
        super()._send_event(severity, code, arguments)


class Searching:
    """A node that hears of no head."""

    def __init__(self, folder: Path, kernel: str = "float64") -> None:
        self.process = Told(TubeSettings(1, kernel=kernel), folder)  # type: ignore[arg-type]
        self.random, self.now, self.cycle = np.random.default_rng(4), 1000.0, 0

    def run(self, seconds: float, offset_dps: tuple[float, float, float] = (0.0, 0.0, 0.0), wave: float = 0.0) -> None:
        for _ in range(round(seconds / PERIOD)):
            self.now, self.cycle = self.now + PERIOD, self.cycle + 1
            rate = np.radians(np.array(offset_dps) + 0.005 * self.random.standard_normal(3))
            rate[2] += math.radians(wave) * math.sin(0.7 * self.cycle)
            force = np.array([0.3, 0.0, -9.8]) + 2e-3 * self.random.standard_normal(3)
            self.process.on_cycle([self.now - PERIOD, *rate.tolist(), *force.tolist()], self.now)
            self.process.take_frames(self.now)

    def told(self) -> list[tuple[Severity, str, dict[str, Scalar]]]:
        return [row for row in getattr(self.process, "told", []) if row[1] in NAMES]


@pytest.mark.parametrize("kernel", ["float64", "fixed"])
def test_an_offset_beyond_a_bias_is_named_with_its_axis_and_the_file_that_helps(tmp_path: Path, kernel: str) -> None:
    node = Searching(tmp_path, kernel)
    node.run(LONGEST - 5.0, (0.1, -7.5, 1.0))
    assert node.told() == []
    node.run(200.0, (0.1, -7.5, 1.0))
    ((severity, code, found),) = node.told()  # once, however long it goes on
    assert (severity, code) == (Severity.ERROR, "bias_never_learnt")
    assert "--imu-gyroscope with its calibration: an offset beyond 6 deg/s" in str(found["needs"])
    assert found["axis"] == "y"
    assert float(found["rate_dps"]) == pytest.approx(-7.5, abs=0.02)
    assert float(found["searched_s"]) == pytest.approx(LONGEST, abs=2.0 * PERIOD)


def test_a_tube_that_is_moved_needs_a_rest_and_has_its_bias_after_one(tmp_path: Path) -> None:
    node = Searching(tmp_path)
    node.run(LONGEST + 5.0, (0.1, 0.2, 0.1), wave=3.0)
    ((_, code, found),) = node.told()
    assert code == "bias_never_learnt"
    assert str(found["needs"]).startswith("a minute at rest: its readings move by more than")
    assert float(found["scatter_dps"]) > 2.0
    node.run(70.0, (0.1, 0.2, 0.1))
    assert [code for _, code, _ in node.told()] == ["bias_never_learnt", "bias_learnt"]
    node.process.close()


def test_a_slow_turn_that_gravity_shows_and_readings_that_are_missing_are_named(tmp_path: Path) -> None:
    turning = Searching(tmp_path / "turning")
    for k in range(round((LONGEST + 5.0) / PERIOD)):
        turning.now += PERIOD
        angle, lean = math.radians(3.0) * PERIOD * k, 0.07
        force = [9.8 * lean * math.cos(angle), -9.8 * lean * math.sin(angle), -9.8]
        noise = turning.random.normal(0.0, 1e-4, 6)
        row = np.array([0.0, 0.0, math.radians(3.0), *force]) + noise
        turning.process.on_cycle([turning.now - PERIOD, *row.tolist()], turning.now)
    ((_, _, found),) = turning.told()
    assert str(found["needs"]).startswith("a rest that gravity and the encoder do not deny")
    silent = Searching(tmp_path / "silent")
    for _ in range(round((LONGEST + 5.0) / PERIOD)):
        silent.now += PERIOD
        silent.process.on_cycle([silent.now - PERIOD, *[math.nan] * 6], silent.now)
    ((_, _, found),) = silent.told()
    assert str(found["needs"]).startswith("readings of the gyroscope")


def test_a_node_at_rest_and_one_that_was_aided_say_nothing(tmp_path: Path) -> None:
    node = Searching(tmp_path)
    node.run(80.0, (0.1, 0.2, 0.1))
    for k in range(600):
        node.process._on_aiding(Aiding(1.0, 1e-8, 0.0, 0.0, 0.0, node.now, k, 0), node.now)
        node.run(PERIOD, (0.1, 0.2, 0.1))
    assert node.told() == []
