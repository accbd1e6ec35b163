"""The ground station as a whole on a real bus: what it learns, what it answers, what survives."""

import asyncio
import contextlib
import itertools
import json
import socket
from collections.abc import AsyncIterator, Callable, Iterator
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path
from typing import Any

import msgpack
import pytest
from hand_fed import COV, VAR, Rig
from schemas import check_answers

from groundstation.ground_host import answering_operators
from telemetry.frozen import replace
from telemetry.media.zenoh_bus import ZenohBus, open_client, open_router
from telemetry.messages import (
    Event,
    ImuMean,
    NodeFlag,
    Receipt,
    Reply,
    Severity,
    StaticRecord,
    SurveyMeasurement,
)
from telemetry.presentation.msgpack_codec import encode_message

NO_COV = ((VAR, 5.0, 0.0), (5.0, VAR, 0.0), (0.0, 0.0, VAR))
MEASUREMENT = SurveyMeasurement(
    1, 1, 0.0, 1, (ImuMean((0.0, 0.0, -9.81), COV),), 0.0, 1e-8, 1e-8, 32, 20.0, NodeFlag.NONE
)
GROUND = "borechain/*/ground"


@pytest.fixture
def buses() -> Iterator[tuple[ZenohBus, ZenohBus]]:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        endpoint = f"tcp/127.0.0.1:{probe.getsockname()[1]}"
    with open_router(endpoint) as server, open_client(endpoint, timeout=10.0) as operator:
        yield server, operator


async def ask(bus: ZenohBus, selector: str) -> Any:
    replies = await asyncio.to_thread(bus.get, selector, 10.0)
    assert len(replies) == 1, replies
    assert replies[0].error is None, replies[0].error
    return json.loads(replies[0].payload)


async def refused(bus: ZenohBus, selector: str) -> str:
    replies = await asyncio.to_thread(bus.get, selector, 10.0)
    assert len(replies) == 1
    assert replies[0].error is not None
    return replies[0].error


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Callable[[], Rig]]:
    """Start a ground station in the same folder, once more each time; all are closed in the end."""
    started: list[Rig] = []

    def make() -> Rig:
        started.append(Rig(tmp_path))
        return started[-1]

    yield make
    for rig in started:
        rig.ground.store.close()


@pytest.fixture
async def rig(tmp_path: Path, buses: tuple[ZenohBus, ZenohBus]) -> AsyncIterator[tuple[Rig, ZenohBus]]:
    """Two tubes, bit at 4 m, one survey at 2 m and two at 4 m."""
    server, operator = buses
    rig = Rig(tmp_path)
    with contextlib.closing(rig.ground):
        async with answering_operators(rig.ground, server):
            rig.run(3.0)
            rig.depth(2.0)
            rig.state(1, 1)
            rig.survey(1, 1)
            rig.state(2, 1)
            rig.state(1, 2)
            rig.depth(4.0)
            rig.survey(1, 2, inclination_deg=3.0)
            rig.survey(2, 1)
            yield rig, operator


async def test_surveys_find_their_stations(rig: tuple[Rig, ZenohBus]) -> None:
    _, bus = rig
    stations = (await ask(bus, f"{GROUND}/stations"))["stations"]
    assert [(s["station"], s["md_m"], s["measurements"]) for s in stations] == [(1, 2.0, 2), (2, 4.0, 1)]
    assert stations[0]["inclination_deg"] == pytest.approx(2.0, abs=0.01)
    assert (stations[1]["azimuth_deg"] + 180.0) % 360.0 - 180.0 == pytest.approx(0.0, abs=0.01)
    assert (await ask(bus, f"{GROUND}/stations/2"))["md_m"] == 4.0
    assert {m["tube"] for m in (await ask(bus, f"{GROUND}/stations/1/measurements"))["measurements"]} == {1, 2}
    assert [t["md_m"] for t in (await ask(bus, f"{GROUND}/string"))["tubes"]] == [2.0, 4.0]
    assert (await ask(bus, f"{GROUND}/status"))["measurements"] == 3


