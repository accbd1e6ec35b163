"""Readers: what the files say, and every refusal word for word."""

import hashlib
import math
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from groundstation.calibration.calibration_records import read_attitudes, read_turn_table
from telemetry.errors import CalibrationError, InputError

DATA = Path(__file__).parents[2] / "data" / "calibration"
POS_NEG = "axis,x_pos,x_neg,y_pos,y_neg,z_pos,z_neg"
CW_ACW = "axis,x_cw,x_acw,y_cw,y_acw,z_cw,z_acw"
ROWS = ["x,100,-100,1,2,3,4", "y,5,6,100,-100,7,8", "z,9,10,11,12,100,-100"]
ATTITUDES = "position,pitch_deg,roll_deg,ax_mps2,ay_mps2,az_mps2"
IN_G = "position,pitch_deg,roll_deg,ax_g,ay_g,az_g"
POSES = ["home,0,0,0,0,9.81", "1,30,0,4.9,0,8.5", "2,0,30,0,4.9,8.5", "3,-30,0,-4.9,0,8.5", "4,0,-30,0,-4.9,8.5"]
TEXTS = {"table": [POS_NEG, *ROWS], "poses": [ATTITUDES, *POSES]}


def file(folder: Path, *lines: str, name: str = "bench.csv") -> Path:
    path = folder / name
    path.write_text("\n".join(lines) + "\n")
    return path


def refusal(path: Path, kind: str, **options: float) -> str:
    """Message with which a file is refused."""
    readers = {"table": partial(read_turn_table, reference=100.0), "poses": read_attitudes}
    with pytest.raises(CalibrationError) as refused:
        readers[kind](path, **options)
    return str(refused.value)


def test_the_error_is_one_of_the_ground_station_and_a_value_error() -> None:
    assert issubclass(CalibrationError, InputError)
    assert issubclass(CalibrationError, ValueError)


@pytest.mark.parametrize("header", [POS_NEG, CW_ACW])
def test_a_turn_table_in_any_order_of_its_rows(tmp_path: Path, header: str) -> None:
    path = file(tmp_path, "# bench 7", "", header, ROWS[2], "# repeated at noon", ROWS[0], ROWS[1])
    table = read_turn_table(path, 100.0, unit=2.0)
    np.testing.assert_array_equal(table.positive, 2.0 * np.array([[100, 1, 3], [5, 100, 7], [9, 11, 100]]))
    np.testing.assert_array_equal(table.negative, 2.0 * np.array([[-100, 2, 4], [6, -100, 8], [10, 12, -100]]))
    assert table.reference == 200.0
    assert table.sha256 == hashlib.sha256(path.read_bytes()).hexdigest()


def test_attitudes_in_radians(tmp_path: Path) -> None:
    path = file(tmp_path, ATTITUDES, *POSES)
    record = read_attitudes(path, limit=20.0)
    assert record.names == ("home", "1", "2", "3", "4")
    np.testing.assert_allclose(record.pitch, np.array([0, 1, 0, -1, 0]) * math.pi / 6.0)
    np.testing.assert_allclose(record.roll, np.array([0, 0, 1, 0, -1]) * math.pi / 6.0)
    np.testing.assert_array_equal(record.readings[1], [4.9, 0.0, 8.5])
    assert record.sha256 == hashlib.sha256(path.read_bytes()).hexdigest()


def test_the_published_records_are_read() -> None:
    assert len(read_attitudes(DATA / "calibration_vn100_accel.csv", limit=157.0).readings) == 9
    assert read_turn_table(DATA / "calibration_vn100_gyro.csv", 200.0, limit=2000.0).negative[2, 2] == -199.75
    assert read_turn_table(DATA / "calibration_node_a1_gyro.csv", 720.0, limit=1000.0).positive[0, 1] == 14.49795449


def test_a_file_of_another_system_is_read(tmp_path: Path) -> None:
    path = tmp_path / "bench.csv"
    path.write_bytes(b"\xef\xbb\xbf" + "\r\n".join([POS_NEG, *ROWS]).encode())
    assert read_turn_table(path, 100.0).positive[0, 0] == 100.0


