"""The kinds of faults, one line each: what is drawn for it, and what it does to a rig.

A fault is drawn from a stream of its own, named by the seed and its kind, so a kind that is left out changes no other.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np

from sim.gauntlet.world import FaultyWorld, Reading
from sim.rig.link_channel import LinkChannel
from telemetry.messages import BASE, ENCODER, DepthReading, Hello, Mode, Receipt, Side, address_name
from telemetry.presentation.msgpack_codec import encode
from telemetry.transport.hop import HopLink

TUBES = (1, 2)


class Faulty(Protocol):
    """What a fault may touch."""

    world: FaultyWorld
    now: float  # s, rig time of the truth

    @property
    def channel(self) -> LinkChannel:
        """The joints."""

    def cut(self, address: int) -> None:
        """Power off."""

    def start(self, address: int) -> None:
        """Power on."""

    def folder(self, address: int) -> Path:
        """Where a process keeps what it keeps."""

    def inject(self, address: int, side: Side, frame: bytes) -> None:
        """A frame from nowhere at an end of a process."""

    def send_depth(self, payload: bytes) -> None:
        """Bytes on the key of the depth."""


Act = Callable[[Faulty], None]


@dataclass(frozen=True, slots=True)
class Step:
    """Something done at a rig time (s) of the truth."""

    at: float
    act: Act


Draw = Callable[[np.random.Generator, float, float], list[Step]]


@dataclass(frozen=True, slots=True)
class FaultKind:
    """One kind: its steps between two rig times (s), and what happens in words."""

    name: str
    meaning: str
    draw: Draw


def _when(random: np.random.Generator, begin: float, end: float) -> float:
    return float(random.uniform(begin, end))


def _tube(random: np.random.Generator) -> int:
    return int(random.choice(TUBES))


def _during(
    random: np.random.Generator, begin: float, end: float, shortest: float, longest: float
) -> tuple[float, float]:
    at = _when(random, begin, end)
    return at, at + float(random.uniform(shortest, longest))


def _power_cut(
    addresses: Iterable[int], before_start: Callable[[Faulty, int], None] = lambda _rig, _address: None
) -> Draw:
    """A process loses its power for a while; something may happen to its folder meanwhile."""
    choice = tuple(addresses)

    def draw(random: np.random.Generator, begin: float, end: float) -> list[Step]:
        address = int(random.choice(choice))
        off, on = _during(random, begin, end, 1.0, 30.0)

        def start(rig: Faulty) -> None:
            before_start(rig, address)
            rig.start(address)

        return [Step(off, lambda rig: rig.cut(address)), Step(on, start)]

    return draw


def _cut_all(random: np.random.Generator, begin: float, end: float) -> list[Step]:
    off, on = _during(random, begin, end, 2.0, 20.0)
    everybody = (BASE, ENCODER, *TUBES)
    steps = [Step(off, lambda rig, a=address: rig.cut(a)) for address in everybody]  # type: ignore[misc]
    return steps + [Step(on, lambda rig, a=address: rig.start(a)) for address in everybody]  # type: ignore[misc]


def _encoder_from_zero(random: np.random.Generator, begin: float, end: float) -> list[Step]:
    off, on = _during(random, begin, end, 1.0, 10.0)

    def start(rig: Faulty) -> None:
        rig.world.zero = off
        rig.start(ENCODER)

    return [Step(off, lambda rig: rig.cut(ENCODER)), Step(on, start)]


def _delete(*patterns: str) -> Callable[[Faulty, int], None]:
    def act(rig: Faulty, address: int) -> None:
        for pattern in patterns:
            for file in rig.folder(address).glob(pattern):
                file.unlink()

    return act


def _damage(pattern: str) -> Callable[[Faulty, int], None]:
    def act(rig: Faulty, address: int) -> None:
        for file in rig.folder(address).glob(pattern):
            data = bytearray(file.read_bytes())
            data[len(data) // 2 :] = b"\xa5" * (len(data) - len(data) // 2)
            file.write_bytes(bytes(data))

    return act


def _no_folder(rig: Faulty, address: int) -> None:
    """A file stands where the folder was: nothing can be written there."""
    folder = rig.folder(address)
    if folder.is_dir():
        folder.rename(folder.with_name(f"{folder.name}-lost"))
    folder.write_text("not a folder")


def _link(**rates: float) -> Draw:
    """Frames suffer for a while."""

    def draw(random: np.random.Generator, begin: float, end: float) -> list[Step]:
        worse, better = _during(random, begin, end, 5.0, 60.0)

        def set_rates(rig: Faulty) -> None:
            for name, rate in rates.items():
                setattr(rig.channel, name, rate)

        def reset(rig: Faulty) -> None:
            for name in rates:
                setattr(rig.channel, name, 0.0)

        return [Step(worse, set_rates), Step(better, reset)]

    return draw


def _severed(*, both_ways: bool) -> Draw:
    def draw(random: np.random.Generator, begin: float, end: float) -> list[Step]:
        off, on = _during(random, begin, end, 2.0, 25.0)
        ends = {(ENCODER, Side.LOWER)} | ({(1, Side.UPPER), (2, Side.UPPER)} if both_ways else set())
        return [
            Step(off, lambda rig: rig.channel.severed.update(ends)),
            Step(on, lambda rig: rig.channel.severed.difference_update(ends)),
        ]

    return draw


def _sensor(spoil: Callable[[Reading], Reading]) -> Draw:
    def draw(random: np.random.Generator, begin: float, end: float) -> list[Step]:
        tube = _tube(random)
        fails, works = _during(random, begin, end, 3.0, 60.0)
        return [
            Step(fails, lambda rig: rig.world.spoilers.update({tube: spoil})),
            Step(works, lambda rig: rig.world.spoilers.pop(tube, None) and None),
        ]

    return draw


def _depth_off(metres: float) -> Draw:
    def draw(random: np.random.Generator, begin: float, end: float) -> list[Step]:
        wrong, right = _during(random, begin, end, 2.0, 60.0)
        return [
            Step(wrong, lambda rig: setattr(rig.world, "depth_error", metres)),
            Step(right, lambda rig: setattr(rig.world, "depth_error", 0.0)),
        ]

    return draw


def _once(act: Callable[[Faulty, np.random.Generator], None]) -> Draw:
    def draw(random: np.random.Generator, begin: float, end: float) -> list[Step]:
        drawn = np.random.Generator(np.random.Philox(int(random.integers(2**62))))
        return [Step(_when(random, begin, end), lambda rig: act(rig, drawn))]

    return draw


def _future_depth(rig: Faulty, random: np.random.Generator) -> None:
    at = rig.world.local_clock(ENCODER, rig.now) + float(random.uniform(10.0, 1e4))
    rig.send_depth(encode(DepthReading(int(random.integers(1, 10**6)), at, float(random.uniform(0.0, 10.0)), ())))


def _garbage(rig: Faulty, random: np.random.Generator) -> None:
    for _ in range(20):
        noise = random.bytes(int(random.integers(0, 300)))
        rig.send_depth(noise)
        address = int(random.choice((BASE, ENCODER, *TUBES)))
        rig.inject(address, Side.LOWER if address == BASE else Side(int(random.integers(2))), noise)


def _forged_frames(rig: Faulty, random: np.random.Generator) -> None:
    """A neighbour that never was names a hop count beyond every string, and receipts what nobody stored."""
    tube = _tube(random)
    link = HopLink(ENCODER, int(random.integers(1, 1000)))
    link.send_best_effort(encode(Hello(ENCODER, 7, int(random.integers(-1, 252)), Mode.BOOT, 1.0)), "hello")
    for sequence in range(1, 9):
        link.send_best_effort(encode(Receipt(tube, sequence, random.bytes(16))), sequence)
    link.last_heard = rig.now
    for frame in link.take_frames(rig.now):
        rig.inject(tube, Side.UPPER, frame.payload)


def _still(reading: Reading) -> Reading:
    return [0.1, 0.1, 0.1, *reading[3:]]


def _force_stuck(reading: Reading) -> Reading:
    return [*reading[:3], 1.0, 2.0, -9.0, *reading[6:]]


def _saturated(reading: Reading) -> Reading:
    return [*reading[:2], 8.7266, *reading[3:]]


def _force_saturated(reading: Reading) -> Reading:
    return [*reading[:3], -78.5, *reading[4:]]


def _not_finite(reading: Reading) -> Reading:
    return [float("nan"), *reading[1:]]


KINDS: tuple[FaultKind, ...] = (
    FaultKind("node-cut", "a node loses its power", _power_cut(TUBES)),
    FaultKind("encoder-cut", "the encoder loses its power, its clock runs on", _power_cut([ENCODER])),
    FaultKind("encoder-from-zero", "the encoder starts again and counts its time from zero", _encoder_from_zero),
    FaultKind("ground-cut", "the ground station loses its power", _power_cut([BASE])),
    FaultKind("all-cut", "everything loses its power at once", _cut_all),
    FaultKind("node-memory-lost", "a node loses its saved state", _power_cut(TUBES, _delete("slot-*"))),
    FaultKind("node-memory-rots", "every slot of a node is damaged", _power_cut(TUBES, _damage("slot-*"))),
    FaultKind("boots-damaged", "a node's count of starts is damaged", _power_cut(TUBES, _damage("boots"))),
    FaultKind("encoder-boots-lost", "the encoder's count of starts is lost", _power_cut([ENCODER], _delete("boots"))),
    FaultKind("surveys-lost", "a node's log of receipted surveys is lost", _power_cut(TUBES, _delete("surveys"))),
    FaultKind("node-disk-gone", "a node's folder takes nothing any more", _power_cut(TUBES, _no_folder)),
    FaultKind("database-deleted", "the database is deleted", _power_cut([BASE], _delete("ground.sqlite*"))),
    FaultKind("journal-deleted", "the database loses its log of writes", _power_cut([BASE], _delete("*-wal", "*-shm"))),
    FaultKind("loss", "30 % of the frames are lost", _link(loss=0.3)),
    FaultKind("duplicates", "half of the frames come twice", _link(duplicate=0.5)),
    FaultKind("corruption", "a fifth of the frames are damaged", _link(corrupt=0.2)),
    FaultKind("joint-severed", "nothing passes the top joint", _severed(both_ways=True)),
    FaultKind("joint-deaf", "nothing passes the top joint downward", _severed(both_ways=False)),
    FaultKind("gyro-stuck", "a gyroscope repeats itself", _sensor(_still)),
    FaultKind("gyro-saturated", "a gyroscope is at its range", _sensor(_saturated)),
    FaultKind("force-stuck", "an accelerometer repeats itself", _sensor(_force_stuck)),
    FaultKind("force-saturated", "an accelerometer is at its range", _sensor(_force_saturated)),
    FaultKind("not-finite", "a sensor gives readings that are no numbers", _sensor(_not_finite)),
    FaultKind("depth-jumps-up", "the depth is 1.5 m too small", _depth_off(-1.5)),
    FaultKind("depth-jumps-down", "the depth is 0.8 m too large", _depth_off(0.8)),
    FaultKind("depth-ahead", "a depth comes from the future", _once(_future_depth)),
    FaultKind("garbage", "random bytes come at every port and key", _once(_garbage)),
    FaultKind("forged-neighbour", "a forged hello and forged receipts come", _once(_forged_frames)),
)
KIND_OF = {kind.name: kind for kind in KINDS}


def address_folder(address: int) -> str:
    """Name of the folder of a process below ``state``."""
    return {BASE: "ground", ENCODER: "encoder"}.get(address, f"tube-{address_name(address)}")
