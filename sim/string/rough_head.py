"""What the encoder of a rough world measures in a run: the disc of the world, and the kernel of the encoder node."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from node.kernels.string.encoder_step import COUNT, EDGE_AT, NOW, RISING, SAMPLE, TIMED
from sim.string.head_measurements import measure_samples
from sim.world.random_streams import RandomStream, random_stream
from sim.world.rough_disc import RoughDisc
from sim.world.rough_section import RoughEncoderSection
from sim.world.world import World

Array = npt.NDArray[np.float64]


def measured_in_field(world: World, section: RoughEncoderSection, t: Array, head: Array) -> Array:
    """What the firmware of the encoder measures in every cycle, (cycles, AIDING).

    Readings that are off are as many and as far off as in the world, but drawn all at once.

    Parameters
    ----------
    section : of the scenario
    t, head : (n,) s and rad, grid of rig time and angle of the head
    """
    seed, ends, even = world.seed, world.ends, section.model_copy(update={"outliers": 0.0})
    disc = RoughDisc(even, t, head, world.begin, world.disc.errors, seed, zero=world.scenario.file.told.north)
    samples = np.zeros((len(ends), SAMPLE))
    samples[:, NOW], samples[:, TIMED] = ends, 1.0
    samples[:, [COUNT, EDGE_AT, RISING]] = disc.samples(ends)
    samples[:, COUNT] += outlier_counts(section, len(ends), math.tau / len(world.disc.errors), seed)
    return measure_samples(world, samples, lambda cycle: disc.sample(float(ends[cycle]))[3])


def outlier_counts(section: RoughEncoderSection, cycles: int, quantum: float, seed: int) -> Array:
    """Counts (cycles,) of ``quantum`` rad by which the readings are off."""
    random = random_stream(seed, RandomStream.ROUGH_OUTLIERS)
    off = random.random(cycles) < section.outliers
    return np.asarray(off * np.rint(math.radians(section.outlier_deg) / quantum * random.standard_normal(cycles)))
