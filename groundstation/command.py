"""``borechain ground`` and ``python -m groundstation``: the ground station of one rig."""

from __future__ import annotations

import click

from groundstation.ground_options import GroundRequest, ground_options
from groundstation.page_options import PageRequest, page_settings
from groundstation.plan_settings import plan_warnings
from telemetry.runtime.command_line import plain_faults, require_modules
from telemetry.runtime.process_options import PlaceRequest


@click.command()
@ground_options
@require_modules("orjson", "scipy", "sqlalchemy")
@plain_faults
def ground(request: GroundRequest, place: PlaceRequest, served: PageRequest, clock: str) -> None:
    """Run the ground station of one rig.

    \b
    Examples:
      borechain ground --folder state/ground --tube-length-m 2
      borechain ground --page 127.0.0.1:8080 --page-passwords passwords
    """
    from groundstation.ground_host import run_ground

    own_clock, page, settings = clock == "own", page_settings(served), request.to_settings()
    for warning in plan_warnings(settings["plan"]):
        click.echo(f"WARNING ({warning.kind}): {request.plan}: {warning.text}", err=True)
    run_ground(place.to_place(), settings, own_clock=own_clock, page=page)
