"""View of the adjustment of the hole: blunders, tubes, what the sigma at the toe is made of, the next stop."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import numpy.typing as npt

from groundstation.service.answers.adjustment_words import (
    CM,
    LEFT_OUT,
    NOTHING,
    say_fit,
    say_next_stop,
    say_part,
    say_second,
    say_unfound,
    size_found,
)
from groundstation.service.answers.answer_views import view_of
from groundstation.service.answers.model import RigModel
from groundstation.service.answers.rounding import largest_first
from groundstation.service.answers.shapes.adjustment_shapes import (
    AdjustedTube,
    AdjustmentAnswer,
    BlunderRow,
    LeastFound,
    NextStopAdvice,
    ToePart,
    ToeShare,
)
from groundstation.service.answers.streamed_rows import Parameters
from groundstation.service.hole.examined_hole import LEVEL, UNEXPLAINED, UNSOLVED, ExaminedHole, std_across
from groundstation.service.hole.position_sources import UNDONE, take_undone
from groundstation.service.setup.setup_priors import north_std
from groundstation.service.setup.toe_costs import TURN_MOST
from groundstation.survey.adjustment.blunder_cost import BlunderCost
from groundstation.survey.adjustment.blunder_kind import BlunderKind
from groundstation.survey.adjustment.blunder_words import STANDARD_GRAVITY, advise_crew, say_explanation, unit_of
from groundstation.survey.adjustment.blunders import Blunder
from groundstation.survey.adjustment.least_found import unfound_across, worst_of_kinds
from groundstation.survey.adjustment.reliability import Reliability
from groundstation.survey.adjustment.tube_biases import bias_of_tube

Array = npt.NDArray[np.float64]
MILLI_G: Final = 1e-3 * STANDARD_GRAVITY  # m/s^2
DECADE: Final = math.log(10.0)
LEAST_SHOWN_CM: Final = 1e-4  # of a share
IN_NO_LOOK: Final = ("north", "depth", "legs")
STEP: Final = BlunderKind.BIAS_STEPPED


@view_of(AdjustmentAnswer)
def answer_adjustment(k: RigModel, _p: Parameters) -> AdjustmentAnswer:
    """The adjustment as it stands; empty before the first survey below the collar."""
    examined, counts = k.hole.examined, k.hole.is_adjusted
    if examined is None:
        said = UNSOLVED if k.hole.is_unsolved else NOTHING
        return AdjustmentAnswer(0, 0.0, None, None, counts, said, None, None, 0, [], [], [], LEFT_OUT, [], [], None)
    found, wrong = examined.adjusted, examined.examination.blunders
    budget = budget_of_toe(k, examined)
    return AdjustmentAnswer(
        surveys=len(found.looks),
        redundancy=found.redundancy,
        misfit=examined.examination.global_ratio,
        play_deg=math.degrees(math.sqrt(found.now.play_var)),
        counts=counts,
        said=UNEXPLAINED if examined.is_open else say_fit(len(found.looks), len(wrong), len(examined.doubts)),
        toe_md_m=float(found.path.md[-1]),
        sigma_toe_cm=CM * std_across(np.sum([one.variances for one in budget], axis=0)),
        searched=examined.surveys,
        blunders=[blunder_row(examined, *one) for one in zip(wrong, examined.costs, strict=True)],
        toe=toe_shares(budget),
        parts=toe_parts(budget),
        left_out=LEFT_OUT,
        unfound=[least_found(examined, one) for one in worst_of_kinds(examined.reliabilities)],
        tubes=adjusted_tubes(examined),
        next_stop=next_stop_advice(examined, budget),
    )


def blunder_row(examined: ExaminedHole, blunder: Blunder, cost: BlunderCost | None) -> BlunderRow:
    """One thing that is wrong."""
    best, second = blunder.best, blunder.second
    return BlunderRow(
        kind=best.hypothesis.kind.value,
        subject=examined.subject(best.hypothesis),
        from_md_m=float(examined.run.md[best.hypothesis.stop]),
        is_doubt=blunder.is_doubt,
        text=examined.sentence(blunder),
        evidence=-best.log_chance / DECADE,
        second_kind=None if second is None else second.hypothesis.kind.value,
        second_evidence=None if second is None else -second.log_chance / DECADE,
        misfit_before=blunder.before,
        misfit_after=blunder.after,
        best=say_explanation(best, examined.run, examined.tubes),
        second=second_best(examined, blunder),
        moved_cm=None if cost is None else CM * float(np.hypot(*cost.moved[:2])),
        sigma_cm=None if cost is None else CM * std_across(cost.variances),
        todo=advise_crew(blunder, examined.tubes),
    )


def second_best(examined: ExaminedHole, blunder: Blunder) -> str | None:
    """The second best explanation in words; None where there is none."""
    second = blunder.second
    if second is None:
        return None
    decades = (second.log_chance - blunder.best.log_chance) / DECADE
    return say_second(say_explanation(second, examined.run, examined.tubes), decades, is_doubt=blunder.is_doubt)


@dataclass(frozen=True, slots=True)
class NamedShare:
    """What one source, of a tube or joint, gives to the variance (3,) at the toe, m^2."""

    source: str
    subject: str
    variances: Array


def budget_of_toe(k: RigModel, examined: ExaminedHole) -> list[NamedShare]:
    """Of what the variance at the toe is made: north, what the looks leave open, depths and the way between stations.

    The last two are those of the trajectory, which are in no look.
    """
    drawn = k.hole.trajectory
    shares = [NamedShare(*examined.share_name(one), one.variances) for one in examined.shares]
    shares.append(NamedShare("legs", "", np.diagonal(drawn.path_covs[-1])))
    tied = [place for place, one in enumerate(shares) if one.source in (*UNDONE, "legs")]
    left = take_undone(np.array([shares[place].variances for place in tied]), np.diagonal(drawn.tied_covs[-1]))
    for place, variances in zip(tied, left, strict=True):
        shares[place] = replace(shares[place], variances=variances)
    return [NamedShare("north", "", north_at_toe(k)), *shares, NamedShare("depth", "", k.hole.toe_by_depth)]


def north_at_toe(k: RigModel) -> Array:
    """Variance (3,), m^2, at the toe by the encoder's zero against north, which is in no look."""
    drawn = k.hole.trajectory
    north, east, _ = drawn.positions[-1]
    across = (np.array([east, north, 0.0]) * min(north_std(k.setup), TURN_MOST)) ** 2
    return np.asarray(across + np.diagonal(drawn.swung_covs[-1]))


