"""A chain of stations over joints with troubles: base, encoder and tubes."""

import math
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sealed_string import state

from telemetry.application.delivery_rules import PRIORITIES
from telemetry.application.end_to_end import KEPT_WAIT
from telemetry.application.endpoint import Endpoint, Received
from telemetry.frozen import replace
from telemetry.media.memory import MemoryPort, joined_ports
from telemetry.media.port import PortFrame
from telemetry.messages import (
    BASE,
    ENCODER,
    EPOCH_UNKNOWN,
    Aiding,
    Command,
    Event,
    ImuMean,
    Message,
    NodeFlag,
    NodeState,
    Reply,
    Severity,
    Side,
    SurveyMeasurement,
)
from telemetry.presentation.msgpack_codec import MessageKind, encode_message, open_payload
from telemetry.transport.hop import pack_frame, parse_frame

TICK = 1.0 / 1.9
AIDING = Aiding(1.0, 1e-6, 0.0, 0.0, 0.1, 100.0, 1, 0)


def survey(tube: int, sequence: int) -> SurveyMeasurement:
    cov = ((1e-6, 0.0, 0.0), (0.0, 1e-6, 0.0), (0.0, 0.0, 1e-6))
    imu = ImuMean((0.1, 0.0, -9.8), cov)
    return SurveyMeasurement(tube, sequence, 100.0, 1, (imu,), 1.0, 1e-6, 1e-6, 32, 20.0, NodeFlag.NONE)


def arrived(port: MemoryPort, now: float) -> list[bytes]:
    """Frames that have come to a port by ``now``."""
    frames: list[bytes] = []
    port.listen(frames.append)
    port.advance(now)
    return frames


class Chain:
    """Stations from the surface down and the joints between them, on clocks of their own."""

    def __init__(self, tubes: list[int], seed: int = 0, **troubles: float) -> None:
        self.addresses = [BASE, ENCODER, *tubes]
        self.troubles = troubles
        self.stations = {address: self.build(address, 1) for address in self.addresses}
        self.joints: list[tuple[MemoryPort, MemoryPort]] = []
        for k in range(len(self.addresses) - 1):
            self.joints.append(joined_ports(seed + k, **troubles))
        self.now = 1000.0
        self.got: dict[int, list[Message]] = {address: [] for address in self.addresses}

    @staticmethod
    def build(address: int, boots: int, restored: bytes | None = None) -> Endpoint:
        sides = frozenset({Side.LOWER}) if address == BASE else frozenset(Side)
        return Endpoint(address, sides, boot_count=boots, is_clock_root=address == ENCODER, restored=restored)

    def local(self, address: int) -> float:
        return self.now if address == ENCODER else (self.now - 1000.0) * (1.0 + address * 1e-7) + 17.0 * address

    def port(self, address: int, side: Side) -> MemoryPort | None:
        place = self.addresses.index(address)
        if side is Side.UPPER:
            return self.joints[place - 1][1] if place > 0 else None
        return self.joints[place][0] if place < len(self.joints) else None

    def run(self, duration: float) -> None:
        end, cycle_at = self.now + duration, self.now
        while self.now < end:
            if self.now >= cycle_at:
                cycle_at += TICK
                for address, station in self.stations.items():
                    station.advance(self.local(address))
            for address, station in self.stations.items():
                self.exchange(address, station)
            self.now += 0.004

    def exchange(self, address: int, station: Endpoint) -> None:
        now = self.local(address)
        for side in Side:
            port = self.port(address, side)
            for frame in arrived(port, self.now) if port else []:
                for received in station.receive(side, frame, now):
                    self.take(address, station, received, now)
        for side, frame in station.take_frames(now):
            port = self.port(address, side)
            if port:
                port.send(frame)

    def take(self, address: int, station: Endpoint, received: Received, now: float) -> None:
        self.got[address].append(received.message)
        match received.message:
            case SurveyMeasurement() | Event() as kept:
                station.mail.acknowledge(kept)
            case Command() as command:
                station.mail.reply(Reply(address, command.sequence, True, command.name))
            case Aiding() as aiding:
                station.send_aiding(replace(aiding, hops=aiding.hops + 1), now)

    def surveys(self) -> list[tuple[int, int]]:
        return [(m.tube, m.sequence) for m in self.got[BASE] if isinstance(m, SurveyMeasurement)]


