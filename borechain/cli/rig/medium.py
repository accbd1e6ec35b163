"""``borechain medium``: world, joints and clock of a scenario."""

from __future__ import annotations

from pathlib import Path

import click

from borechain.cli.faults import plain_faults, require_modules
from borechain.cli.shared_options import fault_option, scenario_argument, seed_option, speed_option
from telemetry.runtime.process_options import PlaceRequest, keys_option, place_options
from telemetry.runtime.typed_options import gather_options


@click.command()
@gather_options(
    scenario_argument,
    seed_option,
    speed_option,
    fault_option,
    click.option("--router/--no-router", default=False, help="Be the router of this rig, instead of joining one."),
    keys_option,
    place_options,
    place=PlaceRequest,
)
@require_modules("scipy")
@plain_faults
def medium(scenario: Path, seed: int, speed: float, faults: tuple[str, ...], router: bool, place: PlaceRequest) -> None:
    """Run the world of a scenario for processes that join by their own commands.

    \b
    Example:
      borechain medium compose-2 --speed 1
    """
    from borechain.drilling.rig_host import run_medium

    run_medium(place.to_place(), scenario, seed, speed, faults, router)
