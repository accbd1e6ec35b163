"""What blame, reliability and budget ask of a string beside its looks: stops in time and depth, and what turns tubes.

Frame and units as in ``looks``: SI and radians.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
JOINT, MOUNT, NORTH = "joint", "mount", "north"


@dataclass(frozen=True, slots=True)
class TurnCauses:
    """Why the yaw that a tube reports is larger than its own: independent causes, of which turns are made.

    Parameters
    ----------
    names : (c,) kind and subject of each: ("joint", tube below it), ("mount", tube), ("north", -1), or others
    patterns : (c, m) change of the turn of every tube for one radian of each
    stds : (c,) rad, of each before the looks
    """

    names: tuple[tuple[str, int], ...]
    patterns: Array
    stds: Array

    @property
    def cov(self) -> Array:
        """Covariance (m, m) of the turns, rad^2, as ``StringPrior.turn_cov`` takes it."""
        columns = self.patterns.T * self.stds
        return np.asarray(columns @ columns.T)


@dataclass(frozen=True, slots=True)
class StringRun:
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


def chain_causes(from_top: list[int], joint_std: float, mount_std: float, north_std: float) -> TurnCauses:
    """Causes of a plain chain: each joint turns the tube below it and all further down, each mount its tube, north all.

    Parameters
    ----------
    from_top : tubes by their places in the string, from the top down; no joint is above the first
    joint_std, mount_std, north_std : rad
    """
    count = len(from_top)
    below = np.zeros((count, count))
    for place, tube in enumerate(from_top):
        below[tube, from_top[place:]] = 1.0
    joints = [(JOINT, tube) for tube in from_top[1:]]
    mounts = [(MOUNT, tube) for tube in range(count)]
    patterns = np.concatenate([below[[tube for _, tube in joints]], np.eye(count), np.ones((1, count))])
    stds = np.array([joint_std] * (count - 1) + [mount_std] * count + [north_std])
    return TurnCauses((*joints, *mounts, (NORTH, -1)), patterns, stds)
