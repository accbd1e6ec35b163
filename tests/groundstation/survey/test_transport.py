"""Transport of a string's yaw in a bent hole, against closed forms, a frame carried step by step, and sampling."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from groundstation.survey.fusion.resolve import Direction, angle_stds, direction_angles, known_direction
from groundstation.survey.fusion.transport import Carried, carry_directions
from groundstation.survey.well.trajectory import Trajectory
from sim.world.borehole import Borehole
from sim.world.truth import lean_rotation

Array = npt.NDArray[np.float64]
DEG = math.pi / 180.0
VERTICAL = known_direction(0.0, 0.0)


def tangent_of(one: Direction) -> Array:
    return np.array([*one.lean, one.down])


def carried_frame(tangents: Array) -> Array:
    """Yaw (n,) against the smallest rotation from down of a frame that no step turns about the axis. Bishop (1975)."""
    frame = lean_rotation(tangents[:1])[0]
    yaws = [0.0]
    for before, after in itertools.pairwise(tangents):
        axis = np.cross(before, after)
        sine = float(np.linalg.norm(axis))
        angle = math.atan2(sine, float(before @ after))
        frame = Rotation.from_rotvec(axis / sine * angle if sine > 0.0 else axis).as_matrix() @ frame
        against = lean_rotation(after[None])[0].T @ frame
        yaws.append(math.atan2(against[1, 0], against[0, 0]))
    return np.unwrap(yaws)


def measured(true: list[Direction], gammas: Array) -> list[Direction]:
    """What tubes in a hole measure whose yaw is taken for the head's."""
    found = []
    for one, gamma in zip(true, gammas, strict=True):
        c, s = math.cos(gamma), math.sin(gamma)
        found.append(replace(one, lean=np.array([[c, s], [-s, c]]) @ one.lean))
    return found


def surveyed(hole: Borehole, mds: Array) -> tuple[Direction, list[Direction], Array]:
    """Head, what is measured at depths (n,), and the true transport there, by a frame carried along the hole."""
    fine = np.unique(np.concatenate([np.linspace(0.0, hole.length, 4001), mds]))
    gammas = np.interp(mds, fine, carried_frame(hole.tangent(fine)[0]))
    true = [known_direction(*hole.direction(md)) for md in mds]
    return known_direction(*hole.direction(0.0)), measured(true, gammas), gammas


def carried(head: Direction, stations: list[Direction]) -> list[Carried]:
    return carry_directions(head, stations, range(len(stations) + 1))


@pytest.mark.parametrize("inclination_deg", [2.0, 30.0, 70.0, 120.0])
def test_a_helix_turns_by_one_less_its_cosine(inclination_deg: float) -> None:
    inclination, turn, count = inclination_deg * DEG, 50.0 * DEG, 500
    azimuths = turn * np.arange(1, count + 1) / count
    gammas = (1.0 - math.cos(inclination)) * azimuths
    stations = measured([known_direction(inclination, azimuth) for azimuth in azimuths], gammas)
    found = carried(known_direction(inclination, 0.0), stations)
    assert [one.gamma for one in found] == pytest.approx(gammas.tolist(), abs=1e-6)


def test_a_leg_turns_by_the_excess_of_its_triangle() -> None:
    """The vertical and two directions 90 degrees apart at 60 degrees: an excess by its angles (Girard)."""
    upper, lower = known_direction(60.0 * DEG, 0.0), known_direction(60.0 * DEG, 90.0 * DEG)
    down = np.array([0.0, 0.0, 1.0])
    corners = [down, tangent_of(upper), tangent_of(lower)]
    inside = [
        math.acos(float(np.dot(a, b) / (np.linalg.norm(a) * np.linalg.norm(b))))
        for k in range(3)
        for a, b in [(np.cross(corners[k], corners[k - 1]), np.cross(corners[k], corners[k - 2]))]
    ]
    excess = sum(inside) - math.pi
    found = carried(upper, measured([lower], np.array([excess])))
    assert found[0].gamma == pytest.approx(excess, abs=1e-12)
    assert tangent_of(found[0].direction) == pytest.approx(tangent_of(lower), abs=1e-12)