def test_what_is_held_back_leaves_when_it_is_released() -> None:
    chain = Chain([2, 1])
    chain.run(3.0)
    node = chain.stations[1]
    node.mail.hold()
    for k in range(3):
        node.mail.submit(
            Event(1, node.mail.series.take(), 0.0, Severity.INFO, "stopped", {"yaw_deg": float(k)}), chain.local(1)
        )
    chain.run(20.0)
    assert not [m for m in chain.got[BASE] if isinstance(m, Event)]
    assert node.mail.outbox_size == 3
    node.mail.release(chain.local(1))
    chain.run(2.0)
    assert [m.sequence for m in chain.got[BASE] if isinstance(m, Event)] == [1, 2, 3]
    assert node.mail.outbox_size == 0


def test_neighbours_and_hops_are_found_without_configuration() -> None:
    chain = Chain([3, 2, 1])
    chain.run(10.0)
    assert [chain.stations[a].place.hops for a in (ENCODER, 3, 2, 1)] == [0, 1, 2, 3]
    two = chain.stations[2].place.neighbours
    assert two[Side.UPPER] is not None
    assert two[Side.UPPER].tube == 3
    assert two[Side.LOWER] is not None
    assert two[Side.LOWER].tube == 1
    assert chain.stations[1].place.neighbours[Side.LOWER] is None


def test_a_tube_added_at_the_top_moves_all_others_down() -> None:
    chain = Chain([1])
    chain.run(6.0)
    assert chain.stations[1].place.hops == 1
    chain.addresses.insert(2, 2)
    chain.stations[2] = chain.build(2, 1)
    chain.got[2] = []
    chain.joints[1:] = [joined_ports(50), joined_ports(51)]
    chain.run(8.0)
    assert [chain.stations[a].place.hops for a in (2, 1)] == [1, 2]
    lower = chain.stations[ENCODER].place.neighbours[Side.LOWER]
    assert lower is not None
    assert lower.tube == 2


def test_a_silent_neighbour_is_noticed() -> None:
    chain = Chain([2, 1])
    chain.run(5.0)
    chain.joints[2][0].is_open = True
    chain.run(5.0)
    assert chain.stations[1].place.neighbours[Side.UPPER] is None
    assert chain.stations[2].place.neighbours[Side.LOWER] is None
    assert chain.stations[2].place.neighbours[Side.UPPER] is not None


@pytest.mark.slow
@settings(max_examples=6)
@given(seed=st.integers(0, 1000), loss=st.floats(0.0, 0.3), duplicate=st.floats(0.0, 0.3))
def test_surveys_arrive_once_each_and_are_receipted(seed: int, loss: float, duplicate: float) -> None:
    chain = Chain([4, 3, 2, 1], seed, loss=loss, duplicate=duplicate, corrupt=0.05, jitter=0.003)
    chain.run(5.0)
    for tube in (1, 2, 3, 4):
        for _ in range(3):
            station = chain.stations[tube]
            station.mail.submit(survey(tube, station.mail.series.take()), chain.local(tube))
    chain.run(60.0)
    assert sorted(set(chain.surveys())) == [(t, s) for t in (1, 2, 3, 4) for s in (1, 2, 3)]
    assert [chain.stations[t].mail.outbox_size for t in (1, 2, 3, 4)] == [0, 0, 0, 0]


