"""A node over a live sensor: the yaw of the same samples replayed, over a cable that is pulled out and comes back."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Protocol

import numpy as np
import pytest
from emulated_iio import EmulatedDevice
from emulated_vn100 import Line, line_of

from node.errors import SensorError
from node.firmware.tube_settings import TubeSettings
from node.kernels.arithmetic.formats import PERIOD
from node.process.drivers.choice import imu_source
from node.process.drivers.iio_imu import IioImu
from node.process.drivers.source import ImuSource
from node.process.drivers.vn100 import Vn100
from node.process.tube_process import TubeProcess
from telemetry.application.clock import ClockFilter
from telemetry.messages import Aiding, Scalar, Severity

pytestmark = pytest.mark.slow
RATE = 100.0
BEGIN = 5000.0
OFFSET = np.radians([0.3, -0.2, 0.25])
NOISE_DPS = 0.1  # of a sample, rms; an MPU-6050 has 0.05 at full bandwidth, 0.022 behind its low pass of 20 Hz
REST, TURN, AFTER = 64.0, 34.0, 6.0  # s: with an encoder that rests, without one, without one


class Live(Protocol):
    """A sensor that is plugged in."""

    source: ImuSource

    def send(self, times: np.ndarray, rates: np.ndarray, forces: np.ndarray) -> np.ndarray:
        """Samples (n,) s, (n, 3) rad/s, (n, 3) m/s^2; returns them as the sensor rounds them, (n, 6)."""

    def unplug(self) -> None:
        """Pull its cable out."""

    def plug(self) -> None:
        """Put it back."""


class LiveDevice:
    """A device of the kernel's industrial I/O."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.device = EmulatedDevice(folder)
        self.source: ImuSource = IioImu("mpu6050", self.device.sysfs, self.device.devices)

    def send(self, times: np.ndarray, rates: np.ndarray, forces: np.ndarray) -> np.ndarray:
        return self.device.live(times, rates, forces)

    def unplug(self) -> None:
        self.device.unplug()

    def plug(self) -> None:
        self.device = EmulatedDevice(self.folder)


class LiveLine:
    """A VN-100 at a serial port."""

    def __init__(self, folder: Path) -> None:
        self.port = folder / "ttyUSB0"
        self.plug()
        self.source: ImuSource = Vn100(self.port)

    def send(self, _: np.ndarray, rates: np.ndarray, forces: np.ndarray) -> np.ndarray:
        self.line.send(b"".join(line_of(*row) for row in zip(rates, forces, strict=True)))
        return np.round(np.hstack([rates, forces]), 6)

    def unplug(self) -> None:
        self.line.cut()
        self.port.unlink()

    def plug(self) -> None:
        self.line = Line()
        self.port.symlink_to(self.line.path)


class Told(TubeProcess):
    """A node that keeps what it tells of its sensor."""

    def _send_event(self, severity: Severity, code: str, arguments: dict[str, Scalar]) -> None:
        if code.startswith("sensor_"):
            self.told = [*getattr(self, "told", []), (code, str(arguments.get("detail", "")))]
        super()._send_event(severity, code, arguments)


class Run:
    """A node beside an encoder that rests at 1 rad."""

    def __init__(self, folder: Path, source: ImuSource) -> None:
        self.process = Told(TubeSettings(1), folder, imus=[source])
        self.process.endpoint.clock = ClockFilter(is_root=True)
        self.now, self.number = BEGIN, 0

    def cycle(self, *, aided: bool, yaw: float = 1.0) -> None:
        self.now += PERIOD
        if aided:
            self.number += 1
            self.process._on_aiding(Aiding(yaw, 1e-9, 0.0, 0.0, 0.0, self.now, self.number, 0), self.now)
        self.process.on_cycle([self.now - PERIOD, 0.0, 0.0, 0.0, 0.0, 0.0, -9.8], self.now)
        self.process.take_frames(self.now)

    @property
    def yaw_deg(self) -> float:
        return math.degrees(self.process.tube.yaw)


