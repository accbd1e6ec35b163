"""Resets of single errors in the covariance, for both arithmetics: they compute nothing."""

from __future__ import annotations

from typing import Any, Final

from node.kernels.arithmetic.formats import Array
from node.kernels.arithmetic.jit import kernel
from node.kernels.record.filter_record import STATES

COARSE: Final = 4  # times its own variance, from where an aiding is worth less for its time than for itself


@kernel
def isolate_state(P: Array, state: int, variance: float) -> None:
    """Give one state the variance ``variance`` and no correlation with the others (a reset keeps no stale terms).

    It computes nothing, so it serves the integers too.
    """
    for j in range(STATES):
        P[state, j] = 0
        P[j, state] = 0
    P[state, state] = variance


@kernel
def set_apart(state: Any, error: int, variance: float) -> None:
    """Give one error of the filter the variance ``variance``, and no correlation with others or the last survey."""
    isolate_state(state.P, error, variance)
    state.surveyed_with[error] = 0
