"""A string made ready for many seeds: what they share is worked out once, readings are drawn in the loop.

Joints, mounts, clocks and sensors of a run are the draws of the world of its seed (``sim.world``), so a run has the
string that a rig of its seed has; what is drawn cycle by cycle comes from ``sim.world.disturbance.philox``.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from node.kernels.arithmetic.formats import PERIOD, Array
from node.kernels.record.node_record import AIDING
from sim.string.allowlist import refuse_others
from sim.string.drill import drill_string, new_memory
from sim.string.head_measurements import measure_head
from sim.string.hops import draw_hops, hop_noise_of
from sim.string.nodes import loop_of, new_nodes
from sim.string.reading_suppliers import DrawnReadings, felt_by, new_readings
from sim.string.result import LOGGED_STATE, LOGGED_SURVEY, StationLog, wrap_angles
from sim.string.rough_runs import FieldRun, RoughWorld
from sim.string.schedule import StringSchedule, redraw_schedule, schedule_of
from sim.world.disturbance.records import make_shared, make_tubes
from sim.world.scenario import Scenario
from sim.world.world import World

Indices = npt.NDArray[np.int64]
BEFORE_END: Final = 10.0  # s, before the end of each turning and each rest: when a filter is judged
ANY_SEED: Final = 1  # of a world whose schedule alone is read
MOST_SURVEYS: Final = 4  # of a tube at a stop: one, and what faults of the filter may add
PLUMB: Final = 1e-6  # of the lean, below which a hole has no azimuth


class DrawnRun(NamedTuple):
    """What came of one seed, and the truth beside it."""

    schedule: StringSchedule
    surveys: Array  # (made,) of dtype ``LOGGED_SURVEY``
    states: Array  # (epochs, tubes) of dtype ``LOGGED_STATE``
    frame: Array  # (tubes,) rad, of the IMU's frame with the head at 0
    systematic: Array  # (tubes, tubes + 1) rad, error of the marks by tube and the top tube
    rough: FieldRun | None


class DrawnString:
    """A scenario whose readings can be drawn in the loop.

    Parameters
    ----------
    scenario : validated

    Attributes
    ----------
    schedule : of any seed, without what its encoder measures
    felt : what perfect sensors read, of all seeds
    epochs, turning : (epochs,) cycles at which every node is judged, and whether the string turns then

    Raises
    ------
    ScenarioError
        Names the key that cannot be expressed, and the command that can.
    """

    def __init__(self, scenario: Scenario) -> None:
        refuse_others(scenario)
        self.scenario = scenario
        world, section = World(scenario, ANY_SEED), scenario.file.rough
        still, phases = world.motion.starting_at(0.0), [p for p in world.phases if p.kind in ("drill", "stop")]
        self.rough = None if section is None else RoughWorld(world, section)
        self.schedule = schedule_of(world, np.zeros((0, AIDING)))
        self.felt = felt_by(scenario, still, world.ends)
        self.epochs = np.array([math.floor((p.end - BEFORE_END - world.begin) / PERIOD) for p in phases], np.int64)
        self.turning = np.array([p.kind == "drill" for p in phases])
        self._head, self._tops = still.drive(world.ends)[0], world.motion.tops(world.ends).astype(np.int64)
        self._depth = world.motion.depth(world.ends)[0]
        self._below = np.array([world.below(tube) for tube in range(1, scenario.tubes + 1)])
        self._shared, self._hop_noise = make_shared(scenario.file), hop_noise_of(scenario.file)
        self._epoch_of = np.full(world.cycles, -1)
        self._epoch_of[self.epochs] = np.arange(len(self.epochs))

    @property
    def node_cycles(self) -> int:
        """Cycles of all nodes in one run."""
        return int(self.schedule.powered.sum())

    def drill(self, seed: int) -> DrawnRun:
        """Every cycle of the run of a seed."""
        world, count = World(self.scenario, seed), self.scenario.tubes
        schedule, rough = self.redraw(world)
        loop, nodes, log = loop_of("float64", count), new_nodes(world), self.new_log()
        given = *loop, nodes, schedule, draw_hops(world), np.zeros(count), new_memory(), 0, world.cycles
        field = None if rough is None else rough.field
        drill_string(*given, drawn=self.new_readings(world), field=field, log=log)
        errors = [world.marks.errors(tube) - self.scenario.file.told.north for tube in range(1, count + 1)]
        systematic = np.array([np.pad(error, (tube, 0), "edge") for tube, error in enumerate(errors, 1)])
        return DrawnRun(schedule, log.surveys[: int(log.made[0])], log.states, frames_of(world), systematic, rough)

    def redraw(self, world: World) -> tuple[StringSchedule, FieldRun | None]:
        """Schedule of a world's seed with what its encoder measures, and its rough world if it is one."""
        rough = None if self.rough is None else self.rough.run(world)
        measured = measure_head(world) if rough is None else rough.measured
        return redraw_schedule(self.schedule, world, measured), rough

    def new_readings(self, world: World) -> DrawnReadings:
        """What the readings of a world's seed are drawn from."""
        tubes = make_tubes(self.scenario.file, world.seed, frames_of(world))
        return new_readings(world.seed, self._shared, tubes, self._hop_noise, self.felt)

    def new_log(self) -> StationLog:
        """What is kept of a run, before it."""
        epochs, count = len(self.epochs), self.scenario.tubes
        return StationLog(
            surveys=np.zeros(MOST_SURVEYS * count * epochs, LOGGED_SURVEY),
            made=np.zeros(1, np.int64),
            states=np.zeros((epochs, count), LOGGED_STATE),
            epochs=self._epoch_of,
        )

    def depths(self, place: Indices, cycle: Indices) -> Array:
        """True depths (n,) m along the hole of nodes at the ends of cycles."""
        return np.asarray(self._depth[cycle] - self._below[place])

    def yaw_errors(self, run: DrawnRun, place: Indices, cycle: Indices, yaw: Array) -> tuple[Array, Array]:
        """Errors of yaws (n,) rad, whole and constant part."""
        turned = self._head[cycle]
        if self.rough is not None and run.rough is not None:
            at = run.schedule.ends[cycle] + run.schedule.later[place]
            turned = self.rough.turned(run.rough, place, cycle, at)
        return wrap_angles(yaw - (turned + run.frame[place])), run.systematic[place, self._tops[cycle]]

    def direction_errors(self, surveys: Array, md: Array) -> tuple[Array, Array]:
        """Errors of inclination and azimuth (n,), from gravity and yaw. Source: thesis eqs. 1.1-1.3."""
        unit = surveys["force"] / np.linalg.norm(surveys["force"], axis=1, keepdims=True)
        c, s = np.cos(surveys["yaw"]), np.sin(surveys["yaw"])
        north, east = c * unit[:, 0] - s * unit[:, 1], s * unit[:, 0] + c * unit[:, 1]
        true = self.scenario.hole.tangent(np.maximum(md, 0.0))[0]
        lean, true_lean = np.hypot(north, east), np.hypot(true[:, 0], true[:, 1])
        inclination = np.arctan2(lean, -unit[:, 2]) - np.arctan2(true_lean, true[:, 2])
        azimuth = wrap_angles(np.arctan2(east, north) - np.arctan2(true[:, 1], true[:, 0]))
        return inclination, np.where(true_lean > PLUMB, azimuth, np.nan)


def frames_of(world: World) -> Array:
    """Angles (tubes,) rad of the IMUs' frames with the head at 0."""
    tubes = range(1, world.scenario.tubes + 1)
    return np.asarray(world.first_angle + np.array([world.marks.frame_angle(tube) for tube in tubes]))
