"""Probability of anything open in a wall or a grid, against drawn ones: shared errors, radii, heads, voids."""

import math

import numpy as np
import pytest
from walls_by_sampling import joint_thickness, uncovered

from groundstation.survey.wall.as_built import Columns
from groundstation.survey.wall.column_joint import largest_distance, probability_beyond, probability_thin
from groundstation.survey.wall.column_state import ColumnState
from groundstation.survey.wall.plane_errors import PlaneErrors
from groundstation.survey.wall.voids import triples_of
from groundstation.survey.wall.wall_joints import (
    Detour,
    judge_joints,
    neighbours_in_grid,
    neighbours_in_line,
    pair_radii,
    with_detours,
)
from groundstation.survey.wall.wall_system import system_probability
from groundstation.survey.wall.wall_verdict import FindingKind, WallVerdict, judge_columns

RADIUS, REQUIRED = 0.6, 0.8
DRAWS = 200_000


def columns_of(
    heads: np.ndarray,
    own: float,
    shared: np.ndarray | None = None,
    *,
    cv: float = 0.0,
    correlation: float = 1.0,
    planes: int = 3,
) -> Columns:
    """Vertical columns whose own errors grow to ``own`` m in each direction; ``shared`` (columns, 2, s) likewise."""
    count, depths = len(heads), np.linspace(0.0, 20.0, planes)
    growth = (depths / 20.0)[None, :, None, None]
    mine = np.broadcast_to(own * growth * np.eye(2), (count, planes, 2, 2)).copy()
    ours = np.zeros((count, planes, 2, 0)) if shared is None else shared[:, None] * growth
    centres = np.repeat(heads[:, None, :], planes, axis=1)
    covs = mine @ np.swapaxes(mine, -1, -2) + ours @ np.swapaxes(ours, -1, -2)
    shape = (count, planes)
    names = [f"C{k + 1}" for k in range(count)]
    return Columns(
        names, depths, centres, covs, heads, centres.copy(), np.full(shape, ColumnState.SURVEYED, np.int8),
        PlaneErrors.of_planes(mine), PlaneErrors.of_planes(ours), np.full(shape, RADIUS),
        np.full(shape, RADIUS * cv), correlation,
    )  # fmt: skip


def line(count: int, spacing: float) -> np.ndarray:
    return np.stack([np.zeros(count), spacing * np.arange(count)], axis=1)


@pytest.mark.slow
@pytest.mark.parametrize("cv", [0.03, 0.05, 0.10, 0.15])
@pytest.mark.parametrize("correlation", [0.0, 0.6, 1.0])
def test_uncertain_radii_make_a_joint_as_doubtful_as_drawn_columns(cv: float, correlation: float) -> None:
    std = 0.0577  # of the distance: with radii that are known the joint is too thin with 6.8e-3
    limit = largest_distance(RADIUS, REQUIRED)
    assert float(probability_beyond(np.array([0.0, 0.75]), std**2 * np.eye(2), limit)) == pytest.approx(
        6.8e-3, rel=0.01
    )
    columns = columns_of(line(2, 0.75), std / math.sqrt(2.0), cv=cv, correlation=correlation)
    found = judge_joints(columns, neighbours_in_line(2, closed=False), REQUIRED).probability[0, -1]
    rng = np.random.default_rng(1)
    first, second = rng.normal(0.0, std / math.sqrt(2.0), (2, DRAWS, 2))
    common, alone = rng.standard_normal(DRAWS), rng.standard_normal((2, DRAWS))
    r1, r2 = RADIUS * (1.0 + cv * (math.sqrt(correlation) * common + math.sqrt(1.0 - correlation) * alone))
    thick = joint_thickness(first, second + np.array([0.0, 0.75]), r1, r2)
    drawn = float(np.mean(thick < REQUIRED))
    assert found == pytest.approx(drawn, rel=0.03, abs=4.0 * math.sqrt(drawn / DRAWS))


@pytest.mark.slow
def test_a_coefficient_of_variation_of_ten_percent_makes_a_good_joint_a_bad_one() -> None:
    chances = []
    for cv in (0.0, 0.03, 0.05, 0.10, 0.15):
        columns = columns_of(line(2, 0.75), 0.0408, cv=cv)
        chances.append(judge_joints(columns, neighbours_in_line(2, closed=False), REQUIRED).probability[0, -1])
    assert chances == pytest.approx([6.8e-3, 0.030, 0.080, 0.21, 0.29], rel=0.03)


def test_radii_known_exactly_at_a_certain_place_are_one_step() -> None:
    """The heads of columns whose places are known: only the radius decides."""
    columns = columns_of(line(2, 0.75), 0.0, cv=0.1)
    pairs = neighbours_in_line(2, closed=False)
    found = judge_joints(columns, pairs, REQUIRED).probability[0, 0]
    needed = math.hypot(0.5 * 0.75, 0.5 * REQUIRED)
    expected = 0.5 * math.erfc((RADIUS - needed) / (0.1 * RADIUS) / math.sqrt(2.0))
    assert found == pytest.approx(expected, rel=1e-4)
    radii, cov = pair_radii(columns, pairs)
    small = probability_thin(np.array([[0.0, 0.75]]), np.zeros((1, 2, 2)), radii[0, :1], 1e-4 * cov[0, :1], REQUIRED)
    assert small[0] < 1e-12


