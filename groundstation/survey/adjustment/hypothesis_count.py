"""How many hypotheses the looks of a hole could show, counted without making one: of many looks they are thousands."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from groundstation.survey.adjustment.hypotheses import (
    FEWEST_TO_CREEP,
    MOST_MOVED,
    stations_seen_twice,
    thinned_stops,
)
from groundstation.survey.adjustment.looks import Looks
from groundstation.survey.adjustment.run_of_stops import JOINT, RunOfStops

Places = npt.NDArray[np.intp]
Truths = npt.NDArray[np.bool_]
OF_STRING = 3  # from a stop on or at it alone: the encoder, and two of the depth
OF_TUBE_ALWAYS, OF_LOOK, OF_LATER_LOOK = 3, 2, 3


def count_hypotheses(looks: Looks, run: RunOfStops) -> int:
    """How many ``all_hypotheses`` are."""
    stops = np.unique(looks.stop)
    onsets = set(thinned_stops(stops.tolist()))
    is_onset = np.isin(stops, list(onsets))
    place = np.searchsorted(stops, looks.stop)
    was_there = np.zeros((int(looks.tube.max()) + 1, len(stops)), bool)
    was_there[looks.tube, place] = True
    was_there = was_there[was_there.any(axis=1)]
    string = int(len(stops) > FEWEST_TO_CREEP) + OF_STRING * int(is_onset[1:].sum())
    joints = _of_joints(looks, run, place, is_onset)
    return string + _of_tubes(was_there, is_onset) + joints + _exchanged(was_there) + _moved(looks, onsets)


def _of_tubes(was_there: Truths, is_onset: Truths) -> int:
    """Of every tube by itself; ``was_there`` (m, k) says at which stops it looked."""
    number: Places = np.cumsum(was_there, axis=1)  # of its looks, from 1
    left: Places = number[:, -1:] - number
    counted = OF_LOOK + OF_LATER_LOOK * (number > 1) + (left >= FEWEST_TO_CREEP)
    return OF_TUBE_ALWAYS * len(was_there) + int(counted[was_there & is_onset].sum())


def _of_joints(looks: Looks, run: RunOfStops, place: Places, is_onset: Truths) -> int:
    """A joint that was misread, and that slipped at any onset but the first stop that it is in."""
    causes = run.causes
    rows = [number for number, (kind, _) in enumerate(causes.names) if kind == JOINT]
    numbers = looks.tube * causes.of_make_ups.shape[1] + looks.make_up
    is_pair = np.bincount(numbers) > 0  # of so many looks sorting them takes longer than all the rest
    pairs, pair_of = np.flatnonzero(is_pair), (np.cumsum(is_pair) - 1)[numbers]
    tube, make_up = np.divmod(pairs, causes.of_make_ups.shape[1])
    turned = (causes.of_tubes[rows][:, tube] + causes.of_make_ups[rows][:, make_up]) != 0.0
    at = np.zeros((len(pairs), len(is_onset)), np.float32)
    at[pair_of, place] = 1.0
    is_in = turned.astype(np.float32) @ at > 0.0
    is_later = np.cumsum(is_in, axis=1) > 1
    return int(is_in.any(axis=1).sum()) + int((is_in & is_later & is_onset).sum())


def _exchanged(was_there: Truths) -> int:
    """Pairs of tubes that were there at one stop."""
    together = was_there.astype(np.float32) @ was_there.T.astype(np.float32) > 0.0
    return int(np.triu(together, 1).sum())


def _moved(looks: Looks, onsets: set[int]) -> int:
    """Neighbouring stations, and all that were seen where these are more."""
    seen = stations_seen_twice(looks, onsets)
    count, run = int((seen.sum(axis=1) > MOST_MOVED).sum()), seen
    for _ in range(MOST_MOVED - 1):
        run = run[:, :-1] & seen[:, seen.shape[1] - run.shape[1] + 1 :]
        count += int(run.sum())
    return count
