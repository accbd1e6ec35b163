"""Numbers and places that all processes of a rig take alike: addresses, speeds, ends, deadlines, rounding."""

from __future__ import annotations

from typing import Any

import pytest

from telemetry.media.credentials import DEPTH_SOURCE
from telemetry.media.neighbours import stepped_ports
from telemetry.media.port import TubeEnd
from telemetry.media.serial_line import SPEEDS
from telemetry.messages import BASE, ENCODER, MAX_TUBE, Side
from telemetry.presentation.can_messages import Rounding
from telemetry.runtime.own_clock import Schedule


def test_addresses_are_those_that_seals_hold() -> None:
    """A source of the depth that is not changed at once goes on being believed."""
    assert (BASE, MAX_TUBE, ENCODER, DEPTH_SOURCE) == (251, 250, 0, 252)


def test_speeds_are_those_that_adapters_have() -> None:
    assert list(SPEEDS) == [9600, 115200, 230400, 460800, 921600, 1000000, 2000000, 3000000]
    assert len(set(SPEEDS.values())) == len(SPEEDS)


def test_each_side_of_a_stepped_process_has_its_end() -> None:
    class Medium:
        def open_port(self, end: TubeEnd) -> Any:
            return end

    found = stepped_ports(Medium(), "rig-7", 9, [Side.UPPER, Side.LOWER])  # type: ignore[arg-type]
    assert found == {side: TubeEnd("rig-7", 9, side, None) for side in (Side.UPPER, Side.LOWER)}


def test_deadlines_are_counted_from_the_beginning_and_those_that_were_missed_are_told() -> None:
    schedule = Schedule(10.0, 0.4)
    assert (schedule.due, schedule.halfway) == (pytest.approx(10.4), pytest.approx(10.2))
    assert schedule.finish(10.41) == 0
    assert (schedule.due, schedule.halfway) == (pytest.approx(10.8), pytest.approx(10.6))
    assert schedule.finish(11.7) == 2
    assert (schedule.due, schedule.halfway) == (pytest.approx(12.0), pytest.approx(11.8))
    assert schedule.finish(11.7) == 0
    assert schedule.due == pytest.approx(12.4)


@pytest.mark.parametrize(
    ("value", "rate", "expected"),
    [(1.5, None, 0.0), (-1.5, None, 0.0), (0.0, None, 0.0), (1.6, None, 0.25 / 12.0), (-1.6, None, 0.25 / 12.0),
     (1.6, 4.0, 4.0 / 12.0), (1.75, 4.0, 4.0 / 12.0), (1.5, 4.0, 0.0)],
)  # fmt: skip
def test_a_rounding_adds_a_twelfth_of_its_square_but_on_a_step(
    value: float, rate: float | None, expected: float
) -> None:
    rounding = Rounding(0, None if rate is None else 1, 2, 0, 0.5, round)
    assert rounding.added([value, rate, 0.0]) == pytest.approx(expected)
