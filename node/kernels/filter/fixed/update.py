"""Scalar measurement updates in Joseph form, in integers; every row of H has one or two terms.

K = P H^T / S is rounded to 31 bits with one exponent for the eight, and P+ = P - K (P H^T)^T - (P H^T - S K) K^T is
the Joseph form for whatever K: rounding of the gain costs S times its square and can make no variance negative.
"""

from __future__ import annotations

from typing import Any, Final

from node.kernels.arithmetic.formats import ANGLE_Q, FORCE_Q, TIME_Q, VECTOR_Q, Array
from node.kernels.arithmetic.integers import (
    bit_length,
    clamp_and_count,
    multiply_q31,
    quotient_q30,
    reciprocal_parts,
    rounded_shift,
)
from node.kernels.arithmetic.jit import kernel, kernel_constant
from node.kernels.arithmetic.trigonometry import TURN, radians_to_counts
from node.kernels.filter.fixed.strapdown import normalise_down
from node.kernels.record.filter_record import STATES, Err

TX, TY, PSI = kernel_constant(Err.TILT_X), kernel_constant(Err.TILT_Y), kernel_constant(Err.YAW)
BX, S, D = kernel_constant(Err.BIAS_X), kernel_constant(Err.SCALE), kernel_constant(Err.STAMP)
UNITY: Final = 1 << 31
LARGEST_TILT: Final = 4 << VECTOR_Q  # rad, of one correction
LARGEST_RESIDUAL: Final = 4 << ANGLE_Q
LARGEST_CORRECTION: Final = 8 << ANGLE_Q  # units
LEAST_VAR: Final = 1 << 10  # unit^2, of an innovation
SHORTEST: Final = 1 << (TIME_Q - 10)  # s, 1 ms


@kernel
def innovation_var(state: Any, a: int, ha: int, b: int, hb: int, r_var: int) -> int:
    """S = H P H^T + R (Q56) for H with ``ha`` and ``hb`` (Q31) at ``a`` and ``b``; leaves P H^T in ``state.ph``."""
    P, ph = state.P, state.ph
    for i in range(STATES):
        ph[i] = multiply_q31(P[i, a], ha)
        if hb != 0:
            ph[i] += multiply_q31(P[i, b], hb)
    return max(multiply_q31(ph[a], ha) + multiply_q31(ph[b], hb) + r_var, LEAST_VAR)


@kernel
def joseph_update(state: Any, s: int) -> tuple[int, int]:
    """Covariance after the update with K = P H^T / S; leaves K 2^q (31 bits) in ``state.gain``, q in ``gain_q``.

    Returns mantissa and exponent of 1 / S.
    """
    P, ph, gain, rest = state.P, state.ph, state.gain, state.rest
    largest = 0
    for i in range(STATES):
        largest |= abs(ph[i])
    mantissa, exponent = reciprocal_parts(s)
    lift = bit_length(largest) - 31
    q = min(30 - lift + exponent, 62)  # a gain below 2^-31 corrects nothing that could be seen
    up, down = max(0, 31 - q), max(0, q - 31)
    for i in range(STATES):
        gain[i] = rounded_shift((rounded_shift(ph[i], lift) * mantissa) >> 31, 30 - lift + exponent - q)
        rest[i] = ph[i] - rounded_shift(multiply_q31(s << up, gain[i]), down)
    state.gain_q = q
    for i in range(STATES):
        wide = ph[i] << up
        for j in range(i, STATES):
            P[i, j] -= rounded_shift(multiply_q31(wide, gain[j]), down) + rounded_shift(gain[i] * rest[j], q)
            P[j, i] = P[i, j]
    return mantissa, exponent


@kernel
def state_correction(state: Any, gain: int, q: int, residual: int) -> int:
    """K r in units (Q40) of a ``residual`` in Q40, for a ``gain`` K 2^q of 31 bits."""
    value = multiply_q31(residual, gain)
    value = (
        rounded_shift(value, q - 31)
        if q >= 31
        else clamp_and_count(state, value, LARGEST_CORRECTION >> (31 - q)) << (31 - q)
    )
    return clamp_and_count(state, value, LARGEST_CORRECTION)


