"""A string of tubes in one process: the firmware of every node on the sensors of the world, joined by a delay line.

It is what a rig does without its processes, so that hundreds of seeds cost seconds. The string is complete from the
start; it turns and rests several times. Clock errors between the nodes are drawn per joint and accumulate.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from node.firmware.encoder import COUNTS_PER_TURN, EDGE_STD, EncoderNode, EncoderSample
from node.firmware.inputs import ImuReading, RigContext
from node.firmware.settings import Joint, Kernel, TubeSettings
from node.firmware.tube import Tube
from node.kernels.angles import wrap
from node.kernels.layout import PERIOD, Scheme
from sim.studies.fresh import fresh_tube
from sim.studies.links import Link, OnOff
from sim.world.borehole import Borehole
from sim.world.disc import Disc
from sim.world.imu_errors import ImuErrors
from sim.world.motion import Motion, Trapezoid
from sim.world.scenario import AccelerometerSection, GyroSection
from sim.world.streams import stream
from sim.world.truth import TubeTruth
from telemetry.messages import Aiding

Array = npt.NDArray[np.float64]
BEGIN, HOLD, JOINT_TIME, REST, FINISH = 1000.0, 60.0, 5.0, 60.0, 1.0  # s
TURNS, RATE_DPS, ACCELERATION_DPS2 = 20.0, 71.0, 35.0
INCLINATION_DEG = 2.0
LINK_STREAM, DISC_STREAM = 4201, 4202


@dataclass(frozen=True, slots=True)
class ChainSetup:
    """One string and what disturbs it; SI and radians."""

    hops: int
    scheme: Scheme
    blocks: int = 3  # of turning and resting
    joint_std: float = math.radians(0.05)
    mount_std: float = math.radians(0.05)
    clock_std: float = 0.2e-3  # s, each joint, constant error of a node's rig time against its neighbour's
    clock_wander_std: float = 0.03e-3  # s, each joint, Gauss-Markov part of it
    clock_wander_tau: float = 60.0  # s
    latency: float = 3e-3  # s, each hop
    loss: float = 0.01  # each hop
    link: Link = OnOff()  # noqa: RUF009
    kernel: Kernel = "float64"


@dataclass(frozen=True, slots=True)
class ChainRun:
    """Yaw errors (rad) and variances (rad^2) at the fixed epochs: (epochs, hops) each."""

    error: Array  # besides the constant errors of joints and mounts
    var: Array
    total_error: Array
    total_var: Array
    turning: npt.NDArray[np.bool_]  # (epochs,)


def motion_of(setup: ChainSetup, first_angle: float) -> Motion:
    """Rest, turn, rest, ... of the whole string."""
    turn = Trapezoid(TURNS * 2.0 * math.pi, math.radians(RATE_DPS), math.radians(ACCELERATION_DPS2))
    return Motion(BEGIN, HOLD, JOINT_TIME, REST, FINISH, turn, setup.blocks, 1.0, first_angle)


def epochs_of(motion: Motion) -> list[tuple[int, bool]]:
    """Cycles at which the filter is judged: 10 s before the end of each turning and of each rest."""
    ends = [(p.end - 10.0, p.kind == "drill") for p in motion.phases if p.kind in ("drill", "stop")]
    return [(math.floor((end - BEGIN) / PERIOD), turning) for end, turning in ends]


class Chain:
    """Nodes, truth and errors of one seed."""

    def __init__(self, setup: ChainSetup, seed: int) -> None:
        self._setup = setup
        self._random = stream(seed, setup.hops)
        self._motion = motion_of(setup, float(self._random.uniform(0.0, 2.0 * math.pi)))
        self._cycles = math.floor((self._motion.end - BEGIN) / PERIOD)
        self._disc = Disc(self._motion, COUNTS_PER_TURN, EDGE_STD, stream(seed, setup.hops, DISC_STREAM))
        hops = setup.hops
        angles = self._random.uniform(-math.pi, math.pi, hops)
        errors = setup.joint_std * self._random.standard_normal(hops)
        self._mounts = setup.mount_std * self._random.standard_normal(hops)
        self._true = np.cumsum(angles) + self._mounts
        self._systematic = np.cumsum(errors) - self._mounts
        readings = [Joint(float(wrap(a + e)), setup.joint_std) for a, e in zip(angles, errors, strict=True)]
        self._clocks = self._clock_errors()
        self._lost = self._random.random((self._cycles, hops)) < setup.loss
        self._lost[:, 0] |= ~self._passes(seed)
        self._tubes = [self._tube(k, readings) for k in range(hops)]
        ends: Array = BEGIN + PERIOD * np.arange(1.0, self._cycles + 1.0)
        self._samples = [self._sensor(k, ends) for k in range(hops)]

    def run(self) -> ChainRun:
        """Let the string turn and rest; returns what the filters knew at the fixed epochs."""
        wanted = dict(epochs_of(self._motion))
        encoder = EncoderNode()
        rows: list[tuple[list[float], list[float], list[float], list[float], bool]] = []
        for cycle in range(self._cycles):
            end = BEGIN + (cycle + 1) * PERIOD
            onward: list[Aiding | None] = [self._cycle(k, cycle, end) for k in range(self._setup.hops)]
            self._relay(cycle, self._measure(encoder, end), onward)
            if cycle in wanted:
                rows.append((*self._errors_at(end), wanted[cycle]))
        error, var, total_error, total_var, turning = (np.array(column) for column in zip(*rows, strict=True))
        return ChainRun(error, var, total_error, total_var, turning)

    def _tube(self, k: int, readings: list[Joint]) -> Tube:
        below = readings[k + 1] if k + 1 < len(readings) else Joint()
        settings = TubeSettings(
            k + 1,
            drive_joint=readings[0],
            lower_joint=below,
            mount_std=self._setup.mount_std,
            scheme=self._setup.scheme,
            state_every=10**9,
            kernel=self._setup.kernel,
        )
        return fresh_tube(settings)

    def _passes(self, seed: int) -> npt.NDArray[np.bool_]:
        """Whether the encoder is heard (cycles,); the phase of the link is that of the seed."""
        random = stream(seed, self._setup.hops, LINK_STREAM)
        times = PERIOD * np.arange(1.0, self._cycles + 1.0)
        return self._setup.link.passes(times + float(random.uniform(0.0, self._setup.link.repeats)))

    def _clock_errors(self) -> Array:
        """Error of every node's rig time (cycles, hops), s: those of the joints above, added up.

        A node dates its own cycles by its own crystal; what is wrong is when it takes an aiding to be valid.
        """
        setup, n = self._setup, self._setup.hops
        phi = math.exp(-PERIOD / setup.clock_wander_tau)
        draws = self._random.standard_normal((self._cycles, n))
        draws[1:] *= math.sqrt(1.0 - phi * phi)
        for k in range(1, self._cycles):
            draws[k] += phi * draws[k - 1]
        constant = setup.clock_std * self._random.standard_normal(n)
        return np.cumsum(constant + setup.clock_wander_std * draws, axis=1)

    def _sensor(self, k: int, ends: Array) -> list[list[float]]:
        hole = Borehole.straight(math.radians(INCLINATION_DEG))
        a = AccelerometerSection()
        truth = TubeTruth(hole, self._motion, 0.0, float(self._true[k]), a.radius_m, a.gravity_mps2)
        rate, force = truth.cycle_means(ends, PERIOD)
        errors = ImuErrors(GyroSection(), a)
        turning = (self._motion.drive(ends)[1] > 0.0).astype(float)
        samples: list[list[float]] = errors.readings(self._random, rate, force, turning, PERIOD).tolist()
        return samples

    def _cycle(self, k: int, cycle: int, end: float) -> Aiding | None:
        wx, wy, wz, fx, fy, fz = self._samples[k][cycle]
        around = RigContext(True, k + 1, end, self._setup.clock_std**2 * (k + 1), True)
        said = self._tubes[k].on_cycle(ImuReading(end - PERIOD, end, (wx, wy, wz), (fx, fy, fz)), around)
        return next((message for message in list(said) if isinstance(message, Aiding)), None)

    def _measure(self, encoder: EncoderNode, end: float) -> Aiding:
        count, edge_at, earlier = self._disc.sample(end)
        return encoder.on_cycle(EncoderSample(count, edge_at, True, earlier=earlier), end)

    def _relay(self, cycle: int, measured: Aiding, onward: list[Aiding | None]) -> None:
        """Down the string: ``forward`` hands on what came, the others what each node said in its cycle."""
        aiding: Aiding | None = measured
        for k, tube in enumerate(self._tubes):
            if aiding is not None and not self._lost[cycle, k]:
                passed = tube.on_aiding(aiding, aiding.valid_at + float(self._clocks[cycle, k]))
            else:
                passed = None
            aiding = passed if self._setup.scheme is Scheme.FORWARD else onward[k]

    def _errors_at(self, end: float) -> tuple[list[float], list[float], list[float], list[float]]:
        truth = float(self._motion.drive(np.array([end]))[0][0])
        total = [wrap(tube.yaw - truth - float(true)) for tube, true in zip(self._tubes, self._true, strict=True)]
        error = [wrap(t - float(s)) for t, s in zip(total, self._systematic, strict=True)]
        var = [tube.yaw_var for tube in self._tubes]
        total_var = [tube.yaw_var + tube.systematic_var for tube in self._tubes]
        return error, var, total, total_var


def run_seed(job: tuple[ChainSetup, int]) -> ChainRun:
    """One seed, for a pool of processes."""
    setup, seed = job
    return Chain(setup, seed).run()
