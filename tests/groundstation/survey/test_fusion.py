"""Fusing what was measured at one station: recursive Bayes, weights by order, holes that moved."""

import math
import random

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from groundstation.survey.fusion.fusion import (
    DEPARTED,
    POWERS,
    QUADRATIC_TO,
    GrowingBayes,
    StationFusion,
    Weighting,
    adaptive_weighting,
    fuse_by_bayes,
    fuse_by_scheme,
    moved_hole,
    newest_departure,
    sequence_weights,
)
from groundstation.survey.fusion.resolve import Direction
from groundstation.survey.well.trajectory import Trajectory

DEG = math.pi / 180.0
NOTHING = np.zeros((2, 0))


def lean_of(inclination: float, azimuth: float, std: float = 1e-3, joint_std: float = 0.0) -> Direction:
    """A direction with one shared column, a joint's."""
    lean = np.array([math.sin(inclination) * math.cos(azimuth), math.sin(inclination) * math.sin(azimuth)])
    shared = joint_std * np.array([[-lean[1]], [lean[0]]])
    return Direction(lean, math.cos(inclination), std**2 * np.eye(2), shared)


def near_vertical(north: float, east: float, cov: np.ndarray, shared: np.ndarray = NOTHING) -> Direction:
    lean = np.array([north, east])
    return Direction(lean, math.sqrt(1.0 - float(lean @ lean)), cov, shared)


def test_two_equal_readings_halve_the_variance_and_leave_the_joint_error_alone() -> None:
    fusion = StationFusion()
    reading = lean_of(2.0 * DEG, 1.0, 1e-3, joint_std=1e-2)
    fusion.add_reading(reading)
    fusion.add_reading(reading)
    fused = fusion.fused()
    np.testing.assert_allclose(fused.lean, reading.lean)
    np.testing.assert_allclose(fused.cov, reading.cov / 2.0, rtol=1e-9, atol=1e-18)
    np.testing.assert_allclose(fused.shared, reading.shared, rtol=1e-9)
    assert fused.down == pytest.approx(reading.down)
    assert fusion.count == 2


