"""The yaw at the last survey, as it is known by all that has come since: a fixed-point smoother.

A survey is taken with the yaw of its moment. What comes later tells of that moment too: an aiding that was missing
while the string came to rest, and the innovations of the turning after it, which measure the rest through the
gyroscope's increments. The yaw then is a state without motion or noise of its own, so all that has to be carried along
is its variance and its covariance with the states of the filter. A reset leaves no covariance, and the yaw as it was.
Source: Gelb (ed.), Applied Optimal Estimation, 1974, section 5.3; Anderson and Moore, Optimal Filtering, 1979, 7.2.
"""

from __future__ import annotations

import math
from typing import Any

from node.kernels.arithmetic.angles import advance_binary
from node.kernels.arithmetic.jit import kernel, kernel_constant
from node.kernels.record.filter_record import STATES, Err

TX, TY, PSI = kernel_constant(Err.TILT_X), kernel_constant(Err.TILT_Y), kernel_constant(Err.YAW)
BX, BY, BZ, S = (
    kernel_constant(Err.BIAS_X),
    kernel_constant(Err.BIAS_Y),
    kernel_constant(Err.BIAS_Z),
    kernel_constant(Err.SCALE),
)


@kernel
def begin_smoothing(state: Any) -> None:
    """Keep the yaw of the survey that is taken now. It computes nothing, so it serves the integers too."""
    state.smoothing = state.yaw_known
    state.surveyed_yaw = state.yaw
    state.surveyed_var = state.P[PSI, PSI]
    for j in range(STATES):
        state.surveyed_with[j] = state.P[PSI, j]


@kernel
def propagate_survey_covariance(state: Any, wz: float, dt: float, turning: float, config: Any) -> None:
    """Covariance with the states over ``dt`` (s) at the spin ``wz`` (rad/s), as ``propagation.propagate``: c F^T."""
    along = state.surveyed_with
    c, s = math.cos(wz * dt * turning), math.sin(wz * dt * turning)
    step = dt * turning
    tx, ty = along[TX], along[TY]
    along[TX] = c * tx + s * ty - step * along[BX]
    along[TY] = -s * tx + c * ty - step * along[BY]
    along[PSI] -= step * (along[BZ] + wz * along[S])
    for k in range(3):
        along[BX + k] *= math.exp(-dt / config.bias_tau[k])


@kernel
def look_back(state: Any, s: float, residual: float) -> None:
    """Update with an innovation ``residual`` of the variance ``s``, whose H and P H^T are in the record.

    K = c H^T / S, c+ = c - K (P H^T)^T, var+ = var - K H c^T.
    """
    along, h, ph = state.surveyed_with, state.h, state.ph
    shared = 0.0
    for j in range(STATES):
        shared += along[j] * h[j]
    gain = shared / s
    for j in range(STATES):
        along[j] -= gain * ph[j]
    state.surveyed_var -= gain * shared
    state.surveyed_yaw = advance_binary(state.surveyed_yaw, gain * residual)
