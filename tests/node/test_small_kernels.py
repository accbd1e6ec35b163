"""Small kernels of a node by hand: sums, means, weights, mounts and angles, with parts that differ and none zero.

Each is called by itself, so that only it is compiled.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from node.kernels.arithmetic.angles import advance_binary, wrap_angle, wrap_positive
from node.kernels.filter.moving_average import average_force
from node.kernels.record.filter_record import RING, default_config
from node.kernels.record.node_record import new_node
from node.kernels.record.sensor_record import OFFSET, STATIC, SWEEP
from node.kernels.sensors.alignment import fit_circle, to_tube
from node.kernels.sensors.cluster import average_ring_forces, fuse_readings
from node.kernels.sensors.correction import COLDEST, HOTTEST, correct_cycle, identity_parameters
from node.kernels.sensors.static_average import add_static, has_moved
from node.kernels.sensors.sweep import add_to_sweep
from node.kernels.string.twist import reaching_var

SIZES = np.array([2e-4, 3e-4, 5e-4, 2e-3, 3e-3, 4e-3])
MIXED = np.eye(6) + 0.4 * np.tri(6, k=-1)


def samples(count: int, seed: int = 1) -> np.ndarray:
    """Readings whose components differ and go together."""
    return (MIXED @ (SIZES[:, None] * np.random.default_rng(seed).standard_normal((6, count)))).T + 0.1 * np.arange(6)


def summed(rows: np.ndarray) -> np.ndarray:
    record = np.zeros(1, STATIC)
    for row in rows:
        assert add_static(record[0], row[:3].copy(), row[3:].copy(), 30.0, 1) == 1
    return record[0]


@pytest.mark.parametrize("count", [2, 3, 40])
def test_sums_of_a_record_are_mean_and_scatter(count: int) -> None:
    rows, record = samples(count), summed(samples(count))
    np.testing.assert_allclose(record["mean"], rows.mean(axis=0), rtol=1e-12)
    off = rows - rows.mean(axis=0)
    np.testing.assert_allclose(record["scatter"], off.T @ off, rtol=1e-8, atol=1e-20)


@pytest.mark.parametrize(("part", "moved"), [(0.98, 1), (1.02, 0)])
def test_a_record_moved_where_its_spread_is_beyond_so_many_times_its_neighbours_noise(part: float, moved: int) -> None:
    """s^2 = S/(n - 1) against limit^2 sum (x_k - x_(k-1))^2 / (2 (n - 1))."""
    rows = samples(30)
    rows[15:, 2] += 1.5e-3
    spread = ((rows - rows.mean(axis=0)) ** 2).sum(axis=0)
    steps = (np.diff(rows, axis=0) ** 2).sum(axis=0)
    limit = part * math.sqrt(float(np.max(2.0 * spread / steps)))
    assert has_moved(summed(rows), limit) == moved


def test_readings_are_fused_by_their_weights_and_one_of_weight_zero_may_be_anything() -> None:
    readings = np.array([[1.0, -2.0, 0.5], [3.0, 4.0, 0.7], [math.nan] * 3, [5.0, 1.0, -0.3]])
    weights, fused = np.array([1.0, 4.0, 0.0, 0.25]), np.zeros(3)
    fuse_readings(readings, weights, fused)
    known = [0, 1, 3]
    np.testing.assert_allclose(fused, weights[known] @ readings[known] / 5.25, rtol=1e-14)


@pytest.mark.parametrize("cycles", [40, RING, RING + 11])
def test_the_mean_of_a_stop_has_the_covariance_of_a_mean(cycles: int) -> None:
    """Over the newest samples of a ring, wherever it stands: C = sum (f - m)(f - m)^T / (n (n - 1))."""
    count, rows = 16, samples(RING + 20)[:, 3:] - np.array([0.0, 0.0, 9.8])
    ring = np.zeros((RING, 3))
    for k in range(cycles):
        ring[k % RING] = rows[k]
    newest = rows[cycles - count : cycles]
    expected = np.cov(newest, rowvar=False) / count
    cluster = new_node(default_config())[0]["cluster"]
    cluster["cycles"] = cycles
    middle, cov = np.zeros(3), np.zeros((3, 3))
    average_ring_forces(cluster, ring, count, middle, cov)
    np.testing.assert_allclose(middle, newest.mean(axis=0), rtol=1e-12)
    np.testing.assert_allclose(cov, expected, rtol=1e-9)
    state = new_node(default_config())[0]["filter"]
    state["ring_force"], state["cycles"] = ring, cycles
    average_force(state, count)
    np.testing.assert_allclose(state["survey_force"], newest.mean(axis=0), rtol=1e-12)
    np.testing.assert_allclose(state["survey_force_cov"], expected, rtol=1e-9)


@pytest.mark.parametrize("temperature", [COLDEST - 30.0, COLDEST, 3.0, 47.0, HOTTEST, HOTTEST + 30.0, math.nan])
def test_a_reading_is_corrected_by_its_polynomials_within_the_range_that_is_known(temperature: float) -> None:
    made, random = identity_parameters(), np.random.default_rng(4)
    made["identity"] = 0
    for name in ("gyroscope", "accelerometer"):
        made[0][name]["matrix"] = 0.0
        made[0][name]["matrix"][0] = np.eye(3) + 0.1 * random.uniform(0.3, 1.0, (3, 3))
        made[0][name]["matrix"][1:] = np.array([1e-3, 1e-5, 1e-7])[:, None, None] * random.uniform(0.3, 1.0, (3, 3, 3))
        made[0][name]["bias"] = np.array([1e-2, 1e-4, 1e-6, 1e-8])[:, None] * random.uniform(0.3, 1.0, (4, 3))
        made[0][name]["reference"] = 22.0
    kept = 25.0 if math.isnan(temperature) else min(max(temperature, COLDEST), HOTTEST)
    powers = (kept - 22.0) ** np.arange(4)
    for name, place in (("gyroscope", 0), ("accelerometer", 1)):
        vectors = np.array([0.3, -0.2, 0.7]), np.array([1.0, 2.0, -9.0])
        raw = vectors[place].copy()
        correct_cycle(made[0], temperature, *vectors)
        matrix = np.tensordot(powers, made[0][name]["matrix"], axes=1)
        np.testing.assert_allclose(
            vectors[place], np.linalg.solve(matrix, raw - powers @ made[0][name]["bias"]), rtol=1e-10
        )


def axis_of(pitch: float, roll: float) -> np.ndarray:
    return np.array([math.sin(pitch), math.cos(pitch) * math.sin(roll), math.cos(pitch) * math.cos(roll)])


def test_a_mount_turns_its_axis_to_the_tubes_and_nothing_about_it() -> None:
    """Rodrigues about the axis that is square to both, by the angle between them."""
    axis = axis_of(0.08, -0.05)
    about = np.cross(axis, [0.0, 0.0, 1.0])
    angle = math.asin(np.linalg.norm(about))
    about = about / np.linalg.norm(about)
    for vector in (axis, np.array([1.0, 2.0, 3.0]), np.array([-0.4, 0.1, 0.2])):
        turned = (
            vector * math.cos(angle)
            + np.cross(about, vector) * math.sin(angle)
            + about * float(about @ vector) * (1.0 - math.cos(angle))
        )
        found = vector.copy()
        to_tube(axis, found)
        np.testing.assert_allclose(found, turned, atol=1e-12)


def swept(noise: float, seed: int, count: int = 60) -> np.ndarray:
    """One sweep over a turn and a half of a tube that leans, whose IMU sits askew."""
    angles = (np.arange(count) + 0.5) * 1.5 * math.tau / count
    lean, random = 0.2, np.random.default_rng(seed)
    axis = axis_of(0.03, -0.02)
    back = np.eye(3)
    for column in back:
        to_tube(axis, column)
    sweep = np.zeros(1, SWEEP)
    for angle in angles:
        down = np.array(
            [math.sin(lean) * math.cos(0.3 - angle), math.sin(lean) * math.sin(0.3 - angle), math.cos(lean)]
        )
        force = -9.81 * (back @ down) + 9.81 * noise * random.standard_normal(3)
        add_to_sweep(sweep[0], force, angle)
    return sweep


def fitted(noise: float, seed: int) -> np.ndarray:
    found = np.zeros(1, OFFSET)
    assert fit_circle(swept(noise, seed)[0], found[0]) == 1
    return found[0]


def test_an_alignment_finds_pitch_and_roll_with_their_signs_and_errs_as_it_says() -> None:
    exact = fitted(0.0, 1)
    assert (exact["pitch"], exact["roll"]) == (pytest.approx(0.03, abs=1e-9), pytest.approx(-0.02, abs=1e-9))
    assert exact["lean"] == pytest.approx(0.2, abs=1e-9)
    rows = np.array([[one["pitch"] - 0.03, one["roll"] + 0.02, one["pitch_std"], one["noise"]] for one in (
        fitted(1e-3, seed) for seed in range(400)
    )])  # fmt: skip
    for off in rows[:, :2].T:  # the mean of the normalised squares is one, from both sides
        assert 0.85 < np.mean(off**2 / rows[:, 2] ** 2) < 1.15
    # across the axis; along the lean what lies in the direction of gravity is not seen
    assert np.mean(rows[:, 3] ** 2) == pytest.approx(0.5e-6 * (1.0 + math.cos(0.2) ** 2), rel=0.03)


@pytest.mark.parametrize(
    ("angle", "signed", "positive"),
    [
        (0.0, 0.0, 0.0),
        (math.pi, math.pi, math.pi),
        (-math.pi, math.pi, math.pi),
        (4.0, 4.0 - math.tau, 4.0),
        (-1.0, -1.0, math.tau - 1.0),
    ],
)
def test_angles_are_wrapped_with_half_a_turn_on_the_positive_side(angle: float, signed: float, positive: float) -> None:
    assert wrap_angle(angle) == pytest.approx(signed, abs=1e-12)
    assert wrap_positive(angle) == pytest.approx(positive, abs=1e-12)


@pytest.mark.parametrize(("counts", "moved"), [(0.4, 0), (0.6, 1), (-0.4, 0), (-0.6, -1), (1.6, 2)])
def test_a_binary_angle_goes_on_by_the_nearest_count(counts: float, moved: int) -> None:
    assert advance_binary(5, counts * math.tau / 2**32) == 5 + moved
    assert advance_binary(0, -0.6 * math.tau / 2**32) == 2**32 - 1


def test_twists_of_tubes_add_up_as_angles() -> None:
    """One torque winds them all: the deviations add, not their squares."""
    var = 0.0
    for tubes in range(1, 6):
        var = reaching_var(var, 400.0, 2e4)
        assert var == pytest.approx((tubes * 400.0 / 2e4) ** 2, rel=1e-12)
    assert reaching_var(0.01**2, 600.0, 2e4) == pytest.approx((0.01 + 0.03) ** 2, rel=1e-12)
