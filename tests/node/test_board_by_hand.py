"""A board and its sensors by hand: each judgement at its bound, each part of what is told, each line once more."""

from __future__ import annotations

import json
import math
import os
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from emulated_iio import FORCE_LSB, RATE_LSB, EmulatedDevice
from test_vn100 import Line, line, line_of, started

from node.errors import SensorError
from node.firmware.encoder_node import EncoderSample
from node.process import board_places
from node.process.board_command import BoardRequest
from node.process.board_findings import BoardFinding
from node.process.board_places import check_disk
from node.process.board_sensors import check_encoder, check_imu
from node.process.drivers.iio_imu import IioImu
from node.process.drivers.source import ImuSample
from node.process.drivers.timed import TimedImu
from node.process.drivers.vn100 import checked_words
from node.process.reading import imu_reading

__all__ = ["line"]  # a fixture

GRAVITY = 9.80665


class Told:
    """A source that gives what it was told, cycle by cycle."""

    def __init__(self, samples: list[ImuSample], **more: float) -> None:
        self._samples = iter(samples)
        self.description = "told"
        self.__dict__.update(more)

    def start(self) -> None:
        pass

    def read(self, begin: float, end: float) -> ImuSample:
        return next(self._samples)

    def close(self) -> None:
        pass


def samples(noise: float = math.radians(0.01), size: float = GRAVITY, bits: tuple[int, ...] = ()) -> list[ImuSample]:
    """Eight cycles whose rates have this deviation over the last seven; some at their range."""
    swing = noise / math.sqrt(2.0 / 7.0)  # of 0, 1, 0, 1, 0, 1, 0 about their mean, over six
    return [
        ImuSample(
            (swing * (k % 2 == 0), 0.5 * swing * (k % 2), 0.3 * swing * (k % 2)),
            (0.001 * k, 0.002 * k, -size - 0.001 * k),
            25.0,
            bits[k] if k < len(bits) else 0,
        )
        for k in range(8)
    ]


def judged(source: Any) -> dict[str, tuple[bool, str]]:
    found = check_imu(source, clock=lambda: 0.0, sleep=lambda _: None)
    return {one.part: (one.good, one.text) for one in found}


@pytest.mark.parametrize(("noise_deg", "is_good"), [(0.149, True), (0.151, False)])
def test_noise_is_the_deviation_of_a_sample(noise_deg: float, is_good: bool) -> None:
    good, text = judged(Told(samples(math.radians(noise_deg))))["noise"]
    assert good == is_good
    assert f"{noise_deg:.4f} deg/s of a cycle at rest" in text


@pytest.mark.parametrize(("part", "is_good"), [(0.86, True), (0.84, False), (1.14, True), (1.16, False)])
def test_gravity_may_be_off_by_fifteen_percent(part: float, is_good: bool) -> None:
    assert judged(Told(samples(size=part * GRAVITY)))["gravity"][0] == is_good


@pytest.mark.parametrize(("counted", "is_good"), [(47.6, True), (47.4, False), (52.4, True), (52.6, False)])
def test_the_rate_of_frames_may_be_off_by_a_twentieth(counted: float, is_good: bool) -> None:
    found = judged(Told(samples(), sample_rate=50.0, counted_rate=counted))["rate"]
    assert found == (is_good, f"{counted:.1f} Hz, set to 50.0")
    assert "rate" not in judged(Told(samples()))


@pytest.mark.parametrize(
    ("bits", "which"),
    [((0, 1), "the gyroscope"), ((0, 0, 2, 0), "the accelerometer"), ((0, 1, 2), "both"), ((0, 3), "both")],
)
def test_a_sensor_at_its_range_in_any_cycle_is_named(bits: tuple[int, ...], which: str) -> None:
    assert judged(Told(samples(bits=bits)))["ranges"] == (False, f"expected none, got {which} at its range")
    assert judged(Told(samples(bits=(3,))))["ranges"][0]  # the first cycle has no begin


class Turned:
    """A counter that has turned by so many counts between its first read and its last."""

    def __init__(self, counts: int) -> None:
        self._counts, self._reads = counts, 0

    def start(self) -> None:
        pass

    def read(self, now: float) -> EncoderSample:
        self._reads += 1
        return EncoderSample(1000 + (self._counts if self._reads > 1 else 0), 0.0, rising=True)

    def close(self) -> None:
        pass


