"""One run in the field: motion, encoder, truth and sensors that the table ``[rough]`` of its scenario asks for."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property

import numpy as np
import numpy.typing as npt

from sim.world.borehole import Borehole
from sim.world.disturbance.row import OneImu, TubeMotion
from sim.world.disturbance.sensor_reading import move_tube, show_disc
from sim.world.motion import Motion
from sim.world.moved_hole import MovedHole
from sim.world.rough_disc import RoughDisc
from sim.world.rough_motion import RoughMotion
from sim.world.rough_section import RoughSection
from sim.world.rough_truth import RoughTruth, transport_angle
from sim.world.scenario_file import ScenarioFile
from sim.world.truth import Twist

Array = npt.NDArray[np.float64]
HEAD = 0  # in the place of a tube


class RoughRun:
    """What the table makes of one run.

    Parameters
    ----------
    file : of the scenario
    motion : the schedule
    begin : s, rig time of the start
    seed : of the run
    line_errors : (counts,) rad, of the places of the encoder's lines
    """

    def __init__(self, file: ScenarioFile, motion: Motion, begin: float, seed: int, line_errors: Array) -> None:
        self._file, self._section, self._schedule = file, file.rough or RoughSection(), motion
        self._begin, self._seed, self._line_errors = begin, seed, line_errors
        self.moved = RoughMotion(self._section, motion, begin, seed)

    @cached_property
    def disc(self) -> RoughDisc:
        """The encoder."""
        section, moved = self._section.encoder, self.moved
        zero = self._file.told.north
        head = OneImu(self._file, self._seed, HEAD)
        return RoughDisc(
            section,
            moved.t,
            moved.head,
            self._begin,
            self._line_errors,
            self._seed,
            zero=zero,
            disturbed=lambda shown: show_disc(TubeMotion(moved.t, shown, moved.driven), head),
        )

    def truth(
        self,
        tube: int,
        hole: Borehole,
        below: float,
        twist: Twist | None,
        joint_angle: float,
        radius: float,
        gravity: float,
        unseen: Callable[[Array], Array] | None,
        hole_later: MovedHole | None,
    ) -> RoughTruth:
        """Perfect sensor of a tube; what it is given is as ``TubeTruth`` takes it."""
        section, moved = self._section, self.moved
        angle = moved.string - moved.twist(section.string)
        angle = move_tube(TubeMotion(moved.t, angle, moved.driven), OneImu(self._file, self._seed, tube))
        if twist is not None:
            angle = angle - twist(moved.t)[0]
        if section.string.transport == "parallel":
            reached = np.maximum(self._schedule.depth(moved.t)[0] - below, 0.0)
            angle = angle + transport_angle(hole, reached)
        given = hole, self._schedule, below, joint_angle, radius, gravity, None, unseen, hole_later
        return RoughTruth(moved.t, angle, *given)
