"""Options of the node's command about several IMUs, as the settings of its cluster."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from node.firmware.imu_settings import ImuSettings
    from telemetry.parameters import SensorParameters


def imu_settings_of(
    sources: int,
    noises: tuple[float, ...],
    offsets_mm: tuple[tuple[float, float], ...],
    gyroscopes: tuple[Path, ...],
    accelerometers: tuple[Path, ...],
) -> tuple[ImuSettings, ...]:
    """Settings of every IMU; an option that is absent leaves all of them as usual.

    Raises
    ------
    ConfigurationError
        When options were given for different numbers of IMUs.
    CalibrationError
        When a file is not a calibration of its sensor.
    """
    from node.errors import NodeConfigurationError
    from node.firmware.imu_settings import ImuSettings

    given = {
        "imu": sources,
        "imu-noise": len(noises),
        "imu-offset-mm": len(offsets_mm),
        "imu-gyroscope": len(gyroscopes),
        "imu-accelerometer": len(accelerometers),
    }
    counts = {name: count for name, count in given.items() if count}
    if len(set(counts.values())) > 1:
        told = ", ".join(f"--{name} {count} times" for name, count in counts.items())
        raise NodeConfigurationError(f"imus: expected as many of each option as there are IMUs, got {told}")
    count = max(counts.values(), default=1)
    rows = zip(
        [(1e-3 * x, 1e-3 * y) for x, y in offsets_mm or ((0.0, 0.0),) * count],
        noises or (1.0,) * count,
        own_corrections("gyroscope", gyroscopes, count),
        own_corrections("accelerometer", accelerometers, count),
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
