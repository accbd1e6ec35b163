"""A chip whose readings come late, as on a machine that is busy: no turning is lost, and every yaw holds its sigma."""

from __future__ import annotations

import ctypes
import math
from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest
from chip_board import next_due, window_begin
from chip_in_process import wrapped
from chip_rig import OFFSET, Rig
from needed_programs import needs_gcc

from node.kernels.arithmetic.formats import PERIOD
from telemetry.messages import NodeFlag, NodeState

UNFIT = NodeFlag.YAW_UNTRUSTED | NodeFlag.CLOCK_UNSYNCHRONISED
RATE, ACCELERATION = math.radians(71.0), math.radians(35.0)  # of the head
RAMP = RATE / ACCELERATION  # s
TURNING, EVERY = 20.0, 60.0  # s, of a turn, from turn to turn
TURNS = 3
MOST_LATE = 0.2  # s
pytestmark = [needs_gcc, pytest.mark.slow]


def turned(at: float) -> float:
    """Angle of a head (rad) that rests, turns at an even rate between two ramps, and rests again."""
    whole, since = divmod(max(at, 0.0), EVERY)
    since -= EVERY - TURNING
    up, level = min(max(since, 0.0), RAMP), min(max(since - RAMP, 0.0), TURNING - 2.0 * RAMP)
    down = min(max(since - TURNING + RAMP, 0.0), RAMP)
    total = RATE * (TURNING - RAMP)
    return whole * total + 0.5 * ACCELERATION * up**2 + RATE * level + RATE * down - 0.5 * ACCELERATION * down**2


def rate_about(at: float) -> float:
    """Fastest rate (rad/s) within the two cycles before a time."""
    times = np.linspace(at - 2.0 * PERIOD, at, 9)
    return max(abs(turned(b) - turned(a)) / (b - a) for a, b in pairwise(times.tolist()))


def drill_late(rig: Rig, lateness: Callable[[], float], line: float) -> None:
    """Some turns of a string whose sensor is read late, by less than what costs a cycle; the line is so slow (s)."""
    world, begun = rig.world, rig.world.now
    due, ended = begun + PERIOD, begun

    def late_cycle() -> None:
        nonlocal due, ended
        read_at = due + lateness()
        world.run(max(read_at - world.now, 0.0))
        begin = window_begin(ended, world.now)
        mean = (turned(world.now - begun) - turned(begin - begun)) / (world.now - begin)
        ended, due, marked_us = world.now, next_due(due, world.now), world.now_us
        world.run(line)
        noise = world.random.normal(0.0, 1.0, 6)
        force = (3e-3 * noise[3], 0.34 + 3e-3 * noise[4], -9.8 + 3e-3 * noise[5])
        rig.chip.read_sensor((*(1e-4 * noise[:2]), mean + 1e-4 * noise[2]), force, marked_us)
        rig.yaw = 1.0 + turned(world.now - begun)
        world.after_cycle(world.now)

    world.cycle_due_us = 1 << 62  # the sensor is read here
    while world.now < begun + TURNS * EVERY + 10.0:
        late_cycle()


@pytest.mark.parametrize(("seed", "line"), [(0, 0.0), (2, 0.0), (4, 0.0), (0, 0.1)])
def test_no_turning_is_lost_and_every_yaw_holds_its_sigma(
    library: ctypes.CDLL, image: bytes, seed: int, line: float
) -> None:
    random = np.random.default_rng(seed)
    rig = Rig(library, image)
    begun = rig.world.now
    drill_late(rig, lambda: float(random.uniform(0.0, MOST_LATE)) if random.random() < 0.3 else 0.0, line)
    states = [state for state in rig.heard(NodeState) if not state.flags & UNFIT]
    assert len(states) > 120
    for state in states:
        at = state.at - begun
        error = wrapped(state.yaw - 1.0 - OFFSET - turned(at))
        rate = rate_about(at)
        doubt = math.sqrt(state.yaw_var + state.systematic_var + rate * rate * state.clock_var)
        assert abs(error) < 5.0 * doubt + 0.002, (at, state)
    assert rig.world.now - begun > TURNS * EVERY
