"""The encoder node: counts of the drive head become the measurement that every tube below relies on.

While the head turns, the moment of the last edge is known: at that moment the angle is exact but for the edge's own
jitter. A counter that does not time its edges is read in the middle of its count. At rest the angle is somewhere inside
one count, a constant error, so the rest gives one measurement, repeated under one sequence number and never averaged
(thesis 3.6 takes it as white). Where inside, the times of the last edges say, if they were taken
(``node.firmware.edge_interpolation``).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from node.firmware.edge_interpolation import stopped_at
from node.firmware.torque import TorqueSettings, TorqueWatch
from telemetry.messages import Aiding

COUNTS_PER_TURN = 4096  # 1024 lines, decoded in quadrature
QUANTUM = 2.0 * math.pi / COUNTS_PER_TURN
EDGE_STD = math.radians(0.003)
STOP_STD = 1.5 * EDGE_STD / QUANTUM  # counts; the form of a stop is not exactly a power of time
FASTEST = 100.0  # rad/s, what two edges in a bouncing instant may seem


@dataclass(frozen=True, slots=True)
class EncoderSample:
    """One reading of the counter."""

    count: int  # since the counter was started
    edge_at: float  # s, rig time of the last change of the count
    rising: bool  # direction of that change
    torque: float | None = None  # N m, of the drive, where it has a sensor
    timed: bool = True  # else the edge's time is that of the read
    earlier: tuple[float, ...] = ()  # s, times of the edges before the last in its direction, the newest first


class EncoderNode:
    """Makes one aiding a cycle from the counter and the drive's torque."""

    def __init__(self, first_sequence: int = 0, torque: TorqueSettings | None = None) -> None:
        self.sequence = first_sequence
        self._torque = TorqueWatch(torque or TorqueSettings())
        self._holding = False
        self._edge_at: float | None = None
        self._edge_angle = 0.0
        self._resting = False
        self._beyond: tuple[float, float] | None = None  # counts, counts^2: of the last edge, since the head stopped

    def on_cycle(self, sample: EncoderSample, now: float) -> Aiding:
        """Measure at ``now`` (s, rig time): the last edge while turning, its place in the count at rest.

        A drive that grips or releases the string makes a new measurement of a rest: what it is worth has changed.
        """
        turning = self._edge_at is not None and sample.edge_at > self._edge_at
        torque = self._torque.on_cycle(sample.torque, turning=turning)
        if torque.holding != self._holding:
            self._holding = torque.holding
            self._resting = False
        if turning:
            measured = self._turning(sample)
        else:
            self._remember(sample)
            measured = self._at_rest(sample, now)
        return replace(measured, torque=torque.size, under_torque=torque.holding)

    def _turning(self, sample: EncoderSample) -> Aiding:
        before_at, before_angle = self._edge_at, self._edge_angle
        self._remember(sample)
        elapsed = sample.edge_at - (before_at if before_at is not None else sample.edge_at)
        self._resting, self._beyond = False, None
        self.sequence += 1
        rate = max(-FASTEST, min((self._edge_angle - before_angle) / elapsed, FASTEST))
        if sample.timed:
            return aiding(self._edge_angle, EDGE_STD**2, rate, sample.edge_at, self.sequence)
        return aiding((sample.count + 0.5) * QUANTUM, QUANTUM**2 / 12.0, rate, sample.edge_at, self.sequence)

    def _at_rest(self, sample: EncoderSample, now: float) -> Aiding:
        if not self._resting:
            self._resting = True
            self.sequence += 1
        if self._beyond is None:
            self._beyond = stopped_at((sample.edge_at, *sample.earlier), STOP_STD)
        beyond, var = self._beyond
        angle = self._edge_angle + (beyond if sample.rising else -beyond) * QUANTUM
        return aiding(angle, var * QUANTUM**2, 0.0, now, self.sequence)

    def _remember(self, sample: EncoderSample) -> None:
        self._edge_at = sample.edge_at
        self._edge_angle = (sample.count + (0 if sample.rising else 1)) * QUANTUM


def aiding(angle: float, var: float, rate: float, valid_at: float, sequence: int) -> Aiding:
    """Aiding of the encoder itself: no joint passed, no systematic error."""
    yaw = angle % (2.0 * math.pi)
    return Aiding(
        yaw=yaw if yaw < 2.0 * math.pi else 0.0,
        yaw_var=var,
        systematic_var=0.0,
        offset=0.0,
        rate=rate,
        valid_at=valid_at,
        sequence=sequence,
        hops=0,
    )
