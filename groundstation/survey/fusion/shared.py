"""Errors that readings share: the accelerometer biases and the mount of a tube, the marks of a joint.

A tube keeps its IMU and a closed joint its reading, so two readings err alike as far as they have these in common.
Each such error is one column; a reading's column is the change of its unit vector for one standard deviation. Whatever
is linear in the readings (a fused station, a position) carries the same columns, and its covariance is their product
with themselves.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from groundstation.survey.fusion.packed import Packed
from groundstation.survey.fusion.resolve import Direction, Resolved
from groundstation.survey.fusion.sphere_direction import SphereDirection

Array = npt.NDArray[np.float64]
Places = npt.NDArray[np.intp]
Name = tuple[str | int, ...]
AXES = 3  # of an accelerometer
CAUSES = 2 + AXES  # of the columns of a reading: mount, joint, and each axis
KINDS = {
    "mount": "mounts", "joint": "joints", "drive": "joints", "string": "joints", "bias": "accelerometer_bias",
    "scale": "depth", "offset": "depth", "length": "depth",
}  # fmt: skip
KIND_NAMES = sorted(set(KINDS.values()))
TRANSPORT, ADJUSTED = "transport", "adjusted"  # of columns that random errors share; they are of no kind


def put_columns(columns: Array, causes: Array, places: Places) -> None:
    """Write the columns of a reading into zeros (3, s): mount, every joint alike, and axes, from ``causes`` (3, 5)."""
    columns[:, places[0]] = causes[:, 0]
    columns[:, places[1:-AXES]] = causes[:, 1:2]
    columns[:, places[-AXES:]] = causes[:, -AXES:]


def columns_of(causes: Array, places: Sequence[Places], width: int) -> Array:
    """Columns (n, k, width) of several readings, from (n, k, 5) and the places of each."""
    columns = np.zeros((len(causes), causes.shape[1], width))
    counts = np.array([*map(len, places)])
    ends = counts.cumsum()
    cause = np.ones(ends[-1], np.intp)  # of a place: every joint alike
    cause[ends - counts] = 0
    for axis in range(AXES):
        cause[ends - AXES + axis] = CAUSES - AXES + axis
    reading = np.repeat(np.arange(len(causes)), counts)
    columns[reading, :, np.concatenate(places)] = causes[reading, :, cause]
    return columns


class SharedErrors:
    """The columns, in the order in which they were met."""

    def __init__(self) -> None:
        self._columns: dict[Name, int] = {}
        self._places: dict[str, list[int]] = {}  # of the columns of each kind, in the order of their coming
        self._known: dict[Name | int, Places] = {}  # by a tube and those above it, or a tube alone; of depths too
        self._transport: list[int] = []
        self._adjusted: list[int] = []
        self._chains: dict[tuple[int, ...] | int, int] = {}
        self._strings: list[tuple[int, ...] | int] = []  # the same by their numbers

    @property
    def count(self) -> int:
        """Errors met so far."""
        return len(self._columns)

    def direction_of(
        self,
        resolved: Resolved,
        tube: int,
        above: Sequence[int] | None,
        systematic_var: float,
        mount_var: float,
        force_bias_std: float,
    ) -> SphereDirection:
        """Direction of one stop with its columns, parameters as ``causes_of``."""
        causes, places = self.causes_of(resolved, tube, above, systematic_var, mount_var, force_bias_std)
        columns = np.zeros((3, len(self._columns)))
        put_columns(columns, causes, places)
        yaw_vars = float(resolved.yaw_var), float(systematic_var)
        return SphereDirection(resolved.tangent, resolved.cov, Packed(columns), yaw_vars)

    def causes_of(
        self,
        resolved: Resolved,
        tube: int,
        above: Sequence[int] | None,
        systematic_var: float,
        mount_var: float,
        force_bias_std: float,
    ) -> tuple[Array, Places]:
        """What one stop shares (3, 5), and at which places its columns stand.

        Parameters
        ----------
        resolved : the stop
        tube : whose node read
        above : tubes above it, lowest first; None when the order of the string is not known
        systematic_var, mount_var : rad^2, of the yaw: all constant errors, and the part of the tube's own mount
        force_bias_std : m/s^2, of each axis of the accelerometer, left after calibration
        """
        places = self.places_of(tube, above)
        by_yaw, by_force = resolved.by_yaw[None], resolved.by_force[None]
        return causes_of_all(by_yaw, by_force, [places], np.array([systematic_var]), mount_var, force_bias_std)[
            0
        ], places

    def variances(self, columns: Array) -> Array:
        """Variances (n, kinds, k) of what has these columns (n, k, s), by kind in the order of ``KIND_NAMES``."""
        members = np.zeros((columns.shape[-1], len(KIND_NAMES)))
        for number, name in enumerate(KIND_NAMES):
            places = np.array(self._places.get(name, ()), np.intp)
            members[places[places < len(members)], number] = 1.0
        return np.asarray(members.T @ np.swapaxes(columns**2, -1, -2))

    def transport_places(self, count: int) -> list[int]:
        """Places of so many columns of the transport in a bent hole, see ``groundstation.survey.fusion.transport``."""
        while len(self._transport) < count:
            self._transport.append(self._place_of((TRANSPORT, len(self._transport))))
        return self._transport[:count]

    def places_of(self, tube: int, above: Sequence[int] | None) -> Places:
        """Places of the errors of a tube, kept once for all of its readings in one string."""
        string: Name | int = tube if above is None else (tube, *above)
        known = self._known.get(string)
        if known is None:
            chain = self._chain(tube, above)
            names: list[Name] = [("mount", tube), *chain, *(("bias", tube, axis) for axis in range(AXES))]
            known = self._known[string] = np.array([self._place_of(name) for name in names], np.intp)
        return known

    def depth_places_of(self, below: Sequence[int]) -> Places:
        """Places of the errors of a depth: scale, offset, and the length of each tube ``below`` from the bit up."""
        key: Name = ("depth", *below)
        known = self._known.get(key)
        if known is None:
            names: list[Name] = [("scale",), ("offset",), *(("length", tube) for tube in below)]
            known = self._known[key] = np.array([self._place_of(name) for name in names], np.intp)
        return known

    def places_of_lengths(self, tubes: Iterable[int]) -> dict[int, int]:
        """Place of the error of the length of each of some tubes, by tube, where a node above it has read."""
        names = ((tube, ("length", tube)) for tube in tubes)
        return {tube: self._columns[name] for tube, name in names if name in self._columns}

    def chain_of(self, tube: int, above: Sequence[int] | None) -> int:
        """Number of a tube with the joints above it, in the order in which they were met."""
        string = tube if above is None else (tube, *above)
        number = self._chains.setdefault(string, len(self._chains))
        if number == len(self._strings):
            self._strings.append(string)
        return number

    def chain(self, number: int) -> tuple[int, tuple[int, ...] | None]:
        """Tube of a chain, and the tubes above it, lowest first; None where their order was not known."""
        string = self._strings[number]
        return (string, None) if isinstance(string, int) else (string[0], string[1:])

    def adjusted_places(self, count: int) -> Places:
        """Places of so many columns of an adjustment, whose errors are of no kind."""
        while len(self._adjusted) < count:
            self._adjusted.append(self._place_of((ADJUSTED, len(self._adjusted))))
        return np.array(self._adjusted[:count], np.intp)

    def _place_of(self, name: Name) -> int:
        """Place of the column of an error, the next one where it is met for the first time."""
        if name not in self._columns:
            self._columns[name] = len(self._columns)
            if (kind := KINDS.get(str(name[0]))) is not None:
                self._places.setdefault(kind, []).append(self._columns[name])
        return self._columns[name]

    @staticmethod
    def _chain(tube: int, above: Sequence[int] | None) -> list[Name]:
        """Joints between the drive head and a tube. A node reports the sum of their variances, not its parts."""
        if above is None:
            return [("string",)]
        names = [tube, *above]
        inner: list[Name] = [("joint", upper, lower) for lower, upper in pairwise(names)]
        return [*inner, ("drive", names[-1])]


def stack_shared_errors(directions: Sequence[Direction], width: int) -> Array:
    """Columns (n, 2, width) of directions, with zeros for those that one does not know."""
    columns = np.zeros((len(directions), 2, width))
    for own, direction in zip(columns, directions, strict=True):
        direction.fill(own)
    return columns


def causes_of_all(
    by_yaw: Array, by_force: Array, places: Sequence[Places], systematic_var: Array, mount_var: float, bias_std: float
) -> Array:
    """What stops share (n, 3, 5): mount, joints and the three axes, each as it acts on the unit vector.

    Parameters
    ----------
    by_yaw, by_force : (n, 3) and (n, 3, 3) change of the unit vector for one rad, and one m/s^2
    places : of the columns of each stop
    systematic_var, mount_var : (n,) and one, rad^2, see ``SharedErrors.causes_of``
    bias_std : m/s^2, of each axis of an accelerometer
    """
    mount = np.minimum(mount_var, systematic_var)
    joints = np.array([*map(len, places)]) - 1 - AXES
    causes = np.empty((len(places), 3, CAUSES))
    causes[:, :, 0] = np.sqrt(mount)[:, None] * by_yaw
    causes[:, :, 1] = np.sqrt((systematic_var - mount) / joints)[:, None] * by_yaw
    causes[:, :, 2:] = bias_std * by_force
    return causes


def widen_shared_errors(shared: Array, columns: int) -> Array:
    """Return the columns (k, s) with zeros for the errors met later: (k, columns)."""
    missing = columns - shared.shape[1]
    return shared if missing == 0 else np.concatenate([shared, np.zeros((shared.shape[0], missing))], axis=1)


def add_shared_errors(one: Array, other: Array) -> Array:
    """Sum of two sets of columns of different width."""
    columns = max(one.shape[1], other.shape[1])
    return widen_shared_errors(one, columns) + widen_shared_errors(other, columns)
