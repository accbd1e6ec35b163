"""Dielectric of moist soil, 0.3 to 1.3 GHz, from its texture, density, water and temperature.

Source: N. R. Peplinski, F. T. Ulaby and M. C. Dobson, "Dielectric properties of soils in the 0.3-1.3-GHz range", IEEE
Trans. Geosci. Remote Sens. 33 (1995) 803-807, with its correction in the same volume, p. 1340. It was fitted to five
soils from sandy loam (51 % sand, 13 % clay) to silty clay (5 % sand, 47 % clay); other textures extrapolate.
"""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from telemetry.errors import RadioError
from telemetry.radio.limits import ELECTRIC_CONSTANT, Array, ModelRange, values_within

FREQUENCY: Final = ModelRange(0.3e9, 1.3e9, 1e-9, "GHz")
FRACTION: Final = ModelRange(0.0, 1.0)
WATER: Final = ModelRange(0.0, 1.0)
DENSITY: Final = ModelRange(0.5, 2.6, 1.0, "g/cm^3")
TEMPERATURE: Final = ModelRange(0.0, 40.0, 1.0, "C")
SOLID_DENSITY: Final = 2.66  # g/cm^3, rho_s of the model
SHAPE: Final = 0.65  # alpha of the model
WATER_INFINITE: Final = 4.9  # permittivity of free water at frequencies far above its relaxation
LEAST_WATER: Final = 1e-9  # the conductivity of dry soil has the water in its denominator


class PorosityWarning(UserWarning):
    """More water than the soil has room for: the model answers, no soil does."""


@dataclass(frozen=True, slots=True)
class Soil:
    """A soil; each value a number or an array.

    Parameters
    ----------
    sand, clay : mass fractions of the solids, together at most 1; the rest is silt
    bulk_density : g/cm^3, of the dry soil
    water : volume of water over volume of soil, 0..1 (VWC)
    temperature : C, of its water
    """

    sand: npt.ArrayLike
    clay: npt.ArrayLike
    bulk_density: npt.ArrayLike = 1.5
    water: npt.ArrayLike = 0.25
    temperature: npt.ArrayLike = 20.0

    @property
    def porosity(self) -> Array:
        """Share of the soil's volume that water can fill."""
        return np.asarray(1.0 - np.asarray(self.bulk_density, float) / SOLID_DENSITY)


def soil_permittivity(soil: Soil, frequency: npt.ArrayLike) -> tuple[Array, Array]:
    """Relative permittivity of a soil, real part and loss: ``eps = eps' - j eps''``.

    ``eps' = 1.15 (1 + rho_b/rho_s (eps_s^a - 1) + m^b' eps'_fw^a - m)^(1/a) - 0.68``,
    ``eps'' = (m^b'' eps''_fw^a)^(1/a)``.
    Where the fit gives sand a conductivity below zero it is taken as zero.

    Parameters
    ----------
    soil : values that broadcast with each other and with ``frequency``
    frequency : Hz, 0.3e9..1.3e9

    Raises
    ------
    RadioError
        With the valid range, for a value outside the model. Water beyond the porosity warns (``PorosityWarning``).
    """
    f = values_within("frequency", frequency, FREQUENCY)
    sand, clay = values_within("sand", soil.sand, FRACTION), values_within("clay", soil.clay, FRACTION)
    if np.any(sand + clay > 1.0 + 1e-9):
        raise RadioError(f"sand and clay: expected fractions of at most 1 together, got {np.max(sand + clay):g}")
    density = values_within("bulk density", soil.bulk_density, DENSITY)
    water = values_within("water", soil.water, WATER)
    _warn_beyond_porosity(water, density)
    water = np.maximum(water, LEAST_WATER)
    conductivity = np.maximum(0.0467 + 0.2204 * density - 0.4111 * sand + 0.6614 * clay, 0.0)
    water_real, water_loss = water_permittivity(f, soil.temperature)
    water_loss = water_loss + conductivity / (math.tau * ELECTRIC_CONSTANT * f) * (
        (SOLID_DENSITY - density) / (SOLID_DENSITY * water)
    )
    solid = (1.01 + 0.44 * SOLID_DENSITY) ** 2 - 0.062
    of_real, of_loss = 1.2748 - 0.519 * sand - 0.152 * clay, 1.33797 - 0.603 * sand - 0.166 * clay
    mixed = 1.0 + density / SOLID_DENSITY * (solid**SHAPE - 1.0) + water**of_real * water_real**SHAPE - water
    real = 1.15 * mixed ** (1.0 / SHAPE) - 0.68
    loss = water ** (of_loss / SHAPE) * water_loss
    return np.asarray(real), np.asarray(loss)


def water_permittivity(frequency: npt.ArrayLike, temperature: npt.ArrayLike) -> tuple[Array, Array]:
    """Relative permittivity of free water by Debye, real part and loss, without conductivity.

    ``eps_w = e_inf + (e_0 - e_inf) / (1 + j f t)``; static value ``e_0`` and ``t`` (2 pi times the relaxation time, s)
    as polynomials of the temperature. Source: Ulaby, Moore and Fung, Microwave Remote Sensing III (1986), appendix E.2.

    Parameters
    ----------
    frequency : Hz
    temperature : C, 0..40

    Raises
    ------
    RadioError
        For a temperature outside the fit.
    """
    c = values_within("temperature", temperature, TEMPERATURE)
    static = 88.045 + c * (-0.4147 + c * (6.295e-4 + c * 1.075e-5))
    relaxation = 1.1109e-10 + c * (-3.824e-12 + c * (6.938e-14 - c * 5.096e-16))
    x = np.asarray(frequency, float) * relaxation
    span = (static - WATER_INFINITE) / (1.0 + x * x)
    return np.asarray(WATER_INFINITE + span), np.asarray(x * span)


def _warn_beyond_porosity(water: Array, density: Array) -> None:
    porosity = 1.0 - density / SOLID_DENSITY
    excess = water - porosity
    if np.any(excess > 1e-9):
        k = np.unravel_index(np.argmax(excess), excess.shape)
        wet, room = np.broadcast_arrays(water, porosity)
        warnings.warn(
            f"water: a soil of this density holds at most {100.0 * room[k]:.0f} % by volume (its porosity), "
            f"got {100.0 * wet[k]:.0f} %; the model goes on, no soil does",
            PorosityWarning,
            stacklevel=3,
        )