@pytest.mark.parametrize(
    ("turn_deg", "counts", "wrong"),
    [
        (None, 11, ""), (None, 12, "count"), (None, -12, "count"), (90.0, 1024, ""), (-90.0, -1024, ""),
        (90.0, -1024, "direction"), (-90.0, 1024, "direction"), (90.0, 923, ""), (90.0, 920, "count"),
        (-90.0, -1125, ""), (-90.0, -1128, "count"),
    ],
)  # fmt: skip
def test_a_counter_is_judged_by_the_turn_that_is_told(turn_deg: float | None, counts: int, wrong: str) -> None:
    found = check_encoder(Turned(counts), turn_deg, clock=lambda: 0.0)
    assert [one.part for one in found if not one.good] == ([wrong] if wrong else [])
    assert f"{counts * 360.0 / 4096.0:.2f} deg" in found[-1].text or wrong == ""


@pytest.mark.parametrize(("tx", "rx", "fault"), [(95, 95, ""), (96, 0, "tx"), (0, 96, "rx")])
def test_a_controller_may_have_ninety_five_errors_each_way(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, tx: int, rx: int, fault: str
) -> None:
    data: dict[str, Any] = {
        "ctrlmode": ["FD"], "state": "ERROR-ACTIVE", "bittiming": {"bitrate": 500000},
        "berr_counter": {"tx": tx, "rx": rx}, "data_bittiming": {"bitrate": 2000000},
    }  # fmt: skip
    row = {"flags": ["UP"], "link_type": "can", "linkinfo": {"info_data": data}}
    program = tmp_path / "ip"

    def answer() -> None:
        program.write_text(f"#!/bin/sh\ncat <<'END'\n{json.dumps([row])}\nEND\n")
        program.chmod(0o755)

    answer()
    monkeypatch.setenv("PATH", str(tmp_path), prepend=":")
    for is_fd in (True, False):
        found = board_places.check_can("can", "can0", is_fd=is_fd)
        assert found.good == (fault == "")
        assert not fault or f"'{fault}': 96" in found.text
    data["ctrlmode"] = []
    answer()
    assert not board_places.check_can("can", "can0", is_fd=True).good
    classic = board_places.check_can("can", "can0", is_fd=False)
    assert classic.good == (fault == "")


