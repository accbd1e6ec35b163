"""What is expected of the answer under each deception: the one table of it, for oracles and for ``docs/faults.md``."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final, Literal


@dataclass(frozen=True, slots=True)
class ExpectedDoubt:
    """Of one kind of deception.

    Attributes
    ----------
    misleads : what it makes wrong: the direction of a station, all azimuths alike, depths, or the collar
    answer : what the system does about it
    """

    misleads: Literal["direction", "north", "depth", "collar"]
    answer: str


EXPECTED: Final[dict[str, ExpectedDoubt]] = {
    "force-step": ExpectedDoubt("direction", "tubes at one station disagree; the tube is named where three passed"),
    "force-creep": ExpectedDoubt("direction", "the same"),
    "mount-slips": ExpectedDoubt("direction", "the same"),
    "axes-exchanged": ExpectedDoubt("direction", "the same"),
    "tubes-exchanged": ExpectedDoubt("direction", "the same"),
    "hole-moves": ExpectedDoubt("direction", "all tubes see it; earlier surveys of the place are dropped"),
    "depth-scale": ExpectedDoubt("depth", "the depth is told with its sigma; a scale beyond that is not seen"),
    "depth-stuck": ExpectedDoubt("depth", "a string that turns without getting deeper is not seen"),
    "north-wrong": ExpectedDoubt("north", "don't know until a second bearing checks it; kept, and undone by one order"),
    "collar-wrong": ExpectedDoubt("collar", "the first station contradicts it, and the crew is told so"),
    "length-wrong": ExpectedDoubt("depth", "surveys of the tubes above move; no other reading speaks against it"),
    "joint-misread": ExpectedDoubt("direction", "the tube restarts and finds its yaw against what it had saved"),
}


def misled_by(names: Iterable[str]) -> set[str]:
    """What of a station is wrong under these deceptions."""
    return {EXPECTED[name].misleads for name in names}
