"""What a gyroscope that keeps more than the mean of a cycle tells of its eighths."""

from __future__ import annotations

import math

import numpy as np

from node.kernels.arithmetic.formats import PERIOD
from node.kernels.record.filter_record import PARTS
from sim.world.disturbance.row import ActsOn, Array, Disturbance, OneImu
from sim.world.random_streams import RandomStream


def borders_of(ends: Array) -> Array:
    """Rig times (n, 9) of the borders of the eighths of cycles that end at ``ends`` (n,), s."""
    return np.asarray(ends[:, None] + PERIOD * (np.arange(-PARTS, 1) / PARTS))


def rates_of_eighths(mean: Array, turned: Array, imu: OneImu) -> Array:
    """Rates about z (n, 9, rad/s) as a driver tells them: 0, for nothing is shown of the cycle before, and the eighths.

    They are as exact as the mean is. Their noise is white, of their band, and its mean is that of the cycle, which
    ``mean`` has already.

    Parameters
    ----------
    mean : (n,) rad/s, readings of the cycles
    turned : (n, 8) rad, that the z axis of a gyroscope without noise and bias shows of each eighth
    """
    density = imu.noise * imu.file.gyroscope.noise_dps_rthz[2]
    white = math.radians(density) / math.sqrt(PERIOD / PARTS)
    noise = imu.random(RandomStream.INCREMENTS).standard_normal(turned.shape)
    apart = turned * (PARTS / PERIOD) + white * noise
    own = mean[:, None] + apart - apart.mean(axis=1, keepdims=True)
    return np.concatenate([np.zeros((len(mean), 1)), own], axis=1)


EIGHTHS = Disturbance("eighths", ("gyroscope.increments",), ActsOn.TAKING)
