"""The whole report of a wall read back: every fact, cell, mark and remedy, from numbers that all differ.

The verdict is given by hand, so that what is printed is known without judging; positions, deviations and their sigma
are those of straight holes with told covariances, which have a closed form.
"""

import math
import re
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from small_wall import HEAD_STD, HEADS, HOLES, WALL, judgement_of, write_wall

from groundstation.entry.entry_warning import EntryWarning
from groundstation.errors import SurveyError
from groundstation.report import column_report as column_report_module
from groundstation.report import wall_report as wall_report_module
from groundstation.report.column_report import column_report
from groundstation.report.document import Document, Origin, ReportPapers, ReportSection, document_content
from groundstation.report.wall_report import (
    column_records,
    remedy_lines,
    report_on,
    site_of,
    tight_words,
    wall_report,
    wall_report_pdf,
)
from groundstation.survey.wall.column_state import ColumnState
from groundstation.survey.wall.void_chance import VoidChance
from groundstation.survey.wall.voids import Void
from groundstation.survey.wall.wall_file import Wall, read_wall
from groundstation.survey.wall.wall_verdict import VoidFinding, WallVerdict

APPROVED = Path(__file__).parents[1] / "data" / "reports"
OTHERS = ["de", "es", "fr", "it"]
DAY = date(2026, 11, 20)


@pytest.fixture(scope="module", autouse=True)
def undrawn() -> Iterator[None]:
    """No picture: `test_wall_drawing.py` measures it, and each takes as long as all the words."""
    with pytest.MonkeyPatch.context() as patch:
        for module, name in ((wall_report_module, "wall_figure"), (column_report_module, "survey_figure")):
            patch.setattr(module, name, lambda *_, **__: None)
            patch.setattr(module, "svg_in", lambda *_: "<svg/>")
        yield


@pytest.fixture(scope="module")
def wall(tmp_path_factory: pytest.TempPathFactory) -> Wall:
    return read_wall(write_wall(tmp_path_factory.mktemp("wall")))


def origin(language: str = "en") -> Origin:
    return Origin(DAY, "1.2.3", [("SHA-256 of wall.toml", "ab" * 32)], ReportPapers(language=language))


@pytest.fixture(scope="module")
def report(wall: Wall) -> Document:
    return wall_report(wall, judgement_of(wall), origin())


def section(document: Document, title: str) -> ReportSection:
    (found,) = [one for one in document.sections if one.title == title]
    return found


def test_every_fact_and_heading(report: Document) -> None:
    assert (report.kind, report.title, report.subject) == ("Wall report", "East pit", "Station square")
    assert (report.verdict, report.good) == ("The wall is NOT TIGHT", False)
    assert list(report.facts) == [
        ("Project", "Station square"),
        ("Client", "City railways"),
        ("Azimuths and coordinates", "site north"),
        ("Depths count from", "collar"),
        ("Height datum", "DHHN2016"),
        (
            "Site coordinates",
            "N 5000.500 m, E 300.250 m, height 31.400 m at the zero of this report; site north",
        ),
        ("Columns and joints", "6 columns, 5 joints, line"),
        ("Radius of a column", "0.6 and 0.65 m, coefficient of variation 0.03"),
        ("Required thickness of a joint", "0.55 m"),
        ("To be tight", "0 to 4 m"),
        ("Tolerance", "20 mm + 1:100: 20 mm at the head and 1 % of the length"),
        ("P(anything open or too thin)", "0.023 (standard error 0.006), allowed 0.01"),
        ("Site", "gravity 9.81234 m/s^2"),
        ("Times of the surveys", "stated of 3 of 4 columns that were surveyed"),
        ("Serial and calibration of the instruments", "stated of all 4 columns that were surveyed"),
        ("Check of the data", "nothing is missing, and nothing is beyond what steel does"),
        (
            "What the ± contains",
            "errors of the instrument, setting out, how a hole runs where it was not surveyed; no mistakes",
        ),
    ]
    assert [(one.title, one.new_page, one.figure is not None) for one in report.sections] == [
        ("Reasons", False, False),
        ("What is to be done", False, False),
        ("Instruments", False, False),
        ("Columns: set out, and as built", True, False),
        ("Joints", False, False),
        ("How it closed", False, False),
        ("Joints over depth, plan, and the worst joint", True, True),
    ]
    assert section(report, "Reasons").words == [
        "Joint B-C is 0.540 m thick at the least from 2 to 2 m; required 0.55 m.",
        "Column D is missing from 0 to 4 m.",
    ]


