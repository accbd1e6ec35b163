"""The whole cycle of a tube at every inclination and rotation: no NaN, no jump, no variance below 0."""

import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from node.firmware.inputs import ImuReading, RigContext
from node.firmware.tube import Tube
from node.firmware.tube_settings import TubeSettings
from node.kernels.arithmetic.angles import wrap_angle
from node.kernels.arithmetic.formats import DEG, PERIOD
from node.kernels.record.filter_record import default_config
from node.kernels.record.node_record import new_node
from telemetry.messages import Aiding, Event, NodeFlag

SUBSTEPS = 16
STILL, MOVING = 100, 160  # cycles
G = 9.81
INVERTED = 170.0 * DEG  # beyond, a cycle does not resolve the yaw: it is that of the aiding


def attitudes(inclination: np.ndarray, azimuth: float, yaw: np.ndarray) -> np.ndarray:
    """R_ned_from_body (n, 3, 3): down turned by the inclination towards the azimuth, then the yaw about the axis."""
    c, s = np.cos(inclination)[:, None, None], np.sin(inclination)[:, None, None]
    kx, ky = -math.sin(azimuth), math.cos(azimuth)
    skew = np.array([[0.0, 0.0, ky], [0.0, 0.0, -kx], [-ky, kx, 0.0]])
    lean = np.eye(3) + s * skew + (1.0 - c) * (skew @ skew)
    turn = np.zeros((len(yaw), 3, 3))
    turn[:, 0, 0] = turn[:, 1, 1] = np.cos(yaw)
    turn[:, 1, 0] = np.sin(yaw)
    turn[:, 0, 1] = -turn[:, 1, 0]
    turn[:, 2, 2] = 1.0
    return np.asarray(lean @ turn)


def reading(begin: tuple[float, float], end: tuple[float, float], azimuth: float) -> tuple[np.ndarray, np.ndarray]:
    """Mean rate and force of an IMU between two (inclination, yaw), from attitudes alone."""
    share = np.arange(SUBSTEPS + 1) / SUBSTEPS
    held = attitudes(begin[0] + (end[0] - begin[0]) * share, azimuth, begin[1] + (end[1] - begin[1]) * share)
    steps = held[:-1].transpose(0, 2, 1) @ held[1:]
    skewed = 0.5 * (steps - steps.transpose(0, 2, 1))
    turned = np.stack([skewed[:, 2, 1], skewed[:, 0, 2], skewed[:, 1, 0]], axis=1)
    sine = np.linalg.norm(turned, axis=1)
    rate = (np.arcsin(np.minimum(sine, 1.0)) / np.maximum(sine, 1e-300)) @ turned
    force = -0.5 * G * (held[:-1] + held[1:])[:, 2].mean(axis=0)
    return rate / PERIOD, force


class Walk:
    """A tube that stands, and then is bent from one inclination to another while it turns."""

    def __init__(self, inclination: float, azimuth: float, yaw: float, *, aided: bool = True) -> None:
        config = default_config()
        numbers = iter(range(10**9)).__next__
        self.tube = Tube(TubeSettings(1, state_every=1), config, new_node(config), numbers, restored=False)
        self.place = (inclination, yaw)
        self.azimuth, self.aided = azimuth, aided
        self.now = 1000.0
        self.sequence = 0
        self.random = np.random.default_rng(1)
        self.codes: list[str] = []
        self.flags = NodeFlag.NONE  # since the start of the turning
        self.cycles = 0
        self.jump = 0.0  # rad, the largest change of the yaw that the motion does not explain

    def cycle(self, inclination: float, yaw: float) -> None:
        rate, force = reading(self.place, (inclination, yaw), self.azimuth)
        rate = rate + self.random.normal(0.0, 1e-7, 3)  # a reading that never repeats
        force = force + self.random.normal(0.0, 1e-5, 3)
        known, before = bool(self.tube.state["yaw_known"]), self.tube.yaw
        self.now += PERIOD
        around = RigContext(True, 1, self.now, 1e-8, True)
        taken = ImuReading(self.now - PERIOD, self.now, tuple(rate.tolist()), tuple(force.tolist()))
        self.codes += [said.code for said in self.tube.on_cycle(taken, around) if isinstance(said, Event)]
        self.flags |= self.tube.flags(around, self.now)
        turned, before_place = yaw - self.place[1], self.place[0]
        if known and inclination < INVERTED and NodeFlag.YAW_UNTRUSTED not in self.flags:
            self.jump = max(self.jump, abs(wrap_angle(self.tube.yaw - before - turned)))
        self.sequence += turned != 0.0 or inclination != before_place or not self.sequence
        self.place = (inclination, yaw)
        if self.aided or self.sequence == 1:
            aiding = Aiding(yaw % (2.0 * math.pi), 1e-9, 0.0, 0.0, turned / PERIOD, self.now, self.sequence, 0)
            self.tube.on_aiding(aiding, self.now)
        self.cycles += 1
        self.check()

    def check(self) -> None:
        state = self.tube.state
        for name in ("P", "now_P", "down", "now_down", "bias", "scale", "stamp"):
            assert np.all(np.isfinite(state[name])), name
        for name in ("P", "now_P") if self.cycles % 4 == 0 else ():  # half of the test's time
            assert np.all(np.diagonal(state[name]) > 0.0)
            np.testing.assert_array_equal(state[name], state[name].T)
            scale = np.sqrt(np.diagonal(state[name]))
            assert np.linalg.eigvalsh(state[name] / np.outer(scale, scale)).min() > -1e-9
        assert abs(np.linalg.norm(state["now_down"]) - 1.0) < 1e-9
        assert 0.0 <= self.tube.yaw < 2.0 * math.pi
        assert self.tube.yaw_var > 0.0

    def error(self) -> float:
        return abs(wrap_angle(self.tube.yaw - self.place[1]))


