"""One ground station a rig: a token on the bus that lives as long as its holder, and is watched by it.

Two that come at the same moment both see the other, and the one that took it first stays. A holder that has slept, or
was cut off from the router, may have been followed meanwhile: its lease has lapsed, and it has to take it anew before
it writes or acknowledges anything. A session that was asleep for longer than its router waits is joined again and
not known again (zenoh 1.x): its lapse is looked into by a fresh one.
"""

from __future__ import annotations

import os
import secrets
import socket
import threading
import time
from collections.abc import Callable
from contextlib import AbstractContextManager, suppress
from typing import Protocol

from groundstation.errors import LeaseError
from telemetry import keys
from telemetry.errors import MediumError

PATIENCE = 5.0  # wall s for which the token of a dead ground station may be left over
ASK_EVERY = 0.5  # wall s
ASK_TIMEOUT = 2.0  # wall s
VALID = 5.0  # s without the router's word after which a lease has lapsed; routers forget who is silent after 10
DEAF_AFTER = 15.0  # s without the router's word, while others are answered: the session is not known any more
BY_ROUTER = 2  # times that a token is answered: by the session that has declared it, and by the router that knows it


class LeaseBus(Protocol):
    """What a lease needs of a bus, such as ``ZenohBus``."""

    def liveliness_token(self, key: str) -> Callable[[], None]:
        """Declare a token; returns what takes it back."""
        ...

    def tokens(self, pattern: str, timeout: float) -> list[str]:
        """Tokens that are there now, as often as they are answered."""
        ...


ReachRouter = Callable[[], AbstractContextManager[LeaseBus]]


def now_awake_or_asleep() -> float:
    """Seconds of a clock that goes on while the machine sleeps."""
    return time.clock_gettime(time.CLOCK_BOOTTIME) if hasattr(time, "CLOCK_BOOTTIME") else time.monotonic()


class RigLease:
    """The lease of a rig, held until ``close``.

    Parameters
    ----------
    bus, rig : where, and of which rig
    reach : a fresh session with the same router, to look into a lapse
    clock : s, goes on while the machine sleeps

    Raises
    ------
    LeaseError
        When there is another ground station; it is named.
    """

    def __init__(
        self, bus: LeaseBus, rig: str, reach: ReachRouter, clock: Callable[[], float] = now_awake_or_asleep
    ) -> None:
        self._bus, self._rig, self._reach, self._clock = bus, rig, reach, clock
        self._pattern = keys.LEASE.format(rig=rig, holder="*")
        self._closed = threading.Event()
        self._follower = ""  # token of the ground station that has the rig now
        self._is_deaf = False
        self._contested_since: float | None = None  # s, since another one's older token is there
        self._take_back: Callable[[], None] = lambda: None
        self._own = ""
        self._confirmed_at = clock()
        deadline = time.monotonic() + PATIENCE
        while others := bus.tokens(self._pattern, ASK_TIMEOUT):
            if time.monotonic() >= deadline:
                raise LeaseError(lease_refusal(rig, others[0]))
            time.sleep(ASK_EVERY)
        self._declare()
        if first := self._first_before():
            raise LeaseError(lease_refusal(rig, first))

    @property
    def trouble(self) -> str:
        """Why nothing may be written or acknowledged now; empty while the lease stands."""
        if self._follower:
            return lease_refusal(self._rig, self._follower)
        if (silent := self._clock() - self._confirmed_at) > VALID:
            return f"the router has not confirmed for {silent:.0f} s that this is the ground station of rig {self._rig}"
        if self._contested_since is not None:
            return f"another ground station of rig {self._rig} is there; one of the two gives way"
        return ""

    @property
    def is_lost(self) -> bool:
        """Whether another ground station has the rig, for good."""
        return bool(self._follower)

    @property
    def is_deaf(self) -> bool:
        """Whether the router answers others and has forgotten this session: only a new one is heard again."""
        return self._is_deaf

    def watch(self) -> None:
        """Confirm the lease again and again on a thread, until ``close`` or until it is lost."""
        threading.Thread(target=self._watch, name="lease", daemon=True).start()

    def close(self) -> None:
        """Watch no more; the token ends with the session."""
        self._closed.set()

    def confirm(self) -> None:
        """Look once whether the lease stands; one that has lapsed is taken anew, or lost."""
        asked_at = self._clock()
        tokens = self._bus.tokens(self._pattern, ASK_TIMEOUT)
        if tokens.count(self._own) < BY_ROUTER:
            self._look_into(asked_at - self._confirmed_at)
            return
        if asked_at - self._confirmed_at > VALID:
            self._take_anew(tokens)
        else:
            self._meet(tokens, asked_at)
        if not self.is_lost:
            self._confirmed_at = asked_at

    def _watch(self) -> None:
        while not (self._closed.wait(ASK_EVERY) or self.is_lost):
            with suppress(MediumError):  # the session is closing
                self.confirm()

    def _look_into(self, silent: float) -> None:
        """The router is away, or no longer knows this session: a fresh one finds out whose the rig is."""
        if silent <= VALID:
            return
        with suppress(MediumError), self._reach() as fresh:
            others = [token for token in fresh.tokens(self._pattern, ASK_TIMEOUT) if token != self._own]
            if others:
                self._follower = others[0]
                self._take_back()
            self._is_deaf = not others and silent > DEAF_AFTER

    def _take_anew(self, tokens: list[str]) -> None:
        """After a lapse a ground station that took the rig meanwhile keeps it; the old token says nothing any more."""
        others = [token for token in tokens if token != self._own]
        self._take_back()
        if others:
            self._follower = others[0]
            return
        self._declare()
        self._follower = self._first_before()
        if self._follower:
            self._take_back()

    def _meet(self, tokens: list[str], now: float) -> None:
        """An older token beside a lease that stands: of one that wakes it goes at once, another one is in its right."""
        older = [token for token in tokens if token < self._own]
        if not older:
            self._contested_since = None
        elif self._contested_since is None:
            self._contested_since = now
        elif now - self._contested_since > VALID:
            self._follower = older[0]
            self._take_back()

    def _declare(self) -> None:
        self._own = keys.LEASE.format(rig=self._rig, holder=holder_name())
        self._take_back = self._bus.liveliness_token(self._own)

    def _first_before(self) -> str:
        """Token of who was first, if it was another one."""
        first = min([self._own, *self._bus.tokens(self._pattern, ASK_TIMEOUT)])
        return "" if first == self._own else first


def holder_name() -> str:
    """Name of this ground station, the older the smaller: when it took the rig, its machine and its process."""
    machine = "".join(c if c.isalnum() else "-" for c in socket.gethostname())[:40] or "unnamed"
    return f"{time.time_ns():020d}_{machine}_{os.getpid()}_{secrets.token_hex(4)}"


def lease_refusal(rig: str, token: str) -> str:
    """Why a second ground station is refused, by the token of the first."""
    _, machine, process, _ = token.rsplit("/", 1)[1].split("_")
    return f"rig {rig}: process {process} on {machine} is its ground station; end that one, or choose another --rig"