def test_what_is_to_be_done_stands_once_in_the_site_and_its_grid(report: Document, wall: Wall) -> None:
    first = (
        "A column at north 0.250 m, east 1.350 m (N 5000.750 m, E 301.600 m) from 2 to 4 m alone does not close "
        "joint B-C."
    )
    second = (
        "A column at north 0.000 m, east 2.700 m (N 5000.500 m, E 302.950 m) from 0 to 4 m closes joints C-D and D-E."
    )
    assert section(report, "What is to be done").words == [first, second]
    judgement = judgement_of(wall)
    assert remedy_lines(wall, judgement, 1) == [first]
    assert remedy_lines(wall, judgement, 4) == [second.replace("joints C-D and D-E", "joint D-E")]
    assert remedy_lines(wall, judgement, 0) == []
    for name, told in {
        "A": [],
        "B": ["Joint B-C is 0.540 m thick at the least from 2 to 2 m; required 0.55 m.", first],
        "D": ["Column D is missing from 0 to 4 m.", second],
    }.items():
        (record,) = [one for one in column_records(wall, judgement) if one.design.name == name]
        assert record.actions == told


def used(name: str, md: float) -> tuple[str, str, str, str, str]:
    """Deviation, sigma, allowed (mm), share and depth of a straight hole under a vertical design, by their formulas."""
    inclination, azimuth, last, (nn, ne, _, ee, _, _) = HOLES[name]
    lean, way = math.radians(inclination), math.radians(azimuth)
    size, limit = md * math.sin(lean), 0.02 + 0.01 * md * math.cos(lean)
    n, e = math.cos(way), math.sin(way)
    variance = md / last * (n * n * nn + 2.0 * n * e * ne + e * e * ee) + HEAD_STD**2
    return (
        f"{1e3 * size:.1f}",
        f"{1e3 * math.sqrt(variance):.1f}",
        f"{1e3 * limit:.1f}",
        f"{size / limit:.0%}",
        f"{md:g}",
    )


def test_every_cell_of_the_columns(report: Document) -> None:
    columns = section(report, "Columns: set out, and as built")
    assert list(columns.columns) == [
        "column", "north m", "east m", "length m", "surveyed m", "dev. mm", "sigma mm", "allowed mm", "used", "at m",
    ]  # fmt: skip
    assert list(columns.rows) == [
        ("A", "0.000", "0.000", "4", "4", *used("A", 4.0)),
        ("B", "0.000", "0.900", "4", "4", *used("B", 4.0)),
        ("C", "0.000", "1.800", "4", "2", *used("C", 2.0)),
        ("D", "0.000", "2.700", "4", "not drilled", *("–",) * 5),
        ("E", "0.000", "3.600", "4", "4", *used("E", 4.0)),
        ("F", "0.000", "4.500", "4", "drilled to 4 m, not surveyed", *("–",) * 5),
    ]
    assert columns.rows[1][5:] == ("83.8", "6.0", "60.0", "140%", "4")  # what the formula says, so that it is seen here
    assert list(columns.marked) == [1, 2, 3, 5]  # beyond it, not known to its toe, not there, not surveyed
    assert list(columns.words) == [
        "Each column at the depth where it uses most of its tolerance; marked: beyond it, or not known to its toe."
    ]


