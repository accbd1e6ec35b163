"""What a tube's process does beside its firmware, part by part: the time it dates by, what it passes, what it tells."""

from __future__ import annotations

import math
from collections import Counter
from types import SimpleNamespace
from typing import Any

import pytest

from node.firmware.tube_settings import PassedTube
from node.process.tube_process import (
    MAX_CLOCK_STD,
    REPORT_EVERY,
    RESENT_TOGETHER,
    SYNCHRONISED_STD,
    TubeProcess,
    jump_of,
)
from telemetry.messages import Aiding, Event, NodeFlag, NodeMode, NodeState, Severity, Side, StaticRecord
from telemetry.presentation.msgpack_codec import encode_message


def process_of(**parts: Any) -> Any:
    """A process with nothing but these parts."""
    made = TubeProcess.__new__(TubeProcess)
    for name, part in parts.items():
        setattr(made, name, part)
    return made


class Clock:
    """A clock that is 1000 s before rig time."""

    def __init__(self, std: float = 1e-4, epoch: int = 3, synchronised: bool = True, stepped: float = 0.25) -> None:
        self.std, self.epoch, self.synchronised, self.stepped = std, epoch, synchronised, stepped
        self.drift_std, self.taken = 5e-6, 0

    def variance(self, now: float) -> float:
        return self.std**2

    def rig_from_local(self, local: float) -> float:
        return local + 1000.0

    def local_from_rig(self, rig: float) -> float:
        return rig - 1000.0

    def take_step(self) -> float:
        self.taken += 1
        return self.stepped


@pytest.mark.parametrize(
    ("std", "synchronised", "is_dated"),
    [
        (0.999 * SYNCHRONISED_STD, True, True),
        (SYNCHRONISED_STD, True, False),
        (1e-6, False, False),
        (10.0 * MAX_CLOCK_STD, True, False),
    ],
)
@pytest.mark.parametrize("neighbour", [None, 4])
def test_a_cycle_is_dated_where_the_clock_is_known_well_enough(
    std: float, synchronised: bool, is_dated: bool, neighbour: int | None
) -> None:
    clock = Clock(std, synchronised=synchronised)
    place = SimpleNamespace(neighbours={Side.UPPER: neighbour, Side.LOWER: 2}, hops=5)
    context = process_of(endpoint=SimpleNamespace(clock=clock, place=place))._context(50.0)
    assert (context.rig_now, context.synchronised, context.hops, context.epoch) == (1050.0, is_dated, 5, 3)
    assert context.joined == (neighbour is not None)
    assert context.clock_var == pytest.approx(min(std, MAX_CLOCK_STD) ** 2)
    assert (context.stepped, clock.taken) == ((0.25, 1) if is_dated else (0.0, 0))
    assert context.drift_std == 5e-6


def aiding(epoch: int) -> Aiding:
    return Aiding(1.0, 1e-6, 0.0, 0.0, 0.0, 1040.0, 7, 2, epoch=epoch)


@pytest.mark.parametrize(
    ("epoch", "own", "silent", "synchronised", "is_taken"),
    [(3, 3, 0, True, True), (0, 3, 0, True, True), (3, 0, 0, True, True), (4, 3, 0, True, False),
     (2, 3, 0, True, False), (3, 3, 0, False, False), (3, 3, 1, True, True), (3, 3, 2, True, False)],
)  # fmt: skip
def test_an_aiding_is_taken_in_its_epoch_and_over_joints_that_were_told(
    epoch: int, own: int, silent: int, synchronised: bool, is_taken: bool
) -> None:
    taken: list[Any] = []
    asked: list[float] = []
    endpoint = SimpleNamespace(
        clock=Clock(epoch=own, synchronised=synchronised), counters=Counter(), ask_time=asked.append, skipped=silent
    )
    tube = SimpleNamespace(on_aiding=lambda *words: taken.append(words))
    settings = SimpleNamespace(above=(PassedTube(),), stiffness=math.inf)
    process_of(endpoint=endpoint, tube=tube, settings=settings, _timing=None)._on_aiding(aiding(epoch), 50.0)
    assert len(taken) == int(is_taken)
    other = synchronised and epoch != own and 0 not in (epoch, own)
    assert (endpoint.counters["other_epoch"], asked) == ((1, [50.0]) if other else (0, []))
    if is_taken:
        message, valid, var = taken[0]
        assert (message.hops, valid, var) == (2 + silent, 40.0 - 0.25, pytest.approx(1e-8))


