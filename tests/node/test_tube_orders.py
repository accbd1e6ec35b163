"""What a tube does at an order, a change of block and a start: each in words, each at its bound, each twice."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from test_told_figures import AROUND, tube

from node.firmware.inputs import ImuReading
from node.firmware.saved_state import CarriedState
from node.firmware.tube import Tube
from node.kernels.filter.modes import STATIC_BIAS, TRACKING
from node.kernels.sensors.aligner import FASTEST
from node.kernels.step.node_step import SAY_EVENTS, SAY_RECORD, SAY_STATE, SAY_SURVEY
from node.process.tube_process import MAX_CLOCK_STD, TubeProcess, jump_of
from telemetry.messages import Event, NodeState, Severity, Side, StaticRecord, SurveyMeasurement
from telemetry.parameters import SHORT_HASH, ParameterBlock, SensorParameters

TURNED = ((1.0, 0.01, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def ready() -> Tube:
    """A tube that knows its bias, at rest."""
    one = tube()
    one.state["mode"], one.state["yaw_known"] = TRACKING, 1
    return one


def told(one: Tube) -> list[tuple[str, dict[str, Any]]]:
    """Events that wait to be said."""
    return [(event.code, dict(event.arguments)) for event in one.say(SAY_EVENTS, 100.0, AROUND)]


@pytest.mark.parametrize("times", [1, 2])
def test_an_alignment_is_dropped_at_an_order_and_that_is_told(times: int) -> None:
    one = ready()
    for _ in range(times):
        one.node["mount"]["method"], one.node["mount"]["axis"][0] = 1, (0.02, -0.03, 0.9993)
        assert one.alignment["method"] != "none"
        assert one.align("none", 0.0) == ""
        assert one.node["mount"]["method"] == 0
        assert one.alignment["method"] == "none"
        assert told(one) == [("alignment_dropped", {"reason": "ordered"})]


def test_why_an_alignment_is_refused_is_said_the_gravest_first() -> None:
    one = ready()
    one.state["mode"] = STATIC_BIAS
    one.node["guard"]["gyro"]["fault"] = 1
    one.state["now_rate"] = 1.0
    assert one.align("circle", 2.0) == "the static bias is not known yet"
    one.state["mode"] = TRACKING
    assert one.align("circle", 2.0) == "a sensor is faulty"
    one.node["guard"]["gyro"]["fault"], one.node["guard"]["force"]["fault"] = 0, 1
    assert one.align("circle", 2.0) == "a sensor is faulty"
    one.node["guard"]["force"]["fault"] = 0
    fastest = f"{math.degrees(FASTEST):g}"
    for rate in (1.0, -1.0):
        one.state["now_rate"] = rate
        assert one.align("circle", 2.0) == f"too fast: 57.3 deg/s, expected at most {fastest}"
    one.state["now_rate"] = np.nextafter(FASTEST, 1.0)
    assert one.align("circle", 2.0).startswith("too fast")
    one.state["now_rate"] = -FASTEST  # as fast as that is not too fast
    assert not one.align("circle", 2.0).startswith("too fast")
    assert one.node["aligner"]["method"] != 0  # and it is under way


def test_a_record_of_which_nothing_came_is_an_error_and_no_record() -> None:
    one = ready()
    assert one.start_record(4.0, 9).startswith("seconds: expected 5..3600, got 4.0")
    one.node["recording"]["sums"]["samples"] = 0
    (said,) = one.say(SAY_RECORD, 100.0, AROUND)
    assert isinstance(said, Event)
    assert (said.tube, said.code, said.severity, said.at, dict(said.arguments)) == (
        3, "static_record_empty", Severity.ERROR, AROUND.rig_now, {},
    )  # fmt: skip
    sums = one.node["recording"]["sums"]
    sums["samples"], sums["mean"], sums["scatter"] = 1000, np.arange(1.0, 7.0), np.eye(6)
    one.node["recording"]["begun"], one.node["recording"]["command"] = 90.0, 9
    (said,) = one.say(SAY_RECORD, 100.0, AROUND)
    assert isinstance(said, StaticRecord)
    assert (said.tube, said.command, said.samples) == (3, 9, 1000)
    assert (said.begun_at, said.ended_at) == (AROUND.rig_now - 10.0, AROUND.rig_now)
    assert (said.rate, said.force) == ((1.0, 2.0, 3.0), (4.0, 5.0, 6.0))


def test_what_is_to_be_said_is_said_in_its_order_and_nothing_else() -> None:
    one = ready()
    assert list(one.say(0, 100.0, AROUND)) == []
    one.node["recording"]["sums"]["samples"] = 0
    kinds = [type(said) for said in one.say(SAY_RECORD | SAY_SURVEY | SAY_STATE, 100.0, AROUND)]
    assert kinds == [Event, SurveyMeasurement, NodeState]


def test_a_survey_is_asked_for_again_by_what_the_filter_has_of_the_last() -> None:
    one = ready()
    one.state["surveyed"] = 1
    one.take_survey()
    assert one.state["surveyed"] == 0


def test_raw_readings_are_those_of_the_record_each_in_its_place() -> None:
    one = ready()
    one.node["raw_rate"], one.node["raw_force"], one.node["temperature"] = (1.0, 2.0, 3.0), (4.0, 5.0, 6.0), 31.5
    raw = one.raw
    assert isinstance(raw, ImuReading)
    assert (raw.rate, raw.force, raw.temperature) == ((1.0, 2.0, 3.0), (4.0, 5.0, 6.0), 31.5)
    assert math.isnan(raw.start)
    assert math.isnan(raw.end)


def sensor(matrix: Any = TURNED) -> SensorParameters:
    return SensorParameters(matrix=matrix, bias=(0.0, 0.0, 1e-4))


@pytest.mark.parametrize("times", [1, 2])
@pytest.mark.parametrize("gyroscope", [False, True])
@pytest.mark.parametrize("accelerometer", [False, True])
def test_of_another_block_that_is_forgotten_which_was_learnt_under_what_it_changes(
    gyroscope: bool, accelerometer: bool, times: int
) -> None:
    one = ready()
    changes: dict[str, Any] = {"gyroscope": sensor()} if gyroscope else {}
    changes |= {"accelerometer": sensor()} if accelerometer else {}
    block = ParameterBlock(3, 7, **changes)
    for k in range(times):
        one.node["mount"]["method"] = 1
        one.state["mode"], one.state["bias"][2], one.state["static_bias"][2] = TRACKING, 1e-3, 2e-3
        one.prepare(block)
        assert (one.node["mount"]["method"] == 0) == accelerometer, k
        reasons = [arguments["reason"] for code, arguments in told(one) if code == "alignment_dropped"]
        assert len(reasons) == accelerometer
        assert (one.state["mode"] == STATIC_BIAS) == gyroscope
        assert (one.state["static_bias"][2] == 0.0) == gyroscope


def test_an_alignment_under_way_ends_with_another_gyroscope() -> None:
    one = ready()
    one.node["aligner"]["method"] = 1
    one.prepare(ParameterBlock(3, 7, gyroscope=sensor()))
    ((code, arguments),) = [said for said in told(one) if said[0].startswith("alignment")]
    assert code == "alignment_refused"
    assert one.node["aligner"]["method"] == 0
    assert arguments["reason"] == "another block for the gyroscope"


def test_a_block_in_use_is_named_by_its_version_and_its_hash() -> None:
    one = ready()
    block = ParameterBlock(3, 12, gyroscope=sensor())
    one.state["smoothing"] = 1
    one.use(block)
    assert one.parameters is block
    assert one.state["smoothing"] == 0
    (said,) = one.say(SAY_STATE, 100.0, AROUND)
    assert isinstance(said, NodeState)
    assert (said.parameters_version, said.parameters_hash) == (12, block.sha256()[:SHORT_HASH])
    np.testing.assert_array_equal(one._corrections["gyroscope"]["matrix"][0][0], np.array(TURNED))
    np.testing.assert_array_equal(one._corrections["gyroscope"]["matrix"][1][0], np.eye(3))  # the IMU's own stays


def announced(**parts: Any) -> list[tuple[Any, ...]]:
    """What a process tells of its start."""
    process: Any = TubeProcess.__new__(TubeProcess)
    said: list[tuple[Any, ...]] = []
    given = {
        "_announced": False, "_counter_fault": "", "_cut": False, "_fallback": "",
        "_saver": SimpleNamespace(fault="", carried=None), "endpoint": SimpleNamespace(counters={"bad_saved_state": 0}),
        "tube": SimpleNamespace(boot_event=lambda rig_now: ("start", rig_now), parameters=ParameterBlock(3, 4)),
        "_send": lambda message, now: said.append((*message, now)),
        "_send_event": lambda severity, code, arguments: said.append((severity, code, arguments)),
    }  # fmt: skip
    for name, part in (given | parts).items():
        setattr(process, name, part)
    process._announce(5000.0, 12.0)
    process._announce(5001.0, 13.0)  # once alone
    return said


BOOT = ("start", 5000.0, 12.0)


@pytest.mark.parametrize(
    ("parts", "expected"),
    [
        ({}, []),
        (
            {"_saver": SimpleNamespace(fault="x" * 300, carried=None)},
            [(Severity.ERROR, "saved_state_lost", {"detail": "x" * 200})],
        ),
        (
            {"_saver": SimpleNamespace(fault="", carried=CarriedState("older", 17, 5))},
            [(Severity.INFO, "saved_state_carried", {"layout": "older", "carried": 17, "new": 5})],
        ),
        ({"_counter_fault": "y" * 300}, [(Severity.ERROR, "boot_counter_lost", {"detail": "y" * 200})]),
        (
            {"endpoint": SimpleNamespace(counters={"bad_saved_state": 1})},
            [(Severity.ERROR, "saved_state_lost", {"detail": "of the telemetry: not as it was written"})],
        ),
        ({"_cut": True}, [(Severity.WARNING, "alignment_refused", {"reason": "the power was cut"})]),
        (
            {"_fallback": "z" * 300},
            [
                (
                    Severity.ERROR,
                    "parameters_fallback",
                    {"detail": "z" * 200, "in_use": 4, "hash": ParameterBlock(3, 4).sha256().hex()},
                )
            ],
        ),
    ],
)
def test_a_start_is_told_once_with_what_was_found_on_the_disk(parts: dict[str, Any], expected: list[Any]) -> None:
    assert announced(**parts) == [BOOT, *expected]


@pytest.mark.parametrize(
    ("by", "jump"), [(3.5, 3.5), (-3.5, 3.5), (2.0 * MAX_CLOCK_STD, MAX_CLOCK_STD), (-1e9, MAX_CLOCK_STD), (2, 2)]
)
def test_a_clock_is_doubted_by_what_it_jumped_up_to_an_hour(by: float, jump: float) -> None:
    assert jump_of(Event(3, 1, 5.0, Severity.WARNING, "clock_jumped", {"by_s": by})) == jump
    assert jump_of(Event(3, 1, 5.0, Severity.WARNING, "clock_jumped", {})) == MAX_CLOCK_STD
    assert jump_of(Event(3, 1, 5.0, Severity.WARNING, "clock_jumped", {"by_s": "much"})) == MAX_CLOCK_STD


def test_silent_tubes_are_told_when_they_change_and_who_is_heard_again_once() -> None:
    process: Any = TubeProcess.__new__(TubeProcess)
    said: list[tuple[Any, ...]] = []
    neighbours: dict[Side, int | None] = {Side.UPPER: 5}
    process.settings, process._skipped = SimpleNamespace(tube=2), 0
    process.endpoint = SimpleNamespace(skipped=0, place=SimpleNamespace(neighbours=neighbours))
    process._send_event = lambda severity, code, arguments: said.append((severity, code, arguments))
    for skipped, neighbour in ((0, 3), (1, 4), (1, 4), (2, 5), (2, None), (0, None), (0, 3), (0, 3)):
        process.endpoint.skipped, neighbours[Side.UPPER] = skipped, neighbour
        process._tell_of_silent_tubes()
    assert said == [
        (Severity.WARNING, "tube_silent", {"tube": 3, "tubes": 1}),
        (Severity.WARNING, "tube_silent", {"tube": 3, "tubes": 2}),
        (Severity.INFO, "tube_heard_again", {"tube": 3}),
    ]
