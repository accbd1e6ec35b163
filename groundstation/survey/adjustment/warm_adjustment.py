"""The compiled parts of an adjustment, compiled or loaded from the cache before the first hole is adjusted."""

from __future__ import annotations

import numpy as np

from groundstation.survey.adjustment.kernels.carried_bases import carry_bases
from groundstation.survey.adjustment.kernels.free_parts import free_parts
from groundstation.survey.adjustment.kernels.observations import (
    add_looks,
    add_right_sides,
    linearise_looks,
    mirror_upper,
    take_step,
    weigh_down,
)
from groundstation.survey.adjustment.kernels.path_elimination import (
    eliminate_path,
    path_covariances,
    reduce_right,
    substitute_path,
)
from groundstation.survey.adjustment.kernels.path_legs import add_legs, bend_to, leg_departures, leg_squares
from groundstation.survey.adjustment.kernels.position_sums import position_sums
from groundstation.survey.adjustment.kernels.sparse_products import add_rooted, add_squares


def warm_adjustment() -> None:
    """Call every kernel for one look of one tube at one station.

    Nothing here multiplies matrices by the library for them: its threads would be lost in a process that is forked.
    """
    first, one, width = np.zeros(1, np.intp), np.ones(1), 8
    forces, tangents, bases = np.array([[0.0, 0.0, -9.8]]), np.array([[0.0, 0.0, 1.0]]), np.zeros((1, 2, 3))
    bases[0, 0, 0] = bases[0, 1, 1] = 1.0
    carry_bases(tangents, bases)
    jacobians, weights, residuals = np.zeros((1, 3, 9)), np.zeros((1, 3, 3)), np.zeros((1, 3))
    linearise_looks(
        first, first, first, forces, one, np.zeros(1), one, tangents, bases, np.zeros((1, 6)), np.zeros(1), 9.8, 1e-6,
        jacobians, weights, residuals, np.zeros(1),
    )  # fmt: skip
    weigh_down(residuals, 1.0, weights, np.zeros(1))
    places, extra, common = np.arange(6)[None].copy(), np.zeros((1, 3, 0)), np.zeros((width + 1, width + 1))
    add_looks(
        first, first, first, jacobians, weights, residuals, extra, places, 6, np.zeros((1, 2, 2)),
        np.zeros((1, 2, width + 1)), common,
    )  # fmt: skip
    add_right_sides(
        first, first, first, jacobians, weights, residuals, extra, 6, np.zeros((1, 4)), np.zeros(width),
    )  # fmt: skip
    take_step(
        first, first, first, jacobians, residuals, extra, places, 6, np.zeros((1, 4)), np.zeros(width),
        np.zeros((1, 3)),
    )  # fmt: skip
    mirror_upper(common, width)
    diagonal, tied, coupled = np.eye(4)[None].copy(), np.zeros((1, 4, 4)), np.zeros((1, 4, width + 1))
    eliminate_path(diagonal, tied, coupled, first, 6)
    reduce_right(diagonal, tied, coupled)
    substitute_path(diagonal, tied, coupled)
    path_covariances(diagonal, tied, np.zeros((1, 4, 4)))
    add_rooted(coupled, common[:width, :width].copy(), 1.0, coupled.copy())
    add_squares(coupled, coupled, common)
    legs, place = (diagonal[:0], diagonal[:0]), (tangents, bases, np.zeros((1, 2)))
    bend_to(tangents[0], tangents[0], bases[0], np.zeros(2))
    add_legs(*legs, one[:0], *place, diagonal, tied, np.zeros((1, 4)))
    leg_departures(legs[0], *place, np.zeros((0, 4)))
    leg_squares(*legs, *place, diagonal, tied, diagonal.copy(), coupled, one[:0].copy(), one[:0].copy())
    position_sums(
        diagonal, tied, np.zeros((1, 2, 2)), bases, np.zeros(1), np.zeros(1), np.zeros((1, 2, 3)),
    )  # fmt: skip
    free_parts(
        first, first, first, jacobians, weights, extra, 6, np.zeros((1, 2, 2)), np.zeros((1, 2, width)),
        np.zeros((width, width)), np.zeros((1, 3, 3)),
    )  # fmt: skip
