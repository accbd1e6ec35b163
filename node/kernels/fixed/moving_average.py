"""The moving average of a stop in integers: mean specific force and the covariance of that mean."""

from __future__ import annotations

from typing import Any

from node.kernels.jit import kernel
from node.kernels.layout import RING


@kernel
def average_force(state: Any, samples: int) -> None:
    """Mean (3, g, Q26) of the newest ``samples`` (at most ``RING``) and its covariance (3, 3, g^2, Q52).

    C = sum (f - m)(f - m)^T / (n (n - 1)), one product below 2^56 and so the sum of 64 below 2^62.
    """
    mean, cov = state.survey_force, state.survey_force_cov
    for i in range(3):
        total = samples >> 1
        for k in range(samples):
            total += state.ring_force[(state.cycles - 1 - k) & (RING - 1), i]
        mean[i] = total // samples
    for i in range(3):
        for j in range(i, 3):
            total = 0
            for k in range(samples):
                slot = (state.cycles - 1 - k) & (RING - 1)
                total += within(state.ring_force[slot, i] - mean[i]) * within(state.ring_force[slot, j] - mean[j])
            cov[i, j] = total // (samples * (samples - 1))
            cov[j, i] = cov[i, j]


@kernel
def within(deviation: int) -> int:
    """A deviation (g, Q26) held within 4 g."""
    return max(min(deviation, 1 << 28), -(1 << 28))
