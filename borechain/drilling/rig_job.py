"""What is to be drilled, who watches it, and what came of it."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from telemetry import keys

if TYPE_CHECKING:
    from borechain.crew.log import RunLog
    from groundstation.gateway.page.page_settings import PageSettings
    from sim.rig.launcher import Tick
    from sim.rig.rig_progress import RigProgress
    from sim.world.world import World

ShowProgress: TypeAlias = "Callable[[Tick | RigProgress], None]"


@dataclass(frozen=True, slots=True)
class RigJob:
    """What is to be drilled, how, and where its keys are."""

    scenario: Path
    seed: int
    speed: float
    faults: tuple[str, ...] = ()
    inline: bool = False
    transport: str | None = None
    rig_name: str = keys.DEFAULT_RIG
    endpoint: str = keys.DEFAULT_ENDPOINT
    keys_place: Path | None = None
    out: Path | None = None  # new or empty folder; one of the name and a number by default
    served: PageSettings | None = None  # page of its ground station
    wall: Path | None = None  # wall file of which the hole is a column
    hole: str = ""  # of the scenario's site
    chips: str = ""  # tubes whose node steps on an emulated chip: numbers with commas, or all


def show_nothing(_progress: Tick | RigProgress) -> None:
    """Progress that is not watched."""


def no_progress(_world: World) -> AbstractContextManager[ShowProgress]:
    """Progress of a world that is not watched."""
    return contextlib.nullcontext(show_nothing)


def say_on_stderr(line: str) -> None:
    """A line beside the output."""
    sys.stderr.write(f"{line}\n")


@dataclass(frozen=True, slots=True)
class RigWatcher:
    """Who is told of a rig while it drills: progress of a world, a log, and notices in a line each."""

    progress: Callable[[World], AbstractContextManager[ShowProgress]] = no_progress
    log: RunLog | None = None
    say: Callable[[str], None] = say_on_stderr


@dataclass(frozen=True, slots=True)
class DrilledRig:
    """What came of a rig: the object that ``borechain rig --json`` prints, and the folder of the run."""

    result: dict[str, Any]
    folder: Path


@dataclass(frozen=True, slots=True)
class RigRun:
    """A rig that has finished: what its ground station answered, and what ran."""

    answers: dict[str, Any]
    processes: int
    restarts: int
