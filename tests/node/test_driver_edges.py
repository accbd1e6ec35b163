"""Drivers at the edge of what they read: both ends of every range, counters that wrap and jump, lost frames."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from emulated_mpu import CAPACITY, EmulatedMpu

from node.errors import SensorError
from node.kernels.arithmetic.formats import DEG, PERIOD, Array
from node.process.drivers.frame_clock import FrameClock, least_excess
from node.process.drivers.mpu_imu import MpuImu
from node.process.drivers.quadrature import LARGEST_JUMP, QuadratureFile
from node.process.drivers.timed import TimedImu

RATE, FORCE, GYRO, ACCELEROMETER = (0.0, 0.0, 1.0 * DEG), (0.2, -0.3, -9.7), 1, 2
LIMIT = 2000.0 * DEG, 1000.0


def driver() -> tuple[EmulatedMpu, MpuImu]:
    chip = EmulatedMpu()
    made = MpuImu(chip.connect, sleep=lambda _: None)
    made.start()
    return chip, made


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("flag", [GYRO, ACCELEROMETER])
def test_one_frame_at_either_end_of_its_range_marks_its_own_sensor(flag: int, axis: int, sign: float) -> None:
    chip, one = driver()
    chip.live(PERIOD, RATE, FORCE)
    assert one.read(0.0, PERIOD).saturated == 0
    rate, force = list(RATE), list(FORCE)
    (rate if flag == GYRO else force)[axis] = sign * LIMIT[flag - 1]
    chip.live(0.5 * PERIOD, RATE, FORCE)
    chip.live(0.03, tuple(rate), tuple(force))
    chip.live(0.5 * PERIOD - 0.03, RATE, FORCE)
    assert one.read(PERIOD, 2.0 * PERIOD).saturated == flag


@pytest.mark.parametrize("spare", [1, 0, -1])
def test_a_fifo_is_read_up_to_the_last_frame_that_it_holds(spare: int) -> None:
    chip, one = driver()
    frames = CAPACITY // 14 - spare
    for _ in range(2):
        chip.live(frames * 0.02 + 1e-6, RATE, FORCE)
        end = frames * 0.02
        if spare < 0:
            one._fresh = False
            with pytest.raises(SensorError, match="overflown"):
                one.read(0.0, end)
        else:
            one._fresh = False
            assert one.read(0.0, end).rate[2] == pytest.approx(RATE[2], rel=0.02)


def test_a_count_of_exactly_the_capacity_is_no_overflow_and_no_whole_frames() -> None:
    chip, one = driver()
    chip.fifo += bytes(CAPACITY)
    one._fresh = False
    with pytest.raises(SensorError, match="8 bytes beyond 36 whole frames in the FIFO"):
        one.read(0.0, 36 * 0.02)


@pytest.mark.parametrize(("low_pass", "delay"), [(184, 2.9e-3), (20, 9.9e-3), (5, 33.48e-3)])
def test_what_is_shown_is_earlier_by_the_delay_of_the_low_pass(low_pass: int, delay: float) -> None:
    """Register map, revision 2.1, delays of the gyroscope: the motion that a frame shows was that much before it."""
    found = {}
    for which in (low_pass, 92):  # 3.9 ms
        chip = EmulatedMpu()
        one = MpuImu(chip.connect, low_pass=which, sleep=lambda _: None)
        one.start()
        for k in range(1, 40):
            chip.live(PERIOD, RATE, FORCE)
            sample = one.read((k - 1) * PERIOD, k * PERIOD)
        found[which] = sample.late
    assert found[low_pass] - found[92] == pytest.approx(delay - 3.9e-3, abs=1e-9)
    assert -0.011 < found[92] < 0.03  # half a frame before its end, or a frame after


def test_a_fifo_that_overflowed_has_another_phase() -> None:
    """Emptied at a time of its own, its frames come at another phase: what was known of the one before is of no use."""
    chip, one = driver()
    late = []
    for turn in range(3):
        for k in range(1, 30):
            chip.live(PERIOD, RATE, FORCE)
            sample = one.read(turn * 100.0 + (k - 1) * PERIOD, turn * 100.0 + k * PERIOD)
        late.append(sample.late)
        chip.live(2.0, RATE, FORCE)  # and nothing is read for two seconds
        one._fresh = True  # as after a start, which reads what there is
        one.read(turn * 100.0 + 50.0, turn * 100.0 + 52.0)
        assert one._frames._reads == type(one._frames._reads)(maxlen=256)
        assert math.isnan(one._frames.newest)
    assert np.ptp(late) < 0.021


PERIODS = (0.02, 0.011, 1.0 / 123.0)


@pytest.mark.parametrize("period", PERIODS)
def test_after_one_read_a_frame_may_have_come_at_any_time_of_its_period(period: float) -> None:
    """Uniform over a period: its standard deviation is a square root of a twelfth of it, its middle half of it ago."""
    clock = FrameClock(1.0 / period)
    newest = clock.on_read(100.0, 26)
    assert clock.std == pytest.approx(period / math.sqrt(12.0), rel=1e-6)
    assert newest == pytest.approx(100.0 - 0.5 * period, rel=1e-9)
    assert clock.end - clock.newest == pytest.approx(0.5 * clock.period)


def test_the_time_of_a_frame_is_off_by_what_its_deviation_says() -> None:
    """Truth is a crystal of its own; normalised squares have the mean of one, from both sides, over the first reads."""
    normalised = []
    for seed in range(200):
        random = np.random.default_rng(seed)
        phase, clock, count, at = random.uniform(0.0, 0.02), FrameClock(50.0), 0, 0.0
        for _ in range(3):
            at += PERIOD + random.uniform(0.0, 0.02)
            total = math.floor((at - phase) / 0.02)
            newest = clock.on_read(at, total - count)
            count = total
        normalised.append(((newest - (phase + 0.02 * total)) / clock.std) ** 2)
    assert 0.4 < np.mean(normalised) < 2.0


@pytest.mark.parametrize("times", [1, 2])
def test_lost_frames_begin_another_phase(times: int) -> None:
    clock, at = FrameClock(50.0), 0.0
    for turn in range(times):
        shift = 0.007 * (turn + 1)
        for k in range(30):
            at += 0.53
            frames = math.floor((at + shift) / 0.02) - math.floor((at - 0.53 + shift) / 0.02)
            newest = clock.on_read(at, frames)
            true = math.floor((at + shift) / 0.02) * 0.02 - shift
            if k:
                assert abs(newest - true) <= 0.5 * 0.02 + 1e-9
        clock.on_read(at + 0.3, 2)  # of fifteen
        at += 0.3
        assert clock.std == pytest.approx(clock.period / math.sqrt(12.0), rel=1e-6)


def dated_reads(
    seed: int, off: float, reads: int, late: tuple[int, ...] = (), moved: int | None = None
) -> tuple[Array, Array]:
    """Errors and stated deviations (reads,), s, of a clock whose reads are off their time by ``off`` (s).

    The crystal is its own and 0.4 % fast; the reads numbered in ``late`` come 30 ms late besides, and from the read
    ``moved`` on their time is 20 ms behind.
    """
    random, period = np.random.default_rng(seed), 0.02 / 1.004
    phase, clock, taken = period * random.uniform(), FrameClock(50.0), 0
    error, std = np.zeros(reads), np.zeros(reads)
    for k in range(reads):
        at = (k + 1) * PERIOD
        behind = 0.02 if moved is not None and k >= moved else 0.0
        done = at + behind + off * random.standard_normal() + (0.03 if k in late else 0.0)
        count = math.floor((done - phase) / period)
        error[k] = clock.on_read(at, count - taken) - (phase + period * count - behind)
        std[k], taken = clock.std, count
    return error, std


def test_frames_of_reads_that_are_off_their_time_are_dated_as_well_as_is_said() -> None:
    """Reads 5 ms off contradict each other, and bounds that they set by chance would be 4 ms off, stated as 1 ms."""
    found = [dated_reads(seed, 5e-3, 300) for seed in range(12)]
    error, std = (np.concatenate([one[k][60:] for one in found]) for k in range(2))
    assert math.sqrt(np.mean(error**2)) < 2e-3
    assert np.max(std) < 5e-3
    assert 0.5 < np.mean(error**2 / std**2) < 2.0
    assert np.mean(np.abs(error) > 3.0 * std) < 0.02


@pytest.mark.parametrize("seed", range(4))
def test_two_late_reads_spoil_the_date_of_no_frames_but_those_around_them(seed: int) -> None:
    """Sixteen reads after the last of them it is bounds again that date, and not a fit that has the late ones in it."""
    error, std = dated_reads(seed, 0.0, 200, (80, 120))
    assert np.median(np.abs(error[140:])) < 1e-3
    assert np.median(std[140:]) < 6e-4


def test_a_time_that_is_moved_among_reads_that_are_off_it_dates_anew() -> None:
    """A fit to reads on both sides of the step would be 5 ms off for two minutes, stated as 1.3 ms."""
    found = [dated_reads(seed, 5e-3, 360, moved=220) for seed in range(8)]
    error, std = (np.concatenate([one[k][270:] for one in found]) for k in range(2))
    assert math.sqrt(np.mean(error**2)) < 3e-3
    assert 0.5 < np.mean(error**2 / std**2) < 2.0


def test_reads_exceed_their_bounds_least_where_their_excesses_cancel() -> None:
    """At the least sum of squares its gradient is 0, and the variance is that of the formula, by matrices."""
    random = np.random.default_rng(3)
    k = np.arange(120)
    t = PERIOD * k
    n = np.floor((t + 5e-3 * random.standard_normal(120) - 0.007) / 0.02)
    n -= n[-1]
    phase, period, var = least_excess(t, n, t[-1] - 0.012, 0.0201)
    off = t - period * n - phase
    excess = np.where(off < 0.0, off, np.maximum(off - period, 0.0))
    beyond = excess != 0.0
    x = np.stack([np.ones(120), np.where(off < 0.0, n, n + 1.0)], axis=1)[beyond]
    e = excess[beyond]
    assert period == pytest.approx(0.02, rel=2e-4)
    assert 10 < np.sum(off < 0.0) < 60
    assert 10 < np.sum(off > period) < 60
    np.testing.assert_allclose(x.T @ e, 0.0, atol=1e-9)
    inverse = np.linalg.inv(x.T @ x)
    assert var == pytest.approx((inverse @ (x.T * e**2) @ x @ inverse)[0, 0], rel=1e-6)


@pytest.mark.parametrize("exceeding", [0, 1, 2])
def test_fewer_than_three_reads_beyond_their_bounds_tell_nothing(exceeding: int) -> None:
    t, n = PERIOD * np.arange(20.0), np.floor(PERIOD * np.arange(20.0) / 0.02)
    n[[3, 12][:exceeding]] += 2.0
    phase, period, var = least_excess(t, n - n[-1], 0.02 * n[-1], 0.02)
    assert phase == 0.02 * n[-1]
    assert period == 0.02
    assert var == 0.0


class Counter:
    """A counter's file."""

    def __init__(self, folder: Path, bits: int, raw: int) -> None:
        self.path, self.span = folder / "count", 1 << bits
        self.write(raw)
        self.driver = QuadratureFile(self.path, bits)
        self.driver.start()
        self.now = 0.0

    def write(self, raw: int) -> None:
        self.path.write_text(f"{raw % self.span}\n")

    def read(self, raw: int) -> tuple[int, bool]:
        self.write(raw)
        self.now += 0.5
        sample = self.driver.read(self.now)
        return sample.count, sample.rising


