"""What a radio receives through soil, and how many packets that costs. Source: thesis, chapter on radio links."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from telemetry.radio.limits import SPEED_OF_LIGHT, Array, positive_values

TRANSMITTED: Final = 2.0  # dBm
THRESHOLD: Final = -103.0  # dBm, below which the thesis counts a link as lost
SENSITIVITY: Final = -110.0  # dBm, of the receiver's data sheet
WIDTH: Final = 1.0  # dB, of the packet error rate's step
DB_PER_NEPER: Final = 20.0 / math.log(10.0)
Logarithm = Callable[[Any], Any]


def propagation_constants(real: npt.ArrayLike, loss: npt.ArrayLike, frequency: npt.ArrayLike) -> tuple[Array, Array]:
    """Attenuation ``alpha`` (Np/m) and phase constant ``beta`` (rad/m) of a plane wave in a lossy dielectric.

    ``alpha, beta = omega sqrt(mu eps'/2 (sqrt(1 + (eps''/eps')^2) -+ 1))``, without magnetism.

    Parameters
    ----------
    real, loss : relative permittivity ``eps' - j eps''``
    frequency : Hz
    """
    e, f = np.asarray(real, float), np.asarray(frequency, float)
    tangent = np.asarray(loss, float) / e
    wave = math.tau * f / SPEED_OF_LIGHT * np.sqrt(0.5 * e)
    root = np.sqrt(1.0 + tangent * tangent)
    # root - 1 as a quotient: the difference would cancel for a small loss
    return np.asarray(wave * np.abs(tangent) / np.sqrt(root + 1.0)), np.asarray(wave * np.sqrt(root + 1.0))


def path_loss(alpha: npt.ArrayLike, beta: npt.ArrayLike, distance: npt.ArrayLike, log: Logarithm = np.log10) -> Array:
    """Loss (dB) over a distance: ``L = 6.4 + 20 log(d) + 20 log(beta) + 8.69 alpha d``.

    The spreading of free space is in it: with ``alpha = 0`` and ``beta = omega/c`` it is Friis's.

    Parameters
    ----------
    alpha, beta : Np/m, rad/m, see ``propagation_constants``
    distance : m
    log : log10; the figures in print follow with ``numpy.log``

    Raises
    ------
    RadioError
        For a distance that is not above zero.
    """
    d = positive_values("distance", distance, "m")
    return np.asarray(6.4 + 20.0 * log(d) + 20.0 * log(np.asarray(beta, float)) + 8.69 * np.asarray(alpha, float) * d)


def received_power(loss: npt.ArrayLike, transmitted: npt.ArrayLike = TRANSMITTED, gains: npt.ArrayLike = 0.0) -> Array:
    """Received power, dBm: ``P_r = P_t + G_t + G_r - L``; ``gains`` is the sum of both antennas', dB."""
    return np.asarray(np.asarray(transmitted, float) + np.asarray(gains, float) - np.asarray(loss, float))


def link_margin(power: npt.ArrayLike, threshold: npt.ArrayLike = THRESHOLD) -> Array:
    """Margin of a received power (dBm) over the threshold, dB."""
    return np.asarray(np.asarray(power, float) - np.asarray(threshold, float))


def packet_error_rate(margin_db: npt.ArrayLike, width: float = WIDTH) -> Array:
    """Probability that a packet is lost: logistic in the margin, one half at the threshold.

    ``PER = 1 / (1 + exp(margin / width))``; ``width`` in dB.

    Raises
    ------
    RadioError
        For a width that is not above zero.
    """
    w = positive_values("width", width, "dB")
    return np.asarray(np.exp(-np.logaddexp(0.0, np.asarray(margin_db, float) / w)))