# What is wrong with a file whatever it holds.


@pytest.mark.parametrize("kind", ["table", "poses"])
@pytest.mark.parametrize("text", ["", " \n\n"])
def test_an_empty_file(tmp_path: Path, kind: str, text: str) -> None:
    path = tmp_path / "bench.csv"
    path.write_text(text)
    assert refusal(path, kind) == "bench.csv, line 1: expected a record, got an empty file"


@pytest.mark.parametrize("kind", ["table", "poses"])
def test_a_file_that_is_not_there(tmp_path: Path, kind: str) -> None:
    message = refusal(tmp_path / "bench.csv", kind)
    assert message == "bench.csv: expected a file to read, got No such file or directory"


@pytest.mark.parametrize(
    ("kind", "expected"), [("table", f"{POS_NEG} or {CW_ACW}"), ("poses", f"{ATTITUDES} or {IN_G}")]
)
@pytest.mark.parametrize("header", ["axis,x,y,z", "x,y", "position,pitch_rad,roll_rad,ax_mps2,ay_mps2,az_mps2"])
def test_a_wrong_header(tmp_path: Path, kind: str, expected: str, header: str) -> None:
    message = refusal(file(tmp_path, "# bench", header, "1,2,3"), kind)
    assert message == f"bench.csv, line 2: expected the header {expected}, got {header}"


def test_only_comments(tmp_path: Path) -> None:
    message = refusal(file(tmp_path, "# nothing came"), "poses")
    assert message == f"bench.csv, line 1: expected the header {ATTITUDES} or {IN_G}, got only comments"


def test_a_header_alone(tmp_path: Path) -> None:
    assert refusal(file(tmp_path, "#", ATTITUDES), "poses") == (
        "bench.csv, line 2: expected rows below the header, got the end of the file"
    )


@pytest.mark.parametrize("kind", ["table", "poses"])
def test_a_row_that_is_cut(tmp_path: Path, kind: str) -> None:
    lines = [*TEXTS[kind][:3], TEXTS[kind][3].rpartition(",")[0]]
    count = TEXTS[kind][0].count(",") + 1
    assert refusal(file(tmp_path, *lines), kind) == f"bench.csv, line 4: expected {count} values, got {count - 1}"


@pytest.mark.parametrize("text", ["fast", "", "1.2.3", "0x10", "1_0"])
def test_no_number(tmp_path: Path, text: str) -> None:
    path = file(tmp_path, "# bench", POS_NEG, ROWS[0], f"y,5,6,{text},-100,7,8", ROWS[2])
    assert refusal(path, "table") == f"bench.csv, line 4: expected a number in column y_pos, got {text!r}"
    path = file(tmp_path, ATTITUDES, POSES[0], f"1,30,{text},4.9,0,8.5")
    assert refusal(path, "poses") == f"bench.csv, line 3: expected a number in column roll_deg, got {text!r}"


@pytest.mark.parametrize("text", ["nan", "NaN", "inf", "-inf", "1e999"])
def test_not_finite(tmp_path: Path, text: str) -> None:
    path = file(tmp_path, POS_NEG, *ROWS[:2], f"z,9,10,11,12,100,{text}")
    assert refusal(path, "table") == f"bench.csv, line 4: expected a finite number in column z_neg, got {text}"
    path = file(tmp_path, ATTITUDES, f"home,0,0,{text},0,9.81")
    assert refusal(path, "poses") == f"bench.csv, line 2: expected a finite number in column ax_mps2, got {text}"


def test_bytes_that_are_no_text(tmp_path: Path) -> None:
    path = tmp_path / "bench.csv"
    path.write_bytes(f"{ATTITUDES}\n1,2,".encode() + b"\xff\n")
    assert refusal(path, "poses") == "bench.csv, line 2: expected UTF-8 text, got byte 0xff"


# Turn table.


def test_a_missing_axis(tmp_path: Path) -> None:
    path = file(tmp_path, POS_NEG, ROWS[1])
    assert refusal(path, "table") == ("bench.csv, line 2: expected a row for turned axis x, z, got the end of the file")


