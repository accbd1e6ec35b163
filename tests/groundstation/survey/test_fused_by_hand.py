"""Fusion, shared errors, transport and depths by hand: parts that differ, none zero, and numeric derivatives."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest

from groundstation.survey.fusion import fusion as fusion_room
from groundstation.survey.fusion.fusion import (
    DEPARTED,
    QUADRATIC_TO,
    GrowingBayes,
    Weighting,
    adaptive_weighting,
    fuse_by_scheme,
    judge_departure,
    sequence_weights,
)
from groundstation.survey.fusion.packed import Packed
from groundstation.survey.fusion.resolve import (
    Direction,
    Quality,
    angle_stds,
    check_all,
    combine_imus,
    known_direction,
    resolve_direction,
)
from groundstation.survey.fusion.shared import SharedErrors, causes_of_all
from groundstation.survey.fusion.sphere_direction import SphereDirection
from groundstation.survey.fusion.survey_trust import trust_of, with_yaws_of
from groundstation.survey.fusion.transport import carry_directions, gamma_bend_stds
from groundstation.survey.fusion.trust_level import Trust
from groundstation.survey.well.depth_errors import DepthErrors, mean_depth
from telemetry.messages import NodeFlag

Array = npt.NDArray[np.float64]
DEG = math.pi / 180.0
G = 9.81


def unit(inclination_deg: float, azimuth_deg: float) -> Array:
    i, a = inclination_deg * DEG, azimuth_deg * DEG
    return np.array([math.sin(i) * math.cos(a), math.sin(i) * math.sin(a), math.cos(i)])


def covariance(seed: int, size: int, scale: float) -> Array:
    root = np.random.default_rng(seed).standard_normal((size, size))
    return np.asarray(scale**2 * (root @ root.T + 0.3 * np.eye(size)))


def reading(seed: int) -> SphereDirection:
    """A direction whose own errors, columns and yaws are like no other's."""
    columns = 1e-3 * np.random.default_rng(100 + seed).uniform(0.3, 1.0, (3, 4))
    yaws = 1e-6 * (seed + 1), 2e-6 * (seed + 2)
    return SphereDirection(unit(3.0 + seed, 40.0 + 7.0 * seed), covariance(seed, 3, 1e-3), Packed(columns), yaws)


@pytest.mark.parametrize(
    ("power", "expected"), [(0, [1, 1, 1, 1]), (1, [1, 2, 3, 4]), (2, [1, 4, 9, 16]), (3, [1, 8, 27, 64])]
)
def test_the_newest_reading_has_the_largest_weight(power: int, expected: list[int]) -> None:
    assert sequence_weights(4, power).tolist() == pytest.approx([one / sum(expected) for one in expected])


def test_a_scheme_weighs_variances_by_the_square_of_its_weights_and_columns_by_themselves() -> None:
    readings, weights = [reading(k) for k in range(3)], (1.0 / 14.0, 4.0 / 14.0, 9.0 / 14.0)
    fused = fuse_by_scheme(readings, Weighting.QUADRATIC)
    assert isinstance(fused, SphereDirection)
    lean = sum(w * one.lean for w, one in zip(weights, readings, strict=True))
    np.testing.assert_allclose(fused.lean, lean, rtol=1e-12)
    own = sum(w**2 * one.own for w, one in zip(weights, readings, strict=True))
    np.testing.assert_allclose(fused.own, own, rtol=1e-12)
    columns = sum(w * one.packed.columns() for w, one in zip(weights, readings, strict=True))
    np.testing.assert_allclose(fused.packed.columns(), columns, rtol=1e-12)
    for place in range(2):
        yaw_var = sum(w**2 * one.yaw_vars[place] for w, one in zip(weights, readings, strict=True))
        assert fused.yaw_vars[place] == pytest.approx(yaw_var, rel=1e-12)


@pytest.mark.parametrize(
    ("size", "weighting"),
    [
        (DEPARTED, Weighting.LINEAR),
        (math.nextafter(DEPARTED, 9.0), Weighting.QUADRATIC),
        (QUADRATIC_TO, Weighting.QUADRATIC),
        (math.nextafter(QUADRATIC_TO, 9.0), Weighting.CUBIC),
    ],
)
def test_a_departure_of_exactly_a_limit_has_the_milder_weights(
    monkeypatch: pytest.MonkeyPatch, size: float, weighting: Weighting
) -> None:
    monkeypatch.setattr(fusion_room, "newest_departure", lambda readings: (np.zeros(2), size))
    assert adaptive_weighting([]) is weighting


