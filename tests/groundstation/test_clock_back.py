"""The base's clock or date steps back, by 2 s to a day: held and told, nothing lost, no tube heard in the future."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest
from hand_fed import Rig as HandFed
from hypothesis import given
from hypothesis import strategies as st

from groundstation.config import GroundConfig
from groundstation.service.alarms.crew_alarms import Condition, CrewAlarms, Times
from groundstation.service.alarms.rig_alarms import Level
from groundstation.service.process.ground_process import GroundProcess
from telemetry.messages import Side
from telemetry.presentation.msgpack_codec import encode_message
from telemetry.runtime.steady_time import STEPS_FROM, SteadyTime

DAY = 86_400.0
BACK = [pytest.param(2.0, id="2 s"), pytest.param(90.0, id="90 s"), pytest.param(DAY, id="a day")]


class Rig(HandFed):
    """The clock of its ground station is behind that of the string by ``behind`` s."""

    behind = 0.0

    def run(self, duration: float) -> None:
        end = self.now + duration
        while self.now < end:
            self.tube.advance(self.now)
            shown = self.now - self.behind
            self.ground.on_timer(shown)
            for _ in range(3):
                for _, frame in self.ground.take_frames(shown):
                    self.tube.receive(Side.UPPER, frame.payload, self.now)
                for side, frame in self.tube.take_frames(self.now):
                    if side is Side.UPPER:
                        self.ground.on_frame(Side.LOWER, frame.payload, shown)
            wake = self.ground.next_wake(shown)
            assert math.isinf(wake) or wake < shown + 60.0
            self.now += 0.5

    def read_depth(self, md: float) -> None:
        self.md = md
        self.ground.on_depth(encode_message(self.source.measure(self.now, md)), self.now - self.behind)


def drilling(folder: Path) -> Rig:
    rig = Rig(folder)
    rig.run(12.0)
    rig.state(1, 1)
    rig.read_depth(2.0)
    rig.run(1.0)
    rig.read_depth(2.0)
    rig.survey(1, 1)
    return rig


@pytest.mark.parametrize("back", BACK)
def test_it_is_told_and_nothing_is_lost_or_heard_in_the_future(tmp_path: Path, back: float) -> None:
    rig = drilling(tmp_path)
    rig.behind = back
    rig.run(3.0)
    (told,) = [row for row in rig.ask("alarms")["rig"] if row["code"] == "clock_back"]
    assert told["detail"].startswith("it stepped back by ")
    # to the half second between two events of this rig
    assert float(told["detail"].split()[4]) == pytest.approx(back, abs=0.6)
    assert told["count"] == 1  # however often it is looked at
    rig.state(1, 1)
    assert 0.0 <= rig.ask("nodes/1")["age_s"] <= 2.0
    assert not rig.ask("nodes/1")["stale"]
    rig.survey(1, 2)
    rig.run(2.0)
    assert len(rig.ask("measurements")["measurements"]) == 2
    assert rig.tube.mail.outbox_size == 0
    rig.behind += 2.0 * back
    rig.run(3.0)
    (told,) = [row for row in rig.ask("alarms")["rig"] if row["code"] == "clock_back"]
    assert told["count"] == 2
    assert float(told["detail"].split()[4]) == pytest.approx(2.0 * back, abs=0.6)  # of this step alone


@pytest.mark.parametrize("back", BACK)
def test_who_falls_silent_after_it_is_told_as_soon_as_ever(tmp_path: Path, back: float) -> None:
    rig = drilling(tmp_path)
    rig.behind = back
    rig.run(rig.ground.config.stale_after + 2.0)
    assert "tube_silent" in rig.alarms()
    assert rig.ask("nodes/1")["stale"]


@pytest.mark.parametrize("back", BACK)
def test_rig_time_goes_on_as_it_was(tmp_path: Path, back: float) -> None:
    rig = drilling(tmp_path)
    rig.behind = back
    rig.run(30.0)
    header = rig.ask("status")
    assert header["rig_time_s"] == pytest.approx(rig.now, abs=back if back < 3.0 else 1.0)


@given(st.lists(st.floats(-1e5, 1e3), min_size=1, max_size=60))
def test_time_never_runs_back_by_more_than_threads_do_and_never_gains(steps: list[float]) -> None:
    steady, shown, newest, gained = SteadyTime(), 0.0, steady_start(), 0.0
    for step in [0.0, *steps]:
        shown += step
        gained += max(step, 0.0)
        at = steady.follow(shown)
        assert at >= newest - STEPS_FROM - 1e-6
        assert at <= gained + 1e-6
        assert steady.shown_at(at) == pytest.approx(shown, abs=1e-6)
        newest = max(newest, at)


def steady_start() -> float:
    return -math.inf


def test_a_shelved_alarm_comes_back_as_if_the_date_had_gone_on() -> None:
    alarms, wrong = CrewAlarms(), [Condition("disk", "database", Level.BAD)]
    alarms.update(wrong, Times(0.0, 0.0, 10 * DAY))
    alarms.put(alarms.shelved(1, "anna", 10 * DAY + 1800.0))
    alarms.update(wrong, Times(600.0, 600.0, 10 * DAY + 600.0))
    back = alarms.follow_date(9 * DAY + 601.0)
    assert back == pytest.approx(DAY, abs=2.0)
    alarms.update(wrong, Times(1700.0, 1700.0, 9 * DAY + 1700.0))
    assert states_of(alarms) == ["shelved"]
    alarms.update(wrong, Times(1801.0, 1801.0, 9 * DAY + 1801.0))
    assert states_of(alarms) == ["raised"]


def states_of(alarms: CrewAlarms) -> list[str]:
    return [str(one.state(alarms.utc)) for one in alarms]


def test_a_restored_machine_that_starts_a_day_before_is_told(tmp_path: Path) -> None:
    for date, told in ((100 * DAY, False), (99 * DAY, True), (101 * DAY, False)):
        ground = GroundProcess(
            GroundConfig(folder=tmp_path, accelerometer_bias_std_deg=0.002), date=lambda date=date: date
        )
        ground.model.rig_alarms.alert("page_restarted", "page")  # whose date is kept
        for k in range(40):
            ground.on_timer(1000.0 + 0.5 * k)
        rows = json.loads(ground.operator.ask_json("alarms"))["rig"]
        assert ("clock_back" in {row["code"] for row in rows}) is told
        ground.close()
