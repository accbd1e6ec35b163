"""Strings that speak by radio: whole rigs in this process, through soil and inside the bore."""

from __future__ import annotations

import copy
import math
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from borechain.drilling.inline import InlineRig
from node.process.tube_process import TubeProcess
from sim.rig.ground_settings import ground_settings
from sim.rig.rig_progress import RigProgress
from sim.studies.soil_link.wet_clay import expected_delivery, largest_difference, surveys_of, wet_clay
from sim.world.marks import wrap_angle
from sim.world.parsing import read_toml
from sim.world.scenario import scenario_of
from sim.world.world import World

PIPE = Path(__file__).parents[2] / "scenarios" / "pipe-5.toml"
DEAD, KILLED, DOWN = 3, 70.0, 100.0  # tube, s after the start, s
pytestmark = pytest.mark.slow


@dataclass
class Drilled:
    """A rig that has finished, and how old the aiding of its lowest tubes became meanwhile."""

    rig: InlineRig
    world: World
    oldest: Counter[int] = field(default_factory=Counter)  # s, by tube, while tube 3 was dead

    def events(self, code: str) -> list[dict[str, Any]]:
        return [event for event in self.rig.ask("events")["events"] if event["code"] == code]


def drill(folder: Path, **radio: Any) -> Drilled:
    """The scenario of the pipe, some keys of its radio changed."""
    tables = copy.deepcopy(read_toml(PIPE))
    tables["radio"]["pipe"] |= radio
    world = World(scenario_of(tables), 1)
    rig = InlineRig(world, ground_settings(world), "pipe", folder)
    drilled = Drilled(rig, world)

    def watch(progress: RigProgress) -> None:
        after = progress.rig_time - world.begin
        if not KILLED < after < KILLED + DOWN:
            return
        for tube in (1, 2):
            process = rig.stepper.processes[tube]
            assert isinstance(process, TubeProcess)
            age = world.local_clock(tube, progress.rig_time) - float(process.tube.state["last_aided"])
            drilled.oldest[tube] = max(drilled.oldest[tube], age)

    rig.run(watch)
    return drilled


@pytest.fixture(scope="module")
def pipe(tmp_path_factory: pytest.TempPathFactory) -> Drilled:
    drilled = drill(tmp_path_factory.mktemp("pipe"))
    yield drilled
    drilled.rig.close()


def test_tubes_below_a_dead_one_keep_their_yaw(pipe: Drilled) -> None:
    assert max(pipe.oldest.values()) < 5.0
    surveys = [m for m in pipe.rig.ask("measurements")["measurements"] if m["tube"] < DEAD]
    assert len(surveys) == 4
    for survey in surveys:
        at = survey["station_at_s"]
        error = wrap_angle(math.radians(survey["yaw_deg"]) - pipe.world.yaw_truth(survey["tube"], at))
        own = math.degrees(wrap_angle(error - pipe.world.systematic_error(survey["tube"], at)))
        assert abs(own) < 5.0 * survey["sigma_yaw_deg"]
        assert survey["sigma_yaw_deg"] < 0.02
        assert survey["flags"] == []
    assert not [event for event in pipe.events("joint_opened") if event["tube"] < DEAD]
    assert not [event for event in pipe.events("aiding_rejected") if event["tube"] < DEAD]


def test_where_only_the_neighbour_is_heard_the_dead_tube_cuts_the_aiding(tmp_path: Path) -> None:
    alone = drill(tmp_path, reach=1)
    assert min(alone.oldest.values()) > 0.9 * DOWN
    alone.rig.close()


def test_nothing_is_lost_over_a_dead_tube_and_every_survey_has_its_place(pipe: Drilled) -> None:
    measurements = pipe.rig.ask("measurements")["measurements"]
    assert Counter(m["tube"] for m in measurements) == {1: 2, 2: 2, 3: 1, 4: 2, 5: 2}
    assert all(p.endpoint.mail.outbox_size == 0 for p in pipe.rig.stepper.processes.values())
    for m in measurements:
        bit = pipe.world.bit_depth(m["station_at_s"])
        assert m["md_m"] == pytest.approx(bit - (m["tube"] - 1) * pipe.world.scenario.tube_length, abs=1e-6)
        assert m["hops"] == 6 - m["tube"]
    assert pipe.rig.ask("status")["unplaced_measurements"] == 0


def test_the_crew_is_told_of_the_dead_tube_and_of_its_return(pipe: Drilled) -> None:
    (silent,) = pipe.events("tube_silent")
    assert (silent["tube"], silent["severity"], silent["arguments"]) == (2, "warning", {"tube": 3, "tubes": 1})
    assert KILLED < silent["at_s"] - pipe.world.begin < KILLED + 4.0
    (back,) = pipe.events("tube_heard_again")
    assert (back["tube"], back["arguments"]) == (2, {"tube": 3})
    assert KILLED + DOWN < back["at_s"] - pipe.world.begin < KILLED + DOWN + 4.0


def test_a_node_tells_the_margins_with_which_it_hears(pipe: Drilled) -> None:
    radio = pipe.world.radio
    assert radio is not None
    for tube in range(1, 6):
        view = pipe.rig.ask(f"nodes/{tube}")
        at = view["at_s"]
        assert view["upper_margin_db"] == pytest.approx(radio.margin((tube,), at))
        below = None if tube == 1 else pytest.approx(radio.margin((tube - 1,), at))
        assert view["lower_margin_db"] == below


def test_surveys_come_through_wet_clay_as_late_as_expected() -> None:
    world = wet_clay(3)
    surveys = surveys_of(world)
    assert sorted((s.tube, s.hops) for s, _ in surveys) == [(1, 1), (1, 2), (1, 3), (2, 1), (2, 2), (3, 1)]
    times = np.array([seconds for _, seconds in surveys])
    distribution = expected_delivery(world, surveys)
    assert distribution.sum() == pytest.approx(1.0, abs=1e-6)
    assert times.min() > 0.0
    assert largest_difference(times, distribution) < 0.725  # beyond which six draws fall once in a thousand
