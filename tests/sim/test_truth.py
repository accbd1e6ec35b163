"""The world's truth in closed form: a perfect sensor gives zero error."""

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from groundstation.survey.fusion.resolve import direction_angles, resolve_direction
from node.kernels.arithmetic.formats import PERIOD
from sim.world.borehole import Borehole
from sim.world.marks import wrap_angle
from sim.world.motion import Motion, Trapezoid
from sim.world.scenario import load_scenario
from sim.world.scenario_file import TorsionSection
from sim.world.torsion import StringTorsion
from sim.world.truth import TubeTruth
from sim.world.world import World

SCENARIOS = Path(__file__).parents[2] / "scenarios"
TURN = Trapezoid(20.0 * 2.0 * math.pi, math.radians(71.0), math.radians(35.0))


def steep_hole() -> Borehole:
    md = np.array([0.0, 2.0, 4.0, 6.0, 9.0])
    return Borehole(md, np.array([0.1, 0.5, 1.0, 1.4, 1.6]), np.array([0.2, 0.4, 1.0, 1.2, 1.0]))


def motion() -> Motion:
    return Motion(1000.0, 20.0, 5.0, 30.0, 5.0, TURN, 3, 2.0, 0.7)


def perfect() -> TubeTruth:
    return TubeTruth(steep_hole(), motion(), 0.0, 1.1, 0.05, 9.81)


def twisted() -> TubeTruth:
    """A tube that lags the drive by some degrees and swings."""
    section = TorsionSection(bit_torque_nm=800.0, wall_friction_nm_per_m=60.0, stick_slip=0.7, stick_slip_hz=0.3)
    torsion = StringTorsion(section, motion(), 2.0, np.array([4.0, 5.0, 6.0]), np.array([0.1, 0.05, 0.2]))
    return TubeTruth(steep_hole(), motion(), 0.0, 1.1, 0.05, 9.81, lambda t: torsion.twist(1, t))


@pytest.mark.parametrize("string", [perfect, twisted])
def test_rates_are_the_derivative_of_the_attitude(string: Callable[[], TubeTruth]) -> None:
    truth, h = string(), 1e-4
    for t in np.linspace(1021.0, 1500.0, 60):
        around = truth.attitude(np.array([t - 2 * h, t - h, t, t + h, t + 2 * h]))
        slope = (around[0] - 8.0 * around[1] + 8.0 * around[3] - around[4]) / (12.0 * h)
        skew = around[2].T @ slope
        numeric = np.array([skew[2, 1], skew[0, 2], skew[1, 0]])
        np.testing.assert_allclose(truth.rate(np.array([t]))[0], numeric, atol=2e-8)


SPINNING = (1020.0 + TURN.ramp, 1020.0 + TURN.duration - TURN.ramp)  # smooth: between the kinks of the ramps
UNWINDING = (1020.0 + TURN.duration, 1020.0 + TURN.duration + 3.0)  # the drive stands


@pytest.mark.slow
@pytest.mark.parametrize(("string", "span"), [(perfect, SPINNING), (twisted, SPINNING), (twisted, UNWINDING)])
def test_rates_integrated_give_the_attitude_back(string: Callable[[], TubeTruth], span: tuple[float, float]) -> None:
    """A sixth-order Magnus integrator on the rates of one tube's drilling, against the attitude itself."""
    truth, steps = string(), 20_000
    begin, end = span
    t = np.linspace(begin, end, steps + 1)
    dt = (end - begin) / steps
    c = math.sqrt(15.0) / 10.0
    w1, w2, w3 = (-truth.rate(t[:-1] + dt * (0.5 + s)) for s in (-c, 0.0, c))  # of the transposed attitude
    a1, a2, a3 = dt * w2, dt * math.sqrt(15.0) / 3.0 * (w3 - w1), dt * 10.0 / 3.0 * (w3 - 2.0 * w2 + w1)
    c1 = np.cross(a1, a2)
    c2 = -np.cross(a1, 2.0 * a3 + c1) / 60.0
    omega = a1 + a3 / 12.0 + np.cross(-20.0 * a1 - a3 + c1, a2 + c2) / 240.0
    attitude = truth.attitude(np.array([begin]))[0]
    for vector in omega:
        angle = float(np.linalg.norm(vector))
        skew = np.array([[0, -vector[2], vector[1]], [vector[2], 0, -vector[0]], [-vector[1], vector[0], 0]])
        near = angle < 1e-8
        s1 = 1.0 if near else math.sin(angle) / angle
        s2 = 0.5 if near else (1.0 - math.cos(angle)) / angle**2
        attitude = attitude @ (np.eye(3) - s1 * skew + s2 * skew @ skew)
    np.testing.assert_allclose(attitude, truth.attitude(np.array([end]))[0], atol=1e-9)


