"""One tube below a turning drive head, with the sensors of the world and whatever is done to them."""

import math
from collections.abc import Callable

import numpy as np

from node.firmware.encoder import QUANTUM, EncoderNode, EncoderSample
from node.firmware.inputs import ImuReading, RigContext
from node.firmware.settings import TubeSettings
from node.kernels.angles import wrap
from node.kernels.layout import PERIOD, Scheme
from sim.studies.chain import BEGIN, INCLINATION_DEG, ChainSetup, motion_of
from sim.studies.fresh import fresh_tube
from sim.world.borehole import Borehole
from sim.world.imu_errors import ImuErrors
from sim.world.scenario import AccelerometerSection, GyroSection
from sim.world.truth import TubeTruth
from telemetry.messages import Event, NodeState

Sample = list[float]  # three rates (rad/s), three forces (m/s^2)
Spoil = Callable[[int, Sample], Sample]


class StringOfOne:
    """Rest, turn at 71 deg/s, rest, ... ; ``run`` goes cycle by cycle and keeps yaw, variance, flags and events."""

    def __init__(self, seed: int, spoil: Spoil = lambda _, sample: sample, blocks: int = 3, loss: float = 0.01) -> None:
        random = np.random.default_rng(seed)
        self.motion = motion_of(ChainSetup(1, Scheme.FORWARD, blocks=blocks), float(random.uniform(0.0, 2.0 * math.pi)))
        self.cycles = math.floor((self.motion.end - BEGIN) / PERIOD)
        ends = BEGIN + PERIOD * np.arange(1.0, self.cycles + 1.0)
        a = AccelerometerSection()
        hole = Borehole.straight(math.radians(INCLINATION_DEG))
        truth = TubeTruth(hole, self.motion, 0.0, 0.0, a.radius_m, a.gravity_mps2)
        rate, force = truth.cycle_means(ends, PERIOD)
        errors = ImuErrors(GyroSection(), a)
        self.angles, self.rates = self.motion.drive(ends)[:2]
        self._samples = errors.readings(random, rate, force, (self.rates > 0.0).astype(float), PERIOD).tolist()
        self._lost = random.random(self.cycles) < loss
        self._spoil = spoil
        self.shift = 0.0  # s, of the node's clock
        self.tube = fresh_tube(TubeSettings(1, state_every=1))
        self._encoder = EncoderNode()
        self.error = np.zeros(self.cycles)
        self.std = np.zeros(self.cycles)
        self.events: list[tuple[int, Event]] = []
        self.states: list[NodeState] = []

    def turning(self, block: int, fraction: float = 0.5) -> int:
        """Cycle within the turning of a block, 0 its begin, 1 its end."""
        drills = [p for p in self.motion.phases if p.kind == "drill"]
        phase = drills[block]
        return math.floor((phase.start + fraction * (phase.end - phase.start) - BEGIN) / PERIOD)

    def resting(self, block: int, fraction: float = 0.5) -> int:
        """Cycle within the rest after the turning of a block."""
        stops = [p for p in self.motion.phases if p.kind == "stop"]
        phase = stops[block]
        return math.floor((phase.start + fraction * (phase.end - phase.start) - BEGIN) / PERIOD)

    def run(self) -> "StringOfOne":
        """Every cycle."""
        for cycle in range(self.cycles):
            self._cycle(cycle, BEGIN + (cycle + 1) * PERIOD)
        return self

    def codes(self, begin: int = 0) -> list[str]:
        """Codes of the events from a cycle on."""
        return [event.code for cycle, event in self.events if cycle >= begin]

    def first(self, code: str, begin: int = 0) -> int:
        """Cycle of the first event of a code from a cycle on."""
        return next(cycle for cycle, event in self.events if event.code == code and cycle >= begin)

    def _cycle(self, cycle: int, end: float) -> None:
        wx, wy, wz, fx, fy, fz = self._spoil(cycle, list(self._samples[cycle]))
        around = RigContext(True, 1, end, 1e-8, True)
        local = end + self.shift
        for said in self.tube.on_cycle(ImuReading(local - PERIOD, local, (wx, wy, wz), (fx, fy, fz)), around):
            if isinstance(said, Event):
                self.events.append((cycle, said))
            elif isinstance(said, NodeState):
                self.states.append(said)
        self.error[cycle] = wrap(self.tube.yaw - float(self.angles[cycle]))
        self.std[cycle] = math.sqrt(self.tube.yaw_var)
        angle = float(self.angles[cycle])
        count = math.floor(angle / QUANTUM + 1e-9)
        edge = min(self.motion.time_of_angle(count * QUANTUM), end)
        aiding = self._encoder.on_cycle(EncoderSample(count, edge, True), end)
        if not self._lost[cycle]:
            self.tube.on_aiding(aiding, aiding.valid_at + self.shift)
