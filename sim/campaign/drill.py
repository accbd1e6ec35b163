"""One run of a campaign in one call: schedule, noise, the firmware of every node, aiding from hop to hop, surveys.

What a node does is ``node.kernels.step``, as in a rig; what the world does to it is ``sim.world`` by other draws.
"""

from __future__ import annotations

import math
from typing import Any, Final, NamedTuple

import numpy as np

from node.kernels.angles import from_binary
from node.kernels.calibration import USUAL
from node.kernels.jit import kernel
from node.kernels.layout import PERIOD, Array, Err
from node.kernels.record import (
    A_HOPS,
    A_OFFSET,
    A_SYSTEMATIC,
    A_TORSION,
    A_VALID,
    AIDING,
    CLOCK_VAR,
    END,
    HOPS,
    JOINED,
    MOMENT,
    READING,
    SATURATED,
    START,
    SYNCHRONISED,
    TEMPERATURE,
)
from node.kernels.step import ONWARD, SAY_EVENTS, SAY_SURVEY
from sim.campaign.philox import normals, uniforms

DRAWN: Final = 12  # numbers a node and cycle: rates, their wander, forces, clock and loss of one hop, one to spare
GAUSSIAN: Final = 10
CLOCK, LOSS = 9, 10
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


class Work(NamedTuple):
    """Work space of a cycle; what goes into the firmware is arrays by themselves, as everywhere."""

    counter: Array  # (4,) uint64, see ``sim.campaign.philox``
    words: Array  # (4,) uint64
    drawn: Array  # (DRAWN,)
    rate: Array  # (3,) rad/s, true
    force: Array  # (3,) m/s^2, true
    reading: Array  # (1, READING)
    moment: Array  # (MOMENT,)
    aiding: Array  # (AIDING,)


def new_work() -> Work:
    """Work space."""
    vectors = (np.zeros(DRAWN), np.zeros(3), np.zeros(3), np.zeros((1, READING)), np.zeros(MOMENT), np.zeros(AIDING))
    return Work(np.zeros(4, np.uint64), np.zeros(4, np.uint64), *vectors)


@kernel
def drill(
    step: Any,
    aid: Any,
    nodes: Array,
    crews: Array,
    corrections: Array,
    course: Any,
    noise: Any,
    draws: Any,
    key: Array,
    work: Any,
    wander: Array,
    hops: Array,
    surveys: Array,
    epochs: Array,
    counts: Array,
) -> int:
    """Drill one run; returns how many surveys there were, of which ``surveys`` holds the first.

    Parameters
    ----------
    step, aid : ``node_step`` and ``node_aiding``, see ``node.kernels.address``
    nodes, crews : (tubes,) of dtype ``NODE``, as new, and ``SETTINGS``
    corrections : (tubes, 2) of dtype ``PARAMETERS``
    course, noise, draws : ``sim.campaign.course.Course``, ``sim.campaign.draws.Noise`` and ``Draws``
    key : (2,) of the run, see ``sim.campaign.philox``
    work : ``Work``
    wander : (tubes, 3) rad/s, work space
    hops : (3, tubes) work space: wander (s) of each hop's clock, its error in this cycle, whether it loses the aiding
    surveys : (most,) of dtype ``SURVEY``
    epochs : (epochs, tubes) of dtype ``STATE_OF``
    counts : (tubes, CODES) of events by code
    """
    made, epoch = 0, 0
    for cycle in range(course.ends.shape[0]):
        tubes = course.powered[cycle]
        heard = course.heard[cycle] and draws.heard[cycle]
        for k in range(tubes):
            draw_cycle(course, noise, draws, key, work, wander, hops, cycle, k)
            set_moment(course, draws, work.moment, cycle, k)
            one = slice(k, k + 1)
            says = step(nodes[one], crews[one], corrections[k], work.reading, work.moment)
            if says & SAY_SURVEY:
                if made < surveys.shape[0]:
                    keep_survey(surveys[made], nodes[k], crews[k], cycle, k, tubes)
                made += 1
            if says & SAY_EVENTS:
                count_events(nodes[k], counts[k])
        if heard:
            hand_down(aid, nodes, crews, noise, draws, work.aiding, hops, cycle, tubes)
        if epoch < course.epochs.shape[0] and course.epochs[epoch] == cycle:
            for k in range(tubes):
                keep_state(epochs[epoch, k], nodes[k].filter)
            epoch += 1
    return made


