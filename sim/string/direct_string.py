"""The string with its link switched off: the firmware of every node on the world's sensors, aiding handed on directly.

Schedule, truth, sensors, joints, torsion and encoder are those of the world that a rig drills in; the firmware is the
node's. What stands for the link are its effects: each hop loses aiding, delays it and adds an error of rig time. There
are no frames, files or processes, so that a study of hundreds of seeds costs minutes. ``medium.link = "off"`` in
a scenario asks for it; ``sim.rig.in_process`` is the string with its link.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from node.firmware.inputs import RigContext
from node.firmware.reporter import VAR_FLOOR
from node.firmware.tube import Tube
from node.kernels.arithmetic.angles import wrap_angle
from node.kernels.step.node_step import ADMITTED
from sim.errors import ScenarioError
from sim.string.drill import drill_string, hand_down, new_memory, no_estimates
from sim.string.head_measurements import measure_head, row_of_aiding
from sim.string.hops import HOP
from sim.string.nodes import NEVER, loop_of, new_nodes, tuned_config
from sim.string.reading_suppliers import record_readings
from sim.string.result import NodeTrace, StringRun, StringSurvey, wrap_angles
from sim.string.schedule import StringSchedule, schedule_of
from sim.world.world import World
from telemetry.messages import Aiding, Event, Message, NodeState, SurveyMeasurement

Array = npt.NDArray[np.float64]


class DirectString:
    """One string of one world.

    Parameters
    ----------
    world : of a scenario whose link is off
    state_every : cycles between two states of a node; by default none is made

    Attributes
    ----------
    nodes : (tubes,) of dtype ``NODE``, the firmware's records
    readings : (cycles, tubes, IMUs, READING) what the nodes are given; a test may spoil those of cycles to come
    clock_shifts : s, by tube, that its clock is moved by; a test may set it between two cycles
    run : what the nodes knew so far

    Raises
    ------
    ScenarioError
        When the scenario has its link on, or tunes what does not exist.
    """

    def __init__(self, world: World, *, state_every: int = NEVER) -> None:
        file, count = world.scenario.file, world.scenario.tubes
        if file.medium.link != "off":
            raise ScenarioError('medium.link: expected "off" for a string without frames')
        self.world = world
        self._loop = loop_of(file.node.kernel, count)
        self._nodes = new_nodes(world, state_every)
        self.nodes = self._nodes.records
        config = tuned_config(file)
        self.tubes = {tube: self._tube(tube, config, state_every) for tube in range(1, count + 1)}
        self.schedule: StringSchedule = schedule_of(world, measure_head(world))
        self._recorded = record_readings(world)
        self.readings = self._recorded.readings
        self._hops = np.zeros(count, HOP)
        self._estimates = None if file.node.scheme == "forward" else no_estimates(count)
        self._memory = new_memory()
        self.clock_shifts: dict[int, float] = {}
        self._mount_var = math.radians(file.joints.mount_std_deg) ** 2
        at = self.schedule.ends[:, None] + self.schedule.later
        self._truth = np.stack([world.truth(tube).yaw(at[:, tube - 1]) for tube in self.tubes], axis=1)
        self._systematic = np.stack([world.systematic_errors(tube, at[:, tube - 1]) for tube in self.tubes], axis=1)
        yaw, total, systematic, var, systematic_var, bias = np.full((6, *at.shape), math.nan)
        turning = world.motion.drive(world.ends)[1] > 0.0
        self.run = StringRun(world.ends, turning, yaw, total, systematic, var, systematic_var, bias)
        self._trace = NodeTrace(yaw, var, systematic_var, bias, np.zeros(count, np.int64))

    def drill(self) -> StringRun:
        """Every cycle of the schedule; returns what the nodes knew."""
        cycle = 0
        while cycle < self.world.cycles:
            cycle = self._advance(cycle, self.world.cycles)
        return self.run

    def steps(self) -> Iterator[int]:
        """Cycle by cycle, each yielded when it is done, so that a study may act between two."""
        for cycle in range(self.world.cycles):
            self._advance(cycle, cycle + 1)
            yield cycle

    def _tube(self, tube: int, config: Array, state_every: int) -> Tube:
        """The node of a tube on its records, which says what the kernel found that it has to say."""
        one, integers = slice(tube - 1, tube), self._loop.integers
        return Tube(
            replace(self.world.tube_settings(tube), state_every=state_every),
            config,
            self.nodes[one],
            iter(range(NEVER)).__next__,
            restored=False,
            corrections=self._nodes.corrections[tube - 1],
            integers=None if integers is None else integers.memory[one],
        )

    def _advance(self, first: int, last: int) -> int:
        """Run the cycle ``first``, and those after it while no node has anything to say; returns which is next."""
        loop, nodes, schedule, hops = self._loop, self._nodes, self.schedule, self._hops
        shifts = np.array([self.clock_shifts.get(tube, 0.0) for tube in self.tubes])
        given = *loop, nodes, schedule, hops, shifts, self._memory, first, last, self._recorded
        reached = int(drill_string(*given, estimates=self._estimates, trace=self._trace))
        self._set_beside_truth(first, reached)
        cycle = reached - 1
        telling = np.flatnonzero(self._trace.says[: schedule.powered[cycle]] & ~ADMITTED).tolist()[::-1]
        for place in telling:
            self._keep_messages(cycle, place, self._messages(cycle, place, float(shifts[place])))
        if telling and schedule.locked:
            hand_down(*loop[1:], nodes, schedule, hops, shifts, self._memory.aiding, cycle, self._estimates)
        return reached

    def _messages(self, cycle: int, place: int, shift: float) -> Sequence[Message]:
        """What a node has to say of a cycle."""
        schedule, later = self.schedule, float(self.schedule.later[place])
        end, hops = float(schedule.ends[cycle]), int(schedule.powered[cycle]) - place
        joined, clock_var = bool(schedule.joined[cycle, place]), float(schedule.clock_var[hops - 1])
        around = RigContext(joined, hops, end + later, clock_var, True)
        return list(self.tubes[place + 1].say(int(self._trace.says[place]), end + (later + shift), around))

    def _set_beside_truth(self, first: int, last: int) -> None:
        """Set what the nodes knew in the cycles ``first``..``last`` - 1 beside the truth."""
        run, rows = self.run, np.s_[first:last]
        unknown = np.isnan(run.yaw[rows])
        run.total_error[rows] = wrap_angles(run.yaw[rows] - self._truth[rows])
        run.systematic_error[rows] = np.where(unknown, math.nan, self._systematic[rows])
        run.var[rows] = np.maximum(run.var[rows], VAR_FLOOR)
        run.systematic_var[rows] += self._mount_var

    def _keep_messages(self, cycle: int, place: int, messages: Sequence[Message]) -> None:
        """Keep what a node had to say."""
        run, estimates = self.run, self._estimates
        for message in messages:
            if isinstance(message, Aiding) and estimates is not None:
                estimates.said[place], estimates.told[place] = row_of_aiding(message), True
            elif isinstance(message, SurveyMeasurement):
                self._keep_survey(cycle, place + 1, message)
            elif isinstance(message, Event):
                run.events.append((cycle, message))
            elif isinstance(message, NodeState):
                run.states.append((cycle, message))

    def _keep_survey(self, cycle: int, tube: int, message: SurveyMeasurement) -> None:
        run = self.run
        for first in reversed(run.surveys):
            if (first.tube, first.measurement.station_at) == (tube, message.station_at):
                moved = wrap_angle(message.yaw - first.measurement.yaw)
                run.revisions.append(StringSurvey(first.cycle, tube, first.error + moved, message, cycle))
                return
        run.surveys.append(StringSurvey(cycle, tube, float(run.total_error[cycle, tube - 1]), message, cycle))