@pytest.mark.parametrize("selector", ["**", "borechain/**", "borechain/rig-1/cmd/*", "borechain/rig-1/cmd/**", "*/*"])
async def test_a_selector_that_covers_everything_orders_nothing_and_ends_nobody(
    rig: tuple[Rig, ZenohBus], selector: str
) -> None:
    it, bus = rig
    replies = await asyncio.to_thread(bus.get, selector, 10.0)
    assert all(reply.error is None or "\n" not in reply.error for reply in replies)
    assert (await ask(bus, f"{GROUND}/orders"))["orders"] == []
    assert it.ground.endpoint.counters["failed_queries"] == 0


@pytest.mark.parametrize("rigs", ["*", "**", "rig-$*"])
async def test_an_order_to_every_rig_is_refused_in_a_line_and_obeyed_by_none(
    rig: tuple[Rig, ZenohBus], rigs: str
) -> None:
    it, bus = rig
    selector = f"borechain/{rigs}/cmd/accept_joints?action=confirm"
    replies = await asyncio.to_thread(bus.get, selector, 10.0)
    assert all(reply.error and "\n" not in reply.error for reply in replies)
    assert any("expected one rig and one order" in str(reply.error) for reply in replies)
    assert (await ask(bus, f"{GROUND}/orders"))["orders"] == []
    assert not it.ground.operator.has_pending


async def test_a_range_answers_only_the_range(rig: tuple[Rig, ZenohBus]) -> None:
    _, bus = rig
    assert [p["md_m"] for p in (await ask(bus, f"{GROUND}/trajectory"))["points"]] == [0.0, 2.0, 4.0]
    assert [p["md_m"] for p in (await ask(bus, f"{GROUND}/trajectory?md=3..12"))["points"]] == [4.0]
    assert [p["md_m"] for p in (await ask(bus, f"{GROUND}/trajectory?md=..2"))["points"]] == [0.0, 2.0]
    assert [p["md_m"] for p in (await ask(bus, f"{GROUND}/trajectory?md=2.5"))["points"]] == [2.5]
    assert [s["station"] for s in (await ask(bus, f"{GROUND}/stations?md=2"))["stations"]] == [1]
    assert {m["tube"] for m in (await ask(bus, f"{GROUND}/measurements?tube=2"))["measurements"]} == {2}


async def test_wildcards_get_every_key_they_name(rig: tuple[Rig, ZenohBus]) -> None:
    _, bus = rig
    assert {r.key.rsplit("/", 1)[1] for r in await asyncio.to_thread(bus.get, f"{GROUND}/nodes/*", 10.0)} == {"1", "2"}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("selector", "named"),
    [
        ("trajektory", "stations/{n}/measurements"),
        ("nodes/9", "nodes/{tube}"),
        ("stations/3", "stations/{n}"),
        ("trajectory?depth=3", "md"),
        ("trajectory?md=abc", "md=4..12"),
        ("trajectory?md=5..4", "md=4..12"),
        ("trajectory?md=99", "0..4 m"),
        ("status?accept=xml", "json or msgpack"),
        ("status?md=3", "accept"),
    ],
)
async def test_a_wrong_selector_is_told_the_right_ones(rig: tuple[Rig, ZenohBus], selector: str, named: str) -> None:
    assert named in await refused(rig[1], f"{GROUND}/{selector}")