FAR, NEAR = DEPARTED + 1.0, DEPARTED - 0.5
NORTH, SOUTH, EAST = np.array([1.0, 0.1]), np.array([-1.0, 0.1]), np.array([0.05, 1.0])


@pytest.mark.parametrize(
    ("seen", "moved"),
    [
        ([], False),
        ([(NORTH, FAR)], True),
        ([(EAST, FAR)], True),  # to the same side, if only just
        ([(SOUTH, FAR)], False),
        ([(NORTH, NEAR)], False),
        ([(NORTH, FAR), (NORTH, FAR)], True),
        ([(NORTH, FAR), (SOUTH, FAR)], False),
        ([(NORTH, FAR), (NORTH, NEAR)], False),
    ],
)
def test_a_hole_has_moved_where_every_neighbour_that_can_tell_departed_to_the_same_side(
    seen: list[tuple[Array, float]], moved: bool
) -> None:
    assert judge_departure((NORTH, FAR), seen).moved == moved
    assert not judge_departure((NORTH, NEAR), seen).moved


@pytest.mark.parametrize(("place", "is_known"), [(1, False), (4, False), (5, True), (6, True)])
def test_a_fused_station_is_forgotten_when_any_reading_of_it_changes(place: int, is_known: bool) -> None:
    growing = GrowingBayes()
    for _ in range(2):
        growing.of(2, 5, lambda begin, end: [reading(k) for k in range(begin, end)])
        assert growing.known(2, 5) is not None
        growing.forget(place)
        assert (growing.known(2, 5) is not None) == is_known


def test_what_stops_share_is_of_mount_joints_and_axes_in_their_parts() -> None:
    by_yaw = np.array([[0.3, -0.2, 0.0], [0.1, 0.4, 0.0]])
    by_force = np.random.default_rng(5).uniform(0.01, 0.2, (2, 3, 3))
    errors = SharedErrors()
    places = [errors.places_of(4, [3, 2, 1]), errors.places_of(2, [1])]  # four joints above one, two above the other
    systematic, mount, bias = np.array([9e-6, 5e-6]), 2e-6, 3e-3
    causes = causes_of_all(by_yaw, by_force, places, systematic, mount, bias)
    for k, joints in enumerate((4, 2)):
        np.testing.assert_allclose(causes[k, :, 0], math.sqrt(mount) * by_yaw[k], rtol=1e-12)
        each = math.sqrt((systematic[k] - mount) / joints)
        np.testing.assert_allclose(causes[k, :, 1], each * by_yaw[k], rtol=1e-12)
        np.testing.assert_allclose(causes[k, :, 2:], bias * by_force[k], rtol=1e-12)
    small = causes_of_all(by_yaw, by_force, places, np.array([1e-6, 1e-6]), mount, bias)
    np.testing.assert_allclose(small[:, :, 0], 1e-3 * by_yaw, rtol=1e-12)  # a mount is no more than all there is
    assert not small[:, :, 1].any()


def test_two_imus_are_better_than_either_by_their_information() -> None:
    covs = np.array([np.diag([1e-6, 4e-6, 9e-6]), np.diag([4e-6, 4e-6, 1e-6])])
    forces = np.array([[0.1, 0.2, -9.8], [0.2, 0.4, -9.7]])
    mean, cov = combine_imus(forces, covs)
    np.testing.assert_allclose(np.diag(cov), [0.8e-6, 2e-6, 0.9e-6], rtol=1e-12)
    np.testing.assert_allclose(mean, [0.12, 0.3, -9.71], rtol=1e-12)


@pytest.mark.parametrize(("inclination_deg", "azimuth_deg"), [(20.0, 0.0), (50.0, 120.0), (75.0, 300.0)])
def test_angles_err_by_the_lean_over_cosine_and_sine(inclination_deg: float, azimuth_deg: float) -> None:
    tangent, i = unit(inclination_deg, azimuth_deg), inclination_deg * DEG
    along = tangent[:2] / np.linalg.norm(tangent[:2])
    across = np.array([-along[1], along[0]])
    cov = 1e-3**2 * np.outer(along, along) + 3e-3**2 * np.outer(across, across)
    inclination, azimuth = angle_stds(tangent[:2], float(tangent[2]), cov)
    assert inclination == pytest.approx(1e-3 / math.cos(i), rel=1e-9)
    assert azimuth == pytest.approx(3e-3 / math.sin(i), rel=1e-9)


def tangent_of(force: Array, yaw: float) -> Array:
    """Downhole in north, east and down: against the force, turned by the yaw about the tube."""
    x, y, z = force / np.linalg.norm(force)
    return np.array([math.cos(yaw) * x - math.sin(yaw) * y, math.sin(yaw) * x + math.cos(yaw) * y, -z])


