"""``borechain merge``: one database of two that parted."""

from __future__ import annotations

from pathlib import Path

import click

from borechain.cli.faults import plain_faults
from borechain.cli.notices import print_notice

SHOWN = 5
folder_type = click.Path(path_type=Path, file_okay=False, exists=True)


@click.command()
@click.argument("first", type=folder_type)
@click.argument("second", type=folder_type)
@click.option("--into", type=click.Path(path_type=Path, file_okay=False), required=True, help="New folder.")
@plain_faults
def merge(first: Path, second: Path, into: Path) -> None:
    """Merge the databases of two ground stations that were at work on one rig, after their ends.

    FIRST and SECOND are their folders, which stay as they are. Surveys and events are numbered, so what both have is
    there once; order of the tubes, joints and setup are those of FIRST. Start the ground station on the new folder.

    \b
    Example:
      borechain merge /var/lib/borechain-a /var/lib/borechain-b --into /var/lib/borechain
    """
    from groundstation.service.disk.merged_database import merge_databases

    done = merge_databases(first, second, into)
    if done.damaged:
        print_notice(f"{done.damaged} rows are damaged and were left out; the tubes are asked for lost messages again")
    if done.twice:
        named = ", ".join(f"number {number} of tube {tube}" for tube, number in done.twice[:SHOWN])
        told = f"{len(done.twice)} numbers have two contents, both are kept: {named}"
        print_notice(f"{told}; are there two tubes of one number?")
    click.echo(
        f"{into}: {done.shared} messages of both, {done.first_alone} of {first} alone, "
        f"{done.second_alone} of {second} alone; {done.stands} stands of the bit more"
    )
