"""Leases of a rig in drawn worlds: machines that sleep, a router that forgets and comes again; never two at once."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import pytest
from hand_fed import Rig
from hypothesis import given, settings
from hypothesis import strategies as st

from groundstation.errors import LeaseError
from groundstation.gateway.lease import ASK_EVERY, VALID, RigLease
from telemetry.errors import MediumError

FORGETS = 10.0  # s after which a router forgets who is silent: zenoh's own default
AGAIN = 1.0  # s until a session has joined a router again


class MadeRouter:
    """A router that knows the tokens of the sessions it hears."""

    def __init__(self) -> None:
        self.now = 1000.0
        self.away_until = 0.0
        self.sessions: list[MadeSession] = []

    def known(self) -> list[str]:
        return [token for one in self.sessions if one.is_known() for token in one.tokens_of_own]


class MadeSession:
    """One machine's session; its clock is the world's, and while it sleeps nothing of it happens."""

    def __init__(self, router: MadeRouter) -> None:
        self.router = router
        self.tokens_of_own: list[str] = []
        self.asleep_from = self.asleep_until = -1.0
        router.sessions.append(self)

    def is_awake(self) -> bool:
        return not self.asleep_from <= self.router.now < self.asleep_until

    def is_known(self) -> bool:
        """Whether the router has it in its tables: heard lately, and joined again after either was away."""
        now = self.router.now
        if now < self.router.away_until + AGAIN:
            return False
        forgotten = self.asleep_until > self.asleep_from + FORGETS
        return not forgotten or now < self.asleep_from + FORGETS or now >= self.asleep_until + AGAIN

    def liveliness_token(self, key: str) -> Callable[[], None]:
        self.tokens_of_own.append(key)
        return lambda: self.tokens_of_own.remove(key) if key in self.tokens_of_own else None

    def tokens(self, pattern: str, timeout: float) -> list[str]:
        del pattern, timeout
        heard = self.router.known() if self.is_awake() and self.is_known() else []
        return sorted([*self.tokens_of_own, *heard])


@contextlib.contextmanager
def reach(router: MadeRouter) -> Iterator[MadeSession]:
    """A fresh session."""
    if router.now < router.away_until:
        raise MediumError("no router")
    fresh = MadeSession(router)
    yield fresh
    router.sessions.remove(fresh)


@pytest.fixture(autouse=True)
def no_patience(monkeypatch: pytest.MonkeyPatch) -> None:
    """Who comes second is refused at once, and tries again in these worlds."""
    monkeypatch.setattr("groundstation.gateway.lease.PATIENCE", 0.0)


SLEEPS = st.lists(
    st.tuples(st.integers(0, 1), st.floats(0.0, 60.0), st.floats(0.5, 40.0)), max_size=4
)  # which, from, for how long (s)
AWAY = st.lists(st.tuples(st.floats(0.0, 60.0), st.floats(0.2, 20.0)), max_size=2)


@settings(deadline=None, max_examples=300)
@given(SLEEPS, AWAY, st.booleans())
def test_two_act_at_once_no_longer_than_a_lease_is_valid_and_one_is_left(
    sleeps: list[tuple[int, float, float]], away: list[tuple[float, float]], are_of_one_age: bool
) -> None:
    """Each tries to take the rig while it has no lease; both look every half second unless they sleep.

    One that has slept never acts beside its follower. Where the router forgets a holder that is awake, another may come
    in between; the holder finds that out when its lease lapses, or the other when the router knows the holder again.
    Nothing of it changes where all leases are of one age, by clocks that stand or were restored.
    """
    with pytest.MonkeyPatch.context() as clock:
        if are_of_one_age:
            clock.setattr("groundstation.gateway.lease.time.time_ns", lambda: 1_800_000_000_000_000_000)
        live_with_leases(sleeps, away)


def live_with_leases(sleeps: list[tuple[int, float, float]], away: list[tuple[float, float]]) -> None:
    router = MadeRouter()
    sessions = [MadeSession(router), MadeSession(router)]
    leases: list[RigLease | None] = [None, None]
    begun = router.now
    both = 0
    for step in range(int((60.0 + 40.0 + 4.0 * FORGETS) / ASK_EVERY)):
        router.now = begun + ASK_EVERY * step
        for start, length in away:
            if start <= router.now - begun < start + length:
                router.away_until = max(router.away_until, begun + start + length)
        for which, start, length in sleeps:
            if start <= router.now - begun < start + ASK_EVERY and sessions[which].is_awake():
                sessions[which].asleep_from, sessions[which].asleep_until = router.now, router.now + length
        for which, session in enumerate(sessions):
            if session.is_awake() and router.now >= router.away_until + AGAIN and session.is_known():
                leases[which] = next_of(leases[which], session, router)
        acting = [
            lease
            for lease, session in zip(leases, sessions, strict=True)
            if lease and session.is_awake() and not lease.trouble
        ]
        both = both + 1 if len(acting) == 2 else 0
        assert both * ASK_EVERY <= (VALID if away else 0.0)
    assert len([lease for lease in leases if lease is not None and not lease.trouble]) == 1


def next_of(lease: RigLease | None, session: MadeSession, router: MadeRouter) -> RigLease | None:
    """The lease of a session after its next look; who lost it is started again by its crew."""
    if lease is not None and not lease.is_lost:
        lease.confirm()
        return lease
    session.tokens_of_own.clear()
    try:
        return RigLease(session, "rig-1", partial(reach, router), lambda: router.now)
    except LeaseError:
        session.tokens_of_own.clear()
        return None


def test_a_lease_lapses_at_its_time_and_not_before() -> None:
    router = MadeRouter()
    session = MadeSession(router)
    lease = RigLease(session, "rig-1", partial(reach, router), lambda: router.now)
    router.away_until = router.now + 100.0
    router.now += VALID
    lease.confirm()
    assert lease.trouble == ""
    router.now += 1.0
    assert lease.trouble == "the router has not confirmed for 6 s that this is the ground station of rig rig-1"
    router.now += 200.0
    assert lease.trouble
    lease.confirm()
    assert (lease.trouble, lease.is_lost, len(session.tokens_of_own)) == ("", False, 1)


def test_what_is_barred_takes_no_order_and_tells_why(tmp_path: Path) -> None:
    rig = Rig(tmp_path)
    rig.run(5.0)
    told_of: list[str] = []
    rig.ground.listeners.append(told_of.extend)
    rig.ground.bar("rig rig-1: process 7 on laptop is its ground station", rig.now)
    assert set(told_of) >= {"alarms", "status", "verdict"}  # at once: nothing is taken in that would tell it later
    with pytest.raises(LeaseError, match="process 7 on laptop"):
        rig.ground.operator.order("north", {"true_deg": "3", "sigma_deg": "1"}, "anna")
    told = {row["code"]: row["detail"] for row in rig.ground.operator.ask("alarms")["rig"]}
    assert told["lease"] == "rig rig-1: process 7 on laptop is its ground station"
    verdict = rig.ground.operator.ask("verdict")
    assert verdict["verdict"] == "dont_know"
    assert "process 7 on laptop" in json.dumps(verdict)
    rig.ground.bar("", rig.now)
    assert "lease" not in {row["code"] for row in rig.ground.operator.ask("alarms")["rig"]}
    rig.ground.close()
