"""``borechain node``: what a tube's board runs."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Literal

import click

from borechain.faults import plain_faults
from borechain.options import above_option, below_option, clock_option, key_option, own_neighbours, place_options


@click.command()
@click.option("--tube", type=int, required=True, help="Number of the tube, 1 is the lowest.")
@click.option("--drive-joint-deg", type=float, default=0.0, help="Scribe-mark reading, drive head to this tube.")
@click.option("--lower-joint-deg", type=float, default=0.0, help="Scribe-mark reading, this tube to the one below.")
@click.option("--joint-std-deg", type=float, default=0.05, show_default=True, help="Error of a reading, 1 sigma.")
@click.option("--mount-std-deg", type=float, default=0.05, show_default=True, help="Error of the IMU's mount, 1 sigma.")
@click.option("--kernel", type=click.Choice(["float64", "fixed"]), default="float64", show_default=True)
@click.option("--scheme", type=click.Choice(["forward", "estimate"]), default="forward", show_default=True)
@click.option("--imu", help="The node's own sensor: replay:FILE, timed:FILE, mpu6500:BUS or mpu6500:BUS:ADDRESS.")
@clock_option
@above_option
@below_option
@key_option
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
    imu: str | None,
    clock: str,
    above: int | None,
    below: int | None,
    key_file: Path | None,
    rig_name: str,
    endpoint: str,
    folder: Path,
) -> None:
    """Run the node of one tube until it is stopped.

    \b
    Examples:
      borechain node --tube 1 --drive-joint-deg 12.5 --folder state/tube-1
      borechain node --tube 1 --clock own --imu mpu6500:1 --above 2 --folder state/tube-1
    """
    from borechain.processes import OwnTime, Place, run_node
    from node.firmware.settings import Joint, TubeSettings
    from node.kernels.layout import Scheme
    from node.process.drivers.choice import imu_source
    from telemetry.messages import Side

    joint_std = math.radians(joint_std_deg)
    settings = TubeSettings(
        tube=tube,
        drive_joint=Joint(math.radians(drive_joint_deg), joint_std),
        lower_joint=Joint(math.radians(lower_joint_deg), joint_std),
        mount_std=math.radians(mount_std_deg),
        scheme=Scheme[scheme.upper()],
        kernel=kernel,
    )
    neighbours = own_neighbours(clock, tube, ("--imu", imu), {Side.UPPER: above, Side.LOWER: below})
    own_time = None if neighbours is None else OwnTime(neighbours)
    run_node(Place(rig_name, endpoint, folder, key_file), settings, imu_source(imu) if imu else None, own_time)
