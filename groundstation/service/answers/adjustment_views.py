"""View of the adjustment of the hole: blunders, tubes, what the sigma at the toe is made of, the next stop."""

from __future__ import annotations

import math

import numpy as np

from groundstation.service.answers.answer_views import view_of
from groundstation.service.answers.model import RigModel
from groundstation.service.answers.shapes.adjustment_shapes import (
    AdjustedTube,
    AdjustmentAnswer,
    BlunderRow,
    NextStopAdvice,
    ToeShare,
)
from groundstation.service.answers.streamed_rows import Parameters
from groundstation.service.hole.examined_hole import ExaminedHole, std_across
from groundstation.service.setup.setup_priors import north_std
from groundstation.service.setup.toe_costs import TURN_MOST
from groundstation.survey.adjustment.blunder_words import STANDARD_GRAVITY
from groundstation.survey.adjustment.blunders import Blunder
from groundstation.survey.adjustment.tube_biases import bias_of_tube

MILLI_G = 1e-3 * STANDARD_GRAVITY  # m/s^2
LEAST_SHOWN_CM = 1e-4  # of a share


@view_of(AdjustmentAnswer)
def answer_adjustment(k: RigModel, _p: Parameters) -> AdjustmentAnswer:
    """The adjustment as it stands; empty before the first survey below the collar."""
    examined = k.hole.examined
    if examined is None:
        return AdjustmentAnswer(0, 0.0, None, None, None, 0, [], [], [], None)
    found = examined.adjusted
    return AdjustmentAnswer(
        surveys=len(found.looks),
        redundancy=found.redundancy,
        misfit=examined.examination.global_ratio,
        play_deg=math.degrees(math.sqrt(found.now.play_var)),
        sigma_toe_cm=100.0
        * math.hypot(std_across(np.sum([share.variances for share in examined.shares], axis=0)), north_at_toe(k)),
        searched=examined.surveys,
        blunders=[blunder_row(examined, one) for one in examined.examination.blunders],
        toe=toe_shares(k, examined),
        tubes=[adjusted_tube(examined, place) for place in range(len(examined.tubes))],
        next_stop=next_stop_advice(examined),
    )


def blunder_row(examined: ExaminedHole, blunder: Blunder) -> BlunderRow:
    """One thing that is wrong."""
    best, second = blunder.best, blunder.second
    return BlunderRow(
        kind=best.hypothesis.kind.value,
        subject=examined.subject(best.hypothesis),
        from_md_m=float(examined.run.md[best.hypothesis.stop]),
        is_doubt=blunder.is_doubt,
        text=examined.sentence(blunder),
        evidence=-best.log_chance / math.log(10.0),
        second_kind=None if second is None else second.hypothesis.kind.value,
        second_evidence=None if second is None else -second.log_chance / math.log(10.0),
        misfit_before=blunder.before,
        misfit_after=blunder.after,
    )


def north_at_toe(k: RigModel) -> float:
    """Standard deviation (m) at the toe by the encoder's zero against north, which is in no look."""
    return float(np.hypot(*k.hole.trajectory.positions[-1, :2])) * min(north_std(k.setup), TURN_MOST)


def toe_shares(k: RigModel, examined: ExaminedHole) -> list[ToeShare]:
    """What each source gives at the toe, the worst first."""
    shares = [ToeShare("north", "", 100.0 * north_at_toe(k))]
    shares += [ToeShare(*examined.share_name(one), 100.0 * std_across(one.variances)) for one in examined.shares]
    return sorted((one for one in shares if one.sigma_cm > LEAST_SHOWN_CM), key=lambda one: -one.sigma_cm)


def adjusted_tube(examined: ExaminedHole, place: int) -> AdjustedTube:
    """One tube as all surveys show it."""
    bias = bias_of_tube(examined.adjusted, place)
    step = next(one for one in examined.steps_found if one.hypothesis.subject == (place,))
    unfound = std_across(np.square(step.unfound))
    return AdjustedTube(
        tube=int(examined.tubes[place]),
        bias_mg=(bias.bias / MILLI_G).tolist(),
        sigma_bias_mg=(np.sqrt(np.diag(bias.cov)) / MILLI_G).tolist(),
        looks=bias.looks,
        smallest_step_mg=step.smallest / MILLI_G if math.isfinite(step.smallest) else None,
        unfound_step_cm=100.0 * unfound if math.isfinite(unfound) else None,
    )


def next_stop_advice(examined: ExaminedHole) -> NextStopAdvice | None:
    """Where to stop next; None while one station alone is known."""
    planned = examined.next_stop
    if planned is None:
        return None
    same = int(np.argmin(np.abs(planned.angles)))
    return NextStopAdvice(
        turn_deg=math.degrees(planned.best),
        sigma_cm=100.0 * float(planned.toe_stds.min()),
        same_face_cm=100.0 * float(planned.toe_stds[same]),
    )
