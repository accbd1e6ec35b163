"""``borechain encoder`` and ``python -m node encoder``: the encoder node on the drive head."""

from __future__ import annotations

from pathlib import Path

import click

from telemetry.runtime.command_line import plain_faults
from telemetry.runtime.process_options import (
    above_option,
    below_option,
    clock_option,
    keys_option,
    lower_option,
    own_neighbours,
    place_options,
    upper_option,
)


@click.command()
@click.option("--counter", help="The encoder's own counter: counter:FILE, replay:FILE or timed:FILE.")
@click.option(
    "--torque-nm",
    type=float,
    default=0.0,
    help="Drilling torque while no sensor measures it; 0: the string does not twist.",
)
@click.option(
    "--trapped-fraction",
    type=float,
    default=0.01,
    show_default=True,
    help="Share of the torque still in the string after a stop, standard deviation.",
)
@clock_option
@above_option
@below_option
@upper_option
@lower_option
@keys_option
@place_options
@plain_faults
def encoder(
    counter: str | None,
    torque_nm: float,
    trapped_fraction: float,
    clock: str,
    above: int | None,
    below: int | None,
    upper: str | None,
    lower: str | None,
    keys_place: Path | None,
    rig_name: str,
    endpoint: str,
    folder: Path,
) -> None:
    """Run the encoder node until it is stopped.

    \b
    Examples:
      borechain encoder --folder state/encoder
      borechain encoder --clock own --counter replay:counter.csv --above base --below 2
      borechain encoder --clock own --counter counter:/dev/encoder --above base --lower can:can0
    """
    from node.firmware.torque import TorqueSettings
    from node.process.drivers.choice import encoder_source
    from node.process.node_host import run_encoder
    from telemetry.messages import ENCODER, Side
    from telemetry.runtime.hosting import OwnTime, Place, chosen_media

    media = {Side.UPPER: upper, Side.LOWER: lower}
    neighbours = own_neighbours(clock, ENCODER, ("--counter", counter), {Side.UPPER: above, Side.LOWER: below}, media)
    own_time = None if neighbours is None else OwnTime(neighbours)
    torque = TorqueSettings(torque_nm, trapped_fraction)
    place = Place(rig_name, endpoint, folder, media=chosen_media(media), keys=keys_place)
    run_encoder(place, encoder_source(counter) if counter else None, own_time, torque)
