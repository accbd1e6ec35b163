"""Errors of the last position of a hole that grows, kept by two running sums: of what stations share and what not.

The sums of ``error_model`` station by station: a station that another one follows counts with both of its legs from
then on, the last one with its upper leg alone,

    C_K = sum_{k<K} R_k + R*_K + (sum_{k<K} e_k + e*_K) (sum_{k<K} e_k + e*_K)^T

so appending costs the same however many stations there are. The ground station's trajectory is made of them and so is
the survey of a record by one instrument. Frame: north, east, down; m.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from groundstation.survey.shared import added

Array = npt.NDArray[np.float64]


class RunningSums:
    """Of the stations that lie behind: shared effects (3, s), one column an error, and random covariance (3, 3)."""

    def __init__(self) -> None:
        self._shared = np.zeros((3, 0))
        self._random = np.zeros((3, 3))

    def pass_station(self, shared: Array, random: Array) -> None:
        """Count a station with both of its legs: effects (3, s) of shared errors, covariance (3, 3) of its own."""
        self._shared, self._random = added(self._shared, shared), self._random + random

    def at_end(self, shared: Array, random: Array) -> tuple[Array, Array]:
        """Covariance (3, 3) and shared columns (3, s) of the position whose station counts with its upper leg."""
        columns = added(self._shared, shared)
        return self._random + random + columns @ columns.T, columns
