"""What an adjustment tells of the accelerometer of each tube, as a bias that a parameter block can take off.

The tilt of a mount and a bias across the tube look alike in a hole that hardly bends: only their sum is known well. It
is that sum where the tube has been, as a bias.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from groundstation.survey.adjustment.adjusted import Adjusted
from groundstation.survey.adjustment.looks import OF_TUBE, TILT

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class ForceBias:
    """Bias (3,) m/s^2 of one tube's accelerometer with its covariance (3, 3), and what it is from.

    ``residual_rms`` (m/s^2) is what the adjustment leaves of the tube's forces, ``digest`` of its looks.
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


def bias_of_tube(adjusted: Adjusted, place: int) -> ForceBias:
    """Bias of the tube at a place of the string."""
    own = adjusted.looks.tube == place
    forces = adjusted.looks.force[own]
    x, y, z = forces.mean(axis=0).tolist()
    as_bias = np.zeros((3, TILT.stop))
    as_bias[:, :3] = np.eye(3)
    as_bias[:, TILT] = [[0.0, z], [-z, 0.0], [y, -x]]  # what a tilt about x and about y turns the force into
    places = OF_TUBE * place + np.arange(TILT.stop)
    cov = as_bias @ adjusted.common_cov[np.ix_(places, places)] @ as_bias.T
    residual_rms = float(np.sqrt(np.mean(np.square(adjusted.left[own]))))
    digest = hashlib.sha256(forces.tobytes() + adjusted.looks.yaw[own].tobytes()).hexdigest()
    return ForceBias(as_bias @ adjusted.now.tubes[place, : TILT.stop], cov, int(own.sum()), residual_rms, digest)
