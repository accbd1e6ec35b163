"""Costs at the toe to first order, beside holes that are drawn again with the item wrong by a small amount."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from groundstation.service.setup.setup_priors import SetupPrior, SetupPriors
from groundstation.service.setup.toe_costs import designed_course, toe_costs
from groundstation.service.setup.told_value import SetupKind
from groundstation.survey.fusion.resolve import known_direction
from groundstation.survey.wall.column_deviation import PRESETS, ColumnDesign
from groundstation.survey.well.trajectory import Trajectory

LEG = 2.0
SMALL = 1e-5  # rad
Angles = list[tuple[float, float]]  # inclination and azimuth of each station, rad
leans = st.lists(st.tuples(st.floats(0.01, 1.0), st.floats(-3.0, 3.0)), min_size=2, max_size=8)


def hole(angles: Angles, collar: tuple[float, float] = (0.0, 0.0)) -> Trajectory:
    drawn = Trajectory(collar=known_direction(*collar))
    drawn.put([(LEG * place, known_direction(*one)) for place, one in enumerate(angles, 1)])
    return drawn


def cost(kind: SetupKind, sigma: float, drawn: Trajectory, subject: str = "", tubes: int = 1) -> float:
    one = SetupPrior(kind, subject, (0.0,), sigma, True)
    mounts = {f"mount.{n}": SetupPrior(SetupKind.MOUNT, str(n), (0.0, 0.0), 1e-3, True) for n in range(1, tubes + 1)}
    return toe_costs(SetupPriors(1, mounts | {"it": one}), drawn)["it"]


def moved(one: Trajectory, other: Trajectory) -> float:
    return float(np.linalg.norm(one.positions[-1] - other.positions[-1]))


@given(leans)
def test_north_costs_what_turning_every_station_moves_the_toe(angles: Angles) -> None:
    turned = [(inclination, azimuth + SMALL) for inclination, azimuth in angles]
    found = cost(SetupKind.NORTH, SMALL, hole(angles))
    assert found == pytest.approx(moved(hole(angles), hole(turned)), rel=1e-3, abs=1e-9)


@given(leans, st.floats(0.0, 0.03))
def test_the_collar_costs_what_leaning_it_moves_the_toe_for_it_enters_the_first_leg_alone(
    angles: Angles, inclination: float
) -> None:
    """To first order in the bend of the first leg: an arc of 0.06 rad is longer than its chord by 2e-4."""
    bent = [(0.03 * lean, azimuth) for lean, azimuth in angles]
    leaning = moved(hole(bent, (inclination, 0.0)), hole(bent, (inclination + SMALL, 0.0)))
    assert cost(SetupKind.COLLAR, SMALL, hole(bent)) == pytest.approx(leaning, rel=1e-3)


@given(leans)
def test_the_tilt_of_the_one_mount_costs_at_most_the_length_and_about_what_tilting_all_stations_does(
    angles: Angles,
) -> None:
    """In a plane all stations tilt to the same side, which moves the toe by the length but for half the last legs."""
    plane = [(inclination, 0.0) for inclination, _ in angles]
    tilted = moved(hole(plane), hole([(inclination + SMALL, 0.0) for inclination, _ in angles]))
    found = cost(SetupKind.MOUNT, SMALL, hole(plane), "1")
    assert tilted <= found * (1.0 + 1e-6)
    assert found == pytest.approx(tilted, abs=LEG * SMALL)


def test_a_yaw_that_may_be_any_costs_at_most_the_root_mean_square_chord() -> None:
    """Of an angle uniform on the circle the chord is 2 sin(a / 2), whose mean square is 2."""
    drawn = hole([(0.1, 0.5)] * 5)
    angles = np.linspace(-math.pi, math.pi, 100_001)
    closure = math.hypot(*drawn.positions[-1][:2])
    chords = closure * math.sqrt(float(np.mean((2.0 * np.sin(angles / 2.0)) ** 2)))
    assert cost(SetupKind.NORTH, math.pi / math.sqrt(3.0), drawn) == pytest.approx(chords, rel=1e-4)


def test_a_joint_costs_what_is_surveyed_below_it() -> None:
    drawn = hole([(0.1, 0.0)] * 5)
    costs = [cost(SetupKind.JOINT, 1e-3, drawn, subject, tubes=5) for subject in ("drive-5", "5-4", "3-2", "2-1")]
    assert costs == sorted(costs, reverse=True)
    assert costs[0] == pytest.approx(1e-3 * math.hypot(*drawn.positions[-1][:2]))
    assert costs[-1] == pytest.approx(1e-3 * LEG * math.sin(0.1), rel=1e-6)
    assert cost(SetupKind.JOINT, 1e-3, drawn, "9-8", tubes=5) == 0.0


def test_independent_mounts_together_cost_what_their_mean_does() -> None:
    drawn = hole([(0.1, 0.0)] * 5)
    one, each = cost(SetupKind.MOUNT, 1e-3, drawn, "1"), cost(SetupKind.MOUNT, 1e-3, drawn, "1", tubes=5)
    assert math.sqrt(5.0) * each == pytest.approx(one / math.sqrt(5.0))


def test_before_the_first_survey_the_hole_is_that_of_the_design() -> None:
    design = ColumnDesign("K1", inclination=0.2, azimuth=1.0, length=20.0, radius=0.6, tolerance=PRESETS["en-12716"])
    drawn = designed_course(design, LEG)
    assert len(drawn) == 11
    assert drawn.md[-1] == 20.0
    assert math.hypot(*drawn.positions[-1][:2]) == pytest.approx(20.0 * math.sin(0.2))
