"""Sources of readings, and how a fault of one becomes an event instead of ending the cycle."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, TypeVar

from node.errors import SensorCause, SensorError
from node.firmware.encoder_node import EncoderSample
from node.kernels.sensors.correction import USUAL
from node.process.drivers.gravity_witness import GravityWitness
from telemetry.messages import Scalar, Severity, Vector3

NOTHING: Vector3 = (math.nan, math.nan, math.nan)

Sample = TypeVar("Sample")
Say = Callable[[Severity, str, dict[str, Scalar]], None]


@dataclass(frozen=True, slots=True)
class ImuSample:
    """Mean of one cycle as the sensor gives it, before any correction."""

    rate: Vector3  # rad/s
    force: Vector3  # m/s^2
    temperature: float = USUAL  # C
    saturated: int = 0  # bits of what was at its range within the cycle: 1 gyroscope, 2 accelerometer
    late: float = 0.0  # s, by which the window that was measured ended before the cycle
    late_std: float = 0.0  # s, of that
    # rad/s, nine mean rates about z: of what that window shows of the cycle before, and of the eighths of this one as
    # far as it shows them; nothing: not known
    parts: tuple[float, ...] = ()


class ImuSource(Protocol):
    """An IMU. ``start`` raises ``SensorError`` when it is absent; so does ``read``, at any later time."""

    def start(self) -> None:
        """Find and configure the sensor; called again after a fault."""

    def read(self, begin: float, end: float) -> ImuSample:
        """Mean over the cycle from ``begin`` to ``end`` (s, own clock)."""

    def close(self) -> None:
        """Release the bus or the file."""


class EncoderSource(Protocol):
    """A counter of the drive head; the same contract."""

    def start(self) -> None:
        """Find the counter; called again after a fault."""

    def read(self, now: float) -> EncoderSample:
        """The counter at ``now`` (s, own clock)."""

    def close(self) -> None:
        """Release the file."""


class SourceSupervisor:
    """Keeps a source going: reports each cause of a fault and its return once, and restarts it after every failure."""

    def __init__(self, source: ImuSource | EncoderSource, say: Say, name: str, imu: int = 0) -> None:
        self._source, self._say, self._name = source, say, name
        self._which: dict[str, Scalar] = {"imu": imu} if imu else {}
        self._told: set[SensorCause] = set()  # since it failed
        self._down = False
        self.trouble = ""  # the newest fault; nothing once it is back

    def call(self, read: Callable[[], Sample], is_whole: Callable[[Sample], bool] = bool) -> Sample | None:
        """What ``read`` gives; None for this cycle when it fails. A source is back when it gives what ``is_whole``."""
        try:
            if self._down:  # this cycle is lost: the sensor has not gathered data over all of it
                self._source.start()
                self._down = False
                return None
            sample = read()
        except SensorError as error:
            self.tell(error)
            self._down = True
            return None
        if self._told and is_whole(sample):
            self._say(Severity.WARNING, f"{self._name}_back", self._which)
            self._told.clear()
            self.trouble = ""
        return sample

    def tell(self, error: SensorError) -> None:
        """Report a fault, unless its cause was told since the source failed."""
        self.trouble = str(error)
        if error.cause not in self._told:
            self._told.add(error.cause)
            details: dict[str, Scalar] = {"cause": str(error.cause), "detail": str(error)[:200]}
            self._say(Severity.ERROR, f"{self._name}_failed", {**details, **self._which})


class SafeImu:
    """An IMU in use; during a fault its readings are NaN. ``imu`` is its number in a cluster, 0 if it is alone."""

    def __init__(self, source: ImuSource, say: Say, imu: int = 0) -> None:
        self.source = source
        self._alarm = SourceSupervisor(source, say, "sensor", imu)
        self._gravity = GravityWitness()

    @property
    def trouble(self) -> str:
        """Why its readings are lost; nothing while they come."""
        return self._alarm.trouble

    def read(self, begin: float, end: float) -> ImuSample:
        """Mean over the cycle, whatever happens."""

        def read_proved() -> ImuSample:
            sample = self.source.read(begin, end)
            self._gravity.look(sample.rate, sample.force)
            return sample

        return self._alarm.call(read_proved, _has_numbers) or ImuSample(NOTHING, NOTHING)


def _has_numbers(sample: ImuSample) -> bool:
    return math.isfinite(sample.rate[2])


class SafeEncoder:
    """A counter in use; during a fault there is no sample and so no aiding, and every node below sees it grow old."""

    def __init__(self, source: EncoderSource, say: Say) -> None:
        self._source = source
        self._alarm = SourceSupervisor(source, say, "encoder")

    def read(self, now: float) -> EncoderSample | None:
        """The counter, or None."""
        return self._alarm.call(lambda: self._source.read(now))
