"""The moving average of a stop: mean specific force of the last samples and the covariance of that mean."""

from __future__ import annotations

from typing import Any

from node.kernels.arithmetic.jit import kernel
from node.kernels.arithmetic.operations import bounded_deviation, mean_of_total
from node.kernels.record.filter_record import RING


@kernel
def average_force(state: Any, samples: int) -> None:
    """Mean (3, m/s^2) of the newest ``samples`` (at most ``RING``) and its covariance (3, 3), into the survey fields.

    C = sum (f - m)(f - m)^T / (n (n - 1)). Source: thesis 4.1 (32-point moving average).
    """
    middle, cov = state.survey_force, state.survey_force_cov
    for i in range(3):
        middle[i] = 0
        for k in range(samples):
            middle[i] += state.ring_force[(state.cycles - 1 - k) % RING, i]
        middle[i] = mean_of_total(middle[i], samples)
    for i in range(3):
        for j in range(i, 3):
            total: float = 0
            for k in range(samples):
                slot = (state.cycles - 1 - k) % RING
                total += bounded_deviation(state.ring_force[slot, i] - middle[i]) * bounded_deviation(
                    state.ring_force[slot, j] - middle[j]
                )
            cov[i, j] = mean_of_total(total, samples * (samples - 1))
            cov[j, i] = cov[i, j]
