"""One reader: the same well in every format of the field is the same answer; what is damaged or hostile is refused."""

import tracemalloc
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from same_well import FORMATS, ROWS, ags, bomb, csv_text, diggs, las_2, las_3, witsml_1, witsml_2, xlsx

from groundstation.calibration.calibration_records import read_turn_table
from groundstation.calibration.matrix_files import read_matrix
from groundstation.calibration.mwd_block import read_triad
from groundstation.errors import SurveyError
from groundstation.plan_settings import read_plan
from groundstation.survey.files.field_files import read_any
from groundstation.survey.files.field_table import TableWish
from groundstation.survey.files.programme import read_programme, read_tie_on
from groundstation.survey.files.survey_records import read_record
from groundstation.survey.requests.survey_answer import answer_survey
from groundstation.survey.requests.survey_request import FrameRequest, SurveyRequest
from groundstation.survey.tools.instruments import load_tool
from groundstation.survey.wall.wall_file import read_wall
from sim.world.parsing import read_toml
from telemetry.bounded_bytes import LARGEST_FILE
from telemetry.calibration import read_calibration
from telemetry.errors import BorechainError
from telemetry.records.noise_file import read_gyro_noise


def put(folder: Path, name: str, content: bytes | str) -> Path:
    path = folder / name
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


def answer(path: Path, **asked: object) -> dict:
    result = answer_survey(SurveyRequest(path, **asked)).result
    return {key: value for key, value in result.items() if key not in ("file", "read_as")}


@pytest.mark.parametrize("name", FORMATS)
def test_the_same_well_gives_the_same_answer_in_every_format(tmp_path: Path, name: str) -> None:
    found = answer(put(tmp_path, name, FORMATS[name]()))
    plain = answer(put(tmp_path, "plain.csv", csv_text()))
    assert found.keys() == plain.keys()
    rounded = name in ("usft.txt", "edm.xml")  # units whose numbers are not those of the others to the last digit
    for one, other in zip(found.pop("stations"), plain.pop("stations"), strict=True):
        for key, value in other.items():
            if isinstance(value, float) and rounded:
                assert one[key] == pytest.approx(value, rel=1e-12, abs=1e-12)
            elif not rounded:
                assert one[key] == value
    if not rounded:
        assert found == plain
    assert found["warnings"] == []


def test_a_wbp_file_of_another_program_is_the_same_well(tmp_path: Path) -> None:
    path = put(tmp_path, "plan.wbp", wbp_text())
    found, plain = answer(path), answer(put(tmp_path, "plain.csv", csv_text()))
    assert found == plain
    with pytest.raises(SurveyError, match=r"bad\.wbp: not a \.wbp file"):
        answer(put(tmp_path, "bad.wbp", "DEPTH nothing\n"))


def wbp_text() -> str:
    """Turn points as the format has them: depth, azimuth, inclination, rates, tool face, method; then their place."""
    points = "".join(
        f"P: {md:7.2f} {azi:7.3f} {inc:7.3f}   0.000   0.000   0.000   0.000    2\nL: 0.00 0.00 0.00\n"
        for md, inc, azi in ROWS
    )
    return f"DEPTH 2\n! by hand\nTARGETS:\nWELLPLANS:\n{'W:0200   0 123         7':144s}{3.0:7.2f}{0.0:8.5f}\n{points}"


def test_our_own_table_of_stations_is_read(tmp_path: Path) -> None:
    from groundstation.survey.requests.survey_tables import station_table_text

    asked = SurveyRequest(put(tmp_path, "a.csv", csv_text()), frame=FrameRequest(north="grid", convergence_deg=2.0))
    first = answer_survey(asked)
    path = put(tmp_path, "stations.csv", station_table_text(first.result["stations"], first.found.frame))
    again = answer(path)
    assert again["north"] == "grid"
    for one, other in zip(again["stations"], first.result["stations"], strict=True):
        assert [one[k] for k in ("md_m", "north_m", "tvd_m")] == pytest.approx(
            [other[k] for k in ("md_m", "north_m", "tvd_m")]
        )


def test_one_station_with_its_collar_is_a_survey(tmp_path: Path) -> None:
    path = put(tmp_path, "one.csv", "MD,Inc,Azi\n10,1,120\n")
    assert [s["md_m"] for s in answer(path, from_collar=True)["stations"]] == [0.0, 10.0]
    with pytest.raises(SurveyError, match="expected at least two stations"):
        answer(path)


