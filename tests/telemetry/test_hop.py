"""The link of one joint under every trouble a joint can have."""

import math
import zlib

import msgpack
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from telemetry.media.memory import MemoryPort, joined_ports
from telemetry.media.port import MAX_FRAME, Priority
from telemetry.transport.hop import (
    ACK_DELAY,
    ACKNOWLEDGEMENT,
    BEST_EFFORT_LIMIT,
    BUNDLE_LIMIT,
    QUEUE_LIMIT,
    SESSION_MASK,
    SESSION_SHIFT,
    SILENCE,
    WINDOW,
    Header,
    HopLink,
    pack_frame,
    parse_frame,
)


def arrived(port: MemoryPort, now: float) -> list[bytes]:
    """Frames that have come to a port by ``now``."""
    frames: list[bytes] = []
    port.listen(frames.append)
    port.advance(now)
    return frames


class Pair:
    """Two links over one joint, on one clock."""

    def __init__(self, seed: int = 0, **troubles: float) -> None:
        self.ports = joined_ports(seed, **troubles)
        self.links = [HopLink(1, 1), HopLink(2, 1)]
        self.got: list[list[bytes]] = [[], []]
        self.now = 100.0

    def run(self, duration: float, *, beat: float = 0.25) -> None:
        """Let time pass in small steps; both ends say a best-effort beat now and then, as stations do."""
        end = self.now + duration
        beat_at = self.now
        while self.now < end:
            if self.now >= beat_at:
                beat_at += beat
                for link in self.links:
                    link.send_best_effort(b"beat", "beat")
            for k, (link, port) in enumerate(zip(self.links, self.ports, strict=True)):
                for frame in arrived(port, self.now):
                    self.got[k].extend(p for p in link.receive(frame, self.now) if p != b"beat")
                for frame in link.take_frames(self.now):
                    port.send(frame)
            self.now += 0.005


def payloads(count: int) -> list[bytes]:
    return [b"payload %d" % k for k in range(count)]


@pytest.mark.slow
@settings(max_examples=25)
@given(
    seed=st.integers(0, 1000),
    loss=st.floats(0.0, 0.5),
    duplicate=st.floats(0.0, 0.5),
    corrupt=st.floats(0.0, 0.3),
    jitter=st.floats(0.0, 0.05),
    count=st.integers(1, 150),
)
def test_nothing_is_lost_and_nothing_comes_twice(
    seed: int, loss: float, duplicate: float, corrupt: float, jitter: float, count: int
) -> None:
    pair = Pair(seed, loss=loss, duplicate=duplicate, corrupt=corrupt, jitter=jitter)
    for payload in payloads(count):
        pair.links[0].send_reliable(payload)
        pair.links[1].send_reliable(payload + b" back")
    pair.run(60.0)
    assert sorted(pair.got[1]) == sorted(payloads(count))
    assert sorted(pair.got[0]) == sorted(p + b" back" for p in payloads(count))
    assert pair.links[0].waiting == pair.links[1].waiting == 0


def test_a_restarted_peer_gets_what_it_had_not_acknowledged() -> None:
    pair = Pair(loss=0.2)
    pair.run(1.0)
    for payload in payloads(20):
        pair.links[0].send_reliable(payload)
    pair.run(0.02)
    pair.links[1] = HopLink(2, 2)
    before = len(pair.got[1])
    pair.run(20.0)
    assert set(pair.got[1]) == set(payloads(20))
    assert len(pair.got[1][before:]) == len(set(pair.got[1][before:]))


def test_a_restarted_sender_is_understood_at_once() -> None:
    pair = Pair()
    pair.links[0].send_reliable(b"one")
    pair.run(1.0)
    pair.links[0] = HopLink(1, 2)
    pair.links[0].send_reliable(b"two")
    pair.run(1.0)
    assert pair.got[1] == [b"one", b"two"]


def passed(sender: HopLink, other: HopLink, now: float) -> list[bytes]:
    """What the other end gets of what is due, where a beat goes each way before and an acknowledgement after."""
    got: list[bytes] = []
    for one, two, at in ((other, sender, now), (sender, other, now), (other, sender, now + ACK_DELAY)):
        one.send_best_effort(b"beat", "beat")
        for frame in one.take_frames(at):
            got += [payload for payload in two.receive(frame.payload, at) if payload != b"beat"]
    return got


