"""Records of IMUs as loggers write them: one truth written in many forms comes back, and what is wrong is named."""

from __future__ import annotations

import math
import re
import tempfile
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from telemetry.errors import InputError, LoggerError
from telemetry.records.imu_record import ImuRecord, read_imu_record
from telemetry.records.record_reading import read_told
from telemetry.records.record_stamps import times_of_stamps
from telemetry.records.sensor_columns import column_of
from telemetry.records.understood_record import understood_line, understood_object

NAMES = "time_s,gx_dps,gy_dps,gz_dps,ax_g,ay_g,az_g,temperature_c"
GRAVITY = 9.80665
COUNT = 400


def truth(count: int = COUNT, seed: int = 1) -> np.ndarray:
    """Rows (n, 8) of a logger of 100 Hz: s, deg/s, g, C."""
    random = np.random.default_rng(seed)
    rates = np.array([4.5, 0.1, -1.1]) + 0.1 * random.standard_normal((count, 3))
    forces = np.array([0.03, 0.07, -1.03]) + 0.005 * random.standard_normal((count, 3))
    return np.column_stack([0.01 * np.arange(count), rates, forces, 25.0 + 0.01 * random.standard_normal(count)])


def text_of(rows: np.ndarray, names: str | None = NAMES, mark: str = ",") -> str:
    head = [] if names is None else [names.replace(",", mark)]
    return "\n".join([*head, *(mark.join(f"{cell:.15g}" for cell in row) for row in rows)]) + "\n"


def read(folder: Path, content: str | np.ndarray, told: str = "", **options: bool) -> ImuRecord:
    path = folder / ("log.csv" if isinstance(content, str) else "log.npy")
    if isinstance(content, str):
        path.write_text(content, encoding="utf-8")
    else:
        np.save(path, content)
    return read_imu_record(*read_told(f"{path}?{told}" if told else str(path)), **options)


def refusal(folder: Path, content: str | np.ndarray, told: str = "") -> str:
    with pytest.raises(LoggerError) as refused:
        read(folder, content, told)
    return str(refused.value)


def assert_is(record: ImuRecord, rows: np.ndarray, tolerance: float = 1e-7) -> None:
    assert record.rate is not None
    assert record.force is not None
    np.testing.assert_allclose(record.rate, rows[:, 1:4] * math.pi / 180.0, atol=tolerance)
    np.testing.assert_allclose(record.force, rows[:, 4:7] * GRAVITY, atol=10.0 * tolerance)


@pytest.mark.parametrize(
    ("name", "quantity", "axis", "unit"),
    [
        ("time_s", "time", 0, "s"),
        ("timestamp_us", "time", 0, "us"),
        ("Time (ms)", "time", 0, "ms"),
        ("t", "time", 0, ""),
        ("gx_dps", "gyroscope", 0, "deg/s"),
        ("Gyro Y (rad/s)", "gyroscope", 1, "rad/s"),
        ("gyro_z_deg_s", "gyroscope", 2, "deg/s"),
        ("gyrZ[mdps]", "gyroscope", 2, "mdeg/s"),
        ("wx", "gyroscope", 0, "rad/s"),
        ("gz_lsb", "gyroscope", 2, "counts"),
        ("GyroX", "gyroscope", 0, ""),
        ("ax_mps2", "accelerometer", 0, "m/s2"),
        ("accY (m/s²)", "accelerometer", 1, "m/s2"),
        ("Accel_Z_mg", "accelerometer", 2, "mg"),
        ("az_g", "accelerometer", 2, "g"),
        ("fz", "accelerometer", 2, "m/s2"),
        ("mx_uT", "magnetometer", 0, "uT"),
        ("mag_y_gauss", "magnetometer", 1, "G"),
        ("temperature_c", "temperature", 0, "C"),
        ("temp", "temperature", 0, "C"),
    ],
)
def test_a_column_is_known_by_its_name(name: str, quantity: str, axis: int, unit: str) -> None:
    found = column_of(name)
    assert found is not None
    assert (found.quantity, found.axis, found.unit, found.odd) == (quantity, axis, unit, "")


@pytest.mark.parametrize("name", ["roll", "pitch_deg", "max", "id", "", "north_m", "quality", "gain"])
def test_a_column_of_something_else_is_none_of_a_sensor(name: str) -> None:
    assert column_of(name) is None


