"""``borechain firmware``: the step of a node in C, for a chip or for a compiler of one's own."""

from __future__ import annotations

from pathlib import Path

import click

from borechain.cli.faults import plain_faults
from borechain.cli.firmware.codec_command import codec
from borechain.cli.whole_files import make_folder
from node.process.cluster_options import ClusterRequest
from node.process.tube_options import SETTING_OPTIONS, TubeRequest
from telemetry.runtime.typed_options import gather_options

TARGETS = ("c", "cortex-m4", "cortex-m0plus", "riscv32")
out_option = click.option(
    "--out",
    type=click.Path(path_type=Path, file_okay=False),
    default=Path("firmware-build"),
    show_default=True,
    help="Folder of what is written.",
)


@click.group()
def firmware() -> None:
    """The step of a node for a chip: the same integers as those of `--kernel fixed`, in C.

    \b
    Example:
      borechain firmware build --target cortex-m4 --imus 1 --out build
    """


@firmware.command()
@click.option(
    "--target", type=click.Choice(TARGETS), default="c", show_default=True, help="Chip; c: the source alone, for any."
)
@click.option("--imus", type=click.IntRange(1, 8), default=8, show_default=True, help="Most IMUs of a node.")
@out_option
@plain_faults
def build(target: str, imus: int, out: Path) -> None:
    """Write the integer step as one C99 file with its header, and compile it for a chip.

    \b
    Examples:
      borechain firmware build --out build
      borechain firmware build --target cortex-m4 --imus 1 --out build
    """
    from node.firmware.event_words import EVENTS_HEADER, write_event_table
    from node.translation.firmware_build import FirmwareRequest, build_firmware

    make_folder(out)
    built = build_firmware(FirmwareRequest(target, imus, out))
    events = out / EVENTS_HEADER
    events.write_text(write_event_table(), encoding="utf-8")
    for path in (*built.files, events):
        click.echo(path)
    click.echo(f"source {built.digest}, {built.memory} bytes of records a node")
    if built.size is not None:
        click.echo(f"{built.size.flash} bytes of flash on {target}")


@firmware.command()
@gather_options(*SETTING_OPTIONS, imus=ClusterRequest, request=TubeRequest)
@click.option(
    "--room", type=click.IntRange(1, 8), default=8, show_default=True, help="IMUs that the chip's program has room for."
)
@click.option(
    "--keys",
    "keys_place",
    type=click.Path(path_type=Path, exists=True),
    help="Keys that borechain pki made: the tube's file, or the folder that it lies in; a page of them for the flash.",
)
@out_option
@plain_faults
def provision(request: TubeRequest, room: int, keys_place: Path | None, out: Path) -> None:
    """Write what a tube's chip begins with, as an image for a page of its flash, and the header that loads it.

    The options are those of `borechain node`, and --room is the --imus of `borechain firmware build`.

    \b
    Examples:
      borechain firmware provision --tube 3 --drive-joint-deg 12.5 --lower-joint-deg 4.0 --out tube-3
      borechain firmware provision --tube 3 --imu-gyroscope gyroscope.json --room 1 --out tube-3
      borechain firmware provision --tube 3 --keys stick --out tube-3
    """
    from node.firmware.node_image import provision_node
    from node.process.key_page import write_key_page

    settings = request.to_settings()
    make_folder(out)
    made = provision_node(settings, room, out)
    pages = [] if keys_place is None else [write_key_page(keys_place, settings.tube, out)]
    for path in (*made.files, *pages):
        click.echo(path)
    click.echo(f"tube {settings.tube}, source {made.digest}, {made.size} bytes")


firmware.add_command(codec)
