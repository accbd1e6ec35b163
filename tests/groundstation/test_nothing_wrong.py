"""Faults on a whole string that is drilled: what the crew sees is right, or it is flagged."""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from borechain.drilling.inline import InlineRig
from groundstation.service.process.ground_process import GroundProcess
from node.process.counter import LOTS
from node.process.tube_process import TubeProcess
from sim.rig.report import missing_surveys
from sim.rig.scheduler import Scheduler
from sim.world.scenario import load_scenario, scenario_of
from sim.world.world import World
from telemetry.frozen import replace
from telemetry.messages import BASE, ENCODER, DepthReading
from telemetry.presentation.msgpack_codec import encode_message

pytestmark = pytest.mark.slow

LENGTH = 2.0
TABLES: dict[str, Any] = {
    "rig": {"tubes": 2, "tube_length_m": LENGTH},
    "path": {"straight": {"inclination_deg": 3.0, "azimuth_deg": 40.0}},
    "schedule": {"add_s": 60.0, "joint_s": 20.0, "stop_s": 32.0, "finish_s": 75.0},
    "rotation": {"turns": 5.0},
}


class RebootWorld(World):
    """An encoder that starts again counts its time from zero."""

    zero = 0.0

    def reboot(self, at: float) -> None:
        self.zero = at

    def local_clock(self, address: int, t: float) -> float:
        return t - self.zero if address == ENCODER else super().local_clock(address, t)

    def true_time(self, address: int, local: float) -> float:
        return local + self.zero if address == ENCODER else super().true_time(address, local)

    def encoder_sample(self, t: float) -> tuple[int, float, int, float | None, tuple[float, ...]]:
        count, edge_at, rising, torque, earlier = super().encoder_sample(t)
        return count, edge_at - self.zero, rising, torque, tuple(edge - self.zero for edge in earlier)


class Drilled:
    """A string of two tubes that is drilled as far as a test wants, in this process."""

    def __init__(self, folder: Path) -> None:
        self.world = RebootWorld(scenario_of(TABLES), 5)
        self.folder = folder
        self.inline = InlineRig(self.world, {"tube_length": LENGTH}, "rig-1", folder)
        self.stepper = self.inline.stepper
        self.scheduler = Scheduler(self.world, self.stepper, self.stepper.follow)
        self.scheduler.begin()
        self.drills = [phase.start for phase in self.world.phases if phase.kind == "drill"]
        self.stops = [phase.start for phase in self.world.phases if phase.kind == "stop"]

    @property
    def ground(self) -> GroundProcess:
        return self.inline.ground

    def drill(self, to: float) -> None:
        self.scheduler.advance(to)

    def finish(self) -> None:
        self.scheduler.advance()

    def cut(self, address: int) -> None:
        """Power off; it stays off until ``start``."""
        if address == BASE:
            self.ground.store.close()
        self.stepper.drop(address)
        self.scheduler.progress.wanted.remove(address)

    def start(self, address: int) -> None:
        self.scheduler.progress.wanted.append(address)
        self.stepper.follow(self.scheduler.progress)

    def place(self, name: str) -> Path:
        return self.folder / "state" / name

    def surveys(self) -> list[tuple[int, float]]:
        """Tube and depth of every survey that an operator sees."""
        shown = self.inline.ask("measurements")["measurements"]
        return sorted((row["tube"], row["md_m"]) for row in shown)

    def codes(self) -> set[str]:
        """Kinds of rig alarms that were raised, standing or not."""
        shown = self.inline.ask("alarms")
        return {row["code"] for row in shown["rig"] + shown["rig_cleared"]}

    def health(self) -> str:
        return str(self.inline.ask("status")["health"])


EVERY = [(1, LENGTH), (1, 2.0 * LENGTH), (2, LENGTH)]


@pytest.fixture
def rig(tmp_path: Path) -> Any:
    rig = Drilled(tmp_path)
    yield rig
    rig.inline.close()


def test_an_undisturbed_string_raises_no_alarm_and_is_good(rig: Drilled) -> None:
    rig.finish()
    assert rig.surveys() == EVERY
    assert rig.inline.ask("alarms")["rig"] == []
    # a new tube is not heard, nor does it know its yaw, until it is screwed on
    assert rig.codes() <= {"tube_silent", "tube_sensor"}
    assert rig.health() == "good"
    assert missing_surveys(rig.inline.ask("measurements")["measurements"], rig.world) == []


@pytest.mark.parametrize("when", [-10.0, 5.0])
def test_an_encoder_that_starts_again_from_zero_misplaces_nothing(rig: Drilled, when: float) -> None:
    rig.drill(rig.stops[1] + when)
    rig.cut(ENCODER)
    rig.drill(rig.stops[1] + when + 3.0)
    rig.world.reboot(rig.stops[1] + when)
    rig.start(ENCODER)
    rig.finish()
    assert rig.inline.ask("status")["epoch"] == 2
    assert set(rig.surveys()) <= set(EVERY)
    assert rig.surveys() == EVERY or rig.codes() & {"survey_missing", "survey_unplaced", "survey_untrusted"}
    assert "epoch" in rig.codes()


def test_an_encoder_that_lost_its_count_uses_no_epoch_again_and_no_stop_of_before_misses_a_survey(rig: Drilled) -> None:
    rig.drill(rig.drills[1] - 5.0)
    rig.cut(ENCODER)
    (rig.place("encoder") / "boots").unlink()
    rig.start(ENCODER)
    rig.finish()
    assert rig.inline.ask("status")["epoch"] >= LOTS
    assert rig.surveys() == EVERY
    assert "survey_missing" not in rig.codes()  # the stands of before are told again, by a clock that ran on