@pytest.mark.parametrize("row", ["x,1,2,3,4,5,6", "w,1,2,3,4,5,6", "X,1,2,3,4,5,6"])
def test_an_axis_twice_or_unknown(tmp_path: Path, row: str) -> None:
    path = file(tmp_path, POS_NEG, ROWS[0], row, ROWS[2])
    expected = f"bench.csv, line 3: expected one row for each turned axis x, y, z, got '{row[0]}'"
    assert refusal(path, "table") == expected


@pytest.mark.parametrize("limit", [99.0, 100.0])
def test_a_saturated_rate(tmp_path: Path, limit: float) -> None:
    path = file(tmp_path, "# bench", POS_NEG, *ROWS)
    assert refusal(path, "table", limit=limit) == (
        f"bench.csv, line 3: expected column x_pos inside the range of +-{limit:g}, got 100: saturated"
    )
    assert read_turn_table(path, 100.0, limit=100.1).reference == 100.0


@pytest.mark.parametrize(
    ("factor", "reason"),
    [
        (math.pi / 180.0, ": it looks in rad where deg belongs"),
        (180.0 / math.pi, ": it looks in deg where rad belongs"),
        (9.80665, ": it looks in m/s^2 where g belongs"),
        (1.0 / 9.80665, ": it looks in g where m/s^2 belongs"),
        (3.0, ""),
        (0.0, ""),
    ],
)
def test_rates_in_another_unit_than_the_reference(tmp_path: Path, factor: float, reason: str) -> None:
    rows = [f"{axis}," + ",".join(repr(100.0 * factor * v) for v in row) for axis, row in zip(
        "xyz", [(1, -1, 0, 0, 0, 0), (0, 0, 1, -1, 0, 0), (0, 0, 0, 0, 1, -1)], strict=True)]  # fmt: skip
    message = refusal(file(tmp_path, POS_NEG, *rows), "table")
    assert message == f"bench.csv, line 2: expected a reading of about 100, got {100.0 * factor:.6g}{reason}"


# Attitudes.


def test_too_few_attitudes(tmp_path: Path) -> None:
    path = file(tmp_path, ATTITUDES, *POSES[:3])
    assert refusal(path, "poses") == "bench.csv, line 4: expected at least 4 attitudes, got 3"


def test_specific_force_in_g(tmp_path: Path) -> None:
    path = file(tmp_path, ATTITUDES, "home,0,0,0,0,1.02", *POSES[1:])
    assert refusal(path, "poses") == (
        "bench.csv, line 2: expected a reading of about 9.80665, got 1.02: it looks in g where m/s^2 belongs"
    )


def test_presets_in_radians(tmp_path: Path) -> None:
    poses = [f"{k},{p * math.pi / 180:.6f},{r * math.pi / 180:.6f},{f}" for k, (p, r, f) in enumerate(
        [(0, 0, "0,0,9.81"), (30, 0, "4.9,0,8.5"), (0, 30, "0,4.9,8.5"), (-30, 0, "-4.9,0,8.5")])]  # fmt: skip
    assert refusal(file(tmp_path, ATTITUDES, *poses), "poses") == (
        "bench.csv, line 3: expected presets that explain readings 59.9 deg apart, got at most 0.5236 deg: "
        "the angles look in rad where deg belongs"
    )


@pytest.mark.parametrize(("pitch", "roll"), [("1718.87", "0"), ("91", "0"), ("0", "-181")])
def test_presets_beyond_a_turn(tmp_path: Path, pitch: str, roll: str) -> None:
    path = file(tmp_path, ATTITUDES, POSES[0], f"1,{pitch},{roll},0,0,9.81", *POSES[2:])
    assert refusal(path, "poses") == (
        f"bench.csv, line 3: expected |pitch| <= 90 deg and |roll| <= 180 deg, got {pitch} and {roll}"
    )


def test_a_saturated_accelerometer(tmp_path: Path) -> None:
    path = file(tmp_path, ATTITUDES, *POSES)
    assert refusal(path, "poses", limit=9.81) == (
        "bench.csv, line 2: expected column az_mps2 inside the range of +-9.81, got 9.81: saturated"
    )
