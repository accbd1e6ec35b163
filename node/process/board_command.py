"""``borechain board check``: what of a board is as it should be, before it goes into a tube."""

from __future__ import annotations

import datetime
import json
import select
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from telemetry.runtime.command_line import check_installed, plain_faults
from telemetry.runtime.typed_options import gather_options

if TYPE_CHECKING:
    from node.process.board_findings import BoardFinding
    from telemetry.records.noise_file import GyroNoise

NOT_GOOD = 1  # exit status
LOOK_S = 0.1  # from one reading of the count to the next while the head is turned by hand


@dataclass(frozen=True, slots=True)
class BoardRequest:
    """The parts of a board that are checked: what has an option, and what every board has."""

    tube: int
    imus: tuple[str, ...]
    gyro_noise: Path | None
    counter: str | None
    turn_deg: float | None
    interfaces: tuple[str, ...]
    is_classic: bool
    folder: Path
    keys_place: Path | None

    def findings(self) -> list[BoardFinding]:
        """A line of every part, in the order of the options."""
        from node.kernels.arithmetic.jit import folder_in_use
        from node.process import board_places as places
        from telemetry.records.noise_file import read_gyro_noise

        now = datetime.datetime.now(datetime.UTC)
        known = None if self.gyro_noise is None else read_gyro_noise(self.gyro_noise)
        found = [line for text in self.imus for line in imu_findings(text, known)]
        if self.counter is not None:
            found += encoder_findings(self.counter, self.turn_deg)
        found += [places.check_can(f"can {name}", name, is_fd=not self.is_classic) for name in self.interfaces]
        found += [places.check_clock(now), places.check_disk(self.folder)]
        if self.keys_place is not None:
            found.append(places.check_keys(self.keys_place, self.tube, now))
        return [*found, places.check_kernels(folder_in_use())]


def imu_findings(text: str, known: GyroNoise | None) -> list[BoardFinding]:
    """Findings of one IMU by its name, with the noise of its record where there is one."""
    from node.process.board_sensors import check_imu
    from node.process.drivers.choice import imu_source
    from node.process.drivers.mpu_chips import CHIPS

    if text.partition(":")[0] in CHIPS:
        check_installed("smbus2")
    source = imu_source(text)
    try:
        return check_imu(source, known)
    finally:
        source.close()


def encoder_findings(text: str, turn_deg: float | None) -> list[BoardFinding]:
    """Findings of the encoder by its name."""
    from node.process.board_sensors import check_encoder
    from node.process.drivers.choice import encoder_source

    source = encoder_source(text)
    try:
        if turn_deg is None:
            return check_encoder(source)
        click.echo(f"turn the head by {turn_deg:g} deg, then press Enter", err=True)
        return check_encoder(source, turn_deg, is_turning=is_turning)
    finally:
        source.close()


def is_turning() -> bool:
    """Whether Enter has not been pressed yet, after a short wait for it; the end of the input counts as pressed."""
    ready, _, _ = select.select([sys.stdin], [], [], LOOK_S)
    return not ready


@click.group()
def board() -> None:
    """Look at the board that this runs on.

    \b
    Examples:
      borechain board check --tube 7 --imu mpu6500:1 --can can0 --can can1
    """


@board.command("check")
@gather_options(
    click.option("--tube", type=int, default=0, show_default=True, help="Number of its tube; 0 is the encoder."),
    click.option("--imu", "imus", multiple=True, help="Its IMU, as borechain node takes it. Repeat for several."),
    click.option(
        "--gyro-noise",
        type=click.Path(path_type=Path, dir_okay=False),
        help="File of borechain allan --out: its noise is judged beside that.",
    ),
    click.option("--counter", help="Its encoder, as borechain encoder takes it."),
    click.option("--turn-deg", type=float, help="Turn the head by this, forward, when asked: direction and count."),
    click.option("--can", "interfaces", multiple=True, help="A CAN interface, such as can0. Repeat for both."),
    click.option("--classic", "is_classic", is_flag=True, help="The controllers are classic ones (MCP2515), not FD."),
    click.option(
        "--folder",
        type=click.Path(path_type=Path, file_okay=False),
        default=Path("/var/lib/borechain"),
        show_default=True,
        help="Where its state is kept.",
    ),
    click.option("--keys", "keys_place", type=click.Path(path_type=Path), help="Its key file, or the folder of it."),
    request=BoardRequest,
)
@click.option("--json", "as_json", is_flag=True, help="One JSON object on one line.")
@plain_faults
def check_board(request: BoardRequest, as_json: bool) -> None:
    """Check sensor, encoder, CAN, clock, disk, keys and kernels, one line each; the sensor is at rest meanwhile.

    The exit status is 0 where every line is good, and 1 where one is not.

    \b
    Examples:
      borechain board check --tube 7 --imu mpu6500:1 --can can0 --can can1 --keys /etc/borechain/tube-7.keys
      borechain board check --counter gpio:chip0:17,27 --turn-deg 90 --can can0
    """
    found = request.findings()
    good = all(line.good for line in found)
    if as_json:
        click.echo(json.dumps({"good": good, "findings": [line.as_object() for line in found]}))
    else:
        for line in found:
            click.echo(f"{'good' if line.good else 'WRONG':5}  {line.part:12} {line.text}")
    sys.exit(0 if good else NOT_GOOD)
