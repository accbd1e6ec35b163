"""Correction of raw readings by the parameters of a node, in the cycle, before anything else sees them."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from node.kernels.arithmetic.formats import Array
from node.kernels.arithmetic.jit import kernel
from node.kernels.arithmetic.operations import are_numbers, is_number, over_factor, times_factor
from node.kernels.arithmetic.quantity import ONE, temperature_quantity
from node.kernels.record.sensor_record import PARAMETERS

COLDEST: Final = temperature_quantity(-20.0)  # C; beyond the polynomials are not followed
HOTTEST: Final = temperature_quantity(85.0)
USUAL: Final = temperature_quantity(25.0)  # C, of a reading that carries no temperature


def identity_parameters() -> Array:
    """Parameters of a node before any upload, one record of dtype ``PARAMETERS``: readings stay as they are."""
    made = np.zeros(1, PARAMETERS)
    made["identity"] = 1
    for sensor in ("gyroscope", "accelerometer"):
        made[0][sensor]["matrix"][0] = np.eye(3)
        made[0][sensor]["reference"] = USUAL
    return made


@kernel
def cubic_polynomial(c0: float, c1: float, c2: float, c3: float, x: float) -> float:
    """c0 + c1 x + c2 x^2 + c3 x^3, by Horner's scheme."""
    return times_factor(times_factor(times_factor(c3, x) + c2, x) + c1, x) + c0


@kernel
def correct_sensor(sensor: Any, temperature: float, reading: Array) -> None:
    """Replace a raw ``reading`` (3) by w = M(T)^-1 (G - b(T)), solved by Cramer's rule.

    Parameters
    ----------
    sensor : record of one sensor of ``PARAMETERS``
    temperature : C, within COLDEST..HOTTEST
    reading : (3,) rad/s or m/s^2, in place

    Source: thesis eq. 3.1 and Table III.2 (model), docs/decisions/0009-parameter-blocks.md (temperature).
    """
    m, c, b = sensor.m, sensor.matrix, sensor.bias
    x = temperature - sensor.reference
    for i in range(3):
        reading[i] -= cubic_polynomial(b[0, i], b[1, i], b[2, i], b[3, i], x)
        for j in range(3):
            m[i, j] = cubic_polynomial(c[0, i, j], c[1, i, j], c[2, i, j], c[3, i, j], x)
    a0 = times_factor(m[1, 1], m[2, 2]) - times_factor(m[1, 2], m[2, 1])
    a1 = times_factor(m[1, 2], m[2, 0]) - times_factor(m[1, 0], m[2, 2])
    a2 = times_factor(m[1, 0], m[2, 1]) - times_factor(m[1, 1], m[2, 0])
    scale = over_factor(ONE, times_factor(m[0, 0], a0) + times_factor(m[0, 1], a1) + times_factor(m[0, 2], a2))
    g0, g1, g2 = reading[0], reading[1], reading[2]
    b1 = times_factor(m[0, 2], m[2, 1]) - times_factor(m[0, 1], m[2, 2])
    b2 = times_factor(m[0, 0], m[2, 2]) - times_factor(m[0, 2], m[2, 0])
    b3 = times_factor(m[0, 1], m[2, 0]) - times_factor(m[0, 0], m[2, 1])
    c1 = times_factor(m[0, 1], m[1, 2]) - times_factor(m[0, 2], m[1, 1])
    c2 = times_factor(m[0, 2], m[1, 0]) - times_factor(m[0, 0], m[1, 2])
    c3 = times_factor(m[0, 0], m[1, 1]) - times_factor(m[0, 1], m[1, 0])
    reading[0] = times_factor(times_factor(g0, a0) + times_factor(g1, b1) + times_factor(g2, c1), scale)
    reading[1] = times_factor(times_factor(g0, a1) + times_factor(g1, b2) + times_factor(g2, c2), scale)
    reading[2] = times_factor(times_factor(g0, a2) + times_factor(g1, b3) + times_factor(g2, c3), scale)


@kernel
def correct_cycle(parameters: Any, temperature: float, rate: Array, force: Array) -> None:
    """Correct one cycle's raw ``rate`` (3, rad/s) and ``force`` (3, m/s^2) in place; the identity touches no bit.

    A reading with a non-finite component is left as it is.

    Parameters
    ----------
    parameters : record of dtype ``PARAMETERS``
    temperature : C; a non-finite one counts as ``USUAL``
    """
    if parameters.identity == 1 or not are_numbers(rate, force):
        return
    usual = temperature if is_number(temperature) else USUAL
    kept = min(max(usual, COLDEST), HOTTEST)
    correct_sensor(parameters.gyroscope, kept, rate)
    correct_sensor(parameters.accelerometer, kept, force)