async def test_every_answer_has_the_fields_that_its_key_promises(rig: tuple[Rig, ZenohBus]) -> None:
    it, _ = rig
    it.survey(1, 3, inclination_deg=40.0)  # out of any tolerance
    it.tube.mail.submit(Event(1, 9, it.now, Severity.WARNING, "overrun", {"missed": 3, "share": None}), it.now)
    it.tube.mail.submit(
        StaticRecord(1, 10, 77, 1.0, 21.0, 38, (0.0, 0.0, 0.1), COV, (0.0, 0.0, -9.8), COV, 30.0, False), it.now
    )
    it.ground.operator.command(1, "align", {"turns": 3.0})
    it.run(2.0)
    number = next(iter(it.ground.model.orders)).number
    assert check_answers(it.ground.model) >= {
        "nodes/1", "stations/2", "stations/2/measurements", "alarms", "events", f"orders/{number}",
    }  # fmt: skip
    alarms = it.ground.operator.ask("alarms")
    assert alarms["active"]


async def test_msgpack_on_request(rig: tuple[Rig, ZenohBus]) -> None:
    _, bus = rig
    (reply,) = await asyncio.to_thread(bus.get, f"{GROUND}/stations?accept=msgpack", 10.0)
    assert msgpack.unpackb(reply.payload)["stations"] == (await ask(bus, f"{GROUND}/stations"))["stations"]


async def test_a_silent_node_goes_stale_and_comes_back(rig: tuple[Rig, ZenohBus]) -> None:
    it, bus = rig
    it.state(1, 2)
    it.depth(4.0)
    assert (await ask(bus, f"{GROUND}/nodes/1"))["stale"] is False
    it.run(5.0)
    it.depth(4.0)
    assert (await ask(bus, f"{GROUND}/nodes/1"))["stale"] is True
    assert (await ask(bus, f"{GROUND}/status"))["stale_tubes"] == [2, 1]
    it.state(1, 2)
    it.depth(4.0)
    assert (await ask(bus, f"{GROUND}/nodes/1"))["stale"] is False


async def test_silence_is_noticed_and_told_where_no_depth_comes_any_more(rig: tuple[Rig, ZenohBus]) -> None:
    it, bus = rig
    it.state(1, 2)
    with watching(bus, f"{GROUND}/nodes/1") as seen:
        await ask(bus, f"{GROUND}/status")  # the subscription has arrived when a later question is answered
        it.run(6.0)
        assert (await ask(bus, f"{GROUND}/nodes/1"))["stale"] is True
        await published(bus, lambda: bool(seen))
    assert [node["stale"] for node in seen] == [True]


async def test_a_restart_forgets_and_doubles_nothing(rig: tuple[Rig, ZenohBus], start: Callable[[], Rig]) -> None:
    it, bus = rig
    it.tube.mail.submit(Event(1, 7, it.now, Severity.INFO, "stopped"), it.now)
    it.run(2.0)
    before = (await ask(bus, f"{GROUND}/stations"))["stations"]
    again = start()
    again.now = it.now
    model = again.ground.model
    assert [(s.md, s.count) for s in model.hole.stations] == [(2.0, 2), (4.0, 1)]
    assert [e.sequence for e in model.string.events] == [7]
    again.run(3.0)
    stored = next(one.message for one in again.ground.store.messages() if isinstance(one.message, SurveyMeasurement))
    again.tube.mail.submit(stored, again.now)  # its receipt was lost
    again.run(2.0)
    assert [(s.md, s.count) for s in model.hole.stations] == [(2.0, 2), (4.0, 1)]
    assert again.tube.mail.outbox_size == 0
    assert before[0]["measurements"] == 2


def test_a_survey_that_comes_before_any_state_after_a_restart_finds_its_station(start: Callable[[], Rig]) -> None:
    first = start()
    first.run(3.0)
    first.depth(2.0)
    first.state(1, 1)
    first.state(2, 1)
    first.state(1, 2)
    first.depth(4.0)
    first.ground.store.close()
    again = start()
    again.now, again.md = first.now, first.md
    again.run(3.0)
    again.read_depth(4.0)
    again.survey(2, 1)
    assert [(s.md, s.count) for s in again.ground.model.hole.stations] == [(2.0, 1)]