def test_a_frame_of_a_session_that_has_ended_has_no_number_counted_anew() -> None:
    """A port that was blocked hands urgent frames on first: those of the session before come after."""
    sender, first, second = HopLink(1, 1), HopLink(2, 1), HopLink(2, 2)
    passed(sender, first, 100.0)
    for payload in payloads(8):
        sender.send_reliable(payload)
    stale = sender.take_frames(101.0)
    assert passed(sender, second, 101.0) == payloads(8)
    for frame in stale:
        assert second.receive(frame.payload, 101.1) == []
    assert second.counters["stale_frames"] == len(stale) > 0
    for payload in payloads(16)[8:]:
        sender.send_reliable(payload)
    assert passed(sender, second, 101.2) == payloads(16)[8:]
    assert sender.waiting == 0


def test_a_session_that_was_made_up_keeps_nobody_out_for_long() -> None:
    peer, other = HopLink(1, 1), HopLink(2, 1)
    passed(peer, other, 100.0)
    forged = pack_frame(Header(1, 1 << 24 | 500 << 8 | 1, 1, other.epoch, 0, 0), [])
    other.receive(forged, 100.1)
    peer.send_reliable(b"kept")
    assert passed(peer, other, 100.2) == []
    assert passed(peer, other, 100.2 + SILENCE) == [b"kept"]


def test_who_met_another_meanwhile_gets_everything_again_and_from_one_on() -> None:
    """Both ends, in both roles: a stranger's frame has one of them forget the numbers of the other."""
    upper, lower, stranger = HopLink(1, 1), HopLink(2, 1), HopLink(9, 1)
    passed(upper, lower, 100.0)
    for place in range(2 * WINDOW):
        upper.send_reliable(b"down %d" % place)
        lower.send_reliable(b"up %d" % place)
        assert passed(upper, lower, 101.0 + 0.1 * place) == [b"up %d" % place, b"down %d" % place]
    stranger.send_best_effort(b"forged", "forged")
    for frame in stranger.take_frames(120.0):
        lower.receive(frame.payload, 120.0)
    got: list[bytes] = []
    for place in range(2 * WINDOW, 4 * WINDOW):
        upper.send_reliable(b"down %d" % place)
        lower.send_reliable(b"up %d" % place)
        for beat in range(2):
            got += passed(upper, lower, 100.0 + 0.2 * place + 0.1 * beat)
    for kind in (b"down", b"up"):
        came = [payload for payload in got if payload.startswith(kind)]
        assert came == [kind + b" %d" % place for place in range(2 * WINDOW, 4 * WINDOW)]
    assert upper.waiting == lower.waiting == 0
    sessions = [link.epoch >> SESSION_SHIFT & SESSION_MASK for link in (upper, lower)]
    assert sessions == [1, 2]  # once each for what was forgotten, and once more for the stranger


@pytest.mark.parametrize("acknowledged", [0, 6, 7, 8])
def test_a_new_session_that_has_all_it_acknowledged_leaves_our_numbers_alone(acknowledged: int) -> None:
    """Seven were acknowledged and an eighth is on its way."""
    sender, other = HopLink(1, 1), HopLink(2, 1)
    passed(sender, other, 100.0)
    for payload in payloads(7):
        sender.send_reliable(payload)
    assert passed(sender, other, 101.0) == payloads(7)
    sender.send_reliable(b"eighth")
    sender.take_frames(101.5)
    before = sender.epoch
    for session, place in ((1, 1), (1, 2)):
        sender.receive(pack_frame(Header(2, 1 << 24 | session << 8 | 2, place, before, acknowledged, 0), []), 101.6)
        assert (sender.epoch != before) is (acknowledged < 7), place
    assert sender.waiting == (0 if acknowledged == 8 else 1)


