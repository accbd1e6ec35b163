"""Station files as people have them: twenty headers with the line of what was understood, and what is refused."""

import math
from pathlib import Path

import numpy as np
import pytest

from groundstation.errors import SurveyError
from groundstation.survey.files.field_files import read_any
from groundstation.survey.files.field_table import TableWish

ROWS = ((0.0, 0.0, 0.0), (100.0, 10.0, 120.5), (250.5, 30.25, 121.0))
COMMA, SEMI, TABS = "','", "';'", "tabs"
DEG = "inclination deg, azimuth deg"


def text_of(header: str, separator: str = ",", decimal: str = ".", unit_row: str = "") -> str:
    rows = [separator.join(f"{value:.2f}".replace(".", decimal) for value in row) for row in ROWS]
    return "\n".join([header, *([unit_row] if unit_row else []), *rows]) + "\n"


BARE = "MD m (no unit given), inclination deg (no unit given), azimuth deg (no unit given)"
FILES = [
    (text_of("MD,Inc,Azi"), f"{BARE}; separated by {COMMA}", 1.0),
    (text_of("md,inclination,azimuth"), f"{BARE}; separated by {COMMA}", 1.0),
    (text_of("Depth,Incl,Azim"), f"{BARE}; separated by {COMMA}", 1.0),
    (text_of("Measured Depth,Inclination,Azimuth"), f"{BARE}; separated by {COMMA}", 1.0),
    (text_of("MD (m),Inc (deg),Azi (deg)"), f"MD m, {DEG}; separated by {COMMA}", 1.0),
    (text_of("MD (ft),Inc (deg),Azi (deg)"), f"MD ft, {DEG}; separated by {COMMA}", 0.3048),
    (text_of("MD [feet],INC [°],AZI [°]"), f"MD ft, {DEG}; separated by {COMMA}", 0.3048),
    (text_of("md_ft,inc_deg,azi_deg"), f"MD ft, {DEG}; separated by {COMMA}", 0.3048),
    (text_of("MD;Inc;Azi", ";"), f"{BARE}; separated by {SEMI}", 1.0),
    (text_of("MD (m);Inc (deg);Azi (deg)", ";", ","), f"MD m, {DEG}; separated by {SEMI}, decimal comma", 1.0),
    (text_of("Tiefe;x;y", ";", ",").replace("Tiefe;x;y", "Depth [m];Neigung [°];Azimut [°]"),
     f"MD m, {DEG}; separated by {SEMI}, decimal comma", 1.0),
    (text_of("MD\tInc\tAzi", "\t"), f"{BARE}; separated by {TABS}", 1.0),
    (text_of("MD (ft)\tInc (deg)\tAzi (deg)", "\t", ","), f"MD ft, {DEG}; separated by {TABS}, decimal comma", 0.3048),
    ("\ufeff" + text_of("MD,Inc,Azi"), f"{BARE}; separated by {COMMA}", 1.0),
    (text_of('"MD (m)","Inc (deg)","Azi (deg)"'), f"MD m, {DEG}; separated by {COMMA}", 1.0),
    (text_of('"Measured Depth (ft)";"Inclination (deg)";"Azimuth (deg)"', ";"),
     f"MD ft, {DEG}; separated by {SEMI}", 0.3048),
    (text_of("MD,Inc,Azi", unit_row="m,deg,deg"), f"MD m, {DEG}; separated by {COMMA}", 1.0),
    (text_of("MD,Inc,Azi", unit_row="(ft),(deg),(deg)"), f"MD ft, {DEG}; separated by {COMMA}", 0.3048),
    ("# survey of 3 May\n\n" + text_of("MD (m),Inc (deg),Azi (deg)"), f"MD m, {DEG}; separated by {COMMA}", 1.0),
    (text_of("md_m;inclination_deg;azimuth_deg", ";", ","), f"MD m, {DEG}; separated by {SEMI}, decimal comma", 1.0),
    (text_of("MD (m),Inc (deg),Azi (deg)").replace("\n", "\r\n"), f"MD m, {DEG}; separated by {COMMA}", 1.0),
    (text_of("md_m,inclination_deg,azimuth_deg"), f"MD m, {DEG}", 1.0),
]  # fmt: skip


