"""Tells the crew, at most once a minute, of frames and messages whose seals were refused."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

from telemetry.application.endpoint import Endpoint
from telemetry.messages import Scalar, Severity

TELL_EVERY = 60.0  # s, so that a forger fills no memory and no flash
CODE = "seal_refused"

Say = Callable[[Severity, str, dict[str, Scalar]], None]


class SealWatch:
    """Compares the counts of an endpoint's seals with what was told.

    Parameters
    ----------
    endpoint : whose seals; one without keys never tells anything
    say : makes an event
    """

    def __init__(self, endpoint: Endpoint, say: Say) -> None:
        self._endpoint = endpoint
        self._say = say
        self._told: dict[str, int] = {}
        self._told_at = -math.inf

    def look(self, now: float) -> None:
        """Report new refusals at ``now`` (s, own clock)."""
        if now < self._told_at + TELL_EVERY or not (fresh := self.fresh()):
            return
        self._told_at, self._told = now, self._told | fresh
        reason = max(fresh, key=lambda name: fresh[name])
        refused = sum(self._told.values())
        self._say(Severity.WARNING, CODE, {"refused": refused, "mostly": reason.removeprefix("seal_")})

    def fresh(self) -> dict[str, int]:
        """Counts that have grown since they were told."""
        seals = self._endpoint.seals
        failures = {} if seals is None else seals.failures()
        return {name: count for name, count in failures.items() if count > self._told.get(name, 0)}


def refusal_of(arguments: Mapping[str, Scalar]) -> str:
    """Line about an event of the code ``seal_refused``, for people."""
    return f"{arguments.get('refused')} refused, mostly {arguments.get('mostly')}"