def test_the_joint_at_which_a_tube_changes_the_measurement_is_named(rig: Drilled) -> None:
    """Tube 2 is honest about itself and lies to those below."""
    rig.drill(rig.drills[1] + 5.0)
    liar = rig.stepper.processes[2].endpoint
    plain = liar.send_aiding
    liar.send_aiding = lambda aiding, now: plain(replace(aiding, yaw=(aiding.yaw + 0.3) % math.tau), now)  # type: ignore[method-assign]
    rig.finish()
    told = [row for row in rig.inline.ask("alarms")["rig"] if row["code"] == "joint"]
    assert [row["subject"] for row in told] == ["joint of tubes 2 and 1"]
    assert "17.2 deg" in told[0]["detail"]
    assert rig.health() == "bad"


def test_a_ground_station_that_is_off_across_a_stop_places_its_surveys(rig: Drilled) -> None:
    rig.drill(rig.drills[1] - 5.0)
    rig.cut(BASE)
    rig.drill(rig.stops[1] + 40.0)
    rig.start(BASE)
    rig.finish()
    assert rig.surveys() == EVERY


def test_a_depth_from_the_future_changes_nothing(rig: Drilled) -> None:
    rig.drill(rig.stops[0] + 5.0)
    forged = encode_message(DepthReading(1, rig.scheduler.now + 300.0, 1.0, ()))
    rig.ground.on_depth(forged, rig.world.local_clock(BASE, rig.scheduler.now))
    rig.finish()
    assert rig.surveys() == EVERY
    assert rig.ground.model.string.depths.refusals["ahead of rig time"] == 1


def empty(folder: Path) -> None:
    for file in folder.glob("ground.sqlite*"):
        file.unlink()


def spoil(folder: Path) -> None:
    """Damage the surveys in the database, as a disk that rots."""
    import sqlite3

    with sqlite3.connect(folder / "ground.sqlite") as connection:
        connection.execute("update messages set payload = x'00' where kind = 'SurveyMeasurement'")
    connection.close()


@pytest.mark.parametrize("harm", [empty, spoil])
def test_a_ground_station_that_lost_its_surveys_gets_them_back(rig: Drilled, harm: Callable[[Path], None]) -> None:
    rig.drill(rig.stops[0] + 40.0)
    assert rig.surveys() == [(1, LENGTH)]
    rig.cut(BASE)
    harm(rig.place("ground"))
    rig.start(BASE)
    rig.finish()
    assert rig.surveys() == EVERY
    assert "numbers_missing" in rig.codes()


def test_a_database_that_vanishes_is_told_and_nothing_is_acknowledged(rig: Drilled) -> None:
    rig.drill(rig.drills[1] - 5.0)
    empty(rig.place("ground"))
    rig.drill(rig.stops[1] + 40.0)
    assert "disk" in rig.codes()
    assert rig.health() == "bad"
    waiting = rig.stepper.processes[1]
    assert isinstance(waiting, TubeProcess)
    assert waiting.endpoint.mail.outbox_size > 0
    rig.cut(BASE)
    rig.start(BASE)
    rig.finish()
    assert rig.surveys() == EVERY


def test_a_tube_that_loses_its_memory_leaves_no_station_silently(rig: Drilled) -> None:
    rig.drill(rig.stops[1] - 4.0)
    rig.cut(1)
    for slot in rig.place("tube-1").glob("slot-*"):
        slot.unlink()
    rig.start(1)
    rig.finish()
    missing = missing_surveys(rig.inline.ask("measurements")["measurements"], rig.world)
    assert ("survey_missing" in rig.codes()) == bool([row for row in missing if row["tube"] == 1])
    assert rig.surveys() == EVERY or rig.codes() & {"survey_missing", "survey_untrusted"}


def test_a_first_stand_in_which_a_tube_surveyed_is_a_stop_of_all(rig: Drilled) -> None:
    """The ground station knows nothing from before the stop, and of the tubes one lost what it had measured."""
    begin = rig.drills[1] + 5.0
    rig.drill(begin)
    rig.cut(BASE)
    rig.cut(ENCODER)
    empty(rig.place("ground"))
    rig.drill(begin + 3.0)
    rig.world.reboot(begin)
    rig.start(ENCODER)
    rig.drill(rig.stops[1] + 20.0)
    rig.cut(2)
    for slot in rig.place("tube-2").glob("slot-*"):
        slot.unlink()
    rig.start(2)
    rig.start(BASE)
    rig.finish()
    assert (1, 2.0 * LENGTH) in rig.surveys()
    assert (2, LENGTH) not in rig.surveys()
    assert "survey_missing" in rig.codes()


def test_a_node_whose_folder_takes_nothing_goes_on_and_says_so(rig: Drilled) -> None:
    rig.drill(rig.drills[1] - 20.0)
    rig.cut(1)
    folder = rig.place("tube-1")
    (folder / "boots").unlink()
    folder.rename(folder.with_name("kept"))
    folder.write_text("a file, as good as a folder that cannot be written")
    rig.start(1)
    rig.finish()
    assert rig.codes() >= {"tube_disk", "tube_restarted"}
    assert (2, LENGTH) in rig.surveys()
    assert set(rig.surveys()) <= set(EVERY)
    assert rig.surveys() == EVERY or "survey_missing" in rig.codes()


def test_the_shipped_scenarios_ask_for_a_survey_of_every_tube_at_every_stop() -> None:
    world = World(load_scenario(Path("scenarios/wellbore-1.toml")), 1)
    assert len(missing_surveys([], world)) == 55