def test_what_columns_share_does_not_open_their_joint() -> None:
    rake = 10.0 * math.tan(math.radians(15.0)) * math.radians(3.0)  # a yaw error of 3 deg on columns raked by 15 deg
    alike = np.broadcast_to(np.array([[0.0], [rake]]), (2, 2, 1))
    pairs = neighbours_in_line(2, closed=False)
    shared = judge_joints(columns_of(line(2, 0.75), 0.03, alike), pairs, REQUIRED).probability[0, -1]
    apart = np.zeros((2, 2, 2))
    apart[0, 1, 0] = apart[1, 1, 1] = rake
    independent = judge_joints(columns_of(line(2, 0.75), 0.03, apart), pairs, REQUIRED).probability[0, -1]
    assert shared == pytest.approx(
        float(probability_beyond(np.array([0.75, 0.0]), 2 * 0.03**2 * np.eye(2), 0.8944)), rel=2e-2
    )
    assert shared < 1e-3
    assert independent > 0.2


@pytest.mark.slow
def test_the_probability_of_any_opening_is_that_of_drawn_walls() -> None:
    """Ten columns with shared errors of different size, own errors, uncertain heads and radii: about 1e-3."""
    count, cv, rho = 10, 0.02, 0.5
    heads = line(count, 0.75)
    shared = np.zeros((count, 2, 1))
    shared[:, 1, 0] = 0.03 * np.linspace(-1.0, 1.0, count)  # pulls the wall apart evenly
    head = 0.008
    columns = columns_of(heads, 0.020, shared, cv=cv, correlation=rho)
    mine, ours = columns.own.at(range(count)), columns.shared.at(range(count))
    mine = np.concatenate([mine, np.broadcast_to(head * np.eye(2), (count, 3, 2, 2))], axis=-1)
    covs = mine @ np.swapaxes(mine, -1, -2) + ours @ np.swapaxes(ours, -1, -2)
    columns = Columns(
        columns.names, columns.depths, columns.centres, covs, columns.designs, columns.planned, columns.states,
        PlaneErrors.of_planes(mine),        columns.shared, columns.radii, columns.radius_stds, rho,
    )  # fmt: skip
    pairs = neighbours_in_line(count, closed=False)
    found = system_probability(columns, judge_joints(columns, pairs, REQUIRED), REQUIRED)
    rng = np.random.default_rng(2)
    opened, draws = 0, 0
    for _ in range(20):
        n = 50_000
        place = heads + rng.normal(0.0, head, (n, count, 2))
        place += rng.normal(0.0, 0.020, (n, count, 2)) + rng.standard_normal((n, 1, 1)) * shared[None, :, :, 0]
        radius = RADIUS * (
            1.0
            + cv
            * (math.sqrt(rho) * rng.standard_normal((n, 1)) + math.sqrt(1.0 - rho) * rng.standard_normal((n, count)))
        )
        thick = joint_thickness(place[:, :-1], place[:, 1:], radius[:, :-1], radius[:, 1:])
        opened, draws = opened + int(np.count_nonzero(np.any(thick < REQUIRED, axis=1))), draws + n
    drawn = opened / draws
    assert 3e-4 < drawn < 3e-3
    assert found.probability == pytest.approx(drawn, rel=0.2)
    assert found.standard_error < 0.05 * found.probability


@pytest.mark.slow
def test_the_probability_of_a_void_between_four_columns_is_that_of_drawn_ones() -> None:
    spacing, std = 0.81, 0.022  # the middle is covered by 2.7 cm
    heads = np.array([[0.0, 0.0], [0.0, spacing], [spacing, 0.0], [spacing, spacing]])
    columns = columns_of(heads, std)
    pairs = neighbours_in_grid(heads, spacing)
    required = 0.05  # the joints hold: only the middle can open
    found = system_probability(
        columns, judge_joints(columns, pairs, required), required, triples_of(heads, 1.75 * spacing)
    )
    rng = np.random.default_rng(3)
    n = 400_000
    centres = heads + rng.normal(0.0, std, (n, 4, 2))
    # the middle of the four is covered unless opposite ones are far apart: only those are looked at closely
    wide = [np.linalg.norm(centres[:, a] - centres[:, b], axis=1) for a, b in ((0, 3), (1, 2))]
    close = np.flatnonzero(np.minimum(*wide) > 2.0 * RADIUS - 0.01)
    drawn = np.count_nonzero(uncovered(centres[close], np.full((len(close), 4), RADIUS), 0.05)) / n
    assert 3e-4 < drawn < 5e-3
    assert found.probability == pytest.approx(drawn, rel=0.2)
    assert found.standard_error < 0.1 * found.probability


