"""Alarms as a crew works with them: states, delays, floods, who acknowledged, and what a restart leaves."""

import contextlib
import math
from pathlib import Path
from typing import Any

import pytest
import sqlalchemy as sa
from hand_fed import Rig
from hypothesis import given
from hypothesis import strategies as st

from groundstation.errors import SelectorError, StoreError
from groundstation.service.alarms.crew_alarms import (
    DELAYS,
    OPEN_AT_MOST,
    SETTLED_AFTER,
    AlarmState,
    Condition,
    CrewAlarm,
    CrewAlarms,
    Times,
)
from groundstation.service.alarms.rig_alarms import Level
from groundstation.service.disk.alarm_record import DamagedAlarmError, alarm_of_text, alarm_to_text
from groundstation.service.disk.ground_store import Store

UTC = 1.8e9
CLOCK = Condition("clock", "tube 3", Level.BAD, "its rig time is 2.0 s ahead")
SILENT = Condition("tube_silent", "tube 2", Level.DEGRADED, "silent", 4.0)


class Clock:
    """Alarms that are looked at again and again."""

    def __init__(self) -> None:
        self.alarms = CrewAlarms()
        self.now = 100.0

    def look(self, *conditions: Condition, after: float = 0.5) -> None:
        self.now += after
        self.alarms.update(conditions, Times(self.now, 1000.0 + self.now, UTC + self.now))

    def states(self) -> dict[str, AlarmState]:
        return {alarm.condition.code: alarm.state(UTC + self.now) for alarm in self.alarms}

    def one(self) -> CrewAlarm:
        (alarm,) = self.alarms
        return alarm


@pytest.fixture
def it() -> Clock:
    return Clock()


def test_an_alarm_says_what_where_and_since_when(it: Clock) -> None:
    it.look(CLOCK)
    alarm = it.one()
    assert (alarm.number, alarm.condition, alarm.since, alarm.since_utc) == (1, CLOCK, 1100.5, UTC + 100.5)
    assert it.states() == {"clock": AlarmState.RAISED}


def test_what_is_short_is_no_alarm(it: Clock) -> None:
    """A string whose joint is open for a moment is silent, which is not worth an alarm."""
    it.look(SILENT)
    it.look(SILENT, after=DELAYS[Level.DEGRADED] - 1.0)
    it.look()
    it.look(SILENT)
    assert it.states() == {}
    it.look(SILENT, after=DELAYS[Level.DEGRADED])
    assert it.states() == {"tube_silent": AlarmState.RAISED}


def test_the_course_of_an_alarm_that_is_acknowledged_first(it: Clock) -> None:
    it.look(CLOCK)
    it.alarms.put(it.alarms.acknowledged(1, "anna", UTC + it.now))
    it.look(CLOCK)
    assert it.states() == {"clock": AlarmState.ACKNOWLEDGED}
    it.look()
    assert it.states() == {}
    assert [alarm.number for alarm in it.alarms.cleared] == [1]


def test_a_bad_one_that_is_gone_stays_until_somebody_has_seen_it(it: Clock) -> None:
    it.look(CLOCK)
    it.look(after=3600.0)
    assert it.states() == {"clock": AlarmState.LATCHED}
    it.alarms.put(it.alarms.acknowledged(1, "anna", UTC + it.now))
    assert it.states() == {}


def test_a_milder_one_that_is_gone_clears_by_itself(it: Clock) -> None:
    it.look(SILENT)
    it.look(SILENT, after=20.0)
    it.look()
    assert it.states() == {}
    assert it.alarms.cleared[0].cleared_at == 1000.0 + it.now


def test_the_second_who_acknowledges_is_told_who_was_first(it: Clock) -> None:
    it.look(CLOCK)
    it.alarms.put(it.alarms.acknowledged(1, "anna", UTC + it.now))
    with pytest.raises(SelectorError, match="alarm 1: anna has acknowledged it, 30 s ago"):
        it.alarms.acknowledged(1, "bert", UTC + it.now + 30.0)
    assert it.one().acknowledged_by == "anna"


def test_an_unknown_number_is_told_which_there_are(it: Clock) -> None:
    it.look(CLOCK)
    with pytest.raises(SelectorError, match="alarm 7: no such open alarm; expected one of 1"):
        it.alarms.shelved(7, "anna", UTC)
    with pytest.raises(SelectorError, match="alarm 1: expected one that is shelved"):
        it.alarms.unshelved(1)


def test_a_shelved_alarm_is_back_after_its_time(it: Clock) -> None:
    it.look(CLOCK)
    it.alarms.put(it.alarms.shelved(1, "anna", UTC + it.now + 60.0))
    assert it.states() == {"clock": AlarmState.SHELVED}
    it.look(CLOCK, after=59.0)
    assert it.states() == {"clock": AlarmState.SHELVED}
    it.alarms.drain_changed()
    it.look(CLOCK, after=1.0)
    assert it.states() == {"clock": AlarmState.RAISED}
    assert len(it.alarms.drain_changed()) == 1
    it.alarms.put(it.alarms.shelved(1, "anna", UTC + it.now + 60.0))
    it.alarms.put(it.alarms.unshelved(1))
    assert it.states() == {"clock": AlarmState.RAISED}