@pytest.mark.parametrize("bits", [16, 32])
@pytest.mark.parametrize("first", [3, -3, 1000])
def test_a_counter_is_followed_through_zero_both_ways(tmp_path: Path, bits: int, first: int) -> None:
    counter = Counter(tmp_path, bits, first)
    total = 0
    for step in (10, 40, -70, -5, 2000, -4000, 3):
        total += step
        assert counter.read(first + total) == (total, step > 0)


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("beyond", [0, 1])
def test_a_counter_jumps_by_what_a_head_can_turn_and_no_more_either_way(tmp_path: Path, sign: int, beyond: int) -> None:
    counter = Counter(tmp_path, 32, 50_000)
    jump = sign * (LARGEST_JUMP + beyond)
    if beyond:
        with pytest.raises(SensorError, match=f"got {jump}"):
            counter.read(50_000 + jump)
    else:
        assert counter.read(50_000 + jump) == (jump, sign > 0)


def test_a_recording_is_a_mean_over_any_part_of_its_rows(tmp_path: Path) -> None:
    """Rows of unequal lengths and values; a part of a row counts by its length."""
    times, rates = (10.0, 11.0, 13.0, 13.5), (None, 2.0, -1.0, 6.0)
    rows = [f"{t},{0 if w is None else w},0,0,0,0,-9.8" for t, w in zip(times, rates, strict=True)]
    (tmp_path / "imu.csv").write_text("\n".join(rows) + "\n")
    imu = TimedImu(tmp_path / "imu.csv")
    imu.start()
    assert imu.read(10.0, 11.0).rate[0] == pytest.approx(2.0)
    assert imu.read(10.25, 10.5).rate[0] == pytest.approx(2.0)
    assert imu.read(10.5, 11.5).rate[0] == pytest.approx((0.5 * 2.0 - 0.5 * 1.0) / 1.0)
    assert imu.read(10.9, 13.1).rate[0] == pytest.approx((0.1 * 2.0 - 2.0 * 1.0 + 0.1 * 6.0) / 2.2)
