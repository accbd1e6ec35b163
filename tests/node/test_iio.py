"""Sensors by the kernel's industrial I/O, against a device in a folder: the turn of a record of its samples."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest
from emulated_iio import EmulatedDevice

from node.errors import SensorError
from node.process.board_sensors import check_imu
from node.process.drivers.choice import imu_source
from node.process.drivers.iio_imu import IioImu
from node.process.drivers.replay_drivers import ReplayImu
from node.process.drivers.source import SafeImu
from telemetry.messages import Severity

PERIOD = 0.526
START = 5000.0


def samples(count: int, begin: float = START, rate: float = 100.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Stamps, rates and forces of a sensor that speeds up and slows down about z."""
    times = begin + np.arange(count) / rate
    rates = np.zeros((count, 3))
    rates[:, 2] = 0.6 * (1.0 - np.cos(2.0 * math.pi * (times - START) / 17.0))
    return times, rates, np.tile([0.3, -0.2, 9.7], (count, 1))


def test_a_device_turns_by_what_a_record_of_its_samples_does(tmp_path: Path) -> None:
    device = EmulatedDevice(tmp_path)
    source = IioImu("mpu6050", device.sysfs, device.devices)
    source.start()
    times, rates, forces = samples(6000)
    turned, windows, read = 0.0, 0.0, []
    for k in range(100):
        inside = (times >= START + k * PERIOD) & (times < START + (k + 1) * PERIOD)
        read.append(np.column_stack([times[inside], device.live(times[inside], rates[inside], forces[inside])]))
        end = START + (k + 1) * PERIOD
        sample = source.read(end - PERIOD, end)
        assert sample.force == pytest.approx((0.3, -0.2, 9.7), abs=0.003)
        assert sample.temperature == pytest.approx(0.001 * (12420 - 3600) * 2.941176)
        assert 0.0 <= sample.late < 0.0101
        if k:
            shown = end - sample.late
            turned += sample.rate[2] * (shown - windows)
        windows = end - sample.late
    rows = np.vstack(read)
    np.save(tmp_path / "samples.npy", rows)
    replayed = ReplayImu(tmp_path / "samples.npy")
    replayed.start()
    first, last = rows[len(read[0]) - 1, 0], rows[-1, 0]
    replayed.read(START, first)
    again = replayed.read(first, last).rate[2] * (last - first)
    assert math.degrees(abs(turned - again)) < 0.01
    assert turned > math.pi


def test_channels_clock_and_buffer_are_set_as_the_kernel_asks(tmp_path: Path) -> None:
    device = EmulatedDevice(tmp_path)
    source = IioImu("iio:device0", device.sysfs, device.devices)
    source.start()
    assert device.attribute("buffer/enable") == "1"
    assert device.attribute("buffer/length") == "2048"
    assert device.attribute("current_timestamp_clock") == "monotonic"
    assert device.attribute("scan_elements/in_anglvel_z_en") == "1"
    assert device.attribute("scan_elements/in_timestamp_en") == "1"
    assert device.attribute("scan_elements/in_magn_x_en") == "0"


def test_packed_words_shifts_and_a_scale_of_each_axis_are_read(tmp_path: Path) -> None:
    device = EmulatedDevice(tmp_path)
    (device.folder / "in_anglvel_x_scale").write_text("0.002129448")
    for axis in "xyz":
        (device.folder / "scan_elements" / f"in_accel_{axis}_type").write_text("be:s12/16>>4")
    source = IioImu("mpu6050", device.sysfs, device.devices)
    source.start()
    device.live(np.array([1.0, 1.01]), np.array([[0.1, 0.1, -0.1]] * 2), np.array([[-0.766, 3.0, 9.7]] * 2))
    sample = source.read(0.5, 1.026)
    assert sample.rate == pytest.approx((0.2, 0.1, -0.1), abs=0.002)
    assert sample.force == pytest.approx((-0.766 / 16, 3.0 / 16, 9.7 / 16), abs=0.005)


def test_a_sensor_at_its_range_says_so(tmp_path: Path) -> None:
    device = EmulatedDevice(tmp_path)
    source = IioImu("mpu6050", device.sysfs, device.devices)
    source.start()
    times, rates, forces = samples(50)
    rates[20, 2], found = 99.0, []
    for what in (rates, np.zeros_like(rates)):
        device.live(times, what, forces)
        times = times + 0.5
        found.append(source.read(times[0] - 0.5, times[0]).saturated)
    assert found == [1, 0]


