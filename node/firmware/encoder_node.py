"""The encoder node: samples of its counter go into the compiled step, aidings come out.

Where inside a count the head stopped the times of its last edges say, if they were taken
(``node.firmware.edge_interpolation``); that is worked out once a stop, before the step that needs it.
"""

from __future__ import annotations

import math

import numpy as np

from node.firmware.edge_interpolation import stopped_at
from node.firmware.torque import TorqueSettings, drive_record
from node.kernels.record.node_record import A_RATE, A_TORQUE, A_VALID, A_YAW, A_YAW_VAR, AIDING
from node.kernels.string.encoder_step import BEYOND, BEYOND_VAR, EDGE_STD, QUANTUM, SAMPLE, encoder_step, new_encoder
from telemetry.frozen import Frozen
from telemetry.messages import EPOCH_UNKNOWN, Aiding

STOP_STD = 1.5 * EDGE_STD / QUANTUM  # counts; the form of a stop is not exactly a power of time


class EncoderSample(Frozen):
    """One reading of the counter."""

    count: int  # since the counter was started
    edge_at: float  # s, rig time of the last change of the count
    rising: bool  # direction of that change
    torque: float | None = None  # N m, of the drive, where it has a sensor
    timed: bool = True  # else the edge's time is that of the read
    earlier: tuple[float, ...] = ()  # s, times of the edges before the last in its direction, the newest first


class EncoderNode:
    """Makes one aiding a cycle from the counter and the drive's torque.

    Attributes
    ----------
    encoders : its record, one-element array of dtype ``ENCODER``
    """

    def __init__(self, first_sequence: int = 0, torque: TorqueSettings | None = None) -> None:
        settings = torque or TorqueSettings()
        # before a restart the string may have been under the torque of drilling
        self.encoders = new_encoder(first_sequence, settings.drilling)
        self._drive = drive_record(settings)
        self._sample, self._aiding = np.zeros(SAMPLE), np.zeros(AIDING)

    def on_cycle(self, sample: EncoderSample, now: float, epoch: int = EPOCH_UNKNOWN) -> Aiding:
        """Measure at ``now`` (s, rig time of an epoch): the last edge while turning, its place in the count at rest."""
        taken, aiding, encoder = self._sample, self._aiding, self.encoders[0]
        torque = math.nan if sample.torque is None else sample.torque
        taken[:BEYOND] = (
            *(sample.count, sample.edge_at, sample.rising, sample.timed),
            *(torque, sample.torque is not None, now),
        )
        if not encoder["placed"] and not sample.edge_at > encoder["edge_at"]:
            taken[BEYOND : BEYOND_VAR + 1] = stopped_at((sample.edge_at, *sample.earlier), STOP_STD)
        encoder_step(self.encoders, self._drive, taken, aiding)
        return Aiding(
            yaw=float(aiding[A_YAW]),
            yaw_var=float(aiding[A_YAW_VAR]),
            systematic_var=0.0,
            offset=0.0,
            rate=float(aiding[A_RATE]),
            valid_at=float(aiding[A_VALID]),
            sequence=int(encoder["sequence"]),
            hops=0,
            torque=float(aiding[A_TORQUE]),
            under_torque=bool(encoder["holding"]),
            epoch=epoch,
        )
