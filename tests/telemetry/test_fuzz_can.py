"""Whatever comes on a CAN joint: no end raises, nothing grows, and what is honest still arrives.

The inputs are frames that an encoder and a tube have sent over the joint, in both profiles, classic and FD: their
identifiers and their data are damaged, cut, lengthened, said again and taken for others. Among them are whole transfers
of frames of the link whose headers say odd things. One thing alone is left out: an older controller with the number
of an end, which then falls silent, as it must.
"""

from __future__ import annotations

import random
from collections import deque
from collections.abc import Iterator

import pytest
from sealed_string import state, survey

from telemetry.application.endpoint import Endpoint
from telemetry.media.can_exchange import SILENCE, CanData, CanExchange
from telemetry.media.can_identifier import PRESENCE, TUNNEL, Identifier
from telemetry.media.isotp import FlowStatus, Sender, flow_control
from telemetry.media.port import MAX_FRAME, Priority
from telemetry.media.send_queue import SEND_LIMIT, SendQueue
from telemetry.messages import ENCODER, Side
from telemetry.presentation.can_messages import NATIVE
from telemetry.presentation.can_native import NativeProfile, open_profile
from telemetry.presentation.msgpack_codec import HIGHEST_ADDRESS
from telemetry.transport.hop import QUEUE_LIMIT, WINDOW, pack_frame

STEP = 0.01  # s
COUNTERS_AT_MOST = 60
TUBE = 1


class Joint:
    """The lower end of an encoder and the upper one of a tube."""

    def __init__(self, *, native: bool, largest: int) -> None:
        self.now = 100.0
        self.encoder = Endpoint(ENCODER, frozenset(Side), boot_count=1, is_clock_root=True)
        self.tube = Endpoint(TUBE, frozenset({Side.UPPER}), boot_count=1)
        self.said: deque[CanData] = deque(maxlen=200)
        self.exchanges = [
            CanExchange(
                endpoint.address,
                largest,
                SendQueue(MAX_FRAME),
                endpoint.address,
                self.now,
                open_profile() if native else None,
            )
            for endpoint in (self.encoder, self.tube)
        ]
        self._ends = [
            (self.exchanges[0], self.encoder, Side.LOWER),
            (self.exchanges[1], self.tube, Side.UPPER),
        ]
        for _, endpoint, side in self._ends:
            endpoint.limit_bundles(side, 0)

    def run(self, duration: float) -> None:
        """Let both speak."""
        until = self.now + duration
        while self.now < until:
            self.now += STEP
            for exchange, endpoint, side in self._ends:
                endpoint.advance(self.now)
                exchange.advance(self.now)
                for of, frame in endpoint.take_frames(self.now):
                    if of is side:
                        exchange.queue.offer(frame)
            while sum(map(self._send, range(2))):
                pass

    def hear(self, number: int, frame: CanData) -> None:
        """A frame comes at one end."""
        exchange, endpoint, side = self._ends[number]
        payload = exchange.on_frame(frame.identifier, frame.data, self.now)
        if payload is not None:
            endpoint.receive(side, payload, self.now)

    def _send(self, number: int) -> bool:
        exchange, other = self.exchanges[number], 1 - number
        frame = exchange.next_frame(self.now)
        if frame is not None:
            self.said.append(frame)
            self.hear(other, frame)
            exchange.on_acknowledged(self.now)
        return frame is not None


def damaged(lot: random.Random, frame: CanData, other: CanData) -> CanData:
    """A frame that was never sent."""
    identifier, data = frame
    match lot.randrange(7):
        case 0:
            identifier = lot.getrandbits(29)
        case 1:
            identifier ^= 1 << lot.randrange(29)
        case 2 if data:
            changed = bytearray(data)
            changed[lot.randrange(len(changed))] ^= 1 << lot.randrange(8)
            data = bytes(changed)
        case 3:
            data = data[: lot.randrange(len(data) + 1)]
        case 4:
            data = lot.randbytes(lot.randrange(65))
        case 5:
            data = other.data
    return CanData(identifier, data)


def mutes(frame: CanData, address: int) -> bool:
    """Whether a frame may be the sign of life of another end of this number."""
    identifier = Identifier.unpack(frame.identifier)
    return identifier is not None and (identifier.type, identifier.source) == (PRESENCE, address)


def odd_transfer(lot: random.Random, source: int, largest: int) -> Iterator[CanData]:
    """A frame of the link by ISO-TP that is whole, but for what its header says."""
    header = [lot.choice((0, 1, source, 255, 256, 2**31, 2**63, lot.getrandbits(40))) for _ in range(6)]
    sender = Sender(pack_frame(header, []), largest)
    while not sender.is_done:
        if sender.awaits_flow:
            sender.on_flow(flow_control(FlowStatus.CONTINUE))
        yield CanData(Identifier(Priority.COMMAND, TUNNEL, source).pack(), sender.next_frame())


def fuzz(inputs: int, *, native: bool, largest: int) -> None:
    lot = random.Random(13)
    joint = Joint(native=native, largest=largest)
    joint.run(3.0)
    joint.tube.mail.submit(survey(TUBE, joint.tube.mail.series.take()), joint.now)
    joint.tube.send_state(state(1), joint.now)
    joint.run(3.0)
    assert joint.encoder.waiting == 1  # the survey, on its way to the surface
    honest = list(joint.said)
    for number in range(inputs):
        end = lot.randrange(2)
        made = damaged(lot, lot.choice(honest), lot.choice(honest))
        if not mutes(made, joint.exchanges[end].address):
            joint.hear(end, made)
        if number % 50 == 0:
            for frame in odd_transfer(lot, joint.exchanges[1 - end].address, largest):
                joint.hear(end, frame)
        if number % 200 == 0:
            joint.run(0.1)
    for exchange in joint.exchanges:
        if isinstance(exchange.profile, NativeProfile):
            assert max(exchange.profile._epoch.keys() | exchange.profile._count.keys()) <= HIGHEST_ADDRESS
            assert len(exchange.profile._parts) <= len(NATIVE)
        assert len(exchange.counters) < COUNTERS_AT_MOST
        assert max(len(exchange._incoming), len(exchange._outgoing), len(exchange._answers)) <= len(Priority)
        assert len(exchange.queue) <= SEND_LIMIT
    for endpoint in (joint.encoder, joint.tube):
        assert len(endpoint.link_counters()) < COUNTERS_AT_MOST
        assert endpoint.waiting <= 2 * (QUEUE_LIMIT + WINDOW)
    joint.now += 2.0 * SILENCE  # what was taken for the other end is forgotten
    joint.run(20.0)
    before = joint.encoder.waiting
    joint.tube.mail.submit(survey(TUBE, joint.tube.mail.series.take()), joint.now)
    joint.run(5.0)
    assert joint.tube.waiting == 0
    assert joint.encoder.waiting == min(before + 1, QUEUE_LIMIT)


KINDS = pytest.mark.parametrize("native", [True, False], ids=["native", "tunnel"])
FRAMES = pytest.mark.parametrize("largest", [8, 64], ids=["classic", "fd"])


@pytest.mark.slow
@KINDS
@FRAMES
def test_a_damaged_frame_on_a_joint_stops_nobody(native: bool, largest: int) -> None:
    fuzz(300_000, native=native, largest=largest)


@pytest.mark.statistical
@pytest.mark.timeout(3600)
@KINDS
@FRAMES
def test_millions_of_damaged_frames_on_a_joint_stop_nobody(native: bool, largest: int) -> None:
    fuzz(3_000_000, native=native, largest=largest)
