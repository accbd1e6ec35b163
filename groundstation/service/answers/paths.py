"""The answerable paths below ``ground/``: what each shows, its fields and the parameters it takes."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import orjson

from groundstation.errors import SelectorError
from groundstation.service.answers import (
    alarm_views,
    column_views,
    key_fields,
    measurement_views,
    order_views,
    verdict_views,
    views,
    wall_views,
)
from groundstation.service.answers.answer_fields import Fields, object_schema
from groundstation.service.answers.model import RigModel
from groundstation.service.answers.streamed_rows import STREAMED
from groundstation.service.answers.views import Parameters, View, finite, utc_text

LONGEST_NUMBER = 18  # digits
SHOWN = 30  # numbers that a refusal names
_NUMBER = re.compile(r"\{[a-z]+\}")


def _station_numbers(k: RigModel) -> range:
    return range(1, len(k.hole.stations) + 1)


@dataclass(frozen=True, slots=True)
class Path:
    """One answerable path below ``ground/``: what it shows, its fields, and which parameters it takes.

    One that shows the hole alone changes with a survey only, and is asked for far more often.
    """

    view: Callable[[RigModel, Parameters], View]
    own: Fields
    parameters: tuple[str, ...] = ()
    is_of_the_hole: bool = False
    text: Callable[[RigModel, Parameters], bytes] | None = None  # JSON of ``view``, where rows of it are kept as such

    def show(self, k: RigModel, p: Parameters) -> View:
        """The whole answer: what every answer has, and the view."""
        return header(k) | self.view(k, p)

    def json(self, k: RigModel, p: Parameters) -> bytes:
        """The whole answer as JSON; of the hole the text of the last time, behind a header of now."""
        if self.text is not None:
            text = self.text(k, p)
        elif self.is_of_the_hole and not p:
            text = k.texts.text_of(self.view, lambda: orjson.dumps(self.view(k, p)))
        else:
            return orjson.dumps(self.show(k, p))
        return orjson.dumps(header(k))[:-1] + b"," + text[1:]

    @property
    def fields(self) -> Fields:
        """Fields of the whole answer."""
        return (*key_fields.HEADER, *self.own)

    @property
    def is_stream(self) -> bool:
        """Whether its rows are numbered in the order of their coming; only new ones are published."""
        return STREAMED[0] in self.parameters


def header(k: RigModel) -> View:
    """What every answer begins with."""
    return {"revision": k.revisions.newest, "utc": utc_text(time.time()), "rig_time_s": finite(k.string.time.rig_now)}


@dataclass(frozen=True, slots=True)
class Member:
    """Paths of one pattern, one a member: the numbers that there are, and what the path of one shows."""

    numbers: Callable[[RigModel], Iterable[int]]
    view: Callable[[RigModel, int], View]
    own: Fields

    @property
    def fields(self) -> Fields:
        """Fields of the answer of one member."""
        return (*key_fields.HEADER, *self.own)

    def path(self, number: int) -> Path:
        """The path of one member."""
        return Path(lambda k, _p: self.view(k, number), self.own)


FIXED: dict[str, Path] = {
    "status": Path(views.status, key_fields.STATUS),
    "verdict": Path(verdict_views.verdict, key_fields.VERDICT),
    "string": Path(views.string, key_fields.STRING),
    "stations": Path(views.stations, key_fields.STATIONS, ("md",), is_of_the_hole=True),
    "measurements": Path(
        measurement_views.measurements,
        key_fields.MEASUREMENTS,
        ("station", "tube", *STREAMED),
        text=measurement_views.measurements_text,
    ),
    "trajectory": Path(views.trajectory, key_fields.TRAJECTORY, ("md",), is_of_the_hole=True),
    "events": Path(views.events, key_fields.EVENTS, ("tube", *STREAMED)),
    "static_records": Path(views.static_records, key_fields.STATIC_RECORDS, ("tube", *STREAMED)),
    "uncertainty": Path(column_views.uncertainty, key_fields.UNCERTAINTY, ("confidence",), is_of_the_hole=True),
    "column": Path(column_views.column, key_fields.COLUMN, ("moment",), is_of_the_hole=True),
    "history": Path(column_views.history, key_fields.HISTORY, ("points",)),
    "wall": Path(wall_views.wall, key_fields.WALL),
    "alarms": Path(alarm_views.alarms, key_fields.ALARMS),
    "recalibration": Path(views.recalibration, key_fields.RECALIBRATION),
    "orders": Path(order_views.orders, key_fields.ORDERS),
    "changes": Path(views.changes, key_fields.CHANGES),
    "schema": Path(lambda _k, _p: {"schemas": schemas()}, key_fields.SCHEMA),
}
MEMBERS: dict[str, Member] = {
    "nodes/{tube}": Member(lambda k: sorted(k.string.states.newest), views.node, key_fields.NODE),
    "stations/{n}": Member(_station_numbers, views.station, key_fields.STATION),
    "stations/{n}/measurements": Member(
        _station_numbers, measurement_views.station_measurements, key_fields.STATION_MEASUREMENTS
    ),
    "orders/{n}": Member(lambda k: [known.number for known in k.orders], order_views.order, key_fields.ORDER),
}
PATTERNS = (*FIXED, *MEMBERS)


def find(k: RigModel, path: str) -> Path:
    """The path, if it has an answer now.

    Raises
    ------
    SelectorError
        When it has none; it lists those that can have one.
    """
    if path in FIXED:
        return FIXED[path]
    pattern, number = _parted(path)
    member = MEMBERS.get(pattern)
    if member is None:
        raise SelectorError(f"{path}: no such path; expected one of {', '.join(PATTERNS)}")
    numbers = list(member.numbers(k))
    if number not in numbers:
        there_are = ", ".join(map(str, numbers[-SHOWN:])) or "none yet"
        raise SelectorError(f"{path}: no such number; of {pattern} there are {there_are}")
    return member.path(number)


def fields_of(path: str) -> Fields:
    """Fields of the answer of a path, whether it has one now or not.

    Raises
    ------
    SelectorError
        When there is no such path.
    """
    known = FIXED.get(path) or MEMBERS.get(_parted(path)[0])
    if known is None:
        raise SelectorError(f"{path}: no such path; expected one of {', '.join(PATTERNS)}")
    return known.fields


def is_of_the_hole(path: str) -> bool:
    """Whether a path shows the whole hole, and so changes with a survey only."""
    return path in FIXED and FIXED[path].is_of_the_hole


def check_parameters(found: Iterable[Path], parameters: Parameters, common: tuple[str, ...] = ()) -> None:
    """Refuse a parameter that none of the paths asked for takes; ``common`` are those of every path.

    Raises
    ------
    SelectorError
        Naming those that are taken.
    """
    known = sorted({name for path in found for name in path.parameters} | set(common))
    for name in parameters:
        if name not in known:
            raise SelectorError(f"parameter {name}: expected {'one of ' + ', '.join(known) if known else 'none'}")


def schemas() -> dict[str, View]:
    """JSON schema of the answer of every path."""
    return {pattern: object_schema(path.fields) for pattern, path in (FIXED | MEMBERS).items()}


def paths(k: RigModel) -> dict[str, Path]:
    """Every path that has an answer now."""
    found = dict(FIXED)
    for pattern, member in MEMBERS.items():
        for number in member.numbers(k):
            found[_NUMBER.sub(str(number), pattern)] = member.path(number)
    return found


def _parted(path: str) -> tuple[str, int]:
    """Pattern and number of a path such as ``stations/3/measurements``; an empty pattern for any other."""
    parts = path.split("/")
    if len(parts) < 2 or not parts[1].isdecimal() or len(parts[1]) > LONGEST_NUMBER:
        return "", 0
    name = "{tube}" if parts[0] == "nodes" else "{n}"
    return "/".join([parts[0], name, *parts[2:]]), int(parts[1])
