"""Propagation of the error covariance in integers: P- = F P F^T + G Q G^T, of which the upper triangle is computed.

P is Q56 of the units of ``arithmetic.formats``; the factors of F are Q31. F P is formed only where its product with
F^T is wanted, and P- is mirrored, so it is symmetric by construction. A variance that would leave its range is held by
scaling its row and column, which keeps P positive.
"""

from __future__ import annotations

from typing import Any, Final

from node.kernels.arithmetic.formats import CEILING, STEP_Q, TIME_Q, UNIT, Array
from node.kernels.arithmetic.integers import multiply_q31
from node.kernels.arithmetic.jit import kernel, kernel_constant
from node.kernels.arithmetic.trigonometry import TURN, exponential_decay, radians_to_counts, sine_cosine
from node.kernels.record.filter_record import STATES, Err

TX, TY, PSI = kernel_constant(Err.TILT_X), kernel_constant(Err.TILT_Y), kernel_constant(Err.YAW)
BX, BY, BZ = kernel_constant(Err.BIAS_X), kernel_constant(Err.BIAS_Y), kernel_constant(Err.BIAS_Z)
S, D = kernel_constant(Err.SCALE), kernel_constant(Err.STAMP)
STEP_RIGHT: Final = UNIT + TIME_Q - 31  # from s to rad a bias unit in Q31
SCALE_RIGHT: Final = STEP_Q - 31 + UNIT  # from rad to rad a scale unit in Q31
NOISE_LEFT: Final = 31 - TIME_Q  # of a variance a second times a time
SQUARE_ONE: Final = 1 << 62  # of Q31


@kernel
def update_bias_decays(state: Any, config: Any, dt: int) -> None:
    """Exp(-dt / tau) of the three biases, Q31, into ``state.decay``; ``dt`` s in Q28, up to 8."""
    for k in range(3):
        if k > 0 and config.bias_decay[k] == config.bias_decay[k - 1]:
            state.decay[k] = state.decay[k - 1]
        else:
            state.decay[k] = exponential_decay(config.bias_decay[k], dt)


@kernel
def propagate_covariance(state: Any, P: Array, wz: int, dt: int, turning: int, config: Any) -> None:
    """Covariance ``P`` (8, 8, Q56) in place over ``dt`` (s, Q28, up to 8) at the spin ``wz`` (rad/s, Q46).

    ``turning`` is 1 while the gyroscope is integrated and 0 while still, when the rates are zero by knowledge.
    """
    update_bias_decays(state, config, dt)
    f = state.decay
    if turning == 1:
        transform_covariance(P, multiply_q31(wz, dt), dt)
    for k in range(3):
        for j in range(BX + k, STATES):
            P[BX + k, j] = multiply_q31(P[BX + k, j], f[k])
        for i in range(BX + k + 1):
            P[i, BX + k] = multiply_q31(P[i, BX + k], f[k])
    add_process_noise(P, dt, turning, f, config)
    mirror_upper_triangle(P)
    for i in range(STATES):
        if P[i, i] > CEILING:
            limit_variance(state, P, i)


@kernel
def transform_covariance(P: Array, angle: int, dt: int) -> None:
    """Rows and columns of the tilts and the yaw: F P F^T without the decay of the biases, upper triangle.

    Parameters
    ----------
    P : (8, 8), Q56, symmetric
    angle : rad turned about z, Q43, up to 64
    dt : s, Q28
    """
    sq30, cq30 = sine_cosine(radians_to_counts(angle, STEP_Q) & TURN)
    s, c = sq30 << 1, cq30 << 1
    step, spin = dt >> STEP_RIGHT, angle >> SCALE_RIGHT
    for j in range(STATES):
        tx, ty = P[TX, j], P[TY, j]
        P[TX, j] = multiply_q31(tx, c) + multiply_q31(ty, s) - multiply_q31(P[BX, j], step)
        P[TY, j] = multiply_q31(ty, c) - multiply_q31(tx, s) - multiply_q31(P[BY, j], step)
        P[PSI, j] -= multiply_q31(P[BZ, j], step) + multiply_q31(P[S, j], spin)
    for i in range(PSI + 1):
        tx, ty = P[i, TX], P[i, TY]
        P[i, TX] = multiply_q31(tx, c) + multiply_q31(ty, s) - multiply_q31(P[i, BX], step)
        P[i, TY] = multiply_q31(ty, c) - multiply_q31(tx, s) - multiply_q31(P[i, BY], step)
        P[i, PSI] -= multiply_q31(P[i, BZ], step) + multiply_q31(P[i, S], spin)


@kernel
def propagate_survey_covariance(state: Any, wz: int, dt: int, turning: int, config: Any) -> None:
    """Covariance of the yaw at the last survey with the states over ``dt``, as its twin in ``filter.smoothing``."""
    update_bias_decays(state, config, dt)
    along = state.surveyed_with
    if turning == 1:
        angle = multiply_q31(wz, dt)
        sq30, cq30 = sine_cosine(radians_to_counts(angle, STEP_Q) & TURN)
        s, c = sq30 << 1, cq30 << 1
        step, spin = dt >> STEP_RIGHT, angle >> SCALE_RIGHT
        tx, ty = along[TX], along[TY]
        along[TX] = multiply_q31(tx, c) + multiply_q31(ty, s) - multiply_q31(along[BX], step)
        along[TY] = multiply_q31(ty, c) - multiply_q31(tx, s) - multiply_q31(along[BY], step)
        along[PSI] -= multiply_q31(along[BZ], step) + multiply_q31(along[S], spin)
    for k in range(3):
        along[BX + k] = multiply_q31(along[BX + k], state.decay[k])


@kernel
def add_process_noise(P: Array, dt: int, turning: int, f: Array, config: Any) -> None:
    """G Q G^T on the diagonal: walk dt of the attitude, (B sigma_b)^2 (1 - f^2) of the biases; ``f`` (3) in Q31."""
    for k in range(3):
        P[TX + k, TX + k] += multiply_q31(config.walk[k] if turning == 1 else config.still_walk_var, dt) << NOISE_LEFT
        P[BX + k, BX + k] += multiply_q31(config.bias_drive[k], (SQUARE_ONE - f[k] * f[k]) >> 31)
    if config.stamp_on == 1:
        P[D, D] += multiply_q31(config.stamp_walk_var, dt) << NOISE_LEFT


@kernel
def mirror_upper_triangle(P: Array) -> None:
    """Copy the upper triangle of ``P`` (8, 8) into the lower."""
    for i in range(STATES):
        for j in range(i):
            P[i, j] = P[j, i]


@kernel
def limit_variance(state: Any, P: Array, i: int) -> None:
    """Scale row and column ``i`` of ``P`` (8, 8) until its variance is within its range; counted as an overflow."""
    state.overflows += 1
    while P[i, i] > CEILING:
        for j in range(STATES):
            P[i, j] -= P[i, j] >> 5
        for j in range(STATES):
            P[j, i] -= P[j, i] >> 5
        mirror_of(P, i)


@kernel
def mirror_of(P: Array, i: int) -> None:
    """Give column ``i`` of ``P`` (8, 8) the values of row ``i``."""
    for j in range(STATES):
        P[j, i] = P[i, j]


@kernel
def widen_variance(state: Any, P: Array, i: int, variance: int) -> None:
    """Add ``variance`` (unit^2, Q56, up to 2^61) to state ``i`` of ``P`` (8, 8), held at the end of the range."""
    total = P[i, i] + variance
    if total > CEILING:
        state.overflows += 1
        total = max(P[i, i], CEILING)
    P[i, i] = total
