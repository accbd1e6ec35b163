"""Positions of adjusted holes against worlds whose holes differ in how sharply they bend, as they are said to."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest
from drawn_worlds import DEG, LENGTH, Case, Worlds, draw_worlds
from scipy.spatial.transform import Rotation
from scipy.stats import binom, chi2

from groundstation.service.hole.adjusted_stations import learnt_wander
from groundstation.service.hole.hole_adjustment import directions_of
from groundstation.survey.adjustment.adjust import adjust_hole
from groundstation.survey.adjustment.blunders import Examination
from groundstation.survey.fusion.shared import SharedErrors
from groundstation.survey.well.trajectory import Trajectory

pytestmark = pytest.mark.slow

Array = npt.NDArray[np.float64]
WORLDS = 300
STATED_DEG = 0.3  # deg/m, root of the mean of the variances of the curvatures of all holes
FREEDOM = 8.0  # of the variance of one of them, as what is known of six directions is the mean of
LEAST, MOST = 0.8, 1.2  # mean square over its degrees of freedom, of which three hundred holes leave 0.94 to 1.06


def drawn_hole(worlds: Worlds, world: int, north_std: float) -> Trajectory:
    """A hole as a ground station draws it whose depths are exact."""
    found = Examination(adjust_hole(worlds.looks(world), worlds.string, worlds.path))
    collar, *below = directions_of(found, SharedErrors(), north_std)
    drawn = Trajectory(collar=collar)
    drawn.bend_as(*learnt_wander(found.drawn, LENGTH))
    drawn.swing_by(north_std)
    drawn.extend(list(zip(worlds.path.md[1:].tolist(), below, strict=True)))
    return drawn


def squares_of(case: Case, north_deg: float = 0.0) -> Array:
    """Squares (w, s) of the positions' errors to north and east in standard deviations; north is off as it is said."""
    drawn_worlds = draw_worlds(case)
    worlds = replace(drawn_worlds, path=replace(drawn_worlds.path, curvature_std=STATED_DEG * DEG))
    turns = turns_of(case, north_deg)
    found = []
    for world, turn in enumerate(turns.tolist()):
        drawn = drawn_hole(worlds, world, north_deg * DEG)
        true = Rotation.from_rotvec([0.0, 0.0, turn]).apply(worlds.holes.positions[world])
        off = (drawn.positions - true)[1:, :2]
        found.append(np.einsum("ka,kab,kb->k", off, np.linalg.inv(drawn.covs[1:, :2, :2]), off))
    return np.array(found)


def turns_of(case: Case, north_deg: float) -> Array:
    """Turns (w,), rad, by which north is off in each world."""
    return np.asarray(north_deg * DEG * np.random.default_rng([case.seed, 2]).normal(size=case.worlds))


def check_squares(squares: Array) -> None:
    """Coverage of 95 % at every station, and the mean square over all."""
    check_regions(squares)
    assert LEAST < squares.mean() / 2.0 < MOST


def check_regions(squares: Array) -> None:
    """Coverage of 95 % at every station."""
    inside = (squares < chi2.ppf(0.95, 2)).sum(axis=0)
    least, most = binom.ppf([1e-3, 1.0 - 1e-3], WORLDS, [0.93, 0.97])
    assert (inside >= least).all()
    assert (inside <= most).all()


@pytest.mark.parametrize("curvature", [STATED_DEG, 4.0 * STATED_DEG])
def test_positions_are_as_well_known_as_is_said(curvature: float) -> None:
    """Of holes as they are said to be, and of a ground that bends them four times as sharply."""
    check_squares(squares_of(replace(VERTICAL, curvature=curvature)))


@pytest.mark.parametrize("curvature", [0.03, 0.07, 0.14, 0.6])
def test_one_hole_is_stated_as_it_bends_itself(curvature: float) -> None:
    """Holes that all bend alike: a tenth as sharply as is said, as wellbore 1 does (0.14), and twice as sharply."""
    check_squares(squares_of(replace(VERTICAL, seed=15, curvature=curvature, freedom=math.inf)))


@pytest.mark.parametrize("length", [10.0, 40.0])
@pytest.mark.parametrize(("curvature", "freedom"), [(0.14, math.inf), (STATED_DEG, FREEDOM)])
def test_another_length_than_the_assumed_is_in_what_is_said(length: float, curvature: float, freedom: float) -> None:
    """Curvatures that are forgotten over half and twice the 20 m that are assumed."""
    check_squares(squares_of(replace(VERTICAL, seed=17, curvature=curvature, freedom=freedom, length=length)))


def test_a_collar_that_only_the_stations_tell_is_no_better_and_no_worse_known() -> None:
    """Told to two degrees: it errs by the curvature that the second leg tells, and that leg leaves its arc by it."""
    check_squares(squares_of(replace(VERTICAL, seed=16, collar=2.0, freedom=math.inf)))


def test_north_is_in_every_position() -> None:
    check_squares(squares_of(replace(VERTICAL, seed=14, inclination=30.0), north_deg=0.3))


@pytest.mark.parametrize("north_deg", [2.0, 5.0])
def test_a_poor_north_moves_positions_on_an_arc(north_deg: float) -> None:
    """Straight across alone the mean square at 16 m is 7.9 for two degrees; on an arc it is no normal error.

    Most turns are small and go hardly inward, few go far: a region that holds 95 % of them is wider than their mean
    square. Of turns of s the inward way, 1 - cos, is stated with 1.05 s^2, so these very turns say what it is to be:
    0.84 of all turns, and of these 300 less.
    """
    case = replace(VERTICAL, seed=14, inclination=30.0)
    squares = squares_of(case, north_deg=north_deg)
    check_regions(squares)
    turns, std = turns_of(case, north_deg), north_deg * DEG
    expected = (np.sin(turns) / std) ** 2 + ((1.0 - np.cos(turns)) / (1.05 * std**2)) ** 2
    assert squares[:, -1].mean() == pytest.approx(expected.mean(), rel=0.1)


VERTICAL = Case(
    seed=12, worlds=WORLDS, tubes=5, stations=8, make_ups=4, inclination=2.0, yaw=0.02, tilt=0.2, joint=0.03,
    curvature=STATED_DEG, freedom=FREEDOM, collar=0.15,
)  # fmt: skip
