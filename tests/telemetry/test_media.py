"""The same cases back to back over every medium of the table: a medium is added to the tests by one line in PLACES."""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import queue
import random
import socket
import threading
import time
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import AbstractContextManager
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim.can.can_hub import running_hub
from telemetry.errors import MediumError
from telemetry.media.media_table import MEDIA, open_medium
from telemetry.media.memory import joined_ports
from telemetry.media.port import PortFrame, Priority, TubeEnd
from telemetry.media.send_queue import SEND_LIMIT, SendQueue
from telemetry.media.zenoh_bus import open_client, open_router
from telemetry.messages import Side
from telemetry.runtime.inbox import Inbox
from telemetry.transport.hop import HopLink

PATIENCE = 30.0
RIG = "back-to-back"
UPPER, LOWER = TubeEnd(RIG, 2, Side.LOWER, 1), TubeEnd(RIG, 1, Side.UPPER, 2)  # tube 2 above tube 1
numbers = itertools.count()


@contextlib.contextmanager
def memory_place() -> Iterator[str]:
    yield f"net-{next(numbers)}"


@contextlib.contextmanager
def zenoh_place() -> Iterator[str]:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        endpoint = f"tcp/127.0.0.1:{probe.getsockname()[1]}"
    with open_router(endpoint):
        yield endpoint


def can_place(settings: str) -> Callable[[], AbstractContextManager[str]]:
    @contextlib.contextmanager
    def place() -> Iterator[str]:
        with running_hub() as hub:
            yield f"{hub.port},interface=borechain_loopback,{settings}"

    return place


PLACES: dict[str, Callable[[], AbstractContextManager[str]]] = {
    "can:classic": can_place("frames=classic"),
    "can:fd": can_place("frames=fd"),
    "can:native": can_place("profile=native"),
    "memory": memory_place,
    "zenoh": zenoh_place,
}


def medium_of(place: str) -> str:
    """Name in the table of a place, which may say more behind it."""
    return place.partition(":")[0]


class End:
    """A port on a bus of its own, and what it has heard."""

    def __init__(self, medium: str, end: TubeEnd) -> None:
        self._bus = contextlib.ExitStack()
        self.port = self._bus.enter_context(open_medium(medium)).open_port(end)
        self._heard: Inbox[bytes] = Inbox()

    def listen(self) -> End:
        self.port.listen(self._heard.put)
        return self

    async def heard(self, count: int) -> list[bytes]:
        """The next frames."""
        frames = [await asyncio.wait_for(self._heard.get(), PATIENCE) for _ in range(count)]
        assert None not in frames
        return [frame for frame in frames if frame is not None]

    async def sees(self, *, up: bool) -> None:
        """Wait until the other end has come or gone."""
        deadline = time.monotonic() + PATIENCE
        while self.port.is_up != up:
            assert time.monotonic() < deadline
            await asyncio.sleep(0.005)

    def leave(self) -> None:
        self.port.close()
        self._bus.close()


class Joint:
    """Opens ends and closes them all."""

    def __init__(self, medium: str) -> None:
        self.medium = medium
        self._ends: list[End] = []

    def end(self, end: TubeEnd) -> End:
        self._ends.append(End(self.medium, end))
        return self._ends[-1]

    async def pair(self) -> tuple[End, End]:
        """Both ends, up."""
        upper, lower = self.end(UPPER).listen(), self.end(LOWER).listen()
        await upper.sees(up=True)
        await lower.sees(up=True)
        return upper, lower

    def close(self) -> None:
        for end in self._ends:
            end.leave()


@pytest.fixture(params=sorted(PLACES))
async def tube_joint(request: pytest.FixtureRequest) -> AsyncIterator[Joint]:
    with PLACES[request.param]() as where:
        joint = Joint(f"{medium_of(request.param)}:{where}")
        yield joint
        joint.close()