def test_small_probabilities_keep_their_relative_accuracy() -> None:
    columns = columns_of(line(2, 0.75), 0.0145)
    pairs = neighbours_in_line(2, closed=False)
    found = judge_joints(columns, pairs, REQUIRED)
    assert 1e-13 < found.probability[0, -1] < 1e-6
    whole = system_probability(columns, found, REQUIRED)
    assert whole.probability == pytest.approx(found.probability[0, -1], rel=0.1)


def test_good_joints_make_a_doubtful_wall_when_there_are_many() -> None:
    columns = columns_of(line(40, 0.75), 0.0305)
    pairs = neighbours_in_line(40, closed=False)
    found = judge_columns(columns, pairs, REQUIRED)
    assert float(np.nanmax(found.joints.probability)) < 0.01 < found.system.probability
    assert [finding.kind for finding in found.findings] == [FindingKind.SYSTEM]
    assert found.verdict is WallVerdict.NOT_PROVEN


def test_a_remedial_column_closes_an_opening_and_its_own_uncertainty_counts() -> None:
    heads = np.array([[0.0, 0.0], [0.0, 1.3], [0.0, 0.65]])
    columns = columns_of(heads, 0.01)
    pairs = np.array([[0, 1]])
    assert judge_columns(columns, pairs, REQUIRED).verdict is WallVerdict.NOT_TIGHT
    detour = Detour(0, np.array([[0, 2], [2, 1]]))
    closed = judge_columns(columns, pairs, REQUIRED, detours=[detour])
    assert closed.verdict is WallVerdict.TIGHT
    doubtful = judge_columns(columns_of(heads, 0.1), pairs, REQUIRED, detours=[detour])
    assert doubtful.verdict is WallVerdict.NOT_PROVEN
    assert doubtful.system.probability == pytest.approx(drawn_detour(heads, 0.1), rel=0.1)


def drawn_detour(heads: np.ndarray, std: float) -> float:
    rng = np.random.default_rng(4)
    place = heads + rng.normal(0.0, std, (DRAWS, 3, 2))
    r = np.full(DRAWS, RADIUS)
    direct, first, second = (joint_thickness(place[:, a], place[:, b], r, r) for a, b in ((0, 1), (0, 2), (2, 1)))
    return float(np.mean((direct < REQUIRED) & ((first < REQUIRED) | (second < REQUIRED))))


def test_joints_that_are_hardly_ever_thin_add_up_beside_one_that_is() -> None:
    """Thirty joints six sigmas off and one 5.6: each alone as good as nothing, and together most of what is left."""
    std, limit = 0.003, largest_distance(RADIUS, REQUIRED)
    gaps = limit - math.sqrt(2.0) * std * np.array([5.6, *[6.02] * 30])
    heads = np.stack([np.zeros(32), np.concatenate([[0.0], np.cumsum(gaps)])], axis=1)
    columns = columns_of(heads, std)
    found = judge_joints(columns, neighbours_in_line(32, closed=False), REQUIRED)
    tails = 0.5 * np.array([math.erfc(z / math.sqrt(2.0)) for z in (5.6, 6.02)])
    whole = system_probability(columns, found, REQUIRED).probability
    assert whole == pytest.approx(tails[0] + 30.0 * tails[1], rel=0.1)
    assert whole > 2.5 * tails[0]


def test_either_leg_of_a_way_by_a_remedial_column_may_be_thin() -> None:
    """Two legs alike, each as doubtful as a joint of two columns that err by so much: the way twice as much."""
    std, leg = 0.05, 0.75
    heads = np.array([[0.0, 0.0], [0.0, 2.0 * leg], [0.0, leg]])
    columns = columns_of(heads, std)
    direct = judge_joints(columns, np.array([[0, 1]]), REQUIRED)
    found = with_detours(columns, direct, [Detour(0, np.array([[0, 2], [2, 1]]))], REQUIRED)
    limit = largest_distance(RADIUS, REQUIRED)
    one = float(probability_beyond(np.array([0.0, leg]), 2.0 * std**2 * np.eye(2), limit))
    assert 0.01 < one < 0.1
    assert found.probability[0, -1] == pytest.approx(2.0 * one, rel=1e-9)


@pytest.mark.parametrize("place", [0.6, 0.7, 0.8])
def test_a_way_by_a_remedial_column_is_as_thick_as_its_thinner_leg(place: float) -> None:
    heads = np.array([[0.0, 0.0], [0.0, 1.4], [0.0, place]])
    columns = columns_of(heads, 0.01)
    direct = judge_joints(columns, np.array([[0, 1]]), REQUIRED)
    found = with_detours(columns, direct, [Detour(0, np.array([[0, 2], [2, 1]]))], REQUIRED)
    longer = max(place, 1.4 - place)
    np.testing.assert_allclose(found.distance, longer)
    np.testing.assert_allclose(found.thickness, 2.0 * math.sqrt(RADIUS**2 - 0.25 * longer**2))
