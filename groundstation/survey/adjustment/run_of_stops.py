"""What blame, reliability and budget ask of a string beside its looks: stops in time and depth, and what turns tubes.

Frame and units as in ``looks``: SI and radians.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from groundstation.survey.adjustment.looks import Looks

Array = npt.NDArray[np.float64]
Places = npt.NDArray[np.intp]
JOINT, MOUNT, NORTH = "joint", "mount", "north"


@dataclass(frozen=True, slots=True)
class TurnCauses:
    """Why the yaw that a tube reports is larger than its own: independent causes, of which turns are made.

    Parameters
    ----------
    names : (c,) kind and subject of each: ("joint", tube below it), ("mount", tube), ("north", -1), or others
    of_tubes, of_make_ups : (c, m) and (c, u), change of the turn of every tube and every make-up for one radian of each
    stds : (c,) rad, of each before the looks
    """

    names: tuple[tuple[str, int], ...]
    of_tubes: Array
    of_make_ups: Array
    stds: Array

    @property
    def cov(self) -> Array:
        """Covariance (m + u, m + u) of the turns, rad^2: ``StringPrior.turn_cov`` but for what has no name."""
        columns = np.concatenate([self.of_tubes, self.of_make_ups], axis=1).T * self.stds
        return np.asarray(columns @ columns.T)

    def turned_looks(self, looks: Looks) -> Array:
        """Change (c, n) of the yaw that each look reports for one radian of each."""
        return np.asarray(self.of_tubes[:, looks.tube] + self.of_make_ups[:, looks.make_up])

    def turned_by(self, places: Places, looks: Looks) -> Array:
        """The same (h, n) of some of them."""
        return np.asarray(self.of_tubes[places][:, looks.tube] + self.of_make_ups[places][:, looks.make_up])


@dataclass(frozen=True, slots=True)
class RunOfStops:
    """How a string was run.

    Parameters
    ----------
    md, time : (k,) m and s, depth of the bit and time of every stop by its number
    station_md : (s + 1,) m, of collar and stations, as ``PathPrior`` has them
    causes : of the turns of its tubes
    """

    md: Array
    time: Array
    station_md: Array
    causes: TurnCauses
