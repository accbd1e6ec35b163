"""``borechain link chip``: a chip on a serial line as one end of a CAN joint."""

from __future__ import annotations

import contextlib
from pathlib import Path

import click

from borechain.cli.faults import EnvironmentFault, InputFault, plain_faults


@click.command()
@click.option(
    "--line",
    type=click.Path(path_type=Path),
    required=True,
    help="Serial line or pseudo terminal of the chip, such as /dev/ttyACM0.",
)
@click.option(
    "--bus",
    required=True,
    metavar="CHANNEL[,SETTING]...",
    help="Segment, as behind `can:` of a port, such as can0 or 7800/any,interface=borechain_loopback.",
)
@click.option(
    "--speed",
    type=click.Choice(["9600", "115200", "230400", "460800", "921600", "1000000", "2000000", "3000000"]),
    default="1000000",
    show_default=True,
    help="Of the line, baud.",
)
@plain_faults
def chip(line: Path, bus: str, speed: str) -> None:
    """Put a chip that speaks SLCAN on its serial line onto a CAN segment, as its controller.

    Runs until it is interrupted, or the chip or the bus is gone.

    \b
    Examples:
      borechain link chip --line /dev/ttyACM0 --bus can0
      borechain link chip --line /dev/pts/5 --bus 7800/rig-3/2-3,interface=borechain_loopback
    """
    from telemetry.errors import MediumError
    from telemetry.media.can_loopback import register_loopback
    from telemetry.media.can_medium import FRAMES, CanSettings
    from telemetry.media.can_port import open_controller
    from telemetry.media.can_timing import FD_LARGEST
    from telemetry.media.chip_bridge import ChipBridge
    from telemetry.media.serial_line import SerialLine

    register_loopback()
    try:
        settings = CanSettings.parse(bus)
    except MediumError as error:
        raise InputFault(f"--bus: {error}") from error
    is_fd = FRAMES[settings.frames] == FD_LARGEST
    with contextlib.ExitStack() as stack:
        try:
            serial = SerialLine(line, int(speed))
            stack.callback(serial.close)
            controller = open_controller(lambda: settings.open_bus("chip"), settings.channel, is_fd, None)
            stack.callback(controller.shutdown)
            click.echo(f"chip at {line}, segment {settings.channel}", err=True)
            bridge = ChipBridge(serial, controller, fd=is_fd, tell=lambda said: click.echo(f"chip: {said}", err=True))
            stack.callback(lambda: click.echo(show_counts(bridge.counters), err=True))
            bridge.run()
        except MediumError as error:
            raise EnvironmentFault(str(error)) from error


def show_counts(counters: dict[str, int]) -> str:
    """What was carried and what went wrong, in a line."""
    return "carried: " + (", ".join(f"{name} {count}" for name, count in sorted(counters.items())) or "nothing")
