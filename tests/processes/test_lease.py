"""Who slept and was followed meanwhile writes nothing more: real ground stations, a real router, a real string."""

import contextlib
import json
import os
import signal
import urllib.request
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from rigs import free_endpoint

from borechain.load.crowd import Crowd, crowd_in_thread
from borechain.load.killed import PRELOAD, await_receipts, first_receipt, run_own_clock_ground, wait_until
from groundstation.config import checked_config
from groundstation.gateway.page.page_settings import PageSettings
from groundstation.ground_host import run_ground
from groundstation.service.disk.ground_store import Store
from sim.rig.processes import ProcessTable, Spec
from telemetry import keys
from telemetry.media.zenoh_bus import ZenohBus, open_router
from telemetry.messages import ENCODER
from telemetry.runtime.hosting import Place

pytestmark = pytest.mark.process
RIG = "slept"


def run_with_page(place: Place, port: int) -> None:
    """A ground station by its own clock, with a page for this machine."""
    run_ground(place, {}, own_clock=True, page=PageSettings("127.0.0.1", port))


@dataclass(frozen=True)
class Stations:
    """Two ground stations of one rig that can be started, their router and the port of the first one's page."""

    table: ProcessTable
    bus: ZenohBus
    port: int


@pytest.fixture
def stations(tmp_path: Path) -> Iterator[Stations]:
    endpoint, port = free_endpoint(), int(free_endpoint().rpartition(":")[2])
    specs = {
        "first": Spec(run_with_page, (Place(RIG, endpoint, tmp_path / "first"), port)),
        "second": Spec(run_own_clock_ground, (Place(RIG, endpoint, tmp_path / "second"), {})),
    }
    table = ProcessTable(specs, [PRELOAD])
    try:
        table.warm()
        with open_router(endpoint) as bus:
            yield Stations(table, bus, port)
    finally:
        table.stop()


def kept(folder: Path) -> Counter[int]:
    """Numbers of the encoder's events in a database."""
    with contextlib.closing(Store(checked_config(rig=RIG, folder=folder).url)) as store:
        return Counter(one.message.sequence for one in store.messages() if one.message.tube == ENCODER)


def holders(bus: ZenohBus) -> set[str]:
    """Processes whose leases the router knows, by number."""
    tokens = bus.tokens(keys.LEASE.format(rig=RIG, holder="*"), 2.0)
    return {token.rsplit("/", 1)[1].split("_")[2] for token in tokens}


def answers(bus: ZenohBus, path: str) -> list[dict[str, Any]]:
    """What every ground station answers."""
    replies = bus.get(keys.GROUND.format(rig=RIG, path=path), 5.0)
    return [json.loads(reply.payload) for reply in replies if reply.error is None]


def test_a_ground_station_that_slept_gives_way_to_the_one_that_followed(stations: Stations, tmp_path: Path) -> None:
    table, bus = stations.table, stations.bus
    crowd = Crowd(1, bus, RIG)
    with crowd_in_thread(crowd, bus, RIG) as loop:
        handed = 0

        def hand_over() -> None:
            nonlocal handed
            loop.call(lambda _process, now: crowd.happen(now))
            handed += 1

        table.start("first")
        first_receipt(crowd, hand_over)
        wait_until(lambda: crowd.endpoint.mail.outbox_size == 0)
        before, (first,) = handed, holders(bus)
        os.kill(int(first), signal.SIGSTOP)
        wait_until(lambda: first not in holders(bus))  # the router takes it for dead
        table.start("second")
        first_receipt(crowd, hand_over)
        os.kill(int(first), signal.SIGCONT)
        wait_until(lambda: told_on_page(stations.port))
        (second,) = holders(bus)
        assert second != first
        assert told_on_page(stations.port).startswith(f"rig {RIG}: process {second} on ")
        assert on_page(stations.port, "verdict")["verdict"] == "dont_know"
        await_receipts(crowd, hand_over, 20)
        wait_until(lambda: crowd.endpoint.mail.outbox_size == 0)
        (alarms,) = answers(bus, "alarms")
        assert "lease" not in {row["code"] for row in alarms["rig"]}
    table.stop()
    assert set(kept(tmp_path / "first")) == set(range(1, before + 1))
    assert set(kept(tmp_path / "second")) >= set(range(before + 1, handed + 1))
    assert max(kept(tmp_path / "second").values()) == 1


def on_page(port: int, path: str) -> dict[str, Any]:
    """What the page answers."""
    with urllib.request.urlopen(f"http://127.0.0.1:{port}/api/{path}", timeout=10.0) as answer:
        return dict(json.load(answer))


def told_on_page(port: int) -> str:
    """What the page says of a lease that another one has now; empty before it does."""
    details = [row["detail"] for row in on_page(port, "alarms")["rig"] if row["code"] == "lease"]
    return next((detail for detail in details if "is its ground station" in detail), "")


@pytest.mark.statistical
def test_a_ground_station_that_slept_alone_goes_on(stations: Stations, tmp_path: Path) -> None:
    table, bus = stations.table, stations.bus
    crowd = Crowd(1, bus, RIG)
    with crowd_in_thread(crowd, bus, RIG) as loop:
        handed = 0

        def hand_over() -> None:
            nonlocal handed
            loop.call(lambda _process, now: crowd.happen(now))
            handed += 1

        table.start("first")
        first_receipt(crowd, hand_over)
        (first,) = holders(bus)
        os.kill(int(first), signal.SIGSTOP)
        wait_until(lambda: not holders(bus))
        os.kill(int(first), signal.SIGCONT)
        before = crowd.receipted
        hand_over()

        def is_receipted() -> bool:
            """One that the router has not made known again ends, and is started again as by its crew."""
            table.reconcile(["first"], [])
            return crowd.receipted > before

        wait_until(is_receipted)
        wait_until(lambda: crowd.endpoint.mail.outbox_size == 0)
        (alarms,) = answers(bus, "alarms")
        assert "lease" not in {row["code"] for row in alarms["rig"]}
    table.stop()
    assert kept(tmp_path / "first") == Counter(range(1, handed + 1))
