"""``borechain rig``: a whole rig in real processes."""

from __future__ import annotations

import contextlib
import json
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from borechain.cli.faults import EnvironmentFault, InputFault, plain_faults, require_modules
from borechain.cli.notices import warnings_in_lines
from borechain.cli.rig.drilling_bar import progress
from borechain.cli.rig.ground_settings import ground_settings
from borechain.cli.rig.rig_result import (
    ASKED,
    ask_surveys,
    get_json,
    missing_surveys_line,
    result_of,
    selector_of,
    show_result,
)
from borechain.cli.shared_options import fault_option, json_option, scenario_argument, seed_option, speed_option
from borechain.crew.log import RunLog
from groundstation.page_options import page_options, page_settings
from telemetry import keys
from telemetry.runtime.process_options import insecure_option, keys_option, secure_endpoint

if TYPE_CHECKING:
    from groundstation.gateway.page.page_settings import PageSettings
    from sim.rig.launcher import Tick
    from sim.rig.processes import ProcessTable
    from sim.rig.scheduler import RigProgress
    from sim.rig.stepper import Acted
    from sim.rig.transports import Transports
    from sim.world.world import World
    from telemetry.media.zenoh_bus import ZenohBus

PRELOAD = {"float64": "borechain.preload", "fixed": "borechain.preload_all"}  # by kernel


@click.command()
@scenario_argument
@speed_option
@seed_option
@fault_option
@click.option("--inline", is_flag=True, help="Run it all in this one process, without a bus: same result, less CPU.")
@click.option(
    "--transport",
    type=click.Choice(["zenoh", "can", "can-classic", "mixed", "can-native"]),
    help="Medium of the joints: mixed has the first three in turn, can-native rounds as the native profile does and "
    "needs --inline  [default: as the scenario says]",
)
@click.option(
    "--rig", "rig_name", default=keys.DEFAULT_RIG, show_default=True, help="Name of the rig in key expressions."
)
@insecure_option
@click.option(
    "--endpoint",
    default=keys.DEFAULT_ENDPOINT,
    show_default=True,
    callback=secure_endpoint,
    help="Where the rig's router listens.",
)
@keys_option
@click.option(
    "--out", type=click.Path(path_type=Path), help="New or empty folder for the run  [default: out/NAME/run-NNNN]"
)
@click.option(
    "--view",
    type=click.Choice(["crew", "bar", "log"]),
    help="What is shown meanwhile: the crew's screen, a bar, or a line for whatever happens  "
    "[default: crew on a terminal, bar there with --inline, log into a file and with --page]",
)
@page_options
@json_option
@require_modules("orjson", "rich", "scipy", "sqlalchemy")
@plain_faults
def rig(
    scenario: Path,
    speed: float,
    seed: int,
    faults: tuple[str, ...],
    inline: bool,
    transport: str | None,
    rig_name: str,
    endpoint: str,
    keys_place: Path | None,
    out: Path | None,
    view: str | None,
    page: str | None,
    page_tls: tuple[Path, Path] | None,
    page_passwords: Path | None,
    as_json: bool,
) -> None:
    """Drill SCENARIO tube by tube with one real process a tube, and show what the ground station makes of it.

    \b
    Examples:
      borechain rig wellbore-1
      borechain rig wellbore-1 --speed 1 --fault kill-node:3@900
      borechain rig rig-3 --transport can
      borechain rig rig-3 --keys stick
      borechain rig wellbore-1 --speed 5 --page 127.0.0.1:8080
      borechain rig three-holes --inline --view log
    """
    from borechain.cli.rig.site import drill_site, has_site
    from borechain.rig_host import opened_router
    from sim.rig.launcher import check_port_free
    from sim.world.shipped import find_scenario

    find_scenario(scenario)  # a wrong name is reported first: its user may well have a rig running
    if inline != (transport == "can-native") and transport is not None:
        raise InputFault(
            f"--transport {transport}: expected {'real processes' if inline else '--inline'} with it; "
            "one process has no bus, and steps know no frames without ISO-TP"
        )
    served = page_settings(page, page_tls, page_passwords)
    if served is not None:
        check_page(served, inline=inline)
    if not inline:
        check_port_free(endpoint)
    on_terminal = sys.stdout.isatty() and served is None  # with a page open no second screen is needed
    view = chosen_view(view, inline=inline, quiet=as_json, on_terminal=on_terminal)
    if view == "crew":
        from borechain.cli.rig.on_screen import drill_on_screen

        drill_on_screen(sys.argv[1:], rig_name, endpoint, keys_place)
        return
    job = RigJob(scenario, seed, speed, faults, transport, rig_name, endpoint, keys_place)
    # other processes can join while the scenario is read and the kernels are loaded
    with contextlib.nullcontext() if inline else opened_router(endpoint, keys_place) as bus:
        log = RunLog(print_line) if view == "log" else None
        run = drill_site if has_site(job) else drill_job
        result, folder = run(job, bus, out, served, log, quiet=view != "bar")
    if as_json:
        click.echo(json.dumps(result))
    else:
        show_result(result, folder)
    if result["missing"]:
        raise EnvironmentFault(missing_surveys_line(result["missing"], result["measurements"], folder))


