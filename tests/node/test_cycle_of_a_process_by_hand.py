"""In which order a tube's process reads, filters, sends and saves, call by call."""

from __future__ import annotations

import math
from collections import Counter
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from noted_parts import NotedPart, bare, message_of

from node.process.tube_process import TubeProcess
from telemetry.errors import EncodeError
from telemetry.messages import Aiding, BlockSegment, Command, Event, NodeState, Severity, Side
from telemetry.runtime.timing import CycleStage

Noted = list[Any]
NAN = math.nan


class Clock:
    """A clock that is 1000 s before rig time."""

    epoch, synchronised, drift_std = 3, True, 0.0

    def variance(self, _now: float) -> float:
        return 1e-8

    def rig_from_local(self, local: float) -> float:
        return local + 1000.0

    def take_step(self) -> float:
        return 0.0


def tube(noted: Noted, **parts: Any) -> Any:
    """A process all of whose parts note what they are asked."""
    place = SimpleNamespace(neighbours={Side.UPPER: 4, Side.LOWER: 2}, hops=2, told_hops=2)
    mail = NotedPart(noted, "mail", {"reply": None}, series=NotedPart(noted, "series", {"take": 41}))
    endpoint = NotedPart(
        noted, "endpoint", {"receive": [], "export_state": b"blob"}, clock=Clock(), place=place, mail=mail,
        counters=Counter(), skipped=0, dropped=0,
    )  # fmt: skip
    state = np.zeros(1, [("still_cycles", int)])
    nodes = np.zeros(1, [("filter", state.dtype), ("config", int)])
    plain = {
        "_imus": [], "_timing": None, "nodes": nodes, "config": [7.0], "endpoint": endpoint, "_now": 0.0,
        "tube": NotedPart(noted, "tube", {"on_cycle": []}, raw="the raw reading"), "_announced": True, "_skipped": 0,
        "_board": NotedPart(noted, "board"), "_warmth": SimpleNamespace(look=lambda one: one),
        "_range": NotedPart(noted, "range"), "_search": NotedPart(noted, "search"),
        "_blocks": NotedPart(noted, "blocks", trying=False), "_seal_watch": NotedPart(noted, "seals"),
        "_saver": NotedPart(noted, "saver", due=False, spent=False, is_refused=False, fault="", carried=None),
        "_commands": NotedPart(noted, "commands", {"obey": "a reply"}), "_log": NotedPart(noted, "log"),
        "_dropped": 0, "_looked_at_drops": math.inf, "_overrun_told": -math.inf, "_sources": [],
        "settings": SimpleNamespace(tube=3, above=(), stiffness=math.inf), "_counter_fault": "", "_cut": False,
        "_fallback": "",
    }  # fmt: skip
    return bare(TubeProcess, **plain | parts)


SAVED = [("endpoint.export_state",), ("saver.save", None, b"blob"), ("mail.release", 50.0)]


def without_arrays(noted: Noted) -> Noted:
    return [tuple(None if isinstance(word, np.ndarray) else word for word in one) for one in noted]


def test_an_order_is_obeyed_answered_and_saved_before_its_receipt_leaves() -> None:
    noted: Noted = []
    one, order = tube(noted), message_of(Command)
    one.endpoint = NotedPart(
        noted, "endpoint", {"receive": [SimpleNamespace(message=order, side=Side.UPPER)], "export_state": b"blob"},
        mail=one.endpoint.mail,
    )  # fmt: skip
    one.on_frame(Side.UPPER, "frame", 50.0, 6.0)
    assert without_arrays(noted) == [
        ("endpoint.receive", Side.UPPER, "frame", 50.0, 6.0), ("commands.obey", order), ("mail.reply", "a reply"),
        *SAVED,
    ]  # fmt: skip
    assert one._now == 50.0


