"""The adjustment against a dense solution of the same problem that shares nothing with it but what a look is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pytest
from dense_adjustment import DenseHole, DenseSolution
from drawn_worlds import Case, Worlds, draw_worlds

from groundstation.survey.adjustment.adjust import adjust_hole
from groundstation.survey.adjustment.adjusted import Adjusted
from groundstation.survey.adjustment.collar import collar_ties
from groundstation.survey.adjustment.looks import StartingPoint

pytestmark = pytest.mark.slow

Array = npt.NDArray[np.float64]
MEANS = 0.1  # standard deviations
COVARIANCES = 5e-3  # of the largest and the smallest axis
PLAY = 0.05  # of its variance
CURVATURE = 0.25  # likewise; that of a leg is left where it moves by a fifth
KNOWN_AS = 4.0  # looks that the play before them counts for
HOLE_KNOWN_AS, LEG_KNOWN_AS = 6.0, 4.0  # directions that the curvature before them counts for
LIKELY = 16.0  # square beyond which a look counts less


# known and unknown biases, mounts as they are mounted, joints at every angle, legs of any length, any tool face or one
CASES = [
    Case(seed=1),
    Case(seed=2, tubes=4, stations=6, inclination=2.0, tilt=0.5, bias=3e-4, same_tool_face=True),
    Case(seed=3, make_ups=3, inclination=60.0, yaw=0.3, legs=(2.0, 5.0), told=180.0),
    Case(seed=4, tubes=2, stations=6, inclination=90.0, tilt=0.6, joint=2.0, collar=0.05),
]


@dataclass(frozen=True)
class Compared:
    """A hole adjusted from where an adjustment had ended, the dense problem, and its solution from there."""

    worlds: Worlds
    start: StartingPoint
    found: Adjusted
    dense: DenseHole
    solution: DenseSolution

    @property
    def there(self) -> DenseSolution:
        """What the dense problem says where the equations of the adjustment are linear."""
        return self.dense.at(self.solution, self.start)


def both(case: Case) -> Compared:
    worlds = draw_worlds(case)
    looks = worlds.looks(0)
    first = adjust_hole(looks, worlds.string, worlds.path)
    assert first.linear.squares.max() < LIKELY
    found = adjust_hole(looks, worlds.string, worlds.path, start=first.now)
    dense = DenseHole(
        looks,
        worlds.string,
        worlds.path,
        found.now.play_var,
        found.now.curvature_var,
        found.now.leg_vars,
        first.now.tangents,
    )
    return Compared(worlds, first.now, found, dense, dense.solve(first.now))


def in_deviations(found: Adjusted, solution: DenseSolution) -> float:
    """Largest departure of a direction from that of a solution, in standard deviations."""
    off = np.einsum("kai,ki->ka", found.bases, solution.tangents - found.now.tangents)
    return float(np.sqrt(np.einsum("ka,kab,kb->k", off, np.linalg.inv(found.covs[:, :2, :2]), off)).max())


def stretched(compared: Compared) -> float:
    """By how much an axis of a covariance of a direction is longer or shorter, as a part of its square."""
    found, there = compared.found, compared.there
    size = len(found.now.tangents)
    across = np.einsum("kai,kib->kab", found.bases, there.across)
    covs = np.einsum("kbkc->kbc", there.cov_of("direction").reshape(size, 2, size, 2))
    theirs = across @ covs @ np.swapaxes(across, 1, 2)
    return float(np.abs(np.linalg.eigvals(np.linalg.solve(found.covs[:, :2, :2], theirs)) - 1.0).max())


def dense_play(compared: Compared) -> float:
    """Variance of the play by what the dense solution makes of every tube's tilt at every look."""
    solution, prior = compared.there, compared.worlds.string.play_std**2
    var, play = compared.found.now.play_var, compared.solution.part("play")
    free = np.sum(1.0 - np.diag(solution.cov_of("play")) / var)
    return float((KNOWN_AS * prior + play @ play) / (KNOWN_AS + free))


def dense_curvature(compared: Compared) -> tuple[float, Array]:
    """Variance of the curvature, and by which each leg is driven, by what the dense solution makes of every leg."""
    dense, solution, now = compared.dense, compared.there, compared.found.now
    first = 3 * len(dense.looks) + 2
    rows = slice(first, first + 2 + 4 * len(now.leg_vars))  # of the curvature at the collar, and of the legs
    slopes = dense.jacobian(solution.x)[rows]
    squares, free = compared.solution.left[rows] ** 2, 1.0 - np.diag(slopes @ solution.cov @ slopes.T)
    seen, free_of_legs = now.leg_vars * squares[2:].reshape(-1, 4).sum(axis=1), free[2:].reshape(-1, 4).sum(axis=1)
    legs = (LEG_KNOWN_AS * now.curvature_var + seen) / (LEG_KNOWN_AS + free_of_legs)
    prior = compared.worlds.path.curvature_std**2
    of_legs = now.curvature_var * np.sum(seen / now.leg_vars)
    seen_at_all = HOLE_KNOWN_AS * prior + now.curvature_var * squares[:2].sum() + of_legs
    return float(seen_at_all / (HOLE_KNOWN_AS + free.sum())), legs


@pytest.fixture(scope="module", params=CASES, ids=lambda case: f"case {case.seed}")
def compared(request: pytest.FixtureRequest) -> Compared:
    return both(request.param)


def test_directions_tubes_and_their_covariances_are_those_of_a_dense_solution(compared: Compared) -> None:
    found, solution = compared.found, compared.solution
    assert in_deviations(found, solution) < MEANS
    there = compared.there.cov_of("tube")
    off = np.abs(found.now.tubes.ravel() - solution.part("tube"))
    assert (off / np.sqrt(np.diag(there))).max() < MEANS
    assert stretched(compared) < COVARIANCES
    stds = np.sqrt(np.diag(found.common_cov))[: off.size]
    np.testing.assert_allclose(stds, np.sqrt(np.diag(there)), rtol=COVARIANCES)


def test_the_collar_goes_with_its_leg_as_in_the_dense_solution(compared: Compared) -> None:
    there, path = compared.there, compared.worlds.path
    kept = np.exp(-path.md[1] / path.correlation_length)
    turned = path.correlation_length * (1.0 - kept)
    turns, bends = there.cov_of("direction")[:2], there.cov_of("direction", "curvature")[:2]
    axes = np.arange(2)
    with_start = bends[axes, axes].mean()
    with_bend = turns[axes, axes + 2].mean() - turns[axes, axes].mean() - turned * with_start
    with_change = bends[axes, axes + 2].mean() - kept * with_start
    sizes = np.sqrt(turns[0, 0] * compared.found.now.curvature_var) * np.array([1.0, path.md[1], 1.0])
    off = np.array(collar_ties(compared.found)[0]) - [with_start, with_bend, with_change]
    assert (np.abs(off) < 5e-3 * sizes).all()
    assert with_start < -10.0 * 5e-3 * sizes[0]  # what leans more at the collar bends less from there


def test_what_is_learnt_of_play_and_curvature_is_what_the_dense_solution_leaves(compared: Compared) -> None:
    now = compared.found.now
    assert now.play_var == pytest.approx(dense_play(compared), rel=PLAY)
    whole, legs = dense_curvature(compared)
    assert now.curvature_var == pytest.approx(whole, rel=CURVATURE)
    np.testing.assert_allclose(now.leg_vars, legs, rtol=CURVATURE)
