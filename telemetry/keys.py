"""The table of key expressions, shared by code, documentation and error messages.

Operators rely on these keys; ``docs/keys.md`` is checked against this table by a test.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from telemetry.messages import Side, address_name

ROOT: Final = "borechain"
DEFAULT_RIG: Final = "rig-1"
DEFAULT_ENDPOINT: Final = "tcp/127.0.0.1:7447"


@dataclass(frozen=True, slots=True)
class Key:
    """One line of the table."""

    template: str  # with {rig}, {tube}, ...
    kind: str  # "publish", "query" or both
    meaning: str


PORT: Final = "borechain/{rig}/port/{tube}/{side}/{direction}"
STEP: Final = "borechain/{rig}/stepper/{process}/step"
DONE: Final = "borechain/{rig}/stepper/{process}/done"
WANTED: Final = "borechain/{rig}/stepper/wanted"
CUE: Final = "borechain/{rig}/stepper/cue"
DEPTH: Final = "borechain/{rig}/surface/depth"
LIVELINESS: Final = "borechain/{rig}/@liveliness/{process}"
GROUND: Final = "borechain/{rig}/ground/{path}"
INTAKE: Final = "borechain/{rig}/intake"
LEASE: Final = "borechain/{rig}/@lease/{holder}"
COMMAND: Final = "borechain/{rig}/cmd/{name}"

TABLE: Final[tuple[Key, ...]] = (
    Key(PORT, "publish", "hop-by-hop link: frames of one tube end; side upper or lower, direction tx or rx"),
    Key(
        DEPTH,
        "publish",
        "measured depth of the bit from tally and block position (message depth reading)",
    ),
    Key(STEP, "publish", "stepper: hands one process its next step"),
    Key(DONE, "publish", "stepper: the process has finished the step"),
    Key(WANTED, "publish", "stepper: the processes that ought to be alive now"),
    Key(CUE, "publish", "stepper: the operator has done what the schedule had him do"),
    Key(LIVELINESS, "liveliness", "token of a living process"),
    Key(LEASE, "liveliness", "token of the one ground station of the rig"),
    Key("borechain/{rig}/ground/status", "query, publish", "rig time, depth, counts, health"),
    Key(
        "borechain/{rig}/ground/verdict",
        "query, publish",
        "on target, watch, steer, out or don't know; how far off, which way, until where it can be corrected",
    ),
    Key("borechain/{rig}/ground/string", "query, publish", "tubes from top to bottom with depth and age"),
    Key("borechain/{rig}/ground/nodes/{tube}", "query, publish", "last state of one node, stale or not"),
    Key("borechain/{rig}/ground/stations", "query, publish", "all stations, fused"),
    Key("borechain/{rig}/ground/stations/{n}", "query", "one station, fused"),
    Key("borechain/{rig}/ground/stations/{n}/measurements", "query", "every cluster measured at one station"),
    Key(
        "borechain/{rig}/ground/measurements",
        "query, publish",
        "every cluster measurement, new ones published; ?station=2..5, ?tube=3, ?since=17;limit=10",
    ),
    Key("borechain/{rig}/ground/trajectory", "query, publish", "positions with covariance; ?md=12.5, ?md=4..12"),
    Key("borechain/{rig}/ground/uncertainty", "query, publish", "region of uncertainty, its sources; ?confidence=0.9"),
    Key(
        "borechain/{rig}/ground/column",
        "query, publish",
        "deviation from the design, projected to the target; ?moment=3",
    ),
    Key(
        "borechain/{rig}/ground/history",
        "query, publish",
        "what was known of the column at the end of every stop, thinned; ?points=200",
    ),
    Key(
        "borechain/{rig}/ground/wall",
        "query, publish",
        "joints of this hole with its neighbours: thickness, probability of an opening, extra columns",
    ),
    Key(
        "borechain/{rig}/ground/alarms",
        "query, publish",
        "tolerance and rig alarms, stations where the hole moved",
    ),
    Key(
        "borechain/{rig}/ground/events", "query, publish", "events of the nodes, new ones published; ?tube=3, ?since=17"
    ),
    Key(
        "borechain/{rig}/ground/static_records",
        "query, publish",
        "raw readings that nodes averaged at rest, new ones published; ?tube=3, ?since=17",
    ),
    Key(
        INTAKE,
        "query, publish",
        "everything that the ground station takes in, where there is a listener: for recordings (msgpack); ?since=17",
    ),
    Key(
        "borechain/{rig}/ground/changes",
        "query, publish",
        "when each answer changed last: a listener that lost one to a full line sees it and asks again",
    ),
    Key("borechain/{rig}/ground/schema", "query", "JSON schema of every answer below ground/"),
    Key("borechain/{rig}/ground/recalibration", "query, publish", "calibration in the field: progress and result"),
    Key("borechain/{rig}/ground/orders", "query, publish", "the newest orders with their course and outcome"),
    Key("borechain/{rig}/ground/orders/{n}", "query, publish", "one order"),
    Key("borechain/{rig}/cmd/{name}", "query", "operator command to the ground station; the reply is its outcome"),
)


def is_order(selector: str) -> bool:
    """Return whether a selector is an order to the ground station."""
    return selector.split("?", maxsplit=1)[0].split("/")[2:3] == ["cmd"]


def port_key(rig: str, address: int, side: Side, direction: str) -> str:
    """Key expression of one port and direction."""
    return PORT.format(rig=rig, tube=address_name(address), side=side.name.lower(), direction=direction)
