"""Survey records: the field record that was printed, and everything that is no record."""

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from groundstation.errors import SurveyError
from groundstation.survey.files.survey_records import (
    DisplacementRule,
    read_columns,
    read_record,
)
from groundstation.survey.well.well_record import SurveyRecord

# A 20 m bore of the thesis, Table 4.1: md_m, b_cm, a_cm and the printed inclination and azimuth
POTSDAM = [
    (0.0, 0.0, 0.0, 0.0, 0.0),
    (2.0, 0.1, -0.25, 0.08, 248.20),
    (4.0, 0.5, -1.0, 0.32, 243.43),
    (6.0, 0.75, -2.0, 0.61, 249.44),
    (8.0, 0.75, -3.0, 0.89, 255.96),
    (10.0, 1.0, -4.5, 1.32, 257.47),
    (12.0, 1.75, -5.75, 1.72, 253.07),
    (14.0, 2.75, -7.75, 2.35, 250.46),
    (16.0, 3.0, -9.25, 2.78, 252.03),
    (18.0, 2.25, -10.25, 3.00, 257.62),
    (20.0, 2.0, -11.75, 3.41, 260.34),
]
GOOD = "md_m,inclination_deg,azimuth_deg\n0,0,0\n2,1,120\n4,2,121\n"
MEASURED = "md_m,a_cm,b_cm\n0,0,0\n2,1,-1\n4,2,-1\n"
ON_DISK = settings(suppress_health_check=[HealthCheck.function_scoped_fixture])


def file(folder: Path, text: str, name: str = "record.csv") -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def potsdam(folder: Path) -> Path:
    rows = [f"{md},{b},{a},{i},{azimuth}" for md, b, a, i, azimuth in POTSDAM]
    header = "md_m,b_cm,a_cm,printed_inclination_deg,printed_azimuth_deg"
    return file(folder, "\n".join(["# field record", header, *rows]) + "\n")


def test_the_printed_rule_gives_every_printed_digit(tmp_path: Path) -> None:
    record = read_record(potsdam(tmp_path), DisplacementRule.THESIS)
    printed = np.array(POTSDAM)
    np.testing.assert_array_equal(record.md, printed[:, 0])
    # the print rounds or cuts the last digit
    np.testing.assert_allclose(np.degrees(record.inclination), printed[:, 3], rtol=0.0, atol=0.01)
    np.testing.assert_allclose(np.degrees(record.azimuth), printed[:, 4], rtol=0.0, atol=0.01)


def test_the_exact_rule_differs_from_the_print_by_what_its_arctangents_leave_out(tmp_path: Path) -> None:
    path = potsdam(tmp_path)
    exact, thesis = read_record(path), read_record(path, DisplacementRule.THESIS)
    for row, inclination in zip(POTSDAM[1:], exact.inclination[1:], strict=True):
        assert math.sin(inclination) == pytest.approx(math.hypot(row[1], row[2]) / 200.0, rel=1e-12)
    np.testing.assert_array_equal(exact.azimuth, thesis.azimuth)
    assert math.degrees(exact.inclination[-1] - thesis.inclination[-1]) == pytest.approx(0.006, abs=5e-4)


def test_other_columns_of_numbers_and_the_lines_are_kept(tmp_path: Path) -> None:
    record = read_record(potsdam(tmp_path))
    assert record.lines == list(range(3, 14))
    assert set(record.columns) == {"printed_inclination_deg", "printed_azimuth_deg"}
    np.testing.assert_array_equal(record.columns["printed_azimuth_deg"], np.array(POTSDAM)[:, 4])


@pytest.mark.parametrize(
    ("a_cm", "b_cm", "azimuth_deg"), [(0.0, -1.0, 0.0), (1.0, 0.0, 90.0), (0.0, 1.0, 180.0), (-1.0, 0.0, 270.0)]
)
def test_north_is_minus_b_and_east_is_plus_a(tmp_path: Path, a_cm: float, b_cm: float, azimuth_deg: float) -> None:
    for rule in DisplacementRule:
        record = read_record(file(tmp_path, f"md_m,a_cm,b_cm\n0,0,0\n2,{a_cm},{b_cm}\n"), rule)
        assert math.degrees(record.azimuth[1]) == pytest.approx(azimuth_deg)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(a_cm=st.floats(-50.0, 50.0), b_cm=st.floats(-50.0, 50.0))
