"""``borechain firmware codec``: the native profile of CAN in C, for a chip or for a tool of one's own."""

from __future__ import annotations

from pathlib import Path

import click

from borechain.cli.faults import plain_faults
from borechain.cli.whole_files import make_folder, write_whole


@click.command()
@click.option(
    "--out",
    type=click.Path(path_type=Path, file_okay=False),
    default=Path("firmware-build"),
    show_default=True,
    help="Folder of what is written.",
)
@plain_faults
def codec(out: Path) -> None:
    """Write the codec of the cyclic messages on CAN as C99, from the table that `link dbc` prints.

    \b
    Example:
      borechain firmware codec --out build
    """
    from telemetry.presentation.can_c_codec import NATIVE_CODE, NATIVE_HEADER, write_native_codec

    written = write_native_codec()
    make_folder(out)
    for name, text in ((NATIVE_HEADER, written.header), (NATIVE_CODE, written.code)):
        write_whole(out / name, text)
        click.echo(out / name)
    click.echo(f"table {written.digest}")