@pytest.mark.parametrize(("text", "understood", "metre"), FILES, ids=range(len(FILES)))
def test_a_file_as_people_have_it_is_read_and_said_back(
    tmp_path: Path, text: str, understood: str, metre: float
) -> None:
    path = tmp_path / "survey.csv"
    path.write_bytes(text.encode())
    found = read_any(path)
    last = f"{ROWS[-1][0] * metre:g}"
    assert found.line == f"read as: {understood}; 3 stations from 0 to {last} m"
    np.testing.assert_allclose(found.record.md, [row[0] * metre for row in ROWS], rtol=1e-12)
    np.testing.assert_allclose(np.degrees(found.record.inclination), [row[1] for row in ROWS], rtol=1e-12)
    np.testing.assert_allclose(np.degrees(found.record.azimuth), [row[2] for row in ROWS], rtol=1e-12)


def test_the_degree_sign_of_an_old_program_is_read(tmp_path: Path) -> None:
    path = tmp_path / "old.csv"
    path.write_bytes(text_of("MD [m];Inc [°];Azi [°]", ";").encode("cp1252"))
    assert read_any(path).line.startswith(f"read as: MD m, {DEG}; separated by ';'")


def test_radians_are_read_where_the_header_says_so(tmp_path: Path) -> None:
    path = tmp_path / "r.csv"
    path.write_text("MD (m),Inc (rad),Azi (rad)\n0,0,0\n10,0.5,1.5\n")
    found = read_any(path)
    assert found.line == "read as: MD m, inclination rad, azimuth rad; separated by ','; 2 stations from 0 to 10 m"
    assert found.record.inclination[1] == pytest.approx(0.5)
    assert found.record.azimuth[1] == pytest.approx(1.5)


def test_a_depth_without_a_unit_takes_the_one_that_is_given(tmp_path: Path) -> None:
    path = tmp_path / "s.csv"
    path.write_text("MD,Inc,Azi\n0,0,0\n100,1,2\n")
    assert read_any(path, wish=TableWish(md_unit="ft")).record.md[1] == pytest.approx(30.48)


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("MD (m),MD (ft),Inc,Azi\n0,0,0,0\n10,32.8,1,2\n", "MD (m) and MD (ft) are both md"),
        ("MD,Depth,Inc,Azi\n0,0,0,0\n10,9,1,2\n", "MD and Depth are both md"),
        ("MD,Inc,Azi\n0,0,0\n10,5,1,5,120,5\n", "decimal commas between values that commas separate"),
        ("MD;Inc;Azi\n0;0;0\n1.234,5;1;2\n", "may be a decimal comma or thousands"),
        ("MD;Inc;Azi\n0;0;0\n1,234;1;2\n", "'1,234' may be thousands or a decimal comma"),
        ("MD;Inc;Azi\n0;0;0\n10,5;1.5;2\n", "'10,5' may be a decimal comma or thousands beside '1.5'"),
        ("MD,Inc,Azi\n0 m,0,0\n10 ft,1,2\n", "line 2: MD = '0 m' has a unit of its own"),
        ("MD (m),Inc (rad),Azi (deg)\n0,0,0\n10,1,2\n", "inclination in rad and azimuth in deg; expected one unit"),
        ("MD (deg),Inc,Azi\n0,0,0\n10,1,2\n", "MD (deg): expected md in m, ft, usft, cm, mm, got deg"),
        ("MD (m),Inc,Azi\nft,deg,deg\n0,0,0\n10,1,2\n", "line 2: ft under a header in m"),
        ("MD,Inc,Azi\n0,0,0\n10,200,2\n", "line 3: expected an inclination of 0..180 deg, got 200"),
        ("MD,Inc,Azi\n0,0,0\n10,x,2\n", "line 3: expected numbers, got Inc = 'x'"),
        ("", "the file is empty"),
    ],
)
def test_what_can_be_read_in_two_ways_or_in_none_is_refused(tmp_path: Path, text: str, named: str) -> None:
    path = tmp_path / "survey.csv"
    path.write_text(text)
    with pytest.raises(SurveyError) as error:
        read_any(path)
    assert named in str(error.value)
    assert str(path) in str(error.value)


def test_a_unit_that_contradicts_the_header_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "s.csv"
    path.write_text("MD (m),Inc,Azi\n0,0,0\n10,1,2\n")
    with pytest.raises(SurveyError, match=r"MD \(m\) is in m, --md-unit says ft"):
        read_any(path, wish=TableWish(md_unit="ft"))
    assert math.isclose(read_any(path, wish=TableWish(md_unit="m")).record.md[1], 10.0)
