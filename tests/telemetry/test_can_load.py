"""The load table beside the bus itself, and a slow joint that thins node states out; all in simulated time."""

from __future__ import annotations

import datetime
from pathlib import Path

import pytest

from borechain.pki.rig_keys import add_tube, init_rig
from sim.can.wire import CanWire
from telemetry.application.can_load import AIDING, CYCLE, HEADER, STATE, bus_load, load_table, steady_traffic
from telemetry.application.end_seal import content_of_sealed
from telemetry.application.seals import Seals, seals_of
from telemetry.frozen import replace
from telemetry.media.can_exchange import CanExchange
from telemetry.media.can_frame import EXTENDED, IDENTIFIER, CanFrame
from telemetry.media.can_timing import BitRates
from telemetry.media.port import MAX_FRAME, PortFrame, Priority
from telemetry.media.send_queue import SendQueue
from telemetry.messages import Aiding, Hello, NodeState, Side, TimeReply, TimeRequest
from telemetry.presentation.can_native import open_profile
from telemetry.presentation.msgpack_codec import decode_message, encode_message
from telemetry.transport.hop import Header, pack_frame, parse_frame

RATES = BitRates(125_000.0, 500_000.0)


class SimulatedJoint:
    """Two ends on a paced wire; payloads go in as frames of a link, one message each."""

    def __init__(self, profile: str, *, fd: bool, thins: bool = False, keys: Path | None = None) -> None:
        self.wire, self.now, self.fd = CanWire(RATES), 0.0, fd
        known = RATES if thins else None
        self.ends = [
            CanExchange(
                address, 64 if fd else 8, SendQueue(MAX_FRAME), address, 0.0,
                open_profile() if profile == "native" else None, known,
            )
            for address in (0, 1)
        ]  # fmt: skip
        for address in (0, 1):
            self.wire.attach(address, fd=True, hears_itself=True)
        self.heard: list[list[tuple[float, object]]] = [[], []]
        self._number = [HEADER.number, HEADER.number]  # of a string that has drilled for days, as in the table
        self.seals = None if keys is None else met(keys)

    def send(self, end: int, message: object, priority: Priority, topic: object, *, kept: bool = False) -> None:
        self._number[end] += 1
        header: Header = HEADER._replace(sender=end, number=self._number[end])
        number = self._number[end] if kept else 0
        if self.seals is not None and isinstance(message, Aiding):
            message = self.seals[end].measurement.close(message)
        content = encode_message(message)  # type: ignore[arg-type]
        if self.seals is not None and isinstance(message, NodeState):
            content = self.seals[end].close_up(content)
        self.ends[end].queue.offer(
            PortFrame(self._sealed(end, pack_frame(header, [(number, content)])), priority, topic)
        )

    def _sealed(self, end: int, payload: bytes) -> bytes:
        if self.seals is None:
            return payload
        (sealed,) = self.seals[end].frames_of(SIDES[end], [PortFrame(payload)], self.now)
        return sealed.payload

    def _opened(self, end: int, payload: bytes) -> bytes | None:
        return payload if self.seals is None else self.seals[end].joints[SIDES[end]].open(payload, self.now)

    def run(self, until: float, tick: float = 2e-4) -> None:
        while self.now < until:
            for end in self.ends:
                end.advance(self.now)
                if (frame := end.next_frame(self.now)) is not None:
                    data = CanFrame(EXTENDED | frame.identifier, frame.data, self.fd)
                    self.wire.submit(end.address, data, self.now)
            for to, frame_ in self.wire.advance(self.now):
                self._deliver(int(str(to)), frame_)
            self.now = min(max(self.wire.due(), self.now + 1e-6), self.now + tick)

    def _deliver(self, to: int, frame: CanFrame) -> None:
        if frame.is_error:
            return
        if frame.own:
            self.ends[to].on_acknowledged(self.now)
            return
        payload = self.ends[to].on_frame(frame.can_id & IDENTIFIER, frame.data, self.now)
        opened = self._opened(to, payload) if payload is not None else None
        parsed = parse_frame(opened) if opened is not None else None
        for _, content in parsed[1] if parsed is not None else []:
            self.heard[to].append((self.now, decode_message(content_of_sealed(bytes(content)))))


SIDES = (Side.LOWER, Side.UPPER)  # of the joint, of the encoder above and the tube below


def met(keys: Path) -> list[Seals]:
    """Seals of both ends, which know each other's sessions at time 0."""
    seals = []
    for address in (0, 1):
        made = seals_of(keys, address, Side)
        assert made is not None
        seals.append(made)
    for _ in range(4):
        for end in (0, 1):
            for frame in seals[end].joints[SIDES[end]].own_frames(0.0):
                seals[1 - end].joints[SIDES[1 - end]].open(frame, 0.0)
    return seals