@pytest.mark.parametrize("due", [False, True])
@pytest.mark.parametrize("spent", [False, True])
def test_what_is_due_is_saved_after_a_frame_where_saves_are_left(due: bool, spent: bool) -> None:
    noted: Noted = []
    one = tube(noted, _saver=NotedPart(noted, "saver", due=due, spent=spent))
    one.on_frame(Side.LOWER, "frame", 50.0)
    saved = SAVED if due and not spent else []
    assert without_arrays(noted) == [("endpoint.receive", Side.LOWER, "frame", 50.0, math.inf), *saved]
    noted.clear()
    one.on_joint_fault(SimpleNamespace(arguments={"a": 1}), 50.0)
    assert one._saver.due or spent
    assert ("mail.submit" in str(noted), "saver.save" in str(noted)) == (True, not spent)


def test_an_aiding_is_believed_from_above_alone_and_a_segment_has_a_status(monkeypatch: pytest.MonkeyPatch) -> None:
    noted: Noted = []
    aiding, segment = message_of(Aiding), message_of(BlockSegment)
    one = tube(noted, _blocks=NotedPart(noted, "blocks", {"on_segment": "a status"}))
    monkeypatch.setattr(one, "_on_aiding", lambda *given: noted.append(("aiding", *given)))
    received = [
        SimpleNamespace(message=message, side=side)
        for message, side in ((aiding, Side.LOWER), (aiding, Side.UPPER), (segment, Side.UPPER))
    ]
    one.endpoint = NotedPart(noted, "endpoint", {"receive": received}, mail=one.endpoint.mail)
    one.on_frame(Side.UPPER, "frame", 50.0)
    assert noted[1:] == [
        ("aiding", aiding, 50.0),
        ("blocks.on_segment", segment, 50.0),
        ("mail.send_status", "a status"),
    ]


def cycle(noted: Noted, one: Any, now: float = 50.0) -> None:
    one.on_cycle([now - 0.5, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0], now)
    noted[:] = without_arrays(noted)


@pytest.mark.parametrize("still", [0, 1])
@pytest.mark.parametrize("own_clock", [False, True])
def test_a_cycle_is_read_filtered_sent_and_saved_in_this_order(still: int, own_clock: bool) -> None:
    noted: Noted = []
    timing = NotedPart(noted, "timing") if own_clock else None
    said = message_of(NodeState)
    one = tube(noted, _timing=timing, _saver=NotedPart(noted, "saver", due=True, spent=False))
    one._looked_at_drops, one.nodes["filter"]["still_cycles"] = 49.0, still
    one.nodes["config"] = 9
    one.tube = NotedPart(noted, "tube", {"on_cycle": [said]})
    one._send = lambda message, now: noted.append(("sent", message, now))
    cycle(noted, one)
    read = noted[0][1]
    assert (read.start, read.end, read.rate, read.force) == (49.5, 50.0, (1.0, 2.0, 3.0), (4.0, 5.0, 6.0))

    def lap(stage: CycleStage) -> Noted:
        return [("timing.lap", stage)] if own_clock else []

    context = noted[2 + own_clock][2]
    assert (context.rig_now, context.synchronised, context.hops) == (1050.0, True, 2)
    expected = [
        ("board.look", read, {"still": still == 1}), ("range.look", read, one.nodes[0]["filter"], 9),
        *lap(CycleStage.READ),
        ("tube.on_cycle", read, context), ("search.look", one.nodes[0]["filter"], 7.0, 50.0, {"lost": False}),
        *lap(CycleStage.FILTER), ("sent", said, 50.0), *([] if own_clock else [("endpoint.advance", 50.0)]),
        *lap(CycleStage.REPORT), ("saver.report", one._send_event), ("seals.look", 50.0), ("saver.count_cycle", None),
        *SAVED, *lap(CycleStage.SAVE),
    ]  # fmt: skip
    assert noted == expected
    noted.clear()
    one._saver.due = False
    cycle(noted, one, 51.0)
    assert [call for call in noted if call[0] in ("saver.save", "timing.lap")] == (
        [("timing.lap", stage) for stage in (CycleStage.READ, CycleStage.FILTER, CycleStage.REPORT)]
        if own_clock
        else []
    )


