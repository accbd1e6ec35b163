"""When a node saves, what it sends before and where it dates what it hears: counted cycle by cycle."""

from __future__ import annotations

import copy
import errno
from pathlib import Path
from typing import Any

import msgpack
import numpy as np
import pytest
from strict_disk import StrictDisk

from node.firmware.tube_settings import TubeSettings
from node.kernels.arithmetic.formats import PERIOD
from node.kernels.record.filter_record import default_config
from node.kernels.record.node_record import new_node
from node.process.command_handlers import CommandHandlers
from node.process.counter import LOTS, BootCounter, read_count
from node.process.journal import Journal
from node.process.saver import AT_ONCE, RETRY_EVERY, SAVE_EVERY, SPACING, Saver
from node.process.tube_process import TubeProcess
from telemetry.application.clock import ClockFilter
from telemetry.application.endpoint_state import STATE_LAYOUT, parse_state
from telemetry.messages import ENCODER, Aiding, Command, Event, Hello, NodeMode, Severity, Side, TimeReply
from telemetry.presentation.msgpack_codec import encode_message, open_payload
from telemetry.schema import MessageKind
from telemetry.transport.hop import HopLink, parse_frame

FOLDER = Path("/node")
BLOB = msgpack.packb([STATE_LAYOUT, 1, [], [], 0, 1])
REST = (0.0, 0.0, 0.0, 0.0, 0.3, -9.8)


class FillingDisk(StrictDisk):
    """A disk that refuses every change while it is full."""

    is_full = False

    def _spend(self) -> None:
        if self.is_full:
            raise OSError(errno.ENOSPC, "No space left on device")
        super()._spend()


def nodes(*, still: bool = True) -> np.ndarray:
    made = new_node(default_config())
    made[0]["filter"]["still_cycles"] = int(still)
    return made


def cycles_until_due(saver: Saver, record: np.ndarray, most: int = 2000) -> int:
    """Cycles until a save is due."""
    for cycle in range(1, most + 1):
        saver.count_cycle(record)
        if saver.due:
            return cycle
    return most + 1


def test_a_save_is_due_exactly_when_its_time_has_come_and_a_refused_one_sooner() -> None:
    disk = FillingDisk()
    saver, record = Saver(FOLDER, disk), nodes()
    for is_full, cycles in ((False, SAVE_EVERY), (True, RETRY_EVERY), (True, RETRY_EVERY), (False, SAVE_EVERY)):
        disk.is_full = is_full
        saver.save(record, BLOB)
        assert saver.is_refused == is_full
        assert cycles_until_due(saver, record) == cycles


def test_a_disk_that_refuses_is_told_once_each_time_that_it_begins_to() -> None:
    disk = FillingDisk()
    saver, record = Saver(FOLDER, disk), nodes()
    told: list[str] = []

    def say(_severity: object, code: str, _arguments: object) -> None:
        told.append(code)

    for round_ in range(1, 4):
        for is_full in (True, True, False, False):
            disk.is_full = is_full
            saver.save(record, BLOB)
            saver.report(say)  # type: ignore[arg-type]
        assert told.count("state_not_saved") == round_


def test_slots_that_a_full_disk_refused_are_written_again() -> None:
    disk = FillingDisk()
    journal = Journal(FOLDER, 4, disk)
    for number in range(1, 4):
        disk.is_full = True
        with pytest.raises(OSError, match="No space"):
            journal.save(nodes(), b"lost")
        disk.is_full = False
        for save in range(6):
            journal.save(nodes(), b"%d %d" % (number, save))
        assert journal.worn == set()
        loaded = Journal(FOLDER, 4, disk).load()
        assert loaded is not None
        assert loaded[1] == b"%d 5" % number


def test_so_many_saves_may_follow_each_other_after_any_rest_and_then_one_each_spacing() -> None:
    for calm in (0, SPACING, 100 * SPACING * AT_ONCE):
        saver, record = Saver(FOLDER, StrictDisk()), nodes()
        for _ in range(min(calm, 3000)):
            saver.count_cycle(record)
        for _ in range(AT_ONCE):
            assert not saver.spent
            saver.save(record, BLOB)
        assert saver.spent
        waited = 0
        while saver.spent:
            saver.count_cycle(record)
            waited += 1
        assert 1 <= waited <= SPACING
        saver.save(record, BLOB)
        assert saver.spent


