"""Recordings played by the clock: the integral is kept whatever the cycles, and what is no recording is refused."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from node.errors import NodeConfigurationError, SensorError
from node.process.drivers.choice import encoder_source, imu_source
from node.process.drivers.timed import TimedEncoder, TimedImu

TIMES = 100.0 + 0.25 * np.arange(41)


def imu_of(path: Path, rows: np.ndarray) -> TimedImu:
    np.save(path / "imu.npy", rows)
    source = TimedImu(path / "imu.npy")
    source.start()
    return source


def test_any_cycles_add_up_to_what_was_recorded(tmp_path: Path) -> None:
    random = np.random.default_rng(2)
    readings = random.standard_normal((41, 6))
    source = imu_of(tmp_path, np.column_stack([TIMES, readings]))
    cuts = np.sort(random.uniform(TIMES[0], TIMES[-1], 30))
    edges = [TIMES[4], *cuts[(cuts > TIMES[4]) & (cuts < TIMES[31])], TIMES[31]]
    total = sum((b - a) * np.array([*source.read(a, b).rate, *source.read(a, b).force]) for a, b in pairwise(edges))
    np.testing.assert_allclose(total, 0.25 * readings[5:32].sum(axis=0), rtol=1e-12, atol=1e-12)


def test_a_row_is_the_mean_since_the_row_before(tmp_path: Path) -> None:
    rows = np.column_stack([TIMES, np.arange(41.0)[:, None] * np.ones(7)])
    source = imu_of(tmp_path, rows)
    assert source.read(100.25, 100.5).rate == (2.0, 2.0, 2.0)
    assert source.read(100.125, 100.375).force == pytest.approx((1.5, 1.5, 1.5))
    assert source.read(100.25, 100.5).temperature == 2.0


def test_the_counter_tells_the_newest_row_that_has_been(tmp_path: Path) -> None:
    np.save(tmp_path / "counter.npy", np.column_stack([TIMES, np.arange(41.0), TIMES - 0.1, np.ones(41), TIMES - 0.2]))
    source = TimedEncoder(tmp_path / "counter.npy")
    source.start()
    assert source.read(100.49).count == 1
    assert source.read(100.5).edge_at == pytest.approx(100.4)
    assert source.read(100.5).earlier == pytest.approx((100.3,))
    for t in (99.0, 120.0):
        with pytest.raises(SensorError, match=r"recorded from 100\.0 s to 110\.0 s, asked for"):
            source.read(t)


@pytest.mark.parametrize("t", [99.9, 110.5])
def test_a_moment_outside_is_a_fault_of_the_sensor(tmp_path: Path, t: float) -> None:
    source = imu_of(tmp_path, np.column_stack([TIMES, np.ones((41, 6))]))
    with pytest.raises(SensorError, match="asked for"):
        source.read(t - 0.1, t)


def test_a_row_without_numbers_costs_the_cycles_that_touch_it(tmp_path: Path) -> None:
    rows = np.column_stack([TIMES, np.ones((41, 6))])
    rows[3, 2] = np.nan
    source = imu_of(tmp_path, rows)
    with pytest.raises(SensorError, match=r"line 5: what came between 100\.50 and 101\.00 s was not recorded"):
        source.read(100.25, 100.75)
    assert source.read(101.0, 101.5).rate == pytest.approx((1.0, 1.0, 1.0))


def test_a_stray_stamp_costs_nothing_and_one_row_is_no_recording(tmp_path: Path) -> None:
    rows = np.column_stack([TIMES, np.ones((41, 6))])
    rows[7, 0] = 100.0
    assert imu_of(tmp_path, rows).read(101.5, 102.0).rate == pytest.approx((1.0, 1.0, 1.0))
    with pytest.raises(SensorError, match="expected 2 rows or more of numbers, got 1"):
        imu_of(tmp_path, np.ones((1, 7)))


def spin(gap: float = 0.0) -> np.ndarray:
    """A minute at 100 Hz that turns by 1 rad/s about z; what lies ``gap`` s after half of it is missing."""
    times = 50.0 + 0.01 * np.arange(6000)
    rows = np.column_stack([times, np.tile([0.0, 0.0, 1.0, 0.0, 0.0, -9.8], (6000, 1))])
    return rows[(times <= 80.0) | (times > 80.0 + gap)]


def test_twelve_missing_seconds_are_a_fault_of_their_cycles_and_no_turn_of_zero(tmp_path: Path) -> None:
    source = imu_of(tmp_path, spin(gap=12.0))
    failed, turned = 0, 0.0
    for begin in np.arange(50.0, 109.0, 0.5):
        try:
            turned += 0.5 * source.read(begin, begin + 0.5).rate[2]
        except SensorError as error:
            assert "line 3002: what came between 80.00 and 92.01 s was not recorded" in str(error)  # noqa: PT017
            failed += 1
    assert failed == 25
    assert turned == pytest.approx(0.5 * (118 - 25))
    assert "gap of 12" in source.understood


def test_a_clock_that_was_set_is_not_read_across(tmp_path: Path) -> None:
    rows = spin()
    rows[3000:, 0] += 2e8
    source = imu_of(tmp_path, rows)
    assert source.read(79.0, 79.5).rate[2] == pytest.approx(1.0)
    with pytest.raises(SensorError, match="was not recorded"):
        source.read(79.75, 80.25)
    assert source.read(81.0, 81.5).rate[2] == pytest.approx(1.0)


def test_a_sensor_at_its_range_says_so(tmp_path: Path) -> None:
    rows = spin()
    rows[:, 3] += 0.01 * np.random.default_rng(5).standard_normal(6000)
    rows[1000:1040, 3] = 4.4
    source = imu_of(tmp_path, rows)
    assert [source.read(t, t + 0.5).saturated for t in (59.0, 60.0, 61.0)] == [0, 1, 0]


@pytest.mark.parametrize("unit", ["gx_dps,gy_dps,gz_dps,ax_g,ay_g,az_g", "wx,wy,wz,ax_mg,ay_mg,az_mg"])
def test_a_logger_s_record_is_replayed_in_its_own_units_and_times(tmp_path: Path, unit: str) -> None:
    """A sensor's own samples, played from their first one on: the same turn whatever the cycles, from any clock."""
    rows = spin()
    rows[:, 1:4] *= 180.0 / np.pi if "dps" in unit else 1.0
    rows[:, 4:7] *= (1.0 if "_g" in unit else 1e3) / 9.80665
    lines = [",".join(f"{cell:.12g}" for cell in row) for row in rows]
    (tmp_path / "log.csv").write_text("\n".join([f"time_s,{unit}", *lines]))
    source = imu_source(f"replay:{tmp_path / 'log.csv'}")
    source.start()
    for k in range(100):
        begin = 7000.0 + 0.526 * k
        sample = source.read(begin, begin + 0.526)
        assert sample.rate == pytest.approx((0.0, 0.0, 1.0))
        assert sample.force == pytest.approx((0.0, 0.0, -9.8))


