"""A ground station that is killed again and again while a string hands it what must not be lost."""

from __future__ import annotations

import contextlib
import random
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from borechain.load.crowd import Crowd, crowd_in_thread
from borechain.load.patience import wait_for
from groundstation.config import checked_config
from groundstation.ground_host import run_ground
from groundstation.service.disk.ground_store import Store
from sim.rig.processes import ProcessTable, Spec
from telemetry.media.zenoh_bus import open_router
from telemetry.messages import ENCODER
from telemetry.runtime.hosting import Place

RIG = "killed"
PRELOAD = "borechain.drilling.preload"
AT_ONCE = 8  # events that wait for their receipt
MOST_RECEIPTS = 40  # of a life
PATIENCE_S = 60.0
LOOK_S = 0.002


@dataclass
class KillOutcome:
    """Counts of events handed over, receipted and kept, and the times of the first receipts after each start (s)."""

    handed: int = 0
    lost: int = 0
    doubled: int = 0
    back_s: list[float] = field(default_factory=list)

    @property
    def is_whole(self) -> bool:
        """Whether every event is kept, and once."""
        return self.lost == self.doubled == 0


def kill_again_and_again(
    times: int, endpoint: str, folder: Path, database: str | None = None, seed: int = 1
) -> KillOutcome:
    """Kill a ground station ``times`` times at random moments, and count what its database keeps at the end.

    ``database`` is the URL of an empty one; SQLite in ``folder`` without it.

    Raises
    ------
    RigError
        When a new life receipts nothing for a minute.
    """
    lot = random.Random(seed)
    settings: dict[str, Any] = {"database_url": database}
    place = Place(RIG, endpoint, folder)
    table = ProcessTable({"base": Spec(run_own_clock_ground, (place, settings))}, [PRELOAD])
    outcome = KillOutcome()
    try:
        table.warm()
        with open_router(endpoint) as bus:
            crowd = Crowd(1, bus, RIG)
            with crowd_in_thread(crowd, bus, RIG) as loop:

                def hand_over() -> None:
                    loop.call(lambda _process, now: crowd.happen(now))
                    outcome.handed += 1

                for _ in range(times + 1):
                    begun = time.monotonic()
                    table.start("base")
                    outcome.back_s.append(first_receipt(crowd, hand_over) - begun)
                    if len(outcome.back_s) <= times:
                        await_receipts(crowd, hand_over, lot.randint(1, MOST_RECEIPTS))
                        table.kill("base")
                wait_until(lambda: crowd.endpoint.mail.outbox_size == 0)
    finally:
        table.stop()
    count_losses(outcome, checked_config(rig=RIG, folder=folder, **settings).url)
    return outcome


def run_own_clock_ground(place: Place, settings: dict[str, Any]) -> None:
    """The ground station as a process by its own clock."""
    run_ground(place, settings, own_clock=True)


def first_receipt(crowd: Crowd, hand_over: Callable[[], None]) -> float:
    """Time (s, monotonic) at which something is receipted again."""
    before = crowd.receipted
    for _ in range(AT_ONCE):
        hand_over()
    wait_until(lambda: crowd.receipted > before)
    return time.monotonic()


def await_receipts(crowd: Crowd, hand_over: Callable[[], None], wanted: int) -> None:
    """Hand over until so many more were receipted."""
    until = crowd.receipted + wanted

    def are_enough() -> bool:
        if crowd.receipted < until and crowd.endpoint.mail.outbox_size < AT_ONCE:
            hand_over()
        return crowd.receipted >= until

    wait_until(are_enough)


def wait_until(true: Callable[[], bool]) -> None:
    """Wait until ``true()``, asked again and again."""
    wait_for(lambda: true() or None, "the ground station was killed and has receipted nothing", PATIENCE_S, LOOK_S)


def count_losses(outcome: KillOutcome, url: str) -> None:
    """Compare what was handed over with what is kept."""
    with contextlib.closing(Store(url)) as store:
        kept = Counter(stored.message.sequence for stored in store.messages() if stored.message.tube == ENCODER)
    outcome.lost = sum(number not in kept for number in range(1, outcome.handed + 1))
    outcome.doubled = sum(times - 1 for times in kept.values())
