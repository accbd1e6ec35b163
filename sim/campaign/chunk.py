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

from sim.string.drawn_string import DrawnRun, DrawnString
from sim.world.scenario import Scenario

Columns: TypeAlias = dict[str, npt.NDArray[Any]]
RUNS: Final = 64  # of a chunk


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


class Campaign:
    """A scenario made ready for many runs, as columns of numbers.

    Parameters
    ----------
    scenario : validated

    Raises
    ------
    ScenarioError
        Names what a campaign cannot express.
    """

    def __init__(self, scenario: Scenario) -> None:
        self.string = DrawnString(scenario)
        self._mount_var = float(np.radians(scenario.file.joints.mount_std_deg)) ** 2

    @property
    def node_cycles(self) -> int:
        """Cycles of all nodes in one run."""
        return self.string.node_cycles

    def chunk(self, first: int, last: int) -> Chunk:
        """The runs ``first``..``last``."""
        runs = [self.run(run) for run in range(first, last + 1)]
        surveys, epochs = zip(*runs, strict=True)
        return Chunk(join_columns(surveys), join_columns(epochs))

    def run(self, seed: int) -> tuple[Columns, Columns]:
        """Surveys and epochs of one run."""
        run = self.string.drill(seed)
        return self._surveys(seed, run), self._epochs(seed, run)

    def _surveys(self, seed: int, run: DrawnRun) -> Columns:
        made, string = run.surveys, self.string
        place, cycle = made["tube"] - 1, made["cycle"]
        md = string.depths(place, cycle)
        error, systematic = string.yaw_errors(run, place, cycle, made["yaw"])
        inclination, azimuth = string.direction_errors(made, md)
        return {
            "run": np.full(len(made), seed, np.int64),
            "tube": made["tube"].astype(np.int16),
            "hop": (made["top"] - place).astype(np.int16),
            "at": run.schedule.ends[cycle] + run.schedule.later[place],
            "md": md,
            "yaw_error": error,
            "systematic_error": systematic,
            "yaw_var": made["yaw_var"].copy(),
            "systematic_var": made["systematic_var"] + self._mount_var,
            "inclination_error": inclination,
            "azimuth_error": azimuth,
            "trusted": made["trusted"].astype(bool),
        }

    def _epochs(self, seed: int, run: DrawnRun) -> Columns:
        epochs, powered = self.string.epochs, run.schedule.powered
        which, place = np.nonzero(np.arange(run.states.shape[1]) < powered[epochs][:, None])
        cycle, kept = epochs[which], run.states[which, place]
        error, systematic = self.string.yaw_errors(run, place, cycle, kept["yaw"])
        return {
            "run": np.full(len(kept), seed, np.int64),
            "hop": (powered[cycle] - place).astype(np.int16),
            "at": run.schedule.ends[cycle] + run.schedule.later[place],
            "turning": self.string.turning[which],
            "known": kept["known"].astype(bool),
            "yaw_error": error,
            "systematic_error": systematic,
            "yaw_var": kept["yaw_var"].copy(),
            "systematic_var": kept["systematic_var"] + self._mount_var,
        }


def join_columns(parts: tuple[Columns, ...]) -> Columns:
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
