"""What a ground station answers of its hole: the word, what it doubts, and which causes it names."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from groundstation.service.process.ground_process import GroundProcess

# of a rig that is left, and of a topmost node that is at the collar's edge
USUAL_ALARMS: Final = frozenset({"deviation", "projection", "depth_silent", "tube_silent", "survey_missing"})
AT_THE_START: Final = (("reference", "tubes 1 at"), ("tube_sensor", "yaw_untrusted"))  # before a tube has its first yaw


@dataclass(frozen=True, slots=True)
class AnswerGiven:
    """An answer.

    Attributes
    ----------
    word : of the verdict
    doubts : of the verdict
    alarms : codes of alarms of the rig that were raised at any time, but for those of every rig at its end
    causes : kinds of the best explanations of what the looks contradict, see ``BlunderKind``
    """

    word: str
    doubts: tuple[str, ...]
    alarms: tuple[str, ...]
    causes: tuple[str, ...]

    @property
    def is_doubted(self) -> bool:
        """Whether the crew is told that something is wrong, or not known."""
        return bool(self.doubts or self.alarms or self.causes)


def answer_of(ground: GroundProcess) -> AnswerGiven:
    """Answer of a ground station as it stands."""
    verdict, alarms = ground.operator.ask("verdict"), ground.operator.ask("alarms")
    codes = {row["code"] for key in ("rig", "rig_cleared") for row in alarms[key] if not is_of_start(row)}
    found = ground.operator.ask("adjustment")["blunders"]
    left_open = ("left_open",) if any(row["is_doubt"] for row in found) else ()
    causes = tuple(row["kind"] for row in found if not row["is_doubt"])
    return AnswerGiven(
        verdict["verdict"], (*verdict["doubts"], *left_open), tuple(sorted(codes - USUAL_ALARMS)), causes
    )


def is_of_start(row: Mapping[str, Any]) -> bool:
    """Whether an alarm was raised as a tube was switched on, as of every rig."""
    begins = any(row["code"] == code and row["detail"].startswith(detail) for code, detail in AT_THE_START)
    return begins and row["count"] == 1
