"""What each hypothesis changes in which look, how wide it may be, which are tried: from looks that are written out."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from groundstation.survey.adjustment import taken_in
from groundstation.survey.adjustment.blunder_kind import BlunderKind as K
from groundstation.survey.adjustment.blunders import best_of_kinds
from groundstation.survey.adjustment.hypotheses import (
    WIDTHS,
    Hypothesis,
    all_hypotheses,
    effect_amplitudes,
    exchanged_stations,
    stations_seen_twice,
    thinned_stops,
)
from groundstation.survey.adjustment.looks import Looks
from groundstation.survey.adjustment.run_of_stops import RunOfStops, TurnCauses

# tube 0 looks at stations 1, 2, 3 at the stops 0, 1, 2; tube 1 at 1, 2 at the stops 1, 2; tube 2 at station 1, stop 2
STATION = [1, 2, 1, 3, 2, 1]
TUBE = [0, 0, 1, 0, 1, 2]
STOP = [0, 1, 1, 2, 2, 2]
TIMES = [100.0, 250.0, 700.0]  # s, of the stops


def looks() -> Looks:
    n = len(STATION)
    places: tuple[Any, ...] = tuple(np.array(one, np.intp) for one in (STATION, TUBE, [0, 1, 1, 2, 2, 2], STOP))
    forces = np.arange(3.0 * n).reshape(n, 3)
    return Looks(*places, forces, np.full(n, 1e-6), np.arange(n) / 10.0, np.full(n, 1e-4))


def run() -> RunOfStops:
    """Causes: the joint below tube 1 turns tube 1 by 1 and make-up 2 by 0.5; the mount of tube 2 turns it by -1."""
    of_tubes = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, -1.0]])
    of_make_ups = np.array([[0.0, 0.0, 0.5], [0.0, 0.0, 0.0]])
    causes = TurnCauses((("joint", 1), ("mount", 2)), of_tubes, of_make_ups, np.array([0.1, 0.2]))
    return RunOfStops(np.array([2.0, 4.0, 6.0]), np.array(TIMES), np.array([0.0, 2.0, 4.0, 6.0]), causes)


@pytest.mark.parametrize(
    ("one", "amplitudes"),
    [
        (Hypothesis(K.BIAS_WRONG, (0,)), [1, 1, 0, 1, 0, 0]),
        (Hypothesis(K.BIAS_STEPPED, (0,), 1), [0, 1, 0, 1, 0, 0]),
        (Hypothesis(K.BIAS_STEPPED, (1,), 2), [0, 0, 0, 0, 1, 0]),
        (Hypothesis(K.TILT_SLIPPED, (2,), 2), [0, 0, 0, 0, 0, 1]),
        (Hypothesis(K.MOUNT_TURNED, (0,), 2), [0, 0, 0, 1, 0, 0]),
        (Hypothesis(K.AXES_EXCHANGED, (0,), 1), [0, 1, 0, 1, 0, 0]),
        (Hypothesis(K.LOOK_WRONG, (0,), 1), [0, 1, 0, 0, 0, 0]),
        (Hypothesis(K.BIAS_CREEPS, (0,), 0), [0, 150, 0, 600, 0, 0]),
        (Hypothesis(K.BIAS_CREEPS, (0,), 1), [0, 0, 0, 450, 0, 0]),
        (Hypothesis(K.JOINT_MISREAD, (1,)), [0, 0, 1, 0.5, 1.5, 0.5]),
        (Hypothesis(K.JOINT_SLIPPED, (1,), 2), [0, 0, 0, 0.5, 1.5, 0.5]),
        (Hypothesis(K.ENCODER_SLIPPED, (), 1), [0, 1, 1, 1, 1, 1]),
        (Hypothesis(K.ENCODER_DRIFTS, ()), [1, 2, 2, 3, 3, 3]),
        (Hypothesis(K.DEPTH_WRONG_ONCE, (), 1), [0, 1, 1, 0, 0, 0]),
        (Hypothesis(K.DEPTH_WRONG_FROM, (), 1), [0, 1, 1, 1, 1, 1]),
        (Hypothesis(K.HOLE_MOVED, (1, 2), 2), [-1, -1, -1, 0, 0, 0]),  # looks of before are off
        (Hypothesis(K.HOLE_MOVED, (2, 2), 2), [0, -1, 0, 0, 0, 0]),
        (Hypothesis(K.HOLE_MOVED, (1, 1), 1), [-1, 0, 0, 0, 0, 0]),
        (Hypothesis(K.TUBES_EXCHANGED, (0, 1)), [0, 1, 1, 1, 1, 0]),  # where both looked
        (Hypothesis(K.TUBES_EXCHANGED, (1, 2)), [0, 0, 0, 0, 1, 1]),
    ],
)
def test_a_hypothesis_is_in_the_looks_that_it_would_change(one: Hypothesis, amplitudes: list[float]) -> None:
    assert effect_amplitudes(one, looks(), run()).tolist() == pytest.approx(amplitudes)


def test_tubes_that_changed_places_looked_at_each_other_s_stations() -> None:
    assert exchanged_stations(looks(), (0, 1)).tolist() == [1, 1, 2, 2, 3, 1]
    assert exchanged_stations(looks(), (1, 2)).tolist() == [1, 2, 1, 3, 1, 2]
    assert looks().station.tolist() == STATION


WIDE = {
    K.BIAS_STEPPED: 1.0, K.BIAS_WRONG: 1.0, K.LOOK_WRONG: 1.0, K.TILT_SLIPPED: 0.2, K.TILT_WRONG: 0.2,
    K.HOLE_MOVED: 0.2,
    K.MOUNT_TURNED: 3.0, K.MOUNT_MISREAD: 3.0, K.JOINT_SLIPPED: 3.0, K.JOINT_MISREAD: 3.0, K.ENCODER_SLIPPED: 3.0,
    K.ENCODER_DRIFTS: 3.0, K.DEPTH_WRONG_ONCE: 10.0, K.DEPTH_WRONG_FROM: 10.0,
}  # fmt: skip


@pytest.mark.parametrize("kind", WIDE)
def test_a_blunder_is_left_to_the_looks_within_what_its_kind_can_be(kind: K) -> None:
    """1 m/s^2, 0.2 rad of a direction, 3 rad of a turn, 10 m."""
    assert taken_in.wide_std(Hypothesis(kind, (1, 2), 1), looks(), run()) == WIDE[kind]


def test_a_creep_may_reach_a_force_s_size_by_the_last_look() -> None:
    assert taken_in.wide_std(Hypothesis(K.BIAS_CREEPS, (0,), 0), looks(), run()) == pytest.approx(1.0 / 600.0)
    assert taken_in.wide_std(Hypothesis(K.BIAS_CREEPS, (0,), 1), looks(), run()) == pytest.approx(1.0 / 450.0)


def test_everything_single_is_asked_once_and_nothing_that_no_look_shows() -> None:
    found = list(all_hypotheses(looks(), run()))
    assert len(found) == len(set(found))
    of = {kind: sorted((one.subject, one.stop) for one in found if one.kind is kind) for kind in K}
    assert of[K.ENCODER_DRIFTS] == [((), 0)]
    for kind in (K.ENCODER_SLIPPED, K.DEPTH_WRONG_ONCE, K.DEPTH_WRONG_FROM):
        assert of[kind] == [((), 1), ((), 2)]
    for kind in (K.BIAS_WRONG, K.TILT_WRONG, K.MOUNT_MISREAD):
        assert of[kind] == [((0,), 0), ((1,), 0), ((2,), 0)]
    for kind in (K.BIAS_STEPPED, K.TILT_SLIPPED, K.MOUNT_TURNED):
        assert of[kind] == [((0,), 1), ((0,), 2), ((1,), 2)]  # not at a tube's first look
    for kind in (K.LOOK_WRONG, K.AXES_EXCHANGED):
        assert of[kind] == [((0,), 0), ((0,), 1), ((0,), 2), ((1,), 1), ((1,), 2), ((2,), 2)]
    assert of[K.BIAS_CREEPS] == [((0,), 0)]  # two looks after it
    assert of[K.JOINT_MISREAD] == [((1,), 0)]
    assert of[K.JOINT_SLIPPED] == [((1,), 2)]
    assert of[K.TUBES_EXCHANGED] == [((0, 1), 0), ((0, 2), 0), ((1, 2), 0)]
    assert of[K.HOLE_MOVED] == [((1, 2), 2)]
    assert of[K.COLLAR_WRONG] == []
    assert stations_seen_twice(looks(), {0, 1, 2}).tolist() == [
        [False, False, False, False],
        [False, True, False, False],
        [False, True, True, False],
    ]
    assert {kind: width for kind, width in WIDTHS.items() if width == 3} == dict.fromkeys(
        (K.BIAS_STEPPED, K.BIAS_CREEPS, K.BIAS_WRONG, K.LOOK_WRONG), 3
    )


@pytest.mark.parametrize(
    ("count", "found"),
    [
        (3, [0, 1, 2]),
        (24, list(range(24))),
        (25, [*range(0, 9, 2), *range(9, 25)]),
        (40, [*range(0, 24, 3), *range(24, 40)]),
        (41, [*range(0, 25, 4), *range(25, 41)]),
    ],
)
def test_of_many_stops_the_latest_and_some_of_before_are_asked(count: int, found: list[int]) -> None:
    assert thinned_stops(list(range(count))) == found
    assert len(found) <= 24


def test_the_best_of_each_kind_and_subject_are_tried_the_best_first() -> None:
    """The logarithms of chances: the most negative first, down to three tenths of it; the best three of all kinds."""

    def one(kind: K, tube: int, stop: int) -> Hypothesis:
        return Hypothesis(kind, (tube,), stop)

    given = [
        (-20.0, one(K.BIAS_STEPPED, 1, 4)), (-50.0, one(K.BIAS_STEPPED, 1, 5)), (-49.0, one(K.BIAS_STEPPED, 1, 6)),
        (-100.0, one(K.TILT_SLIPPED, 2, 3)), (-30.0, one(K.MOUNT_TURNED, 3, 1)), (-29.9, one(K.LOOK_WRONG, 3, 1)),
        (-40.0, one(K.BIAS_STEPPED, 2, 4)), (-45.0, one(K.TILT_SLIPPED, 3, 4)),
    ]  # fmt: skip
    assert best_of_kinds(given) == [
        one(K.TILT_SLIPPED, 2, 3), one(K.BIAS_STEPPED, 1, 5), one(K.TILT_SLIPPED, 3, 4), one(K.MOUNT_TURNED, 3, 1),
    ]  # fmt: skip
    many = [(-100.0 - k, one(kind, 1, 1)) for k, kind in enumerate(K)]
    tried = best_of_kinds(many)
    assert tried == [hypothesis for _, hypothesis in reversed(many)][:8]
