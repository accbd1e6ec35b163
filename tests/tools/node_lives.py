"""Long lives of single nodes with everything that can happen to one.

Each life is drawn from an integer: rests, turns, faults of either sensor, wrong aidings, joints, orders and blocks,
each once, in an order that no rig makes. Both forms of the kernels live it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from node.firmware.imu_settings import ImuSettings
from node.firmware.inputs import ImuReading, RigContext
from node.firmware.tube import Tube
from node.firmware.tube_settings import MakeUpAngle, TubeSettings
from node.kernels.arithmetic.formats import DEG, PERIOD
from node.kernels.record.filter_record import Scheme, default_config
from node.kernels.record.integer_node import new_integers
from node.kernels.record.node_record import new_node
from telemetry.frozen import replace
from telemetry.messages import Aiding
from telemetry.parameters import ParameterBlock, SensorParameters
from telemetry.records.noise_file import GyroNoise

LEARN = 115  # cycles at rest until the constant bias is known
EVERY = 7  # cycles, of which one record is kept
LEAN, GRAVITY = 3.0 * DEG, 9.81

GYROSCOPE = SensorParameters(
    ((1.01, 0.002, -0.003), (0.004, 0.99, 0.005), (-0.001, 0.003, 1.02)),
    (0.002, -0.003, 0.004),
    bias_slopes=((1e-5, 2e-5, -3e-5), (1e-7, 0.0, 2e-7), (0.0, 1e-9, 0.0)),
    reference=21.0,
)
ACCELEROMETER = SensorParameters(
    ((1.001, 0.001, -0.002), (0.0, 0.998, 0.001), (0.002, 0.0, 1.003)), (0.01, -0.02, 0.015), reference=24.0
)
BLOCK = ParameterBlock(3, 7, GYROSCOPE, ACCELEROMETER)
THREE = (
    ImuSettings((0.03, -0.01), 1.0, GYROSCOPE),
    ImuSettings((-0.02, 0.02), 1.5, accelerometer=ACCELEROMETER),
    ImuSettings((0.01, 0.04), 0.7),
)
LIVES: dict[str, tuple[int, TubeSettings]] = {
    "plain": (1, TubeSettings(3)),
    "joints solved": (2, TubeSettings(
        3, MakeUpAngle(0.3, 0.004), MakeUpAngle(1.1, 0.006), 0.002, state_every=3, joints="solved", stiffness=3e4,
        unseen_std=0.02 * DEG, aiding_old_after=2.0,
    )),
    "both": (3, TubeSettings(3, MakeUpAngle(-2.0, 0.01), joints="both", torsion="variance", stiffness=2e4)),
    "estimate": (4, TubeSettings(
        3, MakeUpAngle(0.3, 0.004), MakeUpAngle(1.1, 0.006), 0.002, Scheme.ESTIMATE, torsion="variance",
        stiffness=3e4, gyro_noise=GyroNoise((4e-4, 5e-4, 6e-4), (1e-5, 2e-5, 3e-5), (90.0, 120.0, 150.0)),
    )),
    "cluster": (5, TubeSettings(3, MakeUpAngle(0.5, 0.004), MakeUpAngle(-1.1, 0.006), imus=THREE, state_every=1)),
}  # fmt: skip


class Life:
    """A node, the world around it, and what it told: message by message with the cycle."""

    def __init__(self, name: str, kernel: str) -> None:
        seed, settings = LIVES[name]
        self.random = np.random.default_rng(seed)
        self.settings = replace_settings(settings, kernel)
        self.tube = Tube(
            self.settings, default_config(), new_node(default_config()), iter(range(1, 10**9)).__next__,
            restored=False, integers=new_integers(),
        )  # fmt: skip
        self.now, self.yaw, self.hops, self.sequence, self.offset = 1000.0, 1.0, 2, 0, 0.4
        self.torque, self.joined, self.temperature = 0.0, True, 25.0
        self.cycle = 0
        self.told: list[tuple[int, Any]] = []
        self.kept: list[np.ndarray] = []

    def live(self) -> Life:
        """All of it."""
        self.turn(LEARN, 0.0)
        for k in self.random.permutation(len(HAPPENINGS)):
            HAPPENINGS[k](self)
            rate = float(self.random.choice([0.0, 0.0, 6.0, 30.0, 60.0, -45.0])) * DEG
            self.turn(int(self.random.integers(3, 45)), rate)
        self.tube.state["P"][...] = math.nan
        self.turn(12, 0.0)
        return self

    def turn(
        self,
        cycles: int,
        rate: float,
        spoil: Callable[[np.ndarray, np.ndarray], object] | None = None,
        aided: bool = True,
        around: Callable[[RigContext], RigContext] = lambda context: context,
        **reading: Any,
    ) -> None:
        """So many cycles at a rate (rad/s); what an IMU reads may be spoilt in place."""
        for _ in range(cycles):
            before, self.yaw, self.now = self.now, self.yaw + rate * PERIOD, self.now + PERIOD
            own = self._reading(before, rate, spoil, reading)
            others = tuple(self._reading(before, rate, None, {}) for _ in self.settings.imus[1:])
            context = around(RigContext(self.joined, self.hops, self.now + 50.0, 2e-8, True, 5, 0.0, 1e-6))
            for message in self.tube.on_cycle(replace(own, others=others), context):
                self.told.append((self.cycle, message))
            if aided:
                self.aid(rate=rate)
            if self.cycle % EVERY == 0:
                self.kept.append(self.tube.nodes.copy())
            self.cycle += 1

    def _reading(self, before: float, rate: float, spoil: Any, reading: dict[str, Any]) -> ImuReading:
        """What an IMU reads in a hole that leans, at the middle of the cycle."""
        middle = self.yaw - 0.5 * rate * PERIOD
        down = np.array([-math.sin(LEAN) * math.cos(middle), math.sin(LEAN) * math.sin(middle), math.cos(LEAN)])
        w = np.array([0.0, 0.0, 1.002 * rate]) + [2e-3, -1e-3, 3e-3] + 3e-4 * self.random.standard_normal(3)
        f = -GRAVITY * down + 3e-3 * self.random.standard_normal(3)
        if spoil is not None:
            spoil(w, f)
        shown = {"temperature": self.temperature} | reading
        return ImuReading(before, self.now, tuple(w.tolist()), tuple(f.tolist()), **shown)

    def aid(self, off: float = 0.0, late: float = 0.0, **changed: Any) -> None:
        """Tell the yaw of the upper end, ``off`` (rad) by as much, ``late`` (s) by as much."""
        self.sequence += 1
        noise = 5e-5 * float(self.random.standard_normal())
        yaw = (self.yaw - self.offset + noise + off) % math.tau
        told = Aiding(yaw, 2.7e-9, 3e-6, self.offset, 0.0, self.now + 50.0, self.sequence, self.hops - 1, self.torque,
                      1e-6, self.torque > 0.0)  # fmt: skip
        passed = self.tube.on_aiding(replace(told, **changed), self.now - late, 3e-8)
        if passed is not None:
            self.told.append((self.cycle, passed))


def replace_settings(settings: TubeSettings, kernel: str) -> TubeSettings:
    """The same settings with another kernel."""
    return TubeSettings(**{name: getattr(settings, name) for name in settings.__slots__} | {"kernel": kernel})


def fails(sensor: int, axis: int, value: float) -> Callable[[np.ndarray, np.ndarray], None]:
    """A sensor of which one axis reads ``value``; 3: all of them."""

    def spoil(*both: np.ndarray) -> None:
        both[sensor][axis if axis < 3 else slice(None)] = value

    return spoil


def adds(sensor: int, axis: int, value: float) -> Callable[[np.ndarray, np.ndarray], None]:
    """A sensor of which one axis reads so much more."""

    def spoil(*both: np.ndarray) -> None:
        both[sensor][axis] += value

    return spoil


def aided_by(cycles: int, turning: float, **told: Any) -> Callable[[Life], None]:
    """So many cycles whose aidings are other than they should be."""

    def happens(life: Life) -> None:
        for _ in range(cycles):
            life.turn(1, turning, aided=False)
            life.aid(**told)

    return happens


def exchanges(w: np.ndarray, f: np.ndarray) -> None:
    """Axes x and y of both sensors for each other."""
    w[:2], f[:2] = w[1::-1].copy(), f[1::-1].copy()


def with_torque(life: Life) -> None:
    """The drive holds the string, then lets it go."""
    life.torque = 700.0
    life.turn(15, 20.0 * DEG)
    life.torque = 0.0
    life.turn(5, 20.0 * DEG)


def with_open_joint(life: Life) -> None:
    """A tube is added to a string that rests: nothing is heard, then a joint more is above, as its marks tell."""
    life.turn(60, 0.0)
    life.joined = False
    life.turn(6, 0.0, aided=False)
    life.joined, life.hops, life.offset = True, life.hops + 1, life.offset + 0.15
    life.turn(4, 0.0)


def with_other_joint(life: Life) -> None:
    """The same, but the marks tell of 5 deg that the head did not turn."""
    with_open_joint(life)
    life.turn(20, 45.0 * DEG)
    life.turn(60, 0.0)
    life.hops += 1
    life.turn(1, 0.0, aided=False)
    life.aid(offset=life.offset + 5.0 * DEG)
    life.turn(5, 0.0)


def is_counted_half(life: Life) -> None:
    """An encoder that counts half of the turns."""
    begun = life.yaw
    for _ in range(20):
        life.turn(1, 60.0 * DEG, aided=False)
        life.aid(off=0.5 * (begun - life.yaw), rate=30.0 * DEG)


def breaks_off(life: Life) -> None:
    """An alignment that is ordered and then turned through too fast."""
    life.turn(30, 0.0)
    life.tube.align("circle", 1.0)
    life.turn(15, 7.0 * DEG)
    life.turn(5, 71.0 * DEG)


def winds(life: Life) -> None:
    """Rates that swing, as a drive's do that sticks and slips."""
    for k in range(40):
        life.turn(1, (40.0 + 25.0 * math.sin(0.9 * k)) * DEG)


