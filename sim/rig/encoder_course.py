"""What the encoder on a string that turns one way measures, all cycles at once."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable

import numpy as np
import numpy.typing as npt

from node.firmware.edge_interpolation import EDGES, stopped_at
from node.firmware.encoder_node import STOP_STD
from node.firmware.torque import drive_record
from node.kernels.arithmetic.jit import kernel
from node.kernels.record.node_record import A_SEQUENCE, AIDING
from node.kernels.string.encoder_step import (
    BEYOND,
    BEYOND_VAR,
    COUNT,
    EDGE_AT,
    NOW,
    RISING,
    SAMPLE,
    TIMED,
    encoder_step,
    new_encoder,
)
from sim.world.world import World

Array = npt.NDArray[np.float64]


def is_plain(world: World) -> bool:
    """Whether edges are timed, the head is never free of the string, and the drive has no sensor of its torque."""
    file = world.scenario.file
    rigid = file.torsion is None or file.node.torsion == "ignore"
    return file.encoder.edge_times and file.rough is None and rigid and not world.disc.is_freed


def measured_of(world: World) -> Array:
    """What the firmware of the encoder measures in every cycle, (cycles, AIDING), of a world that ``is_plain``."""
    ends, disc = world.ends, world.disc
    counts = disc.counts(ends)
    samples = np.zeros((len(ends), SAMPLE))
    samples[:, COUNT], samples[:, NOW] = counts, ends
    samples[:, RISING] = samples[:, TIMED] = 1.0  # the string turns one way
    samples[:, EDGE_AT] = np.minimum(disc.times_of(counts), ends)
    samples[ends <= world.motion.begin, EDGE_AT] = world.begin
    return aidings_of(world, samples, lambda cycle: disc.times_of(counts[cycle] - np.arange(1, EDGES)).tolist())


def aidings_of(world: World, samples: Array, edges_before: Callable[[int], Iterable[float]]) -> Array:
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
    measure(new_encoder(0, torque.drilling), drive_record(torque), samples, rows)
    if world.scenario.file.aiding.renumbered:
        rows[:, A_SEQUENCE] = np.arange(len(rows))
    return rows


@kernel
def measure(encoders: Array, drives: Array, samples: Array, rows: Array) -> None:
    """Every cycle of an encoder node: ``samples`` (cycles, SAMPLE) in, ``rows`` (cycles, AIDING) out."""
    for cycle in range(samples.shape[0]):
        encoder_step(encoders, drives, samples[cycle], rows[cycle])
