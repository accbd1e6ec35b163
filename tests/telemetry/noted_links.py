"""Links that note what they are to send and receive what a test says, and an endpoint and a mail over them."""

from __future__ import annotations

import math
from collections import Counter
from typing import Any

from sealed_string import state

from telemetry.application.end_to_end import EndToEndDelivery
from telemetry.application.endpoint import Endpoint
from telemetry.messages import Aiding, BlockStatus, Side, UploadPhase

UPPER, LOWER = Side.UPPER, Side.LOWER
AIDING = Aiding(1.0, 1e-6, 0.0, 0.0, 0.1, 100.0, 1, 0)
STATE = state(50)
STATUS = BlockStatus(3, 5, bytes(32), UploadPhase.REFUSED, 0, 2, bytes(32), "too old")


class NotedLink:
    """A link that notes what it is to send, and receives what a test says."""

    def __init__(self, peer: tuple[int, int] | None = None, *, up: bool = True) -> None:
        self.peer, self.up = peer, up
        self.said: list[tuple[Any, ...]] = []
        self.heard: list[bytes] = []
        self.peer_after: Any = "same"
        self.released, self.quality, self.margin, self.waiting = 0, 0.75, 12.5, 3
        self.counters: Counter[str] = Counter()
        self.wake = math.inf

    def is_up(self, now: float) -> bool:
        return self.up

    def send_reliable(self, payload: bytes, priority: Any = "SURVEY") -> None:
        self.said.append(("reliable", bytes(payload), getattr(priority, "name", priority)))

    def send_best_effort(self, payload: Any, topic: Any, priority: Any) -> None:
        self.said.append(("best", bytes(payload), topic, priority.name))

    def send_with_others(self, payload: Any, topic: Any, priority: Any, until: float) -> None:
        self.said.append(("others", bytes(payload), topic, priority.name, until))

    def release(self, now: float = math.inf) -> None:
        self.released += 1

    def receive(self, frame: Any, now: float, margin: float) -> list[bytes]:
        if self.peer_after != "same":
            self.peer = self.peer_after
        return self.heard

    def take_frames(self, now: float) -> list[Any]:
        return []

    def next_wake(self, now: float) -> float:
        return self.wake

    def taken(self) -> list[tuple[Any, ...]]:
        said, self.said = self.said, []
        return said


def noted(address: int, *sides: Side, is_root: bool = False) -> tuple[Endpoint, dict[Side, NotedLink]]:
    """An endpoint over noted links."""
    made = Endpoint(address, frozenset(sides), boot_count=4, is_clock_root=is_root)
    links = {side: NotedLink() for side in sorted(sides)}
    made._links = links  # type: ignore[assignment]
    made.mail._upper, made.mail._lower = links.get(Side.UPPER), links.get(Side.LOWER)  # type: ignore[assignment]
    return made, links


def mail(address: int, upper: NotedLink | None, lower: NotedLink | None, seals: Any = None) -> EndToEndDelivery:
    return EndToEndDelivery(address, 1, upper, lower, Counter(), seals)  # type: ignore[arg-type]
