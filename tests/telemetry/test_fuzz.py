"""Whatever comes at any port: nothing raises, nothing grows, and what is honest still arrives.

The inputs are frames that a string has sent, damaged on every level: bytes of the frame, what the link's header and
entries say, payloads under a whole frame, and under keys what a partner with its key may seal.
"""

from __future__ import annotations

import random
import zlib
from collections.abc import Callable
from pathlib import Path

import msgpack
import pytest
from sealed_string import ORDER, SealedString, make_folder

from telemetry.messages import BASE, ENCODER, Side
from telemetry.schema import MessageKind
from telemetry.transport.hop import MAX_FRAME, QUEUE_LIMIT, WINDOW

Mutate = Callable[[random.Random, bytes, list[bytes]], bytes]
SAID = (
    MessageKind.SURVEY_MEASUREMENT,
    MessageKind.COMMAND,
    MessageKind.EVENT,
    MessageKind.BLOCK_SEGMENT,
    MessageKind.NODE_STATE,
    MessageKind.STATIC_RECORD,
)
ODD = (
    None,
    True,
    -1,
    0,
    1,
    251,
    255,
    256,
    2**31,
    2**53,
    2**63,
    -(2**63),
    1.5,
    float("nan"),
    "",
    "x" * 300,
    b"",
    [],
    {},
)
ENDS = [(a, side) for a in ORDER for side in Side if (a, side) not in ((BASE, Side.UPPER),)]
COUNTERS_AT_MOST = 60


def noise(lot: random.Random, _frame: bytes, _frames: list[bytes]) -> bytes:
    return lot.randbytes(lot.randrange(0, 400))


def bits(lot: random.Random, frame: bytes, _frames: list[bytes]) -> bytes:
    damaged = bytearray(frame)
    for _ in range(lot.randrange(1, 6)):
        damaged[lot.randrange(len(damaged))] ^= 1 << lot.randrange(8)
    return bytes(damaged)


def cut(lot: random.Random, frame: bytes, _frames: list[bytes]) -> bytes:
    return frame[: lot.randrange(len(frame))] + lot.randbytes(lot.randrange(3))


def spliced(lot: random.Random, frame: bytes, frames: list[bytes]) -> bytes:
    other = lot.choice(frames)
    return frame[: lot.randrange(len(frame))] + other[lot.randrange(len(other)) :]


def long(lot: random.Random, frame: bytes, _frames: list[bytes]) -> bytes:
    return frame + lot.randbytes(lot.choice((1, 5000, MAX_FRAME, 3 * MAX_FRAME)))


def whole_frame_of_damage(lot: random.Random, frame: bytes, frames: list[bytes]) -> bytes:
    """The bytes are damaged and the checksum is right."""
    body = lot.choice((bits, cut, spliced))(lot, frame[4:], [other[4:] for other in frames])
    return zlib.crc32(body).to_bytes(4, "little") + body


def whole_frame_of_odd_values(lot: random.Random, frame: bytes, _frames: list[bytes]) -> bytes:
    """One value of a frame, or of a payload in it, is something else."""
    try:
        rows = msgpack.unpackb(frame[4:])
        entries = rows[-1]
        if entries and lot.random() < 0.7:
            entry = lot.choice(entries)
            message = msgpack.unpackb(entry[1])
            where = message["b"] if lot.random() < 0.7 and message.get("b") else message
            where[lot.choice(list(where))] = lot.choice(ODD)
            entry[1] = msgpack.packb(message)
        else:
            rows[lot.randrange(len(rows))] = lot.choice(ODD)
        body = msgpack.packb(rows)
    except (ValueError, TypeError, OverflowError, KeyError, IndexError):
        body = frame[4:]
    return zlib.crc32(body).to_bytes(4, "little") + bytes(body)


MUTATIONS: tuple[Mutate, ...] = (
    noise,
    bits,
    cut,
    spliced,
    long,
    whole_frame_of_damage,
    whole_frame_of_odd_values,
    whole_frame_of_odd_values,
)


def fuzz(folder: Path, inputs: int, *, sealed: bool) -> None:
    lot = random.Random(7)
    string = SealedString(folder, sealed=sealed)
    string.settle()
    for kind in SAID:
        string.say(kind)
        string.run(1.0)
    frames = [frame for end in ENDS for frame in string.wire[end][-60:]]
    for number in range(inputs):
        end = lot.choice(ENDS)
        made = lot.choice(MUTATIONS)(lot, lot.choice(frames), frames)
        if sealed and lot.random() < 0.5:
            made = under_the_partners_seal(string, end, made)
        string.endpoints[end[0]].receive(end[1], made, string.now)
        if number % 500 == 0:
            string.run(0.2)
            for wire in string.wire.values():
                del wire[:-60]
    is_bounded(string)
    works_still(string)


def under_the_partners_seal(string: SealedString, end: tuple[int, Side], frame: bytes) -> bytes:
    """The frame as a partner that has the joint's key would send it."""
    address, side = end
    place = ORDER.index(address) + (1 if side is Side.LOWER else -1)
    if not 0 <= place < len(ORDER):
        return frame
    return string.seals(ORDER[place]).joints[Side(1 - side)].close(frame) or frame


def is_bounded(string: SealedString) -> None:
    for endpoint in string.endpoints.values():
        assert len(endpoint.link_counters()) < COUNTERS_AT_MOST
        for link in endpoint._links.values():
            assert link.waiting <= QUEUE_LIMIT + WINDOW
        assert endpoint.mail.outbox_size <= 256
        assert len(endpoint.export_state()) < 2**20


def works_still(string: SealedString) -> None:
    """What was made to believe nonsense without keys is itself again after a start; under keys none was."""
    if not string.sealed:
        for address in ORDER:
            string.start(address, new=True)
    string.talking = True
    string.run(30.0)
    assert string.endpoints[1].mail.outbox_size == 0
    string.say(MessageKind.SURVEY_MEASUREMENT)
    assert string.endpoints[1].mail.outbox_size == 1
    string.run(15.0)
    assert string.endpoints[1].mail.outbox_size == 0  # it was stored, and the receipt came back
    assert string.endpoints[ENCODER].place.neighbours[Side.LOWER] is not None


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_folder(tmp_path_factory.mktemp("keys") / "stick")


@pytest.mark.slow
@pytest.mark.parametrize("sealed", [True, False], ids=["sealed", "open"])
def test_a_damaged_frame_stops_nobody(folder: Path, sealed: bool) -> None:
    fuzz(folder, 300_000, sealed=sealed)


@pytest.mark.statistical
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("sealed", [True, False], ids=["sealed", "open"])
def test_millions_of_damaged_frames_stop_nobody(folder: Path, sealed: bool) -> None:
    fuzz(folder, 3_000_000, sealed=sealed)