def test_a_relay_that_dies_with_surveys_in_its_hands_loses_none() -> None:
    chain = Chain([3, 2, 1])
    chain.run(5.0)
    chain.joints[2][0].is_open = True  # tube 2 cannot hand on what it takes from tube 1
    chain.joints[2][1].is_open = True
    for _ in range(5):
        station = chain.stations[1]
        station.mail.submit(survey(1, station.mail.series.take()), chain.local(1))
    chain.run(2.0)
    chain.stations[2] = chain.build(2, 2, chain.stations[2].export_state())
    chain.joints[2][0].is_open = chain.joints[2][1].is_open = False
    chain.run(40.0)
    assert sorted(set(chain.surveys())) == [(1, s) for s in range(1, 6)]


def test_a_tube_that_restarts_before_its_receipt_sends_again_and_counts_on() -> None:
    chain = Chain([2, 1])
    chain.run(5.0)
    chain.joints[1][0].is_open = True
    station = chain.stations[1]
    station.mail.submit(survey(1, station.mail.series.take()), chain.local(1))
    chain.run(1.0)
    chain.stations[1] = chain.build(1, 2, chain.stations[1].export_state())
    chain.joints[1][0].is_open = False
    assert chain.stations[1].mail.series.take() == 2
    chain.run(40.0)
    assert set(chain.surveys()) == {(1, 1)}
    assert chain.stations[1].mail.outbox_size == 0


def test_a_command_is_obeyed_once_and_answered_whatever_is_lost() -> None:
    chain = Chain([2, 1], seed=3, loss=0.3, duplicate=0.3)
    chain.run(5.0)
    chain.stations[BASE].mail.command(Command(1, 77, "take_survey"), chain.local(BASE))
    chain.run(60.0)
    assert [m for m in chain.got[1] if isinstance(m, Command)] == [Command(1, 77, "take_survey")]
    assert [m for m in chain.got[BASE] if isinstance(m, Reply)] == [Reply(1, 77, True, "take_survey")]


def test_a_command_repeated_after_a_restart_is_answered_from_memory() -> None:
    chain = Chain([1])
    chain.run(5.0)
    chain.stations[BASE].mail.command(Command(1, 5, "take_survey"), chain.local(BASE))
    chain.run(5.0)
    chain.stations[1] = chain.build(1, 2, chain.stations[1].export_state())
    chain.stations[BASE] = chain.build(BASE, 2)
    chain.run(5.0)
    chain.stations[BASE].mail.command(Command(1, 5, "take_survey"), chain.local(BASE))
    chain.run(10.0)
    assert len([m for m in chain.got[1] if isinstance(m, Command)]) == 1
    assert len([m for m in chain.got[BASE] if isinstance(m, Reply)]) == 2


def test_aiding_goes_down_hop_by_hop_and_only_down() -> None:
    chain = Chain([3, 2, 1])
    chain.run(5.0)
    chain.stations[ENCODER].send_aiding(AIDING, chain.now)
    chain.run(1.0)
    for hops, tube in enumerate((3, 2, 1)):
        assert [m for m in chain.got[tube] if isinstance(m, Aiding)] == [replace(AIDING, hops=hops)]
    assert not [m for m in chain.got[BASE] if isinstance(m, Aiding)]


def test_a_relay_hands_on_the_very_bytes_that_came(monkeypatch: pytest.MonkeyPatch) -> None:
    from telemetry.application import end_to_end, endpoint

    chain = Chain([2, 1])
    chain.run(5.0)
    encoded: list[int] = []
    plain = end_to_end.encode_message

    def counted(message: Message) -> bytes:
        encoded.extend([1] if isinstance(message, Event) else [])
        return plain(message)

    for room in (endpoint, end_to_end):
        monkeypatch.setattr(room, "encode_message", counted)
    event = Event(1, chain.stations[1].mail.series.take(), 100.0, Severity.INFO, "stopped")
    chain.stations[1].mail.submit(event, chain.local(1))
    chain.run(3.0)
    assert event in chain.got[BASE]
    assert len(encoded) == 1


