"""Keys of the ground station over a bus that notes them: what is put when and in which order, and who is answered."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgpack
import pytest
from hand_fed import Rig

from groundstation.gateway.zenoh import BUSY, INTAKE_AT_ONCE, WAITING, ZenohGateway


class NotedPublisher:
    def __init__(self, bus: NotedBus, key: str) -> None:
        self.bus, self.key, self.is_heard = bus, key, True

    def put(self, payload: bytes) -> None:
        self.bus.put.append((self.key, payload))


class NotedBus:
    """Publishers and queryables by their keys."""

    def __init__(self) -> None:
        self.put: list[tuple[str, bytes]] = []
        self.publishers: dict[str, NotedPublisher] = {}
        self.asked: dict[str, Callable[[Any], None]] = {}
        self.made: list[tuple[str, str, bool]] = []

    def publisher(self, key: str, encoding: str, *, droppable: bool = False) -> NotedPublisher:
        self.made.append((key, encoding, droppable))
        return self.publishers.setdefault(key, NotedPublisher(self, key))

    def queryable_kept(self, key: str, handle: Callable[[Any], None]) -> None:
        self.asked[key] = handle

    def taken(self) -> list[str]:
        """Keys that were put since the last call, without what they begin with."""
        put, self.put = self.put, []
        return [key.removeprefix("borechain/rig-1/") for key, _ in put]


class NotedQuery:
    """A query and all that is answered."""

    def __init__(self, key: str, covers: tuple[str, ...] = (), **parameters: str) -> None:
        self.selector_key, self.parameters, self.covers = key, parameters, covers
        self.replies: list[tuple[str, bytes, str]] = []
        self.errors: list[str] = []
        self.finished = 0

    def intersects(self, key: str) -> bool:
        return key == self.selector_key or key in self.covers

    def reply(self, key: str, payload: bytes, encoding: str = "json") -> None:
        self.replies.append((key, payload, encoding))

    def reply_error(self, text: str) -> None:
        self.errors.append(text)

    def finish(self) -> None:
        self.finished += 1


class Door:
    """A gateway on a loop of its own."""

    def __init__(self, folder: Path) -> None:
        self.bus, self.rig, self.loop = NotedBus(), Rig(folder), asyncio.new_event_loop()

        async def begin() -> ZenohGateway:
            return ZenohGateway(self.bus, self.rig.ground)  # type: ignore[arg-type]

        self.gateway = self.loop.run_until_complete(begin())

    def turn(self) -> None:
        """Let the loop turn once."""
        self.loop.call_soon(self.loop.stop)
        self.loop.run_forever()

    def ask(self, *queries: NotedQuery, within: str = "borechain/rig-1/ground/**") -> None:
        """Have queries answered."""

        async def serve() -> None:
            serving = asyncio.create_task(self.gateway.serve())
            for query in queries:
                self.bus.asked[within](query)
            for _ in range(20):
                await asyncio.sleep(0)
            serving.cancel()
            await asyncio.gather(serving, return_exceptions=True)

        self.loop.run_until_complete(serve())

    def close(self) -> None:
        self.rig.ground.close()
        self.loop.close()


@pytest.fixture
def door(tmp_path: Path) -> Any:
    made = Door(tmp_path)
    yield made
    made.close()


def test_what_changed_is_put_at_once_and_what_shows_the_hole_one_a_turn_in_its_order(door: Door) -> None:
    for publisher in ("intake",):
        door.bus.publishers[f"borechain/rig-1/{publisher}"].is_heard = False
    for _ in range(2):
        door.gateway._publish(["trajectory", "status", "stations", "alarms", "trajectory"])
        assert door.bus.taken() == ["ground/status", "ground/alarms"]
        door.gateway._publish(["stations", "column"])
        found = []
        for _ in range(4):
            door.turn()
            found.append(door.bus.taken())
        assert [one for one in found if one] == [["ground/trajectory"], ["ground/stations"], ["ground/column"]]
    door.gateway._publish(["column", "trajectory"])
    door.gateway.close()
    assert door.bus.taken() == ["ground/column", "ground/trajectory"]
    assert door.gateway._publish not in door.rig.ground.listeners
    assert {(encoding, droppable) for key, encoding, droppable in door.bus.made if "ground/" in key} == {
        ("application/json", True)
    }
    assert len(door.bus.made) == len({key for key, _, _ in door.bus.made})


def test_beats_are_put_where_somebody_listens(door: Door) -> None:
    door.bus.publishers["borechain/rig-1/intake"].is_heard = False
    for path in ("verdict", "changes", "status"):
        for heard in (True, False, True):
            door.gateway._publish([path] if path not in door.gateway._publishers else [])
            door.bus.publishers[f"borechain/rig-1/ground/{path}"].is_heard = heard
            door.bus.taken()
            door.gateway._publish([path])
            assert door.bus.taken() == ([f"ground/{path}"] if heard or path == "status" else [])


def test_a_listener_is_given_all_that_was_taken_in_once_and_the_next_one_again(door: Door) -> None:
    intake = door.bus.publishers["borechain/rig-1/intake"]
    door.rig.read_depth(1.0)
    kept = len(list(door.rig.ground.tape.after(0)))
    intake.is_heard = False
    door.gateway._publish([])
    door.bus.taken()
    for _ in range(2):
        intake.is_heard = True
        door.gateway._publish([])
        first = door.bus.put[0]
        begin = msgpack.unpackb(first[1])
        assert str(begin).count("password") == 0
        for private in ("folder", "key_file", "database_url", "'wall'"):
            assert private not in str(begin)
        assert door.bus.taken() == ["intake"] * (kept + 1)
        door.gateway._publish([])
        assert door.bus.taken() == []
        door.rig.read_depth(2.0)
        kept = len(list(door.rig.ground.tape.after(0)))
        door.bus.taken()
        intake.is_heard = False
        door.gateway._publish([])
        assert door.bus.taken() == []


def test_an_intake_begins_once_where_nothing_was_taken_in_yet(door: Door) -> None:
    assert door.rig.ground.tape.newest == 0
    door.bus.taken()
    door.gateway._publish([])
    assert door.bus.taken() == ["intake"]
    door.gateway._publish([])
    assert door.bus.taken() == []
    door.rig.read_depth(1.0)
    door.gateway._publish([])
    assert door.bus.taken().count("intake") == len(list(door.rig.ground.tape.after(0))) == 1


def test_a_recorder_asks_for_what_it_lacks(door: Door) -> None:
    for md in (1.0, 1.2, 1.4):
        door.rig.read_depth(md)
    newest = door.rig.ground.tape.newest
    assert newest >= 3
    for since, count in ((None, newest), ("0", newest), (str(newest - 2), 2), (str(newest), 0), ("999999", 0)):
        asked: dict[str, Any] = {} if since is None else {"since": since}
        query = NotedQuery("borechain/rig-1/intake", **asked)
        door.ask(query, within="borechain/rig-1/intake")
        ((key, payload, encoding),) = query.replies
        assert (key, encoding, query.finished) == ("borechain/rig-1/intake", "application/msgpack", 1)
        assert len(msgpack.unpackb(payload)) == min(count, INTAKE_AT_ONCE)
    for since in ("-1", "1.5", "x", "9" * 40):
        query = NotedQuery("borechain/rig-1/intake", since=since)
        door.ask(query, within="borechain/rig-1/intake")
        assert (query.replies, query.finished) == ([], 1)
        assert query.errors[0].startswith("parameter since: expected a whole number, got ")


def test_a_query_is_answered_for_every_key_it_covers_and_refused_in_words(door: Door) -> None:
    base = "borechain/rig-1/ground/"
    one = NotedQuery(base + "status")
    packed = NotedQuery(base + "status", accept="msgpack")
    many = NotedQuery(base + "*", (base + "status", base + "alarms"))
    wrong = [
        NotedQuery(base + "status", accept="xml"), NotedQuery(base + "nothing"), NotedQuery(base + "x*"),
        NotedQuery(base + "status", depth="3"),
    ]  # fmt: skip
    door.ask(one, packed, many, *wrong)
    (answer,) = one.replies
    assert (answer[0], answer[2]) == (base + "status", "application/json")
    assert set(json.loads(answer[1])) == set(msgpack.unpackb(packed.replies[0][1]))
    assert packed.replies[0][2] == "application/msgpack"
    assert {key for key, _, _ in many.replies} == {base + "status", base + "alarms"}
    assert [(query.finished, query.replies) for query in wrong] == [(1, [])] * 4
    assert wrong[0].errors == ["parameter accept: expected json or msgpack, got 'xml'"]
    assert wrong[2].errors[0].startswith(base + "x*: no such key; expected below " + base)
    assert "depth" in wrong[3].errors[0]
    failing = NotedQuery(base + "status")
    failing.intersects = None  # type: ignore[assignment]
    after = NotedQuery(base + "status")
    door.ask(failing, after)
    assert failing.errors == [f"{base}status: the ground station failed: TypeError"]
    assert (len(after.replies), door.rig.ground.endpoint.counters["failed_queries"]) == (1, 1)


def test_an_order_is_of_one_rig_and_one_name_and_its_answer_is_awaited(door: Door) -> None:
    base = "borechain/rig-1/cmd/"
    told = NotedQuery(base + "north", action="tell", angle_deg="12", sigma_deg="0.5", by="ben")
    everything = NotedQuery("borechain/**")
    wild = NotedQuery(base + "nor*", action="tell", angle_deg="12", sigma_deg="0.5")
    wrong = NotedQuery(base + "north", action="tell", angle_deg="12")
    unnamed = NotedQuery(base + "north", action="tell", angle_deg="13", sigma_deg="0.5")
    door.ask(told, everything, wild, wrong, unnamed, within=base + "*")
    entries = door.rig.ground.model.setup.entries
    assert [one.by for one in entries] == ["ben", "zenoh"]
    ((key, payload, _),) = told.replies
    assert key == base + "north"
    assert json.loads(payload)["done"] is True
    assert (everything.replies, everything.errors, everything.finished) == ([], [], 1)
    assert wild.errors == [f"{base}nor*: expected one rig and one order, {base}NAME; none was obeyed"]
    assert wrong.errors[0].startswith(f"{base}north: ")
    assert door.gateway._awaited == set()
    door.gateway._awaited = {object() for _ in range(WAITING)}  # type: ignore[misc]
    late = NotedQuery(base + "north", action="tell", angle_deg="14", sigma_deg="0.5")
    door.gateway._take_order(late)  # type: ignore[arg-type]
    assert (late.errors, late.finished, len(entries)) == ([BUSY], 1, 2)
    door.gateway._awaited = set()


def test_who_comes_to_a_full_inbox_is_told_so(door: Door) -> None:
    async def fill() -> list[NotedQuery]:
        queries = [NotedQuery("borechain/rig-1/ground/status") for _ in range(WAITING + 2)]
        for query in queries:
            door.bus.asked["borechain/rig-1/ground/**"](query)
        return queries

    queries = door.loop.run_until_complete(fill())
    assert [query.errors for query in queries] == [[]] * WAITING + [[BUSY]] * 2
