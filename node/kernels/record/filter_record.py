"""Memory of one node: the state record, the configuration record and the names of the error states.

The state is one flat numpy record, so that saving a node is copying its bytes and a C compiler could declare the
same struct. Source: thesis 3.5 (states), error-state form ``dx = true - estimate``.
"""

from __future__ import annotations

import enum
from typing import Final

import numpy as np

from node.kernels.arithmetic.formats import DEG, Array

STATES: Final = 8
RING: Final = 64
PARTS: Final = 8  # of a cycle, whose turn a sensor may tell each by itself
RECENT: Final = 8  # cycles of which they are kept
KNOWN, BEGAN_STILL, ENDED_STILL = 1, 2, 4  # bits of such a cycle: its parts are known, it began and ended at rest
PENDING: Final = 4
UNKNOWN_YAW_VAR: Final = 3.29  # rad^2, uniform over the turn
CLOCK_SLACK: Final = 0.05  # s, by which an aiding may seem to be of the next cycle for the clock's error alone
INVERTED: Final = -0.9848077530122081  # downward part of the axis at 170 deg of inclination


class Err(enum.IntEnum):
    """Index of each error state in ``P``."""

    TILT_X = 0  # rad, rotation of the body about its own x
    TILT_Y = 1  # rad
    YAW = 2  # rad
    BIAS_X = 3  # rad/s
    BIAS_Y = 4  # rad/s
    BIAS_Z = 5  # rad/s
    SCALE = 6  # 1, of the z gyroscope
    STAMP = 7  # s, true time of validity of the aiding minus the node's idea of it


class CycleStatus(enum.IntFlag):
    """What one cycle did; each bit becomes an event or a message."""

    NONE = 0
    STOPPED = 1
    STARTED = 2
    SURVEY_READY = 4
    BIAS_KNOWN = 8
    AIDED = 16
    REJECTED = 32
    YAW_RESET = 64
    RATE_EXCEEDED = 128
    RATE_RECOVERED = 256
    REFERENCE_CHANGED = 512
    BAD_SAMPLE = 1024
    LATE_DROPPED = 2048
    FILTER_FAULT = 4096
    JOINT_OPENED = 8192
    JOINT_CLOSED = 16384


class Scheme(enum.IntEnum):
    """What a node passes on to the next one."""

    FORWARD = 0  # the encoder's own measurement
    ESTIMATE = 1  # the node's yaw and its variance, as published
    INTERSECTION = 2  # the same, taken in by covariance intersection


STATE: Final = np.dtype(
    [
        # the filter, at its own epoch (at most RING cycles behind now)
        ("epoch", "f8"),  # s, node's clock, up to which the filter has run
        ("yaw", "u4"),  # 2^-32 turn, binary angle
        ("yaw_known", "i8"),  # 1 after the first aiding, until something makes the yaw unknown
        ("down", "f8", (3,)),  # unit vector, of gravity, body frame
        ("static_bias", "f8", (3,)),  # rad/s, constant part, from standing still
        ("static_bias_var", "f8", (3,)),  # (rad/s)^2, of it; 0: never learnt
        ("bias", "f8", (3,)),  # rad/s, Gauss-Markov part
        ("scale", "f8"),  # scale error of the z gyroscope
        ("stamp", "f8"),  # s, true time of validity of the aiding minus the node's idea of it
        ("P", "f8", (STATES, STATES)),  # covariance of the error states (``Err``)
        # the same, predicted to the end of the newest cycle
        ("now", "f8"),  # s, node's clock, end of the newest cycle
        ("now_yaw", "u4"),  # 2^-32 turn, predicted to that end
        ("now_down", "f8", (3,)),  # unit vector, of gravity, likewise
        ("now_rate", "f8"),  # rad/s, about the axis, likewise
        ("now_P", "f8", (STATES, STATES)),  # covariance, likewise
        # aiding: reference in use and measurements waiting for their epoch
        ("reference_hops", "i8"),  # joints between the encoder and this node; -1: no reference yet
        ("reference_offset", "f8"),  # rad, of the joints, in the aiding in use
        ("systematic_var", "f8"),  # rad^2, of the constant errors in it
        ("last_sequence", "i8"),  # number of the last aiding taken; -1: none
        ("last_aided", "f8"),  # s, node's clock, time of validity of the last measurement used
        ("innovation", "f8"),  # rad, of the last aiding
        ("innovation_var", "f8"),  # rad^2, of it
        ("rejected", "i8"),  # aidings rejected in a row
        ("pending", "i8"),  # aidings that wait for their epoch
        ("pending_at", "f8", (PENDING,)),  # s, node's clock, their times of validity
        ("pending_yaw", "f8", (PENDING,)),  # rad, their yaws with the offset
        ("pending_var", "f8", (PENDING,)),  # rad^2, of each
        ("pending_sequence", "i8", (PENDING,)),  # number of each
        # the increments of the last RING cycles
        ("cycles", "i8"),  # cycles written to the rings so far
        ("consumed", "i8"),  # cycles the filter has passed completely
        ("ring_start", "f8", (RING,)),  # s, node's clock, begin of each of the last cycles
        ("ring_end", "f8", (RING,)),  # s, node's clock, end of each
        ("ring_rate", "f8", (RING, 3)),  # rad/s, mean over each
        ("ring_force", "f8", (RING, 3)),  # m/s^2, mean over each
        ("ring_quiet", "i8", (RING,)),  # 1 where the node was at rest
        ("ring_split", "i8", (RECENT,)),  # what of the inside of each of the last is known, as bits
        ("ring_parts", "f8", (RECENT, PARTS)),  # rad/s about the axis, of each part beyond the mean of its cycle
        # modes
        ("mode", "i8"),  # 1 static bias, 3 tracking, 4 still, 5 survey, 6 held
        ("still_cycles", "i8"),  # cycles at rest in a row
        ("stopped_at", "f8"),  # s, node's clock, begin of this rest; NaN: none yet
        ("surveyed", "i8"),  # 1 when this stop already has its measurement
        ("rate_exceeded", "i8"),  # 1 while too fast for the yaw to be followed
        ("bias_count", "i8"),  # cycles of rest in the sums below
        ("bias_sum", "f8", (3,)),  # rad/s, sum of the rates of these cycles
        # the last survey
        ("survey_force", "f8", (3,)),  # m/s^2, mean of the last survey
        ("survey_force_cov", "f8", (3, 3)),  # (m/s^2)^2, of that mean
        ("smoothing", "i8"),  # 1 while what comes tells of its yaw
        ("surveyed_yaw", "u4"),  # 2^-32 turn, that yaw by all that has come since
        ("surveyed_var", "f8"),  # rad^2, of it
        ("surveyed_with", "f8", (STATES,)),  # covariance of it with the error states
        # work space of the updates
        ("h", "f8", (STATES,)),  # work space of the updates
        ("ph", "f8", (STATES,)),  # work space of the updates
        ("gain", "f8", (STATES,)),  # work space of the updates
    ],
    align=True,
)

