"""What is kept of a string: by a study what every node knows in every cycle, by a campaign surveys and some epochs."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from node.firmware.reporter import VAR_FLOOR
from node.kernels.arithmetic.angles import from_binary
from node.kernels.record.filter_record import Err
from node.kernels.step.node_step import ADMITTED, SAY_EVENTS, SAY_REVISION, SAY_SURVEY
from sim.kernel import kernel, shared_body
from telemetry.messages import Event, NodeState, SurveyMeasurement

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]
YAW: Final = int(Err.YAW)
LOGGED: Final = SAY_SURVEY | SAY_REVISION | SAY_EVENTS  # of what a node says

LOGGED_SURVEY: Final = np.dtype(
    [
        ("cycle", "i8"),
        ("tube", "i8"),
        ("top", "i8"),  # tubes in the string
        ("yaw", "f8"),  # rad
        ("yaw_var", "f8"),  # rad^2
        ("systematic_var", "f8"),  # rad^2, of the joints and of the mount
        ("trusted", "i8"),  # 1: the yaw is known and no sensor fails
        ("force", "f8", (3,)),  # m/s^2
        ("force_cov", "f8", (3, 3)),  # (m/s^2)^2
    ],
    align=True,
)
LOGGED_STATE: Final = np.dtype(
    [("yaw", "f8"), ("yaw_var", "f8"), ("systematic_var", "f8"), ("known", "i8")],
    align=True,
)


@dataclass(frozen=True, slots=True)
class StringSurvey:
    """One survey, with its error at the cycle that made it, as it was said first or revised later."""

    cycle: int
    tube: int
    error: float  # rad, yaw with all constant errors, less the truth
    measurement: SurveyMeasurement
    said: int  # cycle in which it was said


@dataclass(slots=True)
class StringRun:
    """What the nodes of one seed knew: arrays are (cycles, tubes), tube 1 first; NaN before a tube is powered."""

    ends: Array  # (cycles,) rig time, s
    turning: Mask  # (cycles,)
    yaw: Array  # rad, at the end of the tube's own cycle
    total_error: Array  # rad, estimate less truth
    systematic_error: Array  # rad, of it the part of joints, mounts and twist
    var: Array  # rad^2, random part as the node states it
    systematic_var: Array  # rad^2, as the node states it
    gyro_bias: Array  # rad/s, z axis, estimate
    surveys: list[StringSurvey] = field(default_factory=list)
    revisions: list[StringSurvey] = field(default_factory=list)  # that were said again, by the cycle of the first
    events: list[tuple[int, Event]] = field(default_factory=list)  # with the cycle
    states: list[tuple[int, NodeState]] = field(default_factory=list)  # with the cycle

    @property
    def error(self) -> Array:
        """Random part of the yaw error (cycles, tubes), rad."""
        return wrap_angles(self.total_error - self.systematic_error)

    @property
    def total_var(self) -> Array:
        """Stated variance of ``total_error``, rad^2."""
        return self.var + self.systematic_var


class NodeTrace(NamedTuple):
    """What the nodes know at the end of their cycles, (cycles, tubes) each, and what they have to say of the last."""

    yaw: Array  # rad
    var: Array  # rad^2
    systematic_var: Array  # rad^2
    bias: Array  # rad/s, of the gyroscope's z axis
    says: npt.NDArray[np.int64]  # (tubes,)


class StationLog(NamedTuple):
    """What a campaign keeps of a run."""

    surveys: Array  # (most,) of dtype ``LOGGED_SURVEY``, the first ``made``
    made: npt.NDArray[np.int64]  # (1,) surveys that there were
    states: Array  # (epochs, tubes) of dtype ``LOGGED_STATE``
    epochs: npt.NDArray[np.int64]  # (cycles,) number of the epoch that a cycle ends with, else -1


def wrap_angles(angle: Array) -> Array:
    """The same angles in [-pi, pi), rad."""
    return np.asarray(np.mod(angle + math.pi, math.tau) - math.pi)


@kernel
def trace_node(trace: Any, node: Any, says: int, cycle: int, k: int) -> bool:
    """Keep what a node knows at the end of its cycle; returns whether it has something to say."""
    state = node.filter
    trace.yaw[cycle, k] = from_binary(state.now_yaw)
    trace.var[cycle, k] = state.now_P[YAW, YAW]
    trace.systematic_var[cycle, k] = state.systematic_var
    trace.bias[cycle, k] = state.static_bias[2] + state.bias[2]
    trace.says[k] = says
    return bool(says & ~ADMITTED != 0)


@shared_body
def log_node(log: Any, node: Any, says: int, top: int, cycle: int, k: int) -> None:
    """Keep what a campaign wants of what a node of a string of ``top`` tubes has to say, which is seldom anything."""
    if says & LOGGED:
        log_said(log, node, says, top, cycle, k)


@kernel
def log_said(log: Any, node: Any, says: int, top: int, cycle: int, k: int) -> None:
    """Keep a survey that a node made or revised; its events are let go."""
    if says & SAY_SURVEY:
        if log.made[0] < log.surveys.shape[0]:
            log_survey(log.surveys[log.made[0]], node, cycle, k, top)
        log.made[0] += 1
    elif says & SAY_REVISION and log.made[0] <= log.surveys.shape[0]:
        revise_survey(log.surveys[: log.made[0]], node, k)
    if says & SAY_EVENTS:
        node.events.said = node.events.told


@shared_body
def log_epoch(log: Any, nodes: Array, top: int, cycle: int) -> None:
    """Keep what every filter knows where an epoch ends with the cycle."""
    epoch = log.epochs[cycle]
    if epoch >= 0:
        for k in range(top):
            log_state(log.states[epoch, k], nodes[k].filter)


@kernel
def log_survey(kept: Any, node: Any, cycle: int, k: int, top: int) -> None:
    """Keep what a node measured at a stop."""
    state = node.filter
    kept.cycle, kept.tube, kept.top = cycle, k + 1, top
    kept.yaw = from_binary(state.now_yaw)
    kept.yaw_var = max(state.now_P[YAW, YAW], VAR_FLOOR)
    kept.systematic_var = state.systematic_var
    kept.trusted = 1 if state.yaw_known == 1 and node.guard.gyro.fault == 0 and node.guard.force.fault == 0 else 0
    for i in range(3):
        kept.force[i] = state.survey_force[i]
        for j in range(3):
            kept.force_cov[i, j] = state.survey_force_cov[i, j]


@kernel
def revise_survey(surveys: Array, node: Any, k: int) -> None:
    """Put what a node says of its last survey in the place of what it said before."""
    state = node.filter
    for place in range(surveys.shape[0] - 1, -1, -1):
        kept = surveys[place]
        if kept.tube == k + 1:
            kept.yaw = from_binary(state.surveyed_yaw)
            kept.yaw_var = max(state.surveyed_var, VAR_FLOOR)
            kept.systematic_var = node.revision.systematic
            kept.trusted = 1 if state.yaw_known == 1 else 0
            return


@kernel
def log_state(kept: Any, state: Any) -> None:
    """Keep what a filter knows at an epoch."""
    kept.yaw = from_binary(state.now_yaw)
    kept.yaw_var = max(state.now_P[YAW, YAW], VAR_FLOOR)
    kept.systematic_var = state.systematic_var
    kept.known = state.yaw_known