def test_a_column_is_shown_where_it_uses_most_of_its_tolerance_and_not_at_its_toe(wall: Wall) -> None:
    """B turns back below 2 m, leaning as far to the other side: its toe is as far off and allowed more."""
    hole = wall.holes[1]
    back = replace(hole, azimuth=np.radians([200.0, 200.0, 20.0]))
    document = wall_report(replace(wall, holes=[wall.holes[0], back, *wall.holes[2:]]), judgement_of(wall), origin())
    assert tuple(section(document, "Columns: set out, and as built").rows[1][5:]) == used("B", 2.0)


def test_every_cell_of_the_joints(report: Document) -> None:
    joints = section(report, "Joints")
    assert list(joints.columns) == ["joint", "known as", "thinnest m", "at m", "P(too thin)", "at m"]
    assert list(joints.rows) == [
        ("A-B", "surveyed", "0.650", "2", "0.004", "4"),
        ("B-C", "unsurveyed", "0.540", "2", "0.61", "2"),
        ("C-D", "missing", "0.900", "0", "1", "2"),
        ("D-E", "missing", "open", "0", "1", "0"),
        ("E-F", "surveyed", "0.710", "0", "0.012", "2"),
    ]
    assert list(joints.marked) == [1, 2, 3, 4]
    assert list(joints.words) == ["Required: 0.55 m; marked: thinner, open, not known, or P(too thin) above 0.01."]


def test_what_is_just_as_required_is_not_marked(wall: Wall) -> None:
    """A thickness and a probability at their bound are good, and each a trifle beyond is not."""
    judgement = judgement_of(wall)

    def marked(thickness: float, probability: float) -> list[int]:
        sizes, chances = np.full((5, 3), thickness), np.full((5, 3), probability)
        states = np.full((5, 3), ColumnState.SURVEYED, np.int8)
        joints = replace(judgement.joints, thickness=sizes, probability=chances, states=states)
        document = wall_report(wall, replace(judgement, joints=joints), origin())
        return list(section(document, "Joints").marked)

    assert marked(0.55, 0.01) == []
    assert marked(math.nextafter(0.55, 0.0), 0.01) == [0, 1, 2, 3, 4]
    assert marked(0.55, math.nextafter(0.01, 1.0)) == [0, 1, 2, 3, 4]


def test_instruments_and_how_it_closed(report: Document, wall: Wall) -> None:
    instruments = section(report, "Instruments")
    assert list(instruments.columns) == ["error model", "serial", "calibration", "columns"]
    assert list(instruments.rows) == [("relay", "R-17", "K-31", "A to C"), ("relay", "R-18", "K-40", "E")]
    closing = section(report, "How it closed")
    assert list(closing.columns) == ["day", "drilled", "closed %", "open joints", "widest m", "joint", "at m"]
    assert [row[:2] for row in closing.rows] == [("2026-03-02", "A, C"), ("2026-03-04", "B"), ("2026-03-05", "E, F")]
    assert closing.rows[0][2:] == ("0.0", "5", "–", "–", "–")
    # at 0 m all are 0.9 m apart; the lens of two circles says how thick, and C beyond its survey runs on as it leaned
    lens = 2.0 * math.sqrt(0.6**2 - 0.45**2)
    assert lens > 0.55
    lean = {name: 4.0 * math.tan(math.radians(inclination)) for name, (inclination, *_) in HOLES.items()}
    way = {name: math.radians(azimuth) for name, (_, azimuth, *_) in HOLES.items()}
    north = {name: lean[name] * math.cos(way[name]) for name in HOLES}  # at 4 m
    east = {name: lean[name] * math.sin(way[name]) for name in HOLES}
    wide = math.hypot(north["C"] - north["B"], 0.9 + east["C"] - east["B"])
    assert closing.rows[1][4:] == (f"{wide:.3f}", "B-C", "4")
    assert [int(row[3]) for row in closing.rows] == [stage.open_joints for stage in wall.stages]
    assert [row[2] for row in closing.rows] == ["0.0", f"{100.0 * 6 / 15:.1f}", f"{100.0 * 9 / 15:.1f}"]


