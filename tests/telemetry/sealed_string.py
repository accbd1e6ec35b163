"""A string of endpoints under keys: base, encoder, tubes 2 and 1, joined by hand, every frame on the wire noted."""

from __future__ import annotations

import datetime
import random
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import get_args

from borechain.pki.rig_keys import add_tube, init_rig
from telemetry.application.endpoint import Endpoint
from telemetry.application.seals import Keys, Seals
from telemetry.errors import DecodeError
from telemetry.frozen import replace
from telemetry.messages import (
    BASE,
    ENCODER,
    Aiding,
    BlockSegment,
    BlockStatus,
    Command,
    Event,
    ImuMean,
    Kept,
    Message,
    NodeFlag,
    NodeMode,
    NodeState,
    Reply,
    Severity,
    Side,
    StaticRecord,
    SurveyMeasurement,
    UploadPhase,
)
from telemetry.presentation.msgpack_codec import open_payload
from telemetry.schema import MessageKind
from telemetry.transport.hop import parse_frame
from telemetry.transport.joint_seal import HEAD, OVERHEAD
from telemetry.transport.key_ring import key_file
from telemetry.transport.seal import TAG_SIZE

ORDER = (BASE, ENCODER, 2, 1)  # from the surface down
TICK = 0.1  # s
NOW = datetime.datetime(2026, 5, 4, 6, tzinfo=datetime.UTC)
COV = ((1e-6, 0.0, 0.0), (0.0, 1e-6, 0.0), (0.0, 0.0, 1e-6))
End = tuple[int, Side]


def make_folder(folder: Path, tubes: int = 2, now: datetime.datetime = NOW) -> Path:
    """Keys of a rig; whose certificates are shown to a real router, is made ``now``."""
    init_rig(folder, "rig-1", now, random.Random(1).randbytes)
    for tube in range(1, tubes + 1):
        add_tube(folder, tube, now)
    return folder


