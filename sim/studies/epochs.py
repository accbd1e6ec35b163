"""A string that turns and rests several times, as a scenario, judged at fixed epochs.

Joints and mounts err by their stated sigma, clocks by theirs, and every hop loses some aiding. Epochs are 10 s before
the end of each turning and of each rest, so that samples of one seed are nearly independent.
"""

from __future__ import annotations

import math
import pickle
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from node.kernels.arithmetic.formats import PERIOD
from node.kernels.record.filter_record import Scheme
from sim.campaign.chunk import campaign_of
from sim.string.direct_string import DirectString
from sim.studies.lab import ACCELERATION_DPS2, RATE_DPS, TURNS
from sim.studies.scenarios import CALIBRATED, Tables, complete_string
from sim.world.scenario import scenario_of
from sim.world.world import World

Array = npt.NDArray[np.float64]
BLOCKS = 3  # of turning and resting
BEFORE_END = 10.0  # s
RESTING: Tables = {
    "rig": complete_string(1),
    "path": {"straight": {"inclination_deg": 2.0}},
    "schedule": {"add_s": 60.0, "stop_s": 60.0, "finish_s": 5.0, "blocks": BLOCKS},
    "rotation": {"turns": TURNS, "rate_dps": RATE_DPS, "acceleration_dps2": ACCELERATION_DPS2},
    "accelerometer": CALIBRATED,
    "medium": {"link": "off"},
}


@dataclass(frozen=True, slots=True)
class EpochRun:
    """Yaw errors (rad) and variances (rad^2) at the fixed epochs: (epochs, hops) each, from the head down."""

    error: Array  # besides the constant errors of joints and mounts
    var: Array
    total_error: Array
    total_var: Array
    turning: npt.NDArray[np.bool_]  # (epochs,)


def resting_string(
    hops: int, scheme: Scheme = Scheme.FORWARD, kernel: str = "float64", blocks: int = BLOCKS, loss: float = 0.01
) -> Tables:
    """The string of ``hops`` tubes."""
    return {
        **RESTING,
        "rig": complete_string(hops),
        "schedule": {**RESTING["schedule"], "blocks": blocks},
        "medium": {"link": "off", "loss": loss},
        "node": {"scheme": scheme.name.lower(), "kernel": kernel},
    }


def run_seed(job: tuple[Tables, int]) -> EpochRun:
    """One seed of one scenario, for a pool of processes."""
    tables, seed = job
    world = World(scenario_of(dict(tables)), seed)
    return sample_epochs(DirectString(world))


def run_campaign_seed(job: tuple[Tables, int]) -> EpochRun:
    """One seed of one complete string by a campaign, for a pool of processes."""
    tables, seed = job
    epochs = campaign_of(pickle.dumps(scenario_of(dict(tables)))).run(seed)[1]
    tubes = int(epochs["hop"].max())
    total_error, var = epochs["yaw_error"], epochs["yaw_var"]
    rows = (total_error - epochs["systematic_error"], var, total_error, var + epochs["systematic_var"])
    error, var, total_error, total_var = (values.reshape(-1, tubes)[:, ::-1] for values in rows)
    return EpochRun(error, var, total_error, total_var, epochs["turning"].reshape(-1, tubes)[:, 0])


def sample_epochs(string: DirectString) -> EpochRun:
    """Drill a string and keep what its nodes knew at the fixed epochs."""
    at, turning = epochs_of(string.world)
    run = string.drill()
    rows = (run.error, run.var, run.total_error, run.total_var)
    error, var, total_error, total_var = (values[at, ::-1] for values in rows)
    return EpochRun(error, var, total_error, total_var, turning)


def epochs_of(world: World) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.bool_]]:
    """Cycles (epochs,) at which a filter is judged, and whether the string turns then."""
    phases = [phase for phase in world.phases if phase.kind in ("drill", "stop")]
    cycles = [math.floor((phase.end - BEFORE_END - world.begin) / PERIOD) for phase in phases]
    return np.array(cycles), np.array([phase.kind == "drill" for phase in phases])