def test_a_covariance_that_is_none_is_kept_and_counted_now_and_after_a_restart(start: Callable[[], Rig]) -> None:
    rig = start()
    rig.run(3.0)
    rig.depth(2.0)
    rig.state(1, 1)
    rig.tube.mail.submit(replace(MEASUREMENT, imus=(ImuMean((0.0, 0.0, -9.81), NO_COV),), station_at=rig.now), rig.now)
    rig.run(2.0)
    rig.read_depth(2.0)
    assert rig.tube.mail.outbox_size == 0
    assert (rig.ground.model.placement.refused, rig.ground.model.hole.stations) == (1, [])
    rig.ground.store.close()
    assert start().ground.model.placement.refused == 1


@pytest.mark.parametrize(
    "payload", [b"", b"\x93\x01", b"\xc1", encode_message(Receipt(1, 2)), msgpack.packb([1.0, 2.0]), b"x" * 9000]
)
def test_bytes_that_are_no_depth_are_counted_and_told(start: Callable[[], Rig], payload: bytes) -> None:
    rig = start()
    rig.run(3.0)
    rig.depth(2.0)
    rig.ground.on_depth(payload, rig.now)
    assert rig.ground.model.string.depths.latest == 2.0
    assert rig.ground.endpoint.counters["bad_depths"] == 1
    assert rig.alarms() >= {"bad_input"}


@pytest.mark.parametrize("arguments", [{"angle_deg": -101.8, "marks_deg": -174.9}, {}])
def test_a_joint_that_contradicts_its_marks_is_an_alarm_until_the_crew_has_looked(
    start: Callable[[], Rig], arguments: dict[str, float]
) -> None:
    rig = start()
    rig.speak(1)
    event = Event(1, 7, rig.now, Severity.WARNING, "joint_contradicts_marks", dict(arguments))
    rig.tube.mail.submit(event, rig.now)
    rig.run(2.0)
    (told,) = [row for row in rig.ask("alarms")["rig"] if row["code"] == "joint"]
    assert told["subject"] == "joint above tube 1"
    rig.ground.operator.order("accept_joints", {"action": "confirm"})
    rig.run(1.0)
    assert "joint" not in rig.alarms()


def test_a_depth_that_never_comes_after_a_restart_is_told(start: Callable[[], Rig]) -> None:
    first = start()
    first.speak(1)
    first.depth(2.0)
    first.ground.store.close()
    again = start()
    again.now, again.md = first.now, first.md
    again.run(4.0)
    assert "depth_silent" not in again.alarms()
    again.run(2.0)
    assert "depth_silent" in again.alarms()
    again.read_depth(2.0)
    again.run(1.0)
    assert "depth_silent" not in again.alarms()


def test_a_depth_that_jumped_is_not_believed_by_a_later_start_until_somebody_has_looked(
    start: Callable[[], Rig],
) -> None:
    """A stand of the refused time looked like news to a ground station that had forgotten why it refused it."""

    def next_start(before: Rig) -> Rig:
        before.ground.store.close()
        rig = start()
        rig.now, rig.md, rig.source = before.now, before.md, before.source
        rig.speak(2)
        return rig

    rig = start()
    rig.speak(2)
    rig.depth(2.5)
    rig.now += 0.5
    rig.read_depth(3.9)
    rig.run(1.0)
    assert "depth_refused" in rig.alarms()
    for _ in range(2):
        rig = next_start(rig)
        rig.depth(3.9)
        rig.run(1.0)
        assert rig.ground.model.string.depths.latest == 2.5
        assert "depth_refused" in rig.alarms()
    rig.ground.operator.order("accept_depth", {"action": "confirm"}, by="crew")
    rig.run(1.0)
    for _ in range(2):
        rig.depth(3.9)
        rig.run(1.0)
        assert rig.ground.model.string.depths.latest == 3.9
        assert "depth_refused" not in rig.alarms()
        rig = next_start(rig)