def toe_shares(budget: Sequence[NamedShare]) -> list[ToeShare]:
    """What each source, tube or joint gives at the toe, the worst first."""
    shares = [ToeShare(one.source, one.subject, CM * std_across(one.variances)) for one in budget]
    return sorted((one for one in shares if one.sigma_cm > LEAST_SHOWN_CM), key=lambda one: largest_first(one.sigma_cm))


def toe_parts(budget: Sequence[NamedShare]) -> list[ToePart]:
    """What all errors of each source give at the toe together, the worst first."""
    by_source: dict[str, list[NamedShare]] = {}
    for one in budget:
        by_source.setdefault(one.source, []).append(one)
    total = np.sum([one.variances[:LEVEL] for one in budget], axis=0)
    parts = [part_of(source, same, total) for source, same in by_source.items()]
    return sorted((one for one in parts if one.sigma_cm > LEAST_SHOWN_CM), key=lambda one: largest_first(one.percent))


def part_of(source: str, shares: Sequence[NamedShare], total: Array) -> ToePart:
    """One source; ``total`` (2,) are the variances (m^2) of all to north and east, the larger of which is made up."""
    variances = np.sum([one.variances[:LEVEL] for one in shares], axis=0)
    worst = max(shares, key=lambda one: std_across(one.variances)).subject if len(shares) > 1 else ""
    share = float(variances.sum() / total.sum()) if total.any() else 0.0
    sigma = math.sqrt(max(float(variances[np.argmax(total)]), 0.0))
    return ToePart(source, say_part(source, worst), CM * sigma, 100.0 * share)


def least_found(examined: ExaminedHole, one: Reliability) -> LeastFound:
    """From which size on a mistake is found."""
    unfound = unfound_across(one)
    return LeastFound(
        kind=one.hypothesis.kind.value,
        subject=examined.subject(one.hypothesis),
        smallest=size_found(one),
        unit=unit_of(one.hypothesis.kind)[0],
        unfound_cm=CM * unfound if math.isfinite(unfound) else None,
        words=say_unfound(one, examined.tubes),
    )


def adjusted_tubes(examined: ExaminedHole) -> list[AdjustedTube]:
    """Every tube as all surveys show it."""
    steps = {one.hypothesis.subject[0]: one for one in examined.reliabilities if one.hypothesis.kind is STEP}
    return [adjusted_tube(examined, place, steps[place]) for place in range(len(examined.tubes))]


def adjusted_tube(examined: ExaminedHole, place: int, step: Reliability) -> AdjustedTube:
    """One tube as all surveys show it, and how well a step of its bias at its last stop would be found."""
    bias, unfound = bias_of_tube(examined.adjusted, place), unfound_across(step)
    return AdjustedTube(
        tube=int(examined.tubes[place]),
        bias_mg=(bias.bias / MILLI_G).tolist(),
        sigma_bias_mg=(np.sqrt(np.diag(bias.cov)) / MILLI_G).tolist(),
        looks=bias.looks,
        smallest_step_mg=step.smallest / MILLI_G if math.isfinite(step.smallest) else None,
        unfound_step_cm=CM * unfound if math.isfinite(unfound) else None,
    )


def next_stop_advice(examined: ExaminedHole, budget: Sequence[NamedShare]) -> NextStopAdvice | None:
    """Where to stop next; None while one station alone is known. What no look tells stays as it is at the toe."""
    planned = examined.next_stop
    if planned is None:
        return None
    stays = sum(float(one.variances[:LEVEL].sum()) for one in budget if one.source in IN_NO_LOOK)
    cm = CM * np.sqrt((planned.toe_stds**2 + stays) / LEVEL)
    same = int(np.argmin(np.abs(planned.angles)))
    numbers = math.degrees(planned.best), float(cm.min()), float(cm[same])
    return NextStopAdvice(*numbers, say_next_stop(*numbers))
