"""A gyroscope that was calibrated nowhere, at rest for the first time: its bias of degrees a second is learnt.

Real readings are those of the MPU-9150 in ``tests/data/records``; made ones have offset, noise and steps of a real
MPU-6050 (4.54, 0.05, 1.12 deg/s; 0.018, 0.0125, 0.013 deg/s of a cycle's mean).
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from node.firmware.tube_settings import TubeSettings
from node.kernels.arithmetic.formats import PERIOD
from node.process.drivers.choice import imu_source
from node.process.tube_process import TubeProcess
from telemetry.application.clock import ClockFilter
from telemetry.messages import Aiding

pytestmark = pytest.mark.slow
RATE = 100.0
REAL = Path(__file__).parents[1] / "data" / "records" / "mpu9150-imu0-100hz.npy"
OFFSET = np.array([4.54, 0.05, 1.12])  # deg/s
NOISE = np.array([0.13, 0.09, 0.095])  # deg/s, of a reading
LSB = 1.0 / 65.5  # deg/s, at the range of 500 deg/s
UPRIGHT = (0.04, 0.07, -1.03)  # g
BEGIN = 1000.0
SEARCH = 60.0  # s, within which a node at rest is to know its bias
SEARCHING = 1  # mode


def made(seconds: float, offset: np.ndarray = OFFSET, seed: int = 1, lean: float = 0.0) -> np.ndarray:
    """Readings (n, 6) at rest in deg/s and g, of a tube that leans by ``lean`` (rad)."""
    random = np.random.default_rng(seed)
    rates = offset + NOISE * random.standard_normal((round(seconds * RATE), 3))
    force = UPRIGHT if lean == 0.0 else (math.sin(lean), 0.0, -math.cos(lean))
    forces = np.array(force) + 0.004 * random.standard_normal((len(rates), 3))
    return np.hstack([np.round(rates / LSB) * LSB, forces])


class Played:
    """A node's process that plays readings as ``replay:``; ``told`` gives what its encoder says at a time, or None."""

    def __init__(self, folder: Path, readings: np.ndarray, kernel: str = "float64") -> None:
        names = "time_s,gx_dps,gy_dps,gz_dps,ax_g,ay_g,az_g"
        rows = np.column_stack([np.arange(len(readings)) / RATE, readings])
        np.savetxt(folder / "imu.csv", rows, delimiter=",", header=names, comments="", fmt="%.6f")
        source = imu_source(f"replay:{folder / 'imu.csv'}")
        self.process = TubeProcess(TubeSettings(1, kernel=kernel), folder / "state", imus=[source])
        self.process.endpoint.clock = ClockFilter(is_root=True)
        self.now, self.number = BEGIN, 0

    def run(self, seconds: float, yaw: float | None = None, rate: float = 0.0) -> float | None:
        """Cycles of so long, with an encoder that tells ``yaw`` (rad) and ``rate`` (rad/s); when the search ended."""
        ended = None
        for _ in range(round(seconds / PERIOD)):
            self.now += PERIOD
            if yaw is not None:
                self.number += 1
                told = Aiding(yaw, 1e-8, 0.0, 0.0, rate, self.now, self.number, 0)
                self.process._on_aiding(told, self.now)
            self.process.on_cycle([self.now - PERIOD, 0.0, 0.0, 0.0, 0.0, 0.0, -9.8], self.now)
            self.process.take_frames(self.now)
            if ended is None and self.state["mode"] != SEARCHING:
                ended = self.now - BEGIN
        return ended

    @property
    def state(self) -> np.void:
        return self.process.state[0]

    @property
    def bias_deg(self) -> np.ndarray:
        return np.degrees(self.state["static_bias"] + self.state["bias"])


@pytest.mark.parametrize("kernel", ["float64", "fixed"])
@pytest.mark.parametrize("heard", [True, False], ids=["encoder", "alone"])
def test_an_offset_of_degrees_is_learnt_within_a_minute_and_its_sigma_covers_it(
    tmp_path: Path, kernel: str, heard: bool
) -> None:
    node = Played(tmp_path, made(130.0), kernel)
    ended = node.run(64.0, 1.0 if heard else None)
    assert ended is not None
    assert ended < SEARCH
    node.run(64.0, 1.0 if heard else None)
    sigmas = np.degrees(np.sqrt(np.diag(node.state["P"])[3:6]))
    assert np.all(np.abs(node.bias_deg - OFFSET) < 3.0 * sigmas)
    assert np.all(sigmas < 0.02)
    assert node.state["still_cycles"] > 100
    if heard:
        assert math.degrees(abs(node.process.tube.yaw - 1.0)) < 0.01


@pytest.mark.parametrize("offset", np.arange(0.40, 0.62, 0.02))
def test_no_size_of_an_offset_lies_between_the_two_ways_of_learning_it(tmp_path: Path, offset: float) -> None:
    node = Played(tmp_path, made(65.0, np.array([0.0, offset, 0.0]), round(1e4 * offset)))
    ended = node.run(64.0)
    assert ended is not None
    assert ended < SEARCH


