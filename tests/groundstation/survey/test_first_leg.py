"""A collar that the stations tell: it errs by the curvature that the first leg leaves its arc by.

The oracle is one normal distribution of a fine path: curvature every few millimetres, integrated, and what was told and
read of it taken in by its covariance. It knows no leg and no moment.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pytest

from groundstation.survey.fusion.resolve import Direction
from groundstation.survey.path.leg_wander import UNTIED, CollarTie, LegWander
from groundstation.survey.well.trajectory import Trajectory

Array = npt.NDArray[np.float64]
DEG = np.pi / 180.0
FINE = 800  # of cells of the path
SIZE, LEGS, READ = 0.15 * DEG, 3, 0.004 * DEG  # rad/m, and rad of each station
SHARES = (0.25, 0.5, 0.8, 1.0)
CASES = [(2.0, 20.0, 0.15), (2.0, 20.0, 0.01), (3.0, 4.0, 0.5), (1.5, 15.0, 30.0), (6.0, 8.0, 0.2)]  # m, m, deg


@dataclass(frozen=True)
class FinePath:
    """Covariances of direction and curvature at the upper stations, and of places of the first leg, on one axis."""

    leg: float
    length: float
    names: tuple[str, ...]
    before: Array
    after: Array  # when collar and stations were told

    def between(self, one: str, other: str) -> float:
        return float(self.after[self.names.index(one), self.names.index(other)])

    @property
    def tie(self) -> CollarTie:
        kept = np.exp(-self.leg / self.length)
        turned = self.length * (1.0 - kept)
        with_start = self.between("turn 0", "bend 0")
        bend = self.between("turn 0", "turn 1") - self.between("turn 0", "turn 0") - turned * with_start
        return CollarTie(with_start, bend, self.between("turn 0", "bend 1") - kept * with_start)


def fine_path(leg: float, length: float, collar_deg: float) -> FinePath:
    """A path of some legs (m) whose curvature is forgotten over a length (m), below a collar that was told."""
    depth = LEGS * leg
    cell = depth / FINE
    at = (np.arange(FINE) + 0.5) * cell
    bends = SIZE**2 * np.exp(-np.abs(at[:, None] - at) / length)
    before = np.zeros((FINE + 1, FINE + 1))
    before[0, 0], before[1:, 1:] = (collar_deg * DEG) ** 2, bends

    def turn_at(md: float) -> Array:
        return np.concatenate([[1.0], cell * np.clip((md - at) / cell + 0.5, 0.0, 1.0)])

    def place_at(md: float) -> Array:
        """Offset at a depth less that of the arc between the ends of the first leg, down to there."""
        offset = np.concatenate([[md], cell * np.maximum(md - at, 0.0)])
        return offset - md * turn_at(0.0) - 0.5 * md * md / leg * (turn_at(leg) - turn_at(0.0))

    def bend_at(md: float) -> Array:
        return np.concatenate([[0.0], np.eye(FINE)[min(int(md / cell), FINE - 1)]])

    rows = {"turn 0": turn_at(0.0), "turn 1": turn_at(leg), "bend 0": bend_at(0.0), "bend 1": bend_at(leg)}
    rows |= {f"off {share}": place_at(share * leg) for share in SHARES}
    seen = np.array([turn_at(k * leg) for k in range(1, LEGS + 1)])
    gain = before @ seen.T @ np.linalg.inv(seen @ before @ seen.T + READ**2 * np.eye(LEGS))
    after = before - gain @ seen @ before
    wanted = np.array([*rows.values()])
    return FinePath(leg, length, tuple(rows), wanted @ before @ wanted.T, wanted @ after @ wanted.T)


@pytest.mark.parametrize("case", CASES)
def test_what_the_collar_errs_by_goes_with_the_first_leg_as_on_a_fine_path(case: tuple[float, float, float]) -> None:
    fine = fine_path(*case)
    for share in SHARES:
        found = fine.tie.moment_covariance(fine.leg, share, fine.length)
        assert found == pytest.approx(fine.between("turn 0", f"off {share}"), rel=0.03, abs=1e-12)


@pytest.mark.parametrize("case", CASES)
def test_places_of_the_first_leg_are_as_well_known_as_on_a_fine_path(case: tuple[float, float, float]) -> None:
    fine = fine_path(*case)
    drawn = Trajectory(collar=straight_down(fine.between("turn 0", "turn 0")))
    drawn.bend_as(LegWander(SIZE, fine.length), np.ones(1), [fine.tie])
    drawn.append(fine.leg, straight_down(fine.between("turn 1", "turn 1")))
    for share in SHARES:
        stated = drawn.at(share * fine.leg).cov
        assert stated[0, 0] == pytest.approx(stated[1, 1])
        assert stated[2, 2] == pytest.approx(0.0, abs=1e-15)
        assert stated[0, 0] == pytest.approx(error_at(fine, share), rel=0.05)


def test_without_it_a_collar_that_the_stations_tell_counts_too_much() -> None:
    fine = fine_path(2.0, 20.0, 30.0)
    drawn = Trajectory(collar=straight_down(fine.between("turn 0", "turn 0")))
    drawn.bend_as(LegWander(SIZE, fine.length), np.ones(1), UNTIED)
    drawn.append(fine.leg, straight_down(fine.between("turn 1", "turn 1")))
    assert drawn.covs[1][0, 0] > 1.25 * error_at(fine, 1.0)


def test_what_is_undone_stays_undone_below() -> None:
    fine = fine_path(2.0, 20.0, 0.15)
    tied, free = (Trajectory(collar=straight_down(fine.between("turn 0", "turn 0"))) for _ in range(2))
    for drawn, ties in ((tied, [fine.tie]), (free, UNTIED)):
        drawn.bend_as(LegWander(SIZE, fine.length), np.ones(4), ties)
        for md in (2.0, 4.0, 6.0, 8.0):
            drawn.append(md, straight_down(READ**2))
    np.testing.assert_allclose(tied.covs - tied.tied_covs, free.covs, atol=1e-18)
    assert (np.diagonal(tied.tied_covs, axis1=1, axis2=2)[1:, :2] < 0.0).all()
    np.testing.assert_allclose(tied.tied_covs[1:], tied.tied_covs[1:2].repeat(4, axis=0))
    np.testing.assert_allclose(tied.at(5.0).cov - free.at(5.0).cov, tied.tied_covs[1], atol=1e-18)


def straight_down(variance: float) -> Direction:
    return Direction(np.zeros(2), 1.0, variance * np.eye(2), np.zeros((2, 0)))


def error_at(fine: FinePath, share: float) -> float:
    """Mean square (m^2) of a place on the first leg that is taken to be on the arc between the mean directions."""
    upper, lower = 0.5 * fine.leg * share * (2.0 - share), 0.5 * fine.leg * share * share
    weights = {"turn 0": upper, "turn 1": lower, f"off {share}": 1.0}
    found = sum(a * b * fine.between(one, other) for one, a in weights.items() for other, b in weights.items())
    off = fine.names.index(f"off {share}")  # what was read tells a part of it, which an arc does not follow
    return float(found + fine.before[off, off] - fine.after[off, off])
