"""Options of the node's command as what the crew knows of its tube."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import click

from node.process.cluster_options import ClusterRequest
from telemetry.runtime.command_line import InputFault
from telemetry.runtime.process_options import (
    EndsRequest,
    PlaceRequest,
    above_option,
    below_option,
    clock_option,
    key_option,
    keys_option,
    lower_option,
    place_options,
    upper_option,
)
from telemetry.runtime.typed_options import gather_options

if TYPE_CHECKING:
    from node.firmware.tube_settings import MakeUpAngle, TubeSettings

FILE = click.Path(path_type=Path, dir_okay=False)
SCHEMES = ("forward", "estimate", "intersection")


@dataclass(frozen=True, slots=True)
class TubeRequest:
    """A tube as its options say; ``imus`` are its IMUs."""

    tube: int
    drive_joint_deg: float | None
    lower_joint_deg: float | None
    joint_std_deg: float
    mount_std_deg: float
    kernel: Literal["float64", "fixed"]
    scheme: str
    stiffness_nm: float
    torsion: Literal["gate", "variance"]
    joints: Literal["marks", "solved", "both"]
    gyro_noise: Path | None
    imus: ClusterRequest
    compiled_by: Literal["numba", "c"] = "numba"

    def __post_init__(self) -> None:
        """Refuse what there is no C of.

        Raises
        ------
        InputFault
            When floats are asked for in C.
        """
        if self.compiled_by == "c" and self.kernel != "fixed":
            raise InputFault(f"--compiled-by c: expected --kernel fixed with it, got {self.kernel}")

    def to_settings(self) -> TubeSettings:
        """Settings of the node in SI and rad.

        Raises
        ------
        NodeConfigurationError, CalibrationError, LoggerError
            When a setting is outside its range, or a file is not a calibration, or not of a gyroscope's noise.
        """
        from node.firmware.kernel_choice import LIBRARY
        from node.firmware.tube_settings import TubeSettings
        from node.kernels.record.filter_record import Scheme
        from telemetry.records.noise_file import read_gyro_noise

        return TubeSettings(
            tube=self.tube,
            drive_joint=self._angle_of(self.drive_joint_deg),
            lower_joint=self._angle_of(self.lower_joint_deg),
            mount_std=math.radians(self.mount_std_deg),
            scheme=Scheme[self.scheme.upper()],
            kernel=LIBRARY if self.compiled_by == "c" else self.kernel,
            stiffness=self.stiffness_nm,
            torsion=self.torsion,
            joints=self.joints,
            imus=self.imus.to_settings(),
            gyro_noise=None if self.gyro_noise is None else read_gyro_noise(self.gyro_noise),
        )

    def _angle_of(self, read_deg: float | None) -> MakeUpAngle:
        """Angle of a joint as it was read, or one that may be any where it was not."""
        from node.firmware.tube_settings import UNTOLD, MakeUpAngle

        return UNTOLD if read_deg is None else MakeUpAngle(math.radians(read_deg), math.radians(self.joint_std_deg))


SETTING_OPTIONS = (
    click.option("--tube", type=int, required=True, help="Number of the tube, 1 is the lowest."),
    click.option(
        "--drive-joint-deg",
        type=float,
        help="Angle read from the scribe marks, drive head to this tube. Without it the yaw below may be any.",
    ),
    click.option(
        "--lower-joint-deg",
        type=float,
        help="Angle read from the scribe marks, this tube to the one below. Without it the yaw below may be any.",
    ),
    click.option(
        "--joint-std-deg", type=float, default=0.05, show_default=True, help="Standard error of such a reading."
    ),
    click.option(
        "--mount-std-deg",
        type=float,
        default=0.05,
        show_default=True,
        help="Standard error of the IMU's mounting about the tube's axis.",
    ),
    click.option(
        "--kernel",
        type=click.Choice(["float64", "fixed"]),
        default="float64",
        show_default=True,
        help="Filter in floating point or in integers.",
    ),
    click.option(
        "--scheme",
        type=click.Choice(SCHEMES),
        default="forward",
        show_default=True,
        help="What is relayed down the string: the encoder's measurement, or (for comparison) the node's own estimate.",
    ),
    click.option(
        "--stiffness-nm",
        type=float,
        default=math.inf,
        help="Torsional stiffness of the tube, N m per rad; rigid if absent.",
    ),
    click.option(
        "--torsion",
        type=click.Choice(["gate", "variance"]),
        default="gate",
        show_default=True,
        help="Yaw from above while the string is under torque: ignored, or used with the variance of the twist.",
    ),
    click.option(
        "--joints",
        type=click.Choice(["marks", "solved", "both"]),
        default="marks",
        show_default=True,
        help="Source of the angle of a joint made up above: scribe marks, the node's saved yaw, or both.",
    ),
    click.option(
        "--imu",
        "sources",
        multiple=True,
        help="The node's own IMU: replay:FILE, timed:FILE, iio:NAME, vn100:DEVICE, mpu6500:BUS or mpu6500:BUS:ADDRESS. "
        "Repeat for several.",
    ),
    click.option(
        "--imu-noise",
        "noises",
        type=float,
        multiple=True,
        help="Noise of an IMU as a multiple of the default. Once for each IMU.",
    ),
    click.option(
        "--gyro-noise",
        type=FILE,
        help="File of borechain allan --out: noise of the gyroscopes at rest, and how long their biases last.",
    ),
    click.option(
        "--imu-offset-mm",
        "offsets",
        type=(float, float),
        multiple=True,
        help="Position of an IMU off the tube's axis, X Y. Once for each IMU.",
    ),
    click.option(
        "--imu-gyroscope",
        "gyroscopes",
        type=FILE,
        multiple=True,
        help="Calibration file of an IMU's gyroscope. Once for each IMU.",
    ),
    click.option(
        "--imu-accelerometer",
        "accelerometers",
        type=FILE,
        multiple=True,
        help="Calibration file of an IMU's accelerometer. Once for each IMU.",
    ),
)  # what the crew knows of a tube; the other options say where its node runs

compiler_option = click.option(
    "--compiled-by",
    type=click.Choice(["numba", "c"]),
    default="numba",
    show_default=True,
    help="Of the kernel fixed: numba in the process, or the C library made once by this machine's C compiler.",
)

tube_options = gather_options(
    *SETTING_OPTIONS,
    compiler_option,
    clock_option,
    above_option,
    below_option,
    upper_option,
    lower_option,
    key_option,
    keys_option,
    place_options,
    imus=ClusterRequest,
    request=TubeRequest,
    ends=EndsRequest,
    place=PlaceRequest,
)
