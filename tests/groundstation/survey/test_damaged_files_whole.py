"""Every reader of files, told what it makes of a good file and of each that is damaged in one place.

A number is gone, is a word, stands for no value, is far too large or has another sign; a line is gone or stands twice:
of each either what was read or the refusal is held, word by word, with the file's line.
"""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from read_back import check, leaves, number, numbers, write_anew
from same_well import FORMATS
from small_wall import HEADS, WALL, write_wall

from groundstation.calibration.accuracy_records import read_characteristic
from groundstation.calibration.calibration_records import read_attitudes, read_turn_table
from groundstation.calibration.matrix_files import read_matrix
from groundstation.calibration.mwd_files import read_mwd
from groundstation.errors import SurveyError
from groundstation.plan_settings import read_plan
from groundstation.survey.files.field_files import read_any
from groundstation.survey.files.programme import read_programme, read_tie_on
from groundstation.survey.tools.instruments import load_tool
from groundstation.survey.wall.wall_file import read_wall
from telemetry.errors import BorechainError

INSTRUMENTS = Path(__file__).parents[3] / "scenarios" / "instruments"
VALUE = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?![\w.])")
PLACES = 5  # of each kind of damage, evenly spread over a file
INSTEAD = ("", "x", "-999.25", "1e12", "-7.5")


@dataclass(frozen=True)
class FileKind:
    """A kind of file: its name, a good one, and what reads it into something that is told."""

    name: str
    good: str
    read: Callable[[Path], Any]


def surveyed(path: Path) -> Any:
    found = read_any(path)
    record = found.record
    return {
        "line": found.line,
        "md": record.md,
        "inclination": np.degrees(record.inclination),
        "azimuth": np.degrees(record.azimuth),
        "norths": (found.north, found.depth_reference),
        "warnings": [warning.text for warning in record.warnings],
    }


def walled(path: Path) -> Any:
    """A wall whose file of that name is the damaged one."""
    folder = path.parent / "wall"
    if not folder.exists():
        folder.mkdir()
        write_wall(folder)
    kept = folder / path.name.removeprefix("wall-")
    before = kept.read_text()
    try:
        shutil.copy(path, kept)
        wall = read_wall(folder / "wall.toml")
        return {
            "plans": [(one.design.name, one.status.value, one.serial, one.calibration, number(one.head_std),
                       numbers(one.design.head), number(one.design.radius), number(one.design.length),
                       one.design.tolerance.name) for one in wall.plans],
            "holes": [numbers((*hole.md, *np.degrees(hole.inclination))) for hole in wall.holes],
            "days": [str(day) for day in wall.drilled_on],
            "warnings": [warning.text for warning in wall.warnings],
        }  # fmt: skip
    finally:
        kept.write_text(before)


def planned(path: Path) -> Any:
    plan = read_plan(path).to_plan()
    return {"md": plan.md, "ends": plan.positions if hasattr(plan, "positions") else plan.tangents}


def legs_of(path: Path) -> Any:
    return [(one.tool.name, number(one.top), "on" if one.bottom is None else number(one.bottom))
            for one in read_programme(path)]  # fmt: skip


def tool_of(path: Path) -> Any:
    tool = load_tool(str(path))
    return {"name": tool.name, "title": tool.title, "terms": [
        (term.name, number(term.value), term.unit, term.mode.value, term.formulas) for term in tool.terms
    ] if hasattr(tool.terms[0], "formulas") else [str(term) for term in tool.terms]}  # fmt: skip


def stations_of_wall() -> str:
    import tempfile

    with tempfile.TemporaryDirectory() as folder:
        return (write_wall(Path(folder)).parent / "stations.csv").read_text()


def laboratory(name: str, rows: int) -> str:
    return "".join((INSTRUMENTS / f"{name}.csv").read_text().splitlines(keepends=True)[:rows])


PLAN = """inclination_deg = 1.0
azimuth_deg = 20.0
tolerance = "40 mm + 1:120"
[[leg]]
length_m = 3
[[leg]]
from_m = 3
length_m = 5
build_deg_per_m = 0.5
turn_deg_per_m = 1.5
[[leg]]
length_m = 4
to_inclination_deg = 4
to_azimuth_deg = 20
"""
LEGS = """[[leg]]
from_m = 5.0
to_m = 88.0
instrument = "mwd-rev5.1"
[[leg]]
from_m = 88.0
instrument = "stim300"
"""
TIE = """md_m = 5.0
inclination_deg = 0.75
azimuth_deg = 15.0
north_m = 0.04
east_m = -0.03
tvd_m = 4.99
covariance_m2 = [[0.001, 0.0002, 0.0001], [0.0002, 0.002, -0.0003], [0.0001, -0.0003, 0.004]]
"""
TOOL = """[tool]
name = "probe"
title = "a probe"
kind = "Inertial"
inclination_max_deg = 60.0
[[term]]
name = "IB"
value = 0.01
unit = "deg"
mode = "systematic"
inclination = "Sin(Inc) + 2 * GField"
[[term]]
name = "AZ"
value = 0.25
unit = "deg"
mode = "random"
azimuth = "1 / Max(Sin(Inc), 0.01)"
"""
DISPLACED = "md_m,a_cm,b_cm\n0,0,0\n3,2,-1.5\n6,5,-3\n9,11,-6\n"
RELAYED = (
    "md_m,inclination_deg,azimuth_deg,time_s,yaw_sigma_deg,force_sigma_mps2\n"
    "0,0.5,20,10,0.2,0.004\n4,1.25,24,610,0.23,0.005\n8,2.5,31,1210,0.26,0.006\n12,3.75,29,1810,0.29,0.007\n"
)
ACCURACY = "preset_deg,reading_deg\n15,15.1\n15,15.3\n30,30.2\n30,29.7\n60,60.5\n60,60.1\n"
TEXTS = {name: make().decode("utf-16" if name == "usft.txt" else "cp1252" if name == "old.csv" else "utf-8")
         for name, make in FORMATS.items() if name != "book.xlsx"}  # fmt: skip
