"""Which states show that a tube lives, and how old they are."""

from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from groundstation.config import GroundConfig
from groundstation.service.answers.model import RigModel
from groundstation.service.process.ground_process import GroundProcess
from telemetry.frozen import replace
from telemetry.messages import EPOCH_UNKNOWN, NodeFlag, NodeMode, NodeState, Side

VAR = 1e-7


def node_state(tube: int, at: float, cycles: int) -> NodeState:
    return NodeState(
        tube, at, 1, NodeMode.STILL, 0.0, VAR, 0.0, (0.0, 0.0, 0.0), 0.0, 0.0, VAR, 0.5, 1e-8, NodeFlag.NONE, cycles, 0
    )


def test_a_state_that_was_recorded_is_no_sign_of_life(tmp_path: Path) -> None:
    model = RigModel.begin(GroundConfig(folder=tmp_path))
    old = node_state(1, at=100.0, cycles=50)
    for now, state in ((0.0, old), (1.0, node_state(1, at=101.0, cycles=52))):
        model.string.time.now = now
        model.string.on_state(state, now)
    model.string.time.now = 60.0
    model.string.on_state(old, 60.0)
    assert model.string.states.is_stale(1)
    model.string.on_state(
        node_state(1, at=160.0, cycles=1), 60.0
    )  # a tube that has started again counts its cycles anew
    assert not model.string.states.is_stale(1)


def test_tubes_that_start_one_after_the_other_are_all_waited_for(tmp_path: Path) -> None:
    """A rig ten times as fast as real time starts its processes over many seconds of its own."""
    model = RigModel.begin(GroundConfig(folder=tmp_path))
    model.string.time.now = 0.0
    for tube in range(10, 0, -1):
        model.string.time.now += 1.5
        model.string.on_state(node_state(tube, at=model.string.time.now, cycles=1), model.string.time.now)
        assert not model.string.knows_tubes
    model.string.time.now += 2.0
    assert model.string.knows_tubes
    model.string.on_state(
        node_state(11, at=model.string.time.now, cycles=1), model.string.time.now
    )  # one that is added later
    assert model.string.knows_tubes


def test_a_recorded_state_without_an_epoch_opens_the_door_for_no_other(tmp_path: Path) -> None:
    """The first word of a tube knows no rig time; after it those of before looked new."""
    model = RigModel.begin(GroundConfig(folder=tmp_path))
    first, later = node_state(1, at=5.0, cycles=1), replace(node_state(1, at=100.0, cycles=50), epoch=2)
    model.string.time.now = model.string.time.epoch = 2
    assert model.string.on_state(first, 2.0)
    assert model.string.on_state(later, 2.0)
    model.string.time.now = 60.0
    assert not model.string.on_state(first, 60.0)
    assert not model.string.on_state(replace(later, at=99.0, cycles=48), 60.0)
    assert model.string.states.is_stale(1)
    assert model.string.on_state(node_state(1, at=4.9, cycles=1), 60.0)  # a board whose clock begins with its power
    assert not model.string.states.is_stale(1)


def test_a_state_of_an_epoch_that_the_encoder_has_left_is_no_sign_of_life(tmp_path: Path) -> None:
    model = RigModel.begin(GroundConfig(folder=tmp_path))
    old = replace(node_state(1, at=100.0, cycles=50), epoch=2)
    model.string.time.now = model.string.time.epoch = 2
    model.string.on_state(old, 2.0)
    model.string.time.now, model.string.time.epoch = 3.0, 3
    model.string.on_state(replace(node_state(1, at=1.0, cycles=52), epoch=3), 3.0)
    model.string.time.now, model.string.time.epoch = 60.0, 4
    assert not model.string.on_state(replace(old, at=101.0, cycles=51), 60.0)
    assert model.string.states.is_stale(1)
    model.string.time.epoch = 2  # the encoder has its old count again, and its tubes with it
    assert model.string.on_state(replace(old, at=160.0, cycles=150), 60.0)
    assert not model.string.states.is_stale(1)


@given(st.floats(0.0, 100.0))
def test_a_recorded_state_shows_no_tube_fresh_to_a_ground_station_that_has_just_started(late: float) -> None:
    model = RigModel.begin(GroundConfig(folder=Path("unused")))
    recorded = replace(node_state(1, at=1000.0, cycles=50), epoch=1)
    model.string.time.now = 5.0
    model.string.on_rig_time(1000.0 + late, 1)
    model.string.on_state(recorded, 5.0)
    assert model.string.states.age(1) == pytest.approx(late)


@given(st.floats(0.0, 100.0))
def test_a_state_that_came_before_rig_time_was_known_is_as_old_as_it_says(late: float) -> None:
    """Frames that waited in a process that stood still reach a ground station that has just started."""
    model = RigModel.begin(GroundConfig(folder=Path("unused")))
    model.string.time.now = 5.0
    model.string.on_state(replace(node_state(1, at=1000.0, cycles=50), epoch=1), 5.0)
    assert model.string.states.age(1) == 0.0
    model.string.on_rig_time(1000.0 + late, 1)
    assert model.string.states.age(1) == pytest.approx(late)
    model.string.time.now = 7.0
    model.string.on_rig_time(1002.0 + late, 1)
    assert model.string.states.age(1) == pytest.approx(late + 2.0)


def test_a_state_of_an_epoch_that_has_passed_is_as_old_as_that_epoch_says() -> None:
    model = RigModel.begin(GroundConfig(folder=Path("unused")))
    for now, rig_now, epoch in ((5.0, 1000.0, 2), (6.0, 1001.0, 2), (7.0, 0.0, 3), (40.0, 33.0, 3)):
        model.string.time.now = now
        model.string.on_rig_time(rig_now, epoch)
    model.string.on_state(replace(node_state(1, at=1010.0, cycles=50), epoch=2), 40.0)
    assert model.string.states.age(1) == pytest.approx(25.0)


@pytest.mark.parametrize(
    "undated",
    [{"epoch": 2}, {"epoch": EPOCH_UNKNOWN}, {"epoch": 1, "flags": NodeFlag.CLOCK_UNSYNCHRONISED}],
)
def test_silence_is_judged_by_arrival_where_the_times_of_two_clocks_are_not_comparable(undated: dict[str, Any]) -> None:
    model = RigModel.begin(GroundConfig(folder=Path("unused")))
    model.string.time.now = 5.0
    model.string.on_rig_time(1100.0, 1)
    model.string.on_state(replace(node_state(1, at=1000.0, cycles=50), **undated), 5.0)
    assert model.string.states.age(1) == 0.0


def test_a_ground_station_that_stood_still_shows_nobody_fresh_whatever_comes_first(tmp_path: Path) -> None:
    """Its own time is that of every event, also of a frame that holds no message for it."""
    ground = GroundProcess(GroundConfig(folder=tmp_path))
    ground.on_timer(100.0)
    ground.on_message(node_state(1, at=50.0, cycles=1), 100.0)
    assert not ground.model.string.states.is_stale(1)
    ground.on_frame(Side.LOWER, b"noise", 130.0)
    assert ground.model.string.states.is_stale(1)
    ground.close()