@pytest.mark.parametrize("mark", [",", ";", "\t", " "])
def test_every_delimiter_tells_the_same(tmp_path: Path, mark: str) -> None:
    rows = truth()
    record = read(tmp_path, text_of(rows, mark=mark))
    assert_is(record, rows)
    assert record.row_rate() == pytest.approx(100.0)
    assert record.temperature == pytest.approx(rows[:, 7], abs=1e-6)


def test_decimal_commas_and_a_byte_order_mark_are_read(tmp_path: Path) -> None:
    rows = truth()
    record = read(tmp_path, "\ufeff" + text_of(rows, mark=";").replace(".", ","))
    assert_is(record, rows)


def test_other_units_in_the_names_give_the_same_record(tmp_path: Path) -> None:
    rows = truth()
    other = rows * np.array([1e6, *[math.pi / 180.0] * 3, *[1000.0] * 3, 1.0])
    names = "Timestamp [us],GyroX (rad/s),GyroY (rad/s),GyroZ (rad/s),AccX (mg),AccY (mg),AccZ (mg),Temp (C)"
    record = read(tmp_path, text_of(other, names))
    assert_is(record, rows)
    assert record.row_rate() == pytest.approx(100.0)


def test_columns_are_named_where_the_file_does_not(tmp_path: Path) -> None:
    rows = truth()[:, [4, 5, 6, 1, 2, 3, 0]]
    told = "columns=ax_g,ay_g,az_g,gx_dps,gy_dps,gz_dps,-;rate=100"
    assert_is(read(tmp_path, text_of(rows, None, " "), told), truth())
    assert "expected names of its 6 columns" in refusal(tmp_path, rows[:, :6])
    assert "expected 7 names, one of each column, got 2" in refusal(tmp_path, text_of(rows, None), "columns=wx,wy")


def test_days_and_moments_are_times(tmp_path: Path) -> None:
    rows = truth()
    start = datetime(2024, 5, 31, 23, 59, 59, tzinfo=UTC)
    lines = [
        f"{(start + timedelta(seconds=row[0])).isoformat()},{','.join(f'{cell:.9g}' for cell in row[1:])}"
        for row in rows
    ]
    record = read(tmp_path, "\n".join([NAMES.replace("time_s", "time"), *lines]))
    assert_is(record, rows)
    assert np.diff(record.times()) == pytest.approx(np.full(COUNT - 1, 0.01), abs=1e-5)


def test_arrays_with_and_without_names(tmp_path: Path) -> None:
    rows = truth()
    own = rows * np.array([1.0, *[math.pi / 180.0] * 3, *[GRAVITY] * 3, 1.0])
    assert_is(read(tmp_path, own), rows)
    named = np.array([tuple(row) for row in rows], dtype=[(name, "f8") for name in NAMES.split(",")])
    assert_is(read(tmp_path, named), rows)


def test_counts_need_their_scale(tmp_path: Path) -> None:
    rows = truth()
    counts = np.round(rows[:, 1:4] / 0.05).astype(np.int16)
    record = read(tmp_path, counts, "gyro=0.05 deg/s;rate=100")
    assert record.rate is not None
    np.testing.assert_allclose(record.rate, rows[:, 1:4] * math.pi / 180.0, atol=0.026 * math.pi / 180.0)
    assert "gyroscope x,y,z in 0.05 deg/s" in understood_line(record)
    for told in ("gyro=deg/s", "gyro=1 deg/s"):
        assert "whole numbers, counts of a converter" in refusal(tmp_path, counts, told)
    assert "expected what they are, gyro=UNIT, accel=UNIT or mag=UNIT" in refusal(tmp_path, counts)
    names = "gx,gy,gz"
    assert "gx,gy,gz are counts: expected gyro= with their scale" in refusal(tmp_path, text_of(counts, names))
    assert "are counts" in refusal(tmp_path, text_of(counts, "gx_raw,gy_raw,gz_raw"))