@dataclass(frozen=True, slots=True)
class RigJob:
    """What is to be drilled, how, and where its keys are."""

    scenario: Path
    seed: int
    speed: float
    faults: tuple[str, ...] = ()
    transport: str | None = None
    rig_name: str = keys.DEFAULT_RIG
    endpoint: str = keys.DEFAULT_ENDPOINT
    keys_place: Path | None = None
    wall: Path | None = None  # wall file of which the hole is a column
    hole: str = ""  # of the scenario's site


def drill_job(
    job: RigJob, bus: ZenohBus | None, out: Path | None, page: PageSettings | None, log: RunLog | None, *, quiet: bool
) -> tuple[dict[str, Any], Path]:
    """Drill with processes that meet at ``bus``, or without it in this process; result and folder.

    Raises
    ------
    InputFault, ScenarioError
        When the scenario cannot be drilled; nothing was written.
    EnvironmentFault, RigError
        When the folder cannot be used, a process fails, or on Ctrl-C.
    """
    from borechain.client import Ground
    from sim.rig.launcher import next_run_folder, prepare_folder
    from sim.rig.report import write_files

    started = time.monotonic()
    world = world_of(job)
    folder = out if out is not None else next_run_folder(Path("out") / job.scenario.stem)
    prepare_folder(folder)
    if log is not None and bus is not None:  # nothing is refused any more
        log.join(job.endpoint, job.rig_name, Ground(bus, job.rig_name))
    if page is not None:
        page = page_with_password(page)
    try:
        with progress(world, quiet=quiet) as show:
            if bus is None:
                native = job.transport == "can-native"
                ran = drill_inline(world, job, folder, show, log, native=native)
            else:
                ran = drill_in_processes(world, job, bus, show, log, partial(process_table, world, job, folder, page))
    except KeyboardInterrupt:
        raise EnvironmentFault(f"interrupted; every process was ended, what was stored is in {folder}") from None
    result = result_of(ran.answers, world)
    result |= {"processes": ran.processes, "wall_s": round(time.monotonic() - started, 3), "restarts": ran.restarts}
    write_files(folder, result)
    return result, folder


def world_of(job: RigJob) -> World:
    """World of a job, with what is odd about its scenario told in lines; errors as ``drill_job``."""
    from sim.world.scenario import load_scenario
    from sim.world.world import World

    with warnings_in_lines():
        scenario = load_scenario(job.scenario, job.faults)
        world = World(scenario.drilling(job.hole) if job.hole else scenario, job.seed)
    if world.scenario.medium.link == "off":
        raise InputFault(f'{job.scenario}: medium.link: expected "on" for a rig; only studies run without a link')
    return world


def check_page(page: PageSettings, *, inline: bool) -> None:
    """Refuse a page that cannot be served before anything is made.

    Raises
    ------
    InputFault
        With ``--inline``, which answers no queries.
    PageError
        When its port is taken.
    """
    from groundstation.gateway.page.page_settings import open_page_socket

    if inline:
        raise InputFault("--page: expected a rig of processes with it; nothing can be asked with --inline")
    open_page_socket(page).close()


def page_with_password(page: PageSettings) -> PageSettings:
    """Page of a simulated rig that accepts orders: a random password is made and printed where none is set."""
    if page.passwords:
        return page
    from groundstation.gateway.page.passwords import DRILLER, drawn_password, hash_of

    password = drawn_password()
    click.echo(f"page {page.url}; sign in as {DRILLER} with the password {password}", err=True)
    return replace(page, passwords={DRILLER: hash_of(password)})


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


@dataclass(frozen=True, slots=True)
class Ran:
    """A rig that has finished: what its ground station answered, and what ran."""

    answers: dict[str, Any]
    processes: int
    restarts: int


