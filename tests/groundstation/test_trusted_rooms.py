"""Lines of service and store on which a rig's trust rests, each of which a drawn defect had changed unnoticed."""

from __future__ import annotations

import contextlib
import math
import sqlite3
from pathlib import Path
from types import SimpleNamespace

import pytest
from string_passes import knowing, passes
from test_store import survey, url

from groundstation.config import GroundConfig
from groundstation.service.alarms.watch import Watch
from groundstation.service.answers.csv_tables import csv_cell
from groundstation.service.disk.ground_store import Store, is_depth
from groundstation.service.disk.keeper import StringKeeper
from groundstation.service.disk.merged_database import merge_databases
from groundstation.service.orders.order_book import RECORD_EMPTY, OrderBook, OrderState, SentOrder
from groundstation.service.string.depth import DepthLog
from groundstation.service.string.known_string import KnownString
from groundstation.survey.fusion.fusion import Weighting
from telemetry.application.commands import find_command
from telemetry.messages import DepthReading, Event, NodeFlag, NodeMode, NodeState, Severity, Stand
from telemetry.presentation.msgpack_codec import encode_message

EPOCH = 7
IDENTITIES = {
    "meta": ["name"], "messages": ["id"], "stands": ["epoch", "begun_at"], "string": ["place"], "blocks": ["sha256"],
    "recalibration": ["id"], "joints": ["upper", "lower"], "alarms": ["number"], "setup": ["number"],
    "moments": ["number"],
}  # fmt: skip


def test_every_table_of_a_database_has_an_identity_that_is_there_once(tmp_path: Path) -> None:
    Store(url(tmp_path)).close()
    with contextlib.closing(sqlite3.connect(tmp_path / "ground.sqlite")) as database:
        names = [name for (name,) in database.execute("select name from sqlite_master where type = 'table'")]
        columns = {name: database.execute(f"pragma table_info({name})").fetchall() for name in names}
    assert {name: [row[1] for row in rows if row[5]] for name, rows in columns.items()} == IDENTITIES


@pytest.mark.parametrize("md", [0.0, 1e-3, 0.3, 0.999, 1.0, 250.0, None])
def test_a_depth_from_the_collar_on_is_one_after_a_restart(tmp_path: Path, md: float | None) -> None:
    assert is_depth(md)
    with contextlib.closing(Store(url(tmp_path))) as store:
        store.add_message(survey(1, 1), md)
    with contextlib.closing(Store(url(tmp_path))) as again:
        assert [one.md for one in again.messages()] == [md]
        assert again.damaged == 0


@pytest.mark.parametrize("wrong", [-1e-3, math.nan, math.inf, 1, "1.0"])
def test_what_is_no_depth_is_none(wrong: object) -> None:
    assert not is_depth(wrong)


def test_every_damaged_message_counts_once(tmp_path: Path) -> None:
    with contextlib.closing(Store(url(tmp_path))) as store:
        for number in range(1, 6):
            store.add_message(survey(1, number), 1.0)
    with contextlib.closing(sqlite3.connect(tmp_path / "ground.sqlite")) as database:
        database.execute("update messages set payload = x'00' where sequence in (2, 4, 5)")
        database.commit()
    with contextlib.closing(Store(url(tmp_path))) as again:
        assert [one.message.sequence for one in again.messages()] == [1, 3]
        assert again.damaged == 3


@pytest.mark.parametrize("bit", [0, 7])
def test_a_message_of_which_any_bit_has_changed_is_not_read_and_is_taken_again(tmp_path: Path, bit: int) -> None:
    """Most changed bits leave a message that can be read, with another number in it."""
    message = survey(1, 1)
    sound = encode_message(message)
    with contextlib.closing(Store(url(tmp_path))) as store:
        store.add_message(message, 1.0)
        for byte in range(len(sound)):
            rotten = sound[:byte] + bytes([sound[byte] ^ 1 << bit]) + sound[byte + 1 :]
            with contextlib.closing(sqlite3.connect(tmp_path / "ground.sqlite")) as database:
                database.execute("update messages set payload = ?", (rotten,))
                database.commit()
            store.damaged = 0
            assert (list(store.messages()), store.damaged) == ([], 1)
        assert store.add_message(message, 1.0)
        assert [one.message for one in store.messages()] == [message]


