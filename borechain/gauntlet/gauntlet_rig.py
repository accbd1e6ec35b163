"""A rig that faults may touch: firmware, links, ground station and store in this process, on disks in memory."""

from __future__ import annotations

import gc
import itertools
import math
import tempfile
from collections.abc import Callable, Iterable
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

from borechain.drilling.inline import InlineRig
from borechain.gauntlet.rig_keyring import RigKeyring
from groundstation.service.process.ground_process import GroundProcess
from node.process.node_host import seals_at
from node.process.tube_process import TubeProcess
from sim.errors import RigError
from sim.gauntlet.fault import EVERYBODY, TUBES, Step
from sim.gauntlet.faulty_channel import FaultyChannel
from sim.gauntlet.faulty_disk import FaultyDisk, PowerCutError
from sim.gauntlet.faulty_stepper import FaultyStepper
from sim.gauntlet.faulty_world import CALM_S, CALMED, DRILLED_IN, MINUTE, TUBE_LENGTH, FaultyWorld
from sim.gauntlet.key_faults import heal_keys
from sim.rig.scheduler import Scheduler
from sim.world.random_streams import RandomStream, random_stream
from telemetry.messages import BASE, Side

LOOK_EVERY = 5.0  # s between two looks of an observer
WORLDS = 8  # of a schedule; what a world draws and measures is worked out once a process of the machine
BIAS_AFTER = 55.0  # s of rest in which a tube that has lost its memory finds the bias of its gyroscope
RESTED = 100.0  # s that the string of a short schedule has rested and been heard before everything starts again


class Plan(NamedTuple):
    """A schedule, and the time (s) from which faults may begin in it.

    Attributes
    ----------
    tables : scenario
    rested : s that pass before everything loses its power and the run begins, which is not judged; 0 for none
    after_begin : s of the run in which no fault begins
    settings : of the ground station
    calm : s before the end, at which everything is repaired and after which all is to be well
    """

    tables: dict[str, Any]
    rested: float
    after_begin: float
    settings: dict[str, Any]
    calm: float = 0.0


PLANS = {
    "minute": Plan(MINUTE, RESTED, 6.0, {"tube_length": TUBE_LENGTH, "survey_after": 38.0}),
    "calmed": Plan(CALMED, RESTED, 6.0, {"tube_length": TUBE_LENGTH, "survey_after": 38.0}, CALM_S),
    "drilled-in": Plan(DRILLED_IN, 0.0, 15.0, {"tube_length": TUBE_LENGTH}),
}