def test_a_board_is_asked_for_the_kind_of_controller_that_was_told(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    asked: list[tuple[str, bool]] = []

    def check_can(part: str, interface: str, *, is_fd: bool) -> BoardFinding:
        asked.append((interface, is_fd))
        return BoardFinding(part, True, "")

    monkeypatch.setattr(board_places, "check_can", check_can)
    for is_classic in (False, True):
        BoardRequest(0, (), None, None, None, ("can0", "can1"), is_classic, tmp_path, None).findings()
    assert asked == [("can0", True), ("can1", True), ("can0", False), ("can1", False)]


def test_a_disk_is_good_where_bytes_reach_it_and_two_hundred_megabytes_are_free(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for free, is_good in ((200_000_000, True), (199_000_000, False)):
        monkeypatch.setattr("shutil.disk_usage", lambda _, free=free: SimpleNamespace(free=free))
        found = check_disk(tmp_path / "state")
        assert (found.good, f"{free // 10**6} MB free" in found.text) == (is_good, True)
    assert list((tmp_path / "state").iterdir()) == []

    def refuse(_: int) -> None:
        raise OSError(5, "Input/output error")

    monkeypatch.setattr(os, "fsync", refuse)
    assert check_disk(tmp_path / "state") == BoardFinding("disk", False, f"{tmp_path / 'state'}: Input/output error")


# lines and frames


@pytest.mark.parametrize(("text", "digits"), [("A,C", "2E"), ("AB", "03"), ("VNRRG,01", "72")])
def test_a_line_has_two_digits_of_checksum(text: str, digits: str) -> None:
    """65 ^ 44 ^ 67 is 46, and 65 ^ 66 is 3; the third is as the manual prints it."""
    assert checked_words(f"${text}*{digits}\r".encode()) == text.split(",")
    assert checked_words(f"${text}*{digits.lstrip('0')}\r".encode()) == (None if digits[0] == "0" else text.split(","))
    assert checked_words(f"${text}*{int(digits, 16) ^ 1:02X}\r".encode()) is None


def test_lines_of_a_start_before_are_not_joined_to_those_of_the_next_and_other_families_do_no_harm(line: Line) -> None:
    rate, force = np.array([0.1, 0.2, 0.3]), np.array([0.0, 0.1, -9.8])
    whole = line_of(rate, force)
    source = started(line)
    line.send(whole * 53 + whole[:40])
    assert source.read(0.0, 0.53).rate == pytest.approx(rate)
    source.start()
    line.send(whole * 53 + line_of(rate, force, "VNYMR"))
    assert source.read(1.0, 1.53).force == pytest.approx(force)
    assert source.dropped == 0
    source.close()


def counts_of(device: EmulatedDevice, stamps: np.ndarray, rates_z: np.ndarray) -> None:
    rates = np.column_stack([np.zeros((len(stamps), 2)), rates_z])
    device.live(stamps, rates, np.tile([0.0, 0.0, 9.8], (len(stamps), 1)))


def test_a_frame_stands_for_the_time_since_the_one_before(tmp_path: Path) -> None:
    """Frames that come at uneven steps count by their steps; of the first read nothing is known of the first."""
    device = EmulatedDevice(tmp_path)
    source = IioImu("mpu6050", device.sysfs, device.devices)
    source.start()
    first = 100.0 + 0.01 * np.arange(50)
    counts_of(device, first, np.zeros(50))
    source.read(100.0, 100.5)
    steps = np.where(np.arange(50) % 2, 0.016, 0.004)
    rates = np.where(np.arange(50) % 2, 1.0, 0.0)
    counts_of(device, first[-1] + np.cumsum(steps), rates)
    assert source.read(100.5, 101.0).rate[2] == pytest.approx(0.8, abs=RATE_LSB)


@pytest.mark.parametrize(("missing", "is_lost"), [(1, False), (2, True)])
def test_one_frame_may_be_missing_and_two_are_a_cycle_lost(tmp_path: Path, missing: int, is_lost: bool) -> None:
    device = EmulatedDevice(tmp_path)
    source = IioImu("mpu6050", device.sysfs, device.devices)
    source.start()
    stamps = 100.0 + 0.01 * np.arange(120)
    counts_of(device, stamps[:50], np.zeros(50))
    source.read(100.0, 100.5)
    kept = np.concatenate([stamps[50:70], stamps[70 + missing : 100]])
    counts_of(device, kept, np.full(len(kept), 0.5))
    if is_lost:
        with pytest.raises(SensorError, match=r"frames are missing, 30 ms between two of 10\.0 ms"):
            source.read(100.5, 101.0)
    else:
        assert source.read(100.5, 101.0).force[2] == pytest.approx(9.8, abs=FORCE_LSB)


@pytest.mark.parametrize(
    ("begin", "end", "bits"),
    [(0.4, 0.9, 0), (0.4, 0.95, 1), (0.9, 1.0, 1), (1.1, 1.2, 1), (1.35, 1.9, 1), (1.4, 1.9, 0)],
)
def test_a_cycle_has_the_range_of_every_row_that_it_reaches_into(
    tmp_path: Path, begin: float, end: float, bits: int
) -> None:
    """The rows of 1.0 to 1.4 s stand at the gyroscope's range; each is the mean since the row before."""
    times = 0.1 * np.arange(40)
    readings = np.random.default_rng(5).uniform(-0.5, 0.5, (40, 6)) - [0.0, 0.0, 0.0, 0.0, 0.0, 9.8]
    readings[10:15, 2] = 2.0
    np.save(tmp_path / "imu.npy", np.column_stack([times, readings]))
    source = TimedImu(tmp_path / "imu.npy")
    source.start()
    assert source.read(begin + 1e-9, end).saturated == bits


@pytest.mark.parametrize("count", range(22))
def test_an_imu_s_numbers_are_six_to_ten_or_those_and_nine_parts(count: int) -> None:
    numbers = [float(k + 1) for k in range(count)]
    found = imu_reading(numbers, 0.0, 0.5)
    is_taken = 6 <= count <= 10 or count == 19
    assert math.isfinite(found.rate[0]) == is_taken
    if is_taken:
        full = [*numbers, *[math.nan] * 4][:10]
        assert (*found.rate, *found.force) == tuple(numbers[:6])
        assert found.temperature == (full[6] if count > 6 else found.temperature)
        assert (found.saturated, found.late, found.late_std) == (
            8 if count > 7 else 0, 9.0 if count > 8 else 0.0, 10.0 if count > 9 else 0.0,
        )  # fmt: skip
        assert found.parts == tuple(numbers[10:])
