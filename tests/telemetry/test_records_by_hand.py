"""Records of an IMU by hand: every unit as it is spelled, every bound at its value, what is said of a fault whole."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from telemetry.errors import LoggerError
from telemetry.records.imu_record import ImuRecord, read_imu_record
from telemetry.records.logged_cells import read_logged_cells
from telemetry.records.noise_file import read_gyro_noise
from telemetry.records.reading_faults import rows_at_range, rows_read_twice
from telemetry.records.record_reading import read_told, reading_of, scale_of
from telemetry.records.record_stamps import RowTimes, times_of_stamps
from telemetry.records.sensor_columns import UNITS
from telemetry.records.understood_record import understood_line

TURN = math.pi / 180.0
BY_HAND = {
    "time": {"s sec seconds": 1.0, "ms msec millis": 1e-3, "us usec micros": 1e-6, "ns nsec": 1e-9},
    "gyroscope": {
        "rad/s rads radps": 1.0, "deg/s dps degps °/s": TURN, "mdeg/s mdps": TURN / 1000.0, "deg/h dph": TURN / 3600.0,
    },
    "accelerometer": {"m/s2 m/s² mps2 mss": 1.0, "g G": 9.80665, "mg": 9.80665e-3},
    "magnetometer": {"T": 1.0, "uT µT": 1e-6, "nT": 1e-9, "G gauss Gs": 1e-4, "mG mgauss": 1e-7},
}  # fmt: skip
NAMES = "wx,wy,wz,fx,fy,fz"


@pytest.mark.parametrize("quantity", BY_HAND)
def test_every_spelling_of_a_unit_is_that_unit(quantity: str) -> None:
    known = set()
    for spellings, si in BY_HAND[quantity].items():
        for spelling in spellings.split():
            one, words = scale_of(quantity, spelling)
            assert one == pytest.approx(si, rel=1e-12), spelling
            known.add(words)
            assert scale_of(quantity, f"2.5 {spelling}") == (pytest.approx(2.5 * si), f"2.5 {words}")
    assert known == set(UNITS[quantity])


def still(count: int, seed: int = 3) -> np.ndarray:
    """Rows (n, 6) in SI of a sensor at rest."""
    random = np.random.default_rng(seed)
    return np.column_stack(
        [0.01 * random.standard_normal((count, 3)), [0.0, 0.0, 9.8] + 0.01 * random.standard_normal((count, 3))]
    )


def record_of(folder: Path, columns: dict[str, Any], told: str = "", **options: bool) -> ImuRecord:
    """Record of a file of text with these columns, each cell as it is printed."""
    rows = zip(*(map(str, column) for column in columns.values()), strict=True)
    path = folder / "log.csv"
    path.write_text("\n".join([",".join(columns), *(",".join(row) for row in rows)]) + "\n")
    return read_imu_record(*read_told(f"{path}?{told}" if told else str(path)), **options)


def columns_of(rows: np.ndarray, names: str = NAMES) -> dict[str, Any]:
    return dict(zip(names.split(","), rows.T.tolist(), strict=True))


@pytest.mark.parametrize(
    ("first", "tick", "unit"),
    [(1.01e8, 1.0, "s"), (1.01e11, 1e-3, "ms"), (1.01e14, 1e-6, "us"), (1.01e17, 1e-9, "ns"), (1.7e18, 1e-9, "ns")],
)
def test_whole_stamps_since_1970_have_their_unit_by_their_size(
    tmp_path: Path, first: float, tick: float, unit: str
) -> None:
    step = round(2.0 / tick)
    stamps = [round(first) + step * k for k in range(20)]
    record = record_of(tmp_path, {"time": stamps} | columns_of(still(20)))
    assert record.placed["time"].unit == unit
    assert record.row_rate() == pytest.approx(0.5)


@pytest.mark.parametrize(("largest", "are_counts"), [(99, False), (100, False), (101, True)])
def test_whole_numbers_of_a_node_s_names_are_si_up_to_a_hundred(tmp_path: Path, largest: int, are_counts: bool) -> None:
    rows = np.tile([1, 2, 3, 0, 0, 10], (10, 1))
    rows[4, 0] = -largest
    columns = {"time": [0.1 * k for k in range(10)]} | columns_of(rows)
    if are_counts:
        with pytest.raises(LoggerError, match="gyroscope: wx,wy,wz are counts"):
            record_of(tmp_path, columns)
    else:
        assert record_of(tmp_path, columns).triad("gyroscope").min() == -largest


def test_temperatures_are_celsius_and_of_two_columns_of_an_axis_the_first_counts(tmp_path: Path) -> None:
    rows = still(20)
    columns = columns_of(rows, "gx_rads,gy_rads,gz_rads,ax_ms2,ay_ms2,az_ms2")
    again = {"GX rads": (rows[:, 0] + 5.0).tolist(), "ax_volt": [9.0] * 20, "temp_k": [300.0] * 20}
    record = record_of(tmp_path, {"t_s": [0.1 * k for k in range(20)], "gx_odd": [7.0] * 20} | columns | again)
    assert record.triad("gyroscope") == pytest.approx(rows[:, :3])
    assert record.triad("accelerometer") == pytest.approx(rows[:, 3:])
    assert record.temperature == pytest.approx(26.85)
    assert record.ignored == ("gx_odd", "GX rads", "ax_volt")


def test_how_a_number_is_written_says_whether_it_is_a_count(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("a,b,c,d\n1.0,1,1.5,7\n2.0,2,2.5,\n3.0,3,3.5,1_0\n4.0,4,4.5,inf\n5,5,5,5\n" * 3)
    with pytest.raises(LoggerError, match="expected rows of numbers"):
        read_logged_cells(tmp_path / "a.csv")
    (tmp_path / "a.csv").write_text("a,b,c\n1.0,1,1.5\n2.0,2,2.5\n3.0,nan,3.5\n4.0,4,inf\n5,5,5\n1,1_0,3\n")
    found = read_logged_cells(tmp_path / "a.csv")
    assert found.integers == (False, True, False)
    assert found.damaged == (7,)
    assert np.isnan(found.cells).tolist()[2:] == [[False, True, False], [False, False, True], [False] * 3, [True] * 3]
    np.save(tmp_path / "a.npy", np.array([[1.0, np.inf], [-np.inf, 2.0]]))
    assert np.isnan(read_logged_cells(tmp_path / "a.npy").cells).tolist() == [[False, True], [True, False]]


@pytest.mark.parametrize(("rate", "fits"), [(91.0, True), (109.0, True), (89.0, False), (111.0, False)])
def test_a_rate_may_differ_from_the_stamps_by_a_tenth(tmp_path: Path, rate: float, fits: bool) -> None:
    columns = {"time": [round(0.01 * k, 6) for k in range(50)]} | columns_of(still(50))
    if fits:
        assert record_of(tmp_path, columns, f"rate={rate}").row_rate() == pytest.approx(100.0)
    else:
        with pytest.raises(LoggerError, match="rate: the stamps say 100 Hz"):
            record_of(tmp_path, columns, f"rate={rate}")


def stamped(*stamps: float) -> RowTimes:
    return times_of_stamps(np.array(stamps), 1.0, False, np.zeros(len(stamps), dtype=bool))


@pytest.mark.parametrize(("step", "is_gap"), [(2.375, False), (2.625, True)])
def test_rows_are_missing_where_a_step_is_two_and_a_half_others(step: float, is_gap: bool) -> None:
    found = stamped(0.0, 1.0, 2.0, 3.0, 3.0 + step, 4.0 + step, 5.0 + step)
    assert found.gaps == (((4, step),) if is_gap else ())
    assert found.breaks.tolist() == [False] * 4 + [is_gap] + [False] * 2
    assert found.period == pytest.approx(1.0 if is_gap else (5.0 + step) / 6.0)


def test_a_clock_that_is_set_goes_on_by_one_step_and_of_two_stamps_exchanged_one_is_put_right() -> None:
    found = stamped(*range(10), *(500.0 - 1000.0 + k for k in range(10)))
    assert found.times.tolist() == [float(k) for k in range(20)]
    assert (found.jumps, found.period) == (((10, -509.0),), 1.0)
    assert stamped(0.0, 1.0, 3.0, 2.0, 4.0, 5.0).strays == (2,)
    assert stamped(0.0, 1.0, 9.0, 3.0, 4.0, 5.0).times.tolist() == [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]


def test_rows_in_bursts_are_late_by_the_median_and_at_most_by_the_longest_pause(tmp_path: Path) -> None:
    n = np.arange(600)
    delays = 0.01 * (9 - n % 10) + np.where(n // 10 == 30, 0.05, 0.0)
    stamps = np.round(0.01 * n + delays, 6)
    found = stamped(*stamps)
    assert found.bursts == (pytest.approx(0.05, abs=5e-4), pytest.approx(0.14, abs=5e-4))
    assert found.period == pytest.approx(0.01, rel=1e-3)
    rows = still(600)
    record = record_of(tmp_path, {"time": [f"{one:.6f}" for one in stamps]} | columns_of(rows))
    assert "late by 50 ms at the median and 140 ms at most" in understood_line(record)


def test_a_stretch_at_the_outermost_value_is_five_rows_long_and_none_at_zero() -> None:
    values = np.random.default_rng(1).uniform(0.1, 0.9, (60, 3))
    values[10:15, 0], values[30:34, 0] = 1.0, 1.0
    values[20:26, 1] = 0.0  # the smallest of its axis: an axis that stands there says nothing of its range
    values[40:45, 2] = -1.0
    assert np.flatnonzero(rows_at_range(values)).tolist() == [*range(10, 15), *range(40, 45)]
    twice = np.random.default_rng(2).uniform(0.0, 1.0, (100, 3))
    twice[1:3] = twice[0]
    assert not rows_read_twice(twice).any()  # two in a hundred are chance
    twice[3] = twice[0]
    assert np.flatnonzero(rows_read_twice(twice)).tolist() == [1, 2, 3]


def test_gaps_of_a_record_are_told_with_their_lines_and_all_of_them_added_up(tmp_path: Path) -> None:
    steps = np.full(100, 0.1)
    for place, length in ((10, 1.0), (20, 2.0), (30, 3.0), (40, 4.0), (50, 5.0)):
        steps[place] = length
    times = np.cumsum(steps)
    times[80] += 0.5  # one stray
    record = record_of(tmp_path, {"time": [f"{t:.3f}" for t in times]} | columns_of(still(100)))
    told = understood_line(record).partition("fx,fy,fz in m/s2; ")[2]
    assert told == (
        "gap of 1 s before line 12; gap of 2 s before line 22; gap of 3 s before line 32; 2 gaps more, 15 s in all; "
        "1 stray stamps, the first in line 82"
    )
    cut = record_of(tmp_path, {"time": [f"{t:.3f}" for t in times]} | columns_of(still(100)), "from=2;without=10..10.5")
    assert cut.stamps is not None
    assert [(int(cut.lines[k]), length) for k, length in cut.stamps.gaps] == [
        (line, pytest.approx(length)) for line, length in ((22, 2.0), (32, 3.0), (42, 4.0), (52, 5.0))
    ]
    assert [int(cut.lines[k]) for k in cut.stamps.strays] == [82]
    assert not cut.breaks[0]


def noise(unit: str = "deg/s", **change: Any) -> dict[str, Any]:
    of_axis = {"white": 0.002, "bias_std": 0.01, "bias_tau": 300.0} | change
    return {"unit": unit, "axes": {axis: {"filter": of_axis} for axis in "xyz"}}


def test_noise_of_a_gyroscope_has_the_unit_of_its_file_and_its_time_has_seconds(tmp_path: Path) -> None:
    path = tmp_path / "noise.json"
    for unit, si in (("deg/s", TURN), ("rad/s", 1.0), ("deg/h", TURN / 3600.0)):
        path.write_text(json.dumps(noise(unit)))
        found = read_gyro_noise(path)
        assert found.white == pytest.approx((0.002 * si,) * 3)
        assert found.bias_std == pytest.approx((0.01 * si,) * 3)
        assert found.bias_tau == (300.0,) * 3
    for name, most in (("white", 10.0), ("bias_std", 10.0), ("bias_tau", 1e6)):
        for value, is_taken in ((0.0, False), (1e-9, True), (most * 0.999, True), (most * 1.001, False), (True, False)):
            path.write_text(json.dumps(noise(**{name: value})))
            if is_taken:
                read_gyro_noise(path)
            else:
                with pytest.raises(LoggerError, match=rf"x\.{name}: expected a number above 0"):
                    read_gyro_noise(path)


def test_what_is_left_out_begins_before_it_ends() -> None:
    for told in ({"begin": 5.0, "end": 5.0}, {"without": ("5..5",)}, {"without": ("6..5",)}, {"without": ("5",)}):
        with pytest.raises(LoggerError):
            reading_of(**told)
    assert reading_of(begin=5.0, end=5.1, without=("7..7.5",)).without == ((7.0, 7.5),)