@pytest.mark.parametrize(
    ("names", "told", "says"),
    [
        ("time_s,gx_dps,gy_rad_s,gz_dps,ax_g,ay_g,az_g,temp", "", "gx_dps in deg/s, gy_rad_s in rad/s"),
        ("time_s,gx_dps,gy_dps,gw_dps,ax_g,ay_g,az_g,temp", "", "gyroscope: expected three axes, .*: no z"),
        ("time_s,gx,gy,gz,ax_g,ay_g,az_g,temp", "", "gx,gy,gz are numbers without a unit: expected gyro="),
        ("time_s,gx_furlong,gy_dps,gz_dps,ax_g,ay_g,az_g,temp", "", "column gx_furlong: expected a unit, rad/s"),
        (NAMES, "gyro=rad/s", "the file says gx_dps,gy_dps,gz_dps in deg/s, told was rad/s"),
        (NAMES, "mag=uT", "mag: expected columns of the magnetometer, got time_s,gx_dps"),
        (NAMES, "rate=200", "the stamps say 100 Hz, told was 200 Hz"),
        (NAMES, "gyro=g", "gyro: expected a unit of the gyroscope, rad/s, deg/s"),
        (
            NAMES,
            "accel=0.1 bananas",
            "accel: expected a unit of the accelerometer, m/s2, g, mg or counts, got 'bananas'",
        ),
        (NAMES, "accel=-1 g", "expected a scale and a unit"),
        (NAMES, "from=3;to=2", "expected a moment and a later one, got 3 and 2 s"),
        (NAMES, "from=300", "expected rows of a record of 4.0 s, none is left"),
        (NAMES, "without=7-9", "expected seconds as 120..130|expected a number"),
        (NAMES, "unit=g", "expected accel, columns, .*, got unit"),
        (NAMES.replace("_g", "_mps2"), "", r"1\.03\d long at the median, in m/s2: they look in g"),
        ("md_m,inclination_deg,azimuth_deg,a,b,c,d,e", "", "expected columns of a sensor such as"),
    ],
)
def test_a_wrong_use_is_refused_by_name_and_unit(tmp_path: Path, names: str, told: str, says: str) -> None:
    found = refusal(tmp_path, text_of(truth(), names), told)
    assert re.search(says, found), found


def test_what_is_no_file_is_refused_by_name(tmp_path: Path) -> None:
    assert issubclass(LoggerError, InputError)
    with pytest.raises(LoggerError, match=r"none\.csv: expected a file to read"):
        read_imu_record(*read_told(str(tmp_path / "none.csv")))
    for content in ("", "\n \n", "# nothing\n", NAMES, f"{NAMES}\nfoo,bar\n"):
        assert refusal(tmp_path, content).startswith("log.csv")
    for data in (b"\x93NUMPY no", b"PK\x03\x04" + bytes(60)):
        (tmp_path / "log.npy").write_bytes(data)
        with pytest.raises(LoggerError, match=r"log\.npy: expected an array in the NPY format"):
            read_imu_record(*read_told(str(tmp_path / "log.npy")))
    for array in (np.ones((5, 8), dtype=complex), np.ones(30), np.ones((0, 8))):
        assert "expected rows of numbers" in refusal(tmp_path, array)
    assert "expected 2 rows or more" in refusal(tmp_path, text_of(truth(1)))


def host_stamps(count: int, random: np.random.Generator, pauses: dict[int, float]) -> tuple[np.ndarray, np.ndarray]:
    """True times of samples at 99.3 Hz and when a host that wakes up now and then has read each.

    A ``pauses`` entry is a sample and the seconds for which the host sleeps from there.
    """
    times = np.arange(count) / 99.3
    wakes = np.sort(np.concatenate([np.cumsum(random.uniform(0.02, 0.06, count)), [times[-1] + 1.0]]))
    for k, length in pauses.items():
        wakes = wakes[(wakes < times[k]) | (wakes > times[k] + length)]
    arrived = wakes[np.searchsorted(wakes, times)]
    read_at = np.empty(count)
    free = 0.0
    for k in range(count):
        free = max(arrived[k], free) + 0.0015  # of one read
        read_at[k] = free
    return times, read_at


def test_rows_in_bursts_lie_at_the_sensor_s_rate_and_a_pause_of_the_host_loses_none(tmp_path: Path) -> None:
    random = np.random.default_rng(3)
    times, stamps = host_stamps(30_000, random, {9000: 0.4})
    rows = truth(30_000)
    rows[:, 0] = stamps
    record = read(tmp_path, rows * np.array([1.0, *[0.017] * 3, *[GRAVITY] * 3, 1.0]))
    assert record.stamps is not None
    assert record.stamps.gaps == ()
    assert record.row_rate() == pytest.approx(99.3, rel=1e-4)
    late = record.times() - times
    assert np.std(late) < 0.004  # s, where the stamps scatter by
    assert np.std(stamps - times) > 0.012
    assert "in bursts, late by" in understood_line(record)


