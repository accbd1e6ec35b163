"""What the drive's torque means for the reference: whether it holds the string twisted, and what it may leave behind.

The drive counts as released when its torque has stayed within the sensor's dead band for several cycles, so that the
unwinding is over. Friction then keeps a part of the largest torque; a grip of less than half of it, as to make up a
joint, frees nothing.
"""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np

from node.kernels.arithmetic.jit import kernel

LARGEST: Final = 1e6  # N m
FREEING: Final = 0.5  # of the largest torque, from which on a grip replaces what another has trapped

DRIVE: Final = np.dtype(
    [
        ("drilling", "f8"),  # N m, before a start, and while the head turns if there is no sensor
        ("trapped_fraction", "f8"),  # of the torque, that may stay in a released string, 1 sigma
        ("dead_band", "f8"),  # N m, what a released drive may read
        ("release_cycles", "i8"),  # within the dead band
    ],
    align=True,
)


@kernel
def follow_torque(encoder: Any, drive: Any, measured: float, has_sensor: bool, turning: bool) -> None:
    """Take the sensor's reading (N m, either sign), or the setting where there is none; ``torque`` and ``gripped``.

    Parameters
    ----------
    encoder, drive : records of dtype ``ENCODER`` and ``DRIVE``
    """
    if not has_sensor:
        measured = drive.drilling if turning else 0.0
    size = min(abs(measured), LARGEST) if math.isfinite(measured) else max(encoder.largest_torque, encoder.grip)
    within = size <= drive.dead_band
    encoder.quiet_cycles = encoder.quiet_cycles + 1 if within else 0
    if not within:
        encoder.gripped = 1
        encoder.grip = max(encoder.grip, size)
    elif encoder.gripped == 1 and encoder.quiet_cycles >= drive.release_cycles:
        encoder.gripped = 0
        if encoder.grip > FREEING * encoder.largest_torque:
            encoder.largest_torque = encoder.grip
        encoder.grip = 0.0
    trapped = drive.trapped_fraction * max(encoder.largest_torque, encoder.grip)
    encoder.torque = max(size, trapped) if encoder.gripped == 1 else trapped