@pytest.mark.parametrize("frozen", [2, BASE])
@pytest.mark.parametrize("stood_still", [15.0, 1.0])
@pytest.mark.parametrize(
    ("said", "is_known_to_wait"),
    [
        ({"epoch": 1}, False),  # it tells its time
        ({"epoch": EPOCH_UNKNOWN}, True),
        ({"epoch": 1, "flags": NodeFlag.CLOCK_UNSYNCHRONISED}, True),
    ],
    ids=["dated", "without an epoch", "unsynchronised"],
)
def test_a_state_without_a_time_that_waited_in_a_process_that_stood_still_is_not_handed_on(
    frozen: int, stood_still: float, said: dict[str, Any], is_known_to_wait: bool
) -> None:
    """It would show a tube fresh that may have lost its power since; the next is due within a second."""
    chain = Chain([2, 1])
    chain.run(5.0)
    station = chain.stations.pop(frozen)
    chain.stations[1].send_state(replace(state(7), **said), chain.local(1))
    chain.run(stood_still)
    chain.stations[frozen] = station
    chain.run(3.0)
    came = [m for m in chain.got[BASE] if isinstance(m, NodeState)]
    assert len(came) == (0 if is_known_to_wait and stood_still > 2.0 else 1)
    chain.stations[1].send_state(replace(state(8), **said), chain.local(1))
    chain.run(3.0)
    assert [m.cycles for m in chain.got[BASE] if isinstance(m, NodeState)][-1] == 8


def speak(chain: Chain, periods: int, silent: int = 0) -> dict[int, int]:
    """Let every tube but ``silent`` tell its state, ``periods`` times; frames that each has heard from below."""
    heard = dict.fromkeys(chain.addresses, 0)
    taken = Endpoint.receive

    def counting(self: Endpoint, side: Side, frame: bytes, now: float, margin: float = math.inf) -> list[Received]:
        heard[self.address] += side is Side.LOWER
        return taken(self, side, frame, now, margin)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Endpoint, "receive", counting)
        for k in range(periods):
            for tube in chain.addresses[2:]:
                if tube != silent:
                    chain.stations[tube].send_state(state(k, tube), chain.local(tube))
            chain.run(2.0 * TICK)
    return heard


@pytest.mark.slow
@pytest.mark.parametrize("tubes", [4, 12])
def test_states_go_up_in_one_frame_however_long_the_string_is(tubes: int) -> None:
    chain = Chain(list(range(tubes, 0, -1)))
    chain.run(tubes + 40.0)  # until clocks are compared at the slow pace
    before, begun = len(chain.got[BASE]), chain.now
    heard = speak(chain, 20)
    cycles = (chain.now - begun) / TICK
    assert [m.tube for m in chain.got[BASE][before:] if isinstance(m, NodeState)].count(tubes) >= 19
    told = {m.tube for m in chain.got[BASE][before:] if isinstance(m, NodeState)}
    assert told == set(range(1, tubes + 1))
    for address in (ENCODER, *range(tubes, 1, -1)):
        assert heard[address] < 1.1 * cycles  # with hellos, clocks and acknowledgements; each state alone: tubes / 2


@pytest.mark.parametrize(
    ("severity", "latest", "frames"), [(Severity.INFO, KEPT_WAIT + 0.2, 1), (Severity.WARNING, 0.2, 6)]
)
def test_what_is_no_warning_goes_up_with_the_next_states(
    monkeypatch: pytest.MonkeyPatch, severity: Severity, latest: float, frames: int
) -> None:
    chain = Chain([6, 5, 4, 3, 2, 1])
    chain.run(20.0)
    speak(chain, 3)
    told, to_the_base, with_events = len(chain.got[BASE]), chain.joints[0][1], []
    put = to_the_base.send

    def counting(frame: PortFrame) -> bool:
        _, entries = parse_frame(frame.payload) or (None, [])
        with_events.extend(
            [frame] if any(open_payload(entry).kind is MessageKind.EVENT for _, entry in entries) else []
        )
        return put(frame)

    monkeypatch.setattr(to_the_base, "send", counting)
    for tube in range(6, 0, -1):
        chain.stations[tube].mail.submit(Event(tube, 1, chain.now, severity, "stopped", {}), chain.local(tube))
    if severity is Severity.INFO:
        speak(chain, 1)
    chain.run(latest)
    assert sorted(m.tube for m in chain.got[BASE][told:] if isinstance(m, Event)) == [1, 2, 3, 4, 5, 6]
    assert len(with_events) == frames


