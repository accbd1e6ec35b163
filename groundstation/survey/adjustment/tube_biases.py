"""What an adjustment tells of the accelerometer of each tube, as one bias.

The tilt of a mount and a bias across the tube look alike in a hole that hardly bends: only their sum is known well. It
is that sum where the tube has been, as a bias.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from groundstation.survey.adjustment.adjusted import Adjusted
from groundstation.survey.adjustment.looks import OF_TUBE, TILT

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class AdjustedBias:
    """Bias (3,) m/s^2 of one tube's accelerometer with its covariance (3, 3), and of how many looks."""

    bias: Array
    cov: Array
    looks: int


def bias_of_tube(adjusted: Adjusted, place: int) -> AdjustedBias:
    """Bias of the tube at a place of the string."""
    forces, counts = adjusted.forces_of_tubes
    x, y, z = forces[place].tolist()
    # a bias as it is, and what a tilt about x and about y turns the force into
    as_bias = np.array([[1.0, 0.0, 0.0, 0.0, z], [0.0, 1.0, 0.0, -z, 0.0], [0.0, 0.0, 1.0, y, -x]])
    at = slice(OF_TUBE * place, OF_TUBE * place + TILT.stop)
    cov = as_bias @ adjusted.common_cov[at, at] @ as_bias.T
    return AdjustedBias(as_bias @ adjusted.now.tubes[place, : TILT.stop], cov, int(counts[place]))