def test_a_rest_that_was_saved_is_over_once() -> None:
    saver = Saver(FOLDER, StrictDisk())
    for _ in range(3):
        saver.save(nodes(still=True), BLOB)
        saver.count_cycle(nodes(still=False))
        assert saver.due
        saver.save(nodes(still=False), BLOB)
        saver.count_cycle(nodes(still=False))
        assert not saver.due


@pytest.mark.parametrize(("count", "is_one"), [(0, True), (2 * LOTS - 2, True), (2 * LOTS - 1, False), (-1, False)])
def test_a_number_of_starts_is_believed_up_to_the_last_that_has_a_successor(count: int, is_one: bool) -> None:
    disk = StrictDisk()
    disk.write(FOLDER / "boots", b"%d" % count)
    if is_one:
        assert read_count(disk, FOLDER / "boots") == count
        assert BootCounter(FOLDER, disk=disk).boots == count + 1
    else:
        with pytest.raises(ValueError, match="expected the number of starts"):
            read_count(disk, FOLDER / "boots")


class Above:
    """The encoder as the upper neighbour of a tube."""

    def __init__(self, process: TubeProcess) -> None:
        self.process, self.link = process, HopLink(ENCODER, 1)

    def say(self, payload: bytes, now: float) -> None:
        self.link.send_best_effort(payload, "said")
        for frame in self.link.take_frames(now):
            self.process.on_frame(Side.UPPER, frame.payload, now)

    def heard(self, now: float) -> list[Any]:
        """Payloads that the tube sends up, opened."""
        found = []
        for side, frame in self.process.take_frames(now):
            if side is Side.UPPER:
                parsed = parse_frame(frame.payload)
                assert parsed is not None
                found += [open_payload(payload) for _, payload in parsed[1]]
                self.link.receive(frame.payload, now)
                for answer in self.link.take_frames(now + 0.02):
                    self.process.on_frame(Side.UPPER, answer.payload, now)
        return found