def test_columns_of_one_instrument_that_do_not_stand_side_by_side_are_named_one_by_one(tmp_path: Path) -> None:
    heads = HEADS.replace("B,0,0.9,,,,,", "B,0,0.9,,R-18,K-40,,").replace("E,0,3.6,,R-18,K-40,,", "E,0,3.6,,,,,")
    wall = read_wall(write_wall(tmp_path, WALL, heads))
    document = wall_report(wall, judgement_of(wall), origin())
    assert [row[3] for row in section(document, "Instruments").rows] == ["A, C, E", "B"]


def test_voids_of_a_grid(wall: Wall) -> None:
    voids = [
        VoidFinding(2.0, Void((0, 1, 2), 0.0123, (0.1, 0.2), 0.05)),
        VoidFinding(2.0, Void((1, 2, 3), 0.0031, (0.3, 0.4), 0.02)),
    ]
    three = (0, 1, 4)
    chance = VoidChance(np.array([0.01, 1.0, 0.0100001]), np.full(3, 1e-3), [None, (1, 2, 3), three], np.zeros((3, 2)))
    judgement = replace(judgement_of(wall), voids=voids, void_chance=chance)
    found = section(wall_report(wall, judgement, origin()), "Voids between the columns")
    assert list(found.columns) == ["depth m", "area cm²", "P(void)", "likeliest between"]
    assert list(found.rows) == [("2", "154", "1", "B, C, D"), ("4", "0", "0.01", "A, B, E")]
    assert list(found.marked) == [0, 1]
    assert list(found.words) == [
        "Depths with a void as surveyed, or with P(void) above 0.01, marked; and the depth of the largest."
    ]
    # nothing is likely: the depth of the largest alone, without a mark
    none = VoidChance(np.array([1e-4, 3e-4, 2e-4]), np.full(3, 1e-5), [None, None, None], np.zeros((3, 2)))
    found = section(
        wall_report(wall, replace(judgement, voids=[], void_chance=none), origin()), "Voids between the columns"
    )
    assert (list(found.rows), list(found.marked)) == ([("2", "0", "0.0003", "–")], [])


def test_where_depths_and_north_were_read_from(wall: Wall) -> None:
    file = replace(
        wall.file, depths_read_from="rotary-table", reference_height=3.25, north="grid", stations_north="magnetic"
    )
    site = site_of(replace(wall, file=file))
    assert site.depth_reference == "collar (stations were read from the rotary-table, 3.25 m above it)"
    assert site.north == "grid north; stations were read from magnetic"
    site = site_of(replace(wall, file=replace(file, reference_height=None)))
    assert site.depth_reference == "collar (stations were read from the rotary-table, by column)"
    same = site_of(wall)
    assert (same.depth_reference, same.north, same.project, same.client) == (
        "collar", "site", "Station square", "City railways",
    )  # fmt: skip
    assert (same.height_datum, same.grid) == ("DHHN2016", wall.file.grid)


def test_a_magnetic_wall_tells_its_field_and_warnings_are_counted(tmp_path: Path) -> None:
    """Other words of the facts: an exact radius, no project, unequal depths, a field, doubts of the data."""
    text = WALL.replace("radius_cv = 0.03\n", "field_nt = 49123.4\ndip_deg = 66.125\ndeclination_deg = 2.25\n")
    text = text.replace('project = "Station square"\n', "").replace('serial = "R-17"\n', "")
    text += 'instrument = "mwd-rev5.1"\n'
    heads = HEADS.replace("radius_m\n", "radius_m,length_m\n").replace(",\n", ",,\n").replace(",0.65\n", ",0.65,\n")
    wall = read_wall(write_wall(tmp_path, text, heads))
    wall = replace(wall, warnings=(EntryWarning("lean", "C", "column C leans", 0.0, 2.0), *wall.warnings))
    judgement = replace(judgement_of(wall), verdict=WallVerdict.TIGHT, findings=[], extras=[])
    facts = dict(wall_report(wall, judgement, origin()).facts)
    assert facts["Site"] == "gravity 9.81234 m/s^2; field 49123.4 nT, dip 66.125 deg, declination 2.250 deg"
    assert facts["Radius of a column"] == "0.6 and 0.65 m, taken as known exactly"
    assert facts["Check of the data"] == "warnings: 1"
    assert facts["Serial and calibration of the instruments"] == "stated of 1 of 4 columns that were surveyed"
    document = wall_report(wall, judgement, origin())
    assert (document.subject, document.verdict, document.good) == ("as built", "The wall is tight", True)
    assert section(document, "Reasons").words == ["None."]
    assert section(document, "What is to be done").words == ["Nothing."]
    records = {record.design.name: record for record in column_records(wall, judgement)}
    assert records["C"].warnings == ["column C leans"]
    assert records["B"].warnings == []
    assert [row[1:3] for row in section(document, "Instruments").rows] == [("not stated", "K-31"), ("R-18", "K-40")]


