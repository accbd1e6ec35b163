"""Hours of a rig under faults that come and go: what grows with time, and what does not hold."""

from __future__ import annotations

import gc
import math
import resource
import shutil
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from borechain.gauntlet.gauntlet_rig import GauntletRig
from borechain.gauntlet.oracles import Observer
from sim.gauntlet.fault import EVERYBODY
from sim.gauntlet.fault_kinds import KINDS, LASTING, SEALED
from sim.gauntlet.faulty_disk import FaultyDisk
from sim.gauntlet.faulty_world import COMMON, TUBE_LENGTH, FaultyWorld
from sim.gauntlet.plan import drawn_kinds, steps_of
from sim.world.random_streams import RandomStream, random_stream
from telemetry.messages import BASE

MOST_STOPS = 1000
TURN_S, STOP_S = 10.0, 32.0
WINDOW_S = 600.0  # in which a mixture of faults comes and goes
ADVANCE = 0.8  # m, of the bit in all
SAMPLES = 24
HEALABLE = tuple(kind.name for kind in KINDS if kind.name not in LASTING | SEALED)


@dataclass(frozen=True, slots=True)
class SoakSample:
    """State of the whole after some hours of rig time."""

    hours: float
    memory_mib: float  # of this process
    objects: int  # of Python, in this process
    disks_mib: float  # what the disks in memory hold, until each ring and log is full
    handles: int  # open files of this process
    database_kib: float
    surveys: int
    violations: tuple[str, ...]
    cpu_s: float


def run_soak(hours: float, seed: int) -> Iterator[SoakSample]:
    """Drill and rest for ``hours`` of rig time under faults of a seed, and look at regular times."""
    world = FaultyWorld.of_tables(_tables(3600.0 * hours), seed)
    disks = {address: FaultyDisk(random_stream(seed, RandomStream.GAUNTLET, 4, address)) for address in EVERYBODY}
    folder = Path(tempfile.mkdtemp(prefix="gauntlet-"))
    try:
        rig = GauntletRig(world, disks, {"tube_length": TUBE_LENGTH}, seed, folder)
        observer = Observer(rig)
        rig.begin(world.begin)
        windows = math.ceil((world.end - world.begin) / WINDOW_S)
        for number in range(windows):
            _one_window(rig, observer, seed * windows + number, world.begin + number * WINDOW_S)
            if (number + 1) * SAMPLES // windows > number * SAMPLES // windows:
                yield _sample(rig, observer)
        rig.close()
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _tables(seconds: float) -> dict[str, Any]:
    """Scenario of a string that rests, is drilled a little and surveyed, over and over."""
    stops = max(min(int(seconds / WINDOW_S), MOST_STOPS), 1)
    rest = max(seconds / stops - TURN_S - STOP_S, 60.0)
    return COMMON | {
        "schedule": {"add_s": rest, "stop_s": STOP_S, "finish_s": 60.0, "blocks": stops},
        "rotation": {"turns": 1.5, "advance_m": ADVANCE / stops},
    }


def _one_window(rig: GauntletRig, observer: Observer, number: int, begin: float) -> None:
    """Run faults that come and go within a window; at its end everything is repaired, as a crew would."""
    kinds = drawn_kinds(number, HEALABLE)
    for _, step in steps_of(number, kinds, begin, begin + WINDOW_S):
        rig.advance(step.at, observer.look)
        step.act(rig)
    rig.repair()
    rig.world.forget()
    rig.advance(begin + WINDOW_S, observer.look)


def _sample(rig: GauntletRig, observer: Observer) -> SoakSample:
    used = resource.getrusage(resource.RUSAGE_SELF)
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    model = rig.ground.model if rig.ground is not None else None
    gc.collect()
    return SoakSample(
        hours=(rig.now - rig.world.begin) / 3600.0,
        memory_mib=pages * resource.getpagesize() / 2**20,
        objects=len(gc.get_objects()),
        disks_mib=sum(rig.disk(address).size for address in EVERYBODY) / 2**20,
        handles=len(list(Path("/proc/self/fd").iterdir())),
        database_kib=len(rig.disk(BASE).kept("ground.sqlite")) / 1024.0,
        surveys=0 if model is None else sum(station.count for station in model.hole.stations),
        violations=tuple(observer.found),
        cpu_s=used.ru_utime,
    )
