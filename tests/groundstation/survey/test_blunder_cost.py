"""What a blunder costs at the toe, beside adjustments of the same looks without it, and with a little of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest
from drawn_strings import DEG, MG, DrawnString, draw_string

from groundstation.survey.adjustment.adjust import adjust_hole
from groundstation.survey.adjustment.adjusted import Adjusted
from groundstation.survey.adjustment.blunder_cost import cost_blunders
from groundstation.survey.adjustment.blunder_kind import BlunderKind
from groundstation.survey.adjustment.blunder_words import ADVICE, MISTAKES, advise_crew
from groundstation.survey.adjustment.blunders import Blunder, Explanation, examine_hole
from groundstation.survey.adjustment.hypotheses import Hypothesis, all_hypotheses
from groundstation.survey.adjustment.least_found import (
    DRIFT,
    LARGEST,
    possible_mistakes,
    unfound_across,
    worst_of_kinds,
)
from groundstation.survey.adjustment.looks import Looks
from groundstation.survey.adjustment.reliability import measure_reliability
from groundstation.survey.adjustment.toe_weights import leg_weights, toe_weights

Array = npt.NDArray[np.float64]
PART = 0.01  # of a blunder, so small that no play is learnt from it


def toe_of(found: Adjusted) -> Array:
    """Position (3,) of the last station, m: every leg along the mean of the directions at its ends."""
    return np.asarray(leg_weights(found.path.md) @ found.now.tangents)


def variances_with_and_without(found: Adjusted) -> tuple[Array, Array]:
    """Variances (3,) of the toe, and those that it has where all further unknowns are known."""
    weights, width = toe_weights(found), found.string.width
    states, common = found.cofactor(weights, np.zeros((len(found.common_cov), 3)))
    of_toe = np.einsum("sar,saq->rq", weights, states[:, :2])
    of_both = np.block([[of_toe, common[width:].T], [common[width:], found.common_cov[width:, width:]]])
    known = np.linalg.inv(np.linalg.inv(of_both)[:3, :3])
    return np.diagonal(of_toe), np.diagonal(known)


def stepped(drawn: DrawnString, size: Array) -> Looks:
    """The looks with a step of the accelerometer more."""
    looks = drawn.looks
    wrong = (looks.tube == drawn.tube) & (looks.stop >= drawn.onset)
    return replace(looks, force=looks.force + wrong[:, None] * size)


@pytest.mark.parametrize("seed", [1, 2, 3, 4])
def test_a_step_costs_what_the_toe_moves_by_it_and_what_it_is_less_known_for_it(seed: int) -> None:
    drawn = draw_string(seed, "bias_stepped", 17.0)
    examination = examine_hole(drawn.looks, drawn.string, drawn.path, drawn.run)
    (blunder,), (cost,) = examination.blunders, cost_blunders(examination)
    assert blunder.best.hypothesis.kind is BlunderKind.BIAS_STEPPED
    assert cost is not None
    size = blunder.best.size
    right, little = (adjust_hole(stepped(drawn, (part - 1.0) * size), drawn.string, drawn.path) for part in (0.0, PART))
    moved = (toe_of(little) - toe_of(right)) / PART
    assert cost.moved[:2] == pytest.approx(-moved[:2], rel=0.1, abs=0.05 * float(np.linalg.norm(moved)))
    whole, known = variances_with_and_without(examination.adjusted)
    assert cost.variances == pytest.approx(whole - known, rel=1e-6, abs=1e-9 * float(whole.max()))


def test_the_worst_mistake_of_each_kind_comes_first_and_none_is_larger_than_it_may_be() -> None:
    drawn = draw_string(5)
    found = adjust_hole(drawn.looks, drawn.string, drawn.path)
    possible = possible_mistakes(drawn.looks, drawn.run)
    sizes = {BlunderKind.BIAS_STEPPED: 20.0 * MG, BlunderKind.TILT_SLIPPED: 0.5 * DEG}
    told = measure_reliability(found, drawn.run, possible, toe_weights(found), sizes)
    assert [one.hypothesis for one in told] == possible
    worst = worst_of_kinds(told)
    kinds = [one.hypothesis.kind for one in worst]
    assert len(kinds) == len(set(kinds)) == len({one.kind for one in possible})
    costs = [unfound_across(one) for one in worst]
    assert costs == sorted(costs, reverse=True)
    for one in told:
        assert unfound_across(one) <= next(
            cost for kind, cost in zip(kinds, costs, strict=True) if kind is one.hypothesis.kind
        )
    # the tube at the bit alone has read the last station: its step is the one that does most
    (step,) = (one for one in worst if one.hypothesis.kind is BlunderKind.BIAS_STEPPED)
    assert step.hypothesis.subject == (0,)


def test_every_kind_has_its_advice_and_every_possible_mistake_its_name_and_size() -> None:
    drawn = draw_string(5)
    assert set(ADVICE) == set(BlunderKind)
    kinds = {one.kind for one in possible_mistakes(drawn.looks, drawn.run)}
    assert kinds | {DRIFT.kind} == set(MISTAKES) == set(LARGEST)  # a drift is of all stops


def test_of_every_kind_a_crew_is_told_what_to_do_whatever_the_number_of_its_tubes() -> None:
    """Stations are counted, too: there are more of them than tubes, and one that moved is no tube."""
    drawn = draw_string(5)
    subjects = {one.kind: one.subject for one in all_hypotheses(drawn.looks, drawn.run)}
    subjects[BlunderKind.HOLE_MOVED] = (int(drawn.looks.station.max()) - 1, int(drawn.looks.station.max()))
    names = [f"<{place}>" for place in range(int(drawn.looks.tube.max()) + 1)]
    assert subjects[BlunderKind.HOLE_MOVED][1] >= len(names)
    for kind in BlunderKind:
        subject = subjects.get(kind, ())
        best = Explanation(Hypothesis(kind, subject), np.ones(1), np.eye(1), -50.0)
        advice = advise_crew(Blunder(best, None, 2.0, 1.0), names)
        shown = {place for place, name in enumerate(names) if name in advice}
        assert advice
        assert shown <= (set() if kind is BlunderKind.HOLE_MOVED else set(subject))