@example(a_cm=-1e-20, b_cm=-1.0)
def test_an_azimuth_of_displacements_lies_within_one_turn(tmp_path: Path, a_cm: float, b_cm: float) -> None:
    azimuth = read_record(file(tmp_path, f"md_m,a_cm,b_cm\n0,0,0\n2,{a_cm!r},{b_cm!r}\n")).azimuth[1]
    assert 0.0 <= azimuth < math.tau
    size = math.hypot(a_cm, b_cm)
    np.testing.assert_allclose([size * math.cos(azimuth), size * math.sin(azimuth)], [-b_cm, a_cm], atol=1e-12 * 50)


def test_a_displacement_is_read_over_the_interval_before_it(tmp_path: Path) -> None:
    record = read_record(file(tmp_path, "md_m,a_cm,b_cm\n1,0,0\n2,10,0\n6,10,0\n"))
    np.testing.assert_allclose(np.sin(record.inclination), [0.0, 0.1, 0.025])


def test_stations_come_in_radians_whatever_the_order_of_the_columns(tmp_path: Path) -> None:
    text = "# site 7\nazimuth_deg, depth_note ,md_m,inclination_deg\n\n350,ok,0,0\n# half way\n10.5,why,2.5,179\n"
    record = read_record(file(tmp_path, text))
    np.testing.assert_array_equal(record.md, [0.0, 2.5])
    np.testing.assert_allclose(np.degrees(record.inclination), [0.0, 179.0])
    np.testing.assert_allclose(np.degrees(record.azimuth), [350.0, 10.5])
    assert record.lines == [4, 6]
    assert record.columns == {}


def test_a_byte_order_mark_and_windows_line_ends_are_no_obstacle(tmp_path: Path) -> None:
    path = tmp_path / "excel.csv"
    path.write_bytes(b"\xef\xbb\xbf" + GOOD.replace("\n", "\r\n").encode())
    record = read_record(path)
    np.testing.assert_array_equal(record.md, [0.0, 2.0, 4.0])
    assert record.lines == [2, 3, 4]


def test_a_record_of_both_kinds_is_read_by_its_displacements(tmp_path: Path) -> None:
    text = "md_m,a_cm,b_cm,inclination_deg,azimuth_deg\n0,0,0,0,0\n2,2,0,7,7\n"
    record = read_record(file(tmp_path, text))
    assert math.sin(record.inclination[1]) == pytest.approx(0.01)
    np.testing.assert_array_equal(record.columns["inclination_deg"], [0.0, 7.0])


