"""Readings of several IMUs in one tube as one reading."""

from __future__ import annotations

from node.kernels.jit import kernel
from node.kernels.layout import Array


@kernel
def fuse(readings: Array, weights: Array, fused: Array) -> None:
    """Inverse-variance mean sum w_i x_i / sum w_i into ``fused`` (k). Source: thesis eq. 3.42.

    Parameters
    ----------
    readings : (n, k), one row an IMU
    weights : (n,) inverse variances; a reading of weight 0 may be anything, numbers or none
    """
    total = 0.0
    for j in range(fused.shape[0]):
        fused[j] = 0.0
    for i in range(weights.shape[0]):
        if weights[i] > 0.0:
            total += weights[i]
            for j in range(fused.shape[0]):
                fused[j] += weights[i] * readings[i, j]
    for j in range(fused.shape[0]):
        fused[j] /= total


@kernel
def follow_offsets(rates: Array, fused: Array, samples: int, offsets: Array) -> None:
    """Running means over ``samples`` cycles at rest of what each gyroscope reads beside the ``fused`` rate (3, rad/s).

    d_n = d_(n-1) + (w - w_fused - d_(n-1)) / n; ``rates`` and ``offsets`` are (n, 3), rad/s.
    """
    for i in range(rates.shape[0]):
        for j in range(3):
            offsets[i, j] += (rates[i, j] - fused[j] - offsets[i, j]) / samples
