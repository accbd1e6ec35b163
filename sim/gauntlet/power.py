"""Faults of power, processors and disks."""

from __future__ import annotations

import contextlib
import errno
import math
import sqlite3
import struct
from collections.abc import Callable, Iterable, Sequence

import numpy as np

from sim.gauntlet.fault import EVERYBODY, TUBES, Draw, Faulty, Step, draw_interval, own_stream
from telemetry.messages import BASE, ENCODER

Handle = Callable[[Faulty, int, np.random.Generator], None]
REFUSALS = (errno.ENOSPC, errno.EROFS)
ROTTEN = 4  # rows of a table of a database that are damaged at once, at most
ROTTING = {  # columns of the database in which bits change, by table
    "messages": ("payload", "payload", "content"),
    "stands": ("begun_at", "ended_at", "md"),
    "joints": ("angle", "var"),
    "setup": ("content",),
}


def keep_disk(rig: Faulty, address: int, random: np.random.Generator) -> None:
    """Leave the disk as the cut left it."""


def power_cut(addresses: Iterable[int], before_start: Handle = keep_disk) -> Draw:
    """Draw of a power cut of a process for a while; ``before_start`` may change its disk meanwhile."""
    choice = tuple(addresses)

    def draw(random: np.random.Generator, begin: float, end: float) -> list[Step]:
        address = int(random.choice(choice))
        off, on = draw_interval(random, begin, end, 1.0, 30.0)
        drawn = own_stream(random)

        def start(rig: Faulty) -> None:
            before_start(rig, address, drawn)
            rig.start(address)

        return [Step(off, lambda rig: rig.cut(address)), Step(on, start)]

    return draw


def cut_all(random: np.random.Generator, begin: float, end: float) -> list[Step]:
    """Steps in which everything loses its power at once, and comes back one after the other."""
    off, on = draw_interval(random, begin, end, 2.0, 20.0)
    steps = [Step(off, lambda rig, a=address: rig.cut(a)) for address in EVERYBODY]  # type: ignore[misc]
    for address in EVERYBODY:
        at = on - float(random.uniform(0.0, min(3.0, on - off)))
        steps.append(Step(at, lambda rig, a=address: rig.start(a)))  # type: ignore[misc]
    return steps


def cut_while_saving(random: np.random.Generator, begin: float, end: float) -> list[Step]:
    """Steps in which the power of a process goes in the middle of its next write."""
    address = int(random.choice((BASE, *TUBES)))
    armed, on = draw_interval(random, begin, end, 5.0, 30.0)
    changes = int(random.integers(12))

    def start(rig: Faulty) -> None:
        rig.disk(address).writes_left = -1
        rig.start(address)

    return [Step(armed, lambda rig: setattr(rig.disk(address), "writes_left", changes)), Step(on, start)]


def cut_again_and_again(random: np.random.Generator, begin: float, end: float) -> list[Step]:
    """Steps in which the power of a node comes and goes."""
    address = int(random.choice((BASE, ENCODER, *TUBES)))
    steps = []
    for _ in range(4):
        off, on = draw_interval(random, begin, end, 1.0, 5.0)
        steps += [Step(off, lambda rig: rig.cut(address)), Step(on, lambda rig: rig.start(address))]
    return steps


def encoder_from_zero(random: np.random.Generator, begin: float, end: float) -> list[Step]:
    """Steps in which the encoder starts again and counts its time from zero."""
    off, on = draw_interval(random, begin, end, 1.0, 10.0)

    def start(rig: Faulty) -> None:
        rig.world.zero = off
        rig.start(ENCODER)

    return [Step(off, lambda rig: rig.cut(ENCODER)), Step(on, start)]


def delete_files(*patterns: str) -> Handle:
    """Handle that deletes files."""

    def act(rig: Faulty, address: int, _random: np.random.Generator) -> None:
        disk = rig.disk(address)
        for name in disk.held(*patterns):
            disk.replace(name, None)

    return act


