"""What a gyroscope that keeps more than the mean of a cycle tells of its eighths."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from node.kernels.arithmetic.formats import PERIOD
from node.kernels.record.filter_record import PARTS
from sim.world.scenario_file import GyroSection

Array = npt.NDArray[np.float64]


def borders_of(ends: Array) -> Array:
    """Rig times (n, 9) of the borders of the eighths of cycles that end at ``ends`` (n,), s."""
    return np.asarray(ends[:, None] + PERIOD * (np.arange(-PARTS, 1) / PARTS))


def eighths(mean: Array, turned: Array, gyroscope: GyroSection, random: np.random.Generator) -> Array:
    """Rates about z (n, 9, rad/s) as a driver tells them: 0, for nothing is shown of the cycle before, and the eighths.

    They are as exact as the mean is, with the noise of their band.

    Their noise is white and its mean is that of the cycle, which ``mean`` has already.

    Parameters
    ----------
    mean : (n,) rad/s, readings of the cycles
    turned : (n, 8) rad, that the z axis of a gyroscope without noise and bias shows of each eighth
    gyroscope : its noise
    random : of the noise
    """
    white = math.radians(gyroscope.noise_dps_rthz[2]) / math.sqrt(PERIOD / PARTS)
    apart = turned * (PARTS / PERIOD) + white * random.standard_normal(turned.shape)
    own = mean[:, None] + apart - apart.mean(axis=1, keepdims=True)
    return np.concatenate([np.zeros((len(mean), 1)), own], axis=1)
