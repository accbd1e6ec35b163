"""Joints keep the angle at which they were made up, and a change is told with its joint."""

import math
from collections.abc import Sequence

import pytest
from hypothesis import given
from hypothesis import strategies as st

from groundstation.survey.bearings import wrap_angle
from groundstation.survey.fusion.joint_angles import AGREEING, JointAngles, JointChange, RestingYaw

STRING = (4, 3, 2, 1)
STD = math.radians(0.05)

angles = st.floats(-math.pi, math.pi)


def told(log: JointAngles, offsets: Sequence[float], head: Sequence[float], since: float = 0.0) -> list[JointChange]:
    """What the log tells of tubes at these angles against a head that stands so (rad), a second each."""
    changes = []
    for k, yaw in enumerate(head):
        for tube, offset in zip(STRING, offsets, strict=True):
            change = log.on_yaw(STRING, RestingYaw(tube, since + k + 0.1 * tube, wrap_angle(yaw + offset), STD**2))
            changes += [] if change is None else [change]
    return changes


@given(st.tuples(*[angles] * 4), st.lists(angles, min_size=2, max_size=8))
def test_a_string_that_turns_as_a_whole_tells_nothing(offsets: Sequence[float], head: Sequence[float]) -> None:
    assert told(JointAngles(), offsets, head) == []


@given(st.tuples(*[angles] * 4), angles, st.integers(1, 3), st.floats(3.0, 179.0), st.sampled_from((-1.0, 1.0)))
def test_the_joint_below_the_tube_that_lies_is_named_once(
    offsets: Sequence[float], head: float, place: int, size_deg: float, sign: float
) -> None:
    log, lie = JointAngles(), sign * math.radians(size_deg)
    assert told(log, offsets, [head] * 3) == []
    lied = [offset + lie if k >= place else offset for k, offset in enumerate(offsets)]
    (change,) = told(log, lied, [head] * (AGREEING + 3), since=100.0)
    assert change.pair == (STRING[place - 1], STRING[place])
    assert wrap_angle(change.by - lie) == pytest.approx(0.0, abs=1e-9)


def test_a_change_is_told_once_until_the_crew_accepts_the_angle() -> None:
    log, lied = JointAngles(), (0.0, 1.0, 2.5, 3.5)
    assert told(log, (0.0, 1.0, 2.0, 3.0), [0.0] * 3) == []
    assert [change.pair for change in told(log, lied, [0.0] * 5, since=10.0)] == [(3, 2)]
    assert told(log, (0.0, 1.0, 2.0, 3.0), [0.0] * 5, since=20.0) == []
    assert told(log, lied, [0.0] * 5, since=30.0) == []
    assert log.accept() == [(3, 2)]
    assert told(log, lied, [0.0] * 5, since=40.0) == []


def test_angles_that_were_kept_are_those_of_before() -> None:
    log, later = JointAngles(), JointAngles()
    assert told(log, (0.0, 1.0, 2.0, 3.0), [0.0] * 3) == []
    later.known.update(log.known)
    (change,) = told(later, (0.0, 1.0, 2.5, 3.5), [0.0] * 5, since=10.0)
    assert change.pair == (3, 2)


def test_two_readings_that_part_are_a_tube_that_has_not_settled() -> None:
    log = JointAngles()
    assert told(log, (0.0, 1.0, 2.0, 3.0), [0.0] * 2) == []
    assert told(log, (0.0, 1.0, 2.5, 3.0), [0.0] * (AGREEING - 1), since=10.0) == []
    assert told(log, (0.0, 1.0, 2.0, 3.0), [0.0] * 5, since=20.0) == []


def test_yaws_of_different_times_or_of_a_moving_tube_are_not_compared() -> None:
    log = JointAngles()
    assert told(log, (0.0, 1.0, 2.0, 3.0), [0.0] * 2) == []
    for k in range(10):
        assert log.on_yaw(STRING, RestingYaw(3, 100.0 + 10.0 * k, 2.0, STD**2)) is None
    for k in range(10):
        assert log.on_yaw(STRING, RestingYaw(4, 300.0 + k, 0.0, STD**2)) is None
        log.on_motion(4)
        assert log.on_yaw(STRING, RestingYaw(3, 300.1 + k, 2.0, STD**2)) is None


def test_a_joint_that_was_made_up_anew_is_another_one() -> None:
    log = JointAngles()
    assert told(log, (0.0, 1.0, 2.0, 3.0), [0.0] * 3) == []
    log.on_yaw((4, 2, 1), RestingYaw(2, 50.0, 2.0, STD**2))  # tube 3 is taken out
    assert told(log, (0.0, 0.5, 2.0, 3.0), [0.0] * 5, since=100.0) == []
