"""Who may do what at a router over TLS, with real sessions: each certificate does its own and nothing else."""

from __future__ import annotations

import contextlib
import datetime
import queue
import textwrap
from collections.abc import Iterator
from pathlib import Path

import pytest
from rigs import free_endpoint
from sealed_string import make_folder

from borechain.client import connect_to_ground, live_rigs
from borechain.pki.access import read_access
from telemetry import keys
from telemetry.application.seals import seals_of
from telemetry.errors import MediumError
from telemetry.keys import port_key
from telemetry.media.credentials import Credentials, credentials_of
from telemetry.media.zenoh_bus import Publisher, Query, ZenohBus, open_client, open_router
from telemetry.messages import BASE, DepthReading, Side
from telemetry.presentation.msgpack_codec import decode_message

pytestmark = pytest.mark.slow
RIG = "rig-1"
WAIT = 20.0  # s; nothing that is to come takes as long
BRIEFLY = 2.0  # s that a session tries to connect
STATUS, ORDER = f"borechain/{RIG}/ground/status", f"borechain/{RIG}/cmd/take_survey"
TODAY = datetime.datetime.now(datetime.UTC)
LAST = "last"  # follows what must not arrive: a session keeps the order of what it sends


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_folder(tmp_path_factory.mktemp("pki") / "stick", now=TODAY)


@pytest.fixture(scope="module")
def endpoint(folder: Path) -> Iterator[str]:
    where = free_endpoint().replace("tcp/", "tls/")
    with open_router(where, credentials_of(folder, "router"), read_access(folder)):
        yield where


@pytest.fixture(scope="module")
def buses(folder: Path, endpoint: str) -> Iterator[dict[str, ZenohBus]]:
    names = ("tube-1", "tube-2", "encoder", "base", "depth", "operator", "driller", "medium")
    with contextlib.ExitStack() as stack:
        sessions = {
            name: stack.enter_context(open_client(endpoint, WAIT, credentials_of(folder, name))) for name in names
        }

        def answer(query: Query) -> None:
            key = query.selector_key.replace("/*/", f"/{RIG}/")
            query.reply(key if "*" not in key else STATUS, b"answered")
            query.finish()

        for path in ("ground/**", "cmd/**", "intake"):
            sessions["base"].queryable_kept(f"borechain/{RIG}/{path}", answer)
        yield sessions


def heard(writer: ZenohBus, reader: ZenohBus, wanted: str, allowed: str) -> list[str]:
    """Keys on which the reader hears the writer, who writes ``wanted`` and then ``allowed``, which must arrive."""
    arrived: queue.SimpleQueue[str] = queue.SimpleQueue()
    reader.subscribe(wanted, lambda key, _payload: arrived.put(key))
    reader.subscribe(allowed, lambda key, _payload: arrived.put(key))
    publishers = [writer.publisher(wanted), writer.publisher(allowed)]
    wait_until_heard(publishers[1])
    found: list[str] = []
    while allowed not in found:
        for publisher in publishers:
            publisher.put(b"x")
        with contextlib.suppress(queue.Empty):
            while True:
                found.append(arrived.get(timeout=0.2))
    return sorted(set(found))


def wait_until_heard(publisher: Publisher) -> None:
    idle: queue.SimpleQueue[None] = queue.SimpleQueue()
    for _ in range(int(WAIT / 0.05)):
        if publisher.is_heard:
            return
        with contextlib.suppress(queue.Empty):
            idle.get(timeout=0.05)
    raise AssertionError("no listener")


def answers(bus: ZenohBus, selector: str) -> list[bytes]:
    return [reply.payload for reply in bus.get(selector, BRIEFLY) if reply.error is None]


def test_a_node_writes_its_own_port_and_not_anothers(buses: dict[str, ZenohBus]) -> None:
    own, others = port_key(RIG, 1, Side.UPPER, "tx"), port_key(RIG, 2, Side.UPPER, "tx")
    assert heard(buses["tube-1"], buses["tube-2"], others, own) == [own]
    assert heard(buses["tube-2"], buses["tube-1"], own, others) == [others]


@pytest.mark.parametrize(
    "wanted",
    [
        keys.DEPTH.format(rig=RIG),
        STATUS,
        port_key(RIG, BASE, Side.LOWER, "tx"),
        port_key(RIG, 0, Side.LOWER, "tx"),
        f"borechain/{RIG}/stepper/2/step",
        "borechain/rig-2/port/1/lower/tx",
    ],
)
def test_a_node_writes_nothing_that_is_not_its_own(buses: dict[str, ZenohBus], wanted: str) -> None:
    own = port_key(RIG, 1, Side.LOWER, "tx")
    assert heard(buses["tube-1"], buses["medium"], wanted, own) == [own]


