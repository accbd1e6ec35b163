"""Two suppliers of what the nodes of a string read: arrays worked out before, and draws inside the loop.

Either fills the readings of all tubes in a cycle and takes their hops on, so that ``sim.string.drill`` is one for both.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from node.kernels.arithmetic.formats import PERIOD, Array
from node.kernels.record.node_record import BEHIND, LATE, LATE_STD, READING, SATURATED, SPLIT, TEMPERATURE
from node.kernels.sensors.correction import USUAL
from sim.kernel import shared_body
from sim.string.hops import cross_hop, record_hops
from sim.world.disturbance.lanes import CLOCK, draw_further, draw_numbers
from sim.world.disturbance.sensor_reading import DRAWN, LOSS, read_frames, read_sensors
from sim.world.motion import Motion
from sim.world.scenario import Scenario
from sim.world.truth import TubeTruth
from sim.world.world import World


class RecordedReadings(NamedTuple):
    """What the nodes of one seed read, worked out before."""

    readings: Array  # (cycles, tubes, IMUs, READING)
    errors: Array  # (cycles, hops) s, of rig time below each joint
    losses: npt.NDArray[np.bool_]  # (cycles, hops) whether an aiding is lost there


class FeltTruth(NamedTuple):
    """What perfect sensors read with the head at 0 and joints of 0, means over cycles; the same for all seeds.

    The joints and the head's first angle turn a tube's frame about its axis by a constant angle.
    """

    rate: Array  # (cycles, tubes, 3) rad/s
    force: Array  # (cycles, tubes, 3) m/s^2, without the circle about the axis
    circle: Array  # (cycles, 2) m/s^2, that circle, in the frame of the IMU
    shaken: Array  # (cycles,) 1 while the bit shakes the string


class DrawnReadings(NamedTuple):
    """What the readings of one seed are drawn from, cycle by cycle."""

    key: Array  # (2,) of the run, see ``sim.world.disturbance.philox``
    counter: Array  # (4,) uint64, likewise
    words: Array  # (4,) uint64
    numbers: Array  # (DRAWN,) of a tube and cycle
    readings: Array  # (tubes, 1, READING) of a cycle
    shared: Array  # (1,) of dtype ``SHARED`` of ``sim.world.disturbance.records``
    tubes: Array  # (tubes,) of dtype ``TUBE``, likewise
    hop_noise: Array  # (1,) of dtype ``sim.string.hops.HOP_NOISE``
    felt: FeltTruth


def record_readings(world: World) -> RecordedReadings:
    """All readings of a world's tubes and what its hops do."""
    file, sensors = world.scenario.file, world.sensors
    readings = np.zeros((world.cycles, world.scenario.tubes, file.node.imus, READING))
    readings[..., TEMPERATURE] = USUAL
    for place, imu in np.ndindex(readings.shape[1:3]):
        tube, rows = place + 1, readings[:, place, imu]
        rows[:, :TEMPERATURE] = sensors.samples(tube, imu)
        if file.rough is not None:
            found = sensors.rough_cycles(tube, imu)
            rows[:, TEMPERATURE], rows[:, SATURATED] = found.temperature, found.clipped
            rows[:, LATE], rows[:, LATE_STD] = found.late, found.late_std
        if (parts := sensors.parts(tube, imu)) is not None:
            known = np.isfinite(parts[:, 0])
            rows[:, SPLIT] = known
            rows[known, BEHIND:] = parts[known]
    return RecordedReadings(readings, *record_hops(world))


def new_readings(seed: int, shared: Array, tubes: Array, hop_noise: Array, felt: FeltTruth) -> DrawnReadings:
    """What the readings of a seed are drawn from, see ``DrawnReadings``."""
    return DrawnReadings(
        key=np.array([seed & 0xFFFFFFFF, seed >> 32], np.uint64),
        counter=np.zeros(4, np.uint64),
        words=np.zeros(4, np.uint64),
        numbers=np.zeros(DRAWN),
        readings=np.zeros((len(tubes), 1, READING)),
        shared=shared,
        tubes=tubes,
        hop_noise=hop_noise,
        felt=felt,
    )


