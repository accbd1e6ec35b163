"""What the sensors of a tube read in a cycle of a campaign, and what the hop above it does to an aiding.

Constants and what wanders stand in one record a tube: a kernel reads a field of a record at no cost, where every array
that it is given costs some nanoseconds a call.
"""

from __future__ import annotations

import math
from typing import Any, Final, NamedTuple

import numpy as np

from node.kernels.arithmetic.formats import Array
from node.kernels.arithmetic.jit import kernel
from node.kernels.record.node_record import AIDING, MOMENT, READING, SATURATED, TEMPERATURE
from node.kernels.sensors.correction import USUAL
from sim.campaign.philox import normals, uniforms

DRAWN: Final = 12  # numbers a node and cycle: rates, their wander, forces, clock and loss of one hop, one to spare
GAUSSIAN: Final = 10
CLOCK, LOSS = 9, 10

NOISE: Final = np.dtype(
    [
        ("rate", "f8", (3,)),  # rad/s, white, of a cycle's mean, standard deviation as all that follow
        ("wander", "f8", (3,)),  # rad/s, of the Gauss-Markov part
        ("wander_phi", "f8"),  # what is left of it after a cycle
        ("wander_fresh", "f8"),  # share of it that is new in a cycle
        ("force", "f8"),  # m/s^2, of a cycle's mean
        ("shaking", "f8"),  # m/s^2, likewise, while the bit shakes the string
        ("pull", "f8"),  # rad/s by m/s^2, of the force on each axis of the gyroscope
        ("step", "f8"),  # rad/s, resolution of the gyroscope; 0: none
        ("limit", "f8"),  # rad/s, its range
        ("clock", "f8"),  # s, wander of rig time across each joint
        ("clock_phi", "f8"),
        ("clock_fresh", "f8"),
        ("loss", "f8"),  # of an aiding on one hop
        ("late", "f8"),  # s, by which the aiding is dated beside its validity, once
        ("late_by_hop", "f8"),  # s, likewise, each hop
    ],
    align=True,
)
TUBE: Final = np.dtype(
    [
        ("cos", "f8"),  # of the angle of the IMU's frame with the head at 0
        ("sin", "f8"),
        ("spread", "f8", (3, 3)),  # reading of the gyroscope by the true rates
        ("rate_bias", "f8", (3,)),  # rad/s
        ("force_bias", "f8", (3,)),  # m/s^2
        ("phase", "f8"),  # s, by which its cycles end after the encoder's
        ("hop_clock", "f8"),  # s, error of rig time across the joint as many hops below the head as the tube's index
        ("wander", "f8", (3,)),  # rad/s, of this cycle
        ("hop_wander", "f8"),  # s, of this cycle
        ("hop_error", "f8"),  # s, of rig time below that joint in this cycle
        ("hop_loses", "i8"),  # whether an aiding is lost there in this cycle
    ],
    align=True,
)


class Work(NamedTuple):
    """Work space of a cycle; what goes into the firmware is arrays by themselves, as everywhere."""

    counter: Array  # (4,) uint64, see ``sim.campaign.philox``
    words: Array  # (4,) uint64
    drawn: Array  # (DRAWN,)
    readings: Array  # (tubes, 1, READING)
    moment: Array  # (MOMENT,)
    aiding: Array  # (AIDING,)


def new_work(tubes: int) -> Work:
    """Work space of a string."""
    vectors = np.zeros(DRAWN), np.zeros((tubes, 1, READING)), np.zeros(MOMENT), np.zeros(AIDING)
    return Work(np.zeros(4, np.uint64), np.zeros(4, np.uint64), *vectors)


@kernel
def draw(counter: Array, key: Array, words: Array, drawn: Array, cycle: int, k: int) -> None:
    """Fill ``drawn`` (DRAWN,) for a tube and a cycle: the first ``GAUSSIAN`` normal, the others uniform."""
    counter[0], counter[1], counter[2] = np.uint64(cycle), np.uint64(k), np.uint64(0)
    uniforms(counter, key, words, drawn)
    normals(drawn[:GAUSSIAN])


@kernel
def read_sensors(
    noise: Any,
    tube: Any,
    is_first: bool,
    above: float,
    rates: Array,
    forces: Array,
    circle: Array,
    shaken: Array,
    drawn: Array,
    reading: Array,
    cycle: int,
    k: int,
) -> None:
    """Fill ``reading`` (1, READING) of tube ``k`` in a cycle, and the tube's hop.

    Parameters
    ----------
    noise, tube : of dtype ``NOISE`` and ``TUBE``
    is_first : what wanders begins anew
    above : s, error of rig time at the tube above
    rates, forces, circle, shaken : see ``sim.campaign.course.Course``
    drawn : see ``draw``
    """
    c, s = tube.cos, tube.sin
    true_rates, true_forces, row = rates[cycle, k], forces[cycle, k], reading[0]
    rate = (c * true_rates[0] + s * true_rates[1], c * true_rates[1] - s * true_rates[0], true_rates[2])
    force = (
        c * true_forces[0] + s * true_forces[1] + circle[cycle, 0],
        c * true_forces[1] - s * true_forces[0] + circle[cycle, 1],
        true_forces[2],
    )
    shaking = math.sqrt(noise.force**2 + (noise.shaking * shaken[cycle]) ** 2)
    wander_on(noise, tube, is_first, drawn)
    for i in range(3):
        read = tube.rate_bias[i] + tube.wander[i] + noise.rate[i] * drawn[i] + noise.pull * force[i]
        for j in range(3):
            read += tube.spread[i, j] * rate[j]
        if noise.step > 0.0:
            read = np.round(read / noise.step) * noise.step
        row[i] = min(max(read, -noise.limit), noise.limit)
        row[3 + i] = force[i] + tube.force_bias[i] + shaking * drawn[6 + i]
    row[TEMPERATURE], row[SATURATED] = USUAL, 0.0
    cross_hop(noise, tube, is_first, above, drawn)


@kernel
def wander_on(noise: Any, tube: Any, is_first: bool, drawn: Array) -> None:
    """Take what wanders of a tube's gyroscope on by a cycle."""
    left, fresh = (0.0, 1.0) if is_first else (noise.wander_phi, noise.wander_fresh)
    for i in range(3):
        tube.wander[i] = left * tube.wander[i] + fresh * noise.wander[i] * drawn[3 + i]


@kernel
def cross_hop(noise: Any, tube: Any, is_first: bool, above: float, drawn: Array) -> None:
    """Take a tube's hop on by a cycle: its clock, and whether it loses an aiding."""
    left, fresh = (0.0, 1.0) if is_first else (noise.clock_phi, noise.clock_fresh)
    tube.hop_wander = left * tube.hop_wander + fresh * noise.clock * drawn[CLOCK]
    tube.hop_error = tube.hop_clock + tube.hop_wander + above
    tube.hop_loses = 1 if drawn[LOSS] < noise.loss else 0