def test_the_depth_comes_from_its_source_alone(buses: dict[str, ZenohBus]) -> None:
    depth, status = keys.DEPTH.format(rig=RIG), STATUS
    assert heard(buses["depth"], buses["base"], status, depth) == [depth]
    assert heard(buses["base"], buses["medium"], depth, status) == [status]


def test_an_operator_asks_and_does_not_order_a_driller_does_both(buses: dict[str, ZenohBus]) -> None:
    assert answers(buses["operator"], STATUS) == [b"answered"]
    assert answers(buses["operator"], "borechain/*/ground/trajectory?md=4..12") == [b"answered"]
    assert answers(buses["operator"], ORDER) == answers(buses["operator"], "borechain/*/cmd/take_survey?tube=1") == []
    assert answers(buses["operator"], "borechain/**") == []
    assert answers(buses["driller"], STATUS) == [b"answered"]
    assert answers(buses["driller"], ORDER) == [b"answered"]
    assert answers(buses["tube-1"], STATUS) == answers(buses["tube-1"], ORDER) == []


def test_an_operator_hears_the_ground_station_and_no_port(buses: dict[str, ZenohBus]) -> None:
    port, intake = port_key(RIG, BASE, Side.LOWER, "tx"), keys.INTAKE.format(rig=RIG)
    assert heard(buses["base"], buses["operator"], port, STATUS) == [STATUS]
    assert heard(buses["base"], buses["operator"], port, intake) == [intake]
    assert answers(buses["operator"], intake) == [b"answered"]
    assert answers(buses["tube-1"], intake) == []


def test_a_client_shows_its_certificate(folder: Path, endpoint: str, buses: dict[str, ZenohBus]) -> None:
    buses["base"].liveliness_token(keys.LEASE.format(rig=RIG, holder="base"))
    with connect_to_ground(endpoint, RIG, WAIT, keys_place=folder) as ground:
        assert live_rigs(ground._bus) == [RIG]
        assert answers(ground._bus, ORDER) == []
    with connect_to_ground(endpoint, RIG, WAIT, keys_place=folder, role="driller") as ground:
        assert answers(ground._bus, ORDER) == [b"answered"]
    with pytest.raises(MediumError, match="expected --keys with it"), connect_to_ground(endpoint, RIG):
        pass


def test_a_source_of_the_depth_as_the_page_writes_it_is_believed(
    buses: dict[str, ZenohBus], endpoint: str, folder: Path
) -> None:
    page = (Path(__file__).parents[2] / "docs" / "deploy.md").read_text()
    lines = page.partition("    from pathlib import Path\n")[2].partition("\n\nThen, ")[0]
    program = textwrap.dedent(f"    from pathlib import Path\n{lines}")
    arrived: queue.SimpleQueue[bytes] = queue.SimpleQueue()
    buses["base"].subscribe(keys.DEPTH.format(rig=RIG), lambda _key, payload: arrived.put(payload))
    told = {"readings": lambda: [(12.5, 3.2)]}
    exec(program.replace("tls/surface:7447", endpoint).replace("/etc/borechain", str(folder)), told)
    seals = seals_of(folder, BASE, [Side.LOWER])
    assert seals is not None
    reading = decode_message(seals.depth_content(arrived.get(timeout=WAIT)) or b"")
    assert isinstance(reading, DepthReading)
    assert (reading.at, reading.md) == (12.5, 3.2)


def test_a_client_without_a_certificate_of_the_rig_gets_nowhere(endpoint: str, folder: Path, tmp_path: Path) -> None:
    foreign = credentials_of(make_folder(tmp_path / "foreign", 1, TODAY), "tube-1")
    ours = credentials_of(folder, "tube-1")
    mixed = Credentials(
        ours.authority, foreign.certificate, foreign.key
    )  # it knows the router, not the other way round
    for credentials in (None, foreign, mixed):
        refused(endpoint, credentials)
    refused(endpoint.replace("tls/", "tcp/"), None)


def refused(endpoint: str, credentials: Credentials | None) -> None:
    """Neither reads nor writes: no session comes about."""
    with pytest.raises(MediumError, match="no router at"), open_client(endpoint, BRIEFLY, credentials):
        pass


def test_a_stolen_tube_cannot_be_the_router(folder: Path) -> None:
    """A certificate that is good for a client is not good for listening."""
    where = free_endpoint().replace("tcp/", "tls/")
    with open_router(where, credentials_of(folder, "tube-1")):
        refused(where, credentials_of(folder, "tube-2"))
