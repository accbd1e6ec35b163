"""A hole that was adjusted, and what that tells beside its directions; worked out when it is asked for. No I/O."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from groundstation.survey.adjustment.adjusted import Adjusted
from groundstation.survey.adjustment.blunder_cost import BlunderCost, cost_blunders
from groundstation.survey.adjustment.blunder_kind import BlunderKind
from groundstation.survey.adjustment.blunder_words import say_blunder
from groundstation.survey.adjustment.blunders import Blunder, Examination, chance_of_one
from groundstation.survey.adjustment.budget import ErrorShare, ShareSource, toe_budget
from groundstation.survey.adjustment.hypotheses import Hypothesis
from groundstation.survey.adjustment.last_look import LastLook, look_alone
from groundstation.survey.adjustment.least_found import DRIFT, LARGEST, possible_mistakes
from groundstation.survey.adjustment.next_stop import NextStop, plan_stop
from groundstation.survey.adjustment.position_shares import position_shares
from groundstation.survey.adjustment.reliability import Reliability, measure_reliability
from groundstation.survey.adjustment.run_of_stops import RunOfStops
from groundstation.survey.adjustment.toe_weights import toe_weights
from groundstation.survey.adjustment.unseen_drift import UnseenDrift, drift_unseen
from groundstation.survey.fusion.shared import KINDS

Array = npt.NDArray[np.float64]
LEVEL = 2  # of north, east and down those across a hole
OF_TUBE = (ShareSource.BIAS, ShareSource.TILT)
SOURCE_NAMES = {
    ShareSource.BIAS: "accelerometer_bias", ShareSource.TILT: "mounts", ShareSource.COLLAR: "collar",
    ShareSource.PATH: "path",
}  # fmt: skip
UNEVEN = (BlunderKind.ENCODER_DRIFTS,)  # whose size is one for all stops, and not quite so
UNEXPLAINED = "the newest surveys contradict those before; what is wrong is being looked for"
UNSOLVED = (
    "the surveys cannot be adjusted to each other, so every station stands for itself and nothing is found that is "
    "wrong: check what was told of the rig, and the newest surveys"
)


@dataclass(frozen=True)  # with a dictionary, for what is worked out once
class ExaminedHole:
    """A hole as it was adjusted.

    Parameters
    ----------
    examination : with what was found to be wrong
    run : how the string was run
    tubes : numbers of the tubes by their places
    surveys : how many there were when it was looked for what is wrong
    is_open : whether more seems to be wrong than was looked for yet
    """

    examination: Examination
    run: RunOfStops
    tubes: tuple[str, ...]
    surveys: int
    is_open: bool = False

    @property
    def adjusted(self) -> Adjusted:
        """The hole as it was adjusted."""
        return self.examination.adjusted

    @property
    def drawn(self) -> Adjusted:
        """The hole as it is drawn, with the ± of its positions; without its looks."""
        return self.examination.drawn

    @cached_property
    def _drawn_with_looks(self) -> Adjusted:
        """The same for answers that are made of looks; kept from the first that is asked on."""
        return self.examination.drawn_with_looks

    def sentence(self, blunder: Blunder) -> str:
        """What is wrong, in a driller's words."""
        return say_blunder(blunder, self.run, self.tubes)

    @property
    def doubts(self) -> list[str]:
        """Sentences of what may be one thing or another, or goes on by no two stops alike, as a belt that slips."""
        blunders = self.examination.blunders
        found = [self.sentence(one) for one in blunders if one.is_doubt or one.best.hypothesis.kind in UNEVEN]
        return [*found, UNEXPLAINED] if self.is_open else found

    def subject(self, one: Hypothesis) -> str:
        """What a blunder is of: a tube, the hole, the collar, the depth or the encoder."""
        if one.kind is BlunderKind.HOLE_MOVED:
            return "hole"
        if one.kind in (BlunderKind.DEPTH_WRONG_ONCE, BlunderKind.DEPTH_WRONG_FROM):
            return "depth"
        if one.kind is BlunderKind.COLLAR_WRONG:
            return "collar"
        return f"tube {self.tubes[one.subject[0]]}" if one.subject else "encoder"

    @property
    def by_subject(self) -> dict[str, list[str]]:
        """Sentences of everything that is wrong, by what it is of."""
        found: dict[str, list[str]] = {}
        for one in self.examination.blunders:
            found.setdefault(self.subject(one.best.hypothesis), []).append(self.sentence(one))
        return found

    @cached_property
    def shares(self) -> list[ErrorShare]:
        """Of what the variance at the toe is made."""
        drawn = self._drawn_with_looks
        return [*toe_budget(drawn, self.run.causes), *self._suspected(toe_weights(drawn))]

    def _suspected(self, weights: Array) -> list[ErrorShare]:
        """Share of a suspicion in the variance of functionals (s + 1, 2, r) of the directions."""
        if self.examination.supposed is None:
            return []
        moved = np.einsum("ka,kar->r", self.examination.suspected, weights)
        return [ErrorShare(ShareSource.BLUNDER, -1, moved**2)]

    def share_name(self, share: ErrorShare) -> tuple[str, str]:
        """Source of a share, and the tube or joint that it is of."""
        if share.source is ShareSource.TURN and share.subject >= 0:
            kind, place = self.run.causes.names[share.subject]
            return kind, f"tube {self.tubes[place]}" if place >= 0 else ""
        is_of_tube = share.source in OF_TUBE and share.subject >= 0
        return share.source.value, f"tube {self.tubes[share.subject]}" if is_of_tube else ""

    @cached_property
    def position_variances(self) -> dict[str, Array]:
        """Variances (s + 1, 3), m^2, of collar and stations to north, east and down by what looks have in common."""
        found: dict[str, Array] = {}
        for share in position_shares(self._drawn_with_looks, self.run.causes):
            name = SOURCE_NAMES.get(share.source)
            if share.source is ShareSource.TURN:
                name = KINDS.get(self.share_name(share)[0], "joints")
            if name is not None:
                found[name] = found.get(name, 0.0) + np.maximum(share.variances, 0.0)
        return found

    @cached_property
    def next_stop(self) -> NextStop | None:
        """What the angle of the next stop is worth; None before two stations, from which the length is taken."""
        md = self.adjusted.path.md
        return plan_stop(self.adjusted, float(md[-1] - md[-2])) if len(md) > LEVEL else None

    @cached_property
    def costs(self) -> list[BlunderCost | None]:
        """What each blunder costs at the toe."""
        return cost_blunders(self.examination)

    @cached_property
    def chance(self) -> float:
        """Of a false alarm of one test, so that a whole hole keeps its own."""
        return chance_of_one(self.adjusted.looks, self.run)

    @cached_property
    def last_look(self) -> LastLook | None:
        """What stands on the lowest tube's last look alone; None where another has read the last station too."""
        return look_alone(self.adjusted, self.run, self.chance)

    @property
    def is_drift_known(self) -> bool:
        """Whether the encoder was found to slip at every stop, by a size that is in the ± of the hole."""
        return DRIFT in self.examination.taken_in

    @cached_property
    def unseen_drift(self) -> UnseenDrift | None:
        """What an encoder that slips a little at every stop may do unfound; None while too few stops tell it."""
        return None if self.is_drift_known else drift_unseen(self.adjusted, self.chance)

    @cached_property
    def reliabilities(self) -> list[Reliability]:
        """How well what may go wrong with each tube at its newest stop, and with the string, would be found."""
        found, run = self.adjusted, self.run
        possible = possible_mistakes(found.looks, run)
        told = measure_reliability(found, run, possible, toe_weights(found), LARGEST, self.chance)
        return told if self.unseen_drift is None else [*told, self.unseen_drift.reliability]


def std_across(variances: Array) -> float:
    """Standard deviation (m) across a hole from variances (3,) to north, east and down: the larger of the level two."""
    return math.sqrt(max(*variances[:LEVEL].tolist(), 0.0))  # of hundreds of shares
