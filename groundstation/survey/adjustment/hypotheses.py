"""What may be wrong beside what was foreseen: kinds of blunder, and every single one that the looks could show.

A hypothesis changes the force of a look by its amplitude there times the columns of its kind: a step of a bias counts
one in every look of its tube from a stop on, a creep what has passed since. Source: Baarda, "A testing procedure for
use in geodetic networks", Netherlands Geodetic Commission 2 (1968).
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from groundstation.survey.adjustment.adjusted import Linearised
from groundstation.survey.adjustment.blunder_kind import BlunderKind
from groundstation.survey.adjustment.looks import Looks, StartingPoint
from groundstation.survey.adjustment.run_of_stops import JOINT, RunOfStops

Array = npt.NDArray[np.float64]
Places = npt.NDArray[np.intp]
SHORT = 0.05  # m, over which a hole has one curvature
FEWEST_TO_CREEP = 2  # looks after the last right one; with one it is a step
MOST_MOVED = 4  # neighbouring stations that move together
RECENT, EARLIER = 16, 8  # stops from which on, where there are more than both


K = BlunderKind
SWAPPED = [1, 0, 2]
OF_FORCE = (K.BIAS_STEPPED, K.BIAS_CREEPS, K.BIAS_WRONG, K.LOOK_WRONG)
CONSTANT = (K.BIAS_WRONG, K.TILT_WRONG, K.MOUNT_MISREAD, K.JOINT_MISREAD)
KNOWN_SIZE = (K.AXES_EXCHANGED, K.TUBES_EXCHANGED)  # of amplitude one, put right in the looks themselves
OF_BEFORE = (K.HOLE_MOVED, K.TUBES_EXCHANGED)  # which change looks before their stop
BY_TILT = (K.TILT_SLIPPED, K.TILT_WRONG)
BY_DEPTH = (K.DEPTH_WRONG_ONCE, K.DEPTH_WRONG_FROM)
OF_CHAIN = (K.JOINT_SLIPPED, K.JOINT_MISREAD, K.ENCODER_SLIPPED, K.ENCODER_DRIFTS)
BY_TURN = (K.MOUNT_TURNED, K.MOUNT_MISREAD, *OF_CHAIN)
WIDTHS = {
    **dict.fromkeys(OF_FORCE, 3),
    **dict.fromkeys((*BY_TILT, K.HOLE_MOVED, K.COLLAR_WRONG), 2),
    **dict.fromkeys((*BY_TURN, *BY_DEPTH, *KNOWN_SIZE), 1),
}


@dataclass(frozen=True, slots=True)
class Hypothesis:
    """One thing that may be wrong.

    The direction at the collar is in no look: that it was told wrong changes what is known of the path, see ``collar``.

    Parameters
    ----------
    kind : of it
    subject : the tube, the tube below the joint, both tubes, first and last station of those that moved, or none
    stop : from which on, or at which alone; 0 for what was wrong from the beginning
    """

    kind: BlunderKind
    subject: tuple[int, ...]
    stop: int = 0


def effect_of(
    one: Hypothesis, looks: Looks, run: RunOfStops, now: StartingPoint, linear: Linearised, reach: float = 0.0
) -> tuple[Places, Array]:
    """Looks (r,) that a hypothesis changes, and the change (r, 3, q) of their force for one unit of it.

    Units are m/s^2 (a second, of a creep), rad (a stop, of a drift), m, or one for what has a known size. Of a depth
    that is wrong by about ``reach`` (m) it is the mean change over that length.
    """
    amplitude = effect_amplitudes(one, looks, run)
    rows = np.flatnonzero(amplitude)
    return rows, np.asarray(_unit_effect(one, looks, run, now, linear, reach)[rows] * amplitude[rows, None, None])


def effects_of(
    same: Sequence[Hypothesis], looks: Looks, run: RunOfStops, now: StartingPoint, linear: Linearised
) -> Array:
    """Change (n, 3, h, q) of the force of all looks by hypotheses of one kind, see ``effect_of``."""
    amplitudes = amplitudes_of(same, looks, run).T[:, None, :, None]
    every = same if same[0].kind is K.TUBES_EXCHANGED else same[:1]  # others are alike but for where they are
    return np.asarray(amplitudes * np.stack([_unit_effect(one, looks, run, now, linear) for one in every], axis=2))


def _unit_effect(
    one: Hypothesis, looks: Looks, run: RunOfStops, now: StartingPoint, linear: Linearised, reach: float = 0.0
) -> Array:
    """Change (n, 3, q) of the force of looks by one unit of a hypothesis, were there all of it in each."""
    by = linear.jacobians
    if one.kind in OF_FORCE:
        return np.broadcast_to(np.eye(3), (len(looks), 3, 3))
    if one.kind in BY_TILT:
        return by[:, :, 5:7]
    if one.kind in BY_TURN:
        return by[:, :, 7:8]
    if one.kind is K.HOLE_MOVED:
        return by[:, :, :2]
    if one.kind is K.AXES_EXCHANGED:
        return (looks.force - looks.force[:, SWAPPED])[:, :, None]
    if one.kind is K.TUBES_EXCHANGED:
        bent = _apart(one, looks, now, linear)
    else:
        bent = _bent_by_metre(run.station_md, now, linear, reach)[looks.station]
    return np.asarray(np.einsum("kab,kb->ka", by[:, :, :2], bent)[:, :, None])


def _bent_by_metre(md: Array, now: StartingPoint, linear: Linearised, reach: float) -> Array:
    """How the hole bends (s + 1, 2) from each station on, rad/m, in the mean over ``reach`` m, which may be upward."""
    if abs(reach) < SHORT:
        return now.curvatures
    there = np.stack([np.interp(md + reach, md, one) for one in now.tangents.T], axis=1)
    bent = np.einsum("sai,si->sa", linear.bases, there - now.tangents) / reach
    beyond = np.clip(md + reach - md[-1], 0.0, abs(reach))[:, None] / abs(reach)
    return np.asarray(bent + beyond * now.curvatures[-1])


def _apart(one: Hypothesis, looks: Looks, now: StartingPoint, linear: Linearised) -> Array:
    """How far (n, 2), rad, the hole points elsewhere where the other of two tubes looked."""
    apart = now.tangents[exchanged_stations(looks, one.subject)] - now.tangents[looks.station]
    return np.asarray(np.einsum("kai,ki->ka", linear.bases[looks.station], apart))


def exchanged_stations(looks: Looks, tubes: tuple[int, ...]) -> Places:
    """Stations (n,) of all looks were two tubes to change places at every stop that both looked at."""
    one, other = (np.flatnonzero(looks.tube == tube) for tube in tubes)
    both, of_one, of_other = np.intersect1d(looks.stop[one], looks.stop[other], return_indices=True)
    found = looks.station.copy()
    found[one[of_one]], found[other[of_other]] = looks.station[other[of_other]], looks.station[one[of_one]]
    return found if len(both) else looks.station


def effect_amplitudes(one: Hypothesis, looks: Looks, run: RunOfStops) -> Array:
    """How much (n,) of a hypothesis is in each look; 0 in those that it leaves alone."""
    return np.asarray(amplitudes_of([one], looks, run)[0])


def amplitudes_of(same: Sequence[Hypothesis], looks: Looks, run: RunOfStops) -> Array:
    """The same (h, n) of hypotheses of one kind.

    Where the hole moved it is the looks before that are off, so that the directions are those of the hole as it is.
    """
    kind, stops = same[0].kind, np.array([one.stop for one in same])
    amount: Array | float = -1.0 if kind is K.HOLE_MOVED else 1.0
    if kind in OF_CHAIN:
        amount = _turned_by(same, looks, run)
    elif kind is K.BIAS_CREEPS:
        amount = run.time[looks.stop] - run.time[stops][:, None]
    return np.where(_are_touched(same, stops[:, None], looks), amount, 0.0)


def _are_touched(same: Sequence[Hypothesis], stops: Places, looks: Looks) -> npt.NDArray[np.bool_]:
    """Which looks (h, n) hypotheses of one kind and of stops (h, 1) may change."""
    kind = same[0].kind
    if kind is K.TUBES_EXCHANGED:
        return np.array([exchanged_stations(looks, one.subject) != looks.station for one in same])
    since = looks.stop == stops if kind in (K.DEPTH_WRONG_ONCE, K.LOOK_WRONG) else looks.stop >= stops
    if kind in (*OF_CHAIN, *BY_DEPTH):
        return np.asarray(since)
    subjects = np.array([one.subject for one in same])
    if kind is K.HOLE_MOVED:
        return np.asarray(~since & (looks.station >= subjects[:, :1]) & (looks.station <= subjects[:, 1:]))
    return np.asarray(since & (looks.tube == subjects[:, :1]))


def _turned_by(same: Sequence[Hypothesis], looks: Looks, run: RunOfStops) -> Array:
    """Turn (h, n), or of all alike (n,), of the yaw of every look for one radian of joints or of the encoder."""
    kind, causes = same[0].kind, run.causes
    if kind is K.ENCODER_SLIPPED:
        return np.ones(len(looks))
    if kind is K.ENCODER_DRIFTS:
        return turns_of_drift(looks)
    places = {name: place for place, name in enumerate(causes.names)}
    return causes.turned_by(np.array([places[JOINT, one.subject[0]] for one in same]), looks)


def turns_of_drift(looks: Looks) -> Array:
    """Stops (n,) until each look: a belt slips by a part of what it turns, about the same before every stop.

    Before the first, too: north is told before the string turns.
    """
    return np.asarray(looks.stop + 1.0)


def all_hypotheses(looks: Looks, run: RunOfStops) -> Iterator[Hypothesis]:
    """Everything single that the looks of a hole could show; from the latest stops on where there are many."""
    stops = np.unique(looks.stop).tolist()
    onsets = set(thinned_stops(stops))
    yield from _of_string(stops, onsets)
    of_tubes = {tube: np.unique(looks.stop[looks.tube == tube]).tolist() for tube in np.unique(looks.tube).tolist()}
    for tube, own in of_tubes.items():
        yield from _of_tube(tube, own, onsets)
    yield from _of_joints(looks, run, onsets)
    for one, other in itertools.combinations(of_tubes, 2):
        if np.intersect1d(of_tubes[one], of_tubes[other]).size:
            yield Hypothesis(K.TUBES_EXCHANGED, (one, other))
    yield from _of_hole(looks, onsets)


def thinned_stops(stops: list[int]) -> list[int]:
    """The latest stops, and some of those before."""
    before = stops[:-RECENT]
    every = max(1, -(-len(before) // EARLIER))
    return [*before[::every], *stops[-RECENT:]]


def _of_string(stops: list[int], onsets: set[int]) -> Iterator[Hypothesis]:
    if len(stops) > FEWEST_TO_CREEP:
        yield Hypothesis(K.ENCODER_DRIFTS, ())
    for stop in stops[1:]:
        if stop in onsets:
            yield Hypothesis(K.ENCODER_SLIPPED, (), stop)
            yield Hypothesis(K.DEPTH_WRONG_ONCE, (), stop)
            yield Hypothesis(K.DEPTH_WRONG_FROM, (), stop)


def _of_tube(tube: int, own: list[int], onsets: set[int]) -> Iterator[Hypothesis]:
    for kind in (K.BIAS_WRONG, K.TILT_WRONG, K.MOUNT_MISREAD):
        yield Hypothesis(kind, (tube,))
    for place, stop in enumerate(own):
        if stop not in onsets:
            continue
        yield Hypothesis(K.LOOK_WRONG, (tube,), stop)
        yield Hypothesis(K.AXES_EXCHANGED, (tube,), stop)
        if place:
            for kind in (K.BIAS_STEPPED, K.TILT_SLIPPED, K.MOUNT_TURNED):
                yield Hypothesis(kind, (tube,), stop)
        if place < len(own) - FEWEST_TO_CREEP:
            yield Hypothesis(K.BIAS_CREEPS, (tube,), stop)


def _of_joints(looks: Looks, run: RunOfStops, onsets: set[int]) -> Iterator[Hypothesis]:
    """A joint may be misread from when it is made on, and slip at any stop after that."""
    for (kind, tube), turned in zip(run.causes.names, run.causes.turned_looks(looks), strict=True):
        stops = np.unique(looks.stop[turned != 0.0]).tolist()
        if kind == JOINT and stops:
            yield Hypothesis(K.JOINT_MISREAD, (tube,))
            yield from (Hypothesis(K.JOINT_SLIPPED, (tube,), stop) for stop in stops[1:] if stop in onsets)


def stations_seen_twice(looks: Looks, onsets: set[int]) -> npt.NDArray[np.bool_]:
    """Which stations (o, s + 1) were looked at before and from each of the onsets on, these in their order."""
    stops, count = np.array(sorted(onsets), np.intp)[:, None], int(looks.station.max(initial=0)) + 1
    first, last = np.full(count, np.iinfo(np.intp).max), np.full(count, -1)
    np.minimum.at(first, looks.station, looks.stop)
    np.maximum.at(last, looks.station, looks.stop)
    return np.asarray((first < stops) & (stops <= last))


def _of_hole(looks: Looks, onsets: set[int]) -> Iterator[Hypothesis]:
    """Neighbouring stations that moved together, or all that were looked at before a stop and from it on."""
    for stop, is_seen in zip(sorted(onsets), stations_seen_twice(looks, onsets), strict=True):
        seen = np.flatnonzero(is_seen).tolist()
        for first, width in itertools.product(seen, range(2, MOST_MOVED + 1)):
            if is_seen[first : first + width].sum() == width:
                yield Hypothesis(K.HOLE_MOVED, (first, first + width - 1), stop)
        if len(seen) > MOST_MOVED:
            yield Hypothesis(K.HOLE_MOVED, (seen[0], seen[-1]), stop)
