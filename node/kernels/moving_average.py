"""The moving average of a stop: mean specific force of the last samples and the covariance of that mean."""

from __future__ import annotations

from typing import Any

from node.kernels.jit import kernel
from node.kernels.layout import RING


@kernel
def average_force(state: Any, samples: int) -> None:
    """Mean (3, m/s^2) of the newest ``samples`` (at most ``RING``) and its covariance (3, 3), into the survey fields.

    C = sum (f - m)(f - m)^T / (n (n - 1)). Source: thesis 4.1 (32-point moving average).
    """
    mean, cov = state.survey_force, state.survey_force_cov
    for i in range(3):
        mean[i] = 0.0
        for k in range(samples):
            mean[i] += state.ring_force[(state.cycles - 1 - k) % RING, i]
        mean[i] /= samples
    for i in range(3):
        for j in range(i, 3):
            total = 0.0
            for k in range(samples):
                slot = (state.cycles - 1 - k) % RING
                total += (state.ring_force[slot, i] - mean[i]) * (state.ring_force[slot, j] - mean[j])
            cov[i, j] = total / (samples * (samples - 1.0))
            cov[j, i] = cov[i, j]