@pytest.mark.parametrize("name", ["wellbore-1.toml", "torsion-10.toml"])
def test_specific_force_at_a_stop_resolves_to_the_exact_direction(name: str) -> None:
    world = World(load_scenario(SCENARIOS / name), 4)
    for phase in world.phases:
        if phase.kind != "stop":
            continue
        for tube in range(1, phase.tube + 1):
            t = np.array([phase.start + 20.0])
            truth = world.truth(tube)
            direction = resolve_direction(truth.force(t)[0], np.eye(3), float(truth.yaw(t)[0]), 0.0).direction
            inclination, azimuth = direction_angles(direction.lean, direction.down)
            station = world.truth_station(world.bit_depth(float(t[0])) - (tube - 1) * 2.0)
            assert math.degrees(inclination) == pytest.approx(station["inclination_deg"], abs=1e-9)
            off = math.radians(math.degrees(azimuth) - station["azimuth_deg"])
            assert abs(wrap_angle(off)) * math.sin(inclination) < 1e-9


@pytest.mark.slow
def test_the_yaw_increment_of_a_cycle_is_exact() -> None:
    truth = perfect()
    ends = 1000.0 + PERIOD * np.arange(1.0, 400.0)
    turned = np.diff(truth.yaw(np.concatenate([ends[:1] - PERIOD, ends])))
    straight = TubeTruth(
        Borehole(np.array([0.0, 9.0]), np.array([0.5, 0.5]), np.array([1.0, 1.0])), motion(), 0.0, 1.1, 0.0, 9.81
    )
    exact, _ = straight.cycle_means(ends, PERIOD)
    np.testing.assert_allclose(exact[:, 2] * PERIOD, turned, atol=1e-12)
    rate, _ = truth.cycle_means(ends, PERIOD)
    twist = np.array([solid_angle(end) for end in ends])
    assert np.abs(twist).max() > 5e-4  # the hole bends enough to tell
    np.testing.assert_allclose(rate[:, 2] * PERIOD, turned - twist, atol=1e-6)


def solid_angle(end: float) -> float:
    """Integral of (1 - cos I) dA over the cycle that ends at ``end`` by small steps, for the lowest tube."""
    depths = motion().depth(np.linspace(end - PERIOD, end, 41))[0]
    along = np.array([steep_hole().direction(md) for md in depths])
    middle = 0.5 * (along[1:, 0] + along[:-1, 0])
    return float(np.sum((1.0 - np.cos(middle)) * np.diff(np.unwrap(along[:, 1]))))


def test_an_accelerometer_off_the_axis_feels_the_circle() -> None:
    hole = Borehole(np.array([0.0, 9.0]), np.zeros(2), np.zeros(2))
    still, moving = TubeTruth(hole, motion(), 0.0, 0.0, 0.0, 9.81), TubeTruth(hole, motion(), 0.0, 0.0, 0.05, 9.81)
    t = np.array([1060.0])
    felt = moving.force(t)[0] - still.force(t)[0]
    np.testing.assert_allclose(felt, [-0.05 * math.radians(71.0) ** 2, 0.0, 0.0], atol=1e-12)


@given(st.floats(0.0, 1.0))
def test_the_time_of_an_angle_is_the_inverse_of_the_turning(part: float) -> None:
    angle = part * TURN.angle
    assert float(TURN.turned(np.array([TURN.time_of(angle)]))[0][0]) == pytest.approx(angle, abs=1e-9)


def test_the_circle_around_the_axis_follows_the_tube_and_not_the_drive() -> None:
    """While the drive stands and the string unwinds: -r w^2 and r w', with w the derivative of the tube's own yaw."""
    straight = Borehole(np.array([0.0, 9.0]), np.zeros(2), np.zeros(2))
    lag = StringTorsion(TorsionSection(), motion(), 2.0, np.full(3, 50.0), np.zeros(3))
    still, off_axis = (
        TubeTruth(straight, motion(), 0.0, 0.0, radius, 9.81, lambda t: lag.twist(1, t)) for radius in (0.0, 0.05)
    )
    t, h = UNWINDING[0] + np.linspace(0.1, 2.9, 29), 1e-3
    felt = off_axis.force(t) - still.force(t)
    before, now, after = (off_axis.yaw(t + shift) for shift in (-h, 0.0, h))
    rate, angular = (after - before) / (2.0 * h), (after - 2.0 * now + before) / h**2
    assert np.abs(rate).max() > 0.5
    np.testing.assert_allclose(felt[:, 0], -0.05 * rate**2, atol=1e-6)
    np.testing.assert_allclose(felt[:, 1], 0.05 * angular, atol=1e-6)