def test_a_buffer_that_overran_and_a_device_that_fell_silent_cost_their_cycles(tmp_path: Path) -> None:
    device = EmulatedDevice(tmp_path)
    source = IioImu("mpu6050", device.sysfs, device.devices)
    source.start()
    device.live(*samples(50))
    source.read(START, START + 0.5)
    times, rates, forces = samples(100, START + 0.5)
    kept = (times < START + 0.7) | (times > START + 1.2)
    device.live(times[kept], rates[kept], forces[kept])
    with pytest.raises(SensorError, match=r"frames are missing, 5\d0 ms between two of 10\.0 ms"):
        source.read(START + 0.5, START + 1.5)
    device.live(*samples(50, START + 1.5))
    assert math.isfinite(source.read(START + 1.5, START + 2.0).rate[2])
    with pytest.raises(SensorError, match="expected about 50 frames, got 0"):
        source.read(START + 2.0, START + 2.5)


def test_a_device_that_is_unplugged_is_told_once_and_comes_back(tmp_path: Path) -> None:
    device = EmulatedDevice(tmp_path / "first")
    source = IioImu("mpu6050", device.sysfs, device.devices)
    source.start()
    said: list[tuple[Severity, str]] = []
    safe = SafeImu(source, lambda severity, code, _: said.append((severity, code)))
    device.live(*samples(50))
    assert math.isfinite(safe.read(START, START + 0.5).rate[2])
    device.unplug()
    assert all(math.isnan(safe.read(START + 0.5, START + 1.0).rate[2]) for _ in range(4))
    again = EmulatedDevice(tmp_path / "second")
    source._sysfs, source._devices = again.sysfs, again.devices
    safe.read(START + 1.0, START + 1.5)
    again.live(*samples(50, START + 1.5))
    assert math.isfinite(safe.read(START + 1.5, START + 2.0).rate[2])
    assert said == [(Severity.ERROR, "sensor_failed"), (Severity.WARNING, "sensor_back")]


def test_another_device_and_one_without_a_gyroscope_are_named(tmp_path: Path) -> None:
    device = EmulatedDevice(tmp_path, name="bmp280")
    with pytest.raises(SensorError, match=r"iio: expected a device icm42688, got bmp280 \(iio:device0\)"):
        IioImu("icm42688", device.sysfs, device.devices).start()
    (device.folder / "scan_elements" / "in_anglvel_y_en").unlink()
    with pytest.raises(SensorError, match="it has no in_anglvel_y"):
        IioImu("bmp280", device.sysfs, device.devices).start()
    with pytest.raises(SensorError, match="expected a device icm42688, got none"):
        IioImu("icm42688", tmp_path / "nowhere", device.devices).start()
    (device.folder / "scan_elements" / "in_anglvel_y_en").write_text("0")
    (device.folder / "in_accel_scale").write_text("fast")
    with pytest.raises(SensorError, match="in_accel_scale: expected a number"):
        IioImu("bmp280", device.sysfs, device.devices).start()
    assert isinstance(imu_source("iio:icm42688"), IioImu)


def test_a_check_of_a_board_has_its_rate_and_jitter_by_its_stamps(tmp_path: Path) -> None:
    """Set to 100 Hz, a crystal that gives 104 with stamps that shake by half a millisecond."""
    device, random = EmulatedDevice(tmp_path), np.random.default_rng(4)
    source = IioImu("mpu6050", device.sysfs, device.devices)
    now, sent = START, 0

    def live(seconds: float) -> None:
        nonlocal now, sent
        count = int(104.0 * (now + seconds - START)) - sent
        times = START + (sent + np.arange(count)) / 104.0 + 5e-4 * random.standard_normal(count)
        sent += count
        noise = 0.002 * random.standard_normal((count, 3))
        device.live(times, noise, noise + np.array([0.3, -0.2, -9.79]))
        now += seconds

    found = {line.part: line for line in check_imu(source, clock=lambda: now, sleep=live)}
    assert found["sensor"].text == "mpu6050 by the kernel's driver, 100.0 Hz"
    shown = re.fullmatch(r"(\d+\.\d) Hz, set to 100\.0, jitter (\d\.\d\d) ms", found["rate"].text)
    assert shown is not None
    rate, jitter = shown.groups()
    assert float(rate) == pytest.approx(104.0, abs=0.3)
    assert float(jitter) == pytest.approx(0.5 * math.sqrt(2.0), abs=0.2)  # of a difference of two stamps
    assert all(line.good for line in found.values())
