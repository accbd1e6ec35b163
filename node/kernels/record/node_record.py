"""All memory of one node as one record: what it is aided and moved by, what it trusts, and what it has yet to say.

The record is flat bytes: copying them saves the node, an array of them is a string, and a C compiler could declare it.
``node.kernels.record.filter_record`` holds the filter inside it; here is what stands around the filter.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from node.kernels.arithmetic.formats import Array
from node.kernels.record.filter_record import CONFIG, PARTS, RING, STATE, new_state
from node.kernels.record.sensor_record import MAX_IMUS, MOUNT, OFFSET, STATIC, SWEEP, new_mount

# of the saved record; 1 and 2 held the filter alone, 3 what a start clears as well, 4 no doubts, 5 fewer mismatches,
# 6 no odd forces, 7 no swings, 8 no ramps, 9 no revisions, 10 no parts of cycles,
# 11 no wrong aidings, 12 no counters that stand and no mirror, 13 no turns at rest and no errors that return,
# 14 no ratio of encoder and gyroscope, 15 no string that rubs
NODE_LAYOUT: Final = 16
EVENTS_KEPT: Final = 32  # that wait to be said
NUMBERS: Final = 10  # of one event
DISAGREEMENTS: Final = 3  # aidings in a row, until a mismatch is a fault
MOST_DISAGREEMENTS: Final = 6  # likewise, until a small one is

TRUST: Final = np.dtype(
    [
        ("fault", "i8"),  # ``Fault``; 0: none
        ("proving", "i8"),  # 1: its readings are used again and have yet to agree with the aiding
        ("sane", "i8"),  # cycles in a row with sane readings
        ("cycles", "i8"),  # cycles since it was flagged
    ],
    align=True,
)
REPEATS: Final = np.dtype(
    [
        ("last", "f8", (3,)),  # newest reading; NaN: none yet
        ("counts", "i8", (3,)),  # repeats of it in a row, bit for bit
    ],
    align=True,
)
READINGS: Final = np.dtype(
    [
        ("rates", REPEATS),  # rad/s, of the gyroscope
        ("forces", REPEATS),  # m/s^2, of the accelerometer
        ("clipped", "i8"),  # cycles in a row with a force near the range
    ],
    align=True,
)
AIDINGS: Final = np.dtype(
    [
        ("left", "f8"),  # rad, part of the last innovation that was not corrected
        ("at", "f8"),  # s, own clock, of it; NaN: none yet
        ("seen", "i8"),  # mismatches in a row
        ("mismatch", "f8", (MOST_DISAGREEMENTS,)),  # rad/s, true minus measured, of the last aidings
        ("spin", "f8", (MOST_DISAGREEMENTS,)),  # rad/s, true, at the same time
        ("wrong", "i8"),  # aidings used, until one that was wrong is forgotten; 0: it is
    ],
    align=True,
)
MISMATCH: Final = np.dtype(
    [
        ("fault", "i8"),  # ``Fault``; 0: there is none
        ("rate", "f8"),  # rad/s, true minus measured
        ("spin", "f8"),  # rad/s, true
        ("steady", "i8"),  # 1: the aidings show the same, also while one more of a string at rest is waited for
        ("refuted", "i8"),  # 1: the aiding was rejected, and not for a step of the gyroscope
    ],
    align=True,
)
SWING: Final = np.dtype(
    [
        ("cycles", "i8"),  # whose rates bend, less those that do not
        ("excess", "f8"),  # rad^2, mean of what a bend makes of the yaw
    ],
    align=True,
)
RAMP: Final = np.dtype(
    [
        ("left", "i8"),  # cycles whose aidings still show what the ramp did
        ("lasted", "i8"),  # cycles since it began
        ("seen", "i8"),  # aidings of it
        ("misfit", "f8"),  # sum of their squares over their variances
        ("largest", "f8"),  # rad^2, of their squares
        ("doubted", "i8"),  # 1: it does not fit
        ("opened", "i8"),  # 1: the yaw has been opened for it
        ("doubt", "f8"),  # rad^2, variance of the yaw by the ramps that did not fit
        ("cycles", "i8"),  # since the node stood still, or has forgotten a scale
        ("scale", "f8"),  # scale error of the z gyroscope, then
        ("scale_std", "f8"),  # of it
        ("sense", "i8"),  # 1 or -1: the way in which the string turned fast last; 0: not yet
        ("back", "f8"),  # rad, turned the other way since the node stood still
    ],
    align=True,
)
MIRROR: Final = np.dtype(
    [
        ("exchanged", "i8"),  # 1: x and y of the sensors are, and are exchanged back
        ("cycles", "i8"),  # of turning, over which the means are
        ("down", "f8", (2,)),  # direction of gravity across the axis, at the end of the cycle before
        ("across", "f8"),  # mean of Im(z p), of the force z and the direction p across the axis
        ("felt", "f8"),  # mean of |z|^2
        ("turned", "f8"),  # mean of |p|^2
    ],
    align=True,
)
CREEP: Final = np.dtype(
    [
        ("waits", "i8"),  # 1: the cycle before was one of a rest, and is summed up if this one is
        ("cycles", "i8"),  # of this rest, over which turns are summed up
        ("bias", "f8", (3,)),  # rad/s, constant part of it, when the string came to rest
        ("wander", "f8", (3,)),  # rad/s, part of it that wanders, then
        ("bias_var", "f8", (3,)),  # (rad/s)^2, of both; 0: not known
        ("constant_var", "f8", (3,)),  # (rad/s)^2, of the constant part
        ("decay", "f8"),  # of the part that wanders, what is left of it
        ("decays", "f8"),  # sum of that over the cycles
        ("angle", "f8", (3,)),  # rad, by which the string has turned since, if it did
        ("across", "f8", (2,)),  # gravity across the axis, mean of the first cycles of the rest
        ("first", "f8"),  # rad, of the turn by the middle of those
        ("doubted", "i8"),  # 1: in this rest it turned; 2: that was told
        ("doubt", "f8"),  # rad^2, variance of the yaw by such turns
        ("standing", "f8"),  # rad^2, of it as the rest began
    ],
    align=True,
)
SAME: Final = np.dtype(
    [
        ("seen", "i8"),  # series of rejected aidings that began with the same error
        ("angle", "f8"),  # rad, size of it
        ("left", "i8"),  # aidings used, until it is forgotten
    ],
    align=True,
)
RATIO: Final = np.dtype(
    [
        ("agreed", "i8"),  # cycles of turning in which encoder and gyroscope did, until they are known to
        ("seen", "i8"),  # in a row that showed another ratio
        ("usual", "f8"),  # the first of those, of the encoder's rate over the gyroscope's
        ("told", "i8"),  # 1: the ratio is not one
    ],
    align=True,
)
RUBBING: Final = np.dtype(
    [
        ("score", "i8"),  # uneven cycles of turning, twice, less even ones
        ("left", "i8"),  # cycles of turning, until the string is no more known to rub
        ("var", "f8"),  # rad^2, of the yaw by what it may have turned by, unseen
    ],
    align=True,
)
GUARD: Final = np.dtype(
    [
        ("readings", READINGS),  # the newest readings, to see repeats
        ("aidings", AIDINGS),  # mismatches between gyroscope and aiding
        ("gyro", TRUST),  # trust in the gyroscope
        ("force", TRUST),  # trust in the accelerometer
        ("agreed", "i8"),  # aidings in a row that agree with a gyroscope that proves itself
        ("rate", "f8"),  # rad/s, that the encoder told last
        ("rate_at", "f8"),  # s, own clock, of that aiding
        ("aiding_var", "f8"),  # rad^2, of that aiding
        ("agreed_rate", "f8"),  # rad/s, of the node when an aiding agreed with it last
        ("sane_rate", "f8"),  # rad/s about the axis, the gyroscope's last sane one
        ("found", MISMATCH),  # work space
        ("step", MISMATCH),  # mismatch that the constant bias has taken
        ("before_steps", "f8"),  # rad/s, the constant bias before the first step; NaN: it took none
        ("unproven", "f8"),  # rad/s, of a step that no rest has confirmed
        ("disputed", "f8"),  # rad, by which encoder and gyroscope differed then
        ("first_step", "f8"),  # rad/s, size of that step
        ("jumped", "i8"),  # 1: the clock jumped in the cycle before
        ("untimely", "i8"),  # 1: the aiding before was untimely
        ("reversed", "i8"),  # 1: the encoder counts against the gyroscope
        ("stands", "i8"),  # aidings in a row of a head at rest, while the gyroscope goes on turning
        (
            "rest_cycles",
            "i8",
        ),  # cycles in a row of a head at rest, by the encoder; below 0: of a node alone, without a bias
        ("doubted", "i8"),  # 1: innovations are larger than their variance explains
        ("misfit", "f8"),  # mean of their squares over their variances
        ("excess", "f8"),  # rad^2, mean of their squares beyond their variances
        ("before", "f8"),  # rad, the innovation before
        ("likeness", "f8"),  # mean of the products of neighbours over their variances
        ("shared", "f8"),  # rad^2, mean of the products of neighbours
        ("swing", SWING),  # of the drive, between cycles
        ("ramp", RAMP),  # of the drive, over cycles
        ("mirror", MIRROR),  # of the sensors' axes
        ("creep", CREEP),  # of the string below a head at rest
        ("same", SAME),  # errors of the encoder that return
        ("ratio", RATIO),  # of the encoder's turns to the gyroscope's
        ("rubbing", RUBBING),  # of the string against the rock
        ("jump", "f8"),  # rad, by which resets that nothing explains have moved the yaw
        ("last_jump", "f8"),  # rad, of it by the reset since the last aiding that agreed
        ("odd", "i8"),  # cycles in a row whose force at rest is not that of gravity as the filter has it
    ],
    align=True,
)
TWIST: Final = np.dtype(
    [
        ("known", "i8"),  # 1: an aiding has been used
        ("std", "f8"),  # rad, of the twist in it
        ("held", "i8"),  # 1: it was under torque
        ("wound", "i8"),  # 1: since then the string was under torque
        ("torque", "f8"),  # N m, in the last aiding heard
        ("holding", "i8"),  # 1: the drive held the string then
        ("heard_at", "f8"),  # s, own clock, of the last aiding heard
    ],
    align=True,
)
JOINTS: Final = np.dtype(
    [
        ("hops", "i8"),  # joints above, in the aiding used last; -1: none yet
        ("marks", "f8"),  # rad, offset of the marks in it
        ("solved", "i8"),  # 1: ``offset`` and ``var`` stand in the place of the marks'
        ("offset", "f8"),  # rad, of the joints as solved
        ("var", "f8"),  # rad^2, of it
    ],
    align=True,
)
EVENT: Final = np.dtype(
    [
        ("code", "i8"),  # ``Code``
        ("numbers", "f8", (NUMBERS,)),  # its arguments; NaN: none
    ],
    align=True,
)
EVENTS: Final = np.dtype(
    [
        ("told", "i8"),  # events put in since the start
        ("said", "i8"),  # events taken out
        ("ring", EVENT, (EVENTS_KEPT,)),  # the newest; where it is full the oldest is lost
    ],
    align=True,
)
ALIGNER: Final = np.dtype(
    [
        ("method", "i8"),  # of the alignment under way; 0: none is
        ("wanted", "f8"),  # turns, ordered
        ("angle", "f8"),  # rad, turned so far
        ("yaw", "f8"),  # rad, the filter's, of the last cycle; NaN while it was not aided
        ("sense", "f8"),  # of the turn, 1 or -1; 0 before it began
        ("ordered_at", "f8"),  # s, own clock, of the first cycle after the order; NaN before it
        ("last_end", "f8"),  # s, of the last cycle
        ("steady", "i8"),  # cycles of turning in a row
        ("slow", "i8"),  # cycles in a row, too slow
        ("sweeps", SWEEP, (MAX_IMUS,)),  # sums over the turn
        ("offsets", OFFSET, (MAX_IMUS,)),  # what came of them
        # work space
        ("force", "f8", (3,)),  # m/s^2, of one IMU, without the pull of the circle; or any vector
        ("sums", "f8", (2, 3)),  # axes of all IMUs together, before and after
        ("rotations", "f8", (2, 3, 3)),  # of each to z
        ("turn", "f8", (3, 3)),  # from the first frame to the second
    ],
    align=True,
)
DELAYED: Final = np.dtype(
    [
        ("late", "f8"),  # s, by which the window before ended before its cycle; NaN: there was none
        ("std", "f8"),  # s, of it
        ("lasting", "f8"),  # s, of what stays of its error from window to window
        ("rate", "f8", (3,)),  # rad/s, of that window
        ("change", "f8", (3,)),  # rad/s, of it since the one before
        ("missing", "f8", (3,)),  # rad, turn of its cycle that the sensor had yet to show
        # of the window that has just come, by its parts
        ("told", "i8"),  # 1: they are known
        ("joins", "i8"),  # 1: those of the cycle before are too, which waits for the filter
        ("behind", "f8"),  # rad/s beyond the mean, about the axis, of what was missing of the cycle before
        ("ahead", "f8"),  # rad/s, likewise, of what is missing now
        ("shown", "f8"),  # rad, turn of the cycle before beyond what was taken for missing
    ],
    align=True,
)
CLUSTER: Final = np.dtype(
    [
        ("used", "i8", (MAX_IMUS,)),  # in the fused reading, 1 or 0
        ("apart", "i8", (MAX_IMUS,)),  # cycles in a row, sane and away from the others
        ("well", "i8", (MAX_IMUS,)),  # cycles in a row, sane and among them
        ("faults", "i8", (MAX_IMUS,)),  # ``Fault`` of the newest cycle
        ("watches", READINGS, (MAX_IMUS,)),  # what the raw readings of each show by themselves
        ("delayed", DELAYED, (MAX_IMUS,)),  # windows of each that are not the cycles'
        ("split", "i8", (MAX_IMUS,)),  # 1: it tells the parts of the newest cycle
        ("parts", "f8", (MAX_IMUS, PARTS)),  # rad/s, of these beyond their mean, about the tube's axis
        ("expected", "f8", (3,)),  # rad/s, before the IMUs were apart
        ("cycles", "i8"),  # cycles written so far
        ("ring_force", "f8", (MAX_IMUS, RING, 3)),  # m/s^2, corrected, tube's frame
        ("ring_used", "u1", (MAX_IMUS, RING)),  # 1: it was in the fused reading
        ("rates", "f8", (MAX_IMUS, 3)),  # rad/s, corrected, tube's frame, of the newest cycle
        ("readings", "f8", (MAX_IMUS, 6)),  # the same without the offsets of the gyroscopes, and the forces, m/s^2
        ("weights", "f8", (MAX_IMUS,)),  # inverse variances of those in use, 0 of the others
        # the last survey
        ("survey_used", "i8", (MAX_IMUS,)),  # 1: it was in use over the whole of it
        ("survey_force", "f8", (MAX_IMUS, 3)),  # m/s^2, mean of each
        ("survey_force_cov", "f8", (MAX_IMUS, 3, 3)),  # (m/s^2)^2, of that mean
        # work space
        ("agrees", "i8", (MAX_IMUS,)),  # 1: with the others in this cycle
        ("chosen", "i8", (MAX_IMUS,)),  # 1: in use from this cycle on
        ("ordered", "f8", (MAX_IMUS,)),  # readings of one axis by size
        ("expects", "f8", (6,)),  # rad/s and m/s^2, what the node would read if nothing had changed
        ("middle", "f8", (6,)),  # likewise, what the IMUs in use read
        ("limits", "f8", (6,)),  # likewise, largest differences of IMUs that agree
        ("fused", "f8", (6,)),  # likewise, mean of those in use
    ],
    align=True,
)
REVISION: Final = np.dtype(
    [
        ("turned", "i8"),  # cycles of turning since the survey
        ("said_var", "f8"),  # rad^2, random variance of its yaw, as it was said last
        ("systematic", "f8"),  # rad^2, systematic variance, likewise
    ],
    align=True,
)
RECORDING: Final = np.dtype(
    [
        ("running", "i8"),  # 1 while a record is being taken
        ("command", "i8"),  # number of the order
        ("seconds", "f8"),  # s, wanted
        ("begun", "f8"),  # s, own clock; NaN before the first cycle
        ("sums", STATIC),  # of the raw readings
    ],
    align=True,
)
NODE: Final = np.dtype(
    [
        ("filter", STATE),  # the filter
        ("mount", MOUNT),  # how its IMUs sit in the tube
        ("guard", GUARD),  # trust in the sensors
        ("twist", TWIST),  # torque in the string
        ("joints", JOINTS),  # joints above
        # from here on what a start clears: it is not saved
        ("cycles", "i8"),  # cycles since the start
        ("overruns", "i8"),  # cycles that came too late
        ("status", "i8"),  # status bits of the newest cycle (``Status``)
        ("noticed", "i8"),  # status bits found between two cycles
        ("rejecting", "i8"),  # 1: aidings were rejected in the cycle before
        ("slow_cycles", "i8"),  # cycles in a row not faster than the offset of a gyroscope never calibrated
        ("stamp_hops", "i8"),  # joints of which the time stamp's prior is
        ("temperature", "f8"),  # C, of the newest reading
        ("raw_rate", "f8", (3,)),  # rad/s, what a block of parameters would correct
        ("raw_force", "f8", (3,)),  # m/s^2, likewise
        ("rate", "f8", (3,)),  # rad/s, corrected, of all IMUs together, tube's frame
        ("force", "f8", (3,)),  # m/s^2, likewise
        ("unaligned", "f8", (MAX_IMUS, 3)),  # m/s^2, corrected, in the frame of each IMU
        ("down_offset", "f8"),  # rad, of the aiding handed down
        ("down_systematic", "f8"),  # rad^2, of its constant errors
        ("down_torsion", "f8"),  # rad^2, of its twist
        ("revision", REVISION),  # of the last survey
        ("events", EVENTS),  # what it has yet to say
        ("cluster", CLUSTER),  # IMUs of the tube beside each other
        ("aligner", ALIGNER),  # an alignment under way
        ("recording", RECORDING),  # a static record being taken
        ("config", CONFIG),  # configuration in use: as given, with the noise of the IMUs and of the clock at present
    ],
    align=True,
)

SETTINGS: Final = np.dtype(
    [
        ("drive_angle", "f8"),  # rad, joint to the drive head, while this is the top tube
        ("drive_var", "f8"),  # rad^2
        ("lower_angle", "f8"),  # rad, joint to the tube below
        ("lower_var", "f8"),
        ("unseen_var", "f8"),  # rad^2, what may turn unseen while a joint is made up
        ("stiffness", "f8"),  # N m/rad
        ("aiding_old_after", "f8"),  # s
        ("scheme", "i8"),
        ("state_every", "i8"),  # cycles
        ("torsion_gate", "i8"),  # 1: aiding under torque is not used
        ("joints", "i8"),  # 0 marks, 1 solved, 2 both
        ("stamp_walk", "f8"),  # s/sqrt(s), of one joint's clock
        ("rate_range", "f8"),  # rad/s
        ("force_range", "f8"),  # m/s^2
        ("repeats_together", "i8"),  # 0: not looked at
        ("repeats_alone", "i8"),
        ("imus", "i8"),
        ("place", "f8", (MAX_IMUS, 2)),  # m, of each IMU across the tube's axis
        ("noise", "f8", (MAX_IMUS,)),  # standard deviation of each, in that of the configuration
        ("weight", "f8", (MAX_IMUS,)),  # its inverse variance
        ("plain_gyro_noise", "f8", (3,)),  # of the configuration, for a noise of 1
        ("plain_bias_std", "f8", (3,)),
        ("plain_force_std", "f8"),
        ("tilt_noise", "f8"),  # rad, of one sample of a force at rest, as a tilt, for a noise of 1
    ],
    align=True,
)

KEPT: Final = ("filter", "mount", "guard", "twist", "joints")  # what a save holds; a start clears the rest
KEPT_SIZE: Final = int(NODE.fields["cycles"][1]) if NODE.fields else 0  # bytes of it, from the first on

# what one cycle brings, float64; of every IMU a row
WX, WY, WZ, FX, FY, FZ, TEMPERATURE, SATURATED, LATE, LATE_STD, SPLIT, BEHIND, PART = range(13)
READING: Final = PART + PARTS
START, END, JOINED, HOPS, CLOCK_VAR, SYNCHRONISED, STEPPED, DRIFT = range(8)
MOMENT: Final = 8
# an aiding, float64; see ``node.kernels.step.node_step.node_aiding``
A_YAW, A_YAW_VAR, A_SYSTEMATIC, A_OFFSET, A_RATE, A_VALID, A_SEQUENCE, A_HOPS, A_TORQUE, A_TORSION = range(10)
A_HELD, A_CLOCK_VAR = range(10, 12)
AIDING: Final = 12


def new_node(config: Array) -> Array:
    """Node that knows nothing yet, one record of dtype ``NODE``."""
    made = np.zeros(1, NODE)
    made["filter"] = new_state(config)
    made["mount"] = new_mount()
    made["config"] = config
    forget_session(made)
    made["guard"]["before_steps"] = np.nan
    return made


def forget_session(nodes: Array) -> None:
    """Make every node forget what belongs to one session of its processor: readings, counts, what it had to say."""
    guard = nodes["guard"]
    nodes["cluster"] = np.zeros(1, CLUSTER)
    nodes["cluster"]["used"] = 1
    nodes["cluster"]["delayed"]["late"] = np.nan
    for sensor in ("rates", "forces"):
        nodes["cluster"]["watches"][sensor]["last"] = np.nan
        guard["readings"][sensor]["last"] = np.nan
        guard["readings"][sensor]["counts"] = 0
    guard["readings"]["clipped"] = 0
    guard["aidings"]["at"] = np.nan
    guard["aidings"]["left"] = 0.0
    guard["aidings"]["seen"] = guard["aidings"]["wrong"] = 0
    guard["rate"] = guard["sane_rate"] = guard["agreed_rate"] = guard["aiding_var"] = 0.0
    guard["rate_at"] = -np.inf
    guard["swing"] = np.zeros(1, SWING)
    guard["creep"]["cycles"] = guard["creep"]["waits"] = 0
    guard["jumped"] = guard["untimely"] = guard["agreed"] = guard["rest_cycles"] = 0
    nodes["twist"]["heard_at"] = -np.inf
    nodes["twist"]["torque"] = 0.0
    nodes["twist"]["holding"] = 0
    nodes["joints"]["hops"] = -1
    nodes["joints"]["solved"] = 0
    nodes["revision"] = np.zeros(1, REVISION)
    nodes["aligner"] = np.zeros(1, ALIGNER)
    nodes["recording"] = np.zeros(1, RECORDING)
    nodes["events"]["told"] = nodes["events"]["said"] = 0
    for name in ("cycles", "overruns", "status", "noticed", "rejecting", "slow_cycles", "stamp_hops"):
        nodes[name] = 0
    nodes["temperature"] = 25.0