class GauntletRig:
    """A rig that faults may touch; see ``sim.gauntlet.fault.Faulty``.

    Parameters
    ----------
    world : without faults yet
    disks : of every process
    settings : of the ground station
    seed : of links and lots
    folder : new; holds the keys of the rig and nothing else
    sealed : joints and messages are sealed, so that keys can fail
    """

    def __init__(
        self,
        world: FaultyWorld,
        disks: dict[int, FaultyDisk],
        settings: dict[str, Any],
        seed: int,
        folder: Path,
        *,
        sealed: bool = False,
    ) -> None:
        self.world = world
        self._keyring = RigKeyring(folder / "keys") if sealed else None
        keys = None if self._keyring is None else self._keyring.folder
        self._disks = dict(disks)
        self._settled = dict(disks)
        lots = random_stream(seed, RandomStream.LOTS)
        self.inline = InlineRig(
            world, settings, "rig-1", folder, lambda below: int(lots.integers(below)), disk_of=self.disk, keys=keys
        )
        self.stepper = self.inline.stepper = FaultyStepper(
            self.inline.stepper.builders, world, self.cut, self._start_anew
        )
        self._builders = dict(self.stepper.builders)
        self._folder, self._seed, self._strangers = folder, seed, itertools.count()
        self.off: dict[int, float] = {}  # since when (s), by address
        # since when (s) a process that started on a disk that was changed meanwhile has run, by address
        self.forgot_at: dict[int, float] = {}
        self._frozen_at: dict[int, float] = {}
        self.spoiled_until: dict[int, float] = {}  # s, by tube, until when its sensors failed
        self.repaired = False  # the crew has cleared what it had seen
        self._handled = {address: disk.handled for address, disk in disks.items()}
        self.before_cut: list[Callable[[], None]] = []
        self.after_step: list[Callable[[], None]] = []
        self._numbers = {address: address for address in disks}  # that the processes in their places give themselves
        self._spoke_until: dict[int, float] = {}  # s, by number
        self._look_at = world.begin
        self.scheduler = Scheduler(world, self.stepper, self.stepper.follow, seal_depth=self.inline.seal_depth)
        medium = world.scenario.medium
        self.channel = FaultyChannel(seed, medium.latency, medium.jitter, medium.loss, medium.duplicate)
        self.scheduler.channel = self.channel

    @property
    def now(self) -> float:
        """Rig time of the truth, s."""
        return self.scheduler.now

    @property
    def ground(self) -> GroundProcess | None:
        """The ground station, where it has power."""
        process = self.stepper.processes.get(BASE)
        return process if isinstance(process, GroundProcess) else None

    @property
    def keys(self) -> RigKeyring:
        """Keys of a rig that is sealed."""
        if self._keyring is None:
            raise TypeError("expected a sealed rig, got one without keys")
        return self._keyring

    def cut(self, address: int) -> None:
        """Cut the power of a process, if it has any."""
        if address not in self.scheduler.progress.wanted:
            return
        for listener in self.before_cut:
            listener()
        self._disks[address].cut()
        if address == BASE and self.ground is not None:
            self.ground.store.close()
        self.stepper.drop(address)
        self.scheduler.progress.wanted.remove(address)
        self.off[address] = self._spoke_until[self._numbers[address]] = self.now

    def silent_for(self, tube: int) -> float:
        """Seconds for which no process of this number has had power; 0 while one has."""
        if any(number == tube and address not in self.off for address, number in self._numbers.items()):
            return 0.0
        return self.now - self._spoke_until.get(tube, math.inf)

    def start(self, address: int, tube: int | None = None) -> None:
        """Power a process on if it was cut."""
        if address not in self.off:
            return
        cut_at = self.off.pop(address)
        self._take_place(address, tube)
        if (handled := self._disks[address].handled) != self._handled[address]:
            self._handled[address], self.forgot_at[address] = handled, self.now
        self._interrupt(address, cut_at)
        self.scheduler.progress.wanted.append(address)
        self.stepper.follow(self.scheduler.progress)

    def begin(self, at: float) -> None:
        """Power everything on at a rig time (s)."""
        self._look_at = at + LOOK_EVERY
        self.scheduler.begin(at)

    def _start_anew(self, address: int) -> None:
        """What starts a process again that has ended with an error (systemd, docker) does so."""
        for listener in self.before_cut:
            listener()
        self.stepper.processes[address].close()
        self.stepper.drop(address)
        self.stepper.follow(self.scheduler.progress)

    def freeze(self, address: int) -> None:
        """Freeze a process: it gets no events."""
        self._frozen_at[address] = self.now
        self.stepper.freeze(address)

    def thaw(self, address: int) -> None:
        """Thaw a process."""
        self.stepper.thaw(address)
        self._interrupt(address, self._frozen_at.pop(address, math.inf))

    def _interrupt(self, address: int, since: float) -> None:
        """Note that a process went on after a pause: what a tube had begun to learn anew, it begins again."""
        if since < self.forgot_at.get(address, -math.inf) + BIAS_AFTER:
            self.forgot_at[address] = self.now

    def disk(self, address: int) -> FaultyDisk:
        """Return the disk of a process."""
        return self._disks[address]

    def inject(self, address: int, side: Side, frame: bytes) -> None:
        """Inject a frame at an end of a process."""
        if (process := self.stepper.processes.get(address)) is not None:
            process.on_frame(side, frame, self.world.local_clock(address, self.now))

    def send_depth(self, payload: bytes) -> None:
        """Publish bytes on the key of the depth."""
        if self.ground is not None:
            self.ground.on_depth(payload, self.world.local_clock(BASE, self.now))

    def order(self, name: str, parameters: dict[str, str]) -> bool:
        """Have the crew order something; returns whether the ground station may have obeyed."""
        if self.ground is None:
            return False
        try:
            self.inline.command(name, parameters)
        except PowerCutError:
            self.cut(BASE)  # while it wrote the order down, which stands in its book or does not
        except RigError:
            return False  # a disk that refuses, or what it was told cannot be now
        return True

    def drill(self, steps: Iterable[Step], observe: Callable[[], None] = lambda: None, until: float = math.inf) -> None:
        """Drill until a time (s), or to the end, with each step at its time; ``observe`` is called now and then."""
        for step in steps:
            self.advance(step.at, observe)
            self.spoiled_until.update(dict.fromkeys(self.world.spoilers, step.at))
            step.act(self)
            for listener in self.after_step:
                listener()
        self.advance(until, observe)

    def repair(self) -> None:
        """Give everything power and a working disk; the crew answers what stands."""
        self.repaired = True
        self.world.depth_hidden, self.world.depth_error = False, 0.0
        if self._keyring is not None:
            heal_keys(self)
        for address in EVERYBODY:
            self._disks[address].refusal, self._disks[address].writes_left = 0, -1
            self.thaw(address)
            self.start(address)
        self.answer_alarms()

    def answer_alarms(self) -> None:
        """Have the crew measure what is doubted, and tell it: depth, joints, which tube it is, north."""
        for name in ("accept_depth", "accept_joints"):  # the first is refused where nothing speaks against the depth
            self.order(name, {"action": "confirm"})
        if self.ground is None:
            return
        model = self.ground.model
        doubled = model.string.doubled
        for tube in doubled.untold:
            is_upper = doubled.newest(tube).upper == len(TUBES) + 1 - tube
            self.order("same_number", {"tube": str(tube), "which": "upper" if is_upper else "lower"})
        if model.rig_alarms.stands("reference", "encoder"):
            self.order("north", {"action": "tell", "angle_deg": f"{self.world.zero_deg:.6f}", "sigma_deg": "0.5"})

    def close(self) -> None:
        """Close the database."""
        if self.ground is not None:
            self.ground.store.close()

    def advance(self, to: float, observe: Callable[[], None] = lambda: None) -> None:
        """Advance rig time to ``to`` (s); ``observe`` is called from time to time."""
        while self._look_at <= min(to, self.world.end):
            self.scheduler.advance(self._look_at)
            self._look_at += LOOK_EVERY
            observe()
        self.scheduler.advance(to)

    def _take_place(self, address: int, tube: int | None) -> None:
        """Put ``tube`` with a blank disk in a place, or None: the one that belongs there."""
        self._numbers[address] = address if tube is None else tube
        if tube is None:
            self._disks[address], self.stepper.builders[address] = self._settled[address], self._builders[address]
            return
        draws = random_stream(self._seed, RandomStream.GAUNTLET, 3, address, next(self._strangers))
        self._disks[address] = FaultyDisk(draws)
        settings, folder = self.world.tube_settings(tube), self._folder / "state" / "stranger"
        keys = None if self._keyring is None else self._keyring.folder
        self.stepper.builders[address] = lambda: TubeProcess(
            settings, folder, disk=self._disks[address], seals=seals_at(keys, settings.tube, self.world.reach)
        )


