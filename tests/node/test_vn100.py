"""A VN-100 on a serial line: a pseudo-terminal whose other end writes its lines."""

from __future__ import annotations

import contextlib
import functools
import math
import os
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from emulated_vn100 import Line, line_of

from node.errors import SensorError
from node.process.drivers.choice import imu_source
from node.process.drivers.recorded_imu import RecordedMeans, load_record
from node.process.drivers.source import SafeImu
from node.process.drivers.vn100 import Vn100, line_checksum
from telemetry.messages import Severity
from telemetry.records.record_reading import RecordReading

PERIOD = 0.53


@pytest.fixture
def line() -> Iterator[Line]:
    line = Line()
    yield line
    with contextlib.suppress(OSError):  # a test may have cut it
        line.cut()


def started(line: Line) -> Vn100:
    source = Vn100(line.path)
    source.start()
    return source


def test_it_turns_by_what_a_record_of_its_samples_does(line: Line, tmp_path: Path) -> None:
    source = started(line)
    said = b""
    while said.count(b"\n") < 2:
        said += os.read(line.end, 100)
    asked = said.decode().split()
    assert [order[:-3] for order in asked] == ["$VNWRG,06,19", "$VNWRG,07,100"]
    assert all(int(order[-2:], 16) == functools.reduce(lambda a, b: a ^ b, order[1:-3].encode()) for order in asked)
    times = np.arange(1, 5301) / 100.0
    rates = np.column_stack([0.01 * np.ones(5300), np.zeros(5300), 0.8 * np.sin(0.3 * times)])
    forces = np.tile([0.2, -0.1, -9.79], (5300, 1))
    turned = 0.0
    for k in range(100):
        for row in range(53 * k, 53 * k + 53):
            line.send(line_of(rates[row], forces[row]))
        sample = source.read(k * PERIOD, (k + 1) * PERIOD)
        assert sample.force == pytest.approx((0.2, -0.1, -9.79))
        assert sample.temperature == pytest.approx(31.5)
        turned += sample.rate[2] * PERIOD
    whole = np.vstack([np.zeros((1, 7)), np.column_stack([times, rates, forces])])
    np.save(tmp_path / "record.npy", whole)
    means = RecordedMeans(load_record(tmp_path / "record.npy", RecordReading()))
    again = sum(means.mean(k * PERIOD, (k + 1) * PERIOD).rate[2] * PERIOD for k in range(99))
    last = 0.01 * float(np.sum(rates[53 * 99 :, 2]))
    assert math.degrees(abs(turned - again - last)) < 0.01


def test_it_tells_the_eighths_of_a_whole_cycle(line: Line) -> None:
    """A head that starts in the middle of a cycle: four eighths at rest, four at 0.4 rad/s."""
    source = started(line)
    still, turns = (line_of(np.array([0.1, 0.0, rate]), np.array([0.0, 0.0, 9.8])) for rate in (0.0, 0.4))
    line.send(still * 52)
    assert source.read(0.0, 0.52).parts == ()  # what came before the first read is not known to be a cycle
    line.send(still * 26 + turns * 26)
    assert source.read(0.52, 1.04).parts == pytest.approx((0.0, *[0.0] * 4, *[0.4] * 4), abs=1e-9)


def test_the_checksum_is_the_manual_s() -> None:
    assert line_checksum(b"VNRRG,8") == 0x4B


def test_a_damaged_line_is_dropped_and_a_cut_one_waits_for_its_end(line: Line) -> None:
    source = started(line)
    good = line_of(np.array([0.1, 0.2, 0.3]), np.array([0.0, 0.0, 9.8]))
    bad = good.replace(b"+00.30", b"+09.30")
    line.send(good * 30 + bad + b"\xff\x00garbage\r\n" + good[:40])
    assert source.read(0.0, 0.5).rate == pytest.approx((0.1, 0.2, 0.3))
    assert source.dropped == 2
    line.send(good[40:] + good * 29)
    assert source.read(0.5, 1.0).rate == pytest.approx((0.1, 0.2, 0.3))
    assert source.dropped == 2


