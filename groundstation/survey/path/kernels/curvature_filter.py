"""The filter of a curvature that wanders, for many sizes and lengths side by side, station by station.

The state of a cell is direction and curvature on two axes, (theta_1, theta_2, kappa_1, kappa_2), with the covariance in
blocks of two: A of the direction, B of direction with curvature, C of the curvature. In every leg the curvature may
jump once, somewhere: then

    A += J^2 h^2 / 3 I,    B += J^2 h / 2 I,    C += J^2 I,

the moments of a jump of standard deviation J at a place that is anywhere in the leg h. How often it jumps is learnt
too: after n jumps in s metres the chance of none in the next h is ((b + s) / (b + s + h))^(a + n). What follows
from jumping or not is weighed by the direction that is measured next, and taken together as one normal with the same
two moments.
Source: Kalman (1960) for a cell; Ackerson and Fu, IEEE Trans. Automat. Contr. 15 (1970) for the jumps. rad and m.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from node.kernels.arithmetic.jit import kernel

Array = npt.NDArray[np.float64]
Pair = tuple[float, float]
Matrix = tuple[float, float, float, float]  # a b, c d, row by row
State = tuple[Pair, Pair, Matrix, Matrix, Matrix]  # direction, curvature, A, B, C
NOTHING = (0.0, 0.0, 0.0, 0.0)


@kernel
def multiply_matrices(left: Matrix, right: Matrix) -> Matrix:
    """Product of two matrices."""
    a, b, c, d = left
    e, f, g, h = right
    return a * e + b * g, a * f + b * h, c * e + d * g, c * f + d * h


@kernel
def transpose_matrix(matrix: Matrix) -> Matrix:
    """The matrix with its columns as rows."""
    return matrix[0], matrix[2], matrix[1], matrix[3]


@kernel
def apply_matrix(matrix: Matrix, to: Pair) -> Pair:
    """Matrix times a pair."""
    return matrix[0] * to[0] + matrix[1] * to[1], matrix[2] * to[0] + matrix[3] * to[1]


@kernel
def outer_product(left: Pair, right: Pair) -> Matrix:
    """Left times the transposed of right."""
    return left[0] * right[0], left[0] * right[1], left[1] * right[0], left[1] * right[1]


@kernel
def add_scaled(to: Matrix, factor: float, matrix: Matrix) -> Matrix:
    """Matrix plus a multiple of another."""
    a, b, c, d = to
    return a + factor * matrix[0], b + factor * matrix[1], c + factor * matrix[2], d + factor * matrix[3]


@kernel
def with_variance(matrix: Matrix, var: float) -> Matrix:
    """Matrix plus a variance on both axes."""
    return matrix[0] + var, matrix[1], matrix[2], matrix[3] + var


@kernel
def foresee_state(state: State, bent: float, left: float, noise: Array) -> State:
    """State at the end of a leg: a curvature of 1 is ``bent`` in the direction there and ``left`` in the curvature."""
    (t1, t2), (k1, k2), a, b, c = state
    both = add_scaled(add_scaled(b, 1.0, transpose_matrix(b)), bent, c)
    a = with_variance(add_scaled(a, bent, both), noise[0])
    crossed = add_scaled(b, bent, c)
    b = with_variance((left * crossed[0], left * crossed[1], left * crossed[2], left * crossed[3]), noise[1])
    c = with_variance((left * left * c[0], left * left * c[1], left * left * c[2], left * left * c[3]), noise[2])
    return (t1 + bent * k1, t2 + bent * k2), (left * k1, left * k2), a, b, c


@kernel
def weigh_direction(a: Matrix, cov: Array, off: Pair) -> tuple[float, Matrix]:
    """Logarithm of how likely a direction is that is off by a pair, and the inverse of its foreseen covariance."""
    xx, xy, yy = a[0] + cov[0, 0], a[1] + cov[0, 1], a[3] + cov[1, 1]
    det = xx * yy - xy * xy
    inverse = (yy / det, -xy / det, -xy / det, xx / det)
    weighed = apply_matrix(inverse, off)
    return -0.5 * (weighed[0] * off[0] + weighed[1] * off[1] + math.log(det)), inverse


@kernel
def correct_state(
    state: State, cov: Array, angle: Array, jumps: Array, shares: Array, still: float, leg: float
) -> tuple[float, float, State]:
    """How likely a direction is (logarithm); with it known the chance of a jump in the leg before it, and the state."""
    direction, curvature, a, b, c = state
    off = angle[0] - direction[0], angle[1] - direction[1]
    top = -math.inf
    for j in range(len(jumps)):
        widened = with_variance(a, jumps[j] ** 2 * leg * leg / 3.0)
        chance = still if j == 0 else (1.0 - still) * shares[j]
        top = max(top, math.log(chance) + weigh_direction(widened, cov, off)[0])
    # moments of the changes of direction and curvature, weighed by how well each way foresaw
    total, kept, turned, bent = 0.0, 0.0, (0.0, 0.0), (0.0, 0.0)
    sum_a, sum_b, sum_c = NOTHING, NOTHING, NOTHING
    for j in range(len(jumps)):
        var = jumps[j] ** 2
        wa, wb, wc = (
            with_variance(a, var * leg * leg / 3.0), with_variance(b, 0.5 * var * leg), with_variance(c, var),
        )  # fmt: skip
        likely, inverse = weigh_direction(wa, cov, off)
        chance = still if j == 0 else (1.0 - still) * shares[j]
        share = math.exp(math.log(chance) + likely - top)
        kept = share if j == 0 else kept
        gain_t, gain_k = multiply_matrices(wa, inverse), multiply_matrices(transpose_matrix(wb), inverse)
        dt, dk = apply_matrix(gain_t, off), apply_matrix(gain_k, off)
        total += share
        turned = turned[0] + share * dt[0], turned[1] + share * dt[1]
        bent = bent[0] + share * dk[0], bent[1] + share * dk[1]
        sum_a = add_scaled(
            sum_a, share, add_scaled(add_scaled(wa, -1.0, multiply_matrices(gain_t, wa)), 1.0, outer_product(dt, dt))
        )
        sum_b = add_scaled(
            sum_b, share, add_scaled(add_scaled(wb, -1.0, multiply_matrices(gain_t, wb)), 1.0, outer_product(dt, dk))
        )
        sum_c = add_scaled(
            sum_c, share, add_scaled(add_scaled(wc, -1.0, multiply_matrices(gain_k, wb)), 1.0, outer_product(dk, dk))
        )
    part = 1.0 / total
    dt, dk = (part * turned[0], part * turned[1]), (part * bent[0], part * bent[1])
    return (
        top + math.log(total),
        1.0 - part * kept,
        (
            (direction[0] + dt[0], direction[1] + dt[1]),
            (curvature[0] + dk[0], curvature[1] + dk[1]),
            add_scaled(add_scaled(NOTHING, part, sum_a), -1.0, outer_product(dt, dt)),
            add_scaled(add_scaled(NOTHING, part, sum_b), -1.0, outer_product(dt, dk)),
            add_scaled(add_scaled(NOTHING, part, sum_c), -1.0, outer_product(dk, dk)),
        ),
    )


@kernel
def follow_directions(
    angles: Array, covs: Array, steps: Array, noises: Array, lengths: Array, jumps: Array, shares: Array,
    expected: float, within: float, variances: Array, weights: Array, counts: Array, means: Array, blocks: Array,
) -> None:  # fmt: skip
    """Weigh each cell by the directions of a hole, and leave what it makes of the last.

    Parameters
    ----------
    angles, covs : (n, 2) rad and (n, 2, 2), directions at the stations and their covariance
    steps, noises : (n - 1, g, 2) and (n - 1, g, 3), of each leg in each cell: what of a curvature is in the direction
        and in the curvature at its end; variance of the direction, covariance, variance of the curvature
    lengths : (n - 1,) m, of the legs
    jumps, shares : (1 + j,) rad/m and (1 + j,), of a jump: size, and part of all jumps; the first one is none
    expected, within : jumps that are expected beforehand within so many metres: a gamma distribution of their rate
    variances : (g,) rad^2/m^2, of the curvature at the first station in each cell
    weights, counts : (g,) logarithms, of the cells beforehand, set; (g,) set: how many jumps there seem to have been
    means, blocks : (g, 4) and (g, 3, 4), set: state at the last station; its covariance A, B, C
    """
    for g in range(len(weights)):
        known = covs[0, 0, 0], covs[0, 0, 1], covs[0, 1, 0], covs[0, 1, 1]
        bends = variances[g], 0.0, 0.0, variances[g]
        state = (angles[0, 0], angles[0, 1]), (0.0, 0.0), known, NOTHING, bends
        weight, count, passed = weights[g], 0.0, within
        for i in range(len(lengths)):
            state = foresee_state(state, steps[i, g, 0], steps[i, g, 1], noises[i, g])
            still = (passed / (passed + lengths[i])) ** (expected + count)
            likely, jumped, state = correct_state(state, covs[i + 1], angles[i + 1], jumps, shares, still, lengths[i])
            weight, count, passed = weight + likely, count + jumped, passed + lengths[i]
        weights[g], counts[g] = weight, count
        direction, curvature, a, b, c = state
        means[g, 0], means[g, 1], means[g, 2], means[g, 3] = direction[0], direction[1], curvature[0], curvature[1]
        for place in range(4):
            blocks[g, 0, place], blocks[g, 1, place], blocks[g, 2, place] = a[place], b[place], c[place]


def warm_up() -> None:
    """Compile the loop or load it from the cache."""
    one = np.ones(1)
    follow_directions(
        np.zeros((2, 2)), np.broadcast_to(np.eye(2), (2, 2, 2)).copy(), np.ones((1, 1, 2)), np.ones((1, 1, 3)), one,
        one, one, 1.0, 1.0, one, one.copy(), one.copy(), np.zeros((1, 4)), np.zeros((1, 3, 4)),
    )  # fmt: skip