@pytest.mark.parametrize(
    ("inclination_deg", "build_deg", "turn_deg"),
    [(30.0, 0.0, 20.0), (0.0, 40.0, 60.0), (60.0, -50.0, -80.0), (5.0, 70.0, 30.0)],
)
def test_surveys_give_back_the_hole_that_a_frame_was_carried_through(
    inclination_deg: float, build_deg: float, turn_deg: float
) -> None:
    hole = Borehole.spiral(inclination_deg * DEG, 0.4, turn_deg * DEG, 40.0, build_deg * DEG)
    mds = np.linspace(1.0, 40.0, 40)
    head, stations, gammas = surveyed(hole, mds)
    found = carried(head, stations)
    assert [one.gamma for one in found] == pytest.approx(gammas.tolist(), abs=2e-4)
    for one, gamma in zip(found, gammas, strict=True):
        assert abs(one.gamma - gamma) <= 3.0 * one.std + 1e-6


def test_a_hole_in_one_plane_turns_nothing() -> None:
    stations = [known_direction(k * 10.0 * DEG, 0.7) for k in range(1, 9)]
    assert [one.gamma for one in carried(known_direction(0.0, 0.0), stations)] == pytest.approx([0.0] * 8, abs=1e-14)


directions = st.tuples(st.floats(0.0, 60.0), st.floats(0.0, 360.0))


@given(st.lists(directions, min_size=1, max_size=8), st.floats(-math.pi, math.pi))
def test_a_hole_turned_about_the_vertical_is_turned_and_nothing_else(
    places: list[tuple[float, float]], turn: float
) -> None:
    plain, turned = (
        carried(known_direction(5.0 * DEG, by), [known_direction(i * DEG, a * DEG + by) for i, a in places])
        for by in (0.0, turn)
    )
    assert [one.gamma for one in turned] == pytest.approx([one.gamma for one in plain], abs=1e-9)


@given(directions, directions, st.floats(0.05, 0.95))
def test_a_station_on_the_arc_between_two_changes_nothing(
    above: tuple[float, float], below: tuple[float, float], part: float
) -> None:
    ends = [tangent_of(known_direction(i * DEG, a * DEG)) for i, a in (above, below)]
    between = ends[0] * (1.0 - part) + ends[1] * part
    between /= np.linalg.norm(between)
    true = [Direction(t[:2], float(t[2]), np.zeros((2, 2)), np.zeros((2, 0))) for t in (between, ends[1])]
    gammas = np.array([_excess(ends[0], between), _excess(ends[0], ends[1])])
    stations = measured(true, gammas)
    with_it, without = (
        carried(known_direction(*(x * DEG for x in above)), stations),
        carried(known_direction(*(x * DEG for x in above)), stations[1:]),
    )
    assert with_it[1].gamma == pytest.approx(without[0].gamma, abs=1e-9)
    assert with_it[1].gamma == pytest.approx(gammas[1], abs=1e-9)


def _excess(one: Array, other: Array) -> float:
    """Solid angle of the vertical and two directions. Van Oosterom and Strackee, IEEE Trans. Biomed. Eng. 30 (1983)."""
    volume = one[0] * other[1] - one[1] * other[0]
    return 2.0 * math.atan2(volume, 1.0 + float(one @ other) + one[2] + other[2])


def noisy_hole() -> tuple[Direction, list[Direction]]:
    """A hole that wanders, builds and turns; random and shared errors that differ from station to station."""
    random = np.random.default_rng(5)
    stations = []
    for k in range(1, 11):
        one = known_direction((4.0 * k + 3.0 * random.standard_normal()) * DEG, 12.0 * k * DEG)
        root = 3e-3 * random.standard_normal((2, 2))
        shared = 2e-3 * random.standard_normal((2, 3))
        stations.append(replace(one, cov=root @ root.T, shared=np.concatenate([np.zeros((2, 11)), shared], axis=1)))
    return replace(known_direction(3.0 * DEG, 1.0), cov=1e-5 * np.eye(2)), stations