@given(
    st.lists(
        st.tuples(st.floats(0.001, 0.5), st.floats(0.0, 6.28), st.floats(1e-5, 1e-2), st.floats(0.0, 0.02)),
        min_size=2,
        max_size=12,
    ),
    st.randoms(),
)
def test_fusion_takes_any_order_and_never_averages_the_shared_error(
    readings: list[tuple[float, float, float, float]], shuffler: random.Random
) -> None:
    leans = [lean_of(*reading) for reading in readings]
    shuffled = leans[:]
    shuffler.shuffle(shuffled)
    first, second = fuse_by_bayes(leans), fuse_by_bayes(shuffled)
    np.testing.assert_allclose(first.lean, second.lean, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(first.cov, second.cov, rtol=1e-7, atol=1e-9 * float(np.trace(first.cov)))
    np.testing.assert_allclose(first.shared, second.shared, rtol=1e-7, atol=1e-9)
    assert first.down == pytest.approx(second.down)
    same = lean_of(0.1, 1.0, 1e-3, 0.01)
    np.testing.assert_allclose(fuse_by_bayes([same] * len(readings)).shared, same.shared, rtol=1e-9)


@given(st.lists(st.tuples(st.booleans(), st.integers(1, 6)), min_size=1, max_size=12))
def test_readings_that_grow_come_to_what_all_of_them_come_to_bit_for_bit(course: list[tuple[bool, int]]) -> None:
    """One more reading each time, or one that came late and belongs among those known."""
    growing, readings = GrowingBayes(), list[Direction]()
    for number, (is_late, columns) in enumerate(course, 1):
        shared = 1e-3 * np.ones((2, columns)) * number
        reading = near_vertical(1e-3 * number, -2e-3 * number, np.diag([1e-6, 2e-6 * number]), shared)
        place = len(readings) // 2 if is_late else len(readings)
        readings.insert(place, reading)
        growing.forget(place)
        begin = len(readings) // 3  # those before no longer count
        mine = growing.of(begin, len(readings), lambda begin, end: readings[begin:end])
        all_at_once = fuse_by_bayes(readings[begin:])
        np.testing.assert_array_equal(mine.lean, all_at_once.lean)
        np.testing.assert_array_equal(mine.cov, all_at_once.cov)
        np.testing.assert_array_equal(mine.shared, all_at_once.shared)


@given(
    st.lists(
        st.tuples(st.floats(-0.3, 0.3), st.floats(-0.3, 0.3), st.floats(1e-5, 1e-2), st.floats(1e-5, 1e-2)),
        min_size=1,
        max_size=12,
    )
)
def test_independent_readings_follow_recursive_bayes(readings: list[tuple[float, float, float, float]]) -> None:
    mean, var = np.array(readings[0][:2]), np.array(readings[0][2:]) ** 2
    for reading in readings[1:]:
        new, new_var = np.array(reading[:2]), np.array(reading[2:]) ** 2
        mean = (new_var * mean + var * new) / (var + new_var)  # eq. 3.39, 3.40
        var = 1.0 / (1.0 / var + 1.0 / new_var)  # eq. 3.41
    small = 1e-6  # so near to the vertical that the sphere is a plane
    scaled = [near_vertical(small * n, small * e, small**2 * np.diag([sn**2, se**2])) for n, e, sn, se in readings]
    fused = fuse_by_bayes(scaled)
    np.testing.assert_allclose(fused.lean / small, mean, rtol=1e-8, atol=1e-9)
    np.testing.assert_allclose(fused.cov / small**2, np.diag(var), rtol=1e-8, atol=1e-16)
    assert fused.lean @ fused.lean + fused.down**2 == pytest.approx(1.0)


def test_covariances_that_are_not_round_weigh_by_their_information() -> None:
    first, second = np.array([[4e-6, 1e-6], [1e-6, 1e-6]]), np.array([[1e-6, -5e-7], [-5e-7, 3e-6]])
    small = 1e-4
    one, other = small * np.array([0.01, 0.02]), small * np.array([0.03, -0.01])
    fused = fuse_by_bayes([near_vertical(*one, small**2 * first), near_vertical(*other, small**2 * second)])
    cov = np.linalg.inv(np.linalg.inv(first) + np.linalg.inv(second))
    mean = cov @ (np.linalg.solve(first, one) + np.linalg.solve(second, other))
    np.testing.assert_allclose(fused.cov / small**2, cov, rtol=1e-9)
    np.testing.assert_allclose(fused.lean, mean, rtol=1e-9)


@pytest.mark.parametrize("scheme", [Weighting.BAYES, Weighting.EQUAL])
def test_a_shared_error_stays_and_errors_of_their_own_average_away(scheme: Weighting) -> None:
    count, column = 9, np.array([[3e-3], [1e-3]])
    own = [np.concatenate([np.zeros((2, k)), column, np.zeros((2, count - 1 - k))], axis=1) for k in range(count)]
    cov = 1e-6 * np.eye(2)
    all_share = fuse_by_scheme([near_vertical(0.01, 0.02, cov, column) for _ in range(count)], scheme)
    none_shares = fuse_by_scheme([near_vertical(0.01, 0.02, cov, shared) for shared in own], scheme)
    np.testing.assert_allclose(all_share.total_cov, cov / count + column @ column.T, rtol=1e-9)
    np.testing.assert_allclose(none_shares.total_cov, (cov + column @ column.T) / count, rtol=1e-9)


def test_readings_of_different_width_keep_their_columns_in_place() -> None:
    narrow, wide = np.array([[1e-3], [0.0]]), np.array([[1e-3, 0.0, 2e-3], [0.0, 0.0, 0.0]])
    cov = 1e-4 * np.eye(2)
    for order in ([narrow, wide], [wide, narrow]):
        fused = fuse_by_scheme([near_vertical(0.0, 0.0, cov, shared) for shared in order], Weighting.EQUAL)
        np.testing.assert_allclose(fused.shared, [[1e-3, 0.0, 1e-3], [0.0, 0.0, 0.0]], atol=1e-18)


@pytest.mark.slow
def test_the_fused_covariance_is_what_sampling_gives_when_some_errors_are_shared() -> None:
    generator = np.random.default_rng(3)
    columns = [np.array([[2e-3, 0.0], [1e-3, 0.0]]), np.array([[2e-3, 0.0], [1e-3, 0.0]])]
    columns.append(np.array([[0.0, -1e-3], [0.0, 3e-3]]))
    covs = [np.diag([1e-6, 4e-6]), np.diag([9e-6, 1e-6]), np.diag([2e-6, 2e-6])]
    claimed = fuse_by_bayes([near_vertical(0.0, 0.0, cov, shared) for cov, shared in zip(covs, columns, strict=True)])
    errors = []
    for _ in range(5000):
        common = generator.standard_normal(2)
        readings = [
            near_vertical(*(shared @ common + np.sqrt(np.diag(cov)) * generator.standard_normal(2)), cov, shared)
            for cov, shared in zip(covs, columns, strict=True)
        ]
        errors.append(fuse_by_bayes(readings).lean)
    np.testing.assert_allclose(np.cov(np.array(errors).T), claimed.total_cov, rtol=0.12, atol=1e-7)


@given(st.integers(1, 60), st.integers(0, 3))
def test_weights_are_normalised_powers_of_the_order(count: int, power: int) -> None:
    weights = sequence_weights(count, power)
    assert weights.sum() == pytest.approx(1.0)
    assert np.all(np.diff(weights) >= 0.0)
    np.testing.assert_allclose(weights / weights[0], np.arange(1, count + 1) ** power, rtol=1e-12)


def test_cubic_weights_of_four_looks_are_hundredths() -> None:
    np.testing.assert_allclose(sequence_weights(4, 3), [0.01, 0.08, 0.27, 0.64])


@pytest.mark.parametrize(
    ("looks", "scheme", "reduction"),
    [
        (3, Weighting.LINEAR, 0.75),
        (3, Weighting.QUADRATIC, 0.536),
        (3, Weighting.CUBIC, 0.375),
        (2, Weighting.LINEAR, 0.667),
        (2, Weighting.QUADRATIC, 0.400),
        (2, Weighting.CUBIC, 0.222),
    ],
)
@pytest.mark.parametrize("change", ["inclination", "azimuth"])
def test_errors_shrink_as_in_figure_4_35(looks: int, scheme: Weighting, reduction: float, change: str) -> None:
    before = lean_of(1.0 * DEG, 120.0 * DEG)
    if change == "inclination":
        changed = [lean_of(i * DEG, 120.0 * DEG) for i in np.arange(1.5, 10.1, 0.5)]
    else:
        changed = [lean_of(1.0 * DEG, a * DEG) for a in np.arange(125.0, 200.1, 5.0)]
    for now in changed:
        readings = [before] * (looks - 1) + [now]
        errors = [float(np.linalg.norm(fuse_by_scheme(readings, s).lean - now.lean)) for s in (scheme, Weighting.EQUAL)]
        assert errors[0] / errors[1] == pytest.approx(reduction, abs=5e-4)


def test_errors_at_station_two_are_those_of_figure_4_29d() -> None:
    mds, before, now = (2.0, 4.0, 6.0, 8.0), lean_of(1.0 * DEG, 120.0 * DEG), lean_of(3.0 * DEG, 120.0 * DEG)
    fused, true = Trajectory(), Trajectory()
    for station, md in enumerate(mds):
        looks = 4 - station
        readings = [before] * looks if station != 1 else [before] * (looks - 1) + [now]
        fused.append(md, fuse_by_scheme(readings, Weighting.EQUAL))
        true.append(md, readings[-1])
    error_cm = 100.0 * (true.points[2].position - fused.points[2].position)
    assert error_cm[0] == pytest.approx(-1.16, abs=0.005)
    assert error_cm[1] == pytest.approx(2.01, abs=0.005)
    np.testing.assert_allclose(fused.points[1].position, true.points[1].position, atol=1e-12)


@pytest.mark.parametrize(
    ("size", "scheme"),
    [
        (0.0, Weighting.LINEAR),
        (DEPARTED - 0.01, Weighting.LINEAR),
        (DEPARTED + 0.01, Weighting.QUADRATIC),
        (QUADRATIC_TO - 0.01, Weighting.QUADRATIC),
        (QUADRATIC_TO + 0.01, Weighting.CUBIC),
        (100.0, Weighting.CUBIC),
    ],
)
def test_the_adaptive_scheme_leans_on_the_newest_the_more_it_departs(size: float, scheme: Weighting) -> None:
    cov = 1e-6 * np.eye(2)
    readings = [near_vertical(0.0, 0.0, cov), near_vertical(0.0, 0.0, cov)]
    readings.append(near_vertical(0.0, size * math.sqrt(1.5) * 1e-3, cov))
    assert newest_departure(readings)[1] == pytest.approx(size, rel=3e-3)  # an arc against its chord
    assert adaptive_weighting(readings) is scheme
    np.testing.assert_array_equal(
        fuse_by_scheme(readings, Weighting.ADAPTIVE).lean, fuse_by_scheme(readings, scheme).lean
    )


@pytest.mark.parametrize("scheme", [*POWERS, Weighting.BAYES, Weighting.ADAPTIVE])
def test_one_reading_alone_is_the_station(scheme: Weighting) -> None:
    reading = lean_of(0.2, 1.0, 1e-3, 0.01)
    fused = fuse_by_scheme([reading], scheme)
    np.testing.assert_allclose(fused.lean, reading.lean, rtol=1e-12)
    np.testing.assert_allclose(fused.total_cov, reading.total_cov, rtol=1e-9, atol=1e-18)
    assert fused.down == pytest.approx(reading.down)


def test_a_hole_that_goes_up_stays_up() -> None:
    fused = fuse_by_bayes([lean_of(3.0, 1.0), lean_of(3.01, 1.0)])
    assert fused.down == pytest.approx(math.cos(3.005), abs=1e-4)


def test_a_departure_is_measured_with_the_covariance_of_the_difference() -> None:
    earlier = [near_vertical(0.0, 0.0, np.diag([2e-6, 4e-6])), near_vertical(0.0, 0.0, np.diag([2e-6, 4e-6]))]
    newest = near_vertical(4e-3, 0.0, np.diag([3e-6, 1e-6]))
    difference, size = newest_departure([*earlier, newest])
    np.testing.assert_allclose(difference, [math.asin(4e-3), 0.0], rtol=1e-9, atol=1e-15)
    assert size == pytest.approx(4e-3 / math.sqrt(1e-6 + 3e-6), rel=1e-5)


def test_an_error_of_the_same_mount_cancels_in_a_departure_and_that_of_another_does_not() -> None:
    cov, column, none = 1e-6 * np.eye(2), np.array([[0.0], [5e-3]]), np.zeros((2, 1))
    before = near_vertical(0.0, 0.0, cov, np.concatenate([column, none], axis=1))
    same = near_vertical(0.0, 4e-3, cov, np.concatenate([column, none], axis=1))
    other = near_vertical(0.0, 4e-3, cov, np.concatenate([none, column], axis=1))
    assert newest_departure([before, same])[1] == pytest.approx(4e-3 / math.sqrt(2e-6), rel=1e-5)
    assert newest_departure([before, before, same])[1] == pytest.approx(4e-3 / math.sqrt(1.5e-6), rel=1e-5)
    assert newest_departure([before, other])[1] == pytest.approx(4e-3 / math.sqrt(2e-6 + 50e-6), rel=1e-5)


def test_a_first_reading_departs_from_nothing() -> None:
    difference, size = newest_departure([lean_of(0.1, 1.0)])
    assert size == 0.0
    np.testing.assert_array_equal(difference, [0.0, 0.0])


UNMOVED = [lean_of(1.0 * DEG, 0.0)] * 3
MOVED = [lean_of(1.0 * DEG, 0.0), lean_of(1.0 * DEG, 0.0), lean_of(2.0 * DEG, 0.0)]
BACK = [lean_of(1.0 * DEG, 0.0), lean_of(1.0 * DEG, 0.0), lean_of(0.0, 0.0)]


@pytest.mark.parametrize(
    ("station", "neighbours", "moved"),
    [
        (MOVED, [MOVED, MOVED], True),
        (MOVED, [MOVED], True),
        (MOVED, [MOVED, UNMOVED], False),
        (MOVED, [UNMOVED, UNMOVED], False),
        (MOVED, [BACK, MOVED], False),
        (MOVED, [BACK], False),
        (MOVED, [], False),
        (MOVED, [UNMOVED[:1]], False),
        (MOVED, [MOVED, UNMOVED[:1]], True),
        (UNMOVED, [MOVED, MOVED], False),
        (MOVED[-1:], [MOVED], False),
    ],
    ids=[
        "both agree", "one agrees", "one disagrees", "both disagree", "one to the other side", "to the other side",
        "none", "new neighbour", "one agrees, one new", "own still", "own new",
    ],
)  # fmt: skip
def test_a_hole_moved_when_all_neighbours_saw_the_same(
    station: list[Direction], neighbours: list[list[Direction]], moved: bool
) -> None:
    assert moved_hole(station, neighbours).moved is moved


def test_the_evidence_names_every_departure_that_was_looked_at() -> None:
    evidence = moved_hole(MOVED, [MOVED, UNMOVED[:1], UNMOVED])
    own = (math.sin(2.0 * DEG) - math.sin(1.0 * DEG)) / math.sqrt(1.5e-6)
    assert evidence.own == pytest.approx(own)
    assert evidence.neighbours == pytest.approx((own, 0.0))
    assert not evidence.agree


@pytest.mark.slow
@pytest.mark.parametrize("trials", [1000, pytest.param(5000, marks=pytest.mark.statistical)])
def test_holes_that_never_moved_depart_as_often_as_said(trials: int) -> None:
    generator = np.random.default_rng(4)
    false_single, false_pair, false_three = 0, 0, 0

    def station() -> list[Direction]:
        common = generator.standard_normal(3)
        readings = []
        for k in range(3):
            root = np.array([[1e-3, 0.0], [5e-4 * (k - 1), 2e-3]])
            shared = 2e-3 * np.array([[1.0, float(k == 0), 0.0], [0.5, 0.0, float(k == 2)]])
            lean = 0.01 + root @ generator.standard_normal(2) + shared @ common
            readings.append(near_vertical(lean[0], lean[1], root @ root.T, shared))
        return readings

    for _ in range(trials):
        own, upper, lower = station(), station(), station()
        false_single += newest_departure(own)[1] > DEPARTED
        false_pair += moved_hole(own, [upper]).moved
        false_three += moved_hole(own, [upper, lower]).moved
    expected = math.erfc(math.sqrt(2.0))  # 4.55 %
    std = math.sqrt(expected * (1.0 - expected) / trials)
    assert false_single / trials == pytest.approx(expected, abs=4.0 * std)
    assert false_pair <= trials * expected**2 / 2.0 + 4.0 * math.sqrt(trials * expected**2 / 2.0)
    assert false_three <= 2