KINDS = [
    *(FileKind(name, text, surveyed) for name, text in TEXTS.items()),
    FileKind("lateral.csv", DISPLACED, surveyed), FileKind("relay.csv", RELAYED, surveyed),
    FileKind("plan.toml", PLAN, planned), FileKind("legs.toml", LEGS, legs_of),
    FileKind("tie.toml", TIE, read_tie_on), FileKind("tool.toml", TOOL, tool_of),
    FileKind("wall-wall.toml", WALL, walled), FileKind("wall-heads.csv", HEADS, walled),
    FileKind("wall-stations.csv", stations_of_wall(), walled),
    FileKind("turntable.csv", laboratory("turntable", 9), lambda path: read_turn_table(path, 720.0)),
    FileKind("attitudes.csv", laboratory("attitudes", 9), read_attitudes),
    FileKind("mwd.csv", laboratory("mwd-control", 9), read_mwd),
    FileKind("accuracy.csv", ACCURACY, read_characteristic),
    FileKind("matrix.toml", "matrix = [[1.01, 0.02, -0.03], [0.04, 0.98, 0.05], [0.06, -0.07, 1.02]]\n", read_matrix),
]  # fmt: skip


def spread(count: int) -> list[int]:
    """So many places of ``count``, the first and the last among them."""
    return sorted({round(k * (count - 1) / (PLACES - 1)) for k in range(PLACES)}) if count else []


def damaged(text: str) -> Iterator[tuple[str, str]]:
    """Damages of a text in words, and the text with each."""
    found = list(VALUE.finditer(text))
    for place in spread(len(found)):
        begin, end = found[place].span()
        for new in INSTEAD:
            yield f"number {place + 1}, {found[place][0]}, is {new!r}", text[:begin] + new + text[end:]
    lines = text.splitlines(keepends=True)
    for place in spread(len(lines)):
        yield f"line {place + 1} is gone", "".join(lines[:place] + lines[place + 1 :])
        yield f"line {place + 1} is there twice", "".join(lines[: place + 1] + lines[place:])
    yield "it ends in the middle", text[: len(text) // 2]
    yield "it is empty", ""


def made_of(kind: FileKind, folder: Path, text: str) -> str:
    """What a reader makes of a text, in one line."""
    path = folder / kind.name
    path.write_text(text, encoding="utf-8", newline="")
    try:
        told = "; ".join(leaves(kind.read(path)))
    except BorechainError as error:
        told = f"refused: {error}"
    return told.replace(str(folder), "FOLDER")


def told(folder: Path, kind: FileKind) -> Iterator[str]:
    """The good file, and of each damaged one what is otherwise."""
    good = made_of(kind, folder, kind.good)
    yield f"good: {good}"
    for words, text in damaged(kind.good):
        found = made_of(kind, folder, text)
        yield f"{words}: {'as before' if found == good else found}"


MADE: dict[str, Callable[[Path], Iterable[str]]] = {
    f"damaged-{kind.name}": (lambda folder, kind=kind: told(folder, kind))
    for kind in KINDS  # type: ignore[misc]
}


@pytest.mark.parametrize("name", MADE)
def test_what_a_reader_makes_of_a_damaged_file_is_as_approved(tmp_path: Path, name: str) -> None:
    check(name, MADE[name](tmp_path))


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind.read is surveyed], ids=lambda kind: kind.name)
def test_a_survey_that_lost_a_number_is_refused_warns_or_lost_that_station_alone(
    tmp_path: Path, kind: FileKind
) -> None:
    """No number is made up: what is read of a file without a value are stations of the good one."""
    path = tmp_path / kind.name
    path.write_text(kind.good, encoding="utf-8", newline="")
    good = read_any(path).record
    rows = np.column_stack([good.md, good.inclination, good.azimuth])
    for words, text in damaged(kind.good):
        if not words.endswith("is ''"):
            continue
        path.write_text(text, encoding="utf-8", newline="")
        try:
            record = read_any(path).record
        except SurveyError:
            continue
        read = np.column_stack([record.md, record.inclination, record.azimuth])
        known = [bool(np.isclose(rows, row, rtol=0.0, atol=1e-9).all(axis=1).any()) for row in read]
        assert all(known) or record.warnings, words


if __name__ == "__main__":
    write_anew(MADE)