class SealedString:
    """Steps the endpoints; the base acknowledges, tubes relay the aiding and answer orders."""

    def __init__(self, folder: Path, *, sealed: bool = True) -> None:
        self.folder = folder
        self.sealed = sealed
        self.random = random.Random(2)
        self.evidence: list[bytes] = []  # frames that an attacker has recorded
        self.now = 100.0
        self.boots = dict.fromkeys(ORDER, 1)
        self.endpoints: dict[int, Endpoint] = {}
        self.heard: dict[int, list[Message]] = {address: [] for address in ORDER}
        self.wire: dict[End, list[bytes]] = {(address, side): [] for address in ORDER for side in Side}
        self.measured = self.cycles = self.number = 0
        self.talking = False  # tube 1 tells its state
        self.open_joints: set[End] = set()
        for address in ORDER:
            self.start(address, new=True)

    def start(self, address: int, *, new: bool = False) -> None:
        """Start a process, as after a power cut; what its disk keeps it has."""
        restored = None if new or address == BASE else self.endpoints[address].export_state()
        self.boots[address] += not new
        sides = frozenset({Side.LOWER}) if address == BASE else frozenset(Side)
        lot = partial(self.random.getrandbits, 64)
        seals = Seals(Keys(key_file(self.folder, address), address), address, sides, lot) if self.sealed else None
        self.endpoints[address] = Endpoint(
            address,
            sides,
            boot_count=self.boots[address],
            is_clock_root=address == ENCODER,
            restored=restored,
            seals=seals,
        )

    def seals(self, address: int) -> Seals:
        seals = self.endpoints[address].seals
        assert seals is not None
        return seals

    def run(self, duration: float, until: Callable[[], bool] = lambda: False) -> None:
        """Let time pass."""
        end = self.now + duration
        while self.now < end and not until():
            self.now += TICK
            self._measure()
            for endpoint in self.endpoints.values():
                endpoint.advance(self.now)
            self._carry()

    def settle(self) -> None:
        """Run until every joint and session is there and every outbox is empty."""
        self.talking = True
        self.run(8.0)
        self.talking = False
        self.run(1.0)
        assert all(self.endpoints[address].mail.outbox_size == 0 for address in (2, 1))

    def say(self, kind: MessageKind) -> None:
        """Have a message of a kind said by who says it: tube 1, or the base to tube 1."""
        tube, base = self.endpoints[1], self.endpoints[BASE]
        self.number += 1
        if kind is MessageKind.NODE_STATE:
            self.cycles += 1
            tube.send_state(state(self.cycles), self.now)
        elif kind in (MessageKind.SURVEY_MEASUREMENT, MessageKind.RECEIPT):
            tube.mail.submit(survey(1, tube.mail.series.take()), self.now)
        elif kind is MessageKind.EVENT:
            tube.mail.submit(Event(1, tube.mail.series.take(), self.now, Severity.INFO, "said"), self.now)
        elif kind is MessageKind.STATIC_RECORD:
            v = (0.0, 0.0, 0.0)
            tube.mail.submit(
                StaticRecord(1, tube.mail.series.take(), 1, 1.0, 2.0, 5, v, COV, v, COV, 20.0, False), self.now
            )
        elif kind in (MessageKind.COMMAND, MessageKind.REPLY):
            base.mail.command(Command(1, self.number, "take_survey"), self.now)
        elif kind in (MessageKind.BLOCK_SEGMENT, MessageKind.BLOCK_STATUS):
            base.mail.send_segment(BlockSegment(1, self.number, 1, bytes(32), 1, 0, b"x", bytes(32)))

    def inject(self, end: End, frame: bytes) -> None:
        """A frame from nowhere arrives at one end, and what follows of it."""
        self._deliver(end, frame)
        self._carry()

    def end_of(self, kind: MessageKind) -> End:
        """Where frames with messages of a kind arrive first."""
        if kind in (MessageKind.AIDING, MessageKind.TIME_REPLY, MessageKind.HELLO):
            return 1, Side.UPPER
        if kind is MessageKind.TIME_REQUEST:
            return 2, Side.LOWER
        return (1, Side.UPPER) if kind in DOWN else (BASE, Side.LOWER)

    def frames_with(self, kind: MessageKind) -> list[bytes]:
        """Frames that brought a message of a kind to where it was for."""
        return [frame for frame in self.wire[self.end_of(kind)] if kind in kinds_in(frame)]

    def counts(self) -> dict[str, int]:
        """What every process has refused."""
        total: dict[str, int] = {}
        for address in ORDER:
            for name, count in self.seals(address).failures().items():
                total[name] = total.get(name, 0) + count
            if bad := self.endpoints[address].counters["bad_payloads"]:
                total["no_message"] = total.get("no_message", 0) + bad
        return total

    def counts_of(self, address: int) -> dict[str, int]:
        """What one process has refused."""
        return self.seals(address).failures()

    def effects(self) -> object:
        """Everything that a message could have changed."""
        return (
            {address: list(messages) for address, messages in self.heard.items()},
            {a: (e.mail.outbox_size, e.clock.exchanges, e.place.hops, e.mode) for a, e in self.endpoints.items()},
            {
                a: [n and (n.tube, n.boot_count, n.hops) for n in e.place.neighbours.values()]
                for a, e in self.endpoints.items()
            },
        )

    def _measure(self) -> None:
        if round(self.now / TICK) % 5 == 0:
            self.measured += 1
            self.endpoints[ENCODER].send_aiding(aiding(self.measured, self.now), self.now)
            if self.talking:
                self.say(MessageKind.NODE_STATE)

    def _carry(self) -> None:
        for _ in range(60):
            sent = [(a, side, f) for a, e in self.endpoints.items() for side, f in e.take_frames(self.now)]
            if not sent:
                return
            for address, side, frame in sent:
                end = other_end(address, side)
                if end is not None and not {(address, side), end} & self.open_joints:
                    self._deliver(end, frame.payload)
        raise AssertionError("the endpoints answer each other for ever")

    def _deliver(self, end: End, frame: bytes) -> None:
        address, side = end
        self.wire[end].append(frame)
        endpoint = self.endpoints[address]
        for received in endpoint.receive(side, frame, self.now):
            message = received.message
            if isinstance(message, get_args(Kept)) and message in self.heard[address]:
                endpoint.mail.acknowledge(message)  # stored already, by number and content
                continue
            if not isinstance(message, Aiding):
                self.heard[address].append(message)
            if address == BASE and isinstance(message, get_args(Kept)):
                endpoint.mail.acknowledge(message)
            elif isinstance(message, Command):
                endpoint.mail.reply(Reply(address, message.sequence, True, ""))
            elif isinstance(message, BlockSegment):
                endpoint.mail.send_status(
                    BlockStatus(1, message.sequence, bytes(32), UploadPhase.PARTIAL, 1, 0, bytes(32), "")
                )
            elif isinstance(message, Aiding):
                self.heard[address][:] = [m for m in self.heard[address] if not isinstance(m, Aiding)] + [message]
                endpoint.send_aiding(replace(message, offset=message.offset + 0.1, hops=message.hops + 1), self.now)


DOWN = (MessageKind.RECEIPT, MessageKind.COMMAND, MessageKind.BLOCK_SEGMENT, MessageKind.SESSION_OFFER)


def other_end(address: int, side: Side) -> End | None:
    """The end that one looks into."""
    place = ORDER.index(address) + (1 if side is Side.LOWER else -1)
    return (ORDER[place], Side(1 - side)) if 0 <= place < len(ORDER) else None


def kinds_in(frame: bytes) -> set[MessageKind]:
    """Kinds of the messages in a sealed frame."""
    return {kind for kind, _ in messages_in(frame)}


def messages_in(frame: bytes) -> Iterator[tuple[MessageKind, bytes]]:
    """Kind and payload of each message in a sealed frame."""
    parsed = parse_frame(frame[HEAD.size : -TAG_SIZE]) if len(frame) > OVERHEAD else None
    for _, payload in parsed[1] if parsed else ():
        try:
            yield open_payload(Seals.content(payload)).kind, payload
        except DecodeError:
            continue


def aiding(number: int, at: float) -> Aiding:
    return Aiding(0.001 * (number % 1000), 1e-8, 0.0, 0.0, 0.1, at, number, 0, epoch=1)


def survey(tube: int, number: int) -> SurveyMeasurement:
    return SurveyMeasurement(
        tube, number, 5.0, 2, (ImuMean((0.1, -0.2, -9.8), COV),), 1.0, 1e-6, 2e-6, 32, 18.5, NodeFlag.NONE
    )


def state(cycles: int, tube: int = 1) -> NodeState:
    v = (0.0, 0.0, 0.0)
    return NodeState(
        tube, 5.0, 2, NodeMode.TRACKING, 1.0, 1e-6, 1e-6, v, 0.0, 0.0, 1e-7, 0.5, 1e-9, NodeFlag.NONE, cycles, 0
    )
