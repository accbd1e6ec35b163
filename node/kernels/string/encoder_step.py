"""The encoder node as one step over one record: counts of the drive head become an aiding, with the drive's torque.

While the head turns, the moment of the last edge is known: at that moment the angle is exact but for the edge's own
jitter. A counter that does not time its edges is read in the middle of its count. At rest the angle is somewhere inside
one count, a constant error, so the rest gives one measurement, repeated under one sequence number and never averaged
(thesis 3.6 takes it as white).
"""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np

from node.kernels.arithmetic.formats import Array
from node.kernels.arithmetic.jit import kernel
from node.kernels.record.node_record import A_HELD, A_RATE, A_SEQUENCE, A_TORQUE, A_VALID, A_YAW, A_YAW_VAR
from node.kernels.string.drive_torque import follow_torque

COUNTS_PER_TURN: Final = 4096  # 1024 lines, decoded in quadrature
TURN: Final = 2.0 * math.pi
QUANTUM: Final = TURN / COUNTS_PER_TURN
QUANTUM_VAR: Final = QUANTUM**2
COUNT_VAR: Final = QUANTUM**2 / 12.0
EDGE_STD: Final = math.radians(0.003)
EDGE_VAR: Final = EDGE_STD**2
FASTEST: Final = 100.0  # rad/s, what two edges in a bouncing instant may seem

ENCODER: Final = np.dtype(
    [
        ("sequence", "i8"),  # number of the last measurement
        ("edge_at", "f8"),  # s, rig time of the last edge; NaN: none yet
        ("edge_angle", "f8"),  # rad, of that edge
        ("resting", "i8"),  # 1: the present rest has its number
        ("doubtful_angle", "f8"),  # rad, of a rest's last reading, if it contradicted the measurement; else NaN
        ("placed", "i8"),  # 1: it is known what the head went beyond its last edge
        ("beyond", "f8"),  # counts, that
        ("beyond_var", "f8"),  # counts^2, of it
        ("largest_torque", "f8"),  # N m, that the string was under and that may have trapped a part
        ("grip", "f8"),  # N m, largest since the drive took hold
        ("quiet_cycles", "i8"),  # cycles in a row within the sensor's dead band
        ("gripped", "i8"),  # 1: the drive holds the string
        ("torque", "f8"),  # N m, the drive's, or of a released string what may be trapped (1 sigma)
        ("holding", "i8"),  # 1: it held the string in the last measurement
    ],
    align=True,
)
# a reading of the counter and the drive, float64; see ``encoder_step``
COUNT, EDGE_AT, RISING, TIMED, TORQUE, HAS_TORQUE, NOW, BEYOND, BEYOND_VAR = range(9)
SAMPLE: Final = 9


def new_encoder(first_sequence: int, largest_torque: float) -> Array:
    """Encoder node before its first cycle, one record of dtype ``ENCODER``; the string was under ``largest_torque``."""
    made = np.zeros(1, ENCODER)
    made["sequence"], made["largest_torque"] = first_sequence, largest_torque
    made["edge_at"] = made["doubtful_angle"] = np.nan
    return made


@kernel
def encoder_step(encoders: Array, drives: Array, sample: Array, aiding: Array) -> None:
    """One cycle of the encoder node; its measurement is left in ``aiding``.

    A drive that grips or releases the string makes a new measurement of a rest: what it is worth has changed.

    Parameters
    ----------
    encoders, drives : one-element arrays of dtype ``ENCODER`` and ``DRIVE``
    sample : (9,) count, time of its last edge (s), 1 if it rose, 1 if that time is the edge's own, torque (N m) and 1
        if there is a sensor for it, the present (s, rig time); what a head that stops went beyond its last edge and the
        variance of that (counts), read in the first cycle of a rest
    aiding : (12,) as ``node.kernels.step.node_step.node_aiding`` takes it
    """
    encoder, drive = encoders[0], drives[0]
    turning = sample[EDGE_AT] > encoder.edge_at
    follow_torque(encoder, drive, sample[TORQUE], sample[HAS_TORQUE] != 0.0, turning)
    if encoder.gripped != encoder.holding:
        encoder.holding = encoder.gripped
        encoder.resting = 0
    if turning:
        measure_turning(encoder, sample, aiding)
    else:
        measure_rest(encoder, sample, aiding)
    aiding[A_TORQUE], aiding[A_HELD] = encoder.torque, float(encoder.holding)


@kernel
def measure_turning(encoder: Any, sample: Array, aiding: Array) -> None:
    """Aiding of a string that turns: at the last edge, or at the middle of the count where the edge was not timed."""
    before_at, before_angle = encoder.edge_at, encoder.edge_angle
    take_edge(encoder, sample)
    encoder.resting = encoder.placed = 0
    encoder.sequence += 1
    rate = (encoder.edge_angle - before_angle) / (encoder.edge_at - before_at)
    timed = sample[TIMED] != 0.0
    angle = encoder.edge_angle if timed else (sample[COUNT] + 0.5) * QUANTUM
    write_rest_aiding(encoder, aiding, angle, EDGE_VAR if timed else COUNT_VAR, encoder.edge_at)
    aiding[A_RATE] = max(-FASTEST, min(rate, FASTEST))


@kernel
def measure_rest(encoder: Any, sample: Array, aiding: Array) -> None:
    """The place of the rest inside its count; a count that is another one without an edge is a new measurement.

    A tube whose gyroscope saw nothing move looks again then, and doubts it. Two readings in a row must say so: after
    one that was off alone the rest would be the same measurement under another number, and be used twice.
    """
    before_angle, doubtful = encoder.edge_angle, encoder.doubtful_angle
    take_edge(encoder, sample)
    encoder.doubtful_angle = math.nan
    if encoder.resting == 0 or encoder.edge_angle == doubtful:
        encoder.resting = 1
        encoder.sequence += 1
    elif encoder.edge_angle != before_angle:
        encoder.doubtful_angle = encoder.edge_angle
        encoder.edge_angle = before_angle
    if encoder.placed == 0:
        encoder.placed, encoder.beyond, encoder.beyond_var = 1, sample[BEYOND], sample[BEYOND_VAR]
    beyond = encoder.beyond if sample[RISING] != 0.0 else -encoder.beyond
    write_rest_aiding(
        encoder, aiding, encoder.edge_angle + beyond * QUANTUM, encoder.beyond_var * QUANTUM_VAR, sample[NOW]
    )


@kernel
def take_edge(encoder: Any, sample: Array) -> None:
    """Remember the last edge: a rising one is the lower border of its count, a falling one the upper."""
    encoder.edge_at = sample[EDGE_AT]
    encoder.edge_angle = (sample[COUNT] + (0.0 if sample[RISING] != 0.0 else 1.0)) * QUANTUM


@kernel
def write_rest_aiding(encoder: Any, aiding: Array, angle: float, var: float, valid_at: float) -> None:
    """Aiding of the encoder itself, of a head that rests: no joint passed, no systematic error."""
    aiding[:] = 0.0
    yaw = angle % TURN
    aiding[A_YAW] = yaw if yaw < TURN else 0.0
    aiding[A_YAW_VAR], aiding[A_VALID], aiding[A_SEQUENCE] = var, valid_at, float(encoder.sequence)
