"""One seed of the gauntlet: firmware, links, ground station and store in this process, faults, and what came of it."""

from __future__ import annotations

import hashlib
import json
import shutil
import tempfile
import traceback
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from borechain.gauntlet.oracles import violations
from borechain.inline import InlineRig
from sim.gauntlet.kinds import KINDS, address_folder
from sim.gauntlet.plan import drawn_kinds, steps_of
from sim.gauntlet.world import TUBE_LENGTH, FaultyWorld, gauntlet_scenario
from sim.rig.link_channel import LinkChannel
from sim.rig.report import digest
from sim.rig.scheduler import Scheduler
from sim.world.streams import Stream, stream
from telemetry.messages import BASE, Side

BEFORE_END = 130.0  # s at the end of the schedule in which no fault begins
AFTER_BEGIN = 15.0  # s at its begin
ALL = tuple(kind.name for kind in KINDS)


@dataclass(slots=True)
class Outcome:
    """What became of a seed."""

    seed: int
    kinds: tuple[str, ...]
    violations: list[str] = field(default_factory=list)
    digest: str = ""
    alarms: list[str] = field(default_factory=list)
    measurements: int = 0


class GauntletRig:
    """A rig that faults may touch; see ``sim.gauntlet.kinds.Faulty``."""

    def __init__(self, seed: int, folder: Path) -> None:
        self.world = FaultyWorld(gauntlet_scenario(), seed)
        lots = stream(seed, Stream.LOTS)
        self.inline = InlineRig(
            self.world, {"tube_length": TUBE_LENGTH}, "rig-1", folder, lambda below: int(lots.integers(below))
        )
        self._stepper = self.inline.stepper
        self._folder = folder
        self._off: set[int] = set()
        self.scheduler = Scheduler(self.world, self._stepper, self._stepper.follow)
        self.scheduler.begin()

    @property
    def now(self) -> float:
        """Rig time of the truth, s."""
        return self.scheduler.now

    @property
    def channel(self) -> LinkChannel:
        """The joints."""
        return self.scheduler.channel

    def cut(self, address: int) -> None:
        """Power off; nothing where it is off already."""
        if address in self.scheduler.progress.wanted:
            if address == BASE:
                self.inline.ground.store.close()
            self._stepper.drop(address)
            self.scheduler.progress.wanted.remove(address)
            self._off.add(address)

    def start(self, address: int) -> None:
        """Power on, where it was cut."""
        if address in self._off:
            self._off.remove(address)
            self.scheduler.progress.wanted.append(address)
            self._stepper.follow(self.scheduler.progress)

    def folder(self, address: int) -> Path:
        """Where a process keeps what it keeps."""
        return self._folder / "state" / address_folder(address)

    def inject(self, address: int, side: Side, frame: bytes) -> None:
        """A frame from nowhere."""
        if (process := self._stepper.processes.get(address)) is not None:
            process.on_frame(side, frame, self.world.local_clock(address, self.now))

    def send_depth(self, payload: bytes) -> None:
        """Bytes on the key of the depth."""
        if (process := self._stepper.processes.get(BASE)) is not None:
            process.on_depth(payload, self.world.local_clock(BASE, self.now))

    def drill(self, steps: Sequence[Any]) -> None:
        """Drill to the end, doing each step at its time."""
        for step in steps:
            self.scheduler.advance(step.at)
            step.act(self)
        self.scheduler.advance()


def run_seed(seed: int, allowed: Sequence[str] = ALL, kinds: Sequence[str] | None = None) -> Outcome:
    """Drill under the faults of a seed and judge; ``kinds`` overrules what the seed switches on."""
    outcome = Outcome(seed, tuple(drawn_kinds(seed, allowed) if kinds is None else kinds))
    folder = Path(tempfile.mkdtemp(prefix="gauntlet-"))
    try:
        rig = GauntletRig(seed, folder)
        world = rig.world
        begin, end = world.begin + AFTER_BEGIN, world.end - BEFORE_END
        try:
            rig.drill(steps_of(seed, outcome.kinds, begin, end))
            stations = rig.inline.ask("stations")["stations"]
            outcome.digest = hashlib.sha256(f"{digest(stations)}{_alarms(rig)}".encode()).hexdigest()
            outcome.alarms = sorted({row["code"] for row in _alarms(rig)})
            outcome.measurements = len(rig.inline.ask("measurements")["measurements"])
            outcome.violations = violations(rig.inline, world)
        finally:
            if BASE in rig.inline.stepper.processes:
                rig.inline.close()
    except Exception as error:
        place = traceback.extract_tb(error.__traceback__)[-1]
        outcome.violations.append(f"died: {type(error).__name__}: {error} ({Path(place.filename).name}:{place.lineno})")
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    return outcome


def shrink(seed: int, kinds: Sequence[str]) -> Outcome:
    """The failing seed with as few kinds as still make it fail."""
    kept = list(kinds)
    worst = run_seed(seed, kinds=kept)
    for name in list(kept):
        fewer = [other for other in kept if other != name]
        tried = run_seed(seed, kinds=fewer) if fewer else worst
        if fewer and tried.violations:
            kept, worst = fewer, tried
    return worst


def _alarms(rig: GauntletRig) -> list[dict[str, Any]]:
    shown = rig.inline.ask("alarms")
    rows = json.loads(json.dumps(shown["rig"] + shown["rig_cleared"]))
    return [{key: row[key] for key in ("code", "subject", "count")} for row in rows]
