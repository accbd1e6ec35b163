"""Files with more than one hole, holes that rise, units of two meanings: nothing is taken for the usual one."""

from __future__ import annotations

import io
import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from openpyxl import Workbook
from same_well import ags, diggs, las_2, las_3, witsml_1

from borechain import api
from groundstation.errors import SurveyError
from groundstation.survey.files.field_files import read_any
from groundstation.survey.files.field_table import TableWish

HEADER = ("MD", "Inc", "Azi")
UPPER, LOWER = ((0, 0, 0), (10, 1, 120), (20, 2, 121)), ((30, 2, 122), (40, 3, 123), (50, 4, 124))


def put(folder: Path, name: str, content: bytes | str) -> Path:
    path = folder / name
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


def book(sheets: dict[str, Sequence[Sequence[object]]]) -> bytes:
    made = Workbook()
    made.remove(made.active)
    for title, rows in sheets.items():
        sheet = made.create_sheet(title)
        for row in rows:
            sheet.append(list(row))
    content = io.BytesIO()
    made.save(content)
    return content.getvalue()


def two_trajectories() -> bytes:
    """Two of one hole, whose depths follow on."""
    text = witsml_1().decode()
    one = text[text.index("<trajectory ") : text.index("</trajectorys>")]
    other = one.replace("<name>t</name>", "<name>u</name>")
    for md in ("30.0", "20.0", "10.0", "0.0"):
        other = other.replace(f'<md uom="m">{md}<', f'<md uom="m">{float(md) + 40.0}<')
    return text.replace("</trajectorys>", f"{other}</trajectorys>").encode()


def two_results() -> bytes:
    """Results along two boreholes, whose depths follow on."""
    text = diggs().decode()
    one = text[text.index("<measurement>") : text.index("</Diggs>")]
    holes = "".join(
        f'<samplingFeature><Borehole gml:id="h{k}"><gml:name>B {k}</gml:name></Borehole></samplingFeature>'
        for k in (1, 2)
    )
    parts = [one.replace("<Test>", f'<Test><samplingFeatureRef xlink:href="#h{k}"/>') for k in (1, 2)]
    parts[1] = parts[1].replace("0.0 10.0 20.0 30.0", "40.0 50.0 60.0 70.0")
    named = text.replace("<Diggs ", '<Diggs xmlns:xlink="http://www.w3.org/1999/xlink" ')
    return named.replace(one, holes + "".join(parts)).encode()


MANY = {
    "book.xlsx": (book({"K 1": [HEADER, *UPPER], "notes": [["by hand"]], "K 2": [HEADER, *LOWER]}), "K 1", "K 2", 50.0),
    "log.las": (
        las_3() + b"~Inclinometry_Data[2] | Inclinometry_Definition\n40,1,1\n50,1,1\n",
        "Inclinometry_Data", "Inclinometry_Data[2]", 50.0,
    ),
    "two.xml": (two_trajectories(), "7 / t", "7 / u", 70.0),
    "diggs.xml": (two_results(), "B 1", "B 2", 70.0),
    "bhid.csv": ("BHID,MD,Inc,Azi\n101,0,0,0\n101,10,1,2\n102,20,1,2\n102,30,1,2\n", "101", "102", 30.0),
    "no.csv": ("Hole No.,MD,Inc,Azi\n1,0,0,0\n1,10,1,2\n2,20,1,2\n2,30,1,2\n", "1", "2", 30.0),
}  # fmt: skip


@pytest.mark.parametrize("name", MANY)
def test_of_several_holes_in_one_file_one_is_chosen(tmp_path: Path, name: str) -> None:
    content, one, other, last = MANY[name]
    path = put(tmp_path, name, content)
    with pytest.raises(SurveyError) as error:
        read_any(path)
    for word in (one, other, "--hole"):
        assert word in str(error.value)
    assert read_any(path, wish=TableWish(hole=other)).record.md[-1] == last
    assert read_any(path, wish=TableWish(hole=one)).record.md[-1] < last
    with pytest.raises(SurveyError, match="--hole K9"):
        read_any(path, wish=TableWish(hole="K9"))


def test_a_column_of_sizes_or_of_numbers_of_stations_is_no_choice(tmp_path: Path) -> None:
    for column in ("Hole size", "No", "Well depth TVD", "Station"):
        path = put(tmp_path, "s.csv", f"{column},MD,Inc,Azi\n1,0,0,0\n2,10,1,2\n3,20,1,2\n")
        assert len(read_any(path).record.md) == 3