def test_rows_that_were_lost_are_a_gap_among_bursts_and_among_steady_rows(tmp_path: Path) -> None:
    _, stamps = host_stamps(30_000, np.random.default_rng(4), {9000: 0.4})
    for times in (stamps, np.arange(30_000) / 99.3):
        rows = truth(30_000) * np.array([1.0, *[0.017] * 3, *[GRAVITY] * 3, 1.0])
        rows[:, 0] = times
        rows = np.delete(rows, slice(20_000, 21_192), axis=0)  # 12 s
        record = read(tmp_path, rows)
        assert record.stamps is not None
        ((k, length),) = record.stamps.gaps
        assert k == 20_000
        assert length == pytest.approx(12.0, abs=0.1)
        assert "gap of 12 s before line 20001" in understood_line(record)
        assert record.longest_stretch() == slice(0, 20_000)
        assert record.row_rate() == pytest.approx(99.3, rel=1e-3)


@pytest.mark.parametrize(
    ("unit", "ticks", "modulus"), [("us", 10_000, 2**32), ("ms", 10, 2**16), ("us", 10_000, 10**6)]
)
def test_a_counter_that_begins_anew_goes_on(tmp_path: Path, unit: str, ticks: int, modulus: int) -> None:
    rows = truth()
    stamps = (modulus - 200 * ticks + ticks * np.arange(COUNT)) % modulus
    lines = [f"{stamps[k]},{','.join(f'{cell:.9g}' for cell in rows[k, 1:])}" for k in range(COUNT)]
    record = read(tmp_path, "\n".join([NAMES.replace("time_s", f"time_{unit}"), *lines]))
    assert record.times() - record.times()[0] == pytest.approx(rows[:, 0], abs=1e-9)
    assert record.stamps is not None
    assert not np.any(record.breaks)
    assert record.stamps.wraps == np.sum(np.diff(stamps) < 0)
    assert "began anew" in understood_line(record)


@pytest.mark.parametrize("step", [6.0 * 365.25 * 86400.0, -1000.0])
def test_a_clock_that_was_set_is_no_time_that_passed(tmp_path: Path, step: float) -> None:
    rows = truth()
    rows[250:, 0] += step
    record = read(tmp_path, text_of(rows))
    assert record.stamps is not None
    assert [k for k, _ in record.stamps.jumps] == [250]
    assert record.breaks[250]
    assert record.times()[-1] - record.times()[0] == pytest.approx(3.99, abs=0.02)
    assert "the clock was set by" in understood_line(record)


