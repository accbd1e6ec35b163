"""A tube that lies and whose gravity is wrong about its axis: righted at the begin of a rest, whatever the angle."""

from __future__ import annotations

import math

import numpy as np
import pytest

from node.kernels.record.filter_record import Err
from sim.string.direct_string import DirectString
from sim.studies.field.cases import BLOCKS
from sim.studies.field.run import chosen_cases
from sim.world.scenario import scenario_of
from sim.world.world import World


def turned_about_axis(down: np.ndarray, by: float) -> None:
    c, s = math.cos(by), math.sin(by)
    down[0], down[1] = c * down[0] - s * down[1], s * down[0] + c * down[1]


def off_about_axis(string: DirectString) -> float:
    """Angle (deg) about the axis from gravity as the filter has it to where the accelerometer feels it."""
    down, force = string.nodes[0]["filter"]["now_down"], string.nodes[0]["force"]
    felt, known = math.atan2(-force[1], -force[0]), math.atan2(down[1], down[0])
    return math.degrees(math.remainder(felt - known, math.tau))


@pytest.mark.slow
@pytest.mark.parametrize("by_deg", [2.0, -8.0, 60.0, 175.0])
def test_gravity_that_is_off_about_the_axis_is_righted_at_a_stop(by_deg: float) -> None:
    world = World(scenario_of(dict(chosen_cases("clean-88")[0].setup)), 3)
    string = DirectString(world, state_every=1)
    drilled = next(phase for phase in world.phases if phase.kind == "drill")
    for cycle in string.steps():
        if cycle == int(np.searchsorted(world.ends, drilled.end - 10.0)):
            for name in ("down", "now_down"):
                turned_about_axis(string.nodes[0]["filter"][name], math.radians(by_deg))
        if cycle == int(np.searchsorted(world.ends, drilled.end + 5.0)):
            assert abs(off_about_axis(string)) < 0.3
            bias = np.degrees(string.nodes[0]["filter"]["bias"])
            assert np.abs(bias).max() < 0.06
            assert np.degrees(np.sqrt(string.nodes[0]["filter"]["P"][Err.TILT_X, Err.TILT_X])) < 1.0
    assert len(string.run.surveys) == BLOCKS
    assert not {"gyro_step", "gyro_scale", "bias_moved"} & {event.code for _, event in string.run.events}


@pytest.mark.slow
def test_a_tube_that_lies_and_whose_tilt_was_lost_is_levelled_about_its_axis() -> None:
    world = World(scenario_of(dict(chosen_cases("clean-88")[0].setup)), 3)
    string = DirectString(world, state_every=1)
    state = string.nodes[0]["filter"]
    for cycle in string.steps():
        if cycle == 60:
            for name in ("down", "now_down"):
                turned_about_axis(state[name], math.radians(3.3))
            state["P"][Err.TILT_X], state["P"][:, Err.TILT_X] = 0.0, 0.0
            state["P"][Err.TILT_Y], state["P"][:, Err.TILT_Y] = 0.0, 0.0
            state["P"][Err.TILT_X, Err.TILT_X] = state["P"][Err.TILT_Y, Err.TILT_Y] = 1.0
        if cycle == 70:
            assert abs(off_about_axis(string)) < 0.3
            break
