"""One hole, drilled by processes that meet at a router or by objects in this process, and what came of it."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

from borechain.client import Ground
from borechain.crew.log import RunLog
from borechain.drilling.inline import InlineRig
from borechain.drilling.rig_job import DrilledRig, RigJob, RigRun, RigWatcher, ShowProgress, say_on_stderr
from borechain.drilling.rig_processes import drill_in_processes, process_table, settings_of
from groundstation.gateway.page.page_settings import PageSettings
from node.kernels.arithmetic.jit import processor_in_use
from sim.errors import RigError, ScenarioError
from sim.rig.ground_answers import ASKED
from sim.rig.launcher import next_run_folder, prepare_folder
from sim.rig.report import write_files
from sim.rig.rig_progress import RigProgress
from sim.rig.rig_result import rig_result
from sim.world.scenario import load_scenario
from sim.world.world import World
from telemetry.media.zenoh_bus import ZenohBus
from telemetry.runtime.warning_lines import telling_warnings


def drill_hole(job: RigJob, bus: ZenohBus | None, watcher: RigWatcher) -> DrilledRig:
    """Drill with processes that meet at ``bus``, or without it in this process.

    Raises
    ------
    ScenarioError
        When the scenario cannot be drilled; nothing was written.
    RigError
        When the folder cannot be used, a process fails, or on Ctrl-C.
    """
    started = time.monotonic()
    world = read_world(job, watcher.say)
    folder = run_folder(job)
    if watcher.log is not None and bus is not None:  # nothing is refused any more
        watcher.log.join(job.endpoint, job.rig_name, Ground(bus, job.rig_name))
    page = None if job.served is None else page_with_password(job.served, watcher.say)
    try:
        with watcher.progress(world) as show:
            if bus is None:
                run = drill_inline(world, job, folder, show, watcher.log)
            else:
                table_of = partial(process_table, world, job, folder, page)
                run = drill_in_processes(world, job, bus, show, watcher.log, table_of)
    except KeyboardInterrupt:
        raise RigError(f"interrupted; every process was ended, what was stored is in {folder}") from None
    result = rig_result(run.answers, world)
    result |= {"processes": run.processes, "wall_s": round(time.monotonic() - started, 3), "restarts": run.restarts}
    result["kernels"] = processor_in_use()
    write_files(folder, result)
    return DrilledRig(result, folder)


def run_folder(job: RigJob) -> Path:
    """Folder of a job, made and looked at; errors as ``drill_hole``."""
    folder = job.out if job.out is not None else next_run_folder(Path("out") / job.scenario.stem)
    prepare_folder(folder)
    return folder


def read_world(job: RigJob, say: Callable[[str], None] = say_on_stderr) -> World:
    """World of a job, with what is odd about its scenario told in lines; errors as ``drill_hole``."""
    with telling_warnings(say):
        scenario = load_scenario(job.scenario, job.faults)
        world = World(scenario.drilling(job.hole) if job.hole else scenario, job.seed)
    if world.scenario.medium.link == "off":
        raise ScenarioError(f'{job.scenario}: medium.link: expected "on" for a rig; only studies run without a link')
    world.on_chips = tubes_on_chips(job.chips, world.scenario.tubes)
    return world


def tubes_on_chips(said: str, tubes: int) -> frozenset[int]:
    """Tubes of ``--chip``: numbers with commas, or all; what emulates them is looked for, and made.

    Raises
    ------
    RigError
        When it names no tube of the string.
    ToolchainError
        When compiler or emulator is missing.
    """
    if not said:
        return frozenset()
    whole = frozenset(range(1, tubes + 1))
    chosen = whole if said == "all" else frozenset(int(word) for word in said.split(",") if word.strip().isdecimal())
    if not chosen or not chosen <= whole or (said != "all" and len(said.split(",")) != len(chosen)):
        raise RigError(f"--chip {said}: expected all, or numbers of tubes from 1 to {tubes} with commas")
    from node.translation.chip_program import chip_program

    chip_program()
    return chosen


def page_with_password(page: PageSettings, say: Callable[[str], None]) -> PageSettings:
    """The page of a simulated rig, on which one may order: without passwords with one by lot, which is told."""
    if page.passwords:
        return page
    from groundstation.gateway.page.passwords import DRILLER, drawn_password, hash_of

    password = drawn_password()
    say(f"page {page.url}; sign in as {DRILLER} with the password {password}")
    return replace(page, passwords={DRILLER: hash_of(password)})


def drill_inline(world: World, job: RigJob, folder: Path, show: ShowProgress, log: RunLog | None = None) -> RigRun:
    """Drill with objects in this process."""
    native = job.transport == "can-native"
    rig = InlineRig(world, settings_of(world, job), job.rig_name, folder, native=native, keys=job.keys_place)

    def follow(progress: RigProgress) -> None:
        show(progress)
        if log is not None and log.on_tick(progress, {}) and rig.is_begun:
            log.poll(rig.ask)

    rig.run(follow, job.speed)
    try:
        return RigRun({path: rig.ask(path) for path in ASKED}, 1, 0)
    finally:
        rig.close()
