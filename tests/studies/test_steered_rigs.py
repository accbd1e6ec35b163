"""Whole rigs in a hole that is steered back in its last leg, and in one that goes straight: honest, and not blamed."""

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import pytest

from borechain.studies.drawn_rigs import KnownSetUp, RigDraw, tables_of
from borechain.studies.heard_ground import IN_ONE, heard_ground
from borechain.studies.judged_hole import JudgedHole, judge_hole_of
from groundstation.service.hole.examined_hole import ExaminedHole
from sim.world.path_section import HoleKind
from sim.world.scenario import scenario_of
from sim.world.world import World

pytestmark = pytest.mark.slow

DEG = math.pi / 180.0
FAR = 13.82  # of chi-square with two degrees of freedom: one in a thousand


@dataclass(frozen=True)
class Drilled:
    """A hole as the ground station has it at the end."""

    judged: JudgedHole
    examined: ExaminedHole


@contextmanager
def drilled(kind: HoleKind, seed: int) -> Iterator[Drilled]:
    draw = RigDraw(KnownSetUp(), seed, kind)
    world = World(scenario_of(dict(tables_of(draw))), draw.seed)
    with heard_ground(world, IN_ONE) as ground:
        examined = ground.model.hole.examined
        assert examined is not None
        yield Drilled(judge_hole_of(world, ground.model.hole), examined)


@pytest.mark.parametrize("seed", [12, 26, 33])
def test_a_hole_that_is_steered_back_in_one_leg_is_believed(seed: int) -> None:
    """A degree in two metres, read by the lowest tube alone: no accelerometer is blamed, and the toe is known."""
    with drilled("steered", seed) as found:
        assert found.examined.examination.blunders == ()
        assert found.judged.direction_squares[-1] < FAR
        now = found.examined.adjusted.now
        assert math.sqrt(now.leg_vars[-1]) > 0.5 * DEG
        assert (now.leg_vars[-1] > 4.0 * now.leg_vars[:-1]).all()


def test_a_straight_hole_is_known_to_bend_less() -> None:
    with drilled("straight", 7) as found:
        now = found.examined.adjusted.now
        assert math.sqrt(now.curvature_var) < 0.2 * DEG  # of 0.3 before the looks
        assert (found.judged.ellipsoid_squares < 16.27).all()
