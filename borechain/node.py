"""``borechain node``: what a tube's board runs."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import click

from borechain.faults import plain_faults
from borechain.options import key_option, place_options

if TYPE_CHECKING:
    from node.firmware.imu_settings import ImuSettings
    from telemetry.parameters import SensorParameters

FILE = click.Path(path_type=Path, dir_okay=False)
SCHEMES = ("forward", "estimate", "intersection")


@click.command()
@click.option("--tube", type=int, required=True, help="Number of the tube, 1 is the lowest.")
@click.option("--drive-joint-deg", type=float, default=0.0, help="Scribe-mark reading, drive head to this tube.")
@click.option("--lower-joint-deg", type=float, default=0.0, help="Scribe-mark reading, this tube to the one below.")
@click.option("--joint-std-deg", type=float, default=0.05, show_default=True, help="Error of a reading, 1 sigma.")
@click.option("--mount-std-deg", type=float, default=0.05, show_default=True, help="Error of the IMU's mount, 1 sigma.")
@click.option("--kernel", type=click.Choice(["float64", "fixed", "published"]), default="float64", show_default=True)
@click.option("--scheme", type=click.Choice(SCHEMES), default="forward", show_default=True)
@click.option(
    "--stiffness-nm", type=float, default=math.inf, help="Torque that twists the tube by 1 rad; rigid if absent."
)
@click.option("--torsion", type=click.Choice(["gate", "variance"]), default="gate", show_default=True)
@click.option("--joints", type=click.Choice(["marks", "solved", "both"]), default="marks", show_default=True)
@click.option(
    "--imu",
    "sources",
    multiple=True,
    help="The node's own sensor: replay:FILE, mpu6500:BUS or mpu6500:BUS:ADDRESS; once for each of a cluster.",
)
@click.option("--imu-noise", "noises", type=float, multiple=True, help="Noise of an IMU, times the usual; for each.")
@click.option(
    "--imu-offset-mm", "offsets", type=(float, float), multiple=True, help="Place off the tube's axis, X Y; for each."
)
@click.option(
    "--imu-gyroscope", "gyroscopes", type=FILE, multiple=True, help="Calibration of an IMU's gyroscope; for each."
)
@click.option("--imu-accelerometer", "accelerometers", type=FILE, multiple=True, help="Of its accelerometer; for each.")
@key_option
@place_options
@plain_faults
def node(
    tube: int,
    drive_joint_deg: float,
    lower_joint_deg: float,
    joint_std_deg: float,
    mount_std_deg: float,
    kernel: Literal["float64", "fixed", "published"],
    scheme: str,
    stiffness_nm: float,
    torsion: Literal["gate", "variance"],
    joints: Literal["marks", "solved", "both"],
    sources: tuple[str, ...],
    noises: tuple[float, ...],
    offsets: tuple[tuple[float, float], ...],
    gyroscopes: tuple[Path, ...],
    accelerometers: tuple[Path, ...],
    key_file: Path | None,
    rig_name: str,
    endpoint: str,
    folder: Path,
) -> None:
    """Run the node of one tube until it is stopped.

    \b
    Example:
      borechain node --tube 1 --drive-joint-deg 12.5 --folder state/tube-1
      borechain node --tube 1 --imu mpu6500:1:0x68 --imu mpu6500:1:0x69
    """
    from borechain.processes import Place, run_node
    from node.firmware.settings import Joint, TubeSettings
    from node.kernels.layout import Scheme
    from node.process.drivers.choice import imu_source

    joint_std = math.radians(joint_std_deg)
    settings = TubeSettings(
        tube=tube,
        drive_joint=Joint(math.radians(drive_joint_deg), joint_std),
        lower_joint=Joint(math.radians(lower_joint_deg), joint_std),
        mount_std=math.radians(mount_std_deg),
        scheme=Scheme[scheme.upper()],
        kernel=kernel,
        stiffness=stiffness_nm,
        torsion=torsion,
        joints=joints,
        imus=cluster(len(sources), noises, offsets, gyroscopes, accelerometers),
    )
    run_node(Place(rig_name, endpoint, folder, key_file), settings, [imu_source(source) for source in sources])


def cluster(
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
        When a file holds no calibration of its sensor.
    """
    from node.errors import ConfigurationError
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
        raise ConfigurationError(f"imus: expected as many of each option as there are IMUs, got {told}")
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
    from groundstation.calibration.block import read
    from groundstation.calibration.errors import CalibrationError
    from groundstation.service.parameters import sensor_parameters
    from telemetry.parameters import SensorParameters

    corrections = []
    for path in files:
        calibration = read(path)
        if calibration.sensor != sensor:
            raise CalibrationError(f"{path}: sensor: expected {sensor}, got {calibration.sensor}")
        corrections.append(sensor_parameters(calibration))
    return corrections or [SensorParameters()] * count