def test_a_direction_errs_as_its_derivatives_say() -> None:
    """Errors of two axes and of the yaw together: a wrong sign shows in what they have in common."""
    force, yaw, step = np.array([2.0, -3.0, -8.9]), 0.7, 1e-6
    cov, yaw_var = covariance(3, 3, 2e-3), 4e-6
    found = resolve_direction(force, cov, yaw, yaw_var)
    np.testing.assert_allclose(found.tangent, tangent_of(force, yaw), rtol=1e-12)
    by_yaw = (tangent_of(force, yaw + step) - tangent_of(force, yaw - step)) / (2.0 * step)
    by_force = np.array(
        [(tangent_of(force + step * e, yaw) - tangent_of(force - step * e, yaw)) / (2.0 * step) for e in np.eye(3)]
    ).T
    np.testing.assert_allclose(found.by_yaw, by_yaw, atol=1e-8)
    np.testing.assert_allclose(found.by_force, by_force, atol=1e-8)
    np.testing.assert_allclose(
        found.cov, by_force @ cov @ by_force.T + yaw_var * np.outer(by_yaw, by_yaw), rtol=1e-5, atol=1e-14
    )


@pytest.mark.parametrize(("part", "moved"), [(0.9, False), (1.1, True)])
def test_a_stop_moved_where_its_mean_is_noisier_than_three_times_its_sensor(part: float, moved: bool) -> None:
    samples, std = 32, 3e-3
    var = part * (3.0 * std) ** 2 / samples
    forces, covs = np.array([[[0.0, 0.1, -G]]]), np.array([[np.diag([var, 0.5 * var, 0.1 * var])]])
    (quality,) = check_all(forces, covs, combine_imus(forces, covs), G, [samples], [100.0], std)
    assert (Quality.MOTION in quality) == moved


WHAT_A_FLAG_DOES = {
    NodeFlag.NONE: Trust.FULL,
    NodeFlag.RESTORED: Trust.FULL,
    NodeFlag.AIDING_OLD: Trust.FULL,
    NodeFlag.RESTORED | NodeFlag.AIDING_OLD: Trust.UNKNOWN_YAW,
    NodeFlag.YAW_UNTRUSTED: Trust.UNKNOWN_YAW,
    NodeFlag.INNOVATION_REJECTED: Trust.UNKNOWN_YAW,
    NodeFlag.RATE_EXCEEDED: Trust.UNKNOWN_YAW,
    NodeFlag.BIAS_UNKNOWN: Trust.UNKNOWN_YAW,
    NodeFlag.NOT_SAVED: Trust.FULL,
    NodeFlag.DRIVE_UNTOLD | NodeFlag.LOWER_UNTOLD: Trust.FULL,
    NodeFlag.SENSOR_FAULT: Trust.SET_ASIDE,
    NodeFlag.SENSOR_FAULT | NodeFlag.YAW_UNTRUSTED: Trust.SET_ASIDE,
}


@pytest.mark.parametrize("flags", WHAT_A_FLAG_DOES)
def test_each_flag_has_its_effect_alone_and_with_others(flags: NodeFlag) -> None:
    assert trust_of(flags) is WHAT_A_FLAG_DOES[flags]
    assert trust_of(flags | NodeFlag.SENSOR_FAULT) is Trust.SET_ASIDE
    if not flags & NodeFlag.AIDING_OLD:
        assert trust_of(flags | NodeFlag.NOT_SAVED) is WHAT_A_FLAG_DOES[flags]


def test_a_flag_of_a_later_version_sets_a_survey_aside() -> None:
    strange = NodeFlag(1 << 20) if (1 << 20) not in [int(one) for one in NodeFlag] else NodeFlag(1 << 25)
    assert trust_of(strange) is Trust.SET_ASIDE


def test_an_unknown_yaw_is_added_to_what_was_random_in_it() -> None:
    found = resolve_direction(np.array([2.0, -3.0, -8.9]), covariance(3, 3, 2e-3), 0.7, 4e-6)
    more = with_yaws_of(found, 5e-3)
    assert float(more.yaw_var) == pytest.approx(5e-3 + 4e-6, rel=1e-12)
    np.testing.assert_allclose(more.cov - found.cov, 5e-3 * np.outer(found.by_yaw, found.by_yaw), atol=1e-15)


