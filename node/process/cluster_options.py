"""Options of the node's command about several IMUs, as the settings of its cluster."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from node.firmware.imu_settings import ImuSettings
    from telemetry.parameters import SensorParameters


@dataclass(frozen=True, slots=True)
class ClusterRequest:
    """The IMUs of a tube as its options say: each option for every IMU, or for none."""

    sources: tuple[str, ...]
    noises: tuple[float, ...]
    offsets: tuple[tuple[float, float], ...]  # mm
    gyroscopes: tuple[Path, ...]
    accelerometers: tuple[Path, ...]

    def to_settings(self) -> tuple[ImuSettings, ...]:
        """Settings of every IMU; an option that is absent leaves all of them as usual.

        Raises
        ------
        NodeConfigurationError
            When options were given for different numbers of IMUs.
        CalibrationError
            When a file is not a calibration of its sensor.
        """
        from node.errors import NodeConfigurationError
        from node.firmware.imu_settings import ImuSettings

        given = {
            "imu": len(self.sources),
            "imu-noise": len(self.noises),
            "imu-offset-mm": len(self.offsets),
            "imu-gyroscope": len(self.gyroscopes),
            "imu-accelerometer": len(self.accelerometers),
        }
        counts = {name: count for name, count in given.items() if count}
        if len(set(counts.values())) > 1:
            told = ", ".join(f"--{name} {count} times" for name, count in counts.items())
            raise NodeConfigurationError(f"imus: expected as many of each option as there are IMUs, got {told}")
        count = max(counts.values(), default=1)
        rows = zip(
            [(1e-3 * x, 1e-3 * y) for x, y in self.offsets or ((0.0, 0.0),) * count],
            self.noises or (1.0,) * count,
            own_corrections("gyroscope", self.gyroscopes, count),
            own_corrections("accelerometer", self.accelerometers, count),
            common_ranges(self.gyroscopes, self.accelerometers, count),
            strict=True,
        )
        return tuple(ImuSettings(*row) for row in rows)


def own_corrections(sensor: str, files: tuple[Path, ...], count: int) -> list[SensorParameters]:
    """Correction of one sensor of each of ``count`` IMUs; none without files."""
    from telemetry.calibration import read_calibration, sensor_parameters
    from telemetry.errors import CalibrationError
    from telemetry.parameters import SensorParameters

    corrections = []
    for path in files:
        calibration = read_calibration(path)
        if calibration.sensor != sensor:
            raise CalibrationError(f"{path}: sensor: expected {sensor}, got {calibration.sensor}")
        corrections.append(sensor_parameters(calibration))
    return corrections or [SensorParameters()] * count


def common_ranges(
    gyroscopes: tuple[Path, ...], accelerometers: tuple[Path, ...], count: int
) -> list[tuple[float, float]]:
    """Temperatures (C) at which the corrections of each of ``count`` IMUs were measured; all where no file says."""
    from telemetry.calibration import read_calibration

    ranges = [(-math.inf, math.inf)] * count
    for files in filter(None, (gyroscopes, accelerometers)):
        found = [read_calibration(path).valid or (-math.inf, math.inf) for path in files]
        ranges = [(max(a, c), min(b, d)) for (a, b), (c, d) in zip(ranges, found, strict=True)]
    return ranges