def test_a_worse_level_of_the_same_wants_to_be_acknowledged_anew(it: Clock) -> None:
    def column(level: Level) -> Condition:
        return Condition("projection", "column", level, direction=4.4, threshold="of 45 cm")

    it.look(column(Level.NOTICE))
    it.alarms.put(it.alarms.acknowledged(1, "anna", UTC + it.now))
    it.look(column(Level.NOTICE))
    assert it.states() == {"projection": AlarmState.ACKNOWLEDGED}
    it.look(column(Level.DEGRADED))
    assert (it.one().number, it.one().times, it.states()) == (1, 2, {"projection": AlarmState.RAISED})
    it.look(column(Level.NOTICE))
    assert it.one().condition.level is Level.NOTICE


def test_what_comes_and_goes_is_one_alarm(it: Clock) -> None:
    it.look(SILENT)
    it.look(SILENT, after=20.0)
    for _ in range(5):
        it.look()
        it.look(SILENT)
        it.look(SILENT, after=15.0)
    assert (it.one().number, it.one().times) == (1, 6)
    it.look()
    it.look(after=100.0)
    it.look(SILENT)
    it.look(SILENT, after=20.0)
    assert it.one().number == 2


def test_of_a_flood_the_worst_are_kept_and_the_rest_is_counted(it: Clock) -> None:
    notices = [Condition("bad_input", f"source {n}", Level.NOTICE) for n in range(1000)]
    it.look(*notices)
    assert len(list(it.alarms)) == OPEN_AT_MOST
    assert it.alarms.left_out == 1000 - OPEN_AT_MOST
    assert it.alarms.in_flood
    it.look(*notices)
    assert it.alarms.left_out == 1000 - OPEN_AT_MOST
    it.look(*notices, CLOCK)
    assert next(iter(it.alarms)).condition is CLOCK
    assert len(list(it.alarms)) == OPEN_AT_MOST
    assert it.alarms.left_out == 1001 - OPEN_AT_MOST
    assert len(it.alarms.drain_changed()) <= OPEN_AT_MOST + 1
    it.look(CLOCK, after=700.0)
    assert not it.alarms.in_flood
    assert it.states() == {"clock": AlarmState.RAISED}
    assert it.alarms.left_out == 1001 - OPEN_AT_MOST


def test_a_new_bad_alarm_finds_room_beside_those_that_are_only_latched(it: Clock) -> None:
    it.look(*(Condition("clock", f"tube {n}", Level.BAD) for n in range(OPEN_AT_MOST)))
    it.look()
    it.look(CLOCK)
    assert CLOCK in [alarm.condition for alarm in it.alarms]


@pytest.mark.slow
@given(
    looks=st.lists(
        st.sets(st.tuples(st.integers(0, 60), st.sampled_from(list(Level))), max_size=60), min_size=1, max_size=8
    )
)
def test_no_mild_alarm_is_shown_while_a_worse_one_is_left_out(looks: list[set[tuple[int, Level]]]) -> None:
    it = Clock()
    for look in looks:
        conditions = {f"tube {n}": Condition("clock", f"tube {n}", level) for n, level in sorted(look)}
        it.look(*conditions.values(), after=11.0)
        it.look(*conditions.values(), after=11.0)
        shown = {alarm.condition.subject: alarm for alarm in it.alarms}
        assert len(shown) <= OPEN_AT_MOST
        absent = [one.level for subject, one in conditions.items() if subject not in shown]
        standing = [alarm.condition.level for alarm in shown.values() if alarm.stands]
        assert max(absent, default=Level.NOTICE) <= min(standing, default=Level.BAD)
    assert len({alarm.number for alarm in it.alarms}) == len(list(it.alarms))


def test_a_restart_keeps_numbers_acknowledgement_and_shelf(it: Clock) -> None:
    it.look(CLOCK, SILENT)
    it.look(CLOCK, SILENT, after=20.0)
    it.alarms.put(it.alarms.acknowledged(1, "anna", UTC + it.now))
    it.alarms.put(it.alarms.shelved(2, "bert", UTC + it.now + 600.0))
    kept = [alarm_of_text(alarm_to_text(alarm)) for alarm in it.alarms.drain_changed()]
    again = Clock()
    again.now = it.now
    again.alarms.restore(kept, [])
    again.look()
    assert again.states() == {"clock": AlarmState.ACKNOWLEDGED, "tube_silent": AlarmState.SHELVED}
    again.look(after=SETTLED_AFTER)
    assert again.states() == {"tube_silent": AlarmState.SHELVED}
    again.look(Condition("disk", "database", Level.BAD))
    assert [alarm.number for alarm in again.alarms] == [3, 2]