def drawn(one: Direction, common: Array, random: np.random.Generator) -> Direction:
    lean = one.lean + random.multivariate_normal(np.zeros(2), one.cov)
    if one.width:
        lean = lean + one.shared[:, 11:] @ common
    return replace(one, lean=lean, down=math.sqrt(1.0 - lean @ lean))


def position(head: Direction, found: list[Carried]) -> tuple[Array, Array]:
    """Last position and its covariance."""
    trajectory = Trajectory(collar=replace(head, cov=np.zeros((2, 2))))
    trajectory.extend([(2.0 * k, one.direction) for k, one in enumerate(found, 1)])
    return trajectory.points[-1].position, trajectory.points[-1].cov


@pytest.mark.parametrize(("draws", "within"), [(1000, 0.2), pytest.param(4000, 0.1, marks=pytest.mark.statistical)])
def test_covariances_of_directions_and_positions_are_those_of_draws(draws: int, within: float) -> None:
    head, stations = noisy_hole()
    claimed = [without_between(one) for one in carried(head, stations)]
    cov = position(head, claimed)[1]
    random = np.random.default_rng(7)
    leans, places = [], []
    for _ in range(draws):
        common = random.standard_normal(3)
        found = carried(drawn(head, common, random), [drawn(one, common, random) for one in stations])
        leans.append([one.direction.lean for one in found])
        places.append(position(head, found)[0])
    for k, one in enumerate(claimed):
        sampled = np.cov(np.array(leans)[:, k].T)
        assert np.trace(np.linalg.solve(one.direction.total_cov, sampled)) / 2.0 == pytest.approx(1.0, abs=within)
    sampled_cov = np.cov(np.array(places).T)[:2, :2]
    assert np.linalg.eigvals(np.linalg.solve(cov[:2, :2], sampled_cov)) == pytest.approx([1.0, 1.0], abs=1.2 * within)


def without_between(one: Carried) -> Carried:
    """What lies between stations is not drawn."""
    shared = one.direction.shared.copy()
    shared[:, 0] = 0.0
    return replace(one, direction=replace(one.direction, shared=shared))


def test_an_error_of_one_survey_does_not_grow_below_it() -> None:
    head, true = known_direction(40.0 * DEG, 0.0), [known_direction(40.0 * DEG, k * DEG) for k in range(1, 60)]
    plain = carried(head, true)
    wrong = carried(head, [*true[:20], known_direction(41.0 * DEG, 21.5 * DEG), *true[21:]])
    off = [abs(a.gamma - b.gamma) / DEG for a, b in zip(plain, wrong, strict=True)]
    assert max(off[:20]) == 0.0
    assert max(off[21:]) < 0.02
    assert max(off[21:]) - min(off[21:]) < 1e-9


def test_a_turn_in_the_horizontal_is_not_known() -> None:
    """Gravity in the tubes and the yaw against the head stay as they are: no survey shows it."""
    head = known_direction(90.0 * DEG, 0.0)
    found = carried(head, [replace(known_direction(89.9 * DEG, 0.0), cov=1e-8 * np.eye(2)) for _ in range(3)])
    assert all(angle_stds(o.direction.lean, o.direction.down, o.direction.total_cov)[1] > 1.5 for o in found)


def test_one_record_is_a_hole_by_either_setting() -> None:
    """What a string measures in a bent hole is what one that turns nothing measures in another: no survey tells."""
    hole = Borehole.spiral(20.0 * DEG, 0.0, 50.0 * DEG, 40.0, 20.0 * DEG)
    mds = np.linspace(2.0, 40.0, 20)
    head, stations, _ = surveyed(hole, mds)
    seen = np.array([direction_angles(one.lean, one.down) for one in [head, *stations]])
    other = Borehole(np.concatenate([[0.0], mds]), seen[:, 0], seen[:, 1])
    for md, one in zip(mds.tolist(), stations, strict=True):
        assert other.direction(md) == pytest.approx(direction_angles(one.lean, one.down), abs=1e-9)