@pytest.mark.parametrize(
    ("text", "wish", "md"),
    [
        ("MD;Inc;Azi\n0;0;0\n10;1;2\n1,234;1;2\n", TableWish(decimal="point"), 1234.0),
        ("MD;Inc;Azi\n0;0;0\n1;1;2\n1,234;1;2\n", TableWish(decimal="comma"), 1.234),
        ("MD;Inc;Azi\n0;0;0\n1;1;2\n1.234,5;1;2\n", TableWish(decimal="comma"), 1234.5),
        ('MD,Inc,Azi\n0,0,0\n10,1,2\n"1,234.5",1,2\n', TableWish(), 1234.5),
        ('MD,Inc,Azi\n0,0,0\n10,1,2\n"1,234","1","2"\n', TableWish(decimal="point"), 1234.0),
        (",,,\nMD,Inc,Azi,\n0,0,0,\n,,,\n10,1,2,\n20,1,2,\n", TableWish(), 20.0),
        ("MD   INCL   AZIM\nm    deg    deg\n0     0     0\n10    1     2\n20 1 2\n", TableWish(), 20.0),
        ("MD Incl Azim_GN Azim_TN\n0 0 0 0\n10 1 2 3\n20 1 2 3\n", TableWish(north="grid"), 20.0),
    ],
)
def test_tables_of_people_are_read(tmp_path: Path, text: str, wish: TableWish, md: float) -> None:
    assert read_any(put(tmp_path, "s.csv", text), wish=wish).record.md[-1] == pytest.approx(md)


def test_of_two_norths_the_one_that_is_chosen_is_taken_and_one_says_itself(tmp_path: Path) -> None:
    path = put(tmp_path, "s.csv", "MD,Incl,AZIM_GN,AZIM_TN\n0,0,0,0\n10,1,2,3\n")
    with pytest.raises(SurveyError, match="AZIM_GN and AZIM_TN count from two norths; expected --north grid or true"):
        answer(path)
    for north, azimuth in (("grid", 2.0), ("true", 3.0)):
        found = answer(path, frame=FrameRequest(north=north))
        assert (found["north"], found["stations"][1]["azimuth_deg"]) == (north, pytest.approx(azimuth))
    alone = put(tmp_path, "t.csv", "MD,Incl,AZIM_TN\n0,0,0\n10,1,3\n")
    assert answer(alone)["north"] == "true"
    with pytest.raises(SurveyError, match="AZIM_TN counts from true north, --north says grid"):
        answer(alone, frame=FrameRequest(north="grid"))


@pytest.mark.parametrize(
    ("name", "content", "named"),
    [
        ("a.csv", "MD (fathom),Inc,Azi\n0,0,0\n1,1,1\n", "MD (fathom): unknown unit 'fathom'; expected one of m, ft"),
        ("a.csv", "MD,Inc,Azi\nfathom,deg,deg\n0,0,0\n1,1,1\n", "line 2: MD: unknown unit 'fathom'; expected one of"),
        ("a.csv", "MD (m),Inc (gon),Azi (deg)\n0,0,0\n1,1,1\n", "inclination in gon and azimuth in deg"),
        ("a.csv", "MD,dip,azi\n0,-90,0\n1,80,1\n", "dip: expected dips of one sign, got -90 and 80 deg"),
        ("a.las", las_2().replace(b"2.0", b"4.7"), "LAS 4.7: expected version 2.0 or 3.0"),
        ("a.las", las_3().replace(b"AZIM", b"TEMP"), "expected curves of depth, inclination and azimuth"),
        ("a.xml", witsml_2("2.0"), "WITSML 2.0: expected version 2.1"),
        ("a.xml", witsml_1().replace(b'"1.4.1.1"', b'"1.3.1.1"'), "WITSML 1.3.1.1: expected version 1.4.1.1"),
        ("a.xml", witsml_1().replace(b'<md uom="m">10', b'<md uom="ft">10'), "md in m and in ft; expected one unit"),
        ("a.xml", b"<kml xmlns='http://x'/>", "kml of http://x: expected a WITSML trajectory, 1.4.1.1 or 2.1, or"),
        ("a.xml", witsml_2()[:300], "not XML"),
        ("a.xml", diggs().replace(b"5.0,130.0", b"5.0"), "DIGGS: expected 2 values at each of 4 depths"),
        ("a.ags", ags().replace(b"4.1.1", b"3.1"), "AGS 3.1: expected one of 4.0"),
        ("a.ags", ags().replace(b"HORN_INCL", b"HORN_XXXX"), "HORN: HORN_INCL is missing"),
        ("a.xlsx", xlsx()[:2000], "a damaged workbook"),
        ("a.xlsx", b"PK\x03\x04" + bytes(500), "a damaged workbook"),
        ("a.xls", b"\xd0\xcf\x11\xe0" + bytes(500), "a workbook of before 2007 (.xls); expected .xlsx"),
        ("a.csv", b"\xff\xfe\x00\xd8\x00", "not a text file"),
        ("a.csv", "MD,Inc,Azi\n0,0,0\n10,1,2,3\n", "line 3: expected 3 values, got 4"),
    ],
)  # fmt: skip
def test_what_is_damaged_or_not_known_is_refused_by_name(
    tmp_path: Path, name: str, content: bytes | str, named: str
) -> None:
    with pytest.raises(SurveyError) as error:
        read_any(put(tmp_path, name, content))
    assert named in str(error.value)
    assert "\n" not in str(error.value)


