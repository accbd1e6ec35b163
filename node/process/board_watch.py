"""What a node that runs can say of its board, for an order over the string: newest cycles, CAN, clock, disk, keys.

The parts are judged as ``borechain board check`` judges them before a tube goes down; nothing is stopped for it.
"""

from __future__ import annotations

import datetime
import math
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from node.firmware.inputs import ImuReading
from node.firmware.tube_settings import TubeSettings
from node.kernels.arithmetic.jit import folder_in_use
from node.process import board_places
from node.process.board_findings import BoardFinding, bad_finding, good_finding
from node.process.board_sensors import CYCLES, describe_source, expected_noise, judge_rate, judge_readings
from node.process.drivers.source import SafeImu
from telemetry.errors import MediumError
from telemetry.messages import Side

FEWEST: Final = 3  # readings of which a scatter says something
CAN: Final = "can:"  # as a medium of the kernel's begins
SOCKET: Final = "socketcan"
PATIENCE: Final = 0.2  # s, of a program: a cycle waits for it


@dataclass(frozen=True, slots=True)
class BoardPlaces:
    """What a board has beside its sensors; ``has_clock``: its cycles are those of a clock of its own."""

    folder: Path
    keys: Path | None = None
    media: Mapping[Side, str] = field(default_factory=dict)
    has_clock: bool = False


class BoardWatch:
    """Keeps the newest cycles of a node's sensors, and says what is found of its board when it is asked.

    Parameters
    ----------
    settings : of its tube
    imus : of its own; none where each cycle brings a reading
    """

    def __init__(self, settings: TubeSettings, imus: Sequence[SafeImu], places: BoardPlaces) -> None:
        self._settings, self._imus, self._places = settings, imus, places
        self._readings: deque[ImuReading] = deque(maxlen=CYCLES)
        self._stood: deque[bool] = deque(maxlen=CYCLES)

    def look(self, reading: ImuReading, *, still: bool) -> None:
        """Keep a cycle as the sensor gave it, and whether the string stood before."""
        self._readings.append(reading)
        self._stood.append(still)

    def findings(self, now: datetime.datetime) -> list[BoardFinding]:
        """A line of every part."""
        places = self._places
        found = worst_of([self._findings_of(k) for k in range(len(self._settings.imus))])
        found += [line for side in Side if (line := check_end(side, places.media.get(side, ""))) is not None]
        if places.has_clock:
            found.append(board_places.check_clock(now))
        found.append(board_places.check_disk(places.folder))
        if places.keys is not None:
            found.append(board_places.check_keys(places.keys, self._settings.tube, now))
        return [*found, board_places.check_kernels(folder_in_use())]

    def _findings_of(self, imu: int) -> list[BoardFinding]:
        """Findings of one IMU by its newest cycles."""
        own = self._imus[imu] if self._imus else None
        of_cluster = [(one, *one.others)[imu] for one in self._readings if imu <= len(one.others)]
        samples = [one for one in of_cluster if math.isfinite(one.rate[2])]
        is_whole = bool(samples) and len(samples) == len(self._readings)
        counted = f"{len(samples)} of the last {len(self._readings)} cycles"
        if own is not None and own.trouble:
            counted = f"{counted}: {own.trouble}"
        said = "none of its own, readings come with each cycle" if own is None else describe_source(own.source)
        found = [good_finding("sensor", said)]
        found.append((good_finding if is_whole else bad_finding)("readings", counted))
        if own is not None:
            found += judge_rate(own.source)
        if len(samples) < FEWEST:
            return found
        noise = expected_noise(self._settings.imus[imu].noise, self._settings.gyro_noise)
        return found + judge_readings(samples, noise, still=all(self._stood))


def worst_of(findings: Sequence[Sequence[BoardFinding]]) -> list[BoardFinding]:
    """One line a part of several IMUs: the first that is wrong, else that of the first IMU."""
    if len(findings) == 1:
        return list(findings[0])
    worst: dict[str, BoardFinding] = {}
    for k, lines in enumerate(findings, 1):
        for line in lines:
            if line.part not in worst or (worst[line.part].good and not line.good):
                worst[line.part] = BoardFinding(line.part, line.good, f"IMU {k}: {line.text}")
    return list(worst.values())


def check_end(side: Side, medium: str) -> BoardFinding | None:
    """Controller of one end of the tube; None where it is not one of the kernel's."""
    if not medium.startswith(CAN):
        return None
    from telemetry.media.can_medium import CanSettings

    part = side.name.lower()
    try:
        settings = CanSettings.parse(medium.removeprefix(CAN))
    except MediumError as error:
        return bad_finding(part, str(error))
    if settings.interface != SOCKET:
        return None
    return board_places.check_can(part, settings.channel, is_fd=settings.frames == "fd", limit=PATIENCE)