def test_every_damaged_line_of_a_setup_and_of_alarms_counts_once(tmp_path: Path) -> None:
    Store(url(tmp_path)).close()
    with contextlib.closing(sqlite3.connect(tmp_path / "ground.sqlite")) as database:
        database.executemany("insert into setup (number, content) values (?, ?)", [(1, "{"), (2, "[]"), (3, "none")])
        database.executemany("insert into alarms values (?, ?)", [(1, "{"), (2, "none")])
        database.commit()
    with contextlib.closing(Store(url(tmp_path))) as store:
        assert (store.told(), store.damaged) == ([], 3)
        assert (list(store.alarms()), store.damaged) == ([], 5)


def test_a_stand_is_written_when_it_begins_and_when_it_has_ended_and_at_no_reading_between(tmp_path: Path) -> None:
    """A write is forced to the disk; readings come ten times a second."""
    with contextlib.closing(Store(url(tmp_path))) as store:
        string = KnownString(GroundConfig(folder=tmp_path))
        keeper, written = StringKeeper(store, string), list[Stand]()
        keeper._store = SimpleNamespace(keep_stand=written.append)  # type: ignore[assignment]
        stands = [Stand(EPOCH, 10.0, 11.0, 1.0)]
        string.depths.stands = stands
        for ended in (11.0, 12.0, 13.0, 14.0):
            stands[-1] = Stand(EPOCH, 10.0, ended, 1.0)
            keeper.keep_stand(DepthReading(1, ended, 1.0, (), EPOCH))
        assert written == [Stand(EPOCH, 10.0, 11.0, 1.0)]
        for at in (15.0, 16.0, 17.0):
            keeper.keep_stand(DepthReading(1, at, 1.2, (), EPOCH))
        assert written[1:] == [Stand(EPOCH, 10.0, 14.0, 1.0)]
        stands.append(Stand(EPOCH, 20.0, 21.0, 2.0))
        keeper.keep_stand(DepthReading(1, 21.0, 2.0, (), EPOCH))
        assert written[2:] == stands


def test_databases_are_merged_into_a_folder_whose_parents_are_not_there(tmp_path: Path) -> None:
    for name, number in (("a", 1), ("b", 2)):
        (tmp_path / name).mkdir()
        with contextlib.closing(Store(url(tmp_path / name))) as store:
            store.add_messages([])
            store.add_message(survey(1, number), 1.0)
    into = tmp_path / "of" / "yesterday" / "merged"
    done = merge_databases(tmp_path / "a", tmp_path / "b", into)
    assert (done.shared, done.first_alone, done.second_alone, done.stands, done.damaged) == (0, 1, 1, 0, 0)
    with contextlib.closing(Store(url(into))) as store:
        assert [one.message.sequence for one in store.messages()] == [1, 2]


def test_damage_of_both_databases_is_told_with_a_merge(tmp_path: Path) -> None:
    for name, numbers, damaged in (("a", (1, 2, 3), (2, 3)), ("b", (4, 5), (5,))):
        (tmp_path / name).mkdir()
        with contextlib.closing(Store(url(tmp_path / name))) as store:
            for number in numbers:
                store.add_message(survey(1, number), 1.0)
        with contextlib.closing(sqlite3.connect(tmp_path / name / "ground.sqlite")) as database:
            database.executemany("update messages set payload = x'00' where sequence = ?", [(k,) for k in damaged])
            database.commit()
    done = merge_databases(tmp_path / "a", tmp_path / "b", tmp_path / "c")
    assert (done.damaged, done.first_alone, done.second_alone) == (3, 1, 1)


