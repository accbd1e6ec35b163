"""Scalar measurement updates in Joseph form. Source: thesis eqs. 3.26-3.28.

r = z - h(x), S = H P H^T + R, K = P H^T / S,  P+ = (I - K H) P (I - K H)^T + K R K^T.
For a scalar measurement the last line is P - K (P H^T)^T - (P H^T) K^T + K S K^T for whatever K: one pass over the
upper triangle, mirrored, so that P stays symmetric by construction.
"""

from __future__ import annotations

from typing import Any

from node.kernels.arithmetic.angles import advance_binary
from node.kernels.arithmetic.formats import Array
from node.kernels.arithmetic.jit import kernel, kernel_constant
from node.kernels.filter.smoothing import look_back
from node.kernels.record.filter_record import STATES, Err

TX, TY, PSI = kernel_constant(Err.TILT_X), kernel_constant(Err.TILT_Y), kernel_constant(Err.YAW)
BX, S, D = kernel_constant(Err.BIAS_X), kernel_constant(Err.SCALE), kernel_constant(Err.STAMP)


@kernel
def innovation_var(P: Array, h: Array, r_var: float, ph: Array) -> float:
    """S = H P H^T + R; leaves P H^T in ``ph`` (8)."""
    s = r_var
    for i in range(STATES):
        total = 0.0
        for j in range(STATES):
            total += P[i, j] * h[j]
        ph[i] = total
    for i in range(STATES):
        s += h[i] * ph[i]
    return s


@kernel
def joseph_update(P: Array, ph: Array, s: float, gain: Array) -> None:
    """Covariance after the update with K = P H^T / S; leaves K in ``gain`` (8)."""
    for i in range(STATES):
        gain[i] = ph[i] / s
    for i in range(STATES):
        for j in range(i, STATES):
            value = P[i, j] - gain[i] * ph[j] - ph[i] * gain[j] + gain[i] * s * gain[j]
            P[i, j] = value
            P[j, i] = value


@kernel
def intersect_covariance(P: Array, h: Array, r_var: float, ph: Array) -> float:
    """Covariance intersection with a scalar measurement: the weight w of the node's own estimate, at most 1.

    P becomes P / w, R is to become R / (1 - w), whatever the correlation of the two. The w with the least determinant
    of the covariance afterwards is (n - 1) HPH' / (n (HPH' - R)); at 1 the measurement has nothing to give.
    Source: Julier and Uhlmann, "A non-divergent estimation algorithm in the presence of unknown correlations", 1997.
    """
    own = innovation_var(P, h, 0.0, ph)
    if own <= STATES * r_var:
        return 1.0
    weight = (STATES - 1) * own / (STATES * (own - r_var))
    for i in range(STATES):
        for j in range(STATES):
            P[i, j] /= weight
    return float(weight)


@kernel
def feed_back(state: Any, residual: float) -> None:
    """Closed loop: add K r to the estimates. ``state`` is the node's record, its ``gain`` is K."""
    ex, ey = state.gain[TX] * residual, state.gain[TY] * residual
    ux, uy, uz = state.down[0], state.down[1], state.down[2]
    state.down[0] = ux - uz * ey
    state.down[1] = uy + uz * ex
    state.down[2] = uz + ux * ey - uy * ex
    norm = (state.down[0] ** 2 + state.down[1] ** 2 + state.down[2] ** 2) ** 0.5
    for k in range(3):
        state.down[k] /= norm
        state.bias[k] += state.gain[BX + k] * residual
    state.yaw = advance_binary(state.yaw, state.gain[PSI] * residual)
    state.scale += state.gain[S] * residual
    state.stamp += state.gain[D] * residual


@kernel
def correct_states(state: Any, s: float, residual: float) -> None:
    """Update by a ``residual`` of the variance ``s``, whose H and P H^T are in the record: filter and last survey."""
    joseph_update(state.P, state.ph, s, state.gain)
    if state.smoothing == 1:
        look_back(state, s, residual)
    feed_back(state, residual)


@kernel
def clear_row(h: Array) -> None:
    """Zero the measurement row."""
    for i in range(STATES):
        h[i] = 0.0


@kernel
def zero_rate(state: Any, rate: Array, dt: float, config: Any) -> None:
    """Zero-angular-rate update: while still the mean rate over ``dt`` (s) is the bias, axis by axis."""
    for k in range(3):
        clear_row(state.h)
        state.h[BX + k] = 1.0
        noise = config.attitude_factor * config.gyro_noise[k]
        s = innovation_var(state.P, state.h, noise * noise / dt, state.ph)
        correct_states(state, s, rate[k] - state.static_bias[k] - state.bias[k])


@kernel
def level_by_force(state: Any, force: Array, config: Any) -> None:
    """Correct gravity's direction from the specific force at rest: f / g = -u, u_true = u + u x e."""
    r_var = (config.force_std / config.gravity) ** 2
    for k in range(3):
        clear_row(state.h)
        if k == 0:
            state.h[TY] = state.down[2]
        elif k == 1:
            state.h[TX] = -state.down[2]
        else:
            state.h[TY] = -state.down[0]
            state.h[TX] = state.down[1]
        s = innovation_var(state.P, state.h, r_var, state.ph)
        correct_states(state, s, force[k] / config.gravity + state.down[k])
