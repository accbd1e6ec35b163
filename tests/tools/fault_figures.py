"""Every fault of the gauntlet done to a rig that notes all of it: figures of each kind of what is asked, left and read.

They say that nothing has changed; what each fault is to do is said by the tests of ``tests/gauntlet`` by hand. Where
one is to do otherwise, ``python tests/tools/fault_figures.py`` writes the figures anew, and the change is read.
"""

from __future__ import annotations

import contextlib
import json
import sqlite3
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from seeded_worlds import figure_of

from node.kernels.arithmetic.formats import PERIOD
from sim.gauntlet.fault_kinds import KIND_OF
from sim.gauntlet.faulty_channel import FaultyChannel
from sim.gauntlet.faulty_disk import FaultyDisk
from sim.gauntlet.faulty_world import MINUTE, FaultyWorld
from sim.gauntlet.plan import combined_kinds, drawn_kinds, steps_of
from sim.gauntlet.power import ROTTING
from telemetry.messages import BASE, ENCODER, Hello, NodeMode, Side
from telemetry.presentation.msgpack_codec import encode_message
from telemetry.transport.hop import HopLink

FIGURES = Path(__file__).parents[1] / "data" / "gauntlet_faults.json"
BEGIN, END, SEEDS = 1100.0, 1150.0, (1, 2, 5)
DATABASE = "ground.sqlite"
FILES = (
    ("slot-1", b"abcd"),
    ("slot-2", b"efghi"),
    ("boots", b"12"),
    ("surveys", b"log of it"),
    ("ground.sqlite", b"page"),
)
LATER = 4.3  # s after a step, at which the world is looked at again
PORTS = [(BASE, Side.LOWER), (ENCODER, Side.UPPER), (ENCODER, Side.LOWER), *((t, s) for t in (1, 2) for s in Side)]


class NotingKeys:
    """Keys of a rig, of which is noted what is asked."""

    def __init__(self, rig: NotingRig) -> None:
        self._rig = rig

    def let_end(self, name: str, days: float) -> None:
        self._rig.note("let end", days, content=name.encode())

    def renew(self, name: str) -> None:
        self._rig.note("renew", content=name.encode())

    def let_in(self, name: str) -> None:
        self._rig.note("let in", content=name.encode())

    def shut_out(self, name: str) -> None:
        self._rig.note("shut out", content=name.encode())

    def misgive(self, tube: int) -> None:
        self._rig.note("misgive", tube)

    def give_back(self, tube: int) -> None:
        self._rig.note("give back", tube)


class NotingRig:
    """A rig that notes what is asked of it, with the world, the channel and the disks of the gauntlet."""

    def __init__(self, world: FaultyWorld) -> None:
        self.world, self.now = world.healthy(), 0.0
        self.channel = FaultyChannel(1, 0.01, 0.0, 0.0, 0.0)
        self.disks: dict[int, FaultyDisk] = defaultdict(lambda: FaultyDisk(np.random.default_rng(1)))
        self.noted: list[float] = []
        self.keys = NotingKeys(self)
        for address in (BASE, ENCODER, 1, 2):
            for name, data in FILES:
                self.disks[address].replace(name, database() if name == DATABASE else data + bytes([address]))
            self.disks[address].backups = [b"an old one"]
        for number, (address, side) in enumerate(PORTS):
            link = HopLink(address, 7)
            for k in range(3):
                link.send_best_effort(encode_message(Hello(address, 1, number, NodeMode.BOOT, 0.1 * k)), f"h{k}")
                for frame in link.take_frames(float(k)):
                    self.channel.deliveries(address, side, frame.payload)

    def note(self, word: str, *numbers: float, content: bytes = b"") -> None:
        self.noted += [float(sum(word.encode())), *map(float, numbers), len(content), *_weighed(content)]

    def cut(self, address: int) -> None:
        self.note("cut", address)

    def start(self, address: int, tube: int | None = None) -> None:
        self.note("start", address, -1 if tube is None else tube)

    def freeze(self, address: int) -> None:
        self.note("freeze", address)

    def thaw(self, address: int) -> None:
        self.note("thaw", address)

    def disk(self, address: int) -> FaultyDisk:
        return self.disks[address]

    def inject(self, address: int, side: Side, frame: bytes) -> None:
        self.note("inject", address, side, content=frame)

    def send_depth(self, payload: bytes) -> None:
        self.note("depth", content=payload)

    def order(self, name: str, parameters: dict[str, str]) -> bool:
        self.note("order", content=f"{name} {sorted(parameters.items())}".encode())
        return True

    def seen(self) -> Iterator[float]:
        """What the rig shows now and a little later."""
        world, channel = self.world, self.channel
        for now in (self.now, self.now + LATER):
            self.now = now
            cycle = min(int((now - world.begin) / PERIOD), world.cycles - 1)
            for tube in (1, 2):
                yield from world.imu_sample(tube, cycle)[:6]
                settings = world.tube_settings(tube)
                yield from (settings.drive_joint.angle, settings.lower_joint.angle)
            yield from world.encoder_sample(now)[:2]
            yield from (world.measured_depth(now), float(world.depth_hidden), float(len(world.deceptions)))
            for address in (BASE, ENCODER, 1, 2):
                local = world.local_clock(address, now)
                yield from (local, world.true_time(address, local + 1.0))
            yield from world.truth_station(3.0).values()
        yield from (
            channel.loss,
            channel.burst,
            channel.reordering,
            channel.corrupt,
            channel.duplicate,
            channel.flipped,
        )
        for port in PORTS:
            yield from (channel.port_loss.get(port, 0.0), channel.port_delay.get(port, 0.0), port in channel.severed)

    def left(self) -> Iterator[float]:
        """What the fault has left on the disks."""
        for address, disk in sorted(self.disks.items()):
            yield from (address, disk.writes_left, len(disk.backups), 0 if disk.refusal is None else disk.refusal)
            for name, file in sorted(disk.files.items()):
                content = payloads(bytes(file.seen)) if name == DATABASE else bytes(file.seen)
                yield from (sum(name.encode()), len(content), *_weighed(content))


