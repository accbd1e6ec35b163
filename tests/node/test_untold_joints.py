"""A joint whose angle was not told: the node says so, and the variance of what it hands down is that of any yaw."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from click.testing import CliRunner
from test_tube import AIDING, NOISELESS, Life

from node.firmware.silent_tubes import aiding_across_silent
from node.firmware.tube import Tube
from node.firmware.tube_settings import UNTOLD, Kernel, MakeUpAngle, PassedTube, TubeSettings
from node.kernels.record.filter_record import default_config
from node.kernels.record.node_record import new_node
from node.process.tube_options import TubeRequest, tube_options
from telemetry.frozen import replace
from telemetry.messages import Aiding, NodeFlag, NodeState, SurveyMeasurement
from telemetry.presentation.msgpack_codec import decode_message, encode_message

ANY_YAW = math.pi**2 / 3.0  # rad^2, second moment of an angle that is uniform on the circle
TOLD = MakeUpAngle(0.3, 1e-3)


def tube(number: int, drive: MakeUpAngle, lower: MakeUpAngle, kernel: Kernel = "float64") -> Tube:
    config = default_config()
    settings = TubeSettings(number, drive, lower, limits=NOISELESS, kernel=kernel)
    return Tube(settings, config, new_node(config), itertools.count(1).__next__, restored=False)


def test_any_angle_has_the_second_moment_of_a_circle() -> None:
    angles = np.linspace(-math.pi, math.pi, 1_000_001)
    assert UNTOLD.std**2 == pytest.approx(float(np.mean(angles**2)), rel=1e-5)
    assert not UNTOLD.is_told
    assert MakeUpAngle(0.0, 0.05).is_told


@pytest.mark.parametrize("kernel", ["float64", "fixed"])
def test_a_string_of_any_length_hands_down_what_a_message_can_say(kernel: Kernel) -> None:
    """Of sixty joints that were not told the sum would be twice what the wire takes; the angle is no more unknown."""
    aiding: Aiding = AIDING
    for number in range(60, 0, -1):
        onward = tube(number, UNTOLD, UNTOLD, kernel).on_aiding(aiding, 1000.0)
        assert onward is not None
        assert onward.systematic_var == pytest.approx(ANY_YAW, rel=1e-9)
        aiding = onward
    assert decode_message(encode_message(aiding)) == aiding


def test_what_was_told_is_handed_down_as_before_and_added_to_what_was_not() -> None:
    told = tube(3, TOLD, TOLD).on_aiding(AIDING, 1000.0)
    assert told is not None
    assert told.systematic_var == pytest.approx(2e-6, rel=1e-9)
    below = tube(2, UNTOLD, TOLD).on_aiding(replace(told, hops=1), 1000.0)
    assert below is not None
    assert below.systematic_var == pytest.approx(3e-6, rel=1e-9)  # its own joint to the drive head is not in the chain


def test_over_the_heads_of_silent_tubes_it_is_bounded_too() -> None:
    across = aiding_across_silent(AIDING, [PassedTube(UNTOLD, UNTOLD)] * 3, math.inf)
    assert across.systematic_var == pytest.approx(ANY_YAW)


@pytest.mark.parametrize(
    ("number", "drive", "lower", "hops", "expected"),
    [
        (3, TOLD, TOLD, 1, NodeFlag.NONE),
        (3, UNTOLD, TOLD, 1, NodeFlag.DRIVE_UNTOLD),
        (3, UNTOLD, TOLD, 2, NodeFlag.NONE),  # it does not hang from the drive head
        (3, TOLD, UNTOLD, 2, NodeFlag.LOWER_UNTOLD),
        (1, TOLD, UNTOLD, 2, NodeFlag.NONE),  # the lowest has no tube below
        (3, UNTOLD, UNTOLD, 1, NodeFlag.DRIVE_UNTOLD | NodeFlag.LOWER_UNTOLD),
    ],
)
def test_states_and_surveys_carry_what_was_not_told(
    number: int, drive: MakeUpAngle, lower: MakeUpAngle, hops: int, expected: NodeFlag
) -> None:
    life = Life(tube(number, drive, lower))
    life.hops = hops
    life.cycles(120)
    life.cycles(60, rate=0.5)
    life.cycles(80)
    said = [one for one in life.said if isinstance(one, NodeState | SurveyMeasurement)]
    untold = NodeFlag.DRIVE_UNTOLD | NodeFlag.LOWER_UNTOLD
    assert {one.flags & untold for one in said} == {expected}
    assert any(isinstance(one, SurveyMeasurement) for one in said)
    is_wide = said[-1].systematic_var > ANY_YAW - 1e-9
    assert is_wide == (not drive.is_told)  # aiding comes from the drive head here, whatever is said of hops


def test_an_option_that_is_left_out_is_an_angle_that_was_not_told() -> None:
    import click

    made: list[TubeRequest] = []

    @click.command()
    @tube_options
    def command(request: TubeRequest, **_more: object) -> None:
        made.append(request)

    assert CliRunner().invoke(command, ["--tube", "3"]).exit_code == 0
    assert CliRunner().invoke(command, ["--tube", "3", "--drive-joint-deg", "0"]).exit_code == 0
    assert made[0].to_settings().drive_joint == made[0].to_settings().lower_joint == UNTOLD
    assert made[1].to_settings().drive_joint == MakeUpAngle(0.0, math.radians(0.05))