def test_stored_data_raise_nothing_but_what_is_worse_does(it: Clock) -> None:
    column = Condition("projection", "column", Level.DEGRADED)
    it.alarms.restore([], [column])
    it.look(column)
    it.look(column, after=3600.0)
    assert it.states() == {}
    worse = Condition("projection", "column", Level.BAD)
    it.look(worse)
    assert it.states() == {"projection": AlarmState.RAISED}


@pytest.mark.parametrize("text", ["", "{}", "[]", "null", '{"number": 1}', '{"number": "1", "condition": {}}'])
def test_a_damaged_line_is_no_alarm(text: str) -> None:
    with pytest.raises(DamagedAlarmError):
        alarm_of_text(text)


@given(st.data())
def test_any_line_is_an_alarm_or_refused(data: Any) -> None:
    line = bytearray(alarm_to_text(CrewAlarm(1, CLOCK, math.nan, UTC)), "ascii")
    at = data.draw(st.integers(0, len(line) - 1))
    line[at] = data.draw(st.integers(32, 126))
    with contextlib.suppress(DamagedAlarmError):
        assert isinstance(alarm_of_text(line.decode()), CrewAlarm)


@pytest.fixture
def rig(tmp_path: Path) -> Rig:
    rig = Rig(tmp_path, target=20.0, curvature_std_deg_per_m=3.0)
    rig.run(5.0)
    for stop, inclination_deg in ((1, 0.3), (2, 6.0)):
        rig.drill(stop, inclination_deg)
    return rig


def opened(rig: Rig) -> dict[str, dict[str, Any]]:
    return {row["code"]: row for row in rig.ask("alarms")["open"]}


def order(rig: Rig, number: int, action: str, by: str, **more: str) -> None:
    rig.ground.operator.order("alarm", {"action": action, "number": str(number), **more}, by)


def test_orders_change_an_alarm_and_a_restart_does_not(rig: Rig, tmp_path: Path) -> None:
    alarm = opened(rig)["projection"]
    assert (alarm["state"], alarm["level"], alarm["wind"]) == ("raised", "bad", "N")
    assert alarm["threshold"] == "100 % of 45 cm"
    order(rig, alarm["number"], "acknowledge", "anna")
    for _ in range(11):
        rig.speak(2)
    order(rig, opened(rig)["deviation"]["number"], "shelve", "bert", minutes="60")
    with pytest.raises(SelectorError, match="anna has acknowledged it"):
        order(rig, alarm["number"], "acknowledge", "bert")
    before = opened(rig)
    rig.ground.close()
    again = Rig(tmp_path, target=20.0, curvature_std_deg_per_m=3.0)
    again.now = rig.now
    again.run(2.0)
    after = opened(again)
    for code in ("projection", "deviation"):
        assert after[code] == before[code]
    assert after["deviation"]["shelved_by"] == "bert"
    again.ground.close()


@pytest.mark.parametrize("by", ["", " ", "x" * 65, "an\x1b[2Jna", "a\nb"])
def test_a_name_that_no_screen_could_show_orders_nothing(rig: Rig, by: str) -> None:
    number = opened(rig)["projection"]["number"]
    with pytest.raises(SelectorError, match="by: expected a name of 1 to 64 printable characters"):
        order(rig, number, "acknowledge", by)
    assert opened(rig)["projection"]["state"] == "raised"


def test_an_order_that_cannot_be_kept_is_refused_and_changes_nothing(rig: Rig, tmp_path: Path) -> None:
    number = opened(rig)["projection"]["number"]
    (tmp_path / "ground.sqlite").unlink()
    with pytest.raises(StoreError, match="was removed or replaced"):
        order(rig, number, "acknowledge", "anna")
    assert opened(rig)["projection"]["state"] == "raised"


def test_a_database_of_before_the_alarms_is_read_and_keeps_them_from_now_on(rig: Rig, tmp_path: Path) -> None:
    rig.ground.close()
    url = f"sqlite:///{tmp_path / 'ground.sqlite'}"
    engine = sa.create_engine(url)
    with engine.begin() as connection:
        connection.execute(sa.text("drop table alarms"))
        connection.execute(sa.text("update meta set value = '2' where name = 'schema'"))
    engine.dispose()
    again = Rig(tmp_path, target=20.0, curvature_std_deg_per_m=3.0)
    again.now = rig.now
    again.run(2.0)
    assert "projection" not in opened(again)
    again.ground.close()
    store = Store(url)
    assert len(list(store.messages())) == 2
    store.close()


def test_a_depth_is_compared_with_the_tubes_once_all_that_speak_have_been_heard(tmp_path: Path) -> None:
    whole, short = Rig(tmp_path / "whole"), Rig(tmp_path / "short")
    for rig in (whole, short):
        rig.depth(10.0)
    for met in ((5, 4), (3, 2), (1,)):
        for tube in met:
            whole.tell(tube, 6 - tube)
        whole.run(0.5)
        whole.read_depth(10.0)
        assert "depth_contradicts" not in whole.alarms()
    for _ in range(4):
        short.tell(5, 1)
        short.run(1.0)
        short.read_depth(10.0)
    assert "depth_contradicts" in short.alarms()