class TestBackToBack:
    async def test_frames_come_in_order_and_both_ways(self, tube_joint: Joint) -> None:
        upper, lower = await tube_joint.pair()
        frames = [b"%d" % k for k in range(300)]
        for frame in frames:
            assert upper.port.send(PortFrame(frame))
            assert lower.port.send(PortFrame(frame + b" back"))
        assert await lower.heard(300) == frames
        assert await upper.heard(300) == [frame + b" back" for frame in frames]
        assert not upper.port.counters

    async def test_the_largest_frame_passes_and_a_byte_more_is_refused(self, tube_joint: Joint) -> None:
        upper, lower = await tube_joint.pair()
        largest = random.Random(1).randbytes(upper.port.largest_payload)
        assert not upper.port.send(PortFrame(largest + b"!"))
        assert upper.port.send(PortFrame(largest))
        assert await lower.heard(1) == [largest]
        assert upper.port.counters == {"too_large": 1}

    async def test_an_absent_end_holds_nothing_up_and_gets_the_newest(self, tube_joint: Joint) -> None:
        upper = tube_joint.end(UPPER).listen()
        assert not upper.port.is_up
        assert upper.port.send(PortFrame(b"state", Priority.STATE, "state of 1"))
        assert upper.port.send(PortFrame(b"survey", Priority.SURVEY))
        assert upper.port.send(PortFrame(b"what time is it", Priority.TIME, "time"))
        for k in range(3 * SEND_LIMIT):
            assert upper.port.send(PortFrame(b"aiding %d" % k, Priority.AIDING, "aiding"))
        lower = tube_joint.end(LOWER).listen()
        await upper.sees(up=True)
        upper.port.flush()
        assert await lower.heard(3) == [b"aiding %d" % (3 * SEND_LIMIT - 1), b"survey", b"state"]
        assert upper.port.counters == {"replaced": 3 * SEND_LIMIT - 1, "outdated": 1}

    async def test_a_full_queue_drops_best_effort_first(self, tube_joint: Joint) -> None:
        upper = tube_joint.end(UPPER).listen()
        kept = [b"survey %d" % k for k in range(SEND_LIMIT - 2)]
        for k, frame in enumerate(kept):
            upper.port.send(PortFrame(frame, Priority.SURVEY))
            upper.port.send(PortFrame(b"state %d" % k, Priority.STATE, k))
            upper.port.send(PortFrame(b"aiding", Priority.AIDING, "aiding"))
        lower = tube_joint.end(LOWER).listen()
        await upper.sees(up=True)
        upper.port.flush()
        *urgent, last = await lower.heard(SEND_LIMIT)
        assert urgent == [b"aiding", *kept]
        assert last == b"state %d" % (SEND_LIMIT - 3)
        assert upper.port.counters["dropped"] == SEND_LIMIT - 3

    async def test_a_queue_full_of_what_must_not_be_lost_refuses_more(self, tube_joint: Joint) -> None:
        upper = tube_joint.end(UPPER).listen()
        for k in range(SEND_LIMIT + 5):
            upper.port.send(PortFrame(b"%d" % k))
        lower = tube_joint.end(LOWER).listen()
        await upper.sees(up=True)
        upper.port.flush()
        assert await lower.heard(SEND_LIMIT) == [b"%d" % k for k in range(SEND_LIMIT)]
        assert upper.port.counters == {"dropped": 5}

    async def test_an_end_that_comes_back_gets_what_waited(self, tube_joint: Joint) -> None:
        upper, lower = await tube_joint.pair()
        upper.port.send(PortFrame(b"before"))
        assert await lower.heard(1) == [b"before"]
        lower.leave()
        await upper.sees(up=False)
        upper.port.send(PortFrame(b"old", Priority.HELLO, "hello"))
        upper.port.send(PortFrame(b"new", Priority.HELLO, "hello"))
        again = tube_joint.end(LOWER).listen()
        await upper.sees(up=True)
        upper.port.send(PortFrame(b"after", Priority.HELLO))
        assert await again.heard(2) == [b"new", b"after"]
        again.port.send(PortFrame(b"here again"))
        assert await upper.heard(1) == [b"here again"]

    async def test_a_closed_end_refuses_and_is_seen_to_be_closed(self, tube_joint: Joint) -> None:
        upper, lower = await tube_joint.pair()
        lower.port.close()
        lower.port.close()
        with pytest.raises(MediumError, match="closed"):
            lower.port.send(PortFrame(b"x"))
        assert not lower.port.is_up
        await upper.sees(up=False)

    @pytest.mark.parametrize("garbage", [b"", b"\0", b"\xc1" * 40, random.Random(2).randbytes(500)])
    async def test_garbage_arrives_as_it_is_and_the_link_counts_it(self, tube_joint: Joint, garbage: bytes) -> None:
        upper, lower = await tube_joint.pair()
        upper.port.send(PortFrame(garbage))
        upper.port.send(PortFrame(b"sound"))
        assert await lower.heard(2) == [garbage, b"sound"]
        link = HopLink(1, 1)
        assert link.receive(garbage, 1.0) == []
        assert link.counters["bad_frames"] == 1

    async def test_another_joint_hears_nothing(self, tube_joint: Joint) -> None:
        upper, lower = await tube_joint.pair()
        stranger = tube_joint.end(TubeEnd(RIG, 4, Side.LOWER, 3)).listen()
        beside = tube_joint.end(TubeEnd(RIG, 3, Side.UPPER, 4)).listen()
        await stranger.sees(up=True)
        upper.port.send(PortFrame(b"one"))
        stranger.port.send(PortFrame(b"two"))
        assert await lower.heard(1) == [b"one"]
        assert await beside.heard(1) == [b"two"]


