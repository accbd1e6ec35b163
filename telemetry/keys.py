"""The table of key expressions, shared by code, documentation and error messages.

Operators rely on these keys; ``docs/keys.md`` is checked against this table by a test. The answers below ``ground/``
have a table of their own, ``groundstation/service/answers/answer_table.py``.
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
    Key(
        INTAKE,
        "query, publish",
        "everything that the ground station takes in, where there is a listener: for recordings (msgpack); ?since=17",
    ),
    Key(COMMAND, "query", "operator command to the ground station; the reply is its outcome"),
)


def is_order(selector: str) -> bool:
    """Return whether a selector is an order to the ground station."""
    return selector.split("?", maxsplit=1)[0].split("/")[2:3] == ["cmd"]


def port_key(rig: str, address: int, side: Side, direction: str) -> str:
    """Key expression of one port and direction."""
    return PORT.format(rig=rig, tube=address_name(address), side=side.name.lower(), direction=direction)