def test_a_group_of_ags_that_stands_there_twice_is_refused(tmp_path: Path) -> None:
    more = b'"GROUP","HORN"\r\n"HEADING","LOCA_ID"\r\n"UNIT",""\r\n"DATA","BH8"\r\n'
    with pytest.raises(SurveyError, match=r"line 15: the group HORN stands there twice"):
        read_any(put(tmp_path, "s.ags", ags() + more))


def test_a_hole_of_ags_that_rises_has_negative_dips(tmp_path: Path) -> None:
    content = ags().replace(b'"125","87"', b'"125","-30"').replace(b'"130","85"', b'"130","-80"')
    record = read_any(put(tmp_path, "s.ags", content)).record
    np.testing.assert_allclose(np.degrees(record.inclination), [0.0, 1.0, 120.0, 170.0], atol=1e-9)


def test_a_dip_beyond_ninety_is_refused_by_its_own_name(tmp_path: Path) -> None:
    path = put(tmp_path, "s.csv", "MD,Dip,Azi\n0,-90,0\n10,-91,0\n")
    with pytest.raises(SurveyError, match=r"line 3: Dip: expected a dip of -90\.\.90 deg, got -91"):
        read_any(path)


@pytest.mark.parametrize(
    ("header", "named"),
    [
        ("MD,Neigung (Grad),Azimut (Grad)", "Neigung (Grad): unknown unit 'Grad'; expected one of deg, rad, gon"),
        ("MD\tNeigung_grad\tAzimut_grad", "Neigung_grad: unknown unit 'grad'; expected one of deg, rad, gon"),
        ("MD_km,Inc,Azi", "MD_km: unknown unit 'km'; expected one of m, ft, usft, cm, mm"),
        ("MD,Inc,Azi_mils", "Azi_mils: unknown unit 'mils'; expected one of deg, rad, gon"),
    ],
)
def test_a_unit_of_two_meanings_or_of_none_is_refused_by_column_and_unit(
    tmp_path: Path, header: str, named: str
) -> None:
    """A ``Grad`` is a degree in German and a gon in English."""
    mark = "\t" if "\t" in header else ","
    with pytest.raises(SurveyError) as error:
        read_any(put(tmp_path, "s.csv", f"{header}\n{mark.join('000')}\n{mark.join('112')}\n"))
    assert named in str(error.value)


def test_a_depth_that_no_hole_has_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SurveyError, match=r"line 3: md_m: expected a depth or a length of -100000\.\.100000 m"):
        read_any(put(tmp_path, "s.csv", "MD,Inc,Azi\n0,0,0\n1e7,1,2\n"))


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (b"VERS. 2.0 : CWLS", b"VERS. 2.0 : CWLS: ASCII"), (b"DEPT.M : measured", b"DEPT.M:measured"),
        (b"~Version", b"~\n~Version"), (b"NULL. -999.25 : none", b"NULL.-999.25:no value: none"),
    ],
)  # fmt: skip
def test_lines_of_a_log_end_at_their_first_colon_and_titles_may_be_empty(
    tmp_path: Path, old: bytes, new: bytes
) -> None:
    assert old in las_2()
    record = read_any(put(tmp_path, "s.las", las_2().replace(old, new))).record
    np.testing.assert_allclose(record.md, [0.0, 10.0, 20.0, 30.0])


def test_a_cell_of_a_log_that_is_too_long_is_refused_in_a_line(tmp_path: Path) -> None:
    content = las_3().replace(b"10.0,1.0", b'10.0,"' + b"1" * 200_000 + b'",1.0')
    with pytest.raises(SurveyError, match=r"line 13: expected values of LAS: field larger"):
        read_any(put(tmp_path, "s.las", content))


def test_a_sheet_with_a_cell_in_its_last_corner_is_read_in_little_memory(tmp_path: Path) -> None:
    """Its size is 1048576 rows of 16384 columns, of which four hold anything."""
    made = Workbook()
    for row in (HEADER, *UPPER):
        made.active.append(row)
    made.active["XFD1048576"] = 1
    content = io.BytesIO()
    made.save(content)
    assert list(read_any(put(tmp_path, "s.xlsx", content.getvalue())).record.md) == [0.0, 10.0, 20.0]


