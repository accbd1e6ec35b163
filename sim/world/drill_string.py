"""The string of one scenario and seed, as it is: schedule, joints, twist, and where each of its tubes looks.

What reads of it is in ``sim.world.sensors`` and ``sim.world.world``.
"""

from __future__ import annotations

import math
from functools import cached_property, partial
from typing import Any

import numpy as np
import numpy.typing as npt

from node.kernels.arithmetic.formats import PERIOD
from sim.world.disc import Disc
from sim.world.marks import Marks
from sim.world.motion import Motion, SchedulePhase, Trapezoid
from sim.world.moved_hole import MovedHole, move_hole
from sim.world.rack import Rack
from sim.world.random_streams import RandomStream, random_stream
from sim.world.rough_run import RoughRun
from sim.world.rough_truth import RoughTruth
from sim.world.scenario import Scenario
from sim.world.torsion import StringTorsion
from sim.world.truth import TubeTruth

Array = npt.NDArray[np.float64]
FREE_BEFORE = 1.0  # s before a joint is closed, at which a free head turns


class DrillString:
    """Truth of a string in its hole.

    Parameters
    ----------
    scenario : validated
    seed : of every draw; a stream depends on the seed, its purpose and its tube, on nothing else
    """

    def __init__(self, scenario: Scenario, seed: int) -> None:
        self.scenario = scenario
        self.seed = seed
        file = scenario.file
        self.first_angle = float(random_stream(seed, RandomStream.DRIVE, 0).uniform(0.0, 2.0 * math.pi))
        self.begin = file.schedule.begin_s
        self.rack = None if file.calibration is None else Rack(file.calibration, self.begin)
        self.motion = self._motion(self.begin if self.rack is None else self.rack.end)
        self.marks = Marks(scenario, seed, self.motion)
        self.torsion = self._string_torsion()
        self.phases: tuple[SchedulePhase, ...] = self.motion.phases
        self.end = self.motion.end
        self._rough_truths: dict[int, RoughTruth] = {}
        turns_free = bool(file.joints.head_turn_deg)
        free_at = (self.marks.made_up - FREE_BEFORE).tolist() if turns_free else []
        free_by = self.marks.free_turns.tolist() if turns_free else []
        edge_std, lines = math.radians(file.encoder.edge_std_deg), random_stream(seed, RandomStream.DISC, 0)
        self.disc = Disc(
            self.motion, file.encoder.counts_per_turn, edge_std, lines, free_at, free_by, zero=file.told.north
        )

    @property
    def cycles(self) -> int:
        """Cycles of the whole schedule."""
        return math.floor((self.end - self.begin) / PERIOD + 1e-9)

    @cached_property
    def ends(self) -> Array:
        """Rig times (cycles,) at which the cycles of the encoder end."""
        return np.asarray(self.begin + PERIOD * np.arange(1.0, self.cycles + 1.0))

    def cycle_end(self, cycle: int) -> float:
        """Rig time at which the cycle ``cycle`` (from 0) of the encoder ends."""
        return self.begin + (cycle + 1) * PERIOD

    def phase(self, tube: int) -> float:
        """Time (s) by which a tube's cycles end after those of the encoder, less than a cycle."""
        return self._phases[tube]

    def truth(self, tube: int) -> TubeTruth:
        """Perfect sensor of a tube."""
        a, below = self.scenario.file.accelerometer, self.below(tube)
        joint = self.marks.frame_angle(tube)
        twist = None if self.torsion is None else partial(self.torsion.twist, tube)
        slips = partial(self.marks.unseen, tube) if self.scenario.file.joints.unseen_std_deg else None
        hole, motion = self.scenario.hole, self.motion
        if self.scenario.file.rough is None:
            return TubeTruth(hole, motion, below, joint, a.radius_m, a.gravity_mps2, twist, slips, self.moved_hole)
        return self._rough_truth(tube, joint, a.radius_m, a.gravity_mps2, slips, self.moved_hole)

    def below(self, tube: int) -> float:
        """Length (m) of the string below the node of a tube."""
        return self.scenario.file.told.below(tube, self.scenario.tube_length)

    @cached_property
    def moved_hole(self) -> MovedHole | None:
        """What becomes of the hole while the rig drills."""
        section = self.scenario.file.path.moved
        return None if section is None else move_hole(self.scenario.hole, section, self.begin)

    def yaw_truth(self, tube: int, t: float) -> float:
        """True yaw (rad, unwrapped) of the IMU's frame of a tube that is part of the string."""
        return float(self.truth(tube).yaw(np.array([t]))[0])

    def systematic_error(self, tube: int, t: float) -> float:
        """Constant part of a yaw's error at one rig time, rad; see ``systematic_errors``."""
        return float(self.systematic_errors(tube, np.array([t]))[0])

    def systematic_errors(self, tube: int, t: Array) -> Array:
        """Errors (n,) of a yaw known only through the marks: estimate - truth = random error + this (rad).

        Where joints are solved it is the mark of the time when the tube was on top, and what each solution left.
        """
        if self.scenario.file.node.joints == "marks":
            rigid = self.marks.errors(tube)[np.maximum(self.motion.tops(t), tube) - tube]
        else:
            made_up = max(self.scenario.file.rig.tubes_at_start, tube)
            rigid = self.marks.errors(tube)[made_up - tube] - self.marks.unseen(tube, t)
        rigid = rigid - self.scenario.file.told.north
        return np.asarray(rigid if self.torsion is None else rigid + self.torsion.twist(tube, t)[0])

    def truth_station(self, md: float) -> dict[str, float]:
        """Direction and position of the hole at one depth, degrees and metres; as a hole that moves is at the end."""
        hole = self.scenario.hole if self.moved_hole is None else self.moved_hole.hole
        inclination, azimuth = hole.direction(md)
        north, east, tvd = hole.position(md)
        return {
            "md_m": md,
            "inclination_deg": math.degrees(inclination),
            "azimuth_deg": math.degrees(azimuth),
            "north_m": float(north),
            "east_m": float(east),
            "tvd_m": float(tvd),
        }

    @cached_property
    def rough_run(self) -> RoughRun:
        """What the table ``rough`` makes of this run."""
        return RoughRun(self.scenario.file, self.motion, self.begin, self.seed, self.disc.errors)

    def _rough_truth(self, tube: int, *given: Any) -> RoughTruth:
        if tube not in self._rough_truths:
            twist = None if self.torsion is None else partial(self.torsion.twist, tube)
            hole, below = self.scenario.hole, self.below(tube)
            self._rough_truths[tube] = self.rough_run.truth(tube, hole, below, twist, *given)
        return self._rough_truths[tube]

    def _motion(self, drilling: float) -> Motion:
        """The schedule, which drills from a rig time (s) on."""
        file, s = self.scenario.file, self.scenario.file.schedule
        turn = Trapezoid(
            file.rotation.turns * 2.0 * math.pi,
            math.radians(file.rotation.rate_dps),
            math.radians(file.rotation.acceleration_dps2),
        )
        return Motion(
            drilling,
            s.add_s,
            s.joint_s,
            s.stop_s,
            s.finish_s,
            turn,
            self.scenario.tubes,
            self.scenario.tube_length,
            self.first_angle,
            at_start=file.rig.tubes_at_start,
            blocks=s.blocks,
            advance=file.rotation.advance_m,
            depth_at_start=file.rig.depth_at_start_m,
            longer=file.told.lengths_off_m if file.rotation.advance_m is None else (),
        )

    def _string_torsion(self) -> StringTorsion | None:
        section = self.scenario.file.torsion
        if section is None:
            return None
        lengths = self.motion.lengths.astype(float)
        trapped = section.trapped_fraction * np.abs(
            random_stream(self.seed, RandomStream.TORSION, 0).standard_normal(len(lengths))
        )
        return StringTorsion(section, self.motion, self.scenario.tube_length, lengths, trapped)

    @cached_property
    def _phases(self) -> list[float]:
        draws = PERIOD * random_stream(self.seed, RandomStream.PHASES, 0).random(self.scenario.tubes + 1)
        locked = self.scenario.file.encoder.phase == "locked"
        return [0.0] * len(draws) if locked else draws.tolist()
