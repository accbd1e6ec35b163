"""What the encoder at the drive head measures in every cycle: samples of its counter, through the node's kernel."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable

import numpy as np
import numpy.typing as npt

from node.firmware.edge_interpolation import EDGES, stopped_at
from node.firmware.encoder_node import STOP_STD
from node.firmware.torque import drive_record
from node.kernels.record.node_record import A_SEQUENCE, AIDING
from node.kernels.string.encoder_step import (
    BEYOND,
    BEYOND_VAR,
    COUNT,
    EDGE_AT,
    HAS_TORQUE,
    NOW,
    RISING,
    SAMPLE,
    TIMED,
    TORQUE,
    encoder_step,
    new_encoder,
)
from sim.kernel import kernel
from sim.string.plain_encoder import PlainEncoder
from sim.world.world import World
from telemetry.messages import Aiding

Array = npt.NDArray[np.float64]


def measure_head(world: World) -> Array:
    """What the encoder of a world measures in every cycle, (cycles, AIDING)."""
    encoder = world.scenario.file.encoder
    if not encoder.edge_times:
        return measure_counts(world, PlainEncoder(encoder.counts_per_turn))
    return measure_samples(world, *(turning_samples(world) if turns_one_way(world) else all_samples(world)))


def turns_one_way(world: World) -> bool:
    """Whether the head is never free of the string, only turns forward, and the drive has no sensor of its torque."""
    file = world.scenario.file
    rigid = file.torsion is None or file.node.torsion == "ignore"
    return file.rough is None and rigid and not world.disc.is_freed


def turning_samples(world: World) -> tuple[Array, Callable[[int], Iterable[float]]]:
    """Samples and edges of a head that ``turns_one_way``, as ``measure_samples`` takes them, all cycles at once."""
    ends, disc = world.ends, world.disc
    counts = disc.counts(ends)
    samples = np.zeros((len(ends), SAMPLE))
    samples[:, COUNT], samples[:, NOW] = counts, ends
    samples[:, RISING] = samples[:, TIMED] = 1.0
    samples[:, EDGE_AT] = np.minimum(disc.times_of(counts), ends)
    samples[ends <= world.motion.begin, EDGE_AT] = world.begin
    return samples, lambda cycle: disc.times_of(counts[cycle] - np.arange(1, EDGES)).tolist()


def all_samples(world: World) -> tuple[Array, Callable[[int], Iterable[float]]]:
    """Samples and edges of any head, as ``measure_samples`` takes them, cycle by cycle."""
    samples, edges = np.zeros((world.cycles, SAMPLE)), []
    for sample, end in zip(samples, world.ends.tolist(), strict=True):
        count, edge_at, rising, torque, before = world.encoder_sample(end)
        sample[[COUNT, EDGE_AT, RISING, TIMED, NOW]] = count, edge_at, rising, 1.0, end
        sample[TORQUE], sample[HAS_TORQUE] = torque or 0.0, torque is not None
        edges.append(before)
    return samples, edges.__getitem__


def measure_samples(world: World, samples: Array, edges_before: Callable[[int], Iterable[float]]) -> Array:
    """What the firmware of the encoder makes of samples (cycles, SAMPLE): (cycles, AIDING).

    Parameters
    ----------
    samples : without what is known of where inside its count the head stopped, which is added
    edges_before : times (s) of the edges before the last one of a cycle's sample, newest first
    """
    resting = ~(np.diff(samples[:, EDGE_AT], prepend=math.inf) > 0.0)
    for cycle in np.flatnonzero(resting & ~np.concatenate([[False], resting[:-1]])).tolist():  # the first of each rest
        edges = (float(samples[cycle, EDGE_AT]), *edges_before(cycle))
        samples[cycle, BEYOND : BEYOND_VAR + 1] = stopped_at(edges, STOP_STD)
    rows = np.zeros((len(samples), AIDING))
    torque = world.torque_settings()
    measure_cycles(new_encoder(0, torque.drilling), drive_record(torque), samples, rows)
    return renumber_measurements(world, rows)


def measure_counts(world: World, encoder: PlainEncoder) -> Array:
    """What an encoder without times of its edges measures, (cycles, AIDING)."""
    heads = (world.motion.drive(world.ends)[0] - world.scenario.file.told.north).tolist()
    measured = [encoder.on_cycle(head, end) for head, end in zip(heads, world.ends.tolist(), strict=True)]
    return renumber_measurements(world, np.array([row_of_aiding(aiding) for aiding in measured]))


def renumber_measurements(world: World, rows: Array) -> Array:
    """Measurements (cycles, AIDING), each with a number of its own where the scenario has it so."""
    if world.scenario.file.aiding.renumbered:
        rows[:, A_SEQUENCE] = np.arange(len(rows))
    return rows


def row_of_aiding(aiding: Aiding) -> tuple[float, ...]:
    """An aiding as ``node_aiding`` takes it, (AIDING,)."""
    a = aiding
    above = (a.yaw, a.yaw_var, a.systematic_var, a.offset, a.rate, a.valid_at, a.sequence, a.hops)
    return (*above, a.torque, a.torsion_var, a.under_torque, 0.0)


@kernel
def measure_cycles(encoders: Array, drives: Array, samples: Array, rows: Array) -> None:
    """Every cycle of an encoder node: ``samples`` (cycles, SAMPLE) in, ``rows`` (cycles, AIDING) out."""
    for cycle in range(samples.shape[0]):
        encoder_step(encoders, drives, samples[cycle], rows[cycle])