def test_the_north_that_a_file_says_is_that_of_a_notebooks_answer(tmp_path: Path) -> None:
    for header, north in (("MD,Inc,AZIM_GN", "grid"), ("MD,Inc,AZIM_TN", "true"), ("MD,Inc,AZIM", "site")):
        found = api.survey(put(tmp_path, "s.csv", f"{header}\n0,0,0\n10,1,2\n"))
        assert (found.frame.record, found.frame.answer) == (north, north)


# tables of walls, which read what a survey reads

WALL = (
    'radius_m = 0.6\nthickness_m = 0.8\nlength_m = 10\nheads = "h.csv"\nstations = "s.csv"\nallowed_probability = 0.5\n'
)
HEADS = "column,north_m,east_m\nA,0,0\nB,0,0.7\nC,0,1.4\n"


def wall_of(folder: Path, header: str, row: str, heads: str = HEADS, more: str = "") -> api.JudgedWall:
    rows = "".join(row.format(name, md) + "\n" for name in "ABC" for md in (0, 5, 10))
    put(folder, "s.csv", f"{header}\n{rows}")
    put(folder, "h.csv", heads)
    return api.wall(put(folder, "wall.toml", WALL + more))


@pytest.mark.parametrize(
    ("header", "row", "lean", "azimuth"),
    [
        ("column;MD;INCL;AZIM\n-;m;gon;gon", "{};{};0.2;40", 0.18, 36.0),
        ("column,MD (m),Dip (deg),Azi (deg)", "{},{},-89.9,40", 0.1, 40.0),
        ("column,MD (m),Inc (deg),AZIM_TN,AZIM_GN", "{},{},0.1,40,41", 0.1, 41.0),
    ],
)
def test_tables_of_walls_have_units_in_a_row_dips_and_norths(
    tmp_path: Path, header: str, row: str, lean: float, azimuth: float
) -> None:
    hole = wall_of(tmp_path, header, row, more='north = "grid"\n').wall.holes[1]
    np.testing.assert_allclose(np.degrees(hole.inclination), lean, atol=1e-9)
    np.testing.assert_allclose(np.degrees(hole.azimuth), azimuth, atol=1e-9)
    np.testing.assert_allclose(hole.md, [0.0, 5.0, 10.0])


@pytest.mark.parametrize(
    ("header", "row", "heads", "named"),
    [
        ("column,MD,Inc,AZIM_TN", "{},{},0.1,40", HEADS, "s.csv: AZIM_TN counts from true north, the wall says site"),
        ("column;MD;Inc;Azi", "{};{};0,125;40,000", HEADS,
         "s.csv: '0,125' may be thousands or a decimal comma; expected decimal points"),
        ("column,MD,Inc [mil],Azi", "{},{},0.1,40", HEADS, "s.csv: Inc [mil]: unknown unit 'mil'"),
        ("column,MD,Inc,Azi", "{},{},0.1,40", HEADS.replace("east_m\n", "east_m,length\n").replace("0\n", "0,12\n"),
         "h.csv"),
        ("column,MD,Inc,Azi", "{},{},0.1,40", "column,north_m,east_m,radius_mm\nA,0,0,600\nB,0,0.7,600\n",
         "h.csv: radius_mm: expected radius_m"),
        ("column,MD,Inc,Azi", "{},{},0.1,40", "column,north_m,east_m,Length\nA,0,0,12\nB,0,0.7,12\n",
         "h.csv: Length: expected length_m"),
    ],
)  # fmt: skip
def test_what_a_walls_table_says_in_other_words_is_refused_and_not_passed_over(
    tmp_path: Path, header: str, row: str, heads: str, named: str
) -> None:
    with pytest.raises(SurveyError) as error:
        wall_of(tmp_path, header, row, heads)
    assert named in str(error.value)


def test_heads_lean_in_the_words_of_the_field_too(tmp_path: Path) -> None:
    """They were passed over, and a raked wall was judged as a vertical one."""
    places = zip("ABC", (0, 0.7, 1.4), strict=True)
    rows = "".join(f"{name},0,{east},10,100\n" for name, east in places)
    heads = f"column,north_m,east_m,INCL [gon],AZIM [gon]\n{rows}"
    design = wall_of(tmp_path, "column,MD,Inc,Azi", "{},{},9,90", heads).wall.plans[1].design
    assert (design.inclination, design.azimuth) == (pytest.approx(math.radians(9.0)), pytest.approx(math.radians(90.0)))