def speeds_up(life: Life, scale: float = 1.0) -> None:
    """A ramp up and one down."""
    for k in (*range(1, 15), *range(14, 0, -1)):
        life.turn(1, 5.0 * k * DEG, lambda w, f: w.__setitem__(2, scale * w[2]))


def warms_up(life: Life) -> None:
    """Another temperature, and a bias that follows it."""
    life.temperature = 65.0 - life.temperature
    life.turn(60, 0.0, adds(0, 0, 0.002))


def is_ordered(life: Life) -> None:
    """A survey again, a static record and an alignment by a slow turn."""
    life.tube.take_survey()
    life.tube.start_record(2.0, 77)
    life.turn(30, 0.0)
    life.tube.align("circle", 1.0)
    life.turn(130, 7.0 * DEG)


def takes_block(life: Life) -> None:
    """Another block of parameters, or back to none."""
    block = ParameterBlock(3, 0) if life.tube.parameters.version else BLOCK
    life.tube.prepare(block)
    life.tube.use(block)
    life.turn(40, 0.0)


def tells_parts(life: Life) -> None:
    """Readings that end late and tell their parts."""
    parts = tuple(0.01 * k * DEG + 50.0 * DEG for k in range(9))
    life.turn(15, 50.0 * DEG, late=0.004, late_std=0.001, parts=parts)
    life.turn(5, 50.0 * DEG, late=0.004, late_std=0.001)


