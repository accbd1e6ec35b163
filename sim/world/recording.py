"""A world recorded for every node of a string: what nodes with clocks of their own play by the clock."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt

from node.kernels.arithmetic.formats import PERIOD
from sim.world.marks import wrap_angle
from sim.world.scenario import scenario_of
from sim.world.world import World
from telemetry.messages import ENCODER

Array = npt.NDArray[np.float64]
ROWS_A_CYCLE = 4
SHORTEST_REST, SHORTEST_STOP = 10.0, 30.0  # s, that a scenario allows


def record_sensors(world: World, folder: Path) -> None:
    """Write ``encoder.npy`` and ``tube-N.npy`` for every tube, in the times of their own clocks (``timed:FILE``)."""
    step = PERIOD / ROWS_A_CYCLE
    ends = world.begin + step * np.arange(1.0, (world.end - world.begin) / step)
    np.save(folder / "encoder.npy", encoder_rows(world, ends))
    for tube in range(1, world.scenario.tubes + 1):
        clock = np.array([world.local_clock(tube, end) for end in ends.tolist()])
        np.save(folder / f"tube-{tube}.npy", np.column_stack([clock, world.sensors.readings(tube, ends, step)]))


def encoder_rows(world: World, ends: Array) -> Array:
    """Rows of the encoder's counter at rig times ``ends`` (n,): time, count, last edge, 1, the edges before."""
    rows = []
    for end in ends.tolist():
        count, edge_at, rising, _, earlier = world.encoder_sample(end)
        rows.append([world.local_clock(ENCODER, end), count, edge_at, rising, *earlier])
    return np.array(rows, float)


def turning_once(
    tubes: int, begin: float, rest: float, turning: float, length: float, seed: int, clock_std: float
) -> World:
    """A complete string that rests, turns once and rests, in the time of this machine's clock.

    Parameters
    ----------
    tubes : number of them
    begin : s, encoder's clock
    rest, turning, length : s, at rest before the turning, of the turning, and of all
    seed : of every draw
    clock_std : s, of a node's clock against the encoder's
    """
    rate_dps, acceleration_dps2 = 71.0, 35.0
    ramp = rate_dps / acceleration_dps2
    level = max(turning - ramp, 0.2 * turning)
    held = max(rest, SHORTEST_REST)
    return World(
        scenario_of(
            {
                "rig": {"tubes": tubes, "tubes_at_start": tubes, "tube_length_m": 1.0},
                "path": {"straight": {"inclination_deg": 2.0}},
                "schedule": {"begin_s": begin, "add_s": held, "stop_s": max(length - held, SHORTEST_STOP), "blocks": 1},
                "rotation": {"turns": level * rate_dps / 360.0, "rate_dps": rate_dps},
                "clocks": {"offset_std_s": clock_std, "drift_std_ppm": 0.0},
            }
        ),
        seed,
    )


def fastest_at(world: World, at: float) -> float:
    """Fastest rate of the drive (rad/s) at the rig time ``at`` (s) and within the two cycles before it."""
    return float(np.abs(world.motion.drive(np.linspace(at - 2.0 * PERIOD, at, 3))[1]).max())


def yaw_error(world: World, tube: int, yaw: float, at: float) -> float:
    """What a yaw (rad) stated for the rig time ``at`` (s) is off, rad, beside the constant errors of the marks."""
    return wrap_angle(yaw - world.yaw_truth(tube, at) - world.systematic_error(tube, at))