def test_a_short_turn_is_all_ramp() -> None:
    short = Trapezoid(0.01, 1.0, 1.0)
    angle, rate, _ = short.turned(np.array([short.duration]))
    assert angle[0] == pytest.approx(0.01)
    assert rate[0] == 0.0


@settings(max_examples=30)
@given(st.floats(0.0, 1.0))
def test_the_edge_of_the_encoder_is_the_moment_its_count_changed(part: float) -> None:
    world = World(load_scenario(SCENARIOS / "rig-3.toml"), 2)
    t = world.begin + 60.0 + part * (world.end - world.begin - 60.0)
    count, edge, *_ = world.encoder_sample(t)
    quantum = 2.0 * math.pi / 4096
    angle = float(world.motion.drive(np.array([t]))[0][0])
    out_of_place = 5.0 * math.radians(0.003)
    assert count * quantum - out_of_place <= angle < (count + 1) * quantum + out_of_place
    assert edge <= t
    if edge > world.begin:
        assert world.encoder_sample(edge + 1e-9)[0] == count
        assert world.encoder_sample(edge - 1e-6)[0] == count - 1


def test_the_lines_of_the_encoder_are_out_of_place_by_what_the_scenario_states() -> None:
    scenario = load_scenario(SCENARIOS / "rig-3.toml")
    world = World(scenario, 2)
    spinning = world.begin + 65.0
    errors = {}
    for t in np.arange(spinning, spinning + 20.0, 0.01):
        count, edge, *_ = world.encoder_sample(float(t))
        at_edge = float(world.motion.drive(np.array([edge]))[0][0])
        errors[count] = math.degrees(at_edge - count * 2.0 * math.pi / 4096)
    assert np.std(list(errors.values())) == pytest.approx(scenario.file.encoder.edge_std_deg, rel=0.1)
    assert world.encoder_sample(spinning) == World(scenario, 2).encoder_sample(spinning)


def test_positions_follow_a_circular_arc() -> None:
    radius, angle = 30.0, np.linspace(0.0, 1.4, 8)
    hole = Borehole(radius * angle, angle, np.full(8, 0.7))
    for md in (0.1, 10.0, 33.3, 42.0):
        out = radius * (1.0 - math.cos(md / radius))
        expected = [out * math.cos(0.7), out * math.sin(0.7), radius * math.sin(md / radius)]
        np.testing.assert_allclose(hole.position(md), expected, atol=1e-9)
        assert hole.direction(md) == pytest.approx((md / radius, 0.7))


def test_the_printed_record_is_reproduced() -> None:
    """Inclination and azimuth of thesis Table 4.1, by the exact rule: the print used another, 0.01 deg apart."""
    world = World(load_scenario(SCENARIOS / "wellbore-1.toml"), 1)
    printed = [
        (2, 0.08, 248.20), (4, 0.32, 243.43), (6, 0.61, 249.44), (8, 0.89, 255.96), (10, 1.32, 257.47),
        (12, 1.72, 253.07), (14, 2.35, 250.46), (16, 2.78, 252.03), (18, 3.00, 257.62), (20, 3.41, 260.34),
    ]  # fmt: skip
    for md, inclination_deg, azimuth_deg in printed:
        station = world.truth_station(float(md))
        assert station["inclination_deg"] == pytest.approx(inclination_deg, abs=0.012)
        assert station["azimuth_deg"] == pytest.approx(azimuth_deg, abs=0.005)


def test_a_homokinetic_joint_and_a_parallel_transport_agree_over_the_record() -> None:
    """The solid angle sum (1 - cos I) dA, by which the two kinds of string differ: docs/frames.md."""
    hole = load_scenario(SCENARIOS / "wellbore-1.toml").hole
    directions = np.array([hole.direction(md) for md in np.linspace(0.5, 20.0, 400)])
    turned = np.diff(np.unwrap(directions[:, 1])) * (1.0 - np.cos(directions[1:, 0]))
    assert math.degrees(np.abs(np.cumsum(turned)).max()) < 0.02