def test_a_path_that_bends_evenly_is_off_by_a_twelfth_of_its_square() -> None:
    """Legs of 6 and 9 deg that bend by 20 deg against each other: 2 x 20 deg over their sum, of every rad."""
    first, second, bend = 6.0 * DEG, 9.0 * DEG, 20.0 * DEG
    start, way = np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])
    middle = math.cos(first) * start + math.sin(first) * way
    on = math.cos(first) * way - math.sin(first) * start
    turned = math.cos(bend) * on + math.sin(bend) * np.cross(middle, on)
    last = math.cos(second) * middle + math.sin(second) * turned
    found = gamma_bend_stds(np.array([start, middle, last]), np.zeros(2, bool))
    each = 2.0 * bend / (first + second)
    expected = [first**2 / 12.0 * first * each, second**2 / 12.0 * second * each]
    np.testing.assert_allclose(np.abs(found), expected, rtol=1e-9)


def stations() -> tuple[Direction, list[Direction]]:
    """A head that is known and three stations whose errors share nothing."""
    leans = [unit(20.0, 10.0), unit(28.0, 45.0), unit(35.0, 90.0)]
    measured = [
        Direction(one[:2], float(one[2]), covariance(k, 2, 1e-3 * (k + 1)), np.zeros((2, 0)))
        for k, one in enumerate(leans)
    ]
    return known_direction(15.0 * DEG, 0.0), measured


def carried(measured: list[Direction]) -> list[tuple[Array, float]]:
    head, _ = stations()
    return [(one.direction.lean, one.gamma) for one in carry_directions(head, measured, range(len(measured) + 1))]


def moved(measured: list[Direction], station: int, axis: int, by: float) -> list[Direction]:
    lean = measured[station].lean + by * np.eye(2)[axis]
    down = math.sqrt(1.0 - float(lean @ lean))
    return [*measured[:station], replace(measured[station], lean=lean, down=down), *measured[station + 1 :]]


def test_carried_directions_err_as_numeric_derivatives_say_by_their_own_and_by_those_above() -> None:
    head, measured = stations()
    found = carry_directions(head, measured, range(len(measured) + 1))
    step, count = 1e-6, len(measured)
    by_lean, by_gamma = np.zeros((count, 2, count, 2)), np.zeros((count, count, 2))
    for station in range(count):
        for axis in range(2):
            more, less = (carried(moved(measured, station, axis, sign * step)) for sign in (1.0, -1.0))
            for k in range(count):
                by_lean[k, :, station, axis] = (more[k][0] - less[k][0]) / (2.0 * step)
                by_gamma[k, station, axis] = (more[k][1] - less[k][1]) / (2.0 * step)
    tangents = np.array([[*one.direction.lean, one.direction.down] for one in found])
    bends = np.cumsum(gamma_bend_stds(np.array([[*head.lean, head.down], *tangents]), np.zeros(count, bool)))
    for k in range(count):
        across = np.array([-tangents[k, 1], tangents[k, 0]])
        parts = [by_lean[k, :, j] @ measured[j].cov @ by_lean[k, :, j].T for j in range(count)]
        expected = np.sum(parts, axis=0) + bends[k] ** 2 * np.outer(across, across)
        np.testing.assert_allclose(found[k].direction.total_cov, expected, rtol=1e-4, atol=1e-12)
        var = sum(float(by_gamma[k, j] @ measured[j].cov @ by_gamma[k, j]) for j in range(count)) + bends[k] ** 2
        assert found[k].std == pytest.approx(math.sqrt(var), rel=1e-4)


@pytest.mark.parametrize("told", [False, True])
def test_a_depth_errs_by_scale_offset_lengths_and_its_readings(told: bool) -> None:
    """Two nodes read it: one at the bit, one with tubes 8 and 7 below it; each has a half of what is its own."""
    errors = SharedErrors()
    places = [errors.depth_places_of([]), errors.depth_places_of([8, 7])]
    stds = DepthErrors(scale_std=2e-3, offset_std=0.03, tube_std=4e-3, reading_std=5e-3)
    lengths = {int(place): 9e-3 for place in errors.places_of_lengths([7]).values()} if told else {}
    found = mean_depth(30.0, places, stds, 2.5, lengths)
    columns = found.columns.columns()[0]
    scale, offset, eight, seven = errors.depth_places_of([8, 7])
    assert columns[scale] == pytest.approx(2e-3 * (30.0 + 2.5 * 1.0))  # the bit is one tube deeper in the mean
    assert columns[offset] == pytest.approx(0.03)
    assert columns[eight] == pytest.approx(4e-3 / 2.0)
    assert columns[seven] == pytest.approx((9e-3 if told else 4e-3) / 2.0)
    assert found.own_var == pytest.approx(5e-3**2 / 2.0)
