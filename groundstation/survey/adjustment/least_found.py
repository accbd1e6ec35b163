"""The smallest mistake of each kind that would be found at the last stop, where it would do most at the toe.

A drift of the encoder is of all stops: see ``unseen_drift``.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Final

import numpy as np

from groundstation.survey.adjustment.blunder_kind import BlunderKind
from groundstation.survey.adjustment.hypotheses import Hypothesis
from groundstation.survey.adjustment.looks import Looks
from groundstation.survey.adjustment.reliability import Reliability
from groundstation.survey.adjustment.run_of_stops import JOINT, RunOfStops

K = BlunderKind
DEG: Final = np.pi / 180.0
DRIFT: Final = Hypothesis(K.ENCODER_DRIFTS, ())
LARGEST: Final[Mapping[BlunderKind, float]] = {  # that is to be reckoned with where nothing would find it; SI and rad
    K.BIAS_STEPPED: 0.2,  # 20 mg: a sensor that was knocked
    K.TILT_SLIPPED: 0.5 * DEG,  # of a mount as it is made
    K.MOUNT_TURNED: 5.0 * DEG,
    K.JOINT_SLIPPED: 5.0 * DEG,
    K.ENCODER_SLIPPED: 7.2 * DEG,  # one tooth of a belt of fifty
    K.ENCODER_DRIFTS: 0.5 * DEG,  # at every stop: a wheel that slips by 3e-4 of five turns
    K.DEPTH_WRONG_ONCE: 0.5,
}


def possible_mistakes(looks: Looks, run: RunOfStops) -> list[Hypothesis]:
    """What may go wrong at the last stop: with each tube that looked there, its joint, the encoder, the depth."""
    return list(_of_last_stop(looks, run))


def _of_last_stop(looks: Looks, run: RunOfStops) -> Iterator[Hypothesis]:
    newest, last = newest_stops(looks), int(looks.stop.max())
    for tube, stop in newest.items():
        yield Hypothesis(K.BIAS_STEPPED, (tube,), stop)
        yield Hypothesis(K.TILT_SLIPPED, (tube,), stop)
        yield Hypothesis(K.MOUNT_TURNED, (tube,), stop)
    for kind, tube in run.causes.names:
        if kind == JOINT and last:
            yield Hypothesis(K.JOINT_SLIPPED, (tube,), last)
    if last:
        yield Hypothesis(K.ENCODER_SLIPPED, (), last)
        yield Hypothesis(K.DEPTH_WRONG_ONCE, (), last)


def newest_stops(looks: Looks) -> dict[int, int]:
    """Newest stop of every tube, in the order in which tubes first looked."""
    newest = np.zeros(int(looks.tube.max()) + 1, np.intp)
    newest[looks.tube] = looks.stop  # in the order of time: of a tube that looks again the last that is written stays
    tubes, first = np.unique(looks.tube, return_index=True)
    return {tube: int(newest[tube]) for tube in tubes[np.argsort(first)].tolist()}


def worst_of_kinds(told: Sequence[Reliability]) -> list[Reliability]:
    """Of each kind that which does most at the toe when it is not found, to north or east; the worst first."""
    places = {kind: place for place, kind in enumerate(K)}
    worst: dict[BlunderKind, tuple[float, Reliability]] = {}
    for one in told:
        size, kind = unfound_across(one), one.hypothesis.kind
        if kind not in worst or size > worst[kind][0]:
            worst[kind] = size, one
    by_kind = sorted(worst.values(), key=lambda pair: places[pair[1].hypothesis.kind])
    return [one for _, one in sorted(by_kind, key=lambda pair: -pair[0])]


def unfound_across(one: Reliability) -> float:
    """What one that is not found does at the toe, m: the larger of north and east; the functionals are the toe's."""
    north, east = map(min, one.at_toe[:2].tolist(), one.by_size[:2].tolist())  # of hundreds
    return float(max(north, east))