def database() -> bytes:
    """A database of six rows in each table in which rows rot."""
    with contextlib.closing(sqlite3.connect(":memory:")) as made:
        for table, columns in ROTTING.items():
            names = sorted(set(columns))
            made.execute(f"create table {table} (id integer primary key, {', '.join(names)})")
            for k in range(6):
                row = [bytes(range(10 * k, 10 * k + 9)) if name == "payload" else 1.5 * k + 0.1 for name in names]
                row = [
                    f"{k}{k + 1}{k + 2}" if name == "content" else value for name, value in zip(names, row, strict=True)
                ]
                made.execute(f"insert into {table} values (?{', ?' * len(names)})", (k, *row))
        made.commit()
        return made.serialize()


def payloads(content: bytes) -> bytes:
    """What a database holds; its own bytes are those of a version of SQLite."""
    if not content.startswith(b"SQLite"):
        return content
    with contextlib.closing(sqlite3.connect(":memory:")) as read, contextlib.suppress(sqlite3.DatabaseError):
        read.deserialize(content)
        read.text_factory = bytes
        return b"".join(
            repr(row).encode() for table in ROTTING for row in read.execute(f"select * from {table} order by id")
        )
    return b"damaged"


def _weighed(content: bytes) -> list[float]:
    return [float(np.frombuffer(content, np.uint8) @ np.arange(1.0, len(content) + 1.0))]


def figure_of_kind(kind: str, world: FaultyWorld) -> list[float]:
    """Figures of all steps of a kind over a few seeds: of what is asked and left, whole numbers, and what is shown."""
    left, shown = list[float](), list[float]()
    for seed in SEEDS:
        rig = NotingRig(world)
        steps = KIND_OF[kind].draw(np.random.default_rng(seed), BEGIN, END)
        for step in sorted(steps, key=lambda one: one.at):
            rig.now = step.at
            step.act(rig)
            shown += [step.at, *rig.seen()]
            left += [*rig.noted, *rig.left()]
            rig.noted = []
    return [figure_of(left), figure_of(shown)]


def figure_of_plans() -> list[float]:
    """Figure of which kinds, and when, seeds bring."""
    kinds = [*KIND_OF]
    found: list[float] = []
    for seed in range(1, 9):
        for chosen in (drawn_kinds(seed, kinds), drawn_kinds(seed, kinds[:2]), combined_kinds(seed, kinds[3:20], 3)):
            found += [kinds.index(name) for name in chosen]
            for recovers in (True, False):
                steps = steps_of(seed, chosen, BEGIN, END + 60.0, recovers=recovers)
                found += [x for name, step in steps for x in (kinds.index(name), step.at)]
    return [figure_of(found)]


def everything() -> dict[str, list[float]]:
    """Figures by kind, and that of the plans."""
    world = FaultyWorld.of_tables(MINUTE, 1)
    return {kind: figure_of_kind(kind, world) for kind in KIND_OF} | {"plans": figure_of_plans()}


if __name__ == "__main__":
    lines = (f" {json.dumps(kind)}: {json.dumps(found)}" for kind, found in everything().items())
    FIGURES.write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8")
