"""Where the stations of an adjusted hole point, which of them moved, and which point back. No I/O."""

from __future__ import annotations

import math
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


@dataclass(frozen=True, slots=True)
class AdjustedStations:
    """Stations below the collar, as an adjustment has them.

    Parameters
    ----------
    collar : direction there
    directions : by depth (m), from the top down
    moved : where the hole moved
    found : the adjustment; None where the surveys have no solution in common
    told : direction at the collar as it was told
    below : stations below it, from the top down
    stops : theirs
    """

    collar: Direction
    directions: dict[float, Direction] = field(default_factory=dict)
    moved: list[Moved] = field(default_factory=list)
    found: Adjusted | None = None
    told: Direction | None = None
    below: Sequence[SurveyStation] = ()
    stops: ResolvedStops | None = None

    def turned_back(self) -> list[float]:
        """Depths (m) of stations whose surveys point back against those of the one above."""
        grown = [station for station in self.below if station.lacks_newest]
        if grown and self.stops is not None:
            SurveyStation.fuse_together(grown, self.stops)
        above = self.collar if self.told is None else self.told
        tangents = tangents_of([above, *map(fused_alone, self.below)])
        back = np.flatnonzero((tangents[:-1] * tangents[1:]).sum(axis=1) < TURNED_BACK)
        return [self.below[place].md for place in back.tolist()]


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
        alone = dict(zip(mds, map(fused_alone, below), strict=True))
        return AdjustedStations(told, alone, told=told, below=below, stops=stops)
    collar, *found = directions_of(examined.examination, shared, north)
    moved = moved_stations(examined, below)
    return AdjustedStations(collar, dict(zip(mds, found, strict=True)), moved, examined.drawn, told, below, stops)


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