@kernel
def correct_states(state: Any, a: int, ha: int, b: int, hb: int, s: int, residual: int) -> None:
    """Update by a ``residual`` of the variance ``s`` (Q56), H as in ``innovation_var``: filter and last survey."""
    mantissa, exponent = joseph_update(state, s)
    if state.smoothing == 1:
        along = state.surveyed_with
        shared = multiply_q31(along[a], ha)
        if hb != 0:
            shared += multiply_q31(along[b], hb)
        look_back(state, shared, mantissa, exponent, residual)
    feed_back(state, residual)


@kernel
def look_back(state: Any, shared: int, mantissa: int, exponent: int, residual: int) -> None:
    """The yaw at the last survey by an innovation: ``node.kernels.filter.smoothing.look_back``.

    ``shared`` is its covariance with what is measured (Q56), ``mantissa`` and ``exponent`` are of 1 / S.
    """
    lift = bit_length(abs(shared)) - 31
    q = min(30 - lift + exponent, 62)
    gain = rounded_shift((rounded_shift(shared, lift) * mantissa) >> 31, 30 - lift + exponent - q)
    up, down = max(0, 31 - q), max(0, q - 31)
    along, ph = state.surveyed_with, state.ph
    for j in range(STATES):
        along[j] -= rounded_shift(multiply_q31(ph[j] << up, gain), down)
    state.surveyed_var = max(state.surveyed_var - rounded_shift(multiply_q31(shared << up, gain), down), 0)
    corrected = radians_to_counts(state_correction(state, gain, q, residual), ANGLE_Q)
    state.surveyed_yaw = (int(state.surveyed_yaw) + corrected) & TURN


@kernel
def feed_back(state: Any, residual: int) -> None:
    """Closed loop: add K r to the estimates, ``residual`` in Q40."""
    gain, q = state.gain, state.gain_q
    ex = clamp_and_count(
        state, rounded_shift(state_correction(state, gain[TX], q, residual), ANGLE_Q - VECTOR_Q), LARGEST_TILT
    )
    ey = clamp_and_count(
        state, rounded_shift(state_correction(state, gain[TY], q, residual), ANGLE_Q - VECTOR_Q), LARGEST_TILT
    )
    if ex != 0 or ey != 0:
        down = state.down
        ux, uy, uz = down[0], down[1], down[2]
        down[0] = ux - rounded_shift(uz * ey, VECTOR_Q)
        down[1] = uy + rounded_shift(uz * ex, VECTOR_Q)
        down[2] = uz + rounded_shift(ux * ey - uy * ex, VECTOR_Q)
        normalise_down(down)
    for k in range(3):
        state.bias[k] += state_correction(state, gain[BX + k], q, residual)
    state.yaw = (int(state.yaw) + radians_to_counts(state_correction(state, gain[PSI], q, residual), ANGLE_Q)) & TURN
    state.scale += state_correction(state, gain[S], q, residual)
    state.stamp += state_correction(state, gain[D], q, residual)


@kernel
def zero_rate(state: Any, rate: Array, dt: int, config: Any) -> None:
    """Zero-angular-rate update: while still the mean ``rate`` (3, Q46) over ``dt`` (s, Q28) is the bias."""
    for k in range(3):
        r_var = rounded_shift(quotient_q30(config.rate_walk[k], max(dt, SHORTEST)), 30 - TIME_Q)
        s = innovation_var(state, BX + k, UNITY, BX + k, 0, r_var)
        off = clamp_and_count(state, rate[k] - state.static_bias[k] - state.bias[k], LARGEST_RESIDUAL)
        correct_states(state, BX + k, UNITY, BX + k, 0, s, off)


@kernel
def level_by_force(state: Any, force: Array, config: Any) -> None:
    """Correct gravity's direction from the specific ``force`` (3, g, Q26) at rest: f = -u, u_true = u + u x e."""
    down = state.down
    for k in range(3):
        a, b, ha, hb = TY, TX, down[2], 0
        if k == 1:
            a, b, ha, hb = TX, TY, -down[2], 0
        elif k == 2:
            ha, hb = -down[0], down[1]
        s = innovation_var(state, a, ha << 1, b, hb << 1, config.force_var)
        residual = (force[k] << (ANGLE_Q - FORCE_Q)) + (down[k] << (ANGLE_Q - VECTOR_Q))
        correct_states(state, a, ha << 1, b, hb << 1, s, clamp_and_count(state, residual, LARGEST_RESIDUAL))
