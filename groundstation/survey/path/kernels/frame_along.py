"""A frame of two axes carried along a hole by the shortest turns, and the directions that it sees."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from node.kernels.arithmetic.jit import kernel

Array = npt.NDArray[np.float64]
OPPOSITE = 1e-9  # of 1 + cosine, below which two directions have no shortest turn


@kernel
def see_covariance(axes: Array, cov: Array, out: Array) -> None:
    """Covariance (3, 3) of a direction on two axes (2, 3): ``out`` (2, 2), set."""
    for i in range(2):
        for j in range(2):
            total = 0.0
            for k in range(3):
                for m in range(3):
                    total += axes[i, k] * cov[k, m] * axes[j, m]
            out[i, j] = total


@kernel
def carry_axes(axes: Array, upper: Array, lower: Array, cosine: float) -> None:
    """Turn two axes (2, 3) as a direction turns by the shortest way from ``upper`` to ``lower`` (3,)."""
    for i in range(2):
        along = axes[i, 0] * lower[0] + axes[i, 1] * lower[1] + axes[i, 2] * lower[2]
        for k in range(3):
            axes[i, k] -= along / (1.0 + cosine) * (upper[k] + lower[k])


@kernel
def roll_out(tangents: Array, covs: Array, axes: Array, angles: Array, across: Array) -> bool:
    """Roll out the directions of a hole; False where it turns back on itself.

    Parameters
    ----------
    tangents, covs : (n, 3) and (n, 3, 3), unit vectors down the hole and their covariance
    axes : (2, 3), across the first of them; left across the last
    angles, across : (n, 2) rad, of which the first is given, and (n, 2, 2) rad^2, set
    """
    see_covariance(axes, covs[0], across[0])
    for k in range(len(tangents) - 1):
        upper, lower = tangents[k], tangents[k + 1]
        cosine = upper[0] * lower[0] + upper[1] * lower[1] + upper[2] * lower[2]
        if not cosine > OPPOSITE - 1.0:
            return False
        first = axes[0, 0] * lower[0] + axes[0, 1] * lower[1] + axes[0, 2] * lower[2]
        second = axes[1, 0] * lower[0] + axes[1, 1] * lower[1] + axes[1, 2] * lower[2]
        sine = math.hypot(first, second)
        share = math.atan2(sine, cosine) / sine if sine > 0.0 else 1.0
        angles[k + 1, 0], angles[k + 1, 1] = angles[k, 0] + share * first, angles[k, 1] + share * second
        carry_axes(axes, upper, lower, cosine)
        see_covariance(axes, covs[k + 1], across[k + 1])
    return True


def warm_up() -> None:
    """Compile it or load it from the cache."""
    still = np.tile([0.0, 0.0, 1.0], (2, 1))
    roll_out(still, np.zeros((2, 3, 3)), np.eye(3)[:2].copy(), np.zeros((2, 2)), np.empty((2, 2, 2)))