def test_a_node_tells_nothing_of_itself_before_it_knows_rig_time(monkeypatch: pytest.MonkeyPatch) -> None:
    noted: Noted = []
    one = tube(noted, _announced=False)
    monkeypatch.setattr(one, "_announce", lambda *given: noted.append(("announced", *given)))
    monkeypatch.setattr(one, "_tell_of_silent_tubes", lambda: noted.append(("silent",)))
    for synchronised, told in ((False, []), (True, [("announced", 1050.0, 50.0), ("silent",)])):
        noted.clear()
        one.endpoint.clock.synchronised = synchronised
        cycle(noted, one)
        assert [call for call in noted if call[0] in ("announced", "silent")] == told
        assert not any(call[0] in ("saver.report", "seals.look") for call in noted)  # not before it is announced


@pytest.mark.parametrize(("wz", "lost"), [(3.0, False), (NAN, True), (math.inf, True)])
def test_a_cycle_without_a_rate_about_the_axis_is_lost_to_the_search(wz: float, lost: bool) -> None:
    noted: Noted = []
    one = tube(noted)
    one.on_cycle([49.5, NAN, NAN, wz, 4.0, 5.0, 6.0], 50.0)
    assert next(call for call in noted if call[0] == "search.look")[-1] == {"lost": lost}


def test_a_block_on_trial_has_its_status_once_it_is_decided_and_is_left_alone_else() -> None:
    for trying, status, sent in ((False, "s", []), (True, None, []), (True, "s", [("mail.send_status", "s")])):
        noted: Noted = []
        one = tube(noted, _blocks=NotedPart(noted, "blocks", {"on_cycle": status}, trying=trying))
        cycle(noted, one)
        assert [call for call in noted if call[0] == "mail.send_status"] == sent
        assert [call for call in noted if call[0] == "blocks.on_cycle"] == (
            [("blocks.on_cycle", "the raw reading")] if trying else []
        )


def test_a_clock_that_jumped_is_doubted_before_its_event_leaves() -> None:
    noted: Noted = []
    doubted: Noted = []
    one = tube(noted)
    jump = Event(3, 1, 0.0, Severity.WARNING, "clock_jumped", {"by_s": -2.5})
    one.endpoint.clock.doubt = lambda by: doubted.append((by, list(noted)))
    one.tube = NotedPart(noted, "tube", {"on_cycle": [Event(3, 2, 0.0, Severity.INFO, "other"), jump]})
    one._send = lambda message, _now: noted.append(("sent", message.code))
    cycle(noted, one)
    ((by, before),) = doubted
    assert by == 2.5
    assert ("sent", "clock_jumped") not in before
    assert ("sent", "other") in before


def test_sensors_of_its_own_are_read_over_the_cycle_and_the_first_leads() -> None:
    samples = [SimpleNamespace(rate=(k, 0.0, 0.0), force=(0.0, k, 0.0), temperature=20.0, saturated=0, late=0.0,
                               late_std=0.0, parts=()) for k in (1.0, 2.0, 3.0)]  # fmt: skip
    read: Noted = []
    imus = [SimpleNamespace(read=lambda *given, k=k: read.append((k, *given)) or samples[k]) for k in range(3)]
    noted: Noted = []
    one = tube(noted, _imus=imus)
    cycle(noted, one)
    assert read == [(k, 49.5, 50.0) for k in range(3)]
    seen = noted[0][1]
    assert (seen.rate[0], [other.rate[0] for other in seen.others]) == (1.0, [2.0, 3.0])


def test_overruns_are_counted_each_and_told_once_a_minute() -> None:
    noted: Noted = []
    one = tube(noted)
    one.tube = SimpleNamespace(node={"overruns": 4})
    told: Noted = []
    one._send_event = lambda *given: told.append(given)
    for now in (100.0, 159.999, 160.0, 219.9, 220.0):
        one.on_overrun(2, now)
    assert one.tube.node["overruns"] == 9
    assert told == [
        (Severity.WARNING, "overrun", {"missed": 2, "overruns": count}) for count in (5, 7, 9)
    ]  # fmt: skip