CONFIG: Final = np.dtype(
    [
        ("gyro_noise", "f8", (3,)),  # rad/s/sqrt(Hz), white noise of the rates
        ("bias_std", "f8", (3,)),  # rad/s, of the Gauss-Markov part of the biases
        ("bias_tau", "f8", (3,)),  # s, time constant of that part
        ("boot_bias_std", "f8"),  # rad/s, of a bias before the node has stood still for long enough
        ("attitude_factor", "f8"),  # A of thesis eq. 4.14
        ("bias_factor", "f8"),  # B of thesis eq. 4.15
        ("scale_std", "f8"),  # prior of the scale error; 0 switches the state off
        ("stamp_std", "f8"),  # s, prior of the time stamp, until the clock tells its own; 0 switches the state off
        ("stamp_walk", "f8"),  # s/sqrt(s), wander of the node's clock error
        ("still_walk", "f8"),  # rad/sqrt(s), what may turn unseen while still
        ("aiding_floor_var", "f8"),  # rad^2, added to every aiding
        ("force_std", "f8"),  # m/s^2, of one sample
        ("gravity", "f8"),  # m/s^2, of the site
        ("gate", "f8"),  # sigmas, beyond which an aiding is rejected
        ("intersection", "i8"),  # 1 while the aiding's error may be correlated with the node's own in any way
        ("reject_limit", "i8"),  # rejected in a row before the yaw is reset
        ("rate_limit", "f8"),  # rad/s, from where the yaw cannot be followed
        ("still_rate", "f8"),  # rad/s, up to which a node stands still
        ("lag_cycles", "i8"),  # the filter stays this far behind, to judge a cycle by its successor
        ("survey_samples", "i8"),  # cycles, of the average of a survey
        ("settle_cycles", "i8"),  # cycles at rest, until it is taken
        ("static_cycles", "i8"),  # cycles at rest, of the first bias
    ],
    align=True,
)


def default_config() -> Array:
    """Configuration of an MPU6500-class node, one record of dtype ``CONFIG``.

    The noise set is white plus Gauss-Markov, fitted to the measured Allan curve of the sensor (thesis Table V.1).
    """
    config = np.zeros(1, CONFIG)
    record = config[0]
    record["gyro_noise"] = np.array([8.538e-3, 6.799e-3, 7.313e-3]) * DEG
    record["bias_std"] = np.array([1.2545e-2, 5.869e-3, 4.941e-3]) * DEG
    record["bias_tau"] = 15.87
    record["boot_bias_std"] = 0.05 * DEG
    record["attitude_factor"] = 1.0
    record["bias_factor"] = 1.0
    record["scale_std"] = 1e-3
    record["stamp_std"] = 2e-3
    record["stamp_walk"] = 3e-6
    record["still_walk"] = 2e-4 * DEG
    record["aiding_floor_var"] = (0.001 * DEG) ** 2
    record["force_std"] = 0.02 * DEG * 9.81
    record["gravity"] = 9.81
    record["gate"] = 5.0
    record["reject_limit"] = 5
    record["rate_limit"] = 2.0 * np.pi * 0.95
    record["still_rate"] = 0.08 * DEG
    record["lag_cycles"] = 1
    record["survey_samples"] = 32
    record["settle_cycles"] = 38
    record["static_cycles"] = 95
    return config


def new_state(config: Array) -> Array:
    """State of a node that knows nothing yet, one record of dtype ``STATE``."""
    state = np.zeros(1, STATE)
    record, settings = state[0], config[0]
    priors = np.zeros(STATES)
    priors[Err.TILT_X] = priors[Err.TILT_Y] = 1.0
    priors[Err.YAW] = np.pi / np.sqrt(3.0)
    priors[Err.BIAS_X : Err.BIAS_Z + 1] = settings["boot_bias_std"]
    priors[Err.SCALE] = settings["scale_std"]
    priors[Err.STAMP] = settings["stamp_std"]
    record["P"] = np.diag(priors**2)
    record["now_P"] = record["P"]
    record["mode"] = 1
    record["surveyed"] = 1
    record["down"][2] = 1.0
    record["reference_hops"] = -1
    record["last_sequence"] = -1
    record["last_aided"] = -np.inf
    record["stopped_at"] = np.nan
    return state
