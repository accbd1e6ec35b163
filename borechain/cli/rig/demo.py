"""``borechain demo``: a rig that drills, with its page, for a first look."""

from __future__ import annotations

import itertools
import tempfile
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import click

from borechain.cli.faults import plain_faults, require_modules
from borechain.cli.notices import print_notice
from borechain.cli.rig.compiling_bar import compile_for_rig
from borechain.cli.shared_options import parse_speed
from borechain.drilling.rig_job import RigJob, show_nothing
from groundstation.page_options import DEFAULT, PageRequest, page_settings
from telemetry import keys
from telemetry.runtime.process_options import insecure_option, secure_endpoint

if TYPE_CHECKING:
    from groundstation.gateway.page.page_settings import PageSettings
    from telemetry.media.zenoh_bus import ZenohBus

SCENARIO = Path("demo")


@click.command()
@insecure_option
@click.option("--page", metavar="HOST:PORT", default=DEFAULT, show_default=True, help="Where the page is served.")
@click.option(
    "--speed", default="10", show_default=True, callback=parse_speed, metavar="max|X", help="X times real time."
)
@click.option(
    "--endpoint",
    default=keys.DEFAULT_ENDPOINT,
    show_default=True,
    callback=secure_endpoint,
    help="Where the rig's router listens.",
)
@click.option("--rounds", type=click.IntRange(1), help="Holes to drill before it ends  [default: until Ctrl-C]")
@require_modules("orjson", "rich", "scipy", "sqlalchemy", "starlette", "uvicorn")
@plain_faults
def demo(page: str, speed: float, endpoint: str, rounds: int | None) -> None:
    """Drill a hole with fifteen real processes and show it on a page, again and again until Ctrl-C.

    Ten tubes are in the hole already; what it leaves goes when it ends.

    \b
    Examples:
      borechain demo
      borechain demo --speed 2 --page 127.0.0.1:8090
    """
    from borechain.drilling.drill_hole import page_with_password
    from borechain.drilling.rig_host import opened_router
    from groundstation.gateway.page.page_settings import open_page_socket
    from sim.rig.launcher import check_port_free
    from sim.world.shipped import find_scenario

    settings = page_settings(PageRequest(page))
    if settings is None:
        return
    open_page_socket(settings).close()
    check_port_free(endpoint)
    compile_for_rig(SCENARIO)
    served = page_with_password(settings, print_notice)
    click.echo(f"open {served.url} in a browser; Ctrl-C ends the demonstration")
    try:
        with opened_router(endpoint) as bus:
            for seed in itertools.count(1) if rounds is None else range(1, rounds + 1):
                with tempfile.TemporaryDirectory(prefix="borechain-demo-") as folder:
                    drill_demo_hole(
                        RigJob(find_scenario(SCENARIO), seed, speed, endpoint=endpoint), bus, served, Path(folder)
                    )
    except KeyboardInterrupt:
        click.echo("ended")


def drill_demo_hole(job: RigJob, bus: ZenohBus, page: PageSettings, folder: Path) -> None:
    """One hole."""
    from borechain.drilling.drill_hole import read_world
    from borechain.drilling.rig_processes import drill_in_processes, process_table

    world = read_world(job, print_notice)
    drill_in_processes(world, job, bus, show_nothing, None, partial(process_table, world, job, folder, page))
