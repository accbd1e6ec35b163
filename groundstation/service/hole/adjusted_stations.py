"""Where the stations of an adjusted hole point, which of them moved, and which point back. No I/O."""

from __future__ import annotations

import math
from array import array
from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from groundstation.service.hole.examined_hole import ExaminedHole
from groundstation.service.hole.hole_adjustment import directions_of
from groundstation.service.hole.movement import Moved, moved_stations
from groundstation.service.hole.resolved_stops import ResolvedStops
from groundstation.service.hole.station import SurveyStation
from groundstation.survey.adjustment.adjusted import Adjusted
from groundstation.survey.adjustment.collar import collar_ties
from groundstation.survey.fusion.fusion import Weighting
from groundstation.survey.fusion.resolve import Direction
from groundstation.survey.fusion.shared import SharedErrors
from groundstation.survey.fusion.tangents import tangents_of
from groundstation.survey.path.leg_wander import CollarTie, LegWander
from groundstation.survey.well.trajectory import TURNED_BACK

Array = npt.NDArray[np.float64]
SURELY_ON = math.radians(60.0)  # between any two surveys of two stations, up to which the lower points on
TINY = 1e-12


@dataclass(frozen=True, slots=True)
class AdjustedStations:
    """Stations below the collar, as an adjustment has them.

    Parameters
    ----------
    collar : direction there
    mds, directions : depths (m) and directions, from the top down
    moved : where the hole moved
    found : the adjustment; None where the surveys have no solution in common
    told : direction at the collar as it was told
    below : stations below it, from the top down
    stops : theirs
    """

    collar: Direction
    mds: Sequence[float] = ()
    directions: Sequence[Direction] = ()
    moved: list[Moved] = field(default_factory=list)
    found: Adjusted | None = None
    told: Direction | None = None
    below: Sequence[SurveyStation] = ()
    stops: ResolvedStops | None = None

    def direction_at(self, md: float) -> Direction:
        """Direction at the station at a depth (m); where there is none, that of the collar."""
        place = bisect_left(self.mds, md)
        return self.directions[place] if place < len(self.mds) and self.mds[place] == md else self.collar

    def turned_back(self) -> list[float]:
        """Depths (m) of stations whose surveys point back against those of the one above."""
        above = self.collar if self.told is None else self.told
        tangent = tangents_of([above])[0]
        suspected = may_turn_back(tangent, self.below, self.stops) if self.stops is not None else range(len(self.below))
        found = []
        for place in suspected:
            pair = [fused_alone(self.below[place - 1]) if place else above, fused_alone(self.below[place])]
            upper, lower = tangents_of(pair)
            if float(upper @ lower) < TURNED_BACK:
                found.append(self.below[place].md)
        return found


def may_turn_back(above: Array, below: Sequence[SurveyStation], stops: ResolvedStops) -> list[int]:
    """Places of the stations that may point back against the one above, the first against a direction (3,).

    What a station comes to lies among its surveys, or not far from them, and those of a hole that is one lie within
    a few degrees: so hardly any station has to be worked out by itself.
    """
    if not below:
        return []
    rows, begins = array("I"), list[int]()
    for one in below:
        begins.append(len(rows))
        rows += one.stops.rows[one.first :]
    tangents = stops.rows["tangent"][np.array(rows)]
    means = np.add.reduceat(tangents, begins, axis=0)
    means /= np.maximum(np.linalg.norm(means, axis=1, keepdims=True), TINY)
    counts = np.diff([*begins, len(rows)])
    within = np.minimum.reduceat(np.sum(tangents * means.repeat(counts, axis=0), axis=1), begins)
    spread = np.arccos(np.clip(np.append(1.0, within), -1.0, 1.0))
    centres = np.concatenate([above[None], means])
    bend = np.arccos(np.clip(np.sum(centres[1:] * centres[:-1], axis=1), -1.0, 1.0))
    return np.flatnonzero(bend + spread[1:] + spread[:-1] > SURELY_ON).tolist()


def adjusted_stations(
    examined: ExaminedHole | None,
    below: Sequence[SurveyStation],
    told: Direction,
    shared: SharedErrors,
    north: float,
    stops: ResolvedStops,
) -> AdjustedStations:
    """Stations of an adjusted hole; without a solution each stands for what its own surveys say.

    Parameters
    ----------
    below : stations below the collar, from the top down
    told : direction at the collar
    north : rad, standard deviation of the encoder's zero
    stops : of the stations
    """
    mds = [one.md for one in below]
    if examined is None:
        return AdjustedStations(told, mds, [*map(fused_alone, below)], told=told, below=below, stops=stops)
    found = directions_of(examined.examination, shared, north)
    moved = moved_stations(examined, below)
    return AdjustedStations(found[0], mds, found[1:], moved, examined.drawn, told, below, stops)


def fused_alone(station: SurveyStation) -> Direction:
    """What the surveys of a station say by themselves."""
    return station.fused(Weighting.BAYES)


def learnt_wander(found: Adjusted, curvature_length: float) -> tuple[LegWander, Array, tuple[CollarTie, ...]]:
    """How the path wanders between stations by the curvature that an adjustment has learnt, and each leg's share (s,).

    The last is how the direction at the collar goes with the first legs.

    Parameters
    ----------
    curvature_length : m, over which a curvature is forgotten
    """
    driven = found.now.leg_vars / found.now.curvature_var
    driven[:-1] = np.maximum(driven[:-1], driven[1:])  # what bends sharply may have begun above the station
    return LegWander(math.sqrt(found.now.curvature_var), curvature_length), driven, collar_ties(found)