def test_depths_that_differ_by_joint_are_said(wall: Wall) -> None:
    assert tight_words(wall) == "0 to 4 m"
    plans = list(wall.plans)
    plans[5] = replace(plans[5], design=replace(plans[5].design, length=4.5))
    plans[4] = replace(plans[4], design=replace(plans[4].design, length=4.5))
    assert tight_words(replace(wall, plans=plans)) == "from the upper head to the lower toe of each joint"


def test_a_report_is_of_one_column_by_its_name_or_of_all(wall: Wall) -> None:
    judgement = judgement_of(wall)
    assert report_on(wall, judgement, "B", origin()).title == "Column B"
    assert report_on(wall, judgement, None, origin()).kind == "Wall report"
    with pytest.raises(SurveyError, match=r"^--column: expected one of A, B, C, D, E, F, got G$"):
        wall_report_pdf(wall, judgement, "G", DAY, "1.2.3", ReportPapers())


def lines_of(content: dict[str, Any]) -> list[str]:
    """What a reader reads, a line each: title and verdict, facts, then of every section its words, facts and table."""
    lines = [content["kind"], content["verdict"], *(f"{name}: {text}" for name, text in content["facts"])]
    for one in content["sections"]:
        lines += [f"# {one['title']}", *one["words"], *(f"{name}: {text}" for name, text in one["facts"])]
        lines += [" | ".join(row) for row in ([one["columns"]] if one["columns"] else []) + one["rows"]]
    return [*lines, " | ".join(content["signed_by"]), *content["labels"].values()]


def said_in(wall: Wall, language: str) -> dict[str, tuple[list[str], list[str]]]:
    """File of what was approved, and what a report of the wall or of a column says: there, and in English."""
    records = {record.design.name: record for record in column_records(wall, judgement_of(wall))}
    some = [column_report(records[name], site_of(wall), origin()) for name in "BCDF"]
    whole = wall_report(wall, judgement_of(wall), origin())
    documents = dict(zip(("wall", *"bcdf"), (whole, *some), strict=True))

    def lines_in(document: Document, to: str) -> list[str]:
        return lines_of(document_content(replace(document, origin=origin(to))))

    return {
        f"wall-report-{name}-{language}.txt": (lines_in(document, language), lines_in(document, "en"))
        for name, document in documents.items()
    }


@pytest.mark.parametrize("language", OTHERS)
def test_every_word_in_other_languages(wall: Wall, language: str) -> None:
    """As it was read and approved; the numbers are those of the English report, whose cells are computed above."""
    for name, (said, english) in said_in(wall, language).items():
        assert said == (APPROVED / name).read_text("utf-8").splitlines(), name
        numbers = [sorted(re.findall(r"\d+(?:\.\d+)?", line)) for line in said]
        assert numbers == [sorted(re.findall(r"\d+(?:\.\d+)?", line)) for line in english]


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        approved = read_wall(write_wall(Path(folder)))
    for other in OTHERS:
        for file, (words, _) in said_in(approved, other).items():
            (APPROVED / file).write_text("\n".join(words) + "\n", "utf-8")