def new_rig(plan: str, seed: int, folder: Path, *, sealed: bool = False) -> GauntletRig:
    """The rig of a seed, ready to be drilled with."""
    chosen = PLANS[plan]
    world, kept = started_world(plan, seed % WORLDS)
    disks = {a: kept[a].copied(random_stream(seed, RandomStream.GAUNTLET, 4, a)) for a in EVERYBODY}
    rig = GauntletRig(world.healthy(), disks, chosen.settings, seed, folder, sealed=sealed)
    rig.begin(world.begin + chosen.rested)
    return rig


def make_ready(plan: str, seeds: Iterable[int]) -> None:
    """Compute the worlds of these seeds, so that a seed's time is its own, and exempt them from garbage collection."""
    known = started_world.cache_info().currsize
    for number in sorted({seed % WORLDS for seed in seeds}):
        started_world(plan, number)
    if started_world.cache_info().currsize > known:
        gc.collect()
        gc.freeze()


@cache
def started_world(plan: str, number: int) -> tuple[FaultyWorld, dict[int, FaultyDisk]]:
    """A world, and what the disks hold when the power of everything comes.

    The string of a short schedule has rested under power before, so its nodes know their sensors.
    """
    chosen = PLANS[plan]
    world = FaultyWorld.of_tables(chosen.tables, number)
    disks = {a: FaultyDisk(random_stream(number, RandomStream.GAUNTLET, 5, a)) for a in EVERYBODY}
    if chosen.rested:
        with tempfile.TemporaryDirectory(prefix="gauntlet-") as folder:
            rig = GauntletRig(world.healthy(), disks, chosen.settings, number, Path(folder))
            rig.begin(world.begin)
            rig.scheduler.advance(world.begin + chosen.rested - 2.0)
            for address in EVERYBODY:
                rig.cut(address)
    return world, disks