def damage_files(pattern: str) -> Handle:
    """Handle that overwrites the second half of files with 0xa5."""

    def act(rig: Faulty, address: int, _random: np.random.Generator) -> None:
        disk = rig.disk(address)
        for name, data in disk.held(pattern).items():
            disk.replace(name, data[: len(data) // 2] + b"\xa5" * (len(data) - len(data) // 2))

    return act


def rot_bytes(rig: Faulty, address: int, random: np.random.Generator) -> None:
    """Change single bytes of all that a process keeps."""
    disk = rig.disk(address)
    for name, data in disk.held("*").items():
        rotten = bytearray(data)
        for place in random.integers(len(data), size=3) if data else ():
            rotten[place] ^= 1 << int(random.integers(8))
        disk.replace(name, bytes(rotten))


def restore_backup(rig: Faulty, address: int, random: np.random.Generator) -> None:
    """Replace the database by one of some commits ago."""
    disk = rig.disk(address)
    if disk.backups:
        backup = disk.backups[int(random.integers(len(disk.backups)))]
        disk.replace("ground.sqlite", backup)


def rot_rows(rig: Faulty, address: int, random: np.random.Generator) -> None:
    """Change a bit of some rows of the database, one at least of each table that holds any."""
    disk = rig.disk(address)
    with contextlib.closing(sqlite3.connect(":memory:")) as database:
        for name, image in disk.held("ground.sqlite").items():
            database.deserialize(image)
            for table, columns in ROTTING.items():
                _rot_table(database, table, columns, random)
            database.commit()
            disk.replace(name, database.serialize())


def _rot_table(database: sqlite3.Connection, table: str, columns: Sequence[str], random: np.random.Generator) -> None:
    """Change a bit in one column of some rows."""
    numbers = [number for (number,) in database.execute(f"SELECT rowid FROM {table} ORDER BY rowid")]
    chosen = random.permutation(len(numbers))[: int(random.integers(1, ROTTEN + 1))]
    for number in (numbers[place] for place in chosen):
        column = columns[int(random.integers(len(columns)))]
        (before,) = database.execute(f"SELECT {column} FROM {table} WHERE rowid = ?", [number]).fetchone()
        as_text = isinstance(before, str)
        after = _rotten(before.encode() if as_text else before, random)
        given = "CAST(? AS TEXT)" if as_text else "?"  # whatever its bytes are
        database.execute(f"UPDATE {table} SET {column} = {given} WHERE rowid = ?", (after, number))


def _rotten(before: bytes | float, random: np.random.Generator) -> bytes | float:
    """Bytes or a number with one bit changed; a number stays one."""
    rotten = bytearray(before if isinstance(before, bytes) else struct.pack("<d", before))
    place, bit = int(random.integers(len(rotten))), int(random.integers(8))
    rotten[place] ^= 1 << bit
    if isinstance(before, bytes):
        return bytes(rotten)
    found: float = struct.unpack("<d", rotten)[0]
    return found if math.isfinite(found) else -before


def refused_disk(*addresses: int) -> Draw:
    """Draw of a disk that is full or refuses writes for a while; the process may start again meanwhile."""

    def draw(random: np.random.Generator, begin: float, end: float) -> list[Step]:
        address, refusal = int(random.choice(addresses)), int(random.choice(REFUSALS))
        wrong, right = draw_interval(random, begin, end, 5.0, 60.0)
        steps = [
            Step(wrong, lambda rig: setattr(rig.disk(address), "refusal", refusal)),
            Step(right, lambda rig: setattr(rig.disk(address), "refusal", 0)),
        ]
        if random.random() < 0.5:
            off, on = draw_interval(random, wrong, right, 1.0, 10.0) if right > wrong + 1.0 else (wrong, right)
            steps += [Step(off, lambda rig: rig.cut(address)), Step(on, lambda rig: rig.start(address))]
        return steps

    return draw


def swap_folders(random: np.random.Generator, begin: float, end: float) -> list[Step]:
    """Steps in which two tubes get each other's saved state."""
    off, on = draw_interval(random, begin, end, 2.0, 10.0)

    def swap(rig: Faulty) -> None:
        found = {tube: rig.disk(tube).held("*") for tube in TUBES}
        for tube, other in (TUBES, TUBES[::-1]):
            delete_files("*")(rig, tube, random)
            for name, data in found[other].items():
                rig.disk(tube).replace(name, data)
            rig.start(tube)

    return [*(Step(off, lambda rig, t=tube: rig.cut(t)) for tube in TUBES), Step(on, swap)]  # type: ignore[misc]


def same_number(random: np.random.Generator, begin: float, end: float) -> list[Step]:
    """Steps in which a tube's place is taken for a while by another one with the number of its neighbour."""
    off, on = draw_interval(random, begin, end, 5.0, 20.0)
    tube, number = (1, 2) if random.random() < 0.5 else (2, 1)

    def change(rig: Faulty) -> None:
        rig.cut(tube)
        rig.start(tube, number)

    def change_back(rig: Faulty) -> None:
        rig.cut(tube)
        rig.start(tube)

    def tell(rig: Faulty) -> None:
        rig.order("same_number", {"tube": str(number), "which": "upper" if number > tube else "lower"})

    return [Step(off, change), Step(on, change_back), Step(on, tell)]


def freeze_process(random: np.random.Generator, begin: float, end: float) -> list[Step]:
    """Steps in which a process stands still for up to 30 s, and then goes on."""
    address = int(random.choice(EVERYBODY))
    still, on = draw_interval(random, begin, end, 1.0, 30.0)
    return [Step(still, lambda rig: rig.freeze(address)), Step(on, lambda rig: rig.thaw(address))]


def ground_off_across_stop(random: np.random.Generator, begin: float, end: float) -> list[Step]:
    """Steps in which the ground station is off from before a stop until after the survey."""
    del begin
    drawn = float(random.uniform(22.0, 34.0))
    return [Step(end - drawn, lambda rig: rig.cut(BASE)), Step(end, lambda rig: rig.start(BASE))]
