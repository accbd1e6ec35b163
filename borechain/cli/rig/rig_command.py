"""``borechain rig``: a whole rig in real processes."""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path

import click

from borechain.cli.faults import EnvironmentFault, InputFault, plain_faults, require_modules
from borechain.cli.notices import print_notice
from borechain.cli.rig.compiling_bar import compile_for_rig
from borechain.cli.rig.drilling_bar import DrillingBar
from borechain.cli.rig.shown_result import show_result
from borechain.cli.shared_options import fault_option, json_option, scenario_argument, seed_option, speed_option
from borechain.crew.log import RunLog
from borechain.drilling.rig_job import RigJob, RigWatcher, no_progress
from groundstation.page_options import PageRequest, page_options, page_settings
from telemetry import keys
from telemetry.runtime.process_options import insecure_option, keys_option, secure_endpoint
from telemetry.runtime.typed_options import gather_options

rig_options = gather_options(
    scenario_argument,
    speed_option,
    seed_option,
    fault_option,
    click.option(
        "--inline", is_flag=True, help="Run it all in this one process, without a bus: same result, less CPU."
    ),
    click.option(
        "--chip",
        "chips",
        default="",
        metavar="all|N,N",
        help="Tubes whose node steps on an emulated Cortex-M4, in the integers of the kernel fixed (QEMU).",
    ),
    click.option(
        "--transport",
        type=click.Choice(["zenoh", "can", "can-classic", "mixed", "can-native"]),
        help="Medium of the joints: mixed has the first three in turn, can-native rounds as the native profile does "
        "and needs --inline  [default: as the scenario says]",
    ),
    click.option(
        "--rig", "rig_name", default=keys.DEFAULT_RIG, show_default=True, help="Name of the rig in key expressions."
    ),
    insecure_option,
    click.option(
        "--endpoint",
        default=keys.DEFAULT_ENDPOINT,
        show_default=True,
        callback=secure_endpoint,
        help="Where the rig's router listens.",
    ),
    keys_option,
    click.option(
        "--out", type=click.Path(path_type=Path), help="New or empty folder for the run  [default: out/NAME/run-NNNN]"
    ),
    click.option(
        "--view",
        type=click.Choice(["crew", "bar", "log"]),
        help="What is shown meanwhile: the crew's screen, a bar, or a line for whatever happens  "
        "[default: crew on a terminal, bar there with --inline, log into a file and with --page]",
    ),
    page_options,
    json_option,
    job=RigJob,
    page=PageRequest,
)


@click.command()
@rig_options
@require_modules("orjson", "rich", "scipy", "sqlalchemy")
@plain_faults
def rig(job: RigJob, page: PageRequest, view: str | None, as_json: bool) -> None:
    """Drill SCENARIO tube by tube with one real process a tube, and show what the ground station makes of it.

    \b
    Examples:
      borechain rig wellbore-1
      borechain rig wellbore-1 --speed 1 --fault kill-node:3@900
      borechain rig rig-3 --transport can
      borechain rig rig-3 --chip 2
      borechain rig rig-3 --keys stick
      borechain rig wellbore-1 --speed 5 --page 127.0.0.1:8080
      borechain rig three-holes --inline --view log
    """
    from borechain import api
    from sim.rig.rig_result import missing_surveys_line

    job = checked_job(job, page)
    on_terminal = sys.stdout.isatty() and job.served is None  # a page is looked at in place of a second screen
    compile_for_rig(job.scenario, job.chips)
    view = chosen_view(view, inline=job.inline, quiet=as_json, on_terminal=on_terminal)
    if view == "crew":
        from borechain.cli.rig.on_screen import drill_on_screen

        drill_on_screen(sys.argv[1:], job.rig_name, job.endpoint, job.keys_place)
        return
    drilled = api.drill_rig(job, watcher_of(view))
    result = drilled.result
    if as_json:
        click.echo(json.dumps(result))
    else:
        show_result(result, drilled.folder)
    if result["missing"]:
        raise EnvironmentFault(missing_surveys_line(result["missing"], result["measurements"], drilled.folder))


def checked_job(job: RigJob, page: PageRequest) -> RigJob:
    """The job with its page, when nothing in it contradicts itself, its folder is new and its addresses are free.

    Raises
    ------
    InputFault, ScenarioError
        Wrong options, or no scenario of that name.
    RigError, PageError
        A folder that is used, an address that is taken.
    """
    from groundstation.gateway.page.page_settings import open_page_socket
    from sim.rig.launcher import check_port_free, refuse_used_folder
    from sim.world.shipped import find_scenario

    find_scenario(job.scenario)  # a wrong name is told before a rig that is running already
    if job.out is not None:
        refuse_used_folder(job.out)  # and a folder before a minute of compiling
    if job.inline != (job.transport == "can-native") and job.transport is not None:
        raise InputFault(
            f"--transport {job.transport}: expected {'real processes' if job.inline else '--inline'} with it; "
            "one process has no bus, and steps know no frames without ISO-TP"
        )
    served = page_settings(page)
    if served is not None:
        if job.inline:
            raise InputFault("--page: expected a rig of processes with it; nothing can be asked with --inline")
        open_page_socket(served).close()
    if not job.inline:
        check_port_free(job.endpoint)
    return replace(job, served=served)


def watcher_of(view: str) -> RigWatcher:
    """What is shown while the rig drills."""
    return RigWatcher(
        progress=DrillingBar if view == "bar" else no_progress,
        log=RunLog(print_line) if view == "log" else None,
        say=print_notice,
    )


def chosen_view(view: str | None, *, inline: bool, quiet: bool, on_terminal: bool) -> str:
    """What is shown while a rig drills; nothing with ``quiet``.

    Raises
    ------
    InputFault
        When the crew's screen is asked for where nothing can be asked.
    """
    if quiet:
        return ""
    if view == "crew" and inline:
        raise InputFault("--view crew: expected a rig of processes with it; nothing can be asked with --inline")
    if view is not None:
        return view
    if not on_terminal:
        return "log"
    return "bar" if inline or find_spec("textual") is None else "crew"


def print_line(line: str) -> None:
    """Write a line and flush it, so that a follower of the file sees it at once."""
    click.echo(line)
    sys.stdout.flush()
