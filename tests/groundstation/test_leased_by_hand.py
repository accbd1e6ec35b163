"""A lease and what it bars, by hand: who keeps a rig at exactly which times, and what is handed on meanwhile."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest

from groundstation.errors import LeaseError
from groundstation.gateway import lease as lease_room
from groundstation.gateway.lease import VALID, RigLease, holder_name, lease_refusal
from groundstation.gateway.leased_process import LeasedProcess
from telemetry.errors import MediumError
from telemetry.messages import Side


class Tokens:
    """A bus of tokens; each is answered as often as a test says."""

    def __init__(self) -> None:
        self.own: list[str] = []
        self.others: list[str] = []
        self.by_router = True

    def liveliness_token(self, key: str) -> Callable[[], None]:
        self.own.append(key)
        return lambda: self.own.remove(key)

    def tokens(self, pattern: str, timeout: float) -> list[str]:
        assert pattern == "borechain/rig-9/@lease/*"
        return self.own * (2 if self.by_router else 1) + self.others

    def __enter__(self) -> Tokens:
        return self

    def __exit__(self, *_: object) -> None:
        return None


def leased() -> tuple[RigLease, Tokens, list[float]]:
    bus, clock = Tokens(), [100.0]
    return RigLease(bus, "rig-9", lambda: bus, lambda: clock[0]), bus, clock


OLD, YOUNG = (f"borechain/rig-9/@lease/{stamp}_there_77_ab" for stamp in ("0" * 20, "9" * 20))


@pytest.mark.parametrize(("older", "lost"), [(OLD, True), (YOUNG, False)])
def test_an_older_token_beside_a_lease_takes_it_after_exactly_its_time_and_no_younger_one(
    older: str, lost: bool
) -> None:
    lease, bus, clock = leased()
    for _ in range(2):  # one that goes again is forgotten
        bus.others = [older]
        lease.confirm()
        assert bool(lease.trouble) == lost
        bus.others = []
        clock[0] += 4.0
        lease.confirm()
        assert lease.trouble == ""
    bus.others = [older]
    for later in (0.0, VALID):
        clock[0] += later
        lease.confirm()
        assert not lease.is_lost
    clock[0] += 0.5
    lease.confirm()
    assert lease.is_lost == lost
    assert bus.own == ([] if lost else [lease._own])
    if lost:
        assert lease.trouble == (
            "rig rig-9: process 77 on there is its ground station; end that one, or choose another --rig"
        )


@pytest.mark.parametrize(("silent", "taken_anew"), [(VALID, False), (VALID + 0.001, True)])
@pytest.mark.parametrize("follower", [False, True])
def test_a_lease_that_lapsed_is_taken_anew_or_lost_to_who_followed(
    silent: float, taken_anew: bool, follower: bool
) -> None:
    lease, bus, clock = leased()
    first = lease._own
    clock[0] += silent
    assert bool(lease.trouble) == taken_anew
    bus.others = [YOUNG] if follower else []
    lease.confirm()
    assert lease.is_lost == (taken_anew and follower)
    assert (lease._own != first) == (taken_anew and not follower)
    assert len(bus.own) == (0 if lease.is_lost else 1)
    assert (lease.trouble == "") == (not lease.is_lost)


def test_a_session_that_the_router_forgot_is_looked_into_by_a_fresh_one() -> None:
    for others, lost in (([], False), ([YOUNG], True)):
        lease, bus, clock = leased()
        bus.by_router = False
        for later, deaf in ((0.0, False), (5.0, False), (10.0, False), (10.001, True)):
            lease.confirm()
            assert lease.is_deaf is False
            clock[0] = 100.0 + 5.0 + later
            bus.others = others if later > 0.0 else []
            lease.confirm()
            assert (lease.is_deaf, lease.is_lost) == (deaf and not lost, lost and later > 0.0)
            lease._is_deaf = False
            if lease.is_lost:
                assert bus.own == []
                break


def test_a_second_ground_station_is_refused_by_the_name_of_the_first(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lease_room, "PATIENCE", 0.0)
    bus = Tokens()
    bus.others = [OLD]
    with pytest.raises(LeaseError, match="rig rig-9: process 77 on there is its ground station"):
        RigLease(bus, "rig-9", lambda: bus, lambda: 0.0)
    assert bus.own == []
    names = sorted(holder_name() for _ in range(3))
    assert [len(name.split("_")) for name in names] == [4, 4, 4]
    assert names[0].split("_")[0].isdecimal()
    assert len(names[0].split("_")[0]) == 20
    assert lease_refusal("r", f"a/b/{names[0]}").startswith("rig r: process ")


def test_every_event_is_handed_on_as_it_came_and_only_while_the_lease_stands() -> None:
    done: list[Any] = []

    class Ground:
        endpoint = "its endpoint"

        def __getattr__(self, name: str) -> Any:
            return lambda *given: done.append((name, *given))

    lease = SimpleNamespace(is_deaf=False, is_lost=False, trouble="")
    process: Any = LeasedProcess(Ground(), lease)  # type: ignore[arg-type]
    assert process.endpoint == "its endpoint"
    events: list[tuple[str, tuple[Any, ...]]] = [
        ("on_frame", (Side.LOWER, b"frame", 5.0, 3.5)), ("on_cycle", ("data", 5.0)), ("on_overrun", (2, 5.0)),
        ("on_joint_fault", ("fault", 5.0)), ("on_depth", (b"depth", 5.0)), ("on_timer", (5.0,)),
        ("take_frames", (5.0,)), ("next_wake", (5.0,)),
    ]  # fmt: skip
    for name, given in events:
        getattr(process, name)(*given)
        assert done.pop() == (name, *given)
        assert done == []
    lease.trouble = "gone"
    for name, given in events[:-1]:
        getattr(process, name)(*given)
    assert done == [("bar", "gone", 5.0)]
    lease.trouble = "gone for long"
    process.on_timer(6.0)
    lease.is_lost = True
    process.on_timer(7.0)
    process.on_timer(8.0)
    assert done[1:] == [("bar", "gone for long", 7.0)]  # of one that is lost the crew is told why
    lease.is_deaf = True
    with pytest.raises(MediumError, match="start it again"):
        process.on_timer(9.0)
    process.close()
    assert done[-1] == ("close",)