def test_what_is_not_acknowledged_is_said_again_after_pauses_that_double_up_to_two_seconds() -> None:
    sender, other = HopLink(1, 1), HopLink(2, 1)
    passed(sender, other, 100.0)
    sender.send_reliable(b"lost")
    said = []
    for now in np.arange(101.0, 107.5, 0.01).round(2).tolist():
        other.send_best_effort(b"beat", "beat")
        for frame in other.take_frames(now):
            sender.receive(frame.payload, now)
        said += [now] * sum(b"lost" in entries_of(frame.payload) for frame in sender.take_frames(now))
    np.testing.assert_allclose(np.diff(said), [0.06, 0.12, 0.24, 0.48, 0.96, 1.92, 2.0], atol=0.0101)


def test_another_tube_at_the_joint_gets_what_waits() -> None:
    pair = Pair()
    pair.run(1.0)
    pair.ports[0].is_open = True
    pair.links[0].send_reliable(b"waiting")
    pair.run(SILENCE + 1.0)
    pair.links[1] = HopLink(7, 1)
    pair.got[1].clear()
    pair.ports[0].is_open = False
    pair.run(2.0)
    assert pair.got[1] == [b"waiting"]


def test_a_silent_peer_is_not_shouted_at_and_memory_stays_bounded() -> None:
    pair = Pair()
    pair.run(1.0)
    pair.ports[0].is_open = True
    pair.run(SILENCE + 1.0)
    sent = pair.links[0].counters["frames_sent"]
    for payload in payloads(3 * QUEUE_LIMIT):
        pair.links[0].send_reliable(payload)
    pair.run(10.0, beat=math.inf)
    assert pair.links[0].counters["frames_sent"] <= sent + 1
    assert pair.links[0].waiting <= QUEUE_LIMIT + 64
    assert pair.links[0].counters["reliable_dropped"] > 0


def test_the_newest_of_a_topic_wins() -> None:
    link = HopLink(1, 1)
    peer = HopLink(2, 1)
    for k in range(10):
        link.send_best_effort(b"state %d" % k, "state")
    frames = link.take_frames(1.0)
    assert [p for frame in frames for p in peer.receive(frame.payload, 1.0)] == [b"state 9"]


@given(st.binary(max_size=200))
def test_garbage_is_counted_and_nothing_else(frame: bytes) -> None:
    link = HopLink(1, 1)
    assert link.receive(frame, 1.0) == []
    assert link.counters["bad_frames"] == 1
    assert link.peer is None


ROWS: list[object] = [1, 3, 7, 20, 5, 4, 0, [[0, b"beat"], [2**53 - 1, b"kept"]]]  # version, header, entries
NO_ROWS: list[object] = [{k: k for k in range(8)}, "8 letters", b"\1" * 8, 1, None, [], [*ROWS, 0], ROWS[:7], ROWS[1:]]
NO_ROWS += [[2, *ROWS[1:]], [None, *ROWS[1:]]]
WRONG_HEADER = [[*ROWS[:k], wrong, *ROWS[k + 1 :]] for k in range(1, 7) for wrong in (-1, 2.0, True, None, "3", [3])]
ENTRIES: list[object] = [None, {}, 3, b"beat", [[0, b"beat"], [1]], [[0, "beat"]], [[True, b"beat"]]]
ENTRIES += [[[-1, b"beat"]], [[2**53, b"beat"]], [[0, b"beat", 0]], [[0.0, b"beat"]], [3], [{0: b"beat"}]]


def checked_frame(rows: object) -> bytes:
    body = msgpack.packb(rows)
    return zlib.crc32(body).to_bytes(4, "little") + body


def test_a_frame_is_read_as_it_was_written() -> None:
    header, entries = Header(3, 7, 20, 5, 4, 0), [(0, b"beat"), (2**53 - 1, b"kept")]
    assert pack_frame(header, entries) == checked_frame(ROWS)
    assert parse_frame(checked_frame(ROWS)) == (header, [list(entry) for entry in entries])


@pytest.mark.parametrize("rows", [*NO_ROWS, *WRONG_HEADER, *([*ROWS[:7], entries] for entries in ENTRIES)], ids=repr)
def test_a_frame_of_anything_else_is_none_though_its_checksum_fits(rows: object) -> None:
    assert parse_frame(checked_frame(rows)) is None