def test_a_reading_that_failed_at_the_start_does_not_hold_the_search_up(tmp_path: Path) -> None:
    """No aiding proves a gyroscope without a bias: it is looked at again all the same."""
    readings = made(66.0)
    readings[30:50, 0] = np.nan
    ended = Played(tmp_path, readings).run(65.0)
    assert ended is not None
    assert ended < SEARCH + 3.0


def test_a_gyroscope_beyond_what_a_bias_may_be_goes_on_searching(tmp_path: Path) -> None:
    assert Played(tmp_path, made(80.0, np.array([0.0, 0.0, 6.5]))).run(79.0) is None


def test_a_slow_turn_is_no_bias_where_gravity_or_the_encoder_tells_of_it(tmp_path: Path) -> None:
    turning = made(130.0, np.array([0.0, 0.0, 3.0]), lean=math.radians(4.0))
    angle = np.radians(3.0) * np.arange(len(turning)) / RATE
    lean = math.radians(4.0)
    turning[:, 3], turning[:, 4] = math.sin(lean) * np.cos(angle), -math.sin(lean) * np.sin(angle)
    for name, readings, rate in (("gravity", turning, None), ("told", made(130.0, np.array([0.0, 0.0, 3.0])), 0.05)):
        (tmp_path / name).mkdir()
        node = Played(tmp_path / name, readings)
        assert node.run(125.0, None if rate is None else 1.0, rate or 0.0) is None, name


def test_a_tube_that_is_moved_is_not_at_rest(tmp_path: Path) -> None:
    shaken = made(130.0)
    shaken[:, 2] += 0.5 * np.sin(np.arange(len(shaken)) / RATE)
    assert Played(tmp_path, shaken).run(125.0) is None


def test_a_yaw_that_turned_on_during_the_search_is_told_anew(tmp_path: Path) -> None:
    """The encoder was heard before the node knew its bias, and is silent until the bias is known."""
    node = Played(tmp_path, made(130.0))
    node.run(1.1, 1.0)
    node.run(70.0)
    error = abs(math.remainder(node.process.tube.yaw - 1.0, 2.0 * math.pi))
    assert error < 3.0 * math.sqrt(node.process.tube.yaw_var)
    node.number -= 1  # a head at rest repeats its measurement
    node.run(3.0, 1.0)
    assert math.degrees(abs(node.process.tube.yaw - 1.0)) < 0.1


def real_turn() -> tuple[np.ndarray, float]:
    """Readings (n, 6) of the real sensor about an axis that lies level: a minute at rest, a turn, a rest; its angle.

    The rest is the record's own, read to and fro. The angle (rad) is that between gravity before and after, of forces
    put on a sphere by all rests of the record; the sensor is mounted anew so that its z is the axis turned about.
    """
    counts = np.load(REAL)
    force, rate = (
        np.column_stack([counts[f"{sensor}{axis}_lsb"] for axis in "xyz"]) * unit
        for sensor, unit in (("a", 0.0047900390625 / 9.81), ("g", 0.06103515625))
    )
    spread = np.array([rate[k : k + 100].std(axis=0).max() for k in range(0, len(rate) - 100, 50)])
    rests = np.array([force[50 * k : 50 * k + 100].mean(axis=0) for k in np.flatnonzero(spread < 0.3)])
    squares = np.linalg.lstsq(np.hstack([rests**2, rests]), np.ones(len(rests)), rcond=None)[0]
    centre = -0.5 * squares[3:] / squares[:3]
    before, turn, after = slice(12_900, 13_440), slice(13_440, 13_620), slice(13_620, 14_040)
    first, last = (np.sqrt(squares[:3]) * (force[part].mean(axis=0) - centre) for part in (before, after))
    angle = math.acos(first @ last / np.linalg.norm(first) / np.linalg.norm(last))
    axis = np.sum(rate[turn] - rate[before].mean(axis=0), axis=0)
    z = axis / np.linalg.norm(axis)
    x = np.cross([0.0, 1.0, 0.0], z)
    mount = np.stack([x / np.linalg.norm(x), np.cross(z, x / np.linalg.norm(x)), z])
    both = np.hstack([rate, force]).reshape(-1, 2, 3) @ mount.T
    both = both.reshape(-1, 6)
    rest = np.concatenate([both[before], both[before][::-1]] * 7)
    return np.concatenate([rest, both[before], both[turn], both[after]]), angle


def test_a_real_turn_is_followed_within_its_sigma(tmp_path: Path) -> None:
    readings, angle = real_turn()
    assert math.degrees(angle) == pytest.approx(41.6, abs=0.6)  # by hand, of the record
    node = Played(tmp_path, readings)
    at_rest = (len(readings) - 600) / RATE - 2.0
    ended = node.run(at_rest - 3.0)
    assert ended is not None
    assert ended < SEARCH
    node.run(2.0, 1.0)
    node.run(2.0)
    before = node.process.tube.yaw
    assert before == pytest.approx(1.0, abs=1e-3)
    node.run((len(readings)) / RATE - at_rest - 2.0)
    turned = math.remainder(node.process.tube.yaw - before, 2.0 * math.pi)
    sigma = math.sqrt(node.process.tube.yaw_var)
    assert abs(turned - angle) < 2.0 * sigma
    assert math.degrees(sigma) < 1.5
