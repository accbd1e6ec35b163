"""What a ground station answers of its hole: the word, what it doubts, and which causes it names."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from groundstation.service.process.ground_process import GroundProcess

USUAL_ALARMS: Final = frozenset({"deviation", "projection", "depth_silent", "tube_silent"})  # of a rig that is left


@dataclass(frozen=True, slots=True)
class AnswerGiven:
    """An answer.

    Attributes
    ----------
    word : of the verdict
    doubts : of the verdict
    alarms : codes of alarms of the rig that were raised at any time, but for those of every rig at its end
    causes : kinds of the best explanations of what the looks contradict, see ``groundstation.survey.adjustment.hypotheses``
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
    codes = {row["code"] for key in ("rig", "rig_cleared") for row in alarms[key]}
    found = ground.operator.ask("adjustment")["blunders"]
    left_open = ("left_open",) if any(row["is_doubt"] for row in found) else ()
    causes = tuple(row["kind"] for row in found if not row["is_doubt"])
    return AnswerGiven(
        verdict["verdict"], (*verdict["doubts"], *left_open), tuple(sorted(codes - USUAL_ALARMS)), causes
    )
