"""Depths that scatter by more than is stated: stations are tied no more than their distance is known."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest
from drawn_strings import DEG, direction_at, read_force

from groundstation.service.hole.hole_adjustment import leg_reading_shares
from groundstation.survey.adjustment.adjust import adjust_hole
from groundstation.survey.adjustment.equations import leg_steps
from groundstation.survey.adjustment.looks import Looks, PathPrior, StringPrior
from groundstation.survey.path.curvature_process import process_step

Array = npt.NDArray[np.float64]
SCATTER = 0.05  # m
BEND = 0.2 * DEG  # rad/m
BETWEEN = 0.03  # m, from a station to the one that the next stop reads beside it
NOISE = 6e-4  # m/s^2


def known_path(md: Array, leg_length_var: Array | None) -> PathPrior:
    across = np.diag([1.0, 1.0, 0.0]) * (0.5 * DEG) ** 2
    return PathPrior(md, np.array([0.0, 0.0, 1.0]), across, 0.15 * DEG, 20.0, leg_length_var)


def test_a_leg_wanders_by_its_curvature_over_what_its_length_is_off_too() -> None:
    length_var = np.array([4e-4, 9e-4])
    go, rigid = leg_steps(known_path(np.array([0.0, 2.0, 2.1]), length_var))
    for k, length in enumerate((2.0, 0.1)):
        noise = process_step(length, 20.0)[1][1:, 1:]  # of direction and curvature about one axis, of a curvature of 1
        own = noise + np.diag([length_var[k], 0.0])
        both = np.zeros((4, 4))
        both[np.ix_((0, 2), (0, 2))] = both[np.ix_((1, 3), (1, 3))] = own
        np.testing.assert_allclose(rigid[k] @ both, np.eye(4), atol=1e-9)
    np.testing.assert_array_equal(go, leg_steps(known_path(np.array([0.0, 2.0, 2.1]), None))[0])


@pytest.mark.parametrize(
    ("looks", "shares"),
    [
        ([(1, 0)], [1.0]),
        ([(1, 0), (2, 1)], [1.0, 2.0]),
        ([(1, 0), (2, 0)], [1.0, 0.0]),  # one reading moves both
        ([(1, 0), (1, 1), (1, 2), (2, 1)], [1 / 3, 2 / 9 + 4 / 9]),  # means of e0, e1, e2 and of e1
        ([(1, 0), (1, 1), (2, 1), (2, 2), (3, 2)], [1 / 2, 2 / 4, 1 / 4 + 1 / 4]),
        ([(1, 0), (2, 1), (3, 0)], [1.0, 2.0, 2.0]),  # no neighbours
    ],
)
def test_a_reading_that_two_stations_share_moves_their_leg_not_at_all(
    looks: list[tuple[int, int]], shares: list[float]
) -> None:
    station, stop = np.array(looks).T
    assert leg_reading_shares(station, stop).tolist() == pytest.approx(shares)


def stations_squares(seed: int, *, is_told: bool) -> list[float]:
    """Squares of the errors of directions in what is stated, of a hole whose every station two stops read, beside it.

    What was measured was so at the true depth; each look is of a tube without a fault.
    """
    rng = np.random.default_rng(seed)
    told = np.sort(np.concatenate([np.arange(1, 9) * 2.0, np.arange(1, 9) * 2.0 + BETWEEN]))
    true = told + rng.normal(0.0, SCATTER, len(told))
    along = np.linspace(-1.0, 20.0, 400)
    lean = BEND * (along + 1.0)
    hole = np.stack([np.sin(lean), np.zeros_like(lean), np.cos(lean)], axis=1)
    tangents = np.array([direction_at(one, along, hole) for one in true])
    count = len(told)
    faces = rng.uniform(0.0, 2.0 * np.pi, count)
    forces = np.array(
        [read_force(d, psi, np.zeros(2), 9.81) for d, psi in zip(tangents, faces, strict=True)]
    ) + rng.normal(0.0, NOISE, (count, 3))
    none = np.zeros(count, np.intp)
    places = np.arange(count)
    looks = Looks(places + 1, none, none, places, forces, np.full(count, NOISE**2), faces, np.full(count, 1e-10))
    exact = np.full(1, 1e-7)
    string = StringPrior(exact, exact, np.zeros(2), 1e-12 * np.eye(2), 9.81, 1e-6, 1e-6)
    md, collar = np.append(0.0, told), direction_at(0.0, along, hole)
    across = (np.eye(3) - np.outer(collar, collar)) * (0.5 * DEG) ** 2
    shares = leg_reading_shares(looks.station, looks.stop)
    path = PathPrior(md, collar, across, 0.15 * DEG, 20.0, SCATTER**2 * shares if is_told else None)
    found = adjust_hole(looks, string, path)
    errors = np.einsum("kab,kb->ka", found.bases[1:], tangents - found.now.tangents[1:])
    covs = [found.cov_at(k)[:2, :2] for k in range(1, count + 1)]
    return [float(e @ np.linalg.solve(cov, e)) / 2.0 for e, cov in zip(errors, covs, strict=True)]


def test_directions_of_stations_whose_depths_scatter_are_as_well_known_as_stated() -> None:
    squares = [[stations_squares(seed, is_told=told) for seed in range(60)] for told in (True, False)]
    told, untold = (float(np.mean(one)) for one in squares)
    assert 0.8 < told < 1.2
    assert untold > 2.0  # where their distances are taken for exact
