"""What an adjustment takes: looks of tubes at stations, and what is known of string, collar and path before them.

Frame: north, east, down; a tube's own frame has x and y across it and z downhole. SI and radians.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Places = npt.NDArray[np.intp]
BIAS, TILT, TURN = slice(0, 3), slice(3, 5), 5  # of the unknowns of a tube
OF_TUBE = 6  # unknowns of a tube: bias (3) m/s^2, tilt of its mount about x and y (2) rad, turn about z rad


@dataclass(frozen=True, slots=True)
class Looks:
    """Readings of tubes at rest, one row each.

    Parameters
    ----------
    station : (n,) place of the station in the order of depth, from 1; 0 is the collar, which no tube reads
    tube : (n,) place of the tube among those of the string
    make_up : (n,) which of the ways it was that the string was made up: a tube that is added on top turns all others
    stop : (n,) number of the stop of the string, which grows with time
    force : (n, 3) m/s^2, mean specific force in the tube's frame
    force_var : (n,) (m/s^2)^2, of each axis of the mean
    yaw, yaw_var : (n,) rad and rad^2, random part alone
    """

    station: Places
    tube: Places
    make_up: Places
    stop: Places
    force: Array
    force_var: Array
    yaw: Array
    yaw_var: Array

    def __len__(self) -> int:
        return len(self.station)

    def part(self, rows: Places) -> Looks:
        """Some of them, by their rows."""
        return Looks(*(getattr(self, one.name)[rows] for one in fields(self)))


@dataclass(frozen=True, slots=True)
class StringPrior:
    """What is known of the tubes before any look.

    Parameters
    ----------
    bias_std : (m,) m/s^2, of each axis of a tube's accelerometer
    tilt_std : (m,) rad, of its mount about x and y
    turn : (m + u,) rad, by which the yaw that a tube reports is larger than its own, as far as that is known: the sum
        of a turn of its tube and one of the make-up of the string, of which there were u
    turn_cov : (m + u, m + u) rad^2, of these: what joints, mounts and the encoder's zero have in common is in it
    gravity, gravity_std : m/s^2
    play_std : rad, of the tilt of a tube in the hole at one stop, before the looks tell it
    """

    bias_std: Array
    tilt_std: Array
    turn: Array
    turn_cov: Array
    gravity: float
    gravity_std: float
    play_std: float

    @property
    def count(self) -> int:
        """Number m of tubes."""
        return len(self.bias_std)

    @property
    def width(self) -> int:
        """Number of unknowns of tubes, gravity and make-ups."""
        return 5 * self.count + 1 + len(self.turn)


@dataclass(frozen=True, slots=True)
class PathPrior:
    """What is known of the hole before any look.

    Parameters
    ----------
    md : (s + 1,) m, of the collar and every station, growing
    collar : (3,) unit vector down the hole at the collar
    collar_cov : (3, 3) rad^2, of it; none along it
    curvature_std, correlation_length : rad/m and m, of the curvature that wanders; the former until the looks tell it
    leg_length_var : (s,) m^2, of the length of each leg; None where lengths are exact
    """

    md: Array
    collar: Array
    collar_cov: Array
    curvature_std: float
    correlation_length: float
    leg_length_var: Array | None = None


@dataclass(frozen=True, slots=True)
class FurtherEffects:
    """Effects that are unknown beside the usual ones, such as a bias that stepped: one column each.

    Parameters
    ----------
    columns : (n, 3, e) m/s^2, change of the force of every look for one unit of each
    std : (e,) of each before the looks
    """

    columns: Array
    std: Array


@dataclass(frozen=True, slots=True)
class StartingPoint:
    """Where an iteration begins: what an earlier adjustment of nearly the same looks came to.

    Parameters
    ----------
    tangents, curvatures, tubes, make_ups, gravity, extra : the unknowns
    play_var, curvature_var, leg_vars : how far tubes lie askew, and how the hole bends, as the looks have told it
    is_learnt : these are learnt of so many looks that a few more do not change them, and stay as they are
    """

    tangents: Array  # (s + 1, 3)
    curvatures: Array  # (s + 1, 2) rad/m
    tubes: Array  # (m, 6)
    make_ups: Array  # (u,) rad
    gravity: float
    play_var: float
    curvature_var: float  # rad^2/m^2, of the hole
    leg_vars: Array  # (s,) rad^2/m^2, by which each leg is driven
    extra: Array = field(default_factory=lambda: np.zeros(0))
    is_learnt: bool = False