LAUGHS = (
    '<!DOCTYPE l [<!ENTITY a "ha">'
    + "".join(f'<!ENTITY {b} "{f"&{a};" * 10}">' for a, b in zip("abcdefgh", "bcdefghi", strict=True))
    + "]>"
)
OUTSIDE = '<!DOCTYPE l [<!ENTITY x SYSTEM "file:///etc/hostname">]>'


@pytest.mark.parametrize(("doctype", "entity"), [(LAUGHS, "&i;"), (OUTSIDE, "&x;"), ("<!DOCTYPE l>", "")])
def test_entities_and_document_types_are_refused(tmp_path: Path, doctype: str, entity: str) -> None:
    with pytest.raises(SurveyError, match="expected XML without a document type or entities"):
        read_any(put(tmp_path, "bomb.xml", witsml_2(doctype=doctype, md=entity)))


@pytest.mark.parametrize(
    ("name", "read"),
    [
        ("plan.toml", read_plan), ("wall.toml", read_wall), ("tie.toml", read_tie_on), ("legs.toml", read_programme),
        ("s.csv", read_record), ("plan.csv", read_plan), ("table.csv", lambda path: read_turn_table(path, 1.0)),
        ("tool.toml", lambda path: load_tool(str(path))), ("block.json", read_calibration),
        ("matrix.toml", lambda path: read_matrix(path, 1.0)), ("noise.json", read_gyro_noise),
        ("hole.toml", read_toml), ("triad.json", lambda path: read_triad(path, "accelerometer")),
    ],
)  # fmt: skip
def test_settings_of_two_gigabytes_are_refused_before_they_are_read_whole(
    tmp_path: Path, name: str, read: Callable[[Path], object]
) -> None:
    path = tmp_path / name
    with path.open("wb") as file:
        file.truncate(2 * 2**30)
    tracemalloc.start()
    try:
        with pytest.raises(BorechainError, match="a file larger than 64 MiB"):
            read(path)
        assert tracemalloc.get_traced_memory()[1] < 300 * 2**20
    finally:
        tracemalloc.stop()


def test_a_file_beyond_any_survey_is_refused_before_it_is_read_whole(tmp_path: Path) -> None:
    path = tmp_path / "large.csv"
    with path.open("wb") as file:
        file.truncate(2 * 2**30)  # a hole of 2 GB
    with pytest.raises(SurveyError, match=r"large\.csv: a file larger than 64 MiB; expected a file of stations"):
        read_any(path)
    with pytest.raises(SurveyError, match="a workbook of at most 256 MiB, got more"):
        read_any(put(tmp_path, "bomb.xlsx", bomb()))
    assert LARGEST_FILE < 2 * 2**30


def test_a_wall_reads_what_a_survey_reads(tmp_path: Path) -> None:
    from openpyxl import Workbook

    from groundstation.survey.wall.wall_file import read_wall

    book = Workbook()
    book.active.append(["column", "north_m", "east_m"])
    for k, name in enumerate("ABC"):
        book.active.append([name, 0, 0.7 * k])
    book.save(tmp_path / "heads.xlsx")
    rows = "".join(f"{name};{md / 0.3048:.4f};0,1;40\n".replace(".", ",") for name in "ABC" for md in (0, 5, 10))
    put(tmp_path, "stations.csv", f"shift report\ncolumn;MD [ft];INCL;AZIM\n{rows}".encode("utf-16"))
    plain = tmp_path / "wall.toml"
    plain.write_text('radius_m = 0.6\nthickness_m = 0.8\nheads = "heads.xlsx"\nstations = "stations.csv"\n')
    wall = read_wall(plain)
    assert [plan.design.head[1] for plan in wall.plans] == pytest.approx([0.0, 0.7, 1.4])
    np.testing.assert_allclose(wall.holes[1].md, [0.0, 5.0, 10.0], atol=1e-4)
    np.testing.assert_allclose(np.degrees(wall.holes[1].inclination), 0.1)