def test_a_survey_from_before_the_restart_finds_its_depth(start: Callable[[], Rig]) -> None:
    first = start()
    first.run(3.0)
    first.depth(2.0)
    first.depth(4.0)
    when = first.now - 0.25
    first.depth(6.0)
    first.ground.store.close()
    again = start()
    assert again.ground.model.string.depths.at(again.ground.model.string.time.epoch, when) == 4.0


def test_a_survey_without_a_depth_is_kept_and_counted(start: Callable[[], Rig]) -> None:
    rig = start()
    rig.run(3.0)
    rig.survey(1, 1)
    rig.run(6.0)
    assert rig.ground.model.placement.unplaced == 1
    assert "survey_unplaced" in rig.alarms()
    assert [s.md for s in rig.ground.store.messages()] == [None]
    assert rig.tube.mail.outbox_size == 0


async def published(bus: ZenohBus, arrived: Callable[[], bool]) -> None:
    """Wait for a sample, which comes on a thread of its own."""
    while not arrived():
        await ask(bus, f"{GROUND}/status")


@contextlib.contextmanager
def watching(bus: ZenohBus, key: str) -> Iterator[list[Any]]:
    seen: list[Any] = []
    bus.subscribe(key, lambda _key, payload: seen.append(json.loads(payload)))
    yield seen


async def test_a_change_is_published_on_the_key_it_changes(rig: tuple[Rig, ZenohBus]) -> None:
    it, bus = rig
    with watching(bus, f"{GROUND}/stations") as seen:
        await ask(bus, f"{GROUND}/status")  # the subscription has arrived when a later question is answered
        it.survey(2, 2)
        # what was published before the subscription may still come first
        await published(bus, lambda: bool(seen) and seen[-1]["stations"][0]["measurements"] == 3)
    assert seen[-1]["stations"][0]["measurements"] == 3


@pytest.mark.slow
@pytest.mark.parametrize(
    ("order", "named"),
    [
        (
            "dance?tube=1",
            "take_survey|static_record|parameters|check_board|resend|align|alignment|timing|upload_parameters|accept_depth",
        ),
        ("take_survey", "tube=N"),
        ("take_survey?tube=251", "1..250"),
        ("take_survey?tube=99", "tube 99: not in the string; expected one of 2, 1"),
        ("take_survey?tube=1;seconds=5", "seconds"),
        ("static_record?tube=1", "seconds"),
        ("static_record?tube=1;seconds=long", "seconds: expected 5..3600, got 'long'"),
        ("static_record?tube=1;seconds=4", "seconds: expected 5..3600, got '4'"),
        ("static_record?tube=1;seconds=nan", "seconds: expected 5..3600, got 'nan'"),
        ("align?tube=1;method=round", "method: expected circle, extremes, none, got 'round'"),
        ("align?tube=1;turns=two", "turns"),
        ("align?tube=1;speed=7", "method"),
        ("upload_parameters?tube=9;gyroscope=identity;accelerometer=identity", "tube 9: not in the string; expected"),
        ("upload_parameters?tube=1;gyroscope=identity", "accelerometer"),
        ("upload_parameters?tube=1;gyroscope=g;accelerometer=a;version=0", "version: expected an integer of 1..2^32-1"),
        ("upload_parameters?tube=1;gyroscope=identity;accelerometer=identity", "key_file"),
        ("recalibrate", "begin|attitude|solve|confirm|cancel"),
        ("recalibrate?action=begin", "key_file"),
        ("upload_parameters?tube=1;gyroscope=none;accelerometer=identity", "none.json"),
        ("upload_parameters?tube=1;gyroscope=..%2Fsecret;accelerometer=identity", "name of a file"),
    ],
)
async def test_an_order_that_cannot_be_is_refused_by_name(rig: tuple[Rig, ZenohBus], order: str, named: str) -> None:
    it, bus = rig
    reason = await refused(bus, f"borechain/rig-1/cmd/{order}")
    assert named in reason
    assert "\n" not in reason
    assert not it.ground.operator.has_pending
    assert (await ask(bus, f"{GROUND}/orders"))["orders"] == []