def test_silence_another_family_and_a_sensor_at_its_range_are_named(line: Line) -> None:
    source = started(line)
    good = line_of(np.array([0.0, 0.0, 35.0]), np.array([0.0, 0.0, 9.8]))
    line.send(good * 50)
    assert source.read(0.0, 0.5).saturated == 1
    with pytest.raises(SensorError, match="expected about 50 lines, got 0"):
        source.read(0.5, 1.0)
    line.send(line_of(np.zeros(3), np.zeros(3), "VNYPR") * 50)
    with pytest.raises(SensorError, match=r"expected lines \$VNIMU, got \$VNYPR"):
        source.read(1.0, 1.5)
    with pytest.raises(SensorError, match="vn100: /dev/null"):
        Vn100(Path("/dev/null")).start()
    with pytest.raises(SensorError, match="not started"):
        Vn100(line.path).read(0.0, 0.5)
    assert isinstance(imu_source(f"vn100:{line.path}"), Vn100)


def test_a_cycle_of_which_half_is_missing_is_lost(line: Line) -> None:
    source = started(line)
    good = line_of(np.zeros(3), np.array([0.0, 0.0, 9.8]))
    line.send(good * 50)
    source.read(0.0, 0.5)
    line.send(good * 26)
    assert math.isfinite(source.read(0.5, 1.0).rate[2])
    line.send(good * 24)
    with pytest.raises(SensorError, match="expected about 50 lines, got 24"):
        source.read(1.0, 1.5)


def test_a_line_that_is_pulled_out_is_told_once_and_comes_back(line: Line, tmp_path: Path) -> None:
    port = tmp_path / "ttyUSB0"
    port.symlink_to(line.path)
    source = Vn100(port)
    source.start()
    said: list[tuple[Severity, str]] = []
    safe = SafeImu(source, lambda severity, code, _: said.append((severity, code)))
    good = line_of(np.zeros(3), np.array([0.0, 0.0, 9.8]))
    line.send(good * 50)
    assert math.isfinite(safe.read(0.0, 0.5).rate[2])
    line.cut()
    port.unlink()
    assert all(math.isnan(safe.read(0.5, 1.0).rate[2]) for _ in range(4))
    again = Line()
    port.symlink_to(again.path)
    assert math.isnan(safe.read(1.0, 1.5).rate[2])
    again.send(good * 50)
    assert math.isfinite(safe.read(1.5, 2.0).rate[2])
    assert said == [(Severity.ERROR, "sensor_failed"), (Severity.WARNING, "sensor_back")]
    source.close()
    again.cut()


def test_lines_from_before_it_was_opened_are_not_of_its_first_reading(line: Line) -> None:
    """A cable that is plugged in before the node looks, on a line without a reader: what does not fit is lost."""
    turning, still = (line_of(np.array([0.0, 0.0, rate]), np.array([0.0, 0.0, 9.8])) for rate in (0.7, 0.1))
    line.send(turning * 500)
    source = started(line)
    line.send(still * 50)
    assert source.read(0.0, 0.5).rate == pytest.approx((0.0, 0.0, 0.1))
    assert source.dropped == 0


@pytest.mark.parametrize(
    ("rate", "force", "bits"),
    [(34.8, 156.9, 0), (34.9, 0.0, 1), (-34.9, 0.0, 1), (0.0, 157.0, 2), (0.0, -157.0, 2), (35.0, 158.0, 3)],
)
def test_each_sensor_at_its_range_has_a_bit_of_its_own(line: Line, rate: float, force: float, bits: int) -> None:
    source = started(line)
    for axis in range(3):
        at_range = np.eye(3)[axis]
        line.send(line_of(rate * at_range, force * at_range) + line_of(np.zeros(3), np.zeros(3)))
        assert source.read(0.02 * axis, 0.02 * axis + 0.02).saturated == bits
