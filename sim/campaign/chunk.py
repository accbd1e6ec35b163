"""A chunk of a campaign: some runs one after another, as columns of numbers.

Every computer of a chunk, a process of this machine or a worker of a cluster, gets the same numbers: they depend on the
scenario and the numbers of the runs alone.
"""

from __future__ import annotations

import hashlib
import pickle
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Final, TypeAlias

import numpy as np
import numpy.typing as npt

from node.firmware.block_trial import record_of
from node.kernels.arithmetic.formats import Array
from node.kernels.step.address import firmware_addresses
from sim.campaign.course import ANY_SEED, Course, course_of
from sim.campaign.draws import Draws, draws_of, fresh_nodes, noise_of, tubes_of
from sim.campaign.drill import CODES, STATE_OF, SURVEY, drill
from sim.campaign.field_draws import FieldRun, RoughWorld
from sim.campaign.sensors import new_work
from sim.rig.direct_string import joined_of, wrapped
from sim.rig.encoder_course import measured_of
from sim.world.scenario import Scenario
from sim.world.world import World
from telemetry.parameters import ParameterBlock

Columns: TypeAlias = dict[str, npt.NDArray[Any]]
RUNS: Final = 64  # of a chunk
MOST_SURVEYS: Final = 4  # of a tube at a stop: one, and what faults of the filter may add


@dataclass(frozen=True, slots=True)
class Chunk:
    """What came of the runs of a chunk; columns of one table have one length. SI and radians."""

    surveys: Columns
    epochs: Columns


SURVEY_COLUMNS: Final = {
    "run": "number of the run, which is its seed",
    "tube": "1 is the lowest",
    "hop": "joints from the drive head",
    "at": "s, rig time at the end of the cycle that made the survey",
    "md": "m, measured depth of the node",
    "yaw_error": "rad, estimate less truth, with the constant errors of joints and mount",
    "systematic_error": "rad, of it what joints and mount are wrong by",
    "yaw_var": "rad^2, stated, of the random part",
    "systematic_var": "rad^2, stated, of the constant part",
    "inclination_error": "rad",
    "azimuth_error": "rad; nothing where the hole is plumb",
    "trusted": "whether the yaw was known and no sensor failed",
}
EPOCH_COLUMNS: Final = {
    "run": "number of the run, which is its seed",
    "hop": "joints from the drive head",
    "at": "s, rig time",
    "turning": "whether the string turned",
    "known": "whether the node knew its yaw",
    "yaw_error": "rad, estimate less truth, with the constant errors of joints and mount",
    "systematic_error": "rad, of it what joints and mount are wrong by",
    "yaw_var": "rad^2, stated, of the random part",
    "systematic_var": "rad^2, stated, of the constant part",
}
PLUMB: Final = 1e-6  # of the lean, below which a hole has no azimuth


