"""Errors that readings share: the accelerometer biases and the mount of a tube, the marks of a joint.

A tube keeps its IMU and a closed joint its reading, so two readings err alike as far as they have these in common.
Each such error is one column; a reading's column is the change of its lean for one standard deviation. Whatever is
linear in the readings (a fused station, a position) carries the same columns, and its covariance is their product with
themselves.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from groundstation.survey.resolve import Direction, Resolved

Array = npt.NDArray[np.float64]
Name = tuple[str | int, ...]
KINDS = {"mount": "mounts", "joint": "joints", "drive": "joints", "string": "joints", "bias": "accelerometer_bias"}


class SharedErrors:
    """The columns, in the order in which they were met."""

    def __init__(self) -> None:
        self._columns: dict[Name, int] = {}
        self._places: dict[str, list[int]] = {}  # of the columns of each kind, in the order of their coming

    def __len__(self) -> int:
        return len(self._columns)

    def reading(
        self,
        resolved: Resolved,
        tube: int,
        above: Sequence[int] | None,
        systematic_var: float,
        mount_var: float,
        force_bias_std: float,
    ) -> Direction:
        """Direction of a reading with its columns.

        Parameters
        ----------
        resolved : the stop
        tube : whose node read
        above : tubes above it, lowest first; None when the order of the string is not known
        systematic_var, mount_var : rad^2, of the yaw: all constant errors, and the part of the tube's own mount
        force_bias_std : m/s^2, of each axis of the accelerometer, left after calibration
        """
        mount_var = min(mount_var, systematic_var)
        chain = self._chain(tube, above)
        columns: list[tuple[Name, Array]] = [(("mount", tube), math.sqrt(mount_var) * resolved.by_yaw)]
        each = math.sqrt((systematic_var - mount_var) / len(chain))
        columns.extend((joint, each * resolved.by_yaw) for joint in chain)
        columns.extend((("bias", tube, axis), force_bias_std * resolved.by_force[:, axis]) for axis in range(3))
        indices = [self._place_of(name) for name, _ in columns]
        shared = np.zeros((2, len(self._columns)))
        for index, (_, column) in zip(indices, columns, strict=True):
            shared[:, index] = column
        return resolved.sharing(shared)

    def by_kind(self, columns: Array) -> dict[str, Array]:
        """Covariance (k, k) of something linear in the readings, by kind of shared error; ``columns`` (k, s)."""
        width = columns.shape[1]
        parts = {kind: columns[:, at[: bisect_left(at, width)]] for kind, at in self._places.items() if at[0] < width}
        return {kind: part @ part.T for kind, part in parts.items()}

    def _place_of(self, name: Name) -> int:
        """Place of an error's column, the next one where it is met for the first time."""
        if name not in self._columns:
            self._columns[name] = len(self._columns)
            self._places.setdefault(KINDS[str(name[0])], []).append(self._columns[name])
        return self._columns[name]

    @staticmethod
    def _chain(tube: int, above: Sequence[int] | None) -> list[Name]:
        """Joints between the drive head and a tube. A node reports the sum of their variances, not its parts."""
        if above is None:
            return [("string",)]
        names = [tube, *above]
        inner: list[Name] = [("joint", upper, lower) for lower, upper in pairwise(names)]
        return [*inner, ("drive", names[-1])]


def widened(shared: Array, columns: int) -> Array:
    """The same columns with zeros for those met later: (k, columns)."""
    missing = columns - shared.shape[1]
    return shared if missing == 0 else np.concatenate([shared, np.zeros((shared.shape[0], missing))], axis=1)


def added(one: Array, other: Array) -> Array:
    """Sum of two sets of columns of different width."""
    columns = max(one.shape[1], other.shape[1])
    return widened(one, columns) + widened(other, columns)