def samples() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times, rates and forces of a rest, a turn there by 12 rad that speeds up and slows down, and a rest."""
    times = BEGIN + np.arange(1, round((REST + TURN + AFTER + 10.0) * RATE)) / RATE
    random, into = np.random.default_rng(8), np.clip((times - BEGIN - REST) / TURN, 0.0, 1.0)
    rates = OFFSET + math.radians(NOISE_DPS) * random.standard_normal((len(times), 3))
    rates[:, 2] += 12.0 / TURN * (1.0 - np.cos(2.0 * math.pi * into))
    forces = np.array([0.3, -0.2, -9.7]) + 0.03 * random.standard_normal((len(times), 3))
    return times, rates, forces


@pytest.fixture(params=[LiveDevice, LiveLine], ids=["iio", "vn100"])
def live(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Live]:
    kind: Callable[[Path], Live] = request.param
    (tmp_path / "port").mkdir()
    sensor = kind(tmp_path / "port")
    yield sensor
    with contextlib.suppress(OSError, AttributeError):
        sensor.source.close()
        sensor.unplug()


def test_the_yaw_is_that_of_the_same_samples_replayed_and_a_pulled_cable_is_told(live: Live, tmp_path: Path) -> None:
    node, (times, rates, forces) = Run(tmp_path / "live", live.source), samples()
    read, last, yaws = [], 0, []
    cycles = round((REST + TURN + AFTER) / PERIOD)
    for _ in range(cycles):
        until = int(np.searchsorted(times, node.now + PERIOD, side="right"))
        part = slice(last, until)
        read.append(np.column_stack([times[part], live.send(times[part], rates[part], forces[part])]))
        last = until
        node.cycle(aided=node.now < BEGIN + REST - 1.0)
        yaws.append(node.yaw_deg)
    assert getattr(node.process, "told", []) == []
    rest = slice(last, last + 60)  # a record that goes on beyond the last cycle
    after = np.column_stack([times[rest], rates[rest], forces[rest]])
    np.save(tmp_path / "samples.npy", np.vstack([[BEGIN, *read[0][0, 1:]], *read, after]))
    again = Run(tmp_path / "again", imu_source(f"replay:{tmp_path / 'samples.npy'}"))
    for _ in range(cycles):
        again.cycle(aided=again.now < BEGIN + REST - 1.0)
    apart = math.remainder(yaws[-1] - again.yaw_deg, 360.0)
    assert abs(apart) < 0.01
    turned = math.remainder(yaws[-1] - math.degrees(1.0 + 12.0), 360.0)
    assert abs(turned) < 3.0 * math.degrees(math.sqrt(node.process.tube.yaw_var))
    assert node.process.tube.yaw_var == pytest.approx(again.process.tube.yaw_var, rel=0.05)

    live.unplug()
    for _ in range(6):
        node.cycle(aided=False)
    assert [code for code, _ in node.process.told] == ["sensor_failed"]
    live.plug()
    for _ in range(30):
        live.send(node.now + np.arange(1, 53) / RATE, rates[:52], forces[:52])
        node.cycle(aided=True, yaw=2.0)
    assert [code for code, _ in node.process.told] == ["sensor_failed", "sensor_back"]
    assert math.radians(node.yaw_deg) == pytest.approx(2.0, abs=1e-3)


def test_a_device_that_vanishes_in_mid_cycle_gives_no_mean_of_a_half(live: Live, tmp_path: Path) -> None:
    """Half of the cycle at 40 deg/s has come when the cable is pulled out: the cycle is lost, and is no rest either."""
    node, (times, rates, forces) = Run(tmp_path / "live", live.source), samples()
    for k in range(3):
        live.send(times[:52] + k * PERIOD, rates[:52], forces[:52])
        node.cycle(aided=True)
    turning = rates[:26] + np.array([0.0, 0.0, math.radians(40.0)])
    live.send(times[:26] + 3 * PERIOD, turning, forces[:26])
    live.unplug()
    node.cycle(aided=False)
    ((code, detail),) = node.process.told
    assert code == "sensor_failed"
    assert "gone" in detail or "expected about 53" in detail
    assert math.isnan(node.process.tube.raw.rate[2])
    live.plug()
    node.cycle(aided=False)
    for k in range(4):
        live.send(times[:52] + (5 + k) * PERIOD, rates[:52], forces[:52])
        node.cycle(aided=True)
    assert [code for code, _ in node.process.told] == ["sensor_failed", "sensor_back"]


def test_a_node_over_another_family_ends_with_its_name(tmp_path: Path) -> None:
    device = EmulatedDevice(tmp_path, name="bmp280")
    with pytest.raises(SensorError, match=r"expected a device icm42688, got bmp280 \(iio:device0\)"):
        TubeProcess(TubeSettings(1), tmp_path / "iio", imus=[IioImu("icm42688", device.sysfs, device.devices)])
    port = LiveLine(tmp_path)
    node = Run(tmp_path / "vn100", port.source)
    port.line.send(line_of(np.zeros(3), np.array([0.0, 0.0, -9.8]), "VNYPR") * 52)
    node.cycle(aided=False)
    ((code, detail),) = node.process.told
    assert code == "sensor_failed"
    assert "expected lines $VNIMU, got $VNYPR" in detail
    port.source.close()
    port.unplug()