class Campaign:
    """A scenario made ready for many runs.

    Parameters
    ----------
    scenario : validated

    Raises
    ------
    ScenarioError
        Names what a campaign cannot express.
    """

    def __init__(self, scenario: Scenario) -> None:
        self._scenario = scenario
        self.course: Course = course_of(scenario)
        self._noise = noise_of(scenario.file)
        self._mount_var = float(np.radians(scenario.file.joints.mount_std_deg)) ** 2
        world, count, rough = World(scenario, ANY_SEED), scenario.tubes, scenario.file.rough
        self._depth = world.motion.depth(self.course.ends)[0]
        self.rough = None if rough is None else RoughWorld(world, rough)
        self._corrections = np.stack([np.concatenate([record_of(ParameterBlock(k + 1, 0))] * 2) for k in range(count)])
        self._work = new_work(count)

    @property
    def node_cycles(self) -> int:
        """Cycles of all nodes in one run."""
        return int(self.course.powered.sum())

    def chunk(self, first: int, last: int) -> Chunk:
        """The runs ``first``..``last``."""
        runs = [self.run(run) for run in range(first, last + 1)]
        surveys, epochs = zip(*runs, strict=True)
        return Chunk(joined(surveys), joined(epochs))

    def run(self, seed: int) -> tuple[Columns, Columns]:
        """Surveys and epochs of one run."""
        world = World(self._scenario, seed)
        count, course = self._scenario.tubes, self.course
        field = None if self.rough is None else self.rough.run(world)
        draws = draws_of(world, measured_of(world) if field is None else field.measured)
        if not course.locked:
            course = course._replace(joined=joined_of(world, course.powered, draws.phase))
        nodes, crews = fresh_nodes(world)
        surveys = np.zeros(MOST_SURVEYS * count * len(self.course.epochs), SURVEY)
        epochs = np.zeros((len(self.course.epochs), count), STATE_OF)
        key = np.array([seed & 0xFFFFFFFF, seed >> 32], np.uint64)
        counts = np.zeros((count, CODES), np.int64)
        step, aid = firmware_addresses()
        made = drill(
            step,
            aid,
            nodes,
            crews,
            self._corrections,
            course,
            self._noise,
            tubes_of(world, draws.frame),
            draws,
            None if field is None else field.field,
            key,
            self._work,
            surveys,
            epochs,
            counts,
        )
        return self._surveys(seed, draws, field, surveys[:made]), self._epochs(seed, draws, field, epochs)

    def _surveys(self, seed: int, draws: Draws, field: FieldRun | None, made: Array) -> Columns:
        course, place, cycle = self.course, made["tube"] - 1, made["cycle"]
        md = self._depth[cycle] - place * self._scenario.tube_length
        error, systematic = self._errors(draws, field, place, cycle, made["yaw"])
        inclination, azimuth = self._direction_errors(made, md)
        return {
            "run": np.full(len(made), seed, np.int64),
            "tube": made["tube"].astype(np.int16),
            "hop": (made["top"] - place).astype(np.int16),
            "at": course.ends[cycle] + draws.phase[place],
            "md": md,
            "yaw_error": error,
            "systematic_error": systematic,
            "yaw_var": made["yaw_var"].copy(),
            "systematic_var": made["systematic_var"] + self._mount_var,
            "inclination_error": inclination,
            "azimuth_error": azimuth,
            "trusted": made["trusted"].astype(bool),
        }

    def _epochs(self, seed: int, draws: Draws, field: FieldRun | None, epochs: Array) -> Columns:
        course = self.course
        which, place = np.nonzero(np.arange(epochs.shape[1]) < course.powered[course.epochs][:, None])
        cycle, kept = course.epochs[which], epochs[which, place]
        error, systematic = self._errors(draws, field, place, cycle, kept["yaw"])
        return {
            "run": np.full(len(kept), seed, np.int64),
            "hop": (course.powered[cycle] - place).astype(np.int16),
            "at": course.ends[cycle] + draws.phase[place],
            "turning": course.turning[which],
            "known": kept["known"].astype(bool),
            "yaw_error": error,
            "systematic_error": systematic,
            "yaw_var": kept["yaw_var"].copy(),
            "systematic_var": kept["systematic_var"] + self._mount_var,
        }

    def _errors(
        self,
        draws: Draws,
        field: FieldRun | None,
        place: npt.NDArray[np.int64],
        cycle: npt.NDArray[np.int64],
        yaw: Array,
    ) -> tuple[Array, Array]:
        """Errors of yaws (n,), whole and constant part."""
        turned = self.course.head[cycle]
        if self.rough is not None and field is not None:
            turned = self.rough.turned(field, place, cycle, self.course.ends[cycle] + draws.phase[place])
        return wrapped(yaw - (turned + draws.frame[place])), draws.systematic[place, self.course.tops[cycle]]

    def _direction_errors(self, made: Array, md: Array) -> tuple[Array, Array]:
        """Errors of inclination and azimuth (n,), from gravity and yaw. Source: thesis eqs. 1.1-1.3."""
        unit = made["force"] / np.linalg.norm(made["force"], axis=1, keepdims=True)
        c, s = np.cos(made["yaw"]), np.sin(made["yaw"])
        north, east = c * unit[:, 0] - s * unit[:, 1], s * unit[:, 0] + c * unit[:, 1]
        true = self._scenario.hole.tangent(np.maximum(md, 0.0))[0]
        lean, true_lean = np.hypot(north, east), np.hypot(true[:, 0], true[:, 1])
        inclination = np.arctan2(lean, -unit[:, 2]) - np.arctan2(true_lean, true[:, 2])
        azimuth = wrapped(np.arctan2(east, north) - np.arctan2(true[:, 1], true[:, 0]))
        return inclination, np.where(true_lean > PLUMB, azimuth, np.nan)


def joined(parts: tuple[Columns, ...]) -> Columns:
    """Columns one below the other."""
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


@lru_cache(maxsize=1)
def campaign_of(scenario: bytes) -> Campaign:
    """The campaign of a pickled scenario, kept in a worker from chunk to chunk."""
    return Campaign(pickle.loads(scenario))


def run_chunk(scenario: bytes, first: int, last: int) -> Chunk:
    """The runs ``first``..``last`` of a pickled scenario; what a pool or a cluster calls."""
    return campaign_of(scenario).chunk(first, last)


def scenario_digest(scenario: Scenario) -> str:
    """Digest of a scenario's tables and of its hole."""
    digest = hashlib.sha256(scenario.file.model_dump_json(exclude={"path"}).encode())
    digest.update(scenario.hole.md.tobytes() + scenario.hole.tangent(scenario.hole.md)[0].tobytes())
    return digest.hexdigest()[:16]
