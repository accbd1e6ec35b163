"""What is wrong with a hole that does not fit: the best single explanation, beside the second best, one after another.

Every hypothesis is scored at once; the best of each kind are tried by adjusting the hole with them, and compared by
their likelihood. One is believed where fewer than one in a thousand honest holes would ever show as much, however many
hypotheses and stops there are; where the second best explains nearly as much, it is a doubt and both are taken in.
Source: Baarda 1968; Teunissen 1990; Pope, NOAA Technical Report NOS 65 (1976), for a variance that is estimated.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt

from groundstation.survey.adjustment.adjusted import Adjusted
from groundstation.survey.adjustment.bends_among_holes import bent_as_holes_are
from groundstation.survey.adjustment.blunder_kind import BlunderKind
from groundstation.survey.adjustment.collar import collar_departure
from groundstation.survey.adjustment.hypotheses import BY_DEPTH, KNOWN_SIZE, WIDTHS, Hypothesis, all_hypotheses
from groundstation.survey.adjustment.hypothesis_count import count_hypotheses
from groundstation.survey.adjustment.looks import Looks, PathPrior, StartingPoint, StringPrior
from groundstation.survey.adjustment.run_of_stops import RunOfStops
from groundstation.survey.adjustment.scores import Score, log_chances, log_tail, score_hypotheses
from groundstation.survey.adjustment.screen import is_suspicious
from groundstation.survey.adjustment.taken_in import TakenIn, adjust_with, deviance_of

Array = npt.NDArray[np.float64]
FALSE_ALARM = 1e-3  # of a whole honest hole
SUSPECTED = 0.05  # of an honest hole at one stop, up to which the covariance has what is suspected in it
WORTH_TRYING = math.log(1e-3)  # of one hypothesis, before it is tried
MOST_TRIED = 8
AS_GOOD = 0.3  # part of the best's logarithm that is worth trying; play hides the rest
PARTED = math.log(100.0)  # by how much the best outdoes the second, or it is a doubt
MOST_BLUNDERS = 4
TUBES_MISCOUNTED = 1.5  # spacings of stations by which a depth may be off: one tube too many, and a little
COLLAR = Hypothesis(BlunderKind.COLLAR_WRONG, ())


@dataclass(frozen=True, slots=True)
class Explanation:
    """One explanation of what does not fit.

    Parameters
    ----------
    hypothesis : what it is
    size, cov : (q,) and (q, q), m/s^2 (a second, of a creep), rad or m; empty where the size is known
    log_chance : natural logarithm of the chance that an honest hole shows as much, all hypotheses and stops counted:
        how many would on the mean, so that it is above zero where nothing is explained
    """

    hypothesis: Hypothesis
    size: Array
    cov: Array
    log_chance: float


@dataclass(frozen=True, slots=True)
class Blunder:
    """A blunder that was found.

    Parameters
    ----------
    best, second : explanations; there may be no second
    before, after : weighted squares of what is left over what they are to be, without and with it
    """

    best: Explanation
    second: Explanation | None
    before: float
    after: float

    @property
    def is_doubt(self) -> bool:
        """Whether the second best explains nearly as much."""
        return self.second is not None and self.second.log_chance - self.best.log_chance < PARTED

    @property
    def taken_in(self) -> tuple[Hypothesis, ...]:
        """What the adjustment leaves open for it: both explanations of a doubt, where neither has a known size."""
        both = (self.best, self.second) if self.second and self.is_doubt else (self.best,)
        if any(one.hypothesis.kind in KNOWN_SIZE for one in both):
            both = (self.best,)
        return tuple(one.hypothesis for one in both)


@dataclass(frozen=True)  # with a dictionary, for what is worked out once
class Examination:
    """A hole adjusted with all that was found.

    Parameters
    ----------
    adjusted : with the blunders taken in
    blunders : those known before first
    suspicion : what may be wrong, but not beyond the false alarms of a whole hole; it is not told as a fault
    supposed : the same hole were the suspicion true; None where nothing is suspected
    """

    adjusted: Adjusted
    blunders: tuple[Blunder, ...] = ()
    suspicion: Blunder | None = None
    supposed: Adjusted | None = None

    @cached_property
    def drawn(self) -> Adjusted:
        """The hole as it is drawn, without its looks; see ``drawn_with_looks``."""
        found = self.drawn_with_looks
        return found if found is self.adjusted else found.without_looks()

    @property
    def drawn_with_looks(self) -> Adjusted:
        """The hole as ``adjusted``, by how sharply it seems to bend among all holes; worked out each time.

        What is wrong is looked for in a hole that may bend as is usual, so that a blunder is not taken for a bend of a
        calm one; the ± of its positions is that of this hole. Where that one has no solution it is as ``adjusted``.
        """
        try:
            return bent_as_holes_are(self.adjusted)
        except (np.linalg.LinAlgError, ArithmeticError):
            return self.adjusted

    @property
    def explained(self) -> Adjusted:
        """The hole with all that was found, the suspicion too."""
        return self.adjusted if self.supposed is None else self.supposed

    @property
    def suspected(self) -> Array:
        """By how much each direction (s + 1, 2), rad about two axes, would be another one were the suspicion true.

        It is one standard deviation more: most suspicions are none, so none moves a direction.
        """
        off = self.explained.now.tangents - self.adjusted.now.tangents
        return np.asarray(np.einsum("kai,ki->ka", self.drawn.bases, off))

    @property
    def taken_in(self) -> tuple[Hypothesis, ...]:
        """What the adjustment has as further unknowns or put right in its looks, in its order."""
        return _taken_in(self.blunders)

    @property
    def global_ratio(self) -> float:
        """Weighted squares of what is left over what they are to be: 1 in an honest hole."""
        return global_ratio(self.adjusted)


def global_ratio(found: Adjusted) -> float:
    """Weighted squares of what the looks leave over what they are to be."""
    return found.squares / max(found.redundancy, 1e-9)


def examine_hole(
    looks: Looks,
    string: StringPrior,
    path: PathPrior,
    run: RunOfStops,
    known: Sequence[Blunder] = (),
    start: StartingPoint | None = None,
) -> Examination:
    """Adjust a hole and say what is wrong with it.

    Parameters
    ----------
    looks, string, path, start : as of ``adjust_hole``
    run : stops and causes of turns
    known : blunders that were found before, which are taken in; a doubt among them is judged again
    """
    known = tuple(_judged_again(looks, string, path, run, known, place) for place in range(len(known)))
    now, more = _begun(looks, string, path, run, _taken_in(known), start)
    found = list(known)
    suspicion, supposed = None, None
    while suspicion is None and len(found) < MOST_BLUNDERS and more:
        blunder = find_blunder(looks, string, path, run, now, _taken_in(found))
        if blunder is None or blunder.best.log_chance > math.log(SUSPECTED) + log_of_stops(looks):
            break
        if blunder.best.log_chance <= math.log(FALSE_ALARM):
            found.append(blunder)
            now = adjust_with(looks, string, path, run, _taken_in(found), now.found.now)
            more = is_suspicious(now.found, run)
            continue
        if len(np.unique(looks.tube)) == 1:
            break  # of one tube alone only what is known of path and collar speaks against it
        suspicion = blunder
        supposed = adjust_with(looks, string, path, run, _taken_in([*found, blunder]), now.found.now).found
    blunders = tuple(_resized(one, now, _taken_in(found)) for one in found)
    return Examination(now.found, blunders, suspicion, supposed)


def _begun(
    looks: Looks,
    string: StringPrior,
    path: PathPrior,
    run: RunOfStops,
    taken_in: tuple[Hypothesis, ...],
    start: StartingPoint | None,
) -> tuple[TakenIn, bool]:
    """A hole adjusted with what is known to be wrong, and whether more seems to be.

    Before more is blamed, play and bends are learnt of all looks.
    """
    if start is not None and start.is_learnt:
        if not taken_in:
            now = adjust_with(looks, string, path, run, (), start)
            if not is_suspicious(now.found, run):
                return now, False
        start = replace(start, is_learnt=False)
    now = adjust_with(looks, string, path, run, taken_in, start)
    return now, is_suspicious(now.found, run)


def examine_known(
    looks: Looks,
    string: StringPrior,
    path: PathPrior,
    run: RunOfStops,
    before: Examination | None = None,
    start: StartingPoint | None = None,
) -> tuple[Examination, bool]:
    """Adjust a hole with what was found before, and say whether more seems to be wrong, without looking for it.

    Where nothing was found before and nothing seems to be wrong it comes to the same as ``examine_hole``.

    Parameters
    ----------
    looks, string, path, run, start : as of ``examine_hole``
    before : of fewer looks, whose stations, stops and tubes have the places that they had
    """
    known, suspicion = ((), None) if before is None else (before.blunders, before.suspicion)
    now, more = _begun(looks, string, path, run, _taken_in(known), start)
    blunders = tuple(_resized(one, now, _taken_in(known)) for one in known)
    supposed = None
    if suspicion is not None:
        supposed = adjust_with(looks, string, path, run, _taken_in([*known, suspicion]), now.found.now).found
        more = is_suspicious(supposed, run)
    return Examination(now.found, blunders, suspicion, supposed), more


def _resized(blunder: Blunder, now: TakenIn, taken_in: tuple[Hypothesis, ...]) -> Blunder:
    """A blunder with its size as all looks and the other blunders have it now; a doubt keeps those of its trials."""
    if blunder.is_doubt:
        return blunder
    place = taken_in.index(blunder.best.hypothesis)
    return replace(blunder, best=replace(blunder.best, size=now.sizes[place], cov=now.covs[place]))


def _taken_in(blunders: Sequence[Blunder]) -> tuple[Hypothesis, ...]:
    return tuple(dict.fromkeys(one for blunder in blunders for one in blunder.taken_in))


def find_blunder(
    looks: Looks,
    string: StringPrior,
    path: PathPrior,
    run: RunOfStops,
    now: TakenIn,
    known: tuple[Hypothesis, ...] = (),
) -> Blunder | None:
    """Find the best explanation of what an adjustment leaves, however likely in an honest hole; there may be none.

    Parameters
    ----------
    looks, string, path, run : of the hole
    now : its adjustment, with the hypotheses ``known`` taken in
    """
    found = now.found
    hypotheses = [one for one in all_hypotheses(looks, run) if one not in known]
    chances = [*chances_of(score_hypotheses(found, run, hypotheses), found), *_chance_of_collar(found, known)]
    worth = best_of_kinds(chances)
    if not worth:
        return None
    many = log_of_level(looks, run)
    adjusted = [_tried(looks, string, path, run, found, known, one) for one in worth]
    tried = [
        (with_one, _explained(with_one, found, one, many))
        for with_one, one in zip(adjusted, worth, strict=True)
        if is_plausible(one, with_one.sizes[-1], run)
    ]
    if not tried:
        return None
    tried.sort(key=lambda pair: pair[1].log_chance)
    with_best, best = tried[0]
    second = tried[1][1] if len(tried) > 1 else None
    return Blunder(best, second, global_ratio(found), global_ratio(with_best.found))


def is_plausible(one: Hypothesis, size: Array, run: RunOfStops) -> bool:
    """Whether a blunder of a size can be: a depth is off by a tube that was not counted, never by half of the hole."""
    spacing = float(np.max(np.diff(run.station_md), initial=0.0))
    return one.kind not in BY_DEPTH or abs(float(size[0])) <= TUBES_MISCOUNTED * spacing


def _chance_of_collar(found: Adjusted, known: tuple[Hypothesis, ...]) -> list[tuple[float, Hypothesis]]:
    """Chance that an honest hole departs as far from its collar, unless it is taken in that this was told wrong."""
    if COLLAR in known or (chance := collar_departure(found).log_chance()) >= WORTH_TRYING:
        return []
    return [(chance, COLLAR)]


def chance_of_one(looks: Looks, run: RunOfStops) -> float:
    """Chance of a false alarm that one hypothesis has at the last stop, so that a whole hole keeps its own."""
    return FALSE_ALARM * math.exp(-log_of_level(looks, run))


def log_of_level(looks: Looks, run: RunOfStops) -> float:
    """Logarithm of how many chances an honest hole has: of all hypotheses, and of all stops."""
    hypotheses = 1 + count_hypotheses(looks, run)  # and the collar
    return math.log(hypotheses) + log_of_stops(looks)


def log_of_stops(looks: Looks) -> float:
    """Logarithm of k (k + 1) at the stop k: the inverses are, in sum over all stops however many, one."""
    stops = max(1, len(np.unique(looks.stop)))
    return math.log(stops * (stops + 1.0))


def chances_of(scores: Sequence[Score], found: Adjusted) -> Iterator[tuple[float, Hypothesis]]:
    """Logarithm of the chance that an honest hole shows as much, of each hypothesis that is worth trying."""
    for score in scores:
        chances = log_chances(score.squares, score.told, found.squares, found.redundancy)
        for place in np.flatnonzero(chances < WORTH_TRYING).tolist():
            yield float(chances[place]), score.hypotheses[place]


def best_of_kinds(chances: Sequence[tuple[float, Hypothesis]]) -> list[Hypothesis]:
    """The hypotheses that are worth trying: of each kind and subject the best, of them the best few."""
    best: dict[tuple[object, ...], tuple[float, Hypothesis]] = {}
    for chance, one in chances:
        about = (one.kind, one.subject)
        best[about] = min(best.get(about, (0.0, one)), (chance, one), key=lambda pair: pair[0])
    ranked = sorted(best.values(), key=lambda pair: pair[0])
    ordered = [one for chance, one in ranked if chance <= AS_GOOD * ranked[0][0]]
    first_of_kind = {one.kind: one for one in reversed(ordered)}
    leading = [one for one in ordered if one is first_of_kind[one.kind] or one in ordered[:3]]
    return leading[:MOST_TRIED]


def _tried(
    looks: Looks,
    string: StringPrior,
    path: PathPrior,
    run: RunOfStops,
    found: Adjusted,
    known: tuple[Hypothesis, ...],
    one: Hypothesis,
) -> TakenIn:
    return adjust_with(looks, string, path, run, (*known, one), found.now)


def _explained(with_one: TakenIn, found: Adjusted, one: Hypothesis, many: float) -> Explanation:
    """What a hypothesis explains, from the likelihood of the looks without and with it."""
    if one == COLLAR:
        # the likelihood is that of the looks, and the collar is in none
        return Explanation(one, with_one.sizes[-1], with_one.covs[-1], collar_departure(found).log_chance() + many)
    gain = max(0.0, deviance_of(found) - deviance_of(with_one.found))
    free = max(1.0, with_one.found.redundancy)
    squares = math.expm1(min(gain / free, 500.0)) * free
    told = np.array([WIDTHS[one.kind]])
    chance = float(log_tail(np.array([squares]), told, np.array([free]))[0]) + many
    return Explanation(one, with_one.sizes[-1], with_one.covs[-1], chance)


def _judged_again(
    looks: Looks, string: StringPrior, path: PathPrior, run: RunOfStops, known: Sequence[Blunder], place: int
) -> Blunder:
    """A blunder that was a doubt, by what later looks tell of it."""
    blunder = known[place]
    if not blunder.is_doubt or blunder.second is None:
        return blunder
    others = _taken_in([one for k, one in enumerate(known) if k != place])
    plain, many = adjust_with(looks, string, path, run, others).found, log_of_level(looks, run)
    tried = [
        _explained(_tried(looks, string, path, run, plain, others, one.hypothesis), plain, one.hypothesis, many)
        for one in (blunder.best, blunder.second)
    ]
    tried.sort(key=lambda one: one.log_chance)
    return Blunder(tried[0], tried[1], blunder.before, blunder.after)