def test_every_medium_of_the_table_is_tested() -> None:
    assert set(map(medium_of, PLACES)) == set(MEDIA)


def test_an_unknown_medium_is_one_line_with_the_known_ones() -> None:
    with pytest.raises(MediumError) as caught:
        open_medium("can't:can0")
    assert str(caught.value) == "medium: expected one of can, memory, zenoh, got can't"


def test_a_medium_is_added_by_a_module_and_a_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "pipe_medium.py").write_text("from telemetry.media.memory import open_medium\n")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setitem(MEDIA, "pipe", "pipe_medium")
    heard: list[bytes] = []
    with open_medium("pipe:a") as medium:
        upper, lower = medium.open_port(UPPER), medium.open_port(LOWER)
        lower.listen(heard.append)
        upper.send(PortFrame(b"hello"))
        upper.close()
        lower.close()
    assert heard == [b"hello"]


def test_no_router_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("telemetry.media.zenoh_port.CONNECT_TIMEOUT", 0.2)
    with (
        pytest.raises(MediumError, match=r"no router at tcp/127\.0\.0\.1:1 within 0\.2 s"),
        open_medium("zenoh:tcp/127.0.0.1:1"),
    ):
        pass


def test_a_thread_of_zenohs_stays_known_from_one_callback_to_the_next() -> None:
    class Calls(threading.local):
        count = 0

    calls, heard = Calls(), queue.SimpleQueue[tuple[int, int]]()

    def hear(_frame: bytes) -> None:
        calls.count += 1
        heard.put((threading.get_ident(), calls.count))

    with zenoh_place() as endpoint, open_client(endpoint, PATIENCE) as ours, open_client(endpoint, PATIENCE) as theirs:
        ours.hear("known", hear)
        publisher = theirs.publisher("known")
        deadline = time.monotonic() + PATIENCE
        while not publisher.is_heard:
            assert time.monotonic() < deadline
        for _ in range(20):
            publisher.put(b"frame")
        found = [heard.get(timeout=PATIENCE) for _ in range(20)]
    for thread in {thread for thread, _ in found}:
        counts = [count for one, count in found if one == thread]
        assert counts == list(range(1, len(counts) + 1))


def test_a_long_payload_takes_no_shared_memory() -> None:
    heard: queue.SimpleQueue[bytes] = queue.SimpleQueue()
    with zenoh_place() as endpoint, open_client(endpoint, PATIENCE) as ours, open_client(endpoint, PATIENCE) as theirs:
        theirs.subscribe("long", lambda _key, payload: heard.put(payload))
        onward = ours.publisher("long")
        deadline = time.monotonic() + PATIENCE
        while not onward.is_heard:
            assert time.monotonic() < deadline
        for _ in range(8):
            onward.put(bytes(12_000))
            assert heard.get(timeout=PATIENCE) == bytes(12_000)
        mapped = Path("/proc/self/maps").read_text()
    assert ".zenoh" not in mapped  # as the files of zenoh's segments are called


