"""``borechain node`` and ``python -m node``: what a tube's board runs."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Literal

import click

from node.process.cluster_options import imu_settings_of
from telemetry.runtime.command_line import check_installed, plain_faults
from telemetry.runtime.process_options import (
    above_option,
    below_option,
    clock_option,
    key_option,
    keys_option,
    lower_option,
    own_neighbours,
    place_options,
    upper_option,
)

FILE = click.Path(path_type=Path, dir_okay=False)
SCHEMES = ("forward", "estimate", "intersection")


@click.command()
@click.option("--tube", type=int, required=True, help="Number of the tube, 1 is the lowest.")
@click.option(
    "--drive-joint-deg", type=float, default=0.0, help="Angle read from the scribe marks, drive head to this tube."
)
@click.option(
    "--lower-joint-deg", type=float, default=0.0, help="Angle read from the scribe marks, this tube to the one below."
)
@click.option("--joint-std-deg", type=float, default=0.05, show_default=True, help="Standard error of such a reading.")
@click.option(
    "--mount-std-deg",
    type=float,
    default=0.05,
    show_default=True,
    help="Standard error of the IMU's mounting about the tube's axis.",
)
@click.option(
    "--kernel",
    type=click.Choice(["float64", "fixed"]),
    default="float64",
    show_default=True,
    help="Filter in floating point or in integers.",
)
@click.option(
    "--scheme",
    type=click.Choice(SCHEMES),
    default="forward",
    show_default=True,
    help="What is relayed down the string: the encoder's measurement, or (for comparison) the node's own estimate.",
)
@click.option(
    "--stiffness-nm",
    type=float,
    default=math.inf,
    help="Torsional stiffness of the tube, N m per rad; rigid if absent.",
)
@click.option(
    "--torsion",
    type=click.Choice(["gate", "variance"]),
    default="gate",
    show_default=True,
    help="Yaw from above while the string is under torque: ignored, or used with the variance of the twist.",
)
@click.option(
    "--joints",
    type=click.Choice(["marks", "solved", "both"]),
    default="marks",
    show_default=True,
    help="Source of the angle of a joint made up above: scribe marks, the node's saved yaw, or both.",
)
@click.option(
    "--imu",
    "sources",
    multiple=True,
    help="The node's own IMU: replay:FILE, timed:FILE, mpu6500:BUS or mpu6500:BUS:ADDRESS. Repeat for several.",
)
@click.option(
    "--imu-noise",
    "noises",
    type=float,
    multiple=True,
    help="Noise of an IMU as a multiple of the default. Once for each IMU.",
)
@click.option(
    "--imu-offset-mm",
    "offsets",
    type=(float, float),
    multiple=True,
    help="Position of an IMU off the tube's axis, X Y. Once for each IMU.",
)
@click.option(
    "--imu-gyroscope",
    "gyroscopes",
    type=FILE,
    multiple=True,
    help="Calibration file of an IMU's gyroscope. Once for each IMU.",
)
@click.option(
    "--imu-accelerometer",
    "accelerometers",
    type=FILE,
    multiple=True,
    help="Calibration file of an IMU's accelerometer. Once for each IMU.",
)
@clock_option
@above_option
@below_option
@upper_option
@lower_option
@key_option
@keys_option
@place_options
@plain_faults
def node(
    tube: int,
    drive_joint_deg: float,
    lower_joint_deg: float,
    joint_std_deg: float,
    mount_std_deg: float,
    kernel: Literal["float64", "fixed"],
    scheme: str,
    stiffness_nm: float,
    torsion: Literal["gate", "variance"],
    joints: Literal["marks", "solved", "both"],
    sources: tuple[str, ...],
    noises: tuple[float, ...],
    offsets: tuple[tuple[float, float], ...],
    gyroscopes: tuple[Path, ...],
    accelerometers: tuple[Path, ...],
    clock: str,
    above: int | None,
    below: int | None,
    upper: str | None,
    lower: str | None,
    key_file: Path | None,
    keys_place: Path | None,
    rig_name: str,
    endpoint: str,
    folder: Path,
) -> None:
    """Run the node of one tube until it is stopped.

    \b
    Examples:
      borechain node --tube 1 --drive-joint-deg 12.5 --folder state/tube-1
      borechain node --tube 1 --imu mpu6500:1:0x68 --imu mpu6500:1:0x69
      borechain node --tube 1 --clock own --imu mpu6500:1 --above 2 --folder state/tube-1
      borechain node --tube 2 --clock own --imu mpu6500:1 --upper can:can0 --lower can:can1
    """
    from node.firmware.tube_settings import MakeUpAngle, TubeSettings
    from node.kernels.record.filter_record import Scheme
    from node.process.drivers.choice import imu_source
    from node.process.node_host import run_node
    from telemetry.messages import Side
    from telemetry.runtime.hosting import OwnTime, Place, chosen_media

    if any(source.startswith("mpu6500") for source in sources):
        check_installed("smbus2")
    joint_std = math.radians(joint_std_deg)
    settings = TubeSettings(
        tube=tube,
        drive_joint=MakeUpAngle(math.radians(drive_joint_deg), joint_std),
        lower_joint=MakeUpAngle(math.radians(lower_joint_deg), joint_std),
        mount_std=math.radians(mount_std_deg),
        scheme=Scheme[scheme.upper()],
        kernel=kernel,
        stiffness=stiffness_nm,
        torsion=torsion,
        joints=joints,
        imus=imu_settings_of(len(sources), noises, offsets, gyroscopes, accelerometers),
    )
    media = {Side.UPPER: upper, Side.LOWER: lower}
    neighbours = own_neighbours(clock, tube, ("--imu", sources), {Side.UPPER: above, Side.LOWER: below}, media)
    own_time = None if neighbours is None else OwnTime(neighbours)
    place = Place(rig_name, endpoint, folder, key_file, chosen_media(media), keys=keys_place)
    run_node(place, settings, [imu_source(s) for s in sources], own_time)