def felt_by(scenario: Scenario, motion: Motion, ends: Array) -> FeltTruth:
    """What perfect sensors read of the ``motion`` of a head that starts at 0, over cycles that end at ``ends`` (s).

    Of a rough world nothing: its nodes feel what ``sim.world.disturbance.frame_sums`` has.
    """
    count, a = scenario.tubes, scenario.file.accelerometer
    turns = (motion.drive(ends)[1] > 0.0) | (motion.drive(ends - PERIOD)[1] > 0.0)
    if scenario.file.rough is not None:
        return FeltTruth(np.zeros((0, count, 3)), np.zeros((0, count, 3)), np.zeros((0, 2)), turns.astype(float))
    depths = (scenario.file.told.below(tube, scenario.tube_length) for tube in range(1, count + 1))
    truths = [TubeTruth(scenario.hole, motion, depth, 0.0, 0.0, a.gravity_mps2) for depth in depths]
    rates, forces = zip(*(truth.cycle_means(ends, PERIOD) for truth in truths), strict=True)
    around = TubeTruth(scenario.hole, motion, 0.0, 0.0, a.radius_m, a.gravity_mps2)
    circle = np.ascontiguousarray((around.cycle_means(ends, PERIOD)[1] - forces[0])[:, :2])
    return FeltTruth(np.stack(rates, axis=1), np.stack(forces, axis=1), circle, turns.astype(float))


@shared_body
def supply_readings(recorded: Any, drawn: Any, field: Any, schedule: Any, hops: Array, cycle: int) -> Array:
    """Take the hops (tubes,) of a string on to a cycle; returns what its tubes read then, (tubes, IMUs, READING).

    Parameters
    ----------
    recorded, drawn : ``RecordedReadings`` or ``DrawnReadings``; the other is None, and not compiled
    field : ``sim.world.disturbance.frame_sums.FrameField`` of a rough world whose readings are drawn, else None
    """
    if drawn is not None:
        draw_readings(drawn, field, schedule, hops, cycle)
        readings: Array = drawn.readings
    if recorded is not None:
        recall_hops(recorded, hops, cycle)
        readings = recorded.readings[cycle]
    return readings


@shared_body
def recall_hops(recorded: Any, hops: Array, cycle: int) -> None:
    """Set all hops (tubes,) to what was worked out of a cycle."""
    for hop in range(hops.shape[0]):
        hops[hop].error, hops[hop].loses = recorded.errors[cycle, hop], recorded.losses[cycle, hop]


@shared_body
def draw_readings(drawn: Any, field: Any, schedule: Any, hops: Array, cycle: int) -> None:
    """Draw the readings and the hops of all tubes of the string in a cycle."""
    # named before the loop over tubes, in which naming an array of a tuple costs as much as a sum
    felt, powered, end, later = drawn.felt, schedule.powered, schedule.ends[cycle], schedule.later
    rate, force, circle, shaken, numbers = felt.rate, felt.force, felt.circle, felt.shaken, drawn.numbers
    counter, key, words, readings, tubes = drawn.counter, drawn.key, drawn.words, drawn.readings, drawn.tubes
    shared, hop_noise = drawn.shared[0], drawn.hop_noise[0]
    for k in range(powered[cycle]):
        tube, reading, is_first = tubes[k], readings[k], cycle == 0 or powered[cycle - 1] <= k
        draw_numbers(counter, key, words, numbers, cycle, k)
        if field is not None:
            draw_further(counter, key, words, field.desk.drawn, cycle, k)
            read_frames(shared, tube, is_first, field, numbers, reading, end + later[k], cycle, k)
        else:
            read_sensors(
                shared, tube, is_first, rate, force, circle, shaken, numbers, reading, end + later[k], cycle, k
            )
        cross_hop(hop_noise, hops, k, is_first, numbers[CLOCK], numbers[LOSS])