def test_an_order_is_obeyed_once_over_every_cut(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    obeyed: list[int] = []
    plain = CommandHandlers.take_survey

    def take_survey(self: CommandHandlers, arguments: Any, sequence: int) -> Any:
        obeyed.append(sequence)
        return plain(self, arguments, sequence)

    monkeypatch.setattr(CommandHandlers, "take_survey", take_survey)
    now = 1000.0
    for start in range(3):  # the power goes right after the order, before a cycle has ended
        process = TubeProcess(TubeSettings(3), tmp_path)
        above = Above(process)
        above.say(encode_message(Hello(ENCODER, 1 + start, 0, NodeMode.STILL, 1.0)), now)
        above.say(encode_message(Command(3, 9, "take_survey")), now + 0.1)
        now += 10.0
    assert obeyed == [9]


def test_nothing_that_is_kept_leaves_before_it_is_on_the_disk(tmp_path: Path) -> None:
    """A storm of events, far beyond the saves that may follow each other."""
    process = TubeProcess(TubeSettings(3), tmp_path)
    process.endpoint.clock = ClockFilter(is_root=True)
    above, now, seen = Above(process), 1000.0, 0
    above.say(encode_message(Hello(ENCODER, 1, 0, NodeMode.STILL, 1.0)), now)
    for k in range(4 * SPACING + 2 * AT_ONCE):
        now += PERIOD
        process.on_cycle([now - PERIOD if k % 2 else np.nan, *REST], now)
        above.say(encode_message(Hello(ENCODER, 1, 0, NodeMode.STILL, 1.0)), now)
        for opened in above.heard(now):
            if opened.kind is MessageKind.EVENT:
                loaded = Journal(tmp_path).load()
                assert loaded is not None
                assert opened.sequence < msgpack.unpackb(loaded[1])[1], "its number is given to no other message"
                seen += 1
    assert seen > AT_ONCE


def test_surveys_that_are_sent_again_are_saved_with_the_next_frame(tmp_path: Path) -> None:
    process = TubeProcess(TubeSettings(3), tmp_path)
    for number, tube in ((5, 3), (6, 3), (7, 4)):  # the last of another tube's memory
        process._log.append_payload(
            number, encode_message(Event(tube, number, 1000.0, Severity.ERROR, "logged", {}, 1))
        )
    process._saver.due = False
    assert process._resend(1, 4)[0] == 0
    assert not process._saver.due
    assert process._resend(5, 6) == (2, 0)
    assert process._saver.due
    assert process._resend(6, 6)[0] == 1
    assert process._resend(7, 7)[0] == 0
    assert sorted(number for number, _, _ in parse_state(process.endpoint.export_state()).parcels) == [5, 6]
    for first, last, sent in ((5, 6, 2), (6, 6, 1), (5, 5, 1), (6, 5, None)):
        reply = process._commands.obey(Command(3, 9, "resend", {"first": first, "last": last}))
        assert reply.done == (sent is not None)
        assert reply.values.get("sent") == sent


def test_what_is_kept_is_sent_at_once_when_it_is_asked_for(tmp_path: Path) -> None:
    process = TubeProcess(TubeSettings(3), tmp_path)
    process._send_event(Severity.WARNING, "kept", {})
    waiting = process.endpoint.mail._outbox
    number = process.endpoint.mail.series.newest
    assert waiting.next_due() > process._now
    assert process._resend(number, number + 5)[0] == 1
    assert process._resend(number + 1, number + 5)[0] == 0


def test_a_memory_of_another_tube_is_refused_by_name(tmp_path: Path) -> None:
    other = TubeProcess(TubeSettings(2), tmp_path)
    other._send_event(Severity.WARNING, "kept", {})
    other.close()
    process = TubeProcess(TubeSettings(1), tmp_path)
    assert process._saver.fault == "it is that of tube 2: was a board, a card or a folder exchanged?"
    assert process.endpoint.mail.outbox_size == 0
    assert not process.tube._restored
    assert process.boots >= LOTS  # of the other's starts its own are not counted on


def test_the_same_tube_goes_on_with_its_memory(tmp_path: Path) -> None:
    before = TubeProcess(TubeSettings(2), tmp_path)
    before._send_event(Severity.WARNING, "kept", {})
    before.close()
    again = TubeProcess(TubeSettings(2), tmp_path)
    assert again._saver.fault == ""
    assert again.endpoint.mail.outbox_size == 1


@pytest.mark.parametrize("off", [1e-3, -1e-3])
def test_an_aiding_is_dated_as_what_waits_is_until_the_cycle_moves_them_together(tmp_path: Path, off: float) -> None:
    """Between an exchange and the next cycle the clock has stepped; all that waits is still dated by the old one."""
    process, clock, found = TubeProcess(TubeSettings(3), tmp_path), ClockFilter(), []
    process.endpoint.clock = clock
    for k in range(8):
        if k == 7:
            old = copy.deepcopy(clock)
            clock.take_step()
        asked, wrong = 1000.0 + k, off if k == 7 else 0.0
        at = asked + 17.0 + 3e-3 + wrong
        clock.exchange(TimeReply(asked, at, at, at + 500.0, 1.0, 0.0, 1), asked + 6e-3)
    plain = process.tube.on_aiding

    def noted(aiding: Aiding, valid_local: float, clock_var: float = 0.0) -> Aiding | None:
        found.append(valid_local)
        return plain(aiding, valid_local, clock_var)

    process.tube.on_aiding = noted  # type: ignore[method-assign]
    rig = clock.rig_from_local(1007.0)
    process._on_aiding(Aiding(1.0, 1e-8, 0.0, 0.0, 0.0, rig, 5, 0, epoch=1), 1007.01)
    assert abs(clock.local_from_rig(rig) - old.local_from_rig(rig)) > 1e-5, "the clock has stepped"
    assert found == [pytest.approx(old.local_from_rig(rig), abs=3e-6)]
