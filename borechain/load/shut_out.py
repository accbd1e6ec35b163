"""A person who is revoked in mid-drill: after how long no question of theirs is answered, while the tubes go on."""

from __future__ import annotations

import contextlib
import datetime
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from borechain.drilling.router_host import run_router
from borechain.load.crowd import Crowd, crowd_in_thread
from borechain.load.killed import PRELOAD, KillOutcome, count_losses, first_receipt, run_own_clock_ground, wait_until
from borechain.pki.rig_keys import add_person, init_rig, revoke_person
from groundstation.config import checked_config
from sim.rig.processes import ProcessTable, Spec
from telemetry import keys
from telemetry.application.seals import seals_of
from telemetry.media.credentials import credentials_of
from telemetry.media.zenoh_bus import ZenohBus, open_client
from telemetry.messages import ENCODER, Side
from telemetry.runtime.hosting import Place

RIG = "shut-out"
STAYS = "ben"
JOIN_S, ANSWER_S = 20.0, 0.5  # to join a router, and for which one answer is waited


def measure_shut_out(times: int, endpoint: str, folder: Path) -> dict[str, Any]:
    """Revoke ``times`` persons one after the other; s until each is out and the string is receipted again, and losses.

    Raises
    ------
    RigError
        When one is still answered after a minute, or nothing is receipted any more.
    """
    stick, now = folder / "stick", datetime.datetime.now(datetime.UTC)
    init_rig(stick, RIG, now)
    leaving = [f"person-{number}" for number in range(times)]
    for name in (*leaving, STAYS):
        add_person(stick, name, "driller", now)
    place = Place(RIG, endpoint, folder / "ground", keys=stick)
    specs = {"router": Spec(run_router, (endpoint, stick)), "base": Spec(run_own_clock_ground, (place, {}))}
    table, outcome = ProcessTable(specs, [PRELOAD]), KillOutcome()
    rows: list[tuple[float, float]] = []
    try:
        table.warm()
        for name in specs:
            table.start(name)
        with living_string(endpoint, stick, outcome) as crowd, open_person(endpoint, stick, STAYS) as his:
            for name in leaving:
                with open_person(endpoint, stick, name) as hers:
                    wait_until(lambda hers=hers: is_answered(hers) and is_answered(his))  # type: ignore[misc]
                    rows.append(time_until_out(hers, his, stick, name, crowd))
    finally:
        table.stop()
    count_losses(outcome, checked_config(rig=RIG, folder=folder / "ground").url)
    return {
        "times": times,
        "out_s": [round(out, 2) for out, _ in rows],
        "goes_on_s": [round(goes_on, 2) for _, goes_on in rows],
        "handed": outcome.handed,
        "lost": outcome.lost,
        "doubled": outcome.doubled,
    }


@contextlib.contextmanager
def living_string(endpoint: str, stick: Path, outcome: KillOutcome) -> Iterator[HandedCrowd]:
    """A string that hands over one thing after the other, and what it handed over is receipted at the end."""
    with open_client(endpoint, JOIN_S, credentials_of(stick, "encoder")) as bus:
        crowd = HandedCrowd(1, bus, RIG, seals=seals_of(stick, ENCODER, [Side.UPPER]))
        with crowd_in_thread(crowd, bus, RIG) as loop:

            def hand_over() -> None:
                loop.call(lambda _process, now: crowd.happen(now))
                outcome.handed += 1

            crowd.one_more = hand_over
            first_receipt(crowd, hand_over)
            yield crowd
            wait_until(lambda: crowd.endpoint.mail.outbox_size == 0)


class HandedCrowd(Crowd):
    """A string, and how it is given one thing more to hand over."""

    one_more: Callable[[], None]  # hands one thing over; set once the string lives


@contextlib.contextmanager
def open_person(endpoint: str, stick: Path, name: str) -> Iterator[ZenohBus]:
    """Session of a person."""
    with open_client(endpoint, JOIN_S, credentials_of(stick, name)) as bus:
        yield bus


def is_answered(bus: ZenohBus) -> bool:
    """Whether a person is answered by the ground station."""
    return any(reply.error is None for reply in bus.get(keys.GROUND.format(rig=RIG, path="status"), ANSWER_S))


def time_until_out(hers: ZenohBus, his: ZenohBus, stick: Path, name: str, crowd: HandedCrowd) -> tuple[float, float]:
    """Times (s) from a revocation until she is not answered while he is, and until what is handed over then is kept."""
    begun, before = time.monotonic(), crowd.receipted
    revoke_person(stick, name)
    wait_until(lambda: not is_answered(hers) and is_answered(his))
    out = time.monotonic() - begun
    crowd.one_more()
    wait_until(lambda: crowd.receipted > before and crowd.endpoint.mail.outbox_size == 0)
    return out, time.monotonic() - begun
