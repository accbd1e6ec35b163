"""A pipe as a circular waveguide: modes, cut-off and the attenuation by the loss in its wall.

Source: thesis chapter on radio links; D. M. Pozar, Microwave Engineering (4th ed., 2012), section 3.4.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
import numpy.typing as npt

from telemetry.errors import RadioError
from telemetry.radio.limits import (
    IMPEDANCE,
    MAGNETIC_CONSTANT,
    SPEED_OF_LIGHT,
    Array,
    ModelRange,
    positive_values,
    values_within,
)
from telemetry.radio.path_loss import DB_PER_NEPER

HIGHEST: Final = 20  # index of a mode
FREQUENCY: Final = ModelRange(1e6, 1e12, 1e-9, "GHz")
RADIUS: Final = ModelRange(1e-4, 10.0, 100.0, "cm")


@dataclass(frozen=True, slots=True)
class WaveguideMode:
    """A mode of the guide: transverse electric or magnetic, with ``m`` periods around and ``n`` zeros across.

    Raises
    ------
    RadioError
        For indices that no mode has.
    """

    kind: Literal["TE", "TM"]
    m: int
    n: int

    def __post_init__(self) -> None:
        """Refuse an invalid mode."""
        if not (0 <= self.m <= HIGHEST and 1 <= self.n <= HIGHEST):
            raise RadioError(f"mode: expected m of 0..{HIGHEST} and n of 1..{HIGHEST}, got {self}")

    def __str__(self) -> str:
        return f"{self.kind}{self.m}{self.n}" if max(self.m, self.n) < 10 else f"{self.kind}{self.m},{self.n}"

    @classmethod
    def parse(cls, text: str) -> WaveguideMode:
        """Mode of a text such as TE11 or TM0,12.

        Raises
        ------
        RadioError
            When it is none.
        """
        found = re.fullmatch(r"(TE|TM)(?:(\d)(\d)|(\d{1,2}),(\d{1,2}))", text)
        if found is None:
            raise RadioError(f"mode: expected a name such as TE11 or TM01, got {text!r:.20}")
        kind: Literal["TE", "TM"] = "TE" if found[1] == "TE" else "TM"
        return cls(kind, int(found[2] or found[4]), int(found[3] or found[5]))

    @property
    def zero(self) -> float:
        """``x_mn``, the n-th zero of the Bessel function J_m (TM), or ``x'_mn``, of its derivative (TE)."""
        from scipy.special import jn_zeros, jnp_zeros

        return float((jnp_zeros if self.kind == "TE" else jn_zeros)(self.m, self.n)[-1])


TE11, TM01, TE21 = WaveguideMode("TE", 1, 1), WaveguideMode("TM", 0, 1), WaveguideMode("TE", 2, 1)
LOWEST: Final = (TE11, TM01, TE21)


def cut_off(mode: WaveguideMode, radius: npt.ArrayLike) -> Array:
    """Frequency (Hz) below which a mode does not propagate: ``f_c = x c / (2 pi a)``.

    Parameters
    ----------
    radius : m, of the bore

    Raises
    ------
    RadioError
        For a radius outside 0.1 mm..10 m.
    """
    return np.asarray(mode.zero * SPEED_OF_LIGHT / (math.tau * values_within("radius", radius, RADIUS)))


def surface_resistance(resistivity: npt.ArrayLike, frequency: npt.ArrayLike) -> Array:
    """Resistance (ohm) of a metal's surface: ``R_s = sqrt(pi f mu rho)`` (ohm m, Hz), without magnetism."""
    rho = positive_values("resistivity", resistivity, "ohm m")
    return np.asarray(np.sqrt(math.pi * MAGNETIC_CONSTANT * np.asarray(frequency, float) * rho))


def wall_attenuation(
    mode: WaveguideMode, radius: npt.ArrayLike, frequency: npt.ArrayLike, resistivity: npt.ArrayLike
) -> Array:
    """Attenuation of a mode by its wall, Np/m.

    ``alpha_TE = R_s/(a eta) ((f_c/f)^2 + m^2/(x'^2 - m^2)) / sqrt(1 - (f_c/f)^2)``,
    ``alpha_TM = R_s/(a eta) / sqrt(1 - (f_c/f)^2)``.

    Parameters
    ----------
    radius : m
    frequency : Hz, above the cut-off
    resistivity : ohm m, of the wall

    Raises
    ------
    RadioError
        With the valid range; below the cut-off nothing propagates.
    """
    a, f = values_within("radius", radius, RADIUS), values_within("frequency", frequency, FREQUENCY)
    lowest = cut_off(mode, a)
    given, needed = np.broadcast_arrays(f, lowest)
    below = given <= needed
    if below.any():
        raise RadioError(
            f"frequency: expected more than {needed[below][0] * 1e-9:.3f} GHz, the cut-off of {mode} in this pipe, "
            f"got {given[below][0] * 1e-9:g}; below it nothing propagates"
        )
    ratio = (lowest / f) ** 2
    around = 1.0 if mode.kind == "TM" else ratio + mode.m**2 / (mode.zero**2 - mode.m**2)
    return np.asarray(surface_resistance(resistivity, f) / (a * IMPEDANCE) * around / np.sqrt(1.0 - ratio))


def nepers_to_decibels(nepers: npt.ArrayLike) -> Array:
    """Attenuation in dB/m of one in Np/m."""
    return np.asarray(DB_PER_NEPER * np.asarray(nepers, float))


def link_reach(attenuation_db: npt.ArrayLike, budget_db: npt.ArrayLike) -> Array:
    """Distance (m) over which an attenuation (dB/m) uses up a link budget (dB).

    Raises
    ------
    RadioError
        For a budget or an attenuation that is not above zero.
    """
    return np.asarray(
        positive_values("budget", budget_db, "dB") / positive_values("attenuation", attenuation_db, "dB/m")
    )
