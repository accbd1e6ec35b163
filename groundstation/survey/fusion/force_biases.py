"""Biases of the accelerometers of a string, from the tool faces at which its tubes read the same stations.

A bias turns with its tube, the hole does not: what tubes say of one station differs by their biases, each turned by its
yaw there. Stations are unknown altogether, biases by their prior, joints and mounts by what a reading says of them; all
of them are least squares in one. The size of a force adds what it has along the bias, as far as gravity is known.

With the same turn between any two stops a spiral of leans is the same record as one bias in every tube, each turned by
that much against the one above: what cannot be told apart so keeps the variance of the prior.
"""

from __future__ import annotations

import hashlib
from collections import defaultdict
from collections.abc import Hashable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from groundstation.survey.fusion.resolve import Direction, resolve_direction

Array = npt.NDArray[np.float64]
Places = npt.NDArray[np.intp]
AXES = 3
LEVEL = 2  # of north, east and down those that a lean has


@dataclass(frozen=True, slots=True)
class Look:
    """One tube at one station.

    Parameters
    ----------
    station : the same for all looks at one direction of the hole
    tube : whose accelerometer
    lean, cov : (2,) and (2, 2), as measured, and of its random errors
    by_force : (2, 3) change of the lean for one m/s^2 on each axis
    columns, places : (2, k) change for one standard deviation of joints and mounts, and which these are (k,)
    unit : (3,) direction of the force in the tube
    excess, excess_var : m/s^2 by which the force is larger than gravity, and (m/s^2)^2 of it
    """

    station: Hashable
    tube: int
    lean: Array
    cov: Array
    by_force: Array
    columns: Array
    places: Places
    unit: Array
    excess: float
    excess_var: float


@dataclass(frozen=True, slots=True)
class ForceBias:
    """Bias (3,) m/s^2 of one tube's accelerometer with its covariance (3, 3), and what it is from.

    ``residual_rms`` (m/s^2) is what the bias leaves of the sizes of the tube's forces, ``digest`` of its looks.
    """

    bias: Array
    cov: Array
    looks: int
    residual_rms: float
    digest: str


@dataclass(frozen=True, slots=True)
class SurveyedBiases:
    """Bias of every tube that has one, and why others have none."""

    found: dict[int, ForceBias]
    refused: dict[int, str]


def look_of(
    station: Hashable,
    tube: int,
    direction: Direction,
    shared: tuple[Array, Places],
    force: Array,
    var: float,
    yaw: float,
    gravity: float,
) -> Look:
    """Look of one stop.

    Parameters
    ----------
    station, tube, direction : of the tube at the station
    shared : causes (3, 5) and places, see ``SharedErrors.causes_of``
    force, var : (3,) m/s^2, mean specific force, and (m/s^2)^2 of each of its axes
    yaw : rad, with which it was resolved
    gravity : m/s^2, of the site
    """
    size = float(np.linalg.norm(force))
    causes, places = shared[0][:LEVEL], shared[1][:-AXES]
    columns = np.concatenate([causes[:, :1], np.repeat(causes[:, 1:2], len(places) - 1, axis=1)], axis=1)
    by_force = resolve_direction(force, var * np.eye(AXES), yaw, 0.0).by_force[:LEVEL]
    return Look(
        station, tube, direction.lean, direction.cov, by_force, columns, places, force / size, size - gravity, var
    )  # fmt: skip


class Normal:
    """Normal equations of errors of one standard deviation each."""

    def __init__(self, size: int) -> None:
        self.matrix, self.right = np.eye(size), np.zeros(size)

    def add(self, rows: Array, places: Places, weight: Array, value: Array) -> None:
        """Add observations ``value`` (m,) = ``rows`` (m, k) @ errors at ``places``, of weight ``weight`` (m, m)."""
        self.matrix[np.ix_(places, places)] += rows.T @ weight @ rows
        self.right[places] += rows.T @ weight @ value

    def take_out(self, weighed: Array, weight: Array, value: Array) -> None:
        """Eliminate an unknown (m,) of rows ``weighed`` (m, n), weight matrix (m, m) and right side ``value`` (m,)."""
        gain = np.linalg.solve(weight, weighed)
        self.matrix -= weighed.T @ gain
        self.right -= gain.T @ value


def solve_biases(looks: Sequence[Look], bias_std: float, gravity_std: float) -> dict[int, ForceBias]:
    """Return the accelerometer bias of every tube of the looks, by tube number.

    Parameters
    ----------
    bias_std : m/s^2, of each axis, before
    gravity_std : m/s^2, of the site's gravity
    """
    tubes = sorted({look.tube for look in looks})
    begin = max((int(look.places.max()) + 1 for look in looks if look.places.size), default=0)
    own = {tube: begin + AXES * k + np.arange(AXES) for k, tube in enumerate(tubes)}
    gravity = begin + AXES * len(tubes)
    normal = Normal(gravity + 1)
    stations: dict[Hashable, list[Look]] = defaultdict(list)
    for look in looks:
        stations[look.station].append(look)
        rows = np.array([[*(bias_std * look.unit), gravity_std]])
        places = np.append(own[look.tube], gravity)
        normal.add(rows, places, np.array([[1.0 / look.excess_var]]), np.array([look.excess]))
    for together in stations.values():
        _add_station(normal, together, own, bias_std)
    cov = np.asarray(np.linalg.inv(normal.matrix), np.float64)
    errors = cov @ normal.right
    off = gravity_std * float(errors[gravity])
    found = {}
    for tube, at in own.items():
        its = [look for look in looks if look.tube == tube]
        bias = bias_std * errors[at]
        left = [look.excess - off - float(look.unit @ bias) for look in its]
        digest = hashlib.sha256(b"".join(look.lean.tobytes() + look.unit.tobytes() for look in its)).hexdigest()
        residual_rms = float(np.sqrt(np.mean(np.square(left))))
        found[tube] = ForceBias(bias, np.asarray(bias_std**2 * cov[np.ix_(at, at)]), len(its), residual_rms, digest)
    return found


def _add_station(normal: Normal, looks: Sequence[Look], own: dict[int, Places], bias_std: float) -> None:
    """Looks at one direction, which is unknown."""
    weighed, weight, value = np.zeros((2, len(normal.right))), np.zeros((2, 2)), np.zeros(2)
    for look in looks:
        rows = np.concatenate([look.columns, bias_std * look.by_force], axis=1)
        places = np.concatenate([look.places, own[look.tube]])
        information = np.asarray(np.linalg.inv(look.cov), np.float64)
        normal.add(rows, places, information, look.lean)
        weighed[:, places] += information @ rows
        weight += information
        value += information @ look.lean
    normal.take_out(weighed, weight, value)