@pytest.mark.parametrize("is_refused", [False, True])
def test_a_state_has_what_the_process_knows_beside_the_firmware(is_refused: bool) -> None:
    state = NodeState(
        3, 1.0, 9, NodeMode.STILL, 0.0, 1.0, 1.0, (0.0,) * 3, 0.0, 0.0, 1.0, 1.0, 1.0, NodeFlag.RESTORED, 0, 0
    )
    endpoint = SimpleNamespace(
        place=SimpleNamespace(told_hops=4), clock=Clock(), mail=SimpleNamespace(series=SimpleNamespace(newest=77)),
        margin={Side.UPPER: 11.0, Side.LOWER: -2.0}.get,
    )  # fmt: skip
    process = process_of(endpoint=endpoint, _saver=SimpleNamespace(is_refused=is_refused))
    told = process._with_process_state(state)
    assert (told.hops, told.epoch, told.numbered, told.upper_margin, told.lower_margin) == (4, 3, 77, 11.0, -2.0)
    assert told.flags == NodeFlag.RESTORED | (NodeFlag.NOT_SAVED if is_refused else NodeFlag.NONE)


def test_a_full_queue_is_told_at_most_once_a_minute_with_what_was_dropped_since() -> None:
    told: list[Any] = []
    endpoint = SimpleNamespace(dropped=0)
    process = process_of(
        endpoint=endpoint, _dropped=0, _looked_at_drops=-math.inf, _send_event=lambda *words: told.append(words[1:])
    )
    at = 100.0
    for dropped, after in (
        (0, 0.0),
        (3, REPORT_EVERY - 1e-6),
        (5, REPORT_EVERY),
        (5, 3 * REPORT_EVERY),
        (9, 9 * REPORT_EVERY),
    ):
        endpoint.dropped = dropped
        process._report_drops(at + after)
    assert told == [
        ("queue_full", {"dropped": 5, "since_start": 5}), ("queue_full", {"dropped": 4, "since_start": 9}),
    ]  # fmt: skip


@pytest.mark.parametrize("count", [0, 1, RESENT_TOGETHER, RESENT_TOGETHER + 5])
def test_what_is_asked_for_again_is_sent_so_many_at_a_time_and_saved_before(count: int) -> None:
    sent: list[Any] = []
    kept = {n: encode_message(Event(7, n, 1.0, Severity.INFO, "booted")) for n in range(1, count + 1)}
    foreign = encode_message(Event(8, 2, 1.0, Severity.INFO, "booted"))  # of the memory of another tube
    log = SimpleNamespace(
        payloads=lambda first, last: [(2, foreign), *((n, kept[n]) for n in range(first, last + 1))], complete_from=4
    )
    hastened: list[Any] = []
    mail = SimpleNamespace(
        submit_again=lambda *words: sent.append(words),
        hasten=lambda *words: hastened.append(words) or {1, 1000},
    )
    saver = SimpleNamespace(due=False)
    settings = SimpleNamespace(tube=7)
    process = process_of(_log=log, endpoint=SimpleNamespace(mail=mail), _saver=saver, _now=12.5, settings=settings)
    numbers = range(1, min(count, RESENT_TOGETHER) + 1)
    assert process._resend(1, count) == (len({*numbers} | {1, 1000}), 4)  # once each, what waited by itself too
    assert hastened == [(1, count, 12.5)]
    assert sent == [(n, kept[n], 12.5) for n in numbers]
    assert saver.due == (count > 0)


@pytest.mark.parametrize("is_spent", [False, True])
@pytest.mark.parametrize("kind", ["event", "survey"])
def test_what_must_not_be_lost_waits_for_its_save_and_surveys_stay_in_the_log(is_spent: bool, kind: str) -> None:
    zero = ((0.0,) * 3,) * 3
    message: Any = (
        Event(3, 9, 1.0, Severity.INFO, "booted")
        if kind == "event"
        else StaticRecord(3, 9, 1, 0.0, 5.0, 10, (0.0,) * 3, zero, (0.0,) * 3, zero, 20.0, False)
    )
    done: list[Any] = []
    mail = SimpleNamespace(hold=lambda: done.append("hold"), submit=lambda said, now: done.append((said, now)))
    log = SimpleNamespace(append_payload=lambda number, _: done.append(number))
    saver = SimpleNamespace(due=False, spent=is_spent)
    process_of(_log=log, endpoint=SimpleNamespace(mail=mail), _saver=saver)._keep(message, 5.5)
    assert done == [*([] if kind == "event" else [9]), *(["hold"] if is_spent else []), (message, 5.5)]
    assert saver.due


@pytest.mark.parametrize(
    ("arguments", "seconds"),
    [({"by_s": 0.35}, 0.35), ({"by_s": -2}, 2.0), ({"by_s": -3600.0}, 3600.0), ({"by_s": 1e9}, 3600.0), ({}, 3600.0),
     ({"by_s": "long"}, 3600.0), ({"by_s": None}, 3600.0)],
)  # fmt: skip
def test_a_clock_is_doubted_by_what_it_jumped_and_by_an_hour_at_most(arguments: dict[str, Any], seconds: float) -> None:
    assert jump_of(Event(3, 1, 0.0, Severity.WARNING, "clock_jumped", arguments)) == seconds
