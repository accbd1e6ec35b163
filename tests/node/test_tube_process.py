"""A tube's process over its lives: what it saves, what it forgets, and that nothing it says can end it."""

import math
from pathlib import Path

import pytest

from node.firmware.settings import Joint, TubeSettings
from node.kernels.layout import PERIOD
from node.process.tube_process import TubeProcess
from telemetry.application.clock import ClockFilter
from telemetry.messages import Aiding, Side
from telemetry.schema import VARIANCE

REST = (0.0, 0.0, 0.0, 0.0, 0.3, -9.8)


def cycles(process: TubeProcess, count: int, start: float = 1000.0) -> float:
    now = start
    for _ in range(count):
        now += PERIOD
        process.on_cycle([now - PERIOD, *REST], now)
        process.take_frames(now)
    return now


def test_a_later_life_goes_on_with_bias_and_numbers(tmp_path: Path) -> None:
    first = TubeProcess(TubeSettings(3), tmp_path)
    now = cycles(first, 120)
    second = TubeProcess(TubeSettings(3), tmp_path)
    assert second.boots == first.boots + 1
    assert second.state[0]["mode"] == first.state[0]["mode"]
    assert second.endpoint.new_sequence() >= first.endpoint.outbox_size + 1
    assert second.endpoint.outbox_size == first.endpoint.outbox_size > 0
    cycles(second, 5, now + 30.0)


def test_damaged_slots_are_told_and_the_node_begins_anew(tmp_path: Path) -> None:
    cycles(TubeProcess(TubeSettings(3), tmp_path), 120)
    for slot in tmp_path.glob("slot-*"):
        slot.write_bytes(b"damaged")
    again = TubeProcess(TubeSettings(3), tmp_path)
    assert again.boots == 2
    assert not again.state[0]["static_bias_var"].any()


@pytest.mark.parametrize("wild", [math.nan, math.inf, 1e300])
def test_no_reading_and_no_frame_ends_the_process(tmp_path: Path, wild: float) -> None:
    process = TubeProcess(TubeSettings(3), tmp_path)
    now = cycles(process, 3)
    for k in range(6):
        sample = [now, *REST]
        sample[1 + k] = wild
        now += PERIOD
        process.on_cycle(sample, now)
        process.on_frame(Side.UPPER, b"garbage", now)
        process.take_frames(now)
    cycles(process, 110, now)
    assert process.state[0]["mode"] != 0


def test_an_aiding_that_grew_beyond_what_can_be_said_is_not_handed_on(tmp_path: Path) -> None:
    process = TubeProcess(TubeSettings(3, lower_joint=Joint(0.0, 0.1)), tmp_path)
    process.endpoint.clock = ClockFilter(is_root=True)
    now = cycles(process, 110)
    for var, unsayable in ((1e-4, 0), (VARIANCE, 1)):
        process._on_aiding(Aiding(1.0, 1e-9, var, 0.0, 0.0, now, int(1 / var), 1), now)
        assert process.endpoint.counters["unsayable"] == unsayable
    cycles(process, 3, now)
    assert process.state[0]["yaw_known"]