@kernel
def draw_cycle(
    course: Any, noise: Any, draws: Any, key: Array, work: Any, wander: Array, hops: Array, cycle: int, k: int
) -> None:
    """What the sensors of a tube read in a cycle, and what hop ``k`` from the head does to its aiding."""
    counter, drawn = work.counter, work.drawn
    counter[0], counter[1], counter[2] = np.uint64(cycle), np.uint64(k), np.uint64(0)
    uniforms(counter, key, work.words, drawn)
    normals(drawn[:GAUSSIAN])
    first = cycle == 0 or course.powered[cycle - 1] <= k
    c, s = math.cos(draws.frame[k]), math.sin(draws.frame[k])
    rate, force, reading = work.rate, work.force, work.reading[0]
    turn_back(course.rate[cycle, k], c, s, rate)
    turn_back(course.force[cycle, k], c, s, force)
    force[0] += course.circle[cycle, 0]
    force[1] += course.circle[cycle, 1]
    shaken = math.sqrt(noise.force**2 + (noise.shaking * course.shaken[cycle]) ** 2)
    fresh = 1.0 if first else math.sqrt(1.0 - noise.wander_phi**2)
    for i in range(3):
        wander[k, i] = (0.0 if first else noise.wander_phi * wander[k, i]) + fresh * noise.wander[i] * drawn[3 + i]
        read = draws.rate_bias[k, i] + wander[k, i] + noise.rate[i] * drawn[i] + draws.pull * force[i]
        for j in range(3):
            read += draws.spread[k, i, j] * rate[j]
        if noise.step > 0.0:
            read = np.round(read / noise.step) * noise.step
        reading[i] = min(max(read, -noise.limit), noise.limit)
        reading[3 + i] = force[i] + draws.force_bias[k, i] + shaken * drawn[6 + i]
    reading[TEMPERATURE], reading[SATURATED] = USUAL, 0.0
    fresh = 1.0 if first else math.sqrt(1.0 - noise.clock_phi**2)
    hops[0, k] = (0.0 if first else noise.clock_phi * hops[0, k]) + fresh * noise.clock * drawn[CLOCK]
    hops[1, k] = draws.clock[k] + hops[0, k] + (hops[1, k - 1] if k > 0 else 0.0)
    hops[2, k] = 1.0 if drawn[LOSS] < noise.loss else 0.0


@kernel
def turn_back(vector: Array, c: float, s: float, turned: Array) -> None:
    """R_z^T ``vector`` (3,) of an angle with cosine ``c`` and sine ``s``."""
    turned[0] = c * vector[0] + s * vector[1]
    turned[1] = c * vector[1] - s * vector[0]
    turned[2] = vector[2]


@kernel
def set_moment(course: Any, draws: Any, moment: Array, cycle: int, k: int) -> None:
    """Times of a tube's cycle, and what its link would tell it."""
    below = course.powered[cycle] - 1 - k  # hops from the head, less one
    moment[START] = course.begin + cycle * PERIOD
    moment[END] = course.ends[cycle]
    moment[JOINED] = course.joined[cycle, k]
    moment[HOPS] = below + 1
    moment[CLOCK_VAR] = draws.clock_var[below]
    moment[SYNCHRONISED] = 1.0


@kernel
def hand_down(
    aid: Any,
    nodes: Array,
    crews: Array,
    noise: Any,
    draws: Any,
    aiding: Array,
    hops: Array,
    cycle: int,
    tubes: int,
) -> None:
    """Hand what the encoder measured down the string, until a hop loses it."""
    aiding[:] = draws.measured[cycle]
    valid = aiding[A_VALID] + noise.late
    for hop in range(tubes):
        if hops[2, hop] != 0.0:
            return
        k = tubes - 1 - hop
        one = slice(k, k + 1)
        aiding[A_VALID] = valid + noise.late_by_hop * (hop + 1) + hops[1, hop]
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
