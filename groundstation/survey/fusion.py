"""All clusters that were measured at one station, as one direction.

Recursive Bayes of independent readings is the sum of their information, so it takes any order and constant memory.
The constant error (joints, mount) is shared by the readings; it is carried as a sensitivity, weighted with the same
weights, and never averages away. Source: thesis eqs. 3.39-3.41.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from groundstation.survey.resolve import Lean

Array = npt.NDArray[np.float64]


@dataclass(slots=True)
class StationFusion:
    """Running fusion of one station."""

    count: int = 0
    _information: Array = field(default_factory=lambda: np.zeros((2, 2)))
    _weighted: Array = field(default_factory=lambda: np.zeros(2))
    _systematic: Array = field(default_factory=lambda: np.zeros(2))
    _down: float = 0.0

    def add(self, reading: Lean) -> None:
        """Take one more cluster."""
        information = np.linalg.inv(reading.cov)
        self._information = self._information + information
        self._weighted = self._weighted + information @ reading.lean
        self._systematic = self._systematic + information @ reading.systematic
        self._down += reading.down
        self.count += 1

    def fused(self) -> Lean:
        """Posterior: mean, covariance (2, 2) and systematic sensitivity (2,)."""
        cov = np.asarray(np.linalg.inv(self._information), np.float64)
        lean = cov @ self._weighted
        size = min(float(lean @ lean), 1.0)
        down = math.copysign(math.sqrt(1.0 - size), self._down)
        return Lean(lean, down, cov, cov @ self._systematic)
