"""Cycles that were lost: the yaw that is said next is not surer than the turn that no reading shows.

The oracle is the head's own angle in closed form: it speeds up evenly, turns evenly, and slows down evenly.
"""

import math

import numpy as np
import pytest

from node.firmware.inputs import ImuReading, RigContext
from node.firmware.tube import Tube
from node.firmware.tube_settings import TubeSettings
from node.kernels.record.filter_record import default_config
from node.kernels.record.node_record import new_node
from telemetry.messages import Aiding

PERIOD, G = 1.0 / 1.9, 9.81
SPEED, RAMP = math.radians(71.0), math.radians(35.0)
REST, DRIVEN = 110 * PERIOD, 30.0  # s; the last of these the head takes to stop


def angle_at(t: float) -> float:
    """Angle (rad) of a head that starts at ``REST`` s and rests again ``DRIVEN`` s later."""
    u, whole = min(max(t - REST, 0.0), DRIVEN), SPEED / RAMP
    up, down = min(u, whole), max(u - (DRIVEN - whole), 0.0)
    even = max(min(u, DRIVEN - whole) - whole, 0.0)
    return 1.0 + 0.5 * RAMP * up**2 + SPEED * even + SPEED * down - 0.5 * RAMP * down**2


def drill(kernel: str, lost: set[int], cycles: int) -> tuple[np.ndarray, np.ndarray]:
    """Errors and standard deviations (cycles,) rad, of what a node says after each cycle; NaN of those lost."""
    random, config = np.random.default_rng(4), default_config()
    count = iter(range(10**9)).__next__
    tube = Tube(TubeSettings(1, kernel=kernel), config, new_node(config), count, restored=False)
    error, std = np.full(cycles, math.nan), np.full(cycles, math.nan)
    for k in range(cycles):
        begin, end = k * PERIOD, (k + 1) * PERIOD
        rate, middle = (angle_at(end) - angle_at(begin)) / PERIOD, angle_at(0.5 * (begin + end))
        lean = math.radians(2.0)
        down = np.array([-math.sin(lean) * math.cos(middle), math.sin(lean) * math.sin(middle), math.cos(lean)])
        w = np.array([0.0, 0.0, rate]) + 1.6e-4 * random.standard_normal(3)
        f = -G * down + 3.4e-3 * random.standard_normal(3)
        if k not in lost:
            reading = ImuReading(1e3 + begin, 1e3 + end, tuple(w.tolist()), tuple(f.tolist()))
            tube.on_cycle(reading, RigContext(True, 1, 1e3 + end, 1e-8, True))
            error[k] = math.remainder(tube.yaw - angle_at(end), math.tau)
            std[k] = math.sqrt(tube.yaw_var + tube.systematic_var)
        turned = angle_at(end) - angle_at(begin)
        yaw = (angle_at(end) + 5e-5 * random.standard_normal()) % math.tau
        tube.on_aiding(Aiding(yaw, 2.7e-9, 0.0, 0.0, turned / PERIOD, 1e3 + end, k, 0), 1e3 + end)
    return error, std


@pytest.mark.parametrize("kernel", ["float64", pytest.param("fixed", marks=pytest.mark.slow)])
@pytest.mark.parametrize("place", ["speeding up", "turning", "slowing down"])
def test_a_yaw_is_not_surer_than_the_turn_of_a_lost_cycle(kernel: str, place: str) -> None:
    ramps = math.ceil(SPEED / RAMP / PERIOD)
    first = {
        "speeding up": round(REST / PERIOD),
        "turning": round((REST + 15.0) / PERIOD),
        "slowing down": math.floor((REST + DRIVEN) / PERIOD) - ramps,
    }[place]
    for lost in range(first, first + ramps + 1):
        error, std = drill(kernel, {lost}, lost + 12)
        after = np.abs(error[lost + 1 :]) / std[lost + 1 :]
        assert after.max() < 4.0, (lost, np.degrees(error[lost + 1 :]), np.degrees(std[lost + 1 :]))
        assert math.degrees(std[-1]) < 1.0, "and it is known again"


def test_where_no_cycle_is_lost_nothing_is_added() -> None:
    error, std = drill("float64", set(), 140)
    assert np.all(np.abs(error[110:]) < 4.0 * std[110:])
    assert np.degrees(std[115:]).max() < 0.2