ANGLES = st.floats(0.0, math.pi)
TURNS = st.floats(-math.pi, math.pi)
SPINS = st.sampled_from([0.0, 7.0, -35.0, 71.0, -71.0])


@pytest.mark.slow
@settings(max_examples=15)
@given(ANGLES, ANGLES, TURNS, TURNS, SPINS)
@example(0.0, math.pi, 0.3, 1.0, 71.0)
@example(math.pi, 0.0, -2.0, 0.0, -71.0)
@example(0.5 * math.pi, 0.5 * math.pi, 1.0, 2.0, 71.0)
@example(0.0, math.pi, 0.0, 0.0, 0.0)
@example(3.140625, 1.0, 0.0, 0.0, 71.0)  # through the singular axis, where no mismatch is the gyroscope's
def test_a_walk_over_inclinations_and_rotations_never_jumps(
    first: float, last: float, azimuth: float, yaw: float, spin_dps: float
) -> None:
    walk = Walk(first, azimuth, yaw)
    for _ in range(STILL):
        walk.cycle(first, yaw)
    walk.flags = NodeFlag.NONE
    for k in range(MOVING):
        ahead = min(0.25 * (k + 1), 1.0)  # the drive starts over four cycles
        yaw += spin_dps * DEG * PERIOD * ahead
        walk.cycle(first + (last - first) * (k + 1) / MOVING, yaw)
    for _ in range(8):
        walk.cycle(last, yaw)
    assert set(walk.codes) <= {"stopped", "started", "bias_known", "yaw_reset"}
    assert walk.codes.count("yaw_reset") == 1
    assert walk.jump < 0.2 * DEG
    assert walk.error() < 0.1 * DEG


@pytest.mark.slow
@pytest.mark.parametrize(
    ("inclined", "turned"), [(30.0, 120.0), pytest.param(15.0, 60.0, marks=pytest.mark.statistical)]
)
def test_every_inclination_and_rotation_is_stood_at(inclined: float, turned: float) -> None:
    for inclination in np.radians(np.arange(0.0, 181.0, inclined)):
        for yaw in np.radians(np.arange(0.0, 360.0, turned)):
            walk = Walk(float(inclination), 0.7, float(yaw))
            for _ in range(STILL):
                walk.cycle(float(inclination), float(yaw))
            assert walk.jump < 0.01 * DEG
            assert walk.error() < 0.01 * DEG
            down = attitudes(np.array([inclination]), 0.7, np.array([yaw]))[0, 2]
            np.testing.assert_allclose(walk.tube.state["now_down"], down, atol=1e-4)


def test_a_whole_turn_without_aiding_comes_back_to_itself_up_to_the_horizontal_and_beyond() -> None:
    for inclination in np.radians([0.0, 30.0, 60.0, 90.0, 120.0, 150.0, 170.0]):
        walk = Walk(float(inclination), -1.0, 0.5, aided=False)
        for _ in range(STILL):
            walk.cycle(float(inclination), 0.5)
        for k in range(1, 41):
            walk.cycle(float(inclination), 0.5 + 2.0 * math.pi * k / 40.0)
        assert walk.error() < 0.1 * DEG
