"""A hostile neighbour: bytes, forged messages, and frames that were recorded."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from sim.gauntlet.fault import EVERYBODY, TUBES, Faulty, Step, draw_interval, drawn_tube
from sim.gauntlet.power import delete_files
from telemetry.messages import BASE, ENCODER, Aiding, Hello, NodeMode, Receipt, Side, TimeReply
from telemetry.presentation.msgpack_codec import encode_message
from telemetry.transport.hop import HopLink, pack_frame, parse_frame

REPEATS = 30
STATE = ("slot-*",)


def inject_garbage(rig: Faulty, random: np.random.Generator) -> None:
    """Inject random bytes at every port and key."""
    for _ in range(20):
        noise = random.bytes(int(random.integers(0, 300)))
        rig.send_depth(noise)
        address = int(random.choice(EVERYBODY))
        rig.inject(address, Side.LOWER if address == BASE else Side(int(random.integers(2))), noise)


def forged_frames(rig: Faulty, random: np.random.Generator) -> None:
    """Send as a forged neighbour a hop count beyond every string, and receipts of messages that were not stored."""
    tube = drawn_tube(random)
    link = HopLink(ENCODER, int(random.integers(1, 1000)))
    link.send_best_effort(encode_message(Hello(ENCODER, 7, int(random.integers(-1, 252)), NodeMode.BOOT, 1.0)), "hello")
    for sequence in range(1, 9):
        link.send_best_effort(encode_message(Receipt(tube, sequence, random.bytes(16))), sequence)
    _send(rig, link, tube, Side.UPPER)


def wild_numbers(rig: Faulty, random: np.random.Generator) -> None:
    """Inject messages of the right shape with the largest numbers that the format allows, from above."""
    tube = drawn_tube(random)
    link = HopLink(ENCODER, int(random.integers(1, 1000)))
    aiding = Aiding(0.0, 1e-12, 0.0, 0.0, 0.0, float(random.uniform(0.0, 1e6)), int(random.integers(2**40)), 0)
    link.send_best_effort(encode_message(aiding), "aiding")
    asked = float(random.uniform(-1e6, 1e6))
    link.send_best_effort(
        encode_message(TimeReply(asked, asked, asked, float(random.uniform(0.0, 1e9)), 1.0, 0.0)), "time"
    )
    _send(rig, link, tube, Side.UPPER)


def replay_frames(rig: Faulty, random: np.random.Generator) -> None:
    """Inject recorded frames again, at the port they were for."""
    for frame, address, side in _recorded(rig, random):
        rig.inject(address, side, frame)


def splice_frames(rig: Faulty, random: np.random.Generator) -> None:
    """Inject payloads of recorded frames under the header of another frame of the same port."""
    recorded = _recorded(rig, random)
    for (frame, address, side), (other, _, _) in pairwise(recorded):
        one, two = parse_frame(frame), parse_frame(other)
        if one is not None and two is not None:
            rig.inject(address, side, pack_frame(one[0], [(0, payload) for _, payload in two[1]]))


def second_ground(random: np.random.Generator, begin: float, end: float) -> list[Step]:
    """Steps in which a second base station speaks to the encoder in spite of the lease."""
    at, until = draw_interval(random, begin, end, 3.0, 20.0)
    link = HopLink(BASE, int(random.integers(1, 2**31)))

    def speak(rig: Faulty) -> None:
        link.send_best_effort(encode_message(Hello(BASE, 1, -1, NodeMode.BOOT, 1.0)), "hello")
        _send(rig, link, ENCODER, Side.UPPER)

    return [Step(float(t), speak) for t in np.arange(at, until, 1.0)]


def memory_lost_with_old_receipts(random: np.random.Generator, begin: float, end: float) -> list[Step]:
    """Steps in which a node loses its saved state, and frames sent to it before arrive again."""
    tube = drawn_tube(random)
    off, on = draw_interval(random, begin, end, 1.0, 10.0)
    old: list[bytes] = []

    def cut(rig: Faulty) -> None:
        above = (ENCODER, Side.LOWER) if tube == max(TUBES) else (tube + 1, Side.LOWER)
        old.extend(rig.channel.overheard.get(above, ()))
        rig.cut(tube)

    def start(rig: Faulty) -> None:
        delete_files(*STATE)(rig, tube, random)
        rig.start(tube)
        for frame in old:
            rig.inject(tube, Side.UPPER, frame)

    again = min(on + 5.0, end)

    def come_again(rig: Faulty) -> None:
        for frame in old:
            rig.inject(tube, Side.UPPER, frame)

    return [Step(off, cut), Step(on, start), Step(again, come_again)]


def _recorded(rig: Faulty, random: np.random.Generator) -> list[tuple[bytes, int, Side]]:
    """Draw a port and return its recorded frames with the port that they were for."""
    chain = (BASE, ENCODER, *sorted(TUBES, reverse=True))
    ports = sorted(rig.channel.overheard)
    if not ports:
        return []
    sender, side = ports[int(random.integers(len(ports)))]
    place = chain.index(sender) + (1 if side is Side.LOWER else -1)
    if not 0 <= place < len(chain):
        return []
    frames = list(rig.channel.overheard[sender, side])
    facing = Side.UPPER if side is Side.LOWER else Side.LOWER
    return [(frames[int(random.integers(len(frames)))], chain[place], facing) for _ in range(REPEATS)]


def _send(rig: Faulty, link: HopLink, address: int, side: Side) -> None:
    link.last_heard = math.inf
    for frame in link.take_frames(rig.now):
        rig.inject(address, side, frame.payload)