def test_quality_tells_the_loss() -> None:
    clean, lossy = Pair(1), Pair(1, loss=0.3)
    clean.run(60.0)
    lossy.run(60.0)
    assert clean.links[0].quality == pytest.approx(1.0)
    assert 0.4 < lossy.links[0].quality < 0.9


def test_a_frame_names_its_class_and_its_topic() -> None:
    link, peer = HopLink(1, 1), HopLink(2, 1)
    link.send_best_effort(b"hello", "hello", Priority.HELLO)
    (hello,) = link.take_frames(1.0)
    assert (hello.priority, hello.topic) == (Priority.HELLO, ("hello",))
    peer.receive(hello.payload, 1.0)
    peer.send_best_effort(b"hello", "hello", Priority.HELLO)
    (answer,) = peer.take_frames(1.0)
    link.receive(answer.payload, 1.0)
    link.send_reliable(b"block", Priority.BLOCK)
    link.send_best_effort(b"aiding", "aiding", Priority.AIDING)
    (mixed,) = link.take_frames(1.0)
    assert (mixed.priority, mixed.topic) == (Priority.AIDING, None)
    assert sorted(peer.receive(mixed.payload, 1.0)) == [b"aiding", b"block"]
    (acknowledgement,) = peer.take_frames(1.0 + ACK_DELAY)
    assert (acknowledgement.priority, acknowledgement.topic) == (Priority.COMMAND, ACKNOWLEDGEMENT)


@pytest.mark.parametrize(("limit", "shared"), [(0, [1] * 10), (700, [2] * 5), (BUNDLE_LIMIT, [10])])
def test_payloads_share_a_frame_up_to_the_limit_of_the_port(limit: int, shared: list[int]) -> None:
    pair = Pair()
    pair.run(1.0)
    pair.links[0].bundle_limit = limit
    for k in range(10):
        pair.links[0].send_reliable(bytes([k]) * 310, Priority.BLOCK)
    frames = pair.links[0].take_frames(pair.now)
    assert [len(pair.links[1].receive(frame.payload, pair.now)) for frame in frames] == shared


@given(st.lists(st.integers(0, 4096), min_size=1, max_size=400))
def test_no_bundle_is_larger_than_a_frame_may_be(sizes: list[int]) -> None:
    link = HopLink(1, 2**20)
    for k, size in enumerate(sizes):
        link.send_best_effort(bytes(size), k)
    frames = link.take_frames(1.0)
    assert all(len(frame.payload) <= MAX_FRAME for frame in frames)
    shown = [parse_frame(frame.payload) for frame in frames]
    assert [len(payload) for found in shown if found for _, payload in found[1]] == sizes[-BEST_EFFORT_LIMIT:]


def test_what_may_wait_goes_with_the_next_that_lets_it_go() -> None:
    link = HopLink(1, 1)
    link.send_with_others(b"state", "state", Priority.STATE, until=3.0)
    link.send_best_effort(b"time", "time", Priority.TIME)
    (alone,) = link.take_frames(1.0)
    assert entries_of(alone.payload) == [b"time"]
    assert link.next_wake(1.0) == 3.0
    link.send_best_effort(b"below", "below", Priority.STATE)
    link.release()
    (together,) = link.take_frames(1.5)
    assert sorted(entries_of(together.payload)) == [b"below", b"state"]
    assert link.next_wake(1.5) == math.inf


def test_what_may_wait_goes_alone_in_time_however_often_it_is_replaced() -> None:
    link = HopLink(1, 1)
    link.send_with_others(b"hello", "hello", Priority.HELLO, until=2.0)
    for at in (1.0, 1.5):
        link.send_with_others(b"state at %.1f" % at, "state", Priority.STATE, until=at + 2.0)
    assert link.take_frames(1.9) == []
    (first,) = link.take_frames(2.0)
    assert entries_of(first.payload) == [b"hello"]
    assert link.next_wake(2.0) == 3.0
    assert link.take_frames(2.9) == []
    (second,) = link.take_frames(3.0)
    assert entries_of(second.payload) == [b"state at 1.5"]


def entries_of(frame: bytes) -> list[bytes]:
    """Payloads of a frame."""
    found = parse_frame(frame)
    assert found is not None
    return [payload for _, payload in found[1]]