def test_what_a_node_cannot_use_is_named(tmp_path: Path) -> None:
    np.save(tmp_path / "gyro.npy", np.ones((500, 3), dtype=np.int16))
    source = imu_source(f"timed:{tmp_path / 'gyro.npy'}?gyro=0.05 deg/s;rate=100")
    with pytest.raises(
        SensorError, match=r"gyro\.npy: expected readings of the accelerometer, got a record of gyroscope"
    ):
        source.start()
    with pytest.raises(NodeConfigurationError, match=r"imu: .*gyro\.npy: expected accel, columns, .*, got scale"):
        imu_source(f"timed:{tmp_path / 'gyro.npy'}?scale=0.05")
    (tmp_path / "log.csv").write_text("wx,wy,wz,fx,fy,fz\n" + "0,0,0.5,0,0,-9.8\n" * 50)
    source = imu_source(f"timed:{tmp_path / 'log.csv'}")
    with pytest.raises(SensorError, match=r"log\.csv: has no column of times"):
        source.start()


@pytest.mark.parametrize("kind", ["replay", "timed"])
def test_a_recording_that_is_not_there_is_refused_before_anything_starts(tmp_path: Path, kind: str) -> None:
    for source in (imu_source, encoder_source):
        with pytest.raises(NodeConfigurationError, match=r"expected a recording, got .*none\.npy, which is not a file"):
            source(f"{kind}:{tmp_path / 'none.npy'}")


def quickened(rate: float, steps: int) -> np.ndarray:
    """Three seconds of rows at a rate, each the mean of w(t) = 4 (t - 101) since the row before."""
    times = 100.0 + np.arange(steps) / rate
    turned = 2.0 * (times - 101.0) ** 2
    rows = np.column_stack([times, np.zeros((steps, 6))])
    rows[1:, 3] = np.diff(turned) * rate
    return rows


def test_a_fast_record_tells_what_the_eighths_of_a_cycle_turned(tmp_path: Path) -> None:
    """As a sensor with a FIFO does: of a rate that rises, each eighth has the rate of its own middle."""
    source = imu_of(tmp_path, quickened(100.0, 300))
    for begin, end in ((101.0, 101.53), (101.237, 101.75), (102.001, 102.3)):
        sample = source.read(begin, end)
        middles = begin + (end - begin) * (np.arange(8) + 0.5) / 8.0
        assert sample.parts[0] == 0.0
        assert sample.parts[1:] == pytest.approx(4.0 * (middles - 101.0), abs=2e-3)
        assert np.mean(sample.parts[1:]) == pytest.approx(sample.rate[2], rel=1e-12)


def test_a_record_of_few_rows_tells_no_eighths(tmp_path: Path) -> None:
    assert imu_of(tmp_path, quickened(25.0, 75)).read(101.0, 101.5).parts == ()
