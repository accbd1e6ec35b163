"""A rig of real processes: the table of what runs, and its drilling beside a hub of CAN segments."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from borechain.crew.log import RunLog
from borechain.drilling.rig_host import run_medium
from borechain.drilling.rig_job import RigJob, RigRun, ShowProgress
from groundstation.gateway.page.page_settings import PageSettings
from groundstation.ground_host import run_ground
from node.process.node_host import run_encoder, run_node
from sim.rig.ground_answers import ask_surveys, get_json, selector_of
from sim.rig.ground_settings import ground_settings
from sim.rig.launcher import Launcher, Tick, private_folder
from sim.rig.processes import ProcessTable, Spec
from sim.rig.rack_operator import BusGroundClient, RackOperator
from sim.rig.stepper import Acted
from sim.rig.transports import Transports, open_transports
from sim.world.world import World
from telemetry.media.zenoh_bus import ZenohBus
from telemetry.messages import BASE, ENCODER
from telemetry.runtime.hosting import Place
from telemetry.transport.authentication import new_key

PRELOAD = {"float64": "borechain.drilling.preload", "fixed": "borechain.drilling.preload_all"}  # by kernel


def drill_in_processes(
    world: World,
    job: RigJob,
    bus: ZenohBus,
    show: ShowProgress,
    log: RunLog | None,
    table_of: Callable[[Transports, Path], ProcessTable],
) -> RigRun:
    """Drill with one real process a tube, beside a hub of CAN segments where a joint is on CAN."""
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
        return RigRun(answers, len(table.specs), sum(table.restarts.values()))


def process_table(
    world: World, job: RigJob, folder: Path, page: PageSettings | None, transports: Transports, steps: Path
) -> ProcessTable:
    """Every process of the rig, one line each; ``steps`` is the socket at which they meet their stepper.

    Without keys the tubes meet at a socket beside it, where the stepper itself is the router, with no process between.
    With keys it is the launcher for all, since certificates say there who may do what.
    """
    key_file = new_key(folder / "rig.key") if job.keys_place is None else None
    near = f"unixsock-stream/{steps.with_name('frames')}" if job.keys_place is None else ""

    def place(name: str, address: int = BASE) -> Place:
        media = transports.media_of(address)
        home = private_folder(folder, name)
        endpoint = job.endpoint if address == BASE or not near else near
        return Place(job.rig_name, endpoint, home, key_file, media, steps, job.keys_place)

    specs = {
        "medium": Spec(
            run_medium,
            (place("medium"), job.scenario, job.seed, job.speed, job.faults, False, True, transports, job.hole, near),
        ),
        "encoder": Spec(run_encoder, (place("encoder", ENCODER), None, None, world.torque_settings(), world.reach)),
        "base": Spec(partial(run_ground, page=page), (place("ground"), settings_of(world, job))),
    }
    for tube in range(1, world.scenario.tubes + 1):
        specs[str(tube)] = Spec(run_node, (place(f"tube-{tube}", tube), world.tube_settings(tube)))
    return ProcessTable(specs, [PRELOAD["fixed" if world.on_chips else world.scenario.file.node.kernel]])


def operator_of(world: World, rig_name: str) -> Callable[[ZenohBus, str], Acted]:
    """Who steps the calibration in the field, where the scenario has one."""
    if world.rack is None:
        return lambda _bus, _cue: Acted.DONE
    operator = RackOperator(world.rack, world.scenario.tubes)
    return lambda bus, cue: operator.act_on_cue(BusGroundClient(bus, rig_name), cue)


def settings_of(world: World, job: RigJob) -> dict[str, Any]:
    """Settings of the ground station, with the wall of which the hole is a column."""
    return ground_settings(world) | ({"wall": job.wall, "hole": job.hole} if job.wall is not None else {})