@pytest.mark.slow
def test_states_above_a_node_that_says_nothing_of_itself_come_half_as_often() -> None:
    """The newest of two leaves when the older has waited long enough."""
    chain = Chain([4, 3, 2, 1])
    chain.run(10.0)
    before = len(chain.got[BASE])
    speak(chain, 10, silent=1)
    told = [m.tube for m in chain.got[BASE][before:] if isinstance(m, NodeState)]
    assert {tube: told.count(tube) for tube in (1, 2, 3, 4)} == {1: 0, 2: 5, 3: 5, 4: 5}


@pytest.mark.slow
def test_clocks_agree_with_the_encoder_down_the_chain() -> None:
    chain = Chain([6, 5, 4, 3, 2, 1], jitter=0.3e-3)
    chain.run(120.0)
    for address in (BASE, 6, 5, 4, 3, 2, 1):
        clock = chain.stations[address].clock
        assert clock.synchronised
        error = clock.rig_from_local(chain.local(address)) - chain.now
        assert abs(error) < 4.0 * math.sqrt(clock.variance(chain.local(address))) + 2e-3  # the loop's own step is 4 ms
        assert clock.local_from_rig(clock.rig_from_local(5.0)) == pytest.approx(5.0, abs=1e-6)


@given(st.binary(max_size=100), st.sampled_from(Side))
def test_any_bytes_on_any_port_are_counted_and_dropped(frame: bytes, side: Side) -> None:
    station = Chain.build(1, 1)
    assert station.receive(side, frame, 1.0) == []
    assert sum(station.link_counters().values()) == 1


def test_every_kind_of_message_has_a_priority() -> None:
    assert set(PRIORITIES) == set(MessageKind)


def test_a_state_that_is_damaged_behind_its_tube_is_refused_where_it_is_read() -> None:
    damaged = encode_message(state(1, 7))[:-5]
    relay = Endpoint(3, frozenset({Side.UPPER, Side.LOWER}), boot_count=1)
    base = Endpoint(BASE, frozenset({Side.LOWER}), boot_count=1)
    assert relay.receive(Side.LOWER, pack_frame((4, 1 << 24 | 4, 1, 0, 0, 0), [(0, damaged)]), 10.0) == []
    for frame in (frame for side, frame in relay.take_frames(10.0) if side is Side.UPPER):
        assert base.receive(Side.LOWER, frame.payload, 10.0) == []
    assert (relay.counters["bad_payloads"], base.counters["bad_payloads"]) == (0, 1)


def test_the_states_of_a_long_string_go_up_in_one_frame() -> None:
    relay = Endpoint(160, frozenset({Side.UPPER, Side.LOWER}), boot_count=1)
    entries = [(0, encode_message(state(1, tube))) for tube in range(1, 160)]
    relay.receive(Side.LOWER, pack_frame((159, 1 << 24 | 159, 1, 0, 0, 0), []), 10.0)
    relay.send_state(state(1, 160), 10.0)
    relay.receive(Side.LOWER, pack_frame((159, 1 << 24 | 159, 2, 0, 0, 0), entries), 10.1)
    up = [frame.payload for side, frame in relay.take_frames(10.1) if side is Side.UPPER]
    (parsed,) = map(parse_frame, up)
    assert parsed is not None
    assert [open_payload(payload).origin for _, payload in parsed[1]] == list(range(1, 161))
