"""``borechain firmware``: the step of a node in C, for a chip or for a compiler of one's own."""

from __future__ import annotations

from pathlib import Path

import click

from borechain.cli.faults import plain_faults
from borechain.cli.whole_files import make_folder

TARGETS = ("c", "cortex-m4", "cortex-m0plus", "riscv32")


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
@click.option(
    "--out",
    type=click.Path(path_type=Path, file_okay=False),
    default=Path("firmware-build"),
    show_default=True,
    help="Folder of what is built.",
)
@plain_faults
def build(target: str, imus: int, out: Path) -> None:
    """Write the integer step as one C99 file with its header, and compile it for a chip.

    \b
    Examples:
      borechain firmware build --out build
      borechain firmware build --target cortex-m4 --imus 1 --out build
    """
    from node.translation.firmware_build import FirmwareRequest, build_firmware

    make_folder(out)
    built = build_firmware(FirmwareRequest(target, imus, out))
    for path in built.files:
        click.echo(path)
    click.echo(f"source {built.digest}, {built.memory} bytes of records a node")
    if built.size is not None:
        click.echo(f"{built.size.flash} bytes of flash on {target}")