HAPPENINGS: tuple[Callable[[Life], None], ...] = (
    lambda life: life.turn(3, 0.0, fails(0, 0, math.nan)),
    lambda life: life.turn(2, 0.0, fails(1, 2, math.inf)),
    lambda life: life.turn(2, 30.0 * DEG, fails(0, 2, 520.0 * DEG)),
    lambda life: life.turn(4, 0.0, saturated=1),
    lambda life: life.turn(4, 30.0 * DEG, saturated=2),
    lambda life: life.turn(9, 0.0, fails(0, 3, 1e-4)),
    lambda life: life.turn(12, 20.0 * DEG, fails(0, 2, 20.0 * DEG)),
    lambda life: life.turn(9, 0.0, fails(1, 3, 5.0)),
    lambda life: life.turn(10, 0.0, fails(1, 1, 0.3)),
    lambda life: life.turn(4, 0.0, fails(1, 0, 80.0)),
    lambda life: life.turn(25, 60.0 * DEG, adds(0, 2, 0.5 * DEG)),
    lambda life: life.turn(30, 0.0, adds(0, 2, 0.1 * DEG)),
    lambda life: life.turn(30, 0.0, adds(1, 0, 0.05)),
    lambda life: life.turn(45, 60.0 * DEG, exchanges),
    aided_by(1, 0.0, off=0.3),
    aided_by(9, 0.0, off=0.02),
    aided_by(4, 30.0 * DEG, rate=-30.0 * DEG),
    aided_by(5, 60.0 * DEG, rate=0.0),
    aided_by(6, 10.0 * DEG, late=0.3),
    lambda life: life.aid(late=math.nan),
    lambda life: life.aid(late=-0.2),
    lambda life: life.aid(late=9.0),
    lambda life: life.turn(50, 0.0, aided=False),
    lambda life: life.turn(3, 360.0 * DEG),
    lambda life: setattr(life, "now", life.now + 1e4),
    lambda life: setattr(life, "now", life.now + 0.35),
    lambda life: life.turn(6, 0.0, around=lambda c: replace(c, synchronised=False, clock_var=1e-4, stepped=0.05)),
    lambda life: life.turn(4, 30.0 * DEG, around=lambda c: replace(c, stepped=math.nan, drift_std=5e-5)),
    with_torque, with_open_joint, with_other_joint, is_counted_half, breaks_off, winds, speeds_up,
    lambda life: speeds_up(life, 1.03), warms_up, is_ordered, takes_block, tells_parts,
)  # fmt: skip