def drill_in_processes(
    world: World,
    job: RigJob,
    bus: ZenohBus,
    show: Callable[[Tick | RigProgress], None],
    log: RunLog | None,
    table_of: Callable[[Transports, Path], ProcessTable],
) -> Ran:
    """Drill with one real process a tube, beside a hub of CAN segments where a joint is on CAN."""
    from sim.rig.launcher import Launcher
    from sim.rig.transports import open_transports

    with (
        open_transports(job.transport, world.scenario.medium.transports) as transports,
        tempfile.TemporaryDirectory(prefix="borechain-") as steps,  # a socket's path must be short
    ):
        table = table_of(transports, Path(steps) / "steps")

        def follow(tick: Tick) -> None:
            show(tick)
            if log is not None:
                log.on_tick(tick, table.restarts)

        launcher = Launcher(table, bus, job.rig_name, follow, operator_of(world, job.rig_name))

        def finish(bus: ZenohBus) -> dict[str, Any]:
            if log is not None:
                log.poll(lambda path, parameters: get_json(bus, selector_of(job.rig_name, path, parameters)), since=0)
            return ask_surveys(bus, job.rig_name)

        answers = launcher.run(finish)
        return Ran(answers, len(table.specs), sum(table.restarts.values()))


def drill_inline(
    world: World,
    job: RigJob,
    folder: Path,
    show: Callable[[Tick | RigProgress], None],
    log: RunLog | None = None,
    *,
    native: bool = False,
) -> Ran:
    """Drill with objects in this process."""
    from borechain.inline import InlineRig

    rig = InlineRig(world, settings_of(world, job), job.rig_name, folder, native=native, keys=job.keys_place)

    def follow(progress: RigProgress) -> None:
        show(progress)
        if log is not None and log.on_tick(progress, {}) and rig.is_begun:
            log.poll(rig.ask)

    rig.run(follow, job.speed)
    try:
        return Ran({path: rig.ask(path) for path in ASKED}, 1, 0)
    finally:
        rig.close()


def process_table(
    world: World, job: RigJob, folder: Path, page: PageSettings | None, transports: Transports, steps: Path
) -> ProcessTable:
    """Every process of the rig, one line each; ``steps`` is the socket at which they meet their stepper."""
    from borechain.rig_host import run_medium
    from groundstation.ground_host import run_ground
    from node.process.node_host import run_encoder, run_node
    from sim.rig.launcher import private_folder
    from sim.rig.processes import ProcessTable, Spec
    from telemetry.messages import BASE, ENCODER
    from telemetry.runtime.hosting import Place
    from telemetry.transport.authentication import new_key

    key_file = new_key(folder / "rig.key") if job.keys_place is None else None

    def place(name: str, address: int = BASE) -> Place:
        media = transports.media_of(address)
        home = private_folder(folder, name)
        return Place(job.rig_name, job.endpoint, home, key_file, media, steps, job.keys_place)

    specs = {
        "medium": Spec(
            run_medium,
            (place("medium"), job.scenario, job.seed, job.speed, job.faults, False, True, transports, job.hole),
        ),
        "encoder": Spec(run_encoder, (place("encoder", ENCODER), None, None, world.torque_settings(), world.reach)),
        "base": Spec(partial(run_ground, page=page), (place("ground"), settings_of(world, job))),
    }
    for tube in range(1, world.scenario.tubes + 1):
        specs[str(tube)] = Spec(run_node, (place(f"tube-{tube}", tube), world.tube_settings(tube)))
    return ProcessTable(specs, [PRELOAD[world.scenario.file.node.kernel]])


def operator_of(world: World, rig_name: str) -> Callable[[ZenohBus, str], Acted]:
    """Who steps the calibration in the field, where the scenario has one."""
    from sim.rig.rack_operator import BusGroundClient, RackOperator
    from sim.rig.stepper import Acted

    if world.rack is None:
        return lambda _bus, _cue: Acted.DONE
    operator = RackOperator(world.rack, world.scenario.tubes)
    return lambda bus, cue: operator.act_on_cue(BusGroundClient(bus, rig_name), cue)


def settings_of(world: World, job: RigJob) -> dict[str, Any]:
    """Settings of the ground station, with the wall of which the hole is a column."""
    return ground_settings(world) | ({"wall": job.wall, "hole": job.hole} if job.wall is not None else {})
