"""How well positions along a hole are known beside what stations have in common, and what of that is its path.

With the chain S = P + N of a path and its looks, a position w has the variance w^T C w, C = S^-1, and w^T C P C w of it
is the path's. As C P C = C - C N C, and C N C is what C loses for each unit by which N grows, that is the sum of the
variance and its change: both are followed down the Markov chain z_j = F_j z_{j-1} + noise of E_j at once.
Source: differentiation of a Kalman filter, Astroem, IFAC Proceedings 10 (1977).
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from groundstation.survey.adjustment.kernels.path_elimination import (
    STATE,
    add_outer,
    add_product,
    invert_transposed,
    take_columns,
    take_image,
)
from groundstation.survey.path.kernels.copied_rows import copy_rows
from node.kernels.arithmetic.jit import allocating_kernel

Array = npt.NDArray[np.float64]


@allocating_kernel
def position_sums(
    diagonal: Array, tied: Array, of_looks: Array, bases: Array, halves: Array, wholes: Array, out: Array
) -> None:
    """Variances of the positions, and the part of the path.

    Parameters
    ----------
    diagonal, tied : (s + 1, 4, 4), from ``eliminate_path``
    of_looks : (s + 1, 2, 2), information N of the looks on every direction
    bases : (s + 1, 2, 3), axes across each
    halves, wholes : (s + 1,) m, half of the leg above each, and half of both legs
    out : (s + 1, 2, 3) m^2, set: variance and that of the path, to north, east and down
    """
    count = len(diagonal)
    noises, steps = np.zeros((count, 4, 4)), np.zeros((count, 4, 4))  # E and F
    grown = np.zeros((count, 4, 4))  # change of what is left of each block
    root, passed = np.empty((4, 4)), np.empty((4, 4))
    for j in range(count):
        invert_transposed(diagonal[j], root)
        add_outer(root, root, noises[j])
        if j > 0:
            take_image(root, tied[j], steps[j])
    for j in range(count - 1, -1, -1):
        for a in range(2):
            for b in range(2):
                grown[j, a, b] += of_looks[j, a, b]
        if j > 0:
            passed[:] = 0.0
            take_image(grown[j], steps[j], passed)
            take_columns(steps[j], passed, grown[j - 1], 0, STATE)
    cov, change = np.zeros((4, 4)), np.zeros((4, 4))
    crossed, its_change = np.zeros((3, 4)), np.zeros((3, 4))  # of what was summed, with the state here
    summed = np.zeros((2, 3))
    axes, levers = np.zeros((3, 4)), np.zeros((3, 4))
    for j in range(count):
        by_grown, lost, turned = np.zeros((4, 4)), np.zeros((4, 4)), np.zeros((4, 4))
        add_product(noises[j], grown[j], by_grown)
        take_image(by_grown, noises[j], lost)  # change of E
        take_image(by_grown, steps[j], turned)  # and of F
        carry_covariance(cov, change, steps[j], turned, noises[j], lost)
        carry_crossed(crossed, its_change, steps[j], turned)
        for i in range(3):
            axes[i, 0], axes[i, 1] = bases[j, 0, i], bases[j, 1, i]
        for i in range(3):
            both, its_both, own, its_own = 0.0, 0.0, 0.0, 0.0
            for a in range(2):
                both += crossed[i, a] * axes[i, a]
                its_both += its_change[i, a] * axes[i, a]
                for b in range(2):
                    own += axes[i, a] * cov[a, b] * axes[i, b]
                    its_own += axes[i, a] * change[a, b] * axes[i, b]
            here = summed[0, i] + 2.0 * halves[j] * both + halves[j] ** 2 * own
            out[j, 0, i] = here
            out[j, 1, i] = here + summed[1, i] + 2.0 * halves[j] * its_both + halves[j] ** 2 * its_own
            summed[0, i] += 2.0 * wholes[j] * both + wholes[j] ** 2 * own
            summed[1, i] += 2.0 * wholes[j] * its_both + wholes[j] ** 2 * its_own
        for i in range(3):
            levers[i, 0], levers[i, 1] = wholes[j] * axes[i, 0], wholes[j] * axes[i, 1]
        add_product(levers, cov, crossed)
        add_product(levers, change, its_change)


@allocating_kernel
def carry_covariance(cov: Array, change: Array, step: Array, turned: Array, noise: Array, lost: Array) -> None:
    """Carry a covariance and its change over a step F that itself changes, to F C F^T + E, in place."""
    half, by_turn, by_change = np.zeros((4, 4)), np.zeros((4, 4)), np.zeros((4, 4))
    add_product(step, cov, half)
    add_product(turned, cov, by_turn)
    add_product(step, change, by_change)
    copy_rows(noise, cov)
    copy_rows(lost, change)
    add_outer(half, step, cov)
    add_outer(half, turned, change)
    add_outer(by_turn, step, change)
    add_outer(by_change, step, change)


@allocating_kernel
def carry_crossed(crossed: Array, change: Array, step: Array, turned: Array) -> None:
    """Carry a covariance (3, 4) of sums with a state, and its change, over the same step, in place."""
    before, its_before = crossed.copy(), change.copy()
    crossed[:], change[:] = 0.0, 0.0
    add_outer(before, step, crossed)
    add_outer(before, turned, change)
    add_outer(its_before, step, change)
