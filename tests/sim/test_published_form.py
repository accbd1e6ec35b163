"""The published form: its kinematics and Jacobians, what it knows at rest, and how its divergence is told."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from node.errors import NodeConfigurationError
from node.firmware.inputs import ImuReading, RigContext
from node.firmware.kernel_choice import LOOPS, added_loop, kernel_of
from node.firmware.tube import Tube
from node.firmware.tube_settings import TubeSettings
from node.kernels.arithmetic.formats import DEG, PERIOD, Array
from node.kernels.filter.float64.propagation import BX, PSI, TX, TY
from node.kernels.record.filter_record import STATES, CycleStatus, Err, default_config, new_state
from node.kernels.record.node_record import new_node
from sim.errors import ScenarioError
from sim.studies.lab import LAB, run_seed
from sim.studies.published_form import feed_forward as published
from sim.studies.published_form.euler_angles import (
    error_rates,
    euler_rates,
    geometry_of,
    point_down,
    propagate_covariance,
    tilt_of,
)
from sim.studies.published_form.published_forms import KERNEL, setup_of
from sim.studies.published_form.published_step import published_aiding, published_loop, published_step
from telemetry.messages import Aiding, Event, NodeFlag, NodeState

G = 9.81
SPIN = 71.0 * DEG
ANGLE = st.floats(-1.0, 1.0)
RATE = st.floats(-2.0, 2.0)


class Node:
    """The published kernel on a steady tube."""

    def __init__(self, tilt: float = 0.0) -> None:
        self.config, self.state = default_config()[0], new_state(default_config())[0]
        self.force = -G * np.array([-math.sin(tilt), 0.0, math.cos(tilt)])
        self.now, self.sequence = 1000.0, 0

    def cycle(self, rate: tuple[float, float, float] = (0.0, 0.0, 0.0), dt: float = PERIOD) -> CycleStatus:
        start, self.now = self.now, self.now + dt
        return CycleStatus(published.run_cycle(self.state, self.config, np.array(rate), self.force, start, self.now, 1))

    def aid(self, yaw: float, age: float = 0.0, var: float = (0.003 * DEG) ** 2) -> None:
        self.sequence += 1
        given = (yaw % math.tau, var, 0.0, 0.0, self.now - age, self.sequence, 0)
        published.offer_aiding(self.state, self.config, *given)

    def learn(self) -> None:
        for _ in range(100):
            self.cycle()
            self.aid(1.0)

    @property
    def yaw(self) -> float:
        return float(self.state["now_yaw"]) * math.tau / 2**32


def rates_at(angles: Array, w: Array) -> Array:
    return np.array(euler_rates(w[0], geometry_of(angles[0], angles[1], w[1], w[2])))


def jacobians(angles: Array, w: Array) -> tuple[Array, Array]:
    """Of the Euler rates by the angles (3, 3) and by the body rates (3, 3), from ``error_rates``."""
    at = geometry_of(angles[0], angles[1], w[1], w[2])
    columns = [error_rates(*unit, at) for unit in np.eye(5)]
    by_angles, by_bias = np.array(columns[:2]).T, np.array(columns[2:]).T
    return np.column_stack([by_angles, np.zeros(3)]), -by_bias


@given(st.tuples(ANGLE, ANGLE), st.tuples(RATE, RATE, RATE))
def test_the_jacobians_are_the_derivatives_of_the_rates(angles: tuple[float, float], w: tuple[float, ...]) -> None:
    at, body, step = np.array([*angles, 0.0]), np.array(w), 1e-6
    by_angles, by_rates = jacobians(at, body)
    for unit, found_angle, found_rate in zip(np.eye(3), by_angles.T, by_rates.T, strict=True):
        change = (rates_at(at + step * unit, body) - rates_at(at - step * unit, body)) / (2.0 * step)
        np.testing.assert_allclose(found_angle, change, atol=1e-7)
        change = (rates_at(at, body + step * unit) - rates_at(at, body - step * unit)) / (2.0 * step)
        np.testing.assert_allclose(found_rate, change, atol=1e-7)


@given(ANGLE, ANGLE)
def test_a_tilt_is_read_back_from_its_direction(phi: float, theta: float) -> None:
    down = np.empty(3)
    point_down(down, phi, theta)
    assert np.linalg.norm(down) == pytest.approx(1.0)
    assert tilt_of(down) == pytest.approx((phi, theta))


@pytest.mark.slow
def test_the_propagation_is_that_of_the_matrices() -> None:
    config, random = default_config()[0], np.random.default_rng(3)
    config["attitude_factor"], config["bias_factor"] = 2.0, 5.0
    root = random.normal(size=(6, 6))
    P = np.zeros((STATES, STATES))
    P[:6, :6] = root @ root.T
    P[6, 6] = P[7, 7] = 1.0
    angles, w, dt = np.array([0.3, -0.4, 0.0]), np.array([0.1, -0.2, SPIN]), 0.4
    by_angles, by_rates = jacobians(angles, w)
    decay = np.exp(-dt / config["bias_tau"])
    F = np.block([[np.eye(3) + dt * by_angles, -dt * by_rates], [np.zeros((3, 3)), np.diag(decay)]])
    walk = dt * (2.0 * config["gyro_noise"]) ** 2
    drive = (5.0 * config["bias_std"]) ** 2 * (1.0 - decay**2)
    noise = np.zeros((6, 6))
    noise[:3, :3] = by_rates @ np.diag(walk) @ by_rates.T
    noise[3:, 3:] = np.diag(drive)
    expected = F @ P[:6, :6] @ F.T + noise
    propagate_covariance(P, dt, geometry_of(angles[0], angles[1], w[1], w[2]), config)
    np.testing.assert_allclose(P[:6, :6], expected, rtol=1e-12)
    assert (P[6:, :6] == 0.0).all()
    assert (np.diag(P)[6:] == 1.0).all()


def test_an_explicit_step_lengthens_the_tilt_as_published() -> None:
    node = Node(tilt=0.01)
    node.learn()
    before = math.hypot(*tilt_of(node.state["down"]))
    node.cycle((0.0, 0.0, SPIN))
    after = math.hypot(*tilt_of(node.state["down"]))
    assert after / before == pytest.approx(math.sqrt(1.0 + (SPIN * PERIOD) ** 2), rel=1e-3)


def test_errors_are_taken_off_at_the_output_and_never_fed_back() -> None:
    node, bias = Node(), 0.02 * DEG
    node.learn()
    alone = int(node.state["yaw"])
    for _ in range(300):
        node.cycle((0.0, 0.0, bias))
        node.aid(1.0)
    drifted = (int(node.state["yaw"]) - alone) * math.tau / 2**32
    assert drifted == pytest.approx(300 * PERIOD * bias, rel=1e-5)
    assert node.yaw == pytest.approx(1.0, abs=0.01 * DEG)
    assert 0.5 * bias < node.state["bias"][2] < bias  # a Gauss-Markov bias is drawn to zero
    assert node.state["scale"] == 0.0
    assert node.state["P"][PSI, PSI] < (0.01 * DEG) ** 2


@pytest.mark.parametrize("age", [0.0, 0.01, 0.1])
def test_an_aiding_is_moved_from_its_time_of_validity(age: float) -> None:
    """With the time of arrival in its place, the angle turned meanwhile is missed."""
    errors = []
    for told in (age, 0.0):
        node, yaw = Node(), 1.0
        node.learn()
        for _ in range(10):
            node.cycle((0.0, 0.0, SPIN))
            yaw += SPIN * PERIOD
            node.aid(yaw - SPIN * age, told)
        node.cycle()
        errors.append(math.remainder(node.yaw - yaw, math.tau))
    assert errors[0] == pytest.approx(0.0, abs=0.01 * DEG)
    assert errors[1] == pytest.approx(-SPIN * age, abs=0.05 * SPIN * age + 0.01 * DEG)


def tube(tilt: float) -> tuple[Tube, Array]:
    config = default_config()
    with added_loop(KERNEL, published_loop):
        settings = TubeSettings(1, state_every=1, kernel=KERNEL)
        node = Tube(settings, config, new_node(config), iter(range(10**6)).__next__, restored=False)
    return node, -G * np.array([-math.sin(tilt), 0.0, math.cos(tilt)])


def turned(node: Tube, force: Array, spins: list[float]) -> list[list[NodeState | Event]]:
    """What a tube says in each cycle of a string that turns by ``spins`` (rad/s), aided in every cycle."""
    said, yaw, now = [], 1.0, 1000.0
    random = np.random.default_rng(1)
    for k, spin in enumerate(spins):
        rate = np.array([0.0, 0.0, spin]) + 1e-4 * random.standard_normal(3)
        reading = ImuReading(now, now + PERIOD, tuple(rate.tolist()), tuple(force.tolist()))
        force = force + 1e-9 * random.standard_normal(3)  # bits of a live sensor
        now, yaw = now + PERIOD, yaw + spin * PERIOD
        said.append([m for m in node.on_cycle(reading, RigContext(True, 1, now, 1e-8, True)) if _told(m)])
        node.on_aiding(Aiding(yaw % math.tau, (0.003 * DEG) ** 2, 0.0, 0.0, spin, now, k, 0), now)
    return said


def _told(message: object) -> bool:
    return isinstance(message, NodeState | Event)


def test_a_tilt_that_diverges_is_flagged_and_reset_by_the_next_aiding() -> None:
    node, force = tube(2.0 * DEG)
    said = turned(node, force, [0.0] * 100 + [SPIN] * 60 + [0.0] * 60)
    flagged = [
        k for k, told in enumerate(said) for m in told if isinstance(m, NodeState) and NodeFlag.YAW_UNTRUSTED in m.flags
    ]
    resets = [k for k, told in enumerate(said) for m in told if isinstance(m, Event) and m.code == "yaw_reset"]
    diverged = [k for k in flagged if k >= 100]
    assert diverged
    assert all(k + 1 in resets for k in diverged)
    assert math.remainder(node.yaw - 1.0 - 60 * SPIN * PERIOD, math.tau) == pytest.approx(0.0, abs=0.05 * DEG)


@pytest.mark.parametrize("inclination_deg", [0.0, 45.0, 55.0, 65.0, 90.0, 135.0, 180.0])
def test_a_node_at_any_inclination_lives_on_and_says_when_its_form_does_not_hold(inclination_deg: float) -> None:
    node, force = tube(inclination_deg * DEG)
    said = turned(node, force, [0.0] * 110 + [SPIN] * 8)
    at_rest = [m for m in said[109] if isinstance(m, NodeState)][-1]
    assert math.isfinite(at_rest.yaw)
    assert (NodeFlag.YAW_UNTRUSTED in at_rest.flags) == (inclination_deg >= 60.0)


STEP = st.tuples(
    st.floats(-5.0, 5.0), st.integers(1, 60), st.floats(0.0, 1.5), st.floats(-0.1, 3.0), st.floats(0.0, math.pi)
)


@settings(max_examples=25, deadline=None)
@given(st.lists(STEP, min_size=1, max_size=8), st.integers(0, 2**32 - 1))
def test_whatever_comes_a_cycle_ends_with_numbers_or_says_so(
    steps: list[tuple[float, int, float, float, float]], seed: int
) -> None:
    node, random = Node(), np.random.default_rng(seed)
    for spin, cycles, age, dt, inclination in steps:
        node.force = -G * np.array([-math.sin(inclination), 0.0, math.cos(inclination)])
        for _ in range(cycles):
            wx, wy, wz = 0.05 * random.standard_normal(3) + np.array([0.0, 0.0, spin])
            status = node.cycle((float(wx), float(wy), float(wz)), dt)
            node.aid(float(random.uniform(0.0, math.tau)), age)
            P = node.state["now_P"]
            sound = np.isfinite(P).all() and (np.diag(P) >= 0.0).all()
            assert sound or CycleStatus.FILTER_FAULT in status
            assert np.isfinite([*node.state["now_down"], *node.state["bias"], node.state["now_rate"]]).all()
            assert np.array_equal(P, P.T)


def test_a_repetition_at_rest_counts_again() -> None:
    node = Node()
    node.learn()
    found = []
    for _ in range(20):
        node.cycle()
        node.aid(1.0)
        node.sequence -= 1
        found.append(CycleStatus.AIDED in node.cycle())
    assert all(found)


def test_a_reading_that_is_no_number_changes_nothing() -> None:
    node = Node()
    node.learn()
    before = node.state.tobytes()
    assert node.cycle((0.0, math.nan, 0.0)) == CycleStatus.BAD_SAMPLE
    assert node.state.tobytes() == before


def test_a_restart_goes_on_from_the_output() -> None:
    from node.kernels.filter.resets import resume_filter

    config = default_config()
    states = new_state(config)
    node = Node(tilt=0.02)
    node.state = states[0]
    node.learn()
    for _ in range(20):
        node.cycle((1e-4, 1e-4, 1e-4))
        node.aid(1.0)
    yaw = node.yaw
    resume_filter(states[0])
    node.cycle()
    assert node.yaw == pytest.approx(yaw, abs=0.01 * DEG)
    assert node.state["P"][TX, TX] < 1.0
    assert node.state["P"][TY, TY] < 1.0


def test_six_states_are_estimated_and_the_other_two_stay_as_they_began() -> None:
    node = Node(tilt=0.02)
    node.learn()
    for k in range(60):
        node.cycle((0.0, 0.0, SPIN))
        node.aid(1.0 + (k + 1) * SPIN * PERIOD)
    prior = new_state(default_config())[0]["P"]
    P = node.state["P"]
    for k in (int(Err.SCALE), int(Err.STAMP)):
        assert P[k, k] == prior[k, k]
        assert np.count_nonzero(P[k]) == 1
    assert P[BX, BX] != prior[BX, BX]


def test_it_is_chosen_by_the_settings_while_a_study_offers_it() -> None:
    ours = dict(LOOPS)
    with added_loop(KERNEL, published_loop):
        assert kernel_of(KERNEL) == (published.run_cycle, published.offer_aiding, published_step, published_aiding)
        assert TubeSettings(1, kernel=KERNEL).kernel == KERNEL
    assert ours == LOOPS
    with pytest.raises(
        NodeConfigurationError, match="kernel: expected one of float64, fixed, chip, library, got published"
    ):
        TubeSettings(1, kernel=KERNEL)


@pytest.mark.parametrize("name", ["float64", "fixed", KERNEL])
def test_no_study_takes_the_name_of_a_kernel(name: str) -> None:
    ours = dict(LOOPS)
    with added_loop(KERNEL, published_loop), pytest.raises(NodeConfigurationError, match=f"another name .*got {name}"):
        added_loop(name, published_loop).__enter__()
    assert ours == LOOPS


def test_a_scenario_of_the_published_form_is_refused_outside_its_study() -> None:
    with pytest.raises(ScenarioError, match=r"node\.kernel: expected one of float64, fixed, got 'published'"):
        run_seed((setup_of(LAB, "published filter"), 1))