def test_who_is_at_one_of_two_joined_routers_is_heard_at_both(tmp_path: Path) -> None:
    """As the tubes of a stepped rig at their stepper, and the crew at the launcher."""
    near = f"unixsock-stream/{tmp_path / 'frames'}"
    heard: queue.SimpleQueue[tuple[str, bytes]] = queue.SimpleQueue()
    come: queue.SimpleQueue[tuple[str, bool]] = queue.SimpleQueue()
    with (
        zenoh_place() as endpoint,
        open_router(near, beyond=endpoint),
        open_client(near, PATIENCE) as tube,
        open_client(endpoint, PATIENCE) as crew,
    ):
        crew.liveliness_subscribe("alive/*", lambda key, alive: come.put((key, alive)))
        take_back = tube.liveliness_token("alive/tube")
        assert come.get(timeout=PATIENCE) == ("alive/tube", True)
        for name, here, there in (("up", tube, crew), ("down", crew, tube)):
            there.subscribe(name, lambda key, payload: heard.put((key, payload)))
            publisher = here.publisher(name)
            deadline = time.monotonic() + PATIENCE
            while not publisher.is_heard:
                assert time.monotonic() < deadline
            publisher.put(bytes(100_000))
            assert heard.get(timeout=PATIENCE) == (name, bytes(100_000))
        take_back()
        assert come.get(timeout=PATIENCE) == ("alive/tube", False)


def test_an_end_in_memory_has_one_port() -> None:
    with open_medium("memory:taken") as medium:
        port = medium.open_port(UPPER)
        with pytest.raises(MediumError, match="lower end of 2 is taken"):
            medium.open_port(UPPER)
        port.close()
        medium.open_port(UPPER).close()


def test_the_faults_of_a_joint_in_memory() -> None:
    def carried(**faults: float) -> list[bytes]:
        upper, lower = joined_ports(3, **faults)
        upper.listen(lambda frame: None)
        heard: list[bytes] = []
        lower.listen(heard.append)
        for k in range(200):
            upper.send(PortFrame(b"frame %3d" % k))
        lower.advance(10.0)
        return heard

    sent = [b"frame %3d" % k for k in range(200)]
    assert carried() == sent
    assert carried(latency=11.0) == []
    assert 0 < len(carried(loss=0.5)) < 200 < len(carried(duplicate=0.5))
    assert carried(jitter=0.01) != sent
    assert sorted(carried(jitter=0.01)) == sent
    assert 0 < sum(a != b for a, b in zip(carried(corrupt=0.5), sent, strict=True)) < 200


frames = st.builds(PortFrame, st.binary(max_size=4), st.sampled_from(Priority), st.one_of(st.none(), st.integers(0, 3)))


@given(st.lists(frames, max_size=40), st.integers(1, 8))
def test_a_queue_is_bounded_and_accounts_for_every_frame(offered: list[PortFrame], limit: int) -> None:
    queue = SendQueue(3, limit)
    for frame in offered:
        assert queue.offer(frame) is (len(frame.payload) <= 3)
        assert len(queue) <= limit
    sent: list[bytes] = []
    queue.drain(lambda: True, sent.append)
    assert len(sent) + sum(queue.counters.values()) == len(offered)
    must = [f.payload for f in offered if f.topic is None and len(f.payload) <= 3]
    if len(must) <= limit:
        assert all(sent.count(payload) >= must.count(payload) for payload in must)


def test_a_port_that_goes_down_while_it_drains_keeps_the_rest() -> None:
    queue = SendQueue(10)
    for k in range(5):
        queue.offer(PortFrame(b"%d" % k))
    sent: list[bytes] = []
    queue.drain(lambda: len(sent) < 2, sent.append)
    assert (sent, len(queue)) == ([b"0", b"1"], 3)


def test_ends_face_each_other() -> None:
    assert UPPER.facing == LOWER
    assert LOWER.facing == UPPER
    with pytest.raises(ValueError, match="expected a neighbour"):
        _ = TubeEnd(RIG, 1, Side.UPPER).facing