def test_a_record_that_is_empty_fails_the_record_of_its_tube_that_is_under_way_and_nothing_else() -> None:
    book, record = OrderBook(), find_command("static_record")
    orders = [
        SentOrder(1, record, 1, {}, "anna", 0.0, ""),
        SentOrder(2, record, 2, {}, "anna", 0.0, ""),
        SentOrder(3, find_command("take_survey"), 1, {}, "anna", 0.0, ""),
        SentOrder(4, record, 1, {}, "anna", 0.0, ""),
    ]
    for order in orders:
        book.add(order)
        if order.number != 4:
            order.advance(OrderState.ACKNOWLEDGED)
    book.on_event(Event(1, 9, 10.0, Severity.WARNING, "stopped"))
    assert [order.state for order in orders[:3]] == [OrderState.ACKNOWLEDGED] * 3
    book.on_event(Event(1, 10, 10.0, Severity.WARNING, RECORD_EMPTY))
    assert [(order.number, order.detail) for order in orders if order.ended] == [(1, "nothing was recorded")]
    assert orders[0].state is OrderState.FAILED


def test_a_stand_of_a_new_epoch_before_its_first_reading_is_as_doubtful_as_the_jump_between_epochs() -> None:
    log = DepthLog(0.5, 5.0)
    assert log.on_reading(DepthReading(1, 1000.0, 3.0, (), EPOCH), EPOCH, 1000.0, 500.0, 1e3) == ""
    first = DepthReading(2, 7.0, 9.0, (), EPOCH + 1)
    assert log.on_reading(first, EPOCH + 1, 7.0, 501.0, 1e3) == "after a jump"
    log.accept()
    log.on_reading(DepthReading(3, 9.0, 9.0, (), EPOCH + 1), EPOCH + 1, 9.0, 503.0, 1e3)
    assert log.add_stand(Stand(EPOCH + 1, 2.0, 6.0, 9.0)) is None
    assert log.at(EPOCH + 1, 4.0) is None


@pytest.mark.parametrize(("above", "is_taken"), [(0.0, True), (-0.5, True), (1e-6, False)])
def test_a_told_stand_is_taken_down_to_where_the_string_reaches_and_no_deeper(
    tmp_path: Path, above: float, is_taken: bool
) -> None:
    string = KnownString(GroundConfig(folder=tmp_path))
    string.on_rig_time(100.0, EPOCH)
    for tube, hops in ((2, 1), (1, 2)):
        string.on_state(state_of(tube, hops), 100.0)
    deepest = string.tally.deepest
    assert 0.0 < deepest < math.inf
    string.on_told_stand(Stand(EPOCH, 50.0, 90.0, deepest + above), 95.0)
    assert [stand.md for stand in string.depths.stands] == ([deepest + above] if is_taken else [])


@pytest.mark.parametrize("weighting", [Weighting.ADJUSTED, Weighting.BAYES])
def test_what_is_wrong_with_an_adjusted_hole_is_an_alarm_and_of_one_that_is_fused_it_is_none(
    tmp_path: Path, weighting: Weighting
) -> None:
    """Two stations of a hole moved before the last stop; what is adjusted beside a fused hole is asked for alone."""
    moved = passes(6, lambda stop, station: 2.0 if stop == 6 and station in (1, 2) else 1.0)
    settings = {"mount_tilt_std_deg": 0.01, "accelerometer_bias_std_deg": 0.002, "weighting": weighting}
    model = knowing(tmp_path, moved, 6, **settings)
    Watch(model.string, model.hole, model.placement, model.rig_alarms, 10.0).look(100.0)
    told = [alarm.subject for alarm in model.rig_alarms if alarm.kind.code == "blunder"]
    assert told == (["hole"] if weighting is Weighting.ADJUSTED else [])


@pytest.mark.parametrize("by", ["=1+1", "@SUM(A1)", "+1+1", "-2+3", "=cmd|'/c calc'!A1"])
def test_whoever_orders_is_no_formula_in_a_table(by: str) -> None:
    assert csv_cell({"order": {"by": by}}, ("order", "by")) == f"'{by}"
    assert csv_cell({"tubes": [by, "2"]}, ("tubes",)) == f"'{by} 2"


def state_of(tube: int, hops: int) -> NodeState:
    """A tube that is well."""
    return NodeState(
        tube, 100.0, hops, NodeMode.TRACKING, 1.0, 1e-6, 1e-6, (0.0, 0.0, 0.0), 0.0, 0.0, 1e-6, 0.1, 1e-8,
        NodeFlag.NONE, 5, 0, epoch=EPOCH,
    )  # fmt: skip
