"""One run of a campaign in one call: schedule, noise, the firmware of every node, aiding from hop to hop, surveys.

What a node does is ``node.kernels.step.node_step``, as in a rig; what the world does to it is ``sim.world`` by other
draws.
"""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np

from node.kernels.arithmetic.angles import from_binary
from node.kernels.arithmetic.formats import PERIOD, Array
from node.kernels.arithmetic.jit import kernel, shared_body
from node.kernels.record.filter_record import Err
from node.kernels.record.node_record import (
    A_HOPS,
    A_OFFSET,
    A_SYSTEMATIC,
    A_TORSION,
    A_VALID,
    CLOCK_VAR,
    END,
    HOPS,
    JOINED,
    START,
    SYNCHRONISED,
)
from node.kernels.step.node_step import ONWARD, SAY_EVENTS, SAY_REVISION, SAY_SURVEY
from sim.campaign.frames import draw_parts, read_frames
from sim.campaign.sensors import draw, read_sensors

YAW = int(Err.YAW)
CODES: Final = 64  # of events that are counted
VAR_FLOOR: Final = (math.radians(0.001)) ** 2  # of a yaw as a node states it

SURVEY: Final = np.dtype(
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
STATE_OF: Final = np.dtype(
    [("yaw", "f8"), ("yaw_var", "f8"), ("systematic_var", "f8"), ("known", "i8")],
    align=True,
)


@kernel
def drill(
    step: Any,
    aid: Any,
    nodes: Array,
    crews: Array,
    corrections: Array,
    course: Any,
    noise: Array,
    tubes: Array,
    draws: Any,
    field: Any,
    key: Array,
    work: Any,
    surveys: Array,
    epochs: Array,
    counts: Array,
) -> int:
    """Drill one run; returns how many surveys there were, of which ``surveys`` holds the first.

    Parameters
    ----------
    step, aid : ``node_step`` and ``node_aiding``, see ``node.kernels.step.address``
    nodes, crews : (tubes,) of dtype ``NODE``, as new, and ``SETTINGS``
    corrections : (tubes, 2) of dtype ``PARAMETERS``
    course, draws : ``sim.campaign.course.Course`` and ``sim.campaign.draws.Draws``
    field : ``sim.campaign.field.Field``; None in a plain world, for which the loop is compiled without it
    noise, tubes : (1,) and (tubes,) of dtype ``sim.campaign.sensors.NOISE`` and ``TUBE``
    key : (2,) of the run, see ``sim.campaign.philox``
    work : ``sim.campaign.sensors.Work``
    surveys : (most,) of dtype ``SURVEY``
    epochs : (epochs, tubes) of dtype ``STATE_OF``
    counts : (tubes, CODES) of events by code
    """
    made, epoch = 0, 0
    powered, moment, clock_var = course.powered, work.moment, draws.clock_var
    for cycle in range(course.ends.shape[0]):
        top = powered[cycle]
        heard = course.heard[cycle] and draws.heard[cycle]
        read_string(course, noise, tubes, field, key, work, cycle)
        if heard and not course.locked:
            hand_down(aid, nodes, crews, noise[0], tubes, draws.measured[cycle], work.aiding, top)
        for k in range(top):
            set_moment(course, clock_var, tubes[k].phase, moment, cycle, k)
            one = slice(k, k + 1)
            says = step(nodes[one], crews[one], corrections[k], work.readings[k], moment)
            if says & SAY_SURVEY:
                if made < surveys.shape[0]:
                    keep_survey(surveys[made], nodes[k], crews[k], cycle, k, top)
                made += 1
            elif says & SAY_REVISION and made <= surveys.shape[0]:
                revise_survey(surveys[:made], nodes[k], k)
            if says & SAY_EVENTS:
                count_events(nodes[k], counts[k])
        if heard and course.locked:
            hand_down(aid, nodes, crews, noise[0], tubes, draws.measured[cycle], work.aiding, top)
        if epoch < course.epochs.shape[0] and course.epochs[epoch] == cycle:
            for k in range(top):
                keep_state(epochs[epoch, k], nodes[k].filter)
            epoch += 1
    return made


@shared_body
def read_string(course: Any, noise: Array, tubes: Array, field: Any, key: Array, work: Any, cycle: int) -> None:
    """Read the sensors of all tubes of the string in a cycle, and take their hops on."""
    rate, force, circle, shaken, powered = course.rate, course.force, course.circle, course.shaken, course.powered
    drawn = work.drawn
    for k in range(powered[cycle]):
        tube, is_first, reading = tubes[k], cycle == 0 or powered[cycle - 1] <= k, work.readings[k]
        draw(work.counter, key, work.words, drawn, cycle, k)
        above = tubes[k - 1].hop_error if k > 0 else 0.0
        if field is not None:
            draw_parts(work.counter, key, work.words, field.desk.drawn, cycle, k)
            end = course.ends[cycle] + tube.phase
            read_frames(noise[0], tube, is_first, above, field, drawn, reading, end, cycle, k)
        else:
            read_sensors(noise[0], tube, is_first, above, rate, force, circle, shaken, drawn, reading, cycle, k)


@shared_body
def set_moment(course: Any, clock_var: Array, phase: float, moment: Array, cycle: int, k: int) -> None:
    """Times of a tube's cycle, which is ``phase`` s later than the encoder's, and what its link would tell it."""
    below = course.powered[cycle] - 1 - k  # hops from the head, less one
    moment[START] = course.begin + cycle * PERIOD + phase
    moment[END] = course.ends[cycle] + phase
    moment[JOINED] = course.joined[cycle, k]
    moment[HOPS] = below + 1
    moment[CLOCK_VAR] = clock_var[below]
    moment[SYNCHRONISED] = 1.0


@kernel
def hand_down(
    aid: Any,
    nodes: Array,
    crews: Array,
    noise: Any,
    tubes: Array,
    measured: Array,
    aiding: Array,
    top: int,
) -> None:
    """Hand what the encoder ``measured`` (AIDING,) down the ``top`` tubes of the string, until a hop loses it."""
    aiding[:] = measured
    valid = aiding[A_VALID] + noise.late
    for hop in range(top):
        if tubes[hop].hop_loses:
            return
        k = top - 1 - hop
        one = slice(k, k + 1)
        aiding[A_VALID] = valid + noise.late_by_hop * (hop + 1) + tubes[hop].hop_error
        if not aid(nodes[one], crews[one], aiding) & ONWARD:
            return
        node = nodes[k]
        aiding[A_OFFSET], aiding[A_SYSTEMATIC] = node.down_offset, node.down_systematic
        aiding[A_TORSION] = node.down_torsion
        aiding[A_HOPS] += 1.0


@kernel
def keep_survey(kept: Any, node: Any, crew: Any, cycle: int, k: int, tubes: int) -> None:
    """Keep what a node measured at a stop."""
    state = node.filter
    kept.cycle, kept.tube, kept.top = cycle, k + 1, tubes
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
def keep_state(kept: Any, state: Any) -> None:
    """Keep what a filter knows at an epoch."""
    kept.yaw = from_binary(state.now_yaw)
    kept.yaw_var = max(state.now_P[YAW, YAW], VAR_FLOOR)
    kept.systematic_var = state.systematic_var
    kept.known = state.yaw_known


@kernel
def count_events(node: Any, counts: Array) -> None:
    """Count the events that a node has told, by their codes."""
    events = node.events
    waiting = min(events.told - events.said, events.ring.shape[0])
    for n in range(events.told - waiting, events.told):
        counts[events.ring[n % events.ring.shape[0]].code % CODES] += 1
    events.said = events.told