def test_a_message_that_cannot_be_said_is_counted_and_an_event_has_the_epoch_of_now() -> None:
    noted: Noted = []
    one = tube(noted)
    one._send(Event(3, 5, 1.0, Severity.INFO, "a"), 50.0)
    one._send(Event(3, 6, 1.0, Severity.INFO, "b", {}, 2), 50.0)
    assert [call[1].epoch for call in noted if call[0] == "mail.submit"] == [3, 2]
    one.endpoint = NotedPart(noted, "endpoint", {"send_aiding": EncodeError("no")}, counters=Counter())
    for count in (1, 2):
        one._send(message_of(Aiding), 50.0)
        assert one.endpoint.counters["unsayable"] == count


def test_an_event_of_the_process_has_its_number_time_and_epoch() -> None:
    noted: Noted = []
    one = tube(noted, _now=50.0)
    one._send_event(Severity.ERROR, "a_code", {"x": 1})
    assert noted[-1] == ("mail.submit", Event(3, 41, 1050.0, Severity.ERROR, "a_code", {"x": 1}, 3), 50.0)


@pytest.mark.parametrize(
    ("neighbour", "skipped", "before", "told"),
    [
        (4, 0, 0, []), (4, 2, 0, [(Severity.WARNING, "tube_silent", {"tube": 4, "tubes": 2})]), (4, 2, 2, []),
        (4, 0, 2, [(Severity.INFO, "tube_heard_again", {"tube": 4})]), (None, 0, 2, []),
        (4, 1, 2, [(Severity.WARNING, "tube_silent", {"tube": 4, "tubes": 1})]),
    ],
)  # fmt: skip
def test_silent_tubes_above_are_told_where_their_number_changes(
    neighbour: int | None, skipped: int, before: int, told: Noted
) -> None:
    one = tube([], _skipped=before)
    one.endpoint.skipped, one.endpoint.place.neighbours[Side.UPPER] = skipped, neighbour
    said: Noted = []
    one._send_event = lambda *given: said.append(given)
    one._tell_of_silent_tubes()
    one._tell_of_silent_tubes()
    assert said == told


def test_a_start_is_told_once_with_all_that_was_wrong_on_the_disk() -> None:
    said: Noted = []
    block = SimpleNamespace(version=6, sha256=lambda: b"\xab" * 32)
    carried = SimpleNamespace(layout=2, fields=5, fresh=1)
    saver = SimpleNamespace(fault="f" * 300, carried=carried, due=False, spent=False)
    one = tube([], _announced=False, _saver=saver, _counter_fault="c" * 300, _cut=True, _fallback="b" * 300)
    one.tube = SimpleNamespace(parameters=block, boot_event=lambda rig_now: f"boot at {rig_now}")
    one.endpoint.counters["bad_saved_state"] = 1
    one._send = lambda *given: said.append(given)
    one._send_event = lambda *given: said.append(given)
    one._announce(1050.0, 50.0)
    one._announce(1051.0, 51.0)
    error = Severity.ERROR
    assert said == [
        ("boot at 1050.0", 50.0), (error, "saved_state_lost", {"detail": "f" * 200}),
        (Severity.INFO, "saved_state_carried", {"layout": 2, "carried": 5, "new": 1}),
        (error, "boot_counter_lost", {"detail": "c" * 200}),
        (error, "saved_state_lost", {"detail": "of the telemetry: not as it was written"}),
        (Severity.WARNING, "alignment_refused", {"reason": "the power was cut"}),
        (error, "parameters_fallback", {"detail": "b" * 200, "in_use": 6, "hash": "ab" * 32}),
    ]  # fmt: skip
    fresh = tube([], _announced=False)
    fresh.tube = one.tube
    said.clear()
    fresh._send = fresh._send_event = lambda *given: said.append(given)
    fresh._announce(1050.0, 50.0)
    assert said == [("boot at 1050.0", 50.0)]


def test_a_tube_that_ends_saves_and_gives_its_sensors_back() -> None:
    noted: Noted = []
    one = tube(noted, _now=50.0, _sources=[NotedPart(noted, "first"), NotedPart(noted, "second")])
    one.close()
    assert without_arrays(noted) == [*SAVED, ("first.close",), ("second.close",)]
