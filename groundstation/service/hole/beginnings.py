"""Where the adjustment of a hole of many looks begins: where one of all looks up to an earlier stop ends. No I/O.

It is always the same one, whatever was asked meanwhile: so a hole comes out of a restart bit for bit. That of every
sixteenth stop begins with the looks alone, and learns how far tubes lie askew and how the hole bends; that of every
fourth goes on from it, and leaves a survey that comes now a step or two.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from groundstation.service.hole.blunder_search import LookedAt
from groundstation.service.hole.hung_chains import HungChains
from groundstation.service.hole.resolved_stops import Rows
from groundstation.survey.adjustment.adjust import adjust_hole
from groundstation.survey.adjustment.looks import OF_TUBE, TURN, PathPrior, StartingPoint, StringPrior
from groundstation.survey.adjustment.normal_equations import are_many

Array = npt.NDArray[np.float64]
Places = npt.NDArray[np.intp]
EVERY = (16, 4)  # stops of the string between such beginnings
LookAt = Callable[[Rows, Array, Places, PathPrior, HungChains], LookedAt]


@dataclass(slots=True)
class Beginning:
    """Where an adjustment of earlier looks ended, and of which looks it was."""

    chains: HungChains
    made_of: bytes = b""
    ended: StartingPoint | None = None


class Beginnings:
    """Beginnings of a hole, kept from one adjustment to the next.

    Parameters
    ----------
    look_at : what rows of the table come to as looks
    chains_anew : of no stop yet
    """

    def __init__(self, look_at: LookAt, chains_anew: Callable[[], HungChains]) -> None:
        self._look_at = look_at
        self._kept = [Beginning(chains_anew()) for _ in EVERY]

    def start_of(self, numbers: Places, rows: Rows, seen: LookedAt) -> StartingPoint | None:
        """Where the adjustment of many looks begins; None for that of a few, which begins with the looks alone.

        Parameters
        ----------
        numbers, rows : of the table, in the order of the looks
        """
        looks, path = seen.looks, seen.path
        if not are_many(looks):
            return None
        start, above = None, np.zeros(1, np.intp)
        for every, kept in zip(EVERY, self._kept, strict=True):
            # looks are in the order of time, and so their stops are
            earlier = slice(int(np.searchsorted(looks.stop, int(looks.stop[-1]) // every * every)))
            if not earlier.stop:
                return None  # many tubes, and few stops yet
            is_used = np.zeros(len(path.md), bool)
            is_used[looks.station[earlier]] = is_used[0] = True
            places = np.flatnonzero(is_used)
            station = (np.cumsum(is_used) - 1)[looks.station[earlier]]
            # how depths scatter is another thing at every stop, and no matter of where to begin
            its_path = replace(path, md=path.md[places], leg_length_var=None)
            # a row keeps its readings, and gets another number of its tube where it is revised
            made_of = b"".join(
                one.tobytes() for one in (numbers[earlier], rows["sequence"][earlier], station, its_path.md)
            )
            if kept.ended is None or kept.made_of != made_of:
                part = self._look_at(rows[earlier], looks.force[earlier], station, its_path, kept.chains)
                kept.made_of, kept.ended = made_of, _ended(part, start, np.searchsorted(places, above))
            start, above = kept.ended, places
        return None if start is None else grown_start(start, above, len(path.md), seen.string)


def _ended(part: LookedAt, start: StartingPoint | None, known: Places) -> StartingPoint:
    """Where the adjustment of looks ends that begins with them alone, or where one of some of them ended.

    Parameters
    ----------
    known : places of the stations that were adjusted there
    """
    if start is None:
        start = adjust_hole(part.looks, part.string, part.path).now
    else:
        start = grown_start(start, known, len(part.path.md), part.string)
    return adjust_hole(part.looks, part.string, part.path, start=replace(start, is_learnt=True)).now


def grown_start(start: StartingPoint, known: Places, count: int, string: StringPrior) -> StartingPoint:
    """Where to begin with more stations and tubes: new stations go on as those above, new tubes as they are known.

    Parameters
    ----------
    known : places of collar and stations that were adjusted among ``count``
    """
    tubes = np.zeros((string.count, OF_TUBE))
    tubes[:, TURN], make_ups = string.turn[: string.count], string.turn[string.count :].copy()
    tubes[: len(start.tubes)], make_ups[: len(start.make_ups)] = start.tubes, start.make_ups
    nearest = np.searchsorted(known, np.arange(count), side="right") - 1
    curvatures = np.zeros((count, 2))
    curvatures[known] = start.curvatures
    legs = np.full(count - 1, start.curvature_var)
    legs[known[1:] - 1] = start.leg_vars
    return replace(
        start,
        tangents=start.tangents[nearest],
        curvatures=curvatures,
        tubes=tubes,
        make_ups=make_ups,
        leg_vars=legs,
        is_learnt=True,
    )
