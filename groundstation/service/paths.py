"""The answerable paths below ``ground/``: what each shows, its fields and the parameters it takes."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from groundstation.errors import SelectorError
from groundstation.service import alarm_views, column_views, key_fields, order_views, verdict_views, views
from groundstation.service.answers import Fields
from groundstation.service.model import RigModel
from groundstation.service.views import Parameters, View

LONGEST_NUMBER = 18  # digits
_NUMBER = re.compile(r"\{[a-z]+\}")


def _station_numbers(k: RigModel) -> range:
    return range(1, len(k.stations) + 1)


@dataclass(frozen=True, slots=True)
class Path:
    """One answerable path below ``ground/``: what it shows, its fields, and which parameters it takes."""

    show: Callable[[RigModel, Parameters], View]
    fields: Fields
    parameters: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Member:
    """Paths of one pattern, one a member: the numbers that there are, and what the path of one shows."""

    numbers: Callable[[RigModel], Iterable[int]]
    show: Callable[[RigModel, int], View]
    fields: Fields

    def path(self, number: int) -> Path:
        """The path of one member."""
        return Path(lambda k, _p: self.show(k, number), self.fields)


FIXED: dict[str, Path] = {
    "status": Path(views.status, key_fields.STATUS),
    "verdict": Path(verdict_views.verdict, key_fields.VERDICT),
    "string": Path(views.string, key_fields.STRING),
    "stations": Path(views.stations, key_fields.STATIONS, ("md",)),
    "measurements": Path(views.measurements, key_fields.MEASUREMENTS, ("station", "tube")),
    "trajectory": Path(views.trajectory, key_fields.TRAJECTORY, ("md",)),
    "events": Path(views.events, key_fields.EVENTS, ("tube",)),
    "static_records": Path(views.static_records, key_fields.STATIC_RECORDS, ("tube",)),
    "uncertainty": Path(column_views.uncertainty, key_fields.UNCERTAINTY, ("confidence",)),
    "column": Path(column_views.column, key_fields.COLUMN),
    "alarms": Path(alarm_views.alarms, key_fields.ALARMS),
    "recalibration": Path(views.recalibration, key_fields.RECALIBRATION),
    "orders": Path(order_views.orders, key_fields.ORDERS),
}
MEMBERS: dict[str, Member] = {
    "nodes/{tube}": Member(lambda k: sorted(k.nodes), views.node, key_fields.NODE),
    "stations/{n}": Member(_station_numbers, views.station, key_fields.STATION),
    "stations/{n}/measurements": Member(_station_numbers, views.station_measurements, key_fields.STATION_MEASUREMENTS),
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
    if member is None or number not in member.numbers(k):
        raise SelectorError(f"{path}: no such path; expected one of {', '.join(PATTERNS)}")
    return member.path(number)


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