@pytest.fixture(scope="module")
def keys(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder, now = tmp_path_factory.mktemp("stick") / "stick", datetime.datetime.now(datetime.UTC)
    init_rig(folder, "rig-1", now)
    add_tube(folder, 1, now)
    return folder


PRIORITY = {Hello: Priority.HELLO, TimeRequest: Priority.TIME, TimeReply: Priority.TIME, NodeState: Priority.STATE}


def drill(joint: SimulatedJoint, tubes: int, seconds: float) -> None:
    """The traffic of the table: cycles, and within each every second what is not sent each cycle."""
    joint.run(0.2)
    joint.wire.busy = 0.0
    begin, cycle = joint.now, 0
    others = [t for t in steady_traffic(tubes) if t.message is not AIDING and t.message is not STATE]
    sent = dict.fromkeys(range(len(others)), 0)
    while joint.now < begin + seconds:
        joint.send(0, replace(AIDING, sequence=AIDING.sequence + cycle), Priority.AIDING, "aiding")
        for tube in range(1, tubes + 1):
            joint.send(1, replace(STATE, tube=tube, cycles=STATE.cycles + cycle), Priority.STATE, ("state", tube))
        for number, traffic in enumerate(others):
            while sent[number] < traffic.rate * (joint.now - begin):
                sent[number] += 1
                priority = PRIORITY[type(traffic.message)]
                joint.send(sent[number] % 2, traffic.message, priority, (type(traffic.message), sent[number]))
        cycle += 1
        joint.run(begin + cycle * CYCLE)


@pytest.mark.slow
@pytest.mark.parametrize("seconds", [12.0, pytest.param(20.0, marks=pytest.mark.statistical)])
@pytest.mark.parametrize(("profile", "fd", "tubes"), [
    ("tunnel", True, 10), ("tunnel", True, 25), ("tunnel", False, 5), ("native", True, 25), ("native", False, 15),
])  # fmt: skip
def test_the_table_is_what_the_bus_carries(profile: str, fd: bool, tubes: int, seconds: float) -> None:
    joint = SimulatedJoint(profile, fd=fd)
    drill(joint, tubes, seconds)
    measured = joint.wire.busy / (joint.now - 0.2)
    assert measured == pytest.approx(bus_load(steady_traffic(tubes), profile, RATES, fd=fd), rel=0.05)


@pytest.mark.slow
def test_the_table_is_what_the_bus_carries_under_keys(keys: Path) -> None:
    joint = SimulatedJoint("native", fd=True, keys=keys)
    drill(joint, 10, 10.0)
    measured = joint.wire.busy / (joint.now - 0.2)
    assert measured == pytest.approx(bus_load(steady_traffic(10), "native", RATES, fd=True, sealed=True), rel=0.05)


@pytest.mark.slow
def test_fifty_tubes_on_a_slow_joint_thin_themselves_under_keys(keys: Path) -> None:
    joint = SimulatedJoint("native", fd=True, thins=True, keys=keys)
    drill(joint, 50, 10.0)
    assert bus_load(steady_traffic(50), "native", RATES, fd=True, sealed=True) > 0.8
    assert joint.wire.busy / (joint.now - 0.2) <= 0.6
    assert len([m for _, m in joint.heard[1] if isinstance(m, Aiding)]) >= 10.0 / CYCLE - 2


@pytest.mark.slow
@pytest.mark.parametrize(
    ("profile", "fd", "seconds"),
    [
        pytest.param("tunnel", False, 30.0, marks=pytest.mark.statistical),
        pytest.param("tunnel", True, 30.0, marks=pytest.mark.statistical),
        pytest.param("native", False, 30.0, marks=pytest.mark.statistical),
        ("tunnel", True, 12.0),
        ("native", False, 12.0),
    ],
)
def test_fifty_tubes_on_a_slow_joint_thin_themselves_and_lose_nothing_kept(
    profile: str, fd: bool, seconds: float
) -> None:
    joint = SimulatedJoint(profile, fd=fd, thins=True)
    for k in range(12):
        joint.send(1, replace(STATE, tube=200, cycles=k), Priority.SURVEY, None, kept=True)
    drill(joint, 50, seconds)
    assert bus_load(steady_traffic(50), profile, RATES, fd=fd) > 0.8
    assert joint.wire.busy / (joint.now - 0.2) <= 0.6
    states = [m for _, m in joint.heard[0] if isinstance(m, NodeState)]
    assert [m.cycles for m in states if m.tube == 200] == list(range(12))
    counts = [sum(m.tube == tube for m in states) for tube in range(1, 51)]
    assert 2 * min(counts) + 2 >= max(counts) > 2  # none is heard less than half as often as another
    aidings = [m.sequence for _, m in joint.heard[1] if hasattr(m, "sequence")]
    assert len(aidings) >= seconds / CYCLE - 2
    assert not {"dropped", "no_flow_control", "out_of_order"} & set(joint.ends[1].counters)


def test_the_table_has_every_combination_and_falls_with_the_bit_rate() -> None:
    rows = list(load_table((10, 50), (125e3, 1e6), 4.0))
    assert len(rows) == 2 * 2 * 2 * 2
    by_case = {row[:4]: row[4] for row in rows}
    assert by_case[10, "tunnel", "classic", 125e3] == pytest.approx(8 * by_case[10, "tunnel", "classic", 1e6])
    for frames in ("classic", "fd"):
        assert by_case[50, "native", frames, 125e3] < by_case[50, "tunnel", frames, 125e3]
    assert by_case[50, "tunnel", "classic", 125e3] > 1.0
