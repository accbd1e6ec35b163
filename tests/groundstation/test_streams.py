"""Streams, schemas and what every answer begins with."""

import asyncio
import datetime
import json
import socket
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from hand_fed import Rig
from schemas import check_answers

from groundstation.errors import SelectorError
from groundstation.ground_host import answering_operators
from groundstation.service.answers.paths import answered_paths
from telemetry.media.zenoh_bus import open_client, open_router
from telemetry.messages import Event, Severity

STREAMS = ("events", "measurements", "static_records")


@pytest.fixture
def rig(tmp_path: Path) -> Iterator[Rig]:
    rig = Rig(tmp_path, target=20.0)
    rig.run(5.0)
    for stop in range(1, 4):
        rig.drill(stop, 0.3)
        happen(rig, stop)
    yield rig
    rig.ground.close()


def happen(rig: Rig, number: int) -> None:
    rig.tube.mail.submit(Event(1, 100 + number, rig.now, Severity.INFO, "stopped"), rig.now)
    rig.run(2.0)


def seqs(answer: dict[str, Any], path: str = "events") -> list[int]:
    return [row["seq"] for row in answer[path]]


def test_what_is_sent_is_what_there_is_also_of_a_hole_that_has_grown(tmp_path: Path) -> None:
    rig = Rig(tmp_path, target=20.0)
    rig.run(5.0)
    for stop in range(3):
        if stop:
            rig.drill(stop, 0.3)
        for path in answered_paths(rig.ground.model):
            shown, sent = rig.ask(path), json.loads(rig.ground.operator.ask_json(path))
            assert list(sent) == list(shown)
            assert sent.pop("utc") >= shown.pop("utc")
            assert sent == json.loads(json.dumps(shown)), path
    rig.ground.close()


@pytest.mark.parametrize("path", ["events", "measurements"])
def test_a_stream_is_asked_for_from_a_number_on(rig: Rig, path: str) -> None:
    assert seqs(rig.ask(path), path) == [1, 2, 3]
    assert rig.ask(path)["newest"] == 3
    assert seqs(rig.ask(path, since="1"), path) == [2, 3]
    assert seqs(rig.ask(path, since="0", limit="2"), path) == [1, 2]
    assert seqs(rig.ask(path, since="3"), path) == []


@pytest.mark.parametrize(
    ("name", "value"),
    [("since", "4"), ("since", "-1"), ("since", "1.5"), ("since", "9" * 30), ("since", ""), ("limit", "10001")],
)
def test_a_number_that_cannot_be_is_refused_with_what_can(rig: Rig, name: str, value: str) -> None:
    with pytest.raises(
        SelectorError, match=f"parameter {name}: expected a whole number up to {3 if name == 'since' else 10000}"
    ):
        rig.ask("events", **{name: value})


def test_a_number_of_before_a_restart_is_told_so(rig: Rig) -> None:
    with pytest.raises(SelectorError, match="numbers begin anew when the ground station starts, got '7'"):
        rig.ask("measurements", since="7")


@pytest.mark.parametrize(
    ("path", "expected"),
    [
        ("stations/99", "stations/99: no such number; of stations/{n} there are 1, 2, 3"),
        ("nodes/7", "nodes/7: no such number; of nodes/{tube} there are 1, 2, 3"),
        ("statoins", "statoins: no such path; expected one of status, verdict"),
    ],
)
def test_what_is_not_there_is_refused_with_what_is(rig: Rig, path: str, expected: str) -> None:
    with pytest.raises(SelectorError) as caught:
        rig.ask(path)
    assert str(caught.value).startswith(expected)


def test_of_what_is_missing_an_order_was_given_and_before_there_was_none(rig: Rig, tmp_path: Path) -> None:
    """The numbers of its events begin at 101, so a tube is asked for those between at once."""
    (order,) = rig.ask("orders")["orders"]
    assert (order["command"], order["tube"]) == ("resend", 1)
    with pytest.raises(SelectorError, match=f"^orders/7: no such number; of orders/{{n}} there are {order['order']}"):
        rig.ask("orders/7")
    (folder := tmp_path / "new").mkdir()
    new = Rig(folder, target=20.0)
    new.run(5.0)
    with pytest.raises(SelectorError, match=r"^orders/7: no such number; of orders/\{n\} there are none yet"):
        new.ask("orders/7")
    new.ground.close()


@pytest.mark.slow
def test_every_answer_has_its_schema_on_the_key_of_schemas_and_begins_with_the_same(rig: Rig) -> None:
    schemas = rig.ask("schema")["schemas"]
    assert set(schemas) >= {"status", "verdict", "alarms", "stations/{n}", *STREAMS}
    for name in check_answers(rig.ground.model):
        answer = rig.ask(name)
        pattern = name if name in schemas else name.replace("/1", "/{n}" if "stations" in name else "/{tube}", 1)
        if pattern in schemas:
            jsonschema.validate(answer, schemas[pattern])
        assert list(answer)[:3] == ["revision", "utc", "rig_time_s"]
        assert datetime.datetime.fromisoformat(answer["utc"]).utcoffset() == datetime.timedelta(0)


def test_the_revision_grows_with_what_comes_in_and_with_nothing_else(rig: Rig) -> None:
    before = rig.ask("status")["revision"]
    assert rig.ask("status")["revision"] == before
    rig.speak(3)
    assert rig.ask("status")["revision"] > before


async def test_new_rows_are_published_once_each_and_a_wrong_number_is_told_over_the_bus(tmp_path: Path) -> None:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        endpoint = f"tcp/127.0.0.1:{probe.getsockname()[1]}"
    rig = Rig(tmp_path)
    rig.run(2.0)
    happen(rig, 1)
    key = "borechain/rig-1/ground"
    with open_router(endpoint) as server, open_client(endpoint, timeout=10.0) as bus:
        async with answering_operators(rig.ground, server):
            seen: list[list[int]] = []
            bus.subscribe(f"{key}/events", lambda _key, payload: seen.append(seqs(json.loads(payload))))
            await asyncio.to_thread(bus.get, f"{key}/status", 10.0)  # the subscription has arrived by now
            happen(rig, 2)
            happen(rig, 3)
            while len(seen) < 2:
                await asyncio.to_thread(bus.get, f"{key}/status", 10.0)
            (refused,) = await asyncio.to_thread(bus.get, f"{key}/stations/4", 10.0)
    assert seen == [[2], [3]]
    assert refused.error == "stations/4: no such number; of stations/{n} there are none yet"
    rig.ground.close()
