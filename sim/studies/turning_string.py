"""A complete string that rests, turns and rests in the time of this machine's clock, recorded for every node.

The recordings are what nodes with clocks of their own play by the clock (``timed:FILE``): mean readings with the usual
errors of the sensors, and the counts of the drive head. The marks of the joints are read without error, so the truth
of every yaw is known.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import numpy.typing as npt

from node.firmware.encoder import COUNTS_PER_TURN, EDGE_STD
from node.firmware.settings import Joint, TubeSettings
from node.kernels.angles import wrap
from node.kernels.layout import PERIOD
from sim.studies.chain import ACCELERATION_DPS2, INCLINATION_DEG, RATE_DPS
from sim.world.borehole import Borehole
from sim.world.disc import Disc
from sim.world.imu_errors import ImuErrors
from sim.world.motion import Motion, Trapezoid
from sim.world.scenario import AccelerometerSection, GyroSection
from sim.world.streams import stream
from sim.world.truth import TubeTruth
from telemetry.messages import ENCODER

Array = npt.NDArray[np.float64]
ROWS_A_CYCLE = 4
FARTHEST_CLOCK = 20.0  # s
ENCODER_DISC = 1000  # stream of random numbers, apart from those of the tubes
READING_STD = math.radians(0.05)  # rad, stated of joints and mounts


class TurningString:
    """Truth and recordings.

    Parameters
    ----------
    tubes : number of them, 1 is the lowest
    begin : s, encoder's clock
    rest, turning, length : s, at rest before the turning, of the turning, and of all
    seed : of every draw
    farthest_clock : s, of a node's clock from the encoder's
    """

    def __init__(
        self,
        tubes: int,
        begin: float,
        rest: float,
        turning: float,
        length: float,
        seed: int,
        farthest_clock: float = FARTHEST_CLOCK,
    ) -> None:
        self.tubes = tubes
        self._begin, self._length, self._seed = begin, length, seed
        random = stream(seed, 0)
        rate, acceleration = math.radians(RATE_DPS), math.radians(ACCELERATION_DPS2)
        turn = Trapezoid(rate * max(turning - rate / acceleration, 0.2 * turning), rate, acceleration)
        first_angle = float(random.uniform(0.0, 2.0 * math.pi))
        self._motion = Motion(begin, rest, 0.0, length, 0.0, turn, 1, 1.0, first_angle)
        self._joints = random.uniform(-math.pi, math.pi, tubes + 1)  # by tube: to the part above
        self._offsets = random.uniform(-farthest_clock, farthest_clock, tubes + 1)

    def offset(self, tube: int) -> float:
        """Clock of a node minus that of the encoder, s."""
        return 0.0 if tube == ENCODER else float(self._offsets[tube])

    def settings(self, tube: int) -> TubeSettings:
        """What the crew enters for a tube."""
        drive = Joint(float(self._joints[self.tubes]), READING_STD)
        below = Joint(float(self._joints[tube - 1]), READING_STD) if tube > 1 else Joint()
        return TubeSettings(tube, drive_joint=drive, lower_joint=below, mount_std=READING_STD)

    def yaw_error(self, tube: int, yaw: float, at: float) -> float:
        """What a yaw (rad) said for the rig time ``at`` (s) is off, rad."""
        return float(wrap(yaw - self._motion.drive(np.array([at]))[0][0] - self._angle(tube)))

    def turns_at(self, at: float) -> bool:
        """Whether the string turned at the rig time ``at`` or within the two cycles before it."""
        return bool(np.any(self._motion.drive(np.linspace(at - 2.0 * PERIOD, at, 3))[1] > 0.0))

    def record(self, folder: Path) -> None:
        """Write ``encoder.npy`` and ``tube-N.npy`` for every tube, in the times of their own clocks."""
        step = PERIOD / ROWS_A_CYCLE
        ends = self._begin + step * np.arange(1.0, self._length / step)
        np.save(folder / "encoder.npy", self._counts(ends))
        for tube in range(1, self.tubes + 1):
            readings = self._readings(tube, ends, step)
            np.save(folder / f"tube-{tube}.npy", np.column_stack([ends + self.offset(tube), readings]))

    def _counts(self, ends: Array) -> Array:
        disc = Disc(self._motion, COUNTS_PER_TURN, EDGE_STD, stream(self._seed, ENCODER_DISC))
        samples = [(end, *disc.sample(end)) for end in ends.tolist()]
        return np.array([[end, count, edge, 1.0, *earlier] for end, count, edge, earlier in samples])

    def _readings(self, tube: int, ends: Array, step: float) -> Array:
        lean, random = math.radians(INCLINATION_DEG), stream(self._seed, tube)
        hole = Borehole.straight(lean)
        usual = AccelerometerSection()
        # the noise is stated for the mean of a whole cycle
        accelerometer = usual.model_copy(update={"noise_deg": usual.noise_deg * math.sqrt(ROWS_A_CYCLE)})
        truth = TubeTruth(hole, self._motion, 0.0, self._angle(tube), usual.radius_m, usual.gravity_mps2)
        rate, force = truth.cycle_means(ends, step)
        errors = ImuErrors(GyroSection(), accelerometer)
        turning = (self._motion.drive(ends)[1] > 0.0).astype(float)
        return errors.readings(random, rate, force, turning, step)

    def _angle(self, tube: int) -> float:
        """Sum of the joints from the drive head to a tube, rad."""
        return float(np.sum(self._joints[tube:]))
