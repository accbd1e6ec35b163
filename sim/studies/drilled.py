"""A string that grows and twists, in one process: firmware of every node, tubes added on top, torque and its release.

Beside ``chain``, whose string is rigid and complete, this one tells what torsion and joints do to the yaw that counts:
the surveys of every stop are judged against the truth, with all constant errors.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import partial
from typing import Literal

import numpy as np
import numpy.typing as npt

from node.firmware.encoder import QUANTUM, EncoderNode, EncoderSample
from node.firmware.inputs import ImuReading, RigContext
from node.firmware.settings import Joint, JointRule, Kernel, TubeSettings
from node.firmware.torque import TorqueSettings
from node.firmware.tube import Tube
from node.kernels.angles import wrap
from node.kernels.layout import PERIOD
from sim.studies.fresh import fresh_tube
from sim.world.borehole import Borehole
from sim.world.imu_errors import ImuErrors
from sim.world.motion import Motion, Trapezoid
from sim.world.scenario import AccelerometerSection, GyroSection, TorsionSection
from sim.world.streams import stream
from sim.world.torsion import StringTorsion, stiffness
from sim.world.truth import TubeTruth
from telemetry.messages import Aiding, Event, SurveyMeasurement

Array = npt.NDArray[np.float64]
BEGIN, HOLD, JOINT_TIME, FINISH = 1000.0, 58.0, 5.0, 1.0  # s
RATE_DPS, ACCELERATION_DPS2, INCLINATION_DEG = 71.0, 35.0, 2.0
SILENT_AFTER = 3.5  # s, until a neighbour is taken for gone


@dataclass(frozen=True, slots=True)
class DrilledSetup:
    """One string and its schedule; SI and radians."""

    first: int  # tubes in the string from the start
    blocks: int  # of holding, turning and resting
    added: int = 0  # tubes, one before each block after the first
    tube_length: float = 3.0  # m
    turns: float = 5.0
    stop: float = 32.0  # s
    torsion: TorsionSection | None = None
    rule: Literal["gate", "variance", "ignore"] = "gate"
    joints: JointRule = "marks"
    joint_std: float = math.radians(0.05)
    mount_std: float = math.radians(0.05)
    clock_std: float = 0.2e-3  # s, of a node's rig time
    loss: float = 0.01  # each hop
    unseen_std: float = math.radians(0.01)  # rad, what the string below turns at a make-up, seen by no gyroscope
    head_turn: float = 0.0  # rad, about so far the head turns, free of the string, at each make-up
    kernel: Kernel = "float64"

    @property
    def tubes(self) -> int:
        """Tubes in the string at the end."""
        return self.first + self.added

    def lengths(self) -> npt.NDArray[np.intp]:
        """Tubes in the string in each block, (blocks,)."""
        return self.first + np.minimum(np.arange(self.blocks), self.added)


@dataclass(slots=True)
class DrilledRun:
    """What became of one seed; tubes count from 1, the lowest."""

    ends: Array  # (cycles,) s
    error: Array  # (cycles, tubes) rad, yaw as estimated less the truth; nan before a tube is there
    surveys: list[tuple[int, int, float, float]] = field(default_factory=list)  # block, tube, error (rad), variance
    events: list[tuple[int, Event]] = field(default_factory=list)  # cycle

    def nees(self, tube: int) -> list[float]:
        """Normalised error squared of each survey of a tube."""
        return [error**2 / var for _, who, error, var in self.surveys if who == tube]


class DrilledString:
    """Nodes, truth and errors of one seed."""

    def __init__(self, setup: DrilledSetup, seed: int) -> None:
        self._setup = setup
        self._random = stream(seed, setup.tubes, setup.blocks)
        turn = Trapezoid(setup.turns * 2.0 * math.pi, math.radians(RATE_DPS), math.radians(ACCELERATION_DPS2))
        angle = float(self._random.uniform(0.0, 2.0 * math.pi))
        self.motion = Motion(BEGIN, HOLD, JOINT_TIME, setup.stop, FINISH, turn, setup.blocks, setup.tube_length, angle)
        self.ends: Array = BEGIN + PERIOD * np.arange(1.0, math.floor((self.motion.end - BEGIN) / PERIOD) + 1.0)
        self._adds = [phase for phase in self.motion.phases if phase.kind == "add"]
        self._torsion = self._string_torsion()
        self._draw_joints()
        self._clocks = setup.clock_std * self._random.standard_normal(setup.tubes)
        self._lost = self._random.random((len(self.ends), setup.tubes)) < setup.loss
        truths = [self._truth(tube) for tube in range(1, setup.tubes + 1)]
        self._yaws = [truth.yaw(self.ends) for truth in truths]
        self._samples = [self._sensor(truth) for truth in truths]
        self._tubes = [self._tube(tube) for tube in range(1, setup.tubes + 1)]

    def run(self) -> DrilledRun:
        """Let the string be drilled; returns errors, surveys and events."""
        setup = self._setup
        known = setup.torsion if setup.rule != "ignore" else None
        settings = TorqueSettings(trapped_fraction=known.trapped_fraction if known is not None else 0.0)
        encoder = EncoderNode(torque=settings)
        run = DrilledRun(self.ends, np.full((len(self.ends), setup.tubes), math.nan))
        for cycle, end in enumerate(self.ends.tolist()):
            block = self._block(end)
            count = int(setup.lengths()[block])
            for tube in range(count, 0, -1):
                self._cycle(run, tube, count, cycle, end)
            self._relay(cycle, count, self._measure(encoder, end), end)
        return run

    def _block(self, t: float) -> int:
        return max(sum(phase.start <= t for phase in self._adds) - 1, 0)

    def _joint_is_open(self, t: float, silent: float = 0.0) -> bool:
        """Whether the joint below the head is open, and was for ``silent`` s."""
        added = self._adds[1 : 1 + self._setup.added]
        return any(phase.start + silent < t < phase.joint_closed for phase in added)

    def _string_torsion(self) -> StringTorsion | None:
        setup = self._setup
        draws = np.abs(self._random.standard_normal(setup.blocks))
        if setup.torsion is None:
            return None
        trapped = setup.torsion.trapped_fraction * draws
        return StringTorsion(setup.torsion, self.motion, setup.tube_length, setup.lengths().astype(float), trapped)

    def _draw_joints(self) -> None:
        """True angles and readings by tube (index 0 unused); the string stands while a tube is added.

        ``drive`` is known of every tube that is on top at some time, the others have a joint above from the start.
        """
        setup, random = self._setup, self._random
        count = setup.tubes
        lower = random.uniform(-math.pi, math.pi, count + 1)
        self._slips = setup.unseen_std * random.standard_normal(setup.added)
        self._free = np.concatenate([[0.0], np.cumsum(setup.head_turn * random.uniform(0.5, 1.5, setup.added))])
        drive = np.zeros(count + 1)
        drive[setup.first] = random.uniform(-math.pi, math.pi)
        for tube in range(setup.first + 1, count + 1):
            drive[tube] = drive[tube - 1] - lower[tube] + self._slips[tube - setup.first - 1]
        self._drive, self._lower = drive, lower
        before = self._free[np.maximum(np.arange(count + 1) - setup.first, 0)]
        self._drive_read = drive - before + setup.joint_std * random.standard_normal(count + 1)
        self._lower_read = lower + setup.joint_std * random.standard_normal(count + 1)
        self._mounts = setup.mount_std * random.standard_normal(count + 1)

    def _truth(self, tube: int) -> TubeTruth:
        setup, a = self._setup, AccelerometerSection()
        hole = Borehole.straight(math.radians(INCLINATION_DEG))
        top = max(tube, setup.first)
        joint = self._drive[top] + float(np.sum(self._lower[tube + 1 : top + 1])) + self._mounts[tube]
        twist = None if self._torsion is None else partial(self._torsion.twist, tube)
        return TubeTruth(hole, self.motion, 0.0, float(joint), a.radius_m, a.gravity_mps2, twist)

    def unseen(self, tube: int, t: float) -> float:
        """What a tube has turned without any gyroscope telling (rad); that of a new one is counted from its make-up."""
        made_up = sum(phase.joint_closed <= t for phase in self._adds[1 : 1 + self._setup.added])
        return float(np.sum(self._slips[max(tube - self._setup.first, 0) : made_up]))

    def _sensor(self, truth: TubeTruth) -> list[list[float]]:
        rate, force = truth.cycle_means(self.ends, PERIOD)
        errors = ImuErrors(GyroSection(), AccelerometerSection())
        turning = (self.motion.drive(self.ends)[1] > 0.0).astype(float)
        samples: list[list[float]] = errors.readings(self._random, rate, force, turning, PERIOD).tolist()
        return samples

    def _tube(self, tube: int) -> Tube:
        setup = self._setup
        settings = TubeSettings(
            tube,
            drive_joint=Joint(float(wrap(self._drive_read[tube])), setup.joint_std),
            lower_joint=Joint(float(wrap(self._lower_read[tube])), setup.joint_std),
            mount_std=setup.mount_std,
            state_every=10**9,
            kernel=setup.kernel,
            stiffness=math.inf if setup.torsion is None else stiffness(setup.torsion, setup.tube_length),
            torsion="variance" if setup.rule == "variance" else "gate",
            joints=setup.joints,
        )
        return fresh_tube(settings)

    def _cycle(self, run: DrilledRun, tube: int, count: int, cycle: int, end: float) -> None:
        setup = self._setup
        wx, wy, wz, fx, fy, fz = self._samples[tube - 1][cycle]
        below_open = tube == count - 1 and self._joint_is_open(end, SILENT_AFTER)
        joined = not below_open and not (tube == count > setup.first and self._joint_is_open(end))
        around = RigContext(joined, count - tube + 1, end, setup.clock_std**2, True)
        reading = ImuReading(end - PERIOD, end, (wx, wy, wz), (fx, fy, fz))
        node = self._tubes[tube - 1]
        said = list(node.on_cycle(reading, around))
        error = float(wrap(node.yaw - self._yaws[tube - 1][cycle] - self.unseen(tube, end)))
        run.error[cycle, tube - 1] = error
        for message in said:
            if isinstance(message, SurveyMeasurement):
                run.surveys.append((self._block(end), tube, error, message.yaw_var + message.systematic_var))
            elif isinstance(message, Event):
                run.events.append((cycle, message))

    def _measure(self, encoder: EncoderNode, end: float) -> Aiding:
        t = np.array([end])
        turned_at = [phase.joint_closed - 1.0 for phase in self._adds[1 : 1 + self._setup.added]]
        times = sum(at <= end for at in turned_at) if self._setup.head_turn else 0
        free = float(self._free[times])
        count = math.floor((float(self.motion.drive(t)[0][0]) + free) / QUANTUM + 1e-9)
        edge = max(self.motion.time_of_angle(count * QUANTUM - free), *turned_at[times - 1 : times], BEGIN)
        known = self._torsion is not None and self._setup.rule != "ignore"
        torque = float(self._torsion.torque(t)[0]) if self._torsion is not None and known else 0.0
        return encoder.on_cycle(EncoderSample(count, min(edge, end), True, torque), end)

    def _relay(self, cycle: int, count: int, measured: Aiding, end: float) -> None:
        """Down the string; nothing passes an open joint, and the new tube has no head above it yet."""
        aiding: Aiding | None = measured
        if self._joint_is_open(end):
            return
        for tube in range(count, 0, -1):
            if aiding is None or self._lost[cycle, tube - 1]:
                return
            aiding = self._tubes[tube - 1].on_aiding(aiding, aiding.valid_at + float(self._clocks[tube - 1]))