def test_one_stray_stamp_costs_nothing_and_stamps_that_stand_twice_are_counted(tmp_path: Path) -> None:
    rows = truth()
    rows[100, 0] = 0.2
    record = read(tmp_path, text_of(rows))
    assert record.times() == pytest.approx(0.01 * np.arange(COUNT), abs=1e-9)
    assert "1 stray stamps, the first in line 102" in understood_line(record)
    coarse = truth(4000)
    coarse[:, 0] = 0.04 * (np.arange(4000) // 4)
    record = read(tmp_path, text_of(coarse))
    assert record.row_rate() == pytest.approx(100.0, rel=1e-3)
    assert np.std(record.times() - 0.01 * np.arange(4000)) < 0.002
    assert "3000 stamps stand twice" in understood_line(record)


def test_rows_without_numbers_and_damaged_lines_are_breaks(tmp_path: Path) -> None:
    lines = text_of(truth()).splitlines()
    lines[50] = "0.49,nan,0.1,1,0.03,0.07,-1.03,25"
    lines[90] = "0.89,4.5,0."
    lines[120] = "0.1\x00\x00"
    record = read(tmp_path, "\n".join(lines))
    assert record.lost == (51, 91, 121)
    assert list(record.lines[np.flatnonzero(record.breaks)]) == [52, 92, 122]
    assert "3 rows without numbers, the first in line 51" in understood_line(record)
    assert len(record.lines) == COUNT - 3
    half = [line if k % 2 else "oops" for k, line in enumerate(lines)]
    assert "lines that are none" in refusal(tmp_path, "\n".join([NAMES, *half]))


def test_names_that_come_again_are_a_break_and_other_names_are_another_record(tmp_path: Path) -> None:
    rows = truth()
    first, second = text_of(rows[:200]), text_of(rows[200:])
    record = read(tmp_path, first + second)
    assert_is(record, rows)
    assert list(np.flatnonzero(record.breaks)) == [200]
    other = text_of(rows[200:], NAMES.replace("_dps", "_rad_s"))
    assert "line 202: expected the columns time_s,gx_dps" in refusal(tmp_path, first + other)


def test_a_saturated_stretch_is_named_and_left_out_of_what_is_whole(tmp_path: Path) -> None:
    rows = truth(4000)
    rows[1000:1020, 3] = 250.0
    rows[2000:2010, 6] = -2.0
    record = read(tmp_path, text_of(rows))
    assert list(np.flatnonzero(record.saturated == 1)) == list(range(1000, 1020))
    assert list(np.flatnonzero(record.saturated == 2)) == list(range(2000, 2010))
    assert "gyroscope at its range in 20 rows, the first in line 1002" in understood_line(record)
    assert record.longest_stretch() == slice(2010, 4000)


def test_rows_that_were_read_twice_are_counted_and_left_out_where_asked(tmp_path: Path) -> None:
    rows = truth()
    twice = np.repeat(rows, 2, axis=0)
    twice[:, 0] = 0.005 * np.arange(2 * COUNT)
    text = text_of(twice)
    assert len(read(tmp_path, text).lines) == 2 * COUNT
    record = read(tmp_path, text, leave_out_repeats=True)
    assert_is(record, rows)
    assert record.row_rate() == pytest.approx(100.0)
    assert f"{COUNT} readings stand twice" in understood_line(record)
    without = read(tmp_path, text_of(twice[:, 1:], NAMES.partition(",")[2]), "rate=200", leave_out_repeats=True)
    assert without.row_rate() == pytest.approx(100.0)


def test_parts_are_cut_out_by_the_record_s_seconds(tmp_path: Path) -> None:
    rows = truth()
    record = read(tmp_path, text_of(rows), "from=0.5;to=3;without=1..1.5,2..2.1")
    kept = [k for k in range(COUNT) if 50 <= k <= 300 and not 100 <= k <= 150 and not 200 <= k <= 210]
    assert list(record.lines) == [k + 2 for k in kept]
    assert list(record.lines[np.flatnonzero(record.breaks)]) == [153, 213]


def test_the_object_says_what_the_line_says(tmp_path: Path) -> None:
    rows = np.delete(truth(), slice(100, 200), axis=0)
    found = understood_object(read(tmp_path, text_of(rows, NAMES.replace("temperature_c", "quality"))))
    assert found["columns"]["gyroscope"] == {
        "names": ["gx_dps", "gy_dps", "gz_dps"],
        "unit": "deg/s",
        "si_of_one": pytest.approx(math.pi / 180.0),
    }
    assert found["gaps"] == [{"line": 102, "length_s": pytest.approx(1.01)}]
    assert found["not_used"] == ["quality"]
    assert found["rate_hz"] == pytest.approx(100.0)


@given(st.binary(max_size=300))
def test_no_bytes_raise_anything_but_the_error_of_a_record(data: bytes) -> None:
    with tempfile.TemporaryDirectory() as folder:
        for name in ("log.csv", "log.npy"):
            (Path(folder) / name).write_bytes(data)
            try:
                read_imu_record(*read_told(str(Path(folder) / name)))
            except LoggerError as error:
                assert str(error).startswith("log.")  # noqa: PT017


@given(
    st.lists(st.floats(0.0, 0.3), min_size=150, max_size=400),
    st.sampled_from([0.002, 0.01, 0.1]),
)
def test_no_row_is_later_than_its_stamp_and_rows_ascend(delays: list[float], period: float) -> None:
    count = len(delays)
    stamps = np.maximum.accumulate(period * np.arange(count) + np.array(delays))
    found = times_of_stamps(stamps, 1.0, False, np.zeros(count, dtype=bool))
    if found.bursts is not None:
        assert np.all(found.times <= stamps + 1e-9)
        assert np.all(np.diff(found.times) > 0.0)


def test_times_that_stand_still_are_refused_and_shown(tmp_path: Path) -> None:
    path = tmp_path / "imu.csv"
    path.write_text("0,0,0,0,0,0,-9.81\n" * 600)
    record = read_imu_record(*read_told(str(path)))
    with pytest.raises(LoggerError, match=r"imu.csv: its times stand still: expected times that grow, or a rate"):
        record.times()
    assert "no rate, for its clock stands" in understood_line(record)