def test_columns_of_text_are_kept_as_text_when_asked(tmp_path: Path) -> None:
    table, lines = read_columns(file(tmp_path, "name,md_m\nA1,0\nA 2,7\n"), ("name", "md_m"), ("name",))
    assert table["name"].tolist() == ["A1", "A 2"]
    assert table["md_m"].tolist() == [0.0, 7.0]
    assert lines == [2, 3]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        # order of depths
        (GOOD + "3,1,1\n", r"line 5: expected a measured depth beyond 4 m, got 3 m; depths must grow"),
        (GOOD + "4,1,1\n", r"line 5: expected a measured depth beyond 4 m, got 4 m; .*none may stand there twice"),
        ("# a\n\n" + GOOD + "4,1,1\n", r"line 7: expected a measured depth beyond 4 m"),
        (MEASURED + "3,1,1\n", r"line 5: expected a measured depth beyond 4 m, got 3 m"),
        # numbers
        (GOOD + "6,nan,1\n", "line 5: expected a finite inclination_deg, got nan"),
        (GOOD + "inf,1,1\n", "line 5: expected a finite md_m, got inf"),
        (GOOD + "6,1,1e999\n", "line 5: expected a finite azimuth_deg, got inf"),
        (MEASURED + "6,NaN,1\n", "line 5: expected a finite a_cm, got nan"),
        (GOOD + "6,,1\n", "line 5: expected numbers, got inclination_deg = ''"),
        (GOOD + "6,1,x\n", "line 5: expected numbers, got azimuth_deg = 'x'"),
        (GOOD + '6,"1,5",3\n', "line 5: expected numbers, got inclination_deg = '1,5'"),
        (MEASURED + "6,1 cm,1\n", "line 5: expected numbers, got a_cm = '1 cm'"),
        # ranges
        (GOOD + "6,-0.001,1\n", r"line 5: expected an inclination of 0\.\.180 deg, got -0\.001"),
        (GOOD + "6,180.01,1\n", r"line 5: expected an inclination of 0\.\.180 deg, got 180\.01"),
        (MEASURED + "6,250,1\n", r"line 5: a displacement of 2\.50002 m over 2 m cannot be; expected .* centimetres"),
        (MEASURED + "6,200,0\n", "line 5: a displacement of 2 m over 2 m cannot be"),
        ("md_m,a_cm,b_cm\n0,1,0\n2,1,1\n", "line 2: expected the collar first, without a displacement"),
        # header
        (
            "depth,inc,azi\n0,0,0\n2,1,1\n",
            "expected the columns md_m, a_cm, b_cm or md_m, inclination_deg, .* got depth",
        ),
        ("md_m,a_mm,b_mm\n0,0,0\n2,1,1\n", "a_mm is in another unit, expected a_cm"),
        ("md_m,a_cm,b_mm\n0,0,0\n2,1,1\n", "b_mm is in another unit, expected b_cm"),
        ("md_m,inclination_rad,azimuth_rad\n0,0,0\n2,1,1\n", "inclination_rad is in another unit"),
        ("md_m,inclination_deg,azimuth_rad\n0,0,0\n2,1,1\n", "azimuth_rad is in another unit, expected azimuth_deg"),
        ("md_ft,inclination_deg,azimuth_deg\n0,0,0\n2,1,1\n", "md_ft is in another unit, expected md_m"),
        ("md_m,inclination_deg,azimuth_deg,md_m\n0,0,0,0\n2,1,1,3\n", "line 1: column md_m stands there twice"),
        ("# b\nmd_m,a_cm,b_cm,a_cm\n0,0,0,0\n2,1,1,3\n", "line 2: column a_cm stands there twice"),
        # cells
        (GOOD + "6,1\n", "line 5: expected 3 values, got 2"),
        (GOOD + "6,1,1,1\n", "line 5: expected 3 values, got 4"),
        (GOOD + "6 1 1\n", "line 5: expected 3 values, got 1"),
        (GOOD + '6,"1,1\n8,2,2\n', "line 5"),
        # a spreadsheet's semicolons: the message shows what the header was
        (GOOD.replace(",", ";"), "got md_m;inclination_deg;azimuth_deg"),
        ("md,inc\nzero,none\n", "got md, inc"),
        # rows
        ("md_m,inclination_deg,azimuth_deg\n0,0,0\n", "at least two stations, the first one the collar, got 1"),
        ("md_m,inclination_deg,azimuth_deg\n", "at least two stations, the first one the collar, got 0"),
        ("md_m,a_cm,b_cm\n0,0,0\n", "at least two stations, the first one the collar, got 1"),
        ("", "expected a header and stations, the file is empty"),
        ("\n \n# nothing\n", "expected a header and stations, the file is empty"),
    ],
)
def test_what_is_no_record_is_refused_with_file_and_line(tmp_path: Path, text: str, message: str) -> None:
    path = file(tmp_path, text)
    with pytest.raises(SurveyError, match=message) as caught:
        read_record(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_file_that_is_missing_or_is_no_text_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SurveyError, match=r"none\.csv: No such file or directory; expected a CSV file with md_m"):
        read_record(tmp_path / "none.csv")
    with pytest.raises(SurveyError, match="Is a directory"):
        read_record(tmp_path)
    binary = tmp_path / "photo.csv"
    binary.write_bytes(b"\x89PNG\r\n\x1a\n\x00\xff\xfe")
    with pytest.raises(SurveyError, match=r"photo\.csv: not a text file; expected a CSV file"):
        read_record(binary)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (GOOD.replace("_deg", "_rad"), "inclination_rad is in another unit, expected inclination_deg"),
        (MEASURED.replace("_cm", "_in"), "a_in is in another unit, expected a_cm"),
    ],
)
def test_a_record_in_another_unit_is_refused_by_name(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(SurveyError, match=message):
        read_record(file(tmp_path, text))


@pytest.mark.parametrize("cell", ["-999.25", "9999", "-9999"])
def test_a_displacement_that_stands_for_none_is_named(tmp_path: Path, cell: str) -> None:
    """Over 200 m a displacement of 99.99 m would do."""
    with pytest.raises(SurveyError, match=rf"line 3: a_cm = {cell} stands for no value; without a displacement"):
        read_record(file(tmp_path, f"md_m,a_cm,b_cm\n0,0,0\n200,{cell},1\n400,1,1\n"))


def refusal(path: Path, rule: DisplacementRule) -> str:
    """Message with which a file is refused, or nothing."""
    try:
        read_record(path, rule)
    except SurveyError as error:
        return str(error)
    return ""


def read_or_refuse(path: Path) -> None:
    for rule in DisplacementRule:
        message = refusal(path, rule)
        if message:
            assert str(path) in message
            continue
        record = read_record(path, rule)
        assert isinstance(record, SurveyRecord)
        assert len(record.md) == len(record.inclination) == len(record.azimuth) == len(record.lines) >= 2
        assert np.all(np.diff(record.md) > 0.0)
        assert np.all((record.inclination >= 0.0) & (record.inclination <= math.pi))
        assert np.all(np.isfinite(record.azimuth))


@ON_DISK
@given(st.binary(max_size=400))
@example(b'md_m,a_cm,b_cm\n0,0,0\n2,"1,1\n')
@example(b"md_m,a_cm,b_cm\n0,0,0\n2,1,1\x00\n")
@example(b"md_m,a_cm,b_cm\n0,0,0\n2,1,1\r\r\n")
def test_random_bytes_are_a_record_or_refused(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "random.csv"
    path.write_bytes(content)
    read_or_refuse(path)


CELLS = st.one_of(
    st.floats().map(repr),
    st.floats(0.0, 180.0).map(repr),
    st.integers().map(str),
    st.sampled_from(["", " ", "nan", "-inf", '"', '""', '"1', "1\x00", "#", "1_0", "0x1", "1e400", "٣"]),
    st.text(max_size=6),
)
HEADERS = st.one_of(
    st.sampled_from(["md_m,a_cm,b_cm", "md_m,inclination_deg,azimuth_deg", "md_m,a_cm,b_cm,note", "md_m,a_mm,b_cm"]),
    st.lists(CELLS, max_size=4).map(",".join),
)


@pytest.mark.slow
@ON_DISK
@given(HEADERS, st.lists(st.lists(CELLS, min_size=1, max_size=5).map(",".join), max_size=6))
def test_random_rows_are_a_record_or_refused(tmp_path: Path, header: str, rows: list[str]) -> None:
    path = tmp_path / "random.csv"
    path.write_text("\n".join([header, *rows]), encoding="utf-8", errors="surrogatepass")
    read_or_refuse(path)


@pytest.mark.parametrize(
    "rows",
    [
        pytest.param(["0,0,0", "1,0,0,note", "2,0,0," + "1" * 140_000], id="a cell of a book"),
        pytest.param(["0,0,0", '1,1,"1', "2"], id="a quote that is not closed"),
        pytest.param(["0,0,0", '1,1,"1', '2"', "3,1,1"], id="a cell of two lines"),
        pytest.param(["-1.7e308,0,0", "1.7e308,0,0"], id="depths beyond any number"),
        pytest.param(["0,0,0", "1,1.7e308,1.7e308"], id="displacements beyond any number"),
        pytest.param(["0,0,0", "5e-324,0,0"], id="the smallest interval"),
        pytest.param(["0,0,0", "1,1,1\x0c", "2,1,1"], id="a form feed"),
    ],
)
def test_a_file_that_strains_its_reader_is_a_record_or_refused(tmp_path: Path, rows: list[str]) -> None:
    path = tmp_path / "strange.csv"
    path.write_text("\n".join(["md_m,a_cm,b_cm", *rows]), encoding="utf-8")
    read_or_refuse(path)


ASCENDING = st.lists(
    st.tuples(st.floats(0.01, 100.0), st.floats(0.0, 180.0), st.floats(-720.0, 720.0)), min_size=2, max_size=20
)


@ON_DISK
@given(ASCENDING)
@pytest.mark.slow
def test_every_good_survey_comes_back_to_the_last_bit(tmp_path: Path, rows: list[tuple[float, float, float]]) -> None:
    md = np.cumsum([row[0] for row in rows])
    lines = [f"{depth!r},{row[1]!r},{row[2]!r}" for depth, row in zip(md.tolist(), rows, strict=True)]
    record = read_record(file(tmp_path, "\n".join(["md_m,inclination_deg,azimuth_deg", *lines])))
    np.testing.assert_array_equal(record.md, md)
    np.testing.assert_array_equal(record.inclination, np.radians([row[1] for row in rows]))
    np.testing.assert_array_equal(record.azimuth, np.radians([row[2] for row in rows]))
