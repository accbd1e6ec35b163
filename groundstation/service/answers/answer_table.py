"""The table of answers: which paths below ``ground/`` there are, what each holds, and how it is asked for.

What describes answers is made from this table and from the classes it names; what makes each is said in ``paths``.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any, Final

from groundstation.errors import SelectorError
from groundstation.service.answers.shapes.adjustment_shapes import AdjustmentAnswer
from groundstation.service.answers.shapes.alarm_shapes import AlarmsAnswer
from groundstation.service.answers.shapes.answer_fields import Fields, fields_of_answer, object_schema
from groundstation.service.answers.shapes.column_shapes import ColumnAnswer, HistoryAnswer, Verdict
from groundstation.service.answers.shapes.hole_shapes import (
    MeasurementsAnswer,
    Station,
    StationMeasurementsAnswer,
    StationsAnswer,
    TrajectoryAnswer,
    UncertaintyAnswer,
)
from groundstation.service.answers.shapes.order_shapes import Order, OrdersAnswer, RecalibrationAnswer
from groundstation.service.answers.shapes.setup_shapes import SetupAnswer
from groundstation.service.answers.shapes.string_shapes import (
    AnswerHeader,
    ChangesAnswer,
    EventsAnswer,
    NodeAnswer,
    SchemaAnswer,
    StaticRecordsAnswer,
    StatusAnswer,
    StringAnswer,
)
from groundstation.service.answers.shapes.wall_shapes import WallAnswer
from groundstation.service.answers.streamed_rows import STREAMED
from telemetry import keys

LONGEST_NUMBER = 18  # digits
NUMBER: Final = re.compile(r"\{([a-z]+)\}")


@dataclass(frozen=True, slots=True)
class AnswerKey:
    """One line of the table.

    Parameters
    ----------
    path : below ``ground/``; a name in braces stands for a number
    shape : class of the answer
    meaning : of the key
    parameters : that it takes
    published : it is published when it changes, of a stream the new rows
    of_the_hole : it shows the hole alone, changes with a survey only, and is asked for far more often
    on_page : the page follows it
    """

    path: str
    shape: type[Any]
    meaning: str
    parameters: tuple[str, ...] = ()
    published: bool = True
    of_the_hole: bool = False
    on_page: bool = False

    @property
    def fields(self) -> Fields:
        """Fields of the whole answer."""
        return (*fields_of_answer(AnswerHeader), *fields_of_answer(self.shape))

    @property
    def numbers(self) -> list[str]:
        """Names of the numbers in its path."""
        return NUMBER.findall(self.path)

    @property
    def is_stream(self) -> bool:
        """Whether its rows are numbered in the order of their coming; only new ones are published."""
        return STREAMED[0] in self.parameters

    @property
    def key(self) -> keys.Key:
        """Its line among the key expressions."""
        template = keys.GROUND.format(rig="{rig}", path=self.path)
        return keys.Key(template, "query, publish" if self.published else "query", self.meaning)


ANSWERS: Final = {
    answer.path: answer
    for answer in (
        AnswerKey("status", StatusAnswer, "rig time, depth, counts, health", on_page=True),
        AnswerKey(
            "verdict",
            Verdict,
            "on target, watch, steer, out or don't know; how far off, which way, until where it can be corrected",
            on_page=True,
        ),
        AnswerKey("string", StringAnswer, "tubes from top to bottom with depth and age", on_page=True),
        AnswerKey("stations", StationsAnswer, "all stations, fused", ("md",), of_the_hole=True),
        AnswerKey(
            "measurements",
            MeasurementsAnswer,
            "every cluster measurement, new ones published; ?station=2..5, ?tube=3, ?since=17;limit=10",
            ("station", "tube", *STREAMED),
        ),
        AnswerKey(
            "trajectory",
            TrajectoryAnswer,
            "positions with covariance; ?md=12.5, ?md=4..12",
            ("md",),
            of_the_hole=True,
        ),
        AnswerKey(
            "events",
            EventsAnswer,
            "events of the nodes, new ones published; ?tube=3, ?since=17",
            ("tube", *STREAMED),
        ),
        AnswerKey(
            "static_records",
            StaticRecordsAnswer,
            "raw readings that nodes averaged at rest, new ones published; ?tube=3, ?since=17",
            ("tube", *STREAMED),
        ),
        AnswerKey(
            "uncertainty",
            UncertaintyAnswer,
            "region of uncertainty, its sources; ?confidence=0.9",
            ("confidence",),
            of_the_hole=True,
            on_page=True,
        ),
        AnswerKey(
            "adjustment",
            AdjustmentAnswer,
            "what the tubes say about each other once the surveys of a stop are there: how well all fit, what is "
            "wrong and with what, sensors as learnt, of what the sigma at the toe is made, what would be found, the "
            "angle of the next stop",
            of_the_hole=True,
            on_page=True,
        ),
        AnswerKey(
            "column",
            ColumnAnswer,
            "deviation from the design, projected to the target; ?moment=3",
            ("moment",),
            of_the_hole=True,
            on_page=True,
        ),
        AnswerKey(
            "history",
            HistoryAnswer,
            "what was known of the column at the end of every stop, thinned; ?points=200",
            ("points",),
            on_page=True,
        ),
        AnswerKey(
            "wall",
            WallAnswer,
            "joints of this hole with its neighbours: thickness, probability of an opening, extra columns",
            on_page=True,
        ),
        AnswerKey(
            "setup",
            SetupAnswer,
            "what is known of the rig, by whom and how well, what each item costs at the toe, and what is missing",
            on_page=True,
        ),
        AnswerKey("alarms", AlarmsAnswer, "tolerance and rig alarms, stations where the hole moved", on_page=True),
        AnswerKey("recalibration", RecalibrationAnswer, "calibration in the field: progress and result"),
        AnswerKey("orders", OrdersAnswer, "the newest orders with their course and outcome", on_page=True),
        AnswerKey(
            "changes",
            ChangesAnswer,
            "when each answer changed last: a listener that lost one to a full line sees it and asks again",
        ),
        AnswerKey("schema", SchemaAnswer, "JSON schema of every answer below ground/", published=False),
        AnswerKey("nodes/{tube}", NodeAnswer, "last state of one node, stale or not", on_page=True),
        AnswerKey("stations/{n}", Station, "one station, fused", published=False),
        AnswerKey(
            "stations/{n}/measurements",
            StationMeasurementsAnswer,
            "every cluster measured at one station",
            published=False,
        ),
        AnswerKey("orders/{n}", Order, "one order"),
    )
}
PATTERNS: Final = tuple(ANSWERS)


def find_answer(path: str) -> AnswerKey:
    """Line of a path such as ``stations/3``, whether there is such a station now or not.

    Raises
    ------
    SelectorError
        When there is no such path; it lists those that there are.
    """
    known = ANSWERS.get(split_number(path)[0] if "/" in path else path)
    if known is None:
        raise SelectorError(f"{path}: no such path; expected one of {', '.join(PATTERNS)}")
    return known


def split_number(path: str) -> tuple[str, int]:
    """Pattern and number of a path such as ``stations/3/measurements``; an empty pattern for any other."""
    parts = path.split("/")
    if len(parts) < 2 or not parts[1].isdecimal() or len(parts[1]) > LONGEST_NUMBER:
        return "", 0
    name = "{tube}" if parts[0] == "nodes" else "{n}"
    return "/".join([parts[0], name, *parts[2:]]), int(parts[1])


def schemas_by_path() -> dict[str, dict[str, Any]]:
    """JSON schema of the answer of every path."""
    return {path: object_schema(answer.fields) for path, answer in ANSWERS.items()}


def known_keys() -> list[keys.Key]:
    """Every key expression: those of the answers, and those beside them."""
    return [*keys.TABLE, *(answer.key for answer in ANSWERS.values())]
