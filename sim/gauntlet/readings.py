"""Faults of what is measured: the nodes' sensors, the encoder, the depth of the bit."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from sim.gauntlet.fault import Draw, Faulty, Step, draw_interval, drawn_tube, lasting_fault
from sim.gauntlet.faulty_world import COUNTS, Reading
from telemetry.messages import ENCODER, DepthReading
from telemetry.presentation.msgpack_codec import encode_message


def spoil_sensor(spoil: Callable[[Reading], Reading]) -> Draw:
    """Draw of a fault that spoils the readings of a tube for a while."""

    def draw(random: np.random.Generator, begin: float, end: float) -> list[Step]:
        tube = drawn_tube(random)
        return lasting_fault(
            3.0,
            60.0,
            lambda rig: rig.world.spoilers.update({tube: spoil}),
            lambda rig: rig.world.spoilers.pop(tube, None) and None,
        )(random, begin, end)

    return draw


def gyro_stuck(reading: Reading) -> Reading:
    """Return the reading with a gyroscope that repeats itself."""
    return [0.1, 0.1, 0.1, *reading[3:]]


def gyro_saturated(reading: Reading) -> Reading:
    """Return the reading with a gyroscope at its range."""
    return [*reading[:2], 8.7266, *reading[3:]]


def gyro_saturated_below(reading: Reading) -> Reading:
    """Return the reading with a gyroscope at the other end of its range."""
    return [*reading[:2], -8.7266, *reading[3:]]


def gyro_step(reading: Reading) -> Reading:
    """Return the reading with a gyroscope bias changed by 3 deg/s."""
    return [*reading[:2], reading[2] + 0.052, *reading[3:]]


def gyro_scale(reading: Reading) -> Reading:
    """Return the reading with a gyroscope that reads 10 % too high."""
    return [*reading[:2], reading[2] * 1.1, *reading[3:]]


def force_stuck(reading: Reading) -> Reading:
    """Return the reading with an accelerometer that repeats itself."""
    return [*reading[:3], 1.0, 2.0, -9.0, *reading[6:]]


def force_saturated(reading: Reading) -> Reading:
    """Return the reading with an accelerometer at its range."""
    return [*reading[:3], -78.5, *reading[4:]]


OF_FORCE = (force_stuck, force_saturated)  # that leave a tube its gyroscope


def not_finite(reading: Reading) -> Reading:
    """Return the reading with non-finite values."""
    return [float("nan"), *reading[1:]]


def encoder_slips(random: np.random.Generator, begin: float, end: float) -> list[Step]:
    """Steps in which the encoder slips once, for the rest of the run."""
    at = float(random.uniform(begin, end))
    by = int(random.uniform(0.05, 0.45) * COUNTS) * (1 if random.random() < 0.5 else -1)
    return [Step(at, lambda rig: setattr(rig.world, "slipped", rig.world.slipped + by))]


def encoder_dead(random: np.random.Generator, begin: float, end: float) -> list[Step]:
    """Steps in which the encoder stops counting for a while."""

    def stop(rig: Faulty) -> None:
        rig.world.stuck_at = rig.now

    return lasting_fault(5.0, 60.0, stop, lambda rig: setattr(rig.world, "stuck_at", None))(random, begin, end)


def depth_off(metres: float) -> Draw:
    """Draw of a depth that is off by ``metres`` for a while."""
    return lasting_fault(
        2.0,
        60.0,
        lambda rig: setattr(rig.world, "depth_error", metres),
        lambda rig: setattr(rig.world, "depth_error", 0.0),
    )


def depth_lost(random: np.random.Generator, begin: float, end: float) -> list[Step]:
    """Steps in which no depth is measured for a while, or never again."""
    at, until = draw_interval(random, begin, end, 3.0, 60.0)
    steps = [Step(at, lambda rig: setattr(rig.world, "depth_hidden", True))]
    if random.random() < 0.7:
        steps.append(Step(until, lambda rig: setattr(rig.world, "depth_hidden", False)))
    return steps


def depth_backwards(random: np.random.Generator, begin: float, end: float) -> list[Step]:
    """Steps in which the depth runs backwards by 0.6 m/s, and is then right again."""
    at, until = draw_interval(random, begin, end, 3.0, 8.0)
    steps: list[Step] = []
    t, error = at, 0.0
    while t < until:
        steps.append(Step(t, lambda rig, e=error: setattr(rig.world, "depth_error", e)))  # type: ignore[misc]
        t, error = t + 0.5, error - 0.3
    return [*steps, Step(until, lambda rig: setattr(rig.world, "depth_error", 0.0))]


def depth_ahead(rig: Faulty, random: np.random.Generator) -> None:
    """Send a depth with a time in the future."""
    at = rig.world.local_clock(ENCODER, rig.now) + float(random.uniform(10.0, 1e4))
    rig.send_depth(
        encode_message(DepthReading(int(random.integers(1, 10**6)), at, float(random.uniform(0.0, 10.0)), ()))
    )
