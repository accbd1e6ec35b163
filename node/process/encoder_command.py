"""``borechain encoder`` and ``python -m node encoder``: the encoder node on the drive head."""

from __future__ import annotations

import click

from telemetry.runtime.command_line import plain_faults
from telemetry.runtime.process_options import (
    EndsRequest,
    PlaceRequest,
    above_option,
    below_option,
    clock_option,
    keys_option,
    lower_option,
    place_options,
    upper_option,
)
from telemetry.runtime.typed_options import gather_options

encoder_options = gather_options(
    click.option(
        "--counter",
        help="The encoder's own counter: counter:/dev/counter0, gpio:chip0:A,B, counter:FILE, replay:FILE, timed:FILE.",
    ),
    click.option(
        "--torque-nm",
        type=float,
        default=0.0,
        help="Drilling torque while no sensor measures it; 0: the string does not twist.",
    ),
    click.option(
        "--trapped-fraction",
        type=float,
        default=0.01,
        show_default=True,
        help="Share of the torque still in the string after a stop, standard deviation.",
    ),
    clock_option,
    above_option,
    below_option,
    upper_option,
    lower_option,
    keys_option,
    place_options,
    ends=EndsRequest,
    place=PlaceRequest,
)


@click.command()
@encoder_options
@plain_faults
def encoder(
    counter: str | None, torque_nm: float, trapped_fraction: float, ends: EndsRequest, place: PlaceRequest
) -> None:
    """Run the encoder node until it is stopped.

    \b
    Examples:
      borechain encoder --folder state/encoder
      borechain encoder --clock own --counter replay:counter.csv --above base --below 2
      borechain encoder --clock own --counter counter:/dev/counter0 --above base --lower can:can0
    """
    from node.firmware.torque import TorqueSettings
    from node.process.drivers.choice import encoder_source
    from node.process.node_host import run_encoder
    from telemetry.messages import ENCODER

    own_time = ends.to_own_time(ENCODER, ("--counter", counter))
    torque = TorqueSettings(torque_nm, trapped_fraction)
    run_encoder(place.to_place(), encoder_source(counter) if counter else None, own_time, torque)
