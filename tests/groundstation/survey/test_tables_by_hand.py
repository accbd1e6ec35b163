"""Tables of stations and files of a hole, cell by cell: what is read is what stands there, on its own line."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from groundstation.errors import SurveyError
from groundstation.service.hole.hole_depths import HoleDepths
from groundstation.service.hole.position_sources import _of_directions, depth_variance_at_toe, take_undone
from groundstation.survey.exports.export_hole import ExportHole, ExportSite
from groundstation.survey.exports.ifc_export import _StepLines, _text, ifc_bytes
from groundstation.survey.exports.las_export import las_bytes
from groundstation.survey.files.cell_numbers import cell_numbers, decimal_sign, plain_cell
from groundstation.survey.files.field_table import FieldTable, TableWish
from groundstation.survey.files.hole_choice import choose_hole
from groundstation.survey.files.las_files import read_las
from groundstation.survey.files.station_tables import understand_table

FILE = Path("a.csv")


@pytest.mark.parametrize(
    ("cells", "separator", "asked", "sign"),
    [
        (["1.5", "2"], ";", None, "."),
        (["1,5", "2,25"], ";", None, ","),
        (["1,234.5", "12,345.0"], ";", None, ",."),
        (["1,234.5", "2,345"], ";", None, ",."),
        (["1,5", "2.5"], ";", None, None),
        (["1,234.5", "2,34"], ";", None, None),
        (["1,234", "2,345"], ";", None, None),
        (["1,5"], ",", None, None),
        (["1,234"], ";", "comma", ","),
        (["1,234"], ";", "point", ",."),
    ],
)
def test_what_a_comma_is(cells: list[str], separator: str, asked: str | None, sign: str | None) -> None:
    if sign is None:
        with pytest.raises(SurveyError):
            decimal_sign(FILE, cells, separator, asked)
    else:
        assert decimal_sign(FILE, cells, separator, asked) == sign


def test_cells_are_numbers_by_the_sign_of_their_table() -> None:
    assert [plain_cell(*one) for one in (("1.234,5", ","), ("1,234.5", ",."), ("1.5", "."))] == [
        "1234.5",
        "1234.5",
        "1.5",
    ]
    assert cell_numbers(FILE, [1, 2], "md", ["1.234,5", "7,25"], ",") == [1234.5, 7.25]
    assert cell_numbers(FILE, [1, 2, 3], "md", ["1.5", "-999.25", "2"], ".") == [1.5, None, 2.0]
    for cells, words in (
        (["1", "1_0"], "line 6: expected numbers, got md = '1_0'"),
        (["1", "2 m"], "a unit of its own"),
    ):
        with pytest.raises(SurveyError, match=words):
            cell_numbers(FILE, [5, 6], "md", cells, ".")


def table(header: list[str], *rows: str, **more: Any) -> FieldTable:
    return FieldTable("test", header, [row.split() for row in rows], [10 + 2 * k for k in range(len(rows))], **more)


def test_of_several_holes_the_rows_of_the_chosen_one_are_read_with_their_lines() -> None:
    made = table(["hole", "md", "rig"], "A 0 x", "B 0 x", "A 5 y", "C 0 x", "B 7 x")
    chosen, warnings = choose_hole(FILE, made, {1}, TableWish(hole="B"))
    assert (chosen.rows, chosen.lines, warnings) == ([["B", "0", "x"], ["B", "7", "x"]], [12, 18], [])
    chosen, warnings = choose_hole(FILE, made, {1}, TableWish(hole="A"))
    assert chosen.lines == [10, 14]
    assert [one.text for one in warnings] == ["A: rig differs among its stations and was not read"]
    assert choose_hole(FILE, made, {1}, TableWish(hole="*")) == (made, [])
    with pytest.raises(SurveyError, match="hole tells 3 holes apart: A, B, C; expected --hole"):
        choose_hole(FILE, made, {1}, TableWish())
    with pytest.raises(SurveyError, match="--hole D: expected one of its holes, A, B, C, x, y"):
        choose_hole(FILE, made, {1}, TableWish(hole="D"))
    twice = table(["md", "hole", "rig"], "0 A B", "5 B A", "7 B C")  # a name in two columns is the first one's
    assert choose_hole(FILE, twice, {0}, TableWish(hole="B"))[0].lines == [12, 14]
    many = table(["well", "md"], *(f"{k} 0" for k in range(8)))
    with pytest.raises(SurveyError, match=r"well tells 8 holes apart: 0, 1, 2, 3, 4, 5 \.\.\.;"):
        choose_hole(FILE, many, {1}, TableWish())
    for name in ("remark", "date", "depth_2"):  # words of a station, and numbers, are no holes
        assert choose_hole(FILE, table([name, "md"], "1 0", "2 5"), {1}, TableWish())[1] == []


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_dip_counts_from_the_horizontal_whichever_way_it_is_signed(sign: float) -> None:
    rows = [f"{md} {sign * dip} 40" for md, dip in ((0, 90), (10, 88), (20, 85.5))]
    found = understand_table(FILE, table(["md", "dip", "azimuth"], *rows), TableWish()).record
    assert np.degrees(found.inclination) == pytest.approx([0.0, 2.0, 4.5])
    with pytest.raises(SurveyError, match="dips of one sign"):
        understand_table(FILE, table(["md", "dip", "azimuth"], "0 -88 1", "5 87 1"), TableWish())


def test_a_row_of_units_is_no_station_and_lines_are_those_of_the_stations() -> None:
    made = table(["md", "inclination", "azimuth"], "ft deg deg", "0 1 2", "10 1 2", "20 -999.25 2", "30 1 2")
    found = understand_table(FILE, made, TableWish())
    assert found.record.md == pytest.approx([0.0, 3.048, 9.144])
    (warning,) = found.record.warnings
    assert "line 16: inclination = '-999.25' stands for no value, at 20" in warning.text
    assert (warning.top, warning.bottom) == (pytest.approx(6.096), pytest.approx(6.096))
    with pytest.raises(SurveyError, match="line 18"):
        understand_table(
            FILE, table(["md", "inclination", "azimuth"], "m deg deg", "0 1 2", "9 1 2", "10 1 2", "x 1 2"), TableWish()
        )


LAS = """~Version
VERS. 2.0 : log
WRAP. {wrap} : one line a depth
~Well
NULL. -99 : no value
~Curve
DEPT.M : depth
INCL.DEG : inclination
AZIM.DEG : azimuth
~ASCII
{rows}
"""


@pytest.mark.parametrize(("wrap", "rows"), [("NO", "0 1 2\n5 -99.0 2\n10 3 4"), ("YES", "0\n1 2\n5 -99.0\n2 10 3\n4")])
def test_a_log_is_read_row_by_row_and_what_is_null_is_empty(wrap: str, rows: str) -> None:
    (found,) = read_las(Path("a.las"), LAS.format(wrap=wrap, rows=rows).encode())
    assert found.header == ["DEPT (M)", "INCL (DEG)", "AZIM (DEG)"]
    assert found.rows == [["0", "1", "2"], ["5", "", "2"], ["10", "3", "4"]]
    with pytest.raises(SurveyError, match=r"expected 3 values, got [25]"):
        read_las(Path("a.las"), LAS.format(wrap=wrap, rows=rows + " 7 8").encode())


def hole(md: list[float], **more: Any) -> ExportHole:
    n = len(md)
    local = np.column_stack([np.arange(n) + 0.1, np.arange(n) + 0.2, np.arange(n) + 0.3])
    axis = np.column_stack([np.arange(n) + 100.0, np.arange(n) + 200.0, 50.0 - np.arange(n)])
    return ExportHole("H'1", np.array(md), np.arange(n) + 1.0, np.arange(n) + 2.0, local, axis, **more)


@pytest.mark.parametrize(("md", "step"), [([0.0, 5.0, 10.0], 5.0), ([0.0, 5.0, 10.4], 0.0), ([3.0], 0.0)])
def test_a_log_has_each_curve_in_its_column(md: list[float], step: float) -> None:
    covs = np.array([np.diag([1e-4, 4e-4, 9e-4])] * len(md))
    text = las_bytes(ExportSite("s", (hole(md, covs=covs),), client="c: d")).decode().splitlines()
    at = text.index("~Curve")
    names = [line.partition(".")[0] for line in text[at + 1 : text.index("~Other")]]
    assert names == ["DEPT", "INCL", "AZIM", "TVD", "NORTH", "EAST", "SNORTH", "SEAST", "STVD"]
    assert [float(cell) for cell in text[-1].split()] == pytest.approx(
        [md[-1], len(md), len(md) + 1.0, len(md) - 0.7, len(md) - 0.9, len(md) - 0.8, 0.01, 0.02, 0.03]
    )
    assert f"STEP.M {step:.6f} : step" in text
    assert [line for line in text if line.startswith(("STRT", "STOP", "COMP"))] == [
        f"STRT.M {md[0]:.6f} : first depth", f"STOP.M {md[-1]:.6f} : last depth", "COMP. c  d : company",
    ]  # fmt: skip


def test_a_model_has_its_points_from_the_first_head_and_names_of_twenty_two_letters() -> None:
    text = ifc_bytes(ExportSite("s", (hole([0.0, 5.0], radius=0.6), hole([0.0, 5.0])))).decode()
    assert "IFCCARTESIANPOINT((100.0,200.0,50.0))" in text
    assert text.count("IFCCARTESIANPOINT((1.0,1.0,-1.0))") == 2
    assert [word for word in (",0.6,$,$,$)", ",0.05,$,$,$)") if word in text] == [",0.6,$,$,$)", ",0.05,$,$,$)"]
    assert "'H''1'" in text
    assert _text("é'\\🛠") == "\\X2\\00E9\\X0\\''\\\\\\X4\\0001F6E0\\X0\\"
    names = {_StepLines(project).guid(name) for project in ("p", "q") for name in ("a", "b", "site", "pile/A")}
    assert {len(name) for name in names} == {22}
    assert len(names) == 8  # two projects that are put together share none
    assert {name[0] for name in names} <= set("0123")  # 128 bits are two and 21 times six


# of what the variance of a place is made


def test_variances_of_a_place_by_their_sources() -> None:
    drawn: Any = SimpleNamespace(
        positions=np.array([[0.0, 0.0, 0.0], [3.0, 4.0, 9.0]]),
        swung_covs=np.array([np.zeros((3, 3)), np.diag([1e-5, 2e-5, 0.0])]),
        shared_depth_vars=np.array([[0.0] * 3, [1e-4, 2e-4, 3e-4]]),
        depth_covs=np.array([np.zeros((3, 3)), np.diag([4e-4, 5e-4, 6e-4])]),
    )
    examined: Any = SimpleNamespace(position_variances={"bias": np.zeros((2, 3))})
    found = _of_directions(drawn, None, examined, 0.01)
    assert found["north"][1] == pytest.approx([(0.01 * 4.0) ** 2 + 1e-5, (0.01 * 3.0) ** 2 + 2e-5, 0.0])
    assert found["depth"][1] == pytest.approx([1e-4, 2e-4, 3e-4])
    assert depth_variance_at_toe(drawn) == pytest.approx([5e-4, 7e-4, 9e-4])
    left = take_undone(np.array([[6.0, 1.0, 0.0], [2.0, 3.0, 0.0]]), np.array([-4.0, -5.0, 0.0]))
    assert left == pytest.approx(np.array([[3.0, 0.0, 0.0], [1.0, 0.0, 0.0]]))


def test_a_depth_that_was_read_more_often_is_better_known_and_what_was_told_anew_counts(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    room = "groundstation.service.hole.hole_depths."
    asked: list[float] = []

    def mean_depth(md: float, _places: Any, _errors: Any, _length: float, told: Any) -> Any:
        asked.append(md)
        return SimpleNamespace(columns=len(asked))

    monkeypatch.setattr(room + "mean_depth", mean_depth)
    monkeypatch.setattr(room + "depth_errors", lambda *_: SimpleNamespace(reading_std=0.06))
    setup: Any = SimpleNamespace(version=1, lengths={})
    stops: Any = SimpleNamespace(depth_places=dict.fromkeys(range(9), ()))
    config: Any = SimpleNamespace(tube_length=2.0)
    depths = HoleDepths(config, setup, None, stops)
    station: Any = SimpleNamespace(md=4.0, revised=0, stops=SimpleNamespace(rows=[0, 1, 2, 3]))
    found = [depths.of_stations([station], 1, learns=False)[4.0] for _ in range(2)]
    assert [dataclasses.astuple(one) for one in found] == [(1, pytest.approx(0.06**2 / 4.0))] * 2
    setup.version = 2
    depths.of_stations([station], 1, learns=False)
    station.revised = 1
    depths.of_stations([station], 1, learns=False)
    station.stops.rows.append(4)
    depths.of_stations([station], 1, learns=False)
    assert asked == [4.0] * 4