async def test_an_order_waits_for_nobody_and_its_course_is_published(
    rig: tuple[Rig, ZenohBus],
) -> None:
    it, bus = rig
    with watching(bus, f"{GROUND}/orders/*") as seen:
        silent = asyncio.create_task(ask(bus, "borechain/rig-1/cmd/take_survey?tube=2;by=anna"))
        live = asyncio.create_task(ask(bus, "borechain/rig-1/cmd/parameters?tube=1"))
        orders: list[Any] = []
        while len(orders) < 2:
            orders = (await ask(bus, f"{GROUND}/orders"))["orders"]
        assert {(o["command"], o["tube"], o["by"], o["state"], o["done"]) for o in orders} == {
            ("take_survey", 2, "anna", "sent", None),
            ("parameters", 1, "zenoh", "sent", None),
        }
        number = next(o["order"] for o in orders if o["tube"] == 1)
        it.run(1.0)
        it.tube.mail.reply(Reply(1, number, True, "", {"version": 7, "sha256": "ab", "of a later node": 1}))
        it.run(1.0)
        answer = await live
        assert (answer["state"], answer["done"], answer["values"]) == ("done", True, {"version": 7, "sha256": "ab"})
        assert not silent.done()
        again = await ask(bus, f"{GROUND}/orders/{number}")
        assert again == answer | {"utc": again["utc"]}
        await published(bus, lambda: any(view["order"] == number and view["state"] == "done" for view in seen))
    assert [view["state"] for view in seen if view["order"] == number] == ["sent", "done"]
    silent.cancel()


async def test_more_questions_than_can_wait_are_refused_at_once(
    start: Callable[[], Rig], buses: tuple[ZenohBus, ZenohBus], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("groundstation.gateway.zenoh.WAITING", 2)
    server, operator = buses
    async with answering_operators(start().ground, server):
        with ThreadPoolExecutor(4) as askers:
            asked = [askers.submit(operator.get, f"{GROUND}/status", 10.0) for _ in range(4)]
            refused = [future.result() for future in itertools.islice(as_completed(asked), 2)]  # the loop stands still
            answered = await asyncio.gather(*map(asyncio.wrap_future, asked))
    assert all("ask again later" in str(replies[0].error) for replies in refused)
    assert sum(replies[0].error is None for replies in answered) == 2


async def test_an_order_without_an_answer_names_its_number_and_key(
    rig: tuple[Rig, ZenohBus], monkeypatch: pytest.MonkeyPatch
) -> None:
    it, bus = rig
    monkeypatch.setattr("groundstation.gateway.zenoh.ORDER_TIMEOUT", 0.05)
    reason = await refused(bus, "borechain/rig-1/cmd/take_survey?tube=1")
    (order,) = it.ground.model.orders
    assert f"order {order.number}: tube 1 has not answered take_survey" in reason
    assert f"borechain/rig-1/ground/orders/{order.number}" in reason


async def test_static_records_are_shown_by_tube(rig: tuple[Rig, ZenohBus]) -> None:
    it, bus = rig
    record = StaticRecord(1, 9, 77, 1.0, 21.0, 38, (0.0, 0.0, 0.1), COV, (0.0, 0.0, -9.8), COV, 30.0, False)
    it.tube.mail.submit(record, it.now)
    it.run(2.0)
    (row,) = (await ask(bus, f"{GROUND}/static_records?tube=1"))["static_records"]
    assert (row["order"], row["samples"], row["moved"], row["temperature_c"]) == (77, 38, False, 30.0)
    assert (await ask(bus, f"{GROUND}/static_records?tube=2"))["static_records"] == []
    assert (await ask(bus, f"{GROUND}/nodes/1"))["parameters_version"] == 0
